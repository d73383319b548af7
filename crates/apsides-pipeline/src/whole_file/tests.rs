#![allow(clippy::unwrap_used)]
use super::*;

fn names(dir: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_file_is_there_whole_or_not_at_all() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("map.tif");
    write_whole(&path, b"good").unwrap();
    let mut next = WholeFile::create(&path).unwrap();
    next.write_all(b"half of anoth").unwrap();
    next.flush().unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"good");
    drop(next);
    assert_eq!((fs::read(&path).unwrap(), names(dir.path())), (b"good".to_vec(), vec!["map.tif".into()]));
    let mut next = WholeFile::create(&path).unwrap();
    next.write_all(b"another").unwrap();
    next.publish().unwrap();
    assert_eq!((fs::read(&path).unwrap(), names(dir.path())), (b"another".to_vec(), vec!["map.tif".into()]));
    check_file(&dir.path().join("new")).unwrap();
    check_directory(&dir.path().join("a/b/c")).unwrap();
    assert_eq!(names(dir.path()), ["map.tif"]);
}

#[test]
fn names_that_are_no_files_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let reason = |path: &Path| {
        let e = check_file(path).unwrap_err();
        assert!(is_refusal(&e), "{e}");
        e.to_string()
    };
    assert_eq!(reason(dir.path()), "is a directory; give a file");
    assert_eq!(reason(&dir.path().join("none/file")), "its directory does not exist");
    let file = dir.path().join("file");
    fs::write(&file, "text").unwrap();
    assert_eq!(reason(&file.join("below")), "a file is in the place of its directory");
    let e = check_directory(&file).unwrap_err();
    assert!(is_refusal(&e) && e.to_string() == "is a file; give a directory", "{e}");
    let mut permissions = fs::metadata(&file).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&file, permissions).unwrap();
    assert!(reason(&file).starts_with("is write-protected"));
    assert_eq!(fs::read(&file).unwrap(), b"text");
}

#[cfg(unix)]
#[test]
fn links_are_followed_and_devices_sockets_and_pipes_refused() {
    use std::os::unix::fs::{PermissionsExt as _, symlink};
    let dir = tempfile::tempdir().unwrap();
    let (there, link) = (dir.path().join("there"), dir.path().join("link"));
    fs::create_dir(&there).unwrap();
    symlink("there/target", &link).unwrap();
    // First a link to nothing yet, then one to a file.
    for content in [b"first", b"later"] {
        write_whole(&link, content).unwrap();
        assert_eq!(fs::read(there.join("target")).unwrap(), content);
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        fs::set_permissions(there.join("target"), fs::Permissions::from_mode(0o640)).unwrap();
    }
    assert_eq!(fs::metadata(there.join("target")).unwrap().permissions().mode() & 0o777, 0o640);
    assert_eq!(
        (names(&there), names(dir.path())),
        (vec!["target".into()], vec!["link".into(), "there".into()])
    );
    symlink("loop", dir.path().join("loop")).unwrap();
    assert!(check_file(&dir.path().join("loop")).is_err());
    let _socket = std::os::unix::net::UnixListener::bind(dir.path().join("socket")).unwrap();
    symlink("/dev/null", dir.path().join("device")).unwrap();
    for (path, reason) in [
        (Path::new("/dev/null"), "is a device; give a file"),
        (&dir.path().join("device"), "is a device; give a file"),
        (&dir.path().join("socket"), "is a socket; give a file"),
    ] {
        let e = write_whole(path, b"x").unwrap_err();
        assert!(is_refusal(&e) && e.to_string() == reason, "{}: {e}", path.display());
    }
}

#[test]
fn files_are_replaced_together_or_not_at_all() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    for name in ["a", "b", "stale"] {
        fs::write(at(name), "old").unwrap();
    }
    let new = |name: &str| {
        let mut file = WholeFile::create(&at(name)).unwrap();
        file.write_all(b"new").unwrap();
        file
    };
    let files = vec![new("a"), new("c"), new("b")];
    // The place of the last one is taken by a directory meanwhile: its rename fails after those of the others.
    fs::remove_file(at("b")).unwrap();
    fs::create_dir(at("b")).unwrap();
    let (path, _) = publish_together(files, &[at("stale")]).unwrap_err();
    assert_eq!(path, at("b"));
    assert_eq!(names(dir.path()), ["a", "b", "stale"]);
    assert_eq!(fs::read(at("a")).unwrap(), b"old");
    fs::remove_dir(at("b")).unwrap();
    publish_together(vec![new("a"), new("b")], &[at("stale"), at("none")]).unwrap();
    assert_eq!(names(dir.path()), ["a", "b"]);
    assert_eq!(fs::read(at("a")).unwrap(), b"new");
}

/// The hidden files of a process that was killed are removed by the next that writes beside them; what may be an earlier file is not.
#[cfg(target_os = "linux")]
#[test]
fn what_a_killed_process_left_is_removed() {
    let dir = tempfile::tempdir().unwrap();
    let mut ended = std::process::Command::new("true").spawn().unwrap();
    let dead = ended.id();
    ended.wait().unwrap();
    let alive = std::process::id();
    for name in [
        format!(".apsides-{dead}-0"),
        format!(".apsides-{dead}-17"),
        format!(".apsides-{dead}-3.earlier"),
        format!(".apsides-{alive}-1000000"),
        ".apsides-lock".to_owned(),
        ".apsides-1-of-another-program".to_owned(),
    ] {
        fs::write(dir.path().join(name), "text").unwrap();
    }
    // A process that this machine does not see has its lock.
    let elsewhere = format!(".apsides-{dead}-5");
    let held = File::create(dir.path().join(&elsewhere)).unwrap();
    held.lock().unwrap();
    write_whole(&dir.path().join("file"), b"text").unwrap();
    let mut expected = [
        ".apsides-1-of-another-program".to_owned(),
        format!(".apsides-{dead}-3.earlier"),
        elsewhere,
        format!(".apsides-{alive}-1000000"),
        ".apsides-lock".to_owned(),
        "file".to_owned(),
    ];
    expected.sort();
    assert_eq!(names(dir.path()), expected);
}
