use super::*;
use crate::output::pieces;

#[test]
fn an_earlier_run_is_cleared_and_foreign_files_stay() {
    let root = tempfile::tempdir().unwrap();
    let directory = root.path().join("a/b");
    create(&directory).unwrap();
    let files = OutputFiles::new(&directory);
    let own = [
        files.summary(),
        files.series(),
        files.settling_plot(),
        files.collection(FIELDS),
        files.collection(PARTICLES),
        files.file(FIELDS, 3),
        files.file(PARTICLES, 12_345_678_901),
        files.collection(SURFACES),
        files.file(SURFACES, 12),
        PICTURES.named_file(&directory, "my-view_2", 0),
        files.particle_series(),
        files.collection(CONTACTS),
        files.file(CONTACTS, 3),
        files.collection(FORCE_CHAINS),
        files.file(FORCE_CHAINS, 3),
        files.walls(),
        files.file(FIELDS, 4).with_extension("vti.tmp"),
        pieces::index(&files.file(FIELDS, 5)),
        pieces::piece(&files.file(FIELDS, 5), 0),
        pieces::piece(&files.file(FIELDS, 5), 12_345).with_extension("vti.tmp"),
        pieces::index(&files.file(CONTACTS, 5)),
        pieces::piece(&files.file(CONTACTS, 5), 1),
        pieces::piece(&files.file(CONTACTS, 6), 1),
    ];
    let foreign = [
        directory.join("notes.txt"),
        directory.join("fields/fields_best.vti"),
        directory.join("pictures/best_1.png"),
        directory.join("pictures/0000000001.png"),
        directory.join("pictures/photo_20260101120000.png"),
        directory.join("pictures/photo_00000000001.png"),
        files.script(),
        directory.join("particles/fields_0000000001.vti"),
        directory.join("summary.json.bak"),
        directory.join("contacts/contacts_0000000006/notes.txt"),
        directory.join("contacts/contacts_best/contacts_best_p00001.vtp"),
        directory.join("fields/fields_0000000005.pvtp"),
    ];
    for path in own.iter().chain(&foreign) {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "x").unwrap();
    }
    for name in ["step-0000000100", "step-0000000200.partial", "step-0000000100.replaced", "mine"] {
        fs::create_dir_all(files.checkpoints().join(name)).unwrap();
    }
    create(&directory).unwrap();
    let summary = files.summary();
    assert!(summary.exists(), "a run may be refused yet");
    clear(&directory, &[]).unwrap();
    for path in own {
        assert!(!path.exists(), "{} is stale", path.display());
    }
    for path in foreign {
        assert!(path.exists(), "{} is not ours", path.display());
    }
    assert!(!directory.join("fields/fields_0000000005").exists(), "an empty folder");
    let left = fs::read_dir(&directory).unwrap().count();
    assert_eq!(left, 10, "eight folders, three foreign files, no probe");
    let left: Vec<_> = fs::read_dir(files.checkpoints()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left, ["mine"]);
}

#[test]
fn pictures_are_regular_files_with_a_step_by_name_in_order() {
    let root = tempfile::tempdir().unwrap();
    let directory = root.path();
    fs::create_dir(directory.join("pictures")).unwrap();
    let file = |name: &str, step| PICTURES.named_file(directory, name, step);
    for path in [file("a_b", 12_345_678_901), file("a_b", 5), directory.join("pictures/a_b_7.png")] {
        fs::write(path, "xyz").unwrap();
    }
    std::os::unix::fs::symlink(file("a_b", 5), file("linked", 6)).unwrap();
    let expected = [5, 12_345_678_901].map(|step| (step, file("a_b", step), 3));
    assert_eq!(pictures(directory).unwrap(), BTreeMap::from([("a_b".to_owned(), expected.to_vec())]));
}

#[test]
fn the_script_of_an_earlier_run_is_cleared() {
    let root = tempfile::tempdir().unwrap();
    let script = OutputFiles::new(root.path()).script();
    fs::write(&script, include_str!("../../simulation/writers/open.py")).unwrap();
    assert!(refuse_results(root.path(), &[]).is_err());
    clear(root.path(), &[]).unwrap();
    assert!(!script.exists());
}

#[test]
fn a_run_that_continues_keeps_what_is_before_its_step_and_what_it_is_told_to_keep() {
    let root = tempfile::tempdir().unwrap();
    let directory = root.path();
    let files = OutputFiles::new(directory);
    let partial = |path: PathBuf| PathBuf::from(format!("{}.tmp", path.display()));
    let stays = [
        files.series(),
        files.particle_series(),
        files.collection(FIELDS),
        files.walls(),
        files.file(FIELDS, 3),
        files.file(FIELDS, 5),
        files.file(PARTICLES, 4),
        files.engine_log("liggghts"),
        pieces::index(&files.file(FIELDS, 3)),
        pieces::piece(&files.file(FIELDS, 3), 1),
        pieces::index(&files.file(FORCE_CHAINS, 5)),
        pieces::piece(&files.file(FORCE_CHAINS, 5), 0),
        directory.join("fields/fields_0000000009.txt"),
        directory.join("summary.json.bak"),
    ];
    let goes = [
        files.summary(),
        files.settling_plot(),
        files.file(PARTICLES, 5),
        files.file(CONTACTS, 6),
        files.file(FORCE_CHAINS, 7),
        PICTURES.named_file(directory, "speed", 12_345_678_901),
        partial(files.file(FIELDS, 2)),
        partial(files.series()),
        pieces::index(&files.file(PARTICLES, 5)),
        pieces::piece(&files.file(PARTICLES, 5), 2),
        pieces::index(&files.file(FIELDS, 6)),
        pieces::piece(&files.file(FIELDS, 6), 7),
        partial(pieces::piece(&files.file(FIELDS, 3), 0)),
    ];
    for path in stays.iter().chain(&goes) {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "x").unwrap();
    }
    let checkpoint = files.checkpoints().join("step-0000000009");
    fs::create_dir_all(&checkpoint).unwrap();
    let kept = [FIELDS, FORCE_CHAINS, CONTACTS];
    clear_after(directory, &[], 5, &kept).unwrap();
    for path in stays.iter().chain([&checkpoint]) {
        assert!(path.exists(), "{} is needed", path.display());
    }
    for path in goes {
        assert!(!path.exists(), "{} is of a course that was given up", path.display());
    }
    assert!(!directory.join("fields/fields_0000000006").exists());
}

#[test]
fn the_table_of_a_writer_is_refused_kept_and_cleared_as_the_series_is() {
    let root = tempfile::tempdir().unwrap();
    let (directory, kinds) = (root.path(), [Kind::Table("heights.csv")]);
    let table = directory.join("heights.csv");
    fs::write(&table, "x").unwrap();
    refuse_results(directory, &[]).unwrap();
    let refused = refuse_results(directory, &kinds).unwrap_err().to_string();
    assert!(refused.contains("heights.csv"), "{refused}");
    clear_after(directory, &kinds, 5, &[]).unwrap();
    clear(directory, &[]).unwrap();
    assert!(table.exists());
    clear(directory, &kinds).unwrap();
    assert!(!table.exists());
}

#[test]
fn a_directory_that_a_run_writes_to_is_refused_until_that_ends() {
    let root = tempfile::tempdir().unwrap();
    let held = lock(root.path()).unwrap();
    assert!(held.is_some());
    let refused = lock(root.path()).unwrap_err().to_string();
    assert!(refused.contains("another run") && refused.contains("--out"), "{refused}");
    drop(held);
    assert!(lock(root.path()).unwrap().is_some());
}

#[test]
fn a_place_where_nothing_can_be_written_is_named_with_a_remedy() {
    let root = tempfile::tempdir().unwrap();
    let file = root.path().join("file");
    fs::write(&file, "x").unwrap();
    for directory in [file.join("out"), PathBuf::from("/proc/turbid")] {
        let error = create(&directory).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        let text = error.to_string();
        assert!(text.contains(&directory.display().to_string()) && text.contains("--out"), "{text}");
    }
    assert_eq!(fs::read(&file).unwrap(), b"x");
    fs::write(root.path().join(checkpoint::FOLDER), "x").unwrap();
    let text = create(root.path()).unwrap_err().to_string();
    assert!(text.contains(checkpoint::FOLDER), "{text}");
}

#[test]
fn results_of_an_earlier_run_are_refused_by_name_and_foreign_files_are_not() {
    let root = tempfile::tempdir().unwrap();
    let directory = root.path();
    let files = OutputFiles::new(directory);
    let put = |path: PathBuf| {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "x").unwrap();
    };
    put(directory.join("notes.txt"));
    put(directory.join("fields/best.vti"));
    put(files.summary().with_extension("json.tmp"));
    fs::create_dir_all(files.checkpoints().join("step-0000000300.partial")).unwrap();
    refuse_results(directory, &[]).unwrap();
    let refused = || refuse_results(directory, &[]).unwrap_err().to_string();
    put(files.file(PARTICLES, 7));
    let said = refused();
    assert!(said.contains("earlier run: particles/particles_0000000007.vtp\n"), "{said}");
    assert!(said.contains("--overwrite") && said.contains("--out") && !said.contains("resume"), "{said}");
    put(files.series());
    assert!(refused().contains("earlier run: series.csv, another file\n"));
    put(pieces::piece(&files.file(FIELDS, 5), 0));
    fs::create_dir(files.checkpoints().join("step-0000000100")).unwrap();
    assert!(refused().contains("series.csv, 2 other files, a checkpoint of step 100\n  `turbid resume "));
    fs::create_dir(files.checkpoints().join("step-0000000200")).unwrap();
    assert!(refused().contains(", 2 checkpoints, the last of step 200\n"));
}

#[test]
fn links_of_the_names_of_a_run_are_refused_and_nothing_is_removed_or_written_through_them() {
    let root = tempfile::tempdir().unwrap();
    let (directory, other) = (root.path().join("out"), root.path().join("other"));
    fs::create_dir_all(&directory).unwrap();
    fs::create_dir_all(&other).unwrap();
    let files = OutputFiles::new(&directory);
    let mine = other.join("fields_0000000001.vti");
    fs::write(&mine, "mine").unwrap();
    for name in ["fields", "checkpoints", "summary.json", "series.csv.tmp", "liggghts.log"] {
        let link = directory.join(name);
        std::os::unix::fs::symlink(&other, &link).unwrap();
        let said = create(&directory).unwrap_err().to_string();
        assert!(said.contains(&link.display().to_string()) && said.contains("symbolic link"), "{said}");
        fs::remove_file(link).unwrap();
    }
    create(&directory).unwrap();
    // Links below the folders go themselves.
    fs::create_dir(directory.join("fields")).unwrap();
    let frame = files.file(FIELDS, 1);
    let links = [frame.clone(), frame.with_extension("vti.tmp"), frame.with_extension("")];
    for (link, to) in links.iter().zip([&mine, &mine, &other]) {
        std::os::unix::fs::symlink(to, link).unwrap();
    }
    clear(&directory, &[]).unwrap();
    assert!(links.iter().all(|link| fs::symlink_metadata(link).is_err()));
    assert_eq!(fs::read(&mine).unwrap(), b"mine");
    // The directory itself may be one.
    std::os::unix::fs::symlink(&directory, root.path().join("scratch")).unwrap();
    create(&root.path().join("scratch")).unwrap();
}

#[test]
fn what_a_run_reads_is_neither_removed_nor_written_over() {
    let root = tempfile::tempdir().unwrap();
    let directory = root.path();
    let saved = directory.join("checkpoints/step-0000000100");
    fs::create_dir_all(&saved).unwrap();
    fs::create_dir(directory.join("fields")).unwrap();
    let file = |name: &str| {
        let path = directory.join(name);
        fs::write(&path, "x").unwrap();
        path
    };
    let harmless = [file("case.toml"), file("fields/stone.stl"), directory.join("missing")];
    let read = [
        file("series.csv"),
        file("fields/fields_0000000001.vti"),
        file("checkpoints/step-0000000100/case.toml"),
    ];
    refuse_inputs(directory, &[], &harmless).unwrap();
    let link = directory.join("places.csv");
    std::os::unix::fs::symlink("series.csv", &link).unwrap();
    for input in read.iter().chain([&link]) {
        let inputs = [harmless[0].clone(), input.clone()];
        let said = refuse_inputs(directory, &[], &inputs).unwrap_err().to_string();
        assert!(said.starts_with(&input.display().to_string()) && said.contains("--out"), "{said}");
        let said = refuse_input(input, &inputs).unwrap_err().to_string();
        assert!(said.contains("which was read"), "{said}");
    }
    assert!(refuse_input(&read[0], &[link]).is_err(), "they are the same");
    refuse_input(&directory.join("new.csv"), &harmless).unwrap();
}
