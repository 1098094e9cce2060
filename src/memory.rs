//! Memory: allocations that may fail, and the limits of a process: those of the machine, or less if a control group or a limit of
//! the process says so.

use std::fs;
use std::path::Path;
pub use turbid_core::memory::*;

/// Memory limit of one process, and its origin.
#[derive(Clone, Debug, PartialEq)]
pub struct Room {
    /// Limit (bytes).
    pub bytes: f64,
    /// The limit in words, e.g. "this machine has 16.0 GB".
    pub limit: String,
    /// True if it holds for each process by itself; else all of the machine have it in common.
    pub each: bool,
}

/// The limits of this process, if the system reports any.
pub fn rooms() -> Vec<Room> {
    let read = |path: &str| fs::read_to_string(path).unwrap_or_default();
    let machine = kilobytes(&read("/proc/meminfo"), "MemTotal:").map(|bytes| Room {
        limit: format!("this machine has {}", in_bytes(bytes)),
        bytes,
        each: false,
    });
    let group = group(&read("/proc/self/cgroup"), Path::new("/sys/fs/cgroup"));
    let own = address_space(&read("/proc/self/limits"));
    [machine, group, own].into_iter().flatten().collect()
}

/// Memory that this process can still get (bytes), at most; infinite if the system reports nothing.
pub fn left() -> f64 {
    let free = kilobytes(&fs::read_to_string("/proc/meminfo").unwrap_or_default(), "MemAvailable:");
    rooms().iter().map(|room| room.bytes).chain(free).fold(f64::INFINITY, f64::min)
}

/// A line of `/proc/meminfo` (bytes).
pub fn kilobytes(meminfo: &str, key: &str) -> Option<f64> {
    let line = meminfo.lines().find(|line| line.starts_with(key))?;
    let kilobytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(1024.0 * kilobytes)
}

/// The least that the control group of `/proc/self/cgroup` or one above it grants, of version 2 or 1. In a container
/// the groups above its own, and its own name, may be hidden; then the files at the root are its own.
fn group(groups: &str, root: &Path) -> Option<Room> {
    let mut least: Option<Room> = None;
    for line in groups.lines() {
        let mut fields = line.splitn(3, ':').skip(1);
        let (controllers, path) = (fields.next()?, fields.next()?);
        let (tops, file) = match controllers {
            "" => ([root.to_path_buf(), root.join("unified")], "memory.max"),
            _ if controllers.split(',').any(|name| name == "memory") => {
                ([root.join("memory"), root.join(controllers)], "memory.limit_in_bytes")
            }
            _ => continue,
        };
        let path = Path::new(path.trim_start_matches('/'));
        for file in tops.iter().flat_map(|top| path.ancestors().map(|path| top.join(path).join(file))) {
            // "max" is no limit.
            let read = fs::read_to_string(&file).ok();
            let bytes: Option<f64> = read.and_then(|text| text.trim().parse().ok());
            if let Some(bytes) = bytes.filter(|&bytes| least.as_ref().is_none_or(|room| bytes < room.bytes)) {
                let (amount, file) = (in_bytes(bytes), file.display());
                least = Some(Room {
                    bytes,
                    limit: format!("the control group of this process grants {amount} ({file})"),
                    each: false,
                });
            }
        }
    }
    least
}

/// The soft limit of the address space in `/proc/self/limits`.
fn address_space(limits: &str) -> Option<Room> {
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    let bytes: f64 = line.split_whitespace().next()?.parse().ok()?;
    Some(Room { bytes, limit: format!("this process may have {} (ulimit -v)", in_bytes(bytes)), each: true })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder with files of these contents.
    fn tree(files: &[(&str, &str)]) -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        for (path, content) in files {
            let path = root.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, content).unwrap();
        }
        root
    }

    fn granted(groups: &str, files: &[(&str, &str)]) -> Option<f64> {
        group(groups, tree(files).path()).map(|room| room.bytes)
    }

    #[test]
    fn the_least_limit_of_a_group_and_those_above_it_counts_in_both_versions() {
        let unified = [
            ("memory.max", "max\n"),
            ("job/memory.max", "3000000000\n"),
            ("job/step/memory.max", "max\n"),
            ("other/memory.max", "1\n"),
        ];
        assert_eq!(granted("0::/job/step\n", &unified), Some(3e9));
        assert_eq!(granted("0::/\n", &unified), None, "\"max\" is no limit");
        let hybrid = [
            ("memory/memory.limit_in_bytes", "9223372036854771712\n"),
            ("memory/a/memory.limit_in_bytes", "5000000000\n"),
            ("memory/a/b/memory.limit_in_bytes", "4000000000\n"),
            ("unified/memory.max", "6000000000\n"),
        ];
        let groups = "5:cpu,cpuacct:/x\n4:memory:/a/b\n1:name=systemd:/other\n0::/\n";
        assert_eq!(granted(groups, &hybrid), Some(4e9));
    }

    #[test]
    fn in_a_container_that_does_not_see_its_own_group_the_limit_at_the_root_counts() {
        let root = [("memory.max", "2000000000\n")];
        assert_eq!(granted("0::/docker/0123\n", &root), Some(2e9));
        assert_eq!(granted("0::/../..\n", &root), Some(2e9));
        let root = [("memory/memory.limit_in_bytes", "2000000000\n")];
        assert_eq!(granted("4:memory:/docker/0123\n", &root), Some(2e9));
        assert_eq!(granted("", &[]), None);
    }

    #[test]
    fn the_address_space_and_the_memory_of_the_machine_are_read_as_the_system_writes_them() {
        let limits = "Limit                     Soft Limit           Hard Limit           Units     \n\
                      Max resident set          unlimited            unlimited            bytes     \n\
                      Max address space         512000000            unlimited            bytes     \n";
        let room = address_space(limits).unwrap();
        assert_eq!((room.bytes, room.each), (512e6, true));
        assert_eq!(room.limit, "this process may have 512 MB (ulimit -v)");
        assert_eq!(address_space(&limits.replace("512000000", "unlimited")), None);
        assert_eq!(kilobytes("MemTotal:  2000 kB\nMemFree: 1 kB\n", "MemTotal:"), Some(2048e3));
        assert!(!rooms().is_empty());
    }
}
