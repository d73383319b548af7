use super::*;

const SUMMARY: &str = "summary.json";
const REPORT: &str = "report.html";
const MULTIPLIERS: &str = "multipliers.json";

fn content(dir: &Path) -> Vec<(String, String)> {
    let mut found: Vec<_> = fs::read_dir(dir)
        .unwrap()
        .map(|entry| {
            let path = entry.unwrap().path();
            let text = fs::read_to_string(&path).unwrap_or_else(|_| "directory".into());
            (path.file_name().unwrap().to_string_lossy().into_owned(), text)
        })
        .collect();
    found.sort();
    found
}

fn items(text: &str) -> Vec<Item> {
    [SUMMARY, TRAJECTORY, REPORT].map(|name| (name, Some(text.as_bytes().to_vec()))).into()
}

#[test]
fn files_are_replaced_and_stale_ones_removed() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("notes.txt"), "mine").unwrap();
    fs::write(dir.path().join(MULTIPLIERS), "stale").unwrap();
    replace(dir.path(), &items("first")).unwrap();
    let mut second = items("second");
    second.push((MULTIPLIERS, None));
    let written = replace(dir.path(), &second).unwrap();
    assert_eq!(written, [SUMMARY, TRAJECTORY, REPORT].map(|n| dir.path().join(n)));
    let pair = |a: &str, b: &str| (a.to_owned(), b.to_owned());
    assert_eq!(
        content(dir.path()),
        [
            pair("notes.txt", "mine"),
            pair(REPORT, "second"),
            pair(SUMMARY, "second"),
            pair(TRAJECTORY, "second")
        ]
    );
}

#[test]
fn a_failure_leaves_the_earlier_result() {
    let dir = tempfile::tempdir().unwrap();
    replace(dir.path(), &items("first")).unwrap();
    let before = content(dir.path());
    // A name that no file can have, after others that could be written.
    let mut bad = items("second");
    bad.push(("no/such/directory.json", Some(Vec::new())));
    let error = replace(dir.path(), &bad).unwrap_err();
    assert!(error.to_string().contains("directory.json"), "{error}");
    assert_eq!(content(dir.path()), before);
}

#[test]
fn two_files_of_one_name_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    replace(dir.path(), &items("first")).unwrap();
    let before = content(dir.path());
    for second in [Some(b"another figure".to_vec()), None] {
        let mut bad = items("second");
        bad.push((REPORT, second));
        let error = replace(dir.path(), &bad).unwrap_err().to_string();
        assert!(error.contains("report.html` would be written twice"), "{error}");
        assert_eq!(content(dir.path()), before);
    }
}

#[test]
fn a_failed_rename_is_undone() {
    let dir = tempfile::tempdir().unwrap();
    replace(dir.path(), &items("first")).unwrap();
    let before = content(dir.path());
    let (files, stale) = staged(dir.path(), &items("second")).unwrap();
    // A directory takes the place of the third file: its rename fails after those of the others.
    fs::remove_file(dir.path().join(REPORT)).unwrap();
    fs::create_dir(dir.path().join(REPORT)).unwrap();
    let (path, _) = publish_together(files, &stale).unwrap_err();
    assert_eq!(path, dir.path().join(REPORT));
    fs::remove_dir(&path).unwrap();
    fs::write(&path, "first").unwrap();
    assert_eq!(content(dir.path()), before);
}

#[cfg(unix)]
#[test]
fn a_result_file_that_is_a_link_or_a_device() {
    let dir = tempfile::tempdir().unwrap();
    let other = tempfile::tempdir().unwrap();
    std::os::unix::fs::symlink(other.path().join("kept.json"), dir.path().join(SUMMARY)).unwrap();
    replace(dir.path(), &items("first")).unwrap();
    replace(dir.path(), &items("second")).unwrap();
    assert_eq!(fs::read_to_string(other.path().join("kept.json")).unwrap(), "second");
    assert!(fs::symlink_metadata(dir.path().join(SUMMARY)).unwrap().is_symlink());
    fs::remove_file(dir.path().join(SUMMARY)).unwrap();
    std::os::unix::fs::symlink("/dev/null", dir.path().join(SUMMARY)).unwrap();
    let error = replace(dir.path(), &items("third")).unwrap_err().to_string();
    assert!(error.ends_with("is a device; give a file") && error.contains(SUMMARY), "{error}");
    assert_eq!(fs::read_to_string(dir.path().join(REPORT)).unwrap(), "second");
}

#[test]
fn a_file_or_a_directory_in_the_way() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("out");
    fs::write(&file, "text").unwrap();
    let error = replace(&file, &items("x")).unwrap_err();
    assert!(matches!(error, ReportError::Directory { .. }), "{error}");
    let below = replace(&file.join("sub"), &items("x")).unwrap_err();
    assert!(matches!(below, ReportError::Io { .. }), "{below}");
    assert_eq!(fs::read_to_string(&file).unwrap(), "text");

    let out = dir.path().join("other");
    fs::create_dir_all(out.join(REPORT)).unwrap();
    let error = replace(&out, &items("x")).unwrap_err();
    assert!(matches!(error, ReportError::Directory { .. }), "{error}");
    assert_eq!(content(&out), [(REPORT.to_owned(), "directory".to_owned())]);
}

#[test]
fn directories_made_for_nothing_are_removed() {
    let dir = tempfile::tempdir().unwrap();
    let mut bad = items("x");
    bad.push(("no/such/directory.json", Some(Vec::new())));
    replace(&dir.path().join("a/b"), &bad).unwrap_err();
    assert!(!dir.path().join("a").exists());
    replace(&dir.path().join("a/b"), &items("x")).unwrap();
    assert_eq!(content(&dir.path().join("a/b")).len(), 3);
}

#[cfg(target_os = "linux")]
#[test]
fn a_directory_that_cannot_be_made() {
    let error = replace(Path::new("/proc/apsides/out"), &items("x")).unwrap_err();
    let text = error.to_string();
    assert!(text.starts_with("cannot create the directory `/proc/apsides/out`: "), "{text}");
}
