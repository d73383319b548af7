//! The program as a child process, and its words.
#![allow(dead_code, reason = "each test binary uses a part")]

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_apsides");

pub(crate) fn apsides(arguments: &[&str]) -> Output {
    Command::new(PROGRAM).args(arguments).output().unwrap()
}

pub(crate) fn stderr(o: &Output) -> String {
    String::from_utf8_lossy(&o.stderr).into_owned()
}

pub(crate) fn stdout(o: &Output) -> String {
    String::from_utf8_lossy(&o.stdout).into_owned()
}

pub(crate) fn path(p: &Path) -> String {
    p.to_string_lossy().into_owned()
}

/// Starts the program without waiting for it.
pub(crate) fn spawn(arguments: &[&str]) -> Child {
    Command::new(PROGRAM).args(arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

pub(crate) fn signal(child: &Child, name: &str) {
    assert!(Command::new("kill").args([name, &child.id().to_string()]).status().unwrap().success());
}

/// The cells of a table without the columns of wall-clock times.
pub(crate) fn table(file: &Path) -> Vec<Vec<String>> {
    let mut table = csv::Reader::from_path(file).unwrap();
    let heads: Vec<String> = table.headers().unwrap().iter().map(str::to_owned).collect();
    let kept = |record: csv::StringRecord| -> Vec<String> {
        let cells = record.iter().zip(&heads).filter(|(_, head)| !head.ends_with("_ms"));
        cells.map(|(cell, _)| cell.to_owned()).collect()
    };
    let rows: Vec<Vec<String>> = table.records().map(|record| kept(record.unwrap())).collect();
    std::iter::once(kept(heads.iter().map(String::as_str).collect())).chain(rows).collect()
}
