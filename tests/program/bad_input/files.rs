//! Files that are not regular, that have no end, or that are of somebody else: never waited for, never quoted.

use crate::common::Place;
use crate::common::case::SPHERES;
use std::ffi::CString;
use std::path::Path;

const SECRET: &str =
    "root:x:0:0:hidden_words:/root:/bin/bash and_more_of_the_line\nnext:line:of:the:secret\n";

fn fifo(path: &Path) {
    let name = CString::new(path.to_str().unwrap()).unwrap();
    // SAFETY: a path that ends with a zero byte.
    assert_eq!(unsafe { libc::mkfifo(name.as_ptr(), 0o600) }, 0);
}

/// A folder with a good case, and a FIFO, a device and a folder under the names of all kinds of files.
fn place() -> Place {
    let place = Place::new(SPHERES);
    for end in ["stl", "obj", "txt", "toml"] {
        fifo(&place.path(format!("fifo.{end}")));
        std::fs::create_dir(place.path(format!("folder.{end}"))).unwrap();
        std::os::unix::fs::symlink("/dev/zero", place.path(format!("device.{end}"))).unwrap();
    }
    place
}

/// A study that shows a file of references, which it reads before anything has run.
fn with_table(file: &str) -> String {
    format!(
        "title = \"x\"\ncase = \"case.toml\"\n[[table]]\nname = \"t\"\ntitle = \"t\"\nrows = []\n\
         columns = [{{ label = \"r\", y = \"mach\", reference = {{ csv = \"{file}\", y = \"u\" }} }}]\n"
    )
}

#[test]
fn fifos_devices_and_folders_are_refused_wherever_a_file_is_read() {
    let place = place();
    for (name, kind) in [("fifo", "a FIFO"), ("device", "a device"), ("folder", "a directory")] {
        let words = [name, kind, "not a regular file"];
        for end in ["stl", "obj"] {
            let shape = format!("particles.0.shape={{ mesh = {{ file = \"{name}.{end}\" }} }}");
            place.refused(&["check", "case.toml", "--set", &shape], &words);
        }
        let list = format!("particles.0.file=\"{name}.txt\"");
        place.refused(&["check", "case.toml", "--set", &list], &words);
        place.refused(&["check", &format!("{name}.toml")], &words);
        place.refused(&["study", "--list", &format!("{name}.toml")], &words);
        let study = format!("title = \"x\"\ncase = \"{name}.toml\"\n");
        place.write("study.toml", study);
        place.refused(&["study", "--list", "study.toml"], &[name]);
        let study = with_table(&format!("{name}.txt"));
        place.write("study.toml", study);
        place.refused(&["study", "--list", "study.toml"], &words);
    }
}

#[test]
fn a_file_that_is_too_large_is_refused_unread_with_the_limit() {
    let place = place();
    for (name, limit) in [("large.stl", "256 MiB"), ("large.txt", "1024 MiB"), ("large.toml", "16 MiB")] {
        let file = std::fs::File::create(place.path(name)).unwrap();
        file.set_len(1 << 40).unwrap();
        let arguments = match name {
            "large.stl" => {
                vec!["case.toml", "--set", "particles.0.shape={ mesh = { file = \"large.stl\" } }"]
            }
            "large.txt" => vec!["case.toml", "--set", "particles.0.file=\"large.txt\""],
            _ => vec![name],
        };
        place.refused(&[&["check"], &arguments[..]].concat(), &[name, "larger than", limit]);
    }
}

#[test]
fn a_message_quotes_no_more_than_a_word_of_a_file_that_is_of_somebody_else() {
    let place = place();
    for name in ["secret.txt", "secret.stl", "secret.obj", "secret"] {
        place.write(name, SECRET);
    }
    place.write("solid.stl", format!("solid x\n{SECRET}"));
    place.write("study.toml", "title = \"x\"\ncase = \"secret\"\n");
    place.write("table.toml", with_table("secret.txt"));
    let mesh = |name: &str| format!("particles.0.shape={{ mesh = {{ file = \"{name}\" }} }}");
    let commands: [&[&str]; 8] = [
        &["check", "secret"],
        &["study", "secret"],
        &["study", "study.toml", "--list"],
        &["study", "table.toml", "--list"],
        &["check", "case.toml", "--set", "particles.0.file=\"secret.txt\""],
        &["check", "case.toml", "--set", &mesh("secret.stl")],
        &["check", "case.toml", "--set", &mesh("secret.obj")],
        &["check", "case.toml", "--set", &mesh("solid.stl")],
    ];
    for arguments in commands {
        let output = place.output(arguments);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}\n{said}");
        for word in ["/bin/bash", "and_more", "next:line"] {
            assert!(!said.contains(word), "{arguments:?}: `{word}` is in\n{said}");
        }
    }
    place.refused(&["check", "secret"], &["this is no case of turbid", "domain"]);
}

#[test]
fn what_a_file_says_commands_no_terminal() {
    let place = place();
    place.write("esc.txt", "x,\u{1b}]0;owned\u{7}\n1,2\n");
    let list = ["check", "case.toml", "--set", "particles.0.file=\"esc.txt\""];
    let esc = SPHERES.replace("density = 1000.0", "\"den\u{7f}\\u001b[2J\" = 1000.0");
    place.write("esc.toml", esc);
    for arguments in [&list[..], &["check", "esc.toml"], &["check", "\u{1b}[2J.toml"]] {
        let output = place.output(arguments);
        assert_eq!(output.status.code(), Some(2));
        let odd = |byte: &u8| *byte < 32 && *byte != b'\n' || *byte == 127;
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.stderr.iter().any(odd), "{said:?}");
    }
}
