//! What is no regular file, what has no end, and what is of somebody else: never waited for, never quoted.

use super::{CASE, refused, turbid};
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
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    std::fs::write(place.join("case.toml"), CASE).unwrap();
    for end in ["stl", "obj", "txt", "toml"] {
        fifo(&place.join(format!("fifo.{end}")));
        std::fs::create_dir(place.join(format!("folder.{end}"))).unwrap();
        std::os::unix::fs::symlink("/dev/zero", place.join(format!("device.{end}"))).unwrap();
    }
    folder
}

/// A study that shows a file of references, which it reads before anything has run.
fn with_table(file: &str) -> String {
    format!(
        "title = \"x\"\ncase = \"case.toml\"\n[[table]]\nname = \"t\"\ntitle = \"t\"\nrows = []\n\
         columns = [{{ label = \"r\", reference = {{ csv = \"{file}\", y = \"u\" }} }}]\n"
    )
}

#[test]
fn fifos_devices_and_folders_are_refused_wherever_a_file_is_read() {
    let folder = folder();
    for (name, kind) in [
        ("fifo", "a FIFO"),
        ("device", "a device"),
        ("folder", "a directory"),
    ] {
        let words = [name, kind, "not a regular file"];
        for end in ["stl", "obj"] {
            let shape = format!("particles.0.shape={{ mesh = {{ file = \"{name}.{end}\" }} }}");
            refused(folder.path(), &["check", "case.toml", "--set", &shape], &words);
        }
        let list = format!("particles.0.file=\"{name}.txt\"");
        refused(folder.path(), &["check", "case.toml", "--set", &list], &words);
        refused(folder.path(), &["check", &format!("{name}.toml")], &words);
        refused(
            folder.path(),
            &["study", "--list", &format!("{name}.toml")],
            &words,
        );
        let study = format!("title = \"x\"\ncase = \"{name}.toml\"\n");
        std::fs::write(folder.path().join("study.toml"), study).unwrap();
        refused(folder.path(), &["study", "--list", "study.toml"], &[name]);
        let study = with_table(&format!("{name}.txt"));
        std::fs::write(folder.path().join("study.toml"), study).unwrap();
        refused(folder.path(), &["study", "--list", "study.toml"], &words);
    }
}

#[test]
fn a_file_that_is_too_large_is_refused_unread_with_the_limit() {
    let folder = folder();
    for (name, limit) in [
        ("large.stl", "256 MiB"),
        ("large.txt", "1024 MiB"),
        ("large.toml", "16 MiB"),
    ] {
        let file = std::fs::File::create(folder.path().join(name)).unwrap();
        file.set_len(1 << 40).unwrap();
        let arguments = match name {
            "large.stl" => vec![
                "case.toml",
                "--set",
                "particles.0.shape={ mesh = { file = \"large.stl\" } }",
            ],
            "large.txt" => vec!["case.toml", "--set", "particles.0.file=\"large.txt\""],
            _ => vec![name],
        };
        refused(
            folder.path(),
            &[&["check"], &arguments[..]].concat(),
            &[name, "larger than", limit],
        );
    }
}

#[test]
fn a_message_quotes_no_more_than_a_word_of_a_file_that_is_of_somebody_else() {
    let folder = folder();
    let place = folder.path();
    for name in ["secret.txt", "secret.stl", "secret.obj", "secret"] {
        std::fs::write(place.join(name), SECRET).unwrap();
    }
    std::fs::write(place.join("solid.stl"), format!("solid x\n{SECRET}")).unwrap();
    std::fs::write(place.join("study.toml"), "title = \"x\"\ncase = \"secret\"\n").unwrap();
    std::fs::write(place.join("table.toml"), with_table("secret.txt")).unwrap();
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
        let output = turbid(place, arguments);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}\n{said}");
        for word in ["/bin/bash", "and_more", "next:line"] {
            assert!(!said.contains(word), "{arguments:?}: `{word}` is in\n{said}");
        }
    }
    refused(
        place,
        &["check", "secret"],
        &["this is no case of turbid", "domain"],
    );
}

#[test]
fn what_a_file_says_commands_no_terminal() {
    let folder = folder();
    std::fs::write(folder.path().join("esc.txt"), "x,\u{1b}]0;owned\u{7}\n1,2\n").unwrap();
    let list = ["check", "case.toml", "--set", "particles.0.file=\"esc.txt\""];
    let esc = CASE.replace("density = 1000.0", "\"den\u{7f}\\u001b[2J\" = 1000.0");
    std::fs::write(folder.path().join("esc.toml"), esc).unwrap();
    for arguments in [&list[..], &["check", "esc.toml"], &["check", "\u{1b}[2J.toml"]] {
        let output = turbid(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2));
        let odd = |byte: &u8| *byte < 32 && *byte != b'\n' || *byte == 127;
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.stderr.iter().any(odd), "{said:?}");
    }
}
