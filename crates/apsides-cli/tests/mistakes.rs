//! Files with mistakes as the program meets them: status 2, the file, the line and the column, in time.
#![allow(clippy::unwrap_used)]

mod support;

use std::time::{Duration, Instant};

use support::{apsides, path, stderr};

/// Longest time of an answer, start of the program included.
const IN_TIME: Duration = Duration::from_secs(1);

/// Put in the place of a value.
const OTHERS: [&str; 5] = ["nan", "\"1 +\"", "[1, 2, 3]", "\"3 m/kg s\"", "{ unknown = 1 }"];

#[test]
fn each_line_of_the_starter_with_a_mistake_has_status_2_and_a_place() {
    let dir = tempfile::tempdir().unwrap();
    let file = path(&dir.path().join("own.toml"));
    assert_eq!(apsides(&["new", "problem", &file]).status.code(), Some(0));
    let text = std::fs::read_to_string(&file).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let mut refused = 0;
    for (k, line) in lines.iter().enumerate() {
        // Without its kind a file is that of a mission, where columns are not known.
        let is_statement = |key: &str| !key.starts_with('#') && key != "kind";
        let Some((key, _)) = line.split_once(" = ").filter(|(key, _)| is_statement(key)) else {
            continue;
        };
        for other in OTHERS {
            let changed = format!("{key} = {other}");
            let mut lines = lines.clone();
            lines[k] = &changed;
            std::fs::write(&file, lines.join("\n")).unwrap();
            let begin = Instant::now();
            let o = apsides(&["check", &file]);
            assert!(begin.elapsed() < IN_TIME, "{changed}: {:?}", begin.elapsed());
            if o.status.code() == Some(0) {
                continue;
            }
            refused += 1;
            let said = stderr(&o);
            assert_eq!(o.status.code(), Some(2), "{changed}: {said}");
            assert!(!said.contains("panicked"), "{changed}: {said}");
            let is_placed = said.contains("own.toml") && said.contains("line ") && said.contains("column ");
            assert!(is_placed || said.contains("missing are"), "{changed}: {said}");
        }
    }
    assert!(refused >= 90, "{refused} are refused");
}
