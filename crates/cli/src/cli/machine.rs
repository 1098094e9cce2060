//! Properties of this machine.

pub(super) use turbid::memory::in_bytes;
use turbid::memory::kilobytes;

/// Total memory (bytes), if known.
pub(super) fn memory() -> Option<f64> {
    meminfo("MemTotal:")
}

/// Memory available to a new process (bytes), if known.
pub(super) fn memory_available() -> Option<f64> {
    meminfo("MemAvailable:")
}

fn meminfo(key: &str) -> Option<f64> {
    kilobytes(&std::fs::read_to_string("/proc/meminfo").ok()?, key)
}

/// Cores that this process may use.
pub(super) fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

/// The system's setting for transparent huge pages: `always`, `madvise` or `never`.
pub(super) fn huge_pages() -> Option<String> {
    let text = std::fs::read_to_string("/sys/kernel/mm/transparent_hugepage/enabled").ok()?;
    let chosen = text.split_once('[')?.1.split_once(']')?.0;
    Some(chosen.to_string())
}

/// Seconds in words.
pub(super) fn in_time(seconds: f64) -> String {
    match seconds {
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s if s < 172_800.0 => format!("{:.1} h", s / 3600.0),
        s => format!("{:.1} days", s / 86_400.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_read_well_over_many_orders() {
        assert_eq!(in_time(0.4), "0 s");
        assert_eq!(in_time(90.0), "90 s");
        assert_eq!(in_time(600.0), "10 min");
        assert_eq!(in_time(9000.0), "2.5 h");
        assert_eq!(in_time(864_000.0), "10.0 days");
    }
}
