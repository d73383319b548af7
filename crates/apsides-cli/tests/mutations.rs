//! Files of every kind that the program reads, altered byte by byte: a documented status and a sentence, and never the answer of a file that
//! was not altered.
//!
//! The alterations are the same each time. `APSIDES_MUTATIONS` says how many of each kind are made; `cargo xtask torture` makes many.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod support;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use support::{PROGRAM, stderr};

/// Alterations of a file where nobody says how many.
const USUAL: u64 = 24;
/// Longest time of an answer.
const IN_TIME: Duration = Duration::from_secs(20);

fn mutations() -> u64 {
    std::env::var("APSIDES_MUTATIONS").map_or(USUAL, |n| n.parse().unwrap())
}

/// Numbers by an xorshift generator (Marsaglia, 2003).
struct Generator(u64);

impl Generator {
    fn below(&mut self, most: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % most.max(1) as u64) as usize
    }

    /// A file with one alteration: a bit, a byte, a number that is none, a cut, a part twice or left out, text of another kind.
    fn alter(&mut self, file: &[u8]) -> Vec<u8> {
        const WORDS: [&[u8]; 12] = [
            b"nan",
            b"inf",
            b"-1",
            b"1e308",
            b"1e-308",
            b"99999999999999999999",
            b"\"",
            b"[",
            b"{",
            b"\0",
            b"\xff\xfe",
            b"=",
        ];
        let mut altered = file.to_vec();
        let at = self.below(altered.len());
        match self.below(7) {
            0 => altered[at] ^= 1 << self.below(8),
            1 => altered[at] = self.below(256) as u8,
            2 => altered.truncate(at),
            3 => drop(altered.drain(at..(at + 1 + self.below(40)).min(file.len()))),
            4 => {
                let part = file[at..(at + 1 + self.below(200)).min(file.len())].to_vec();
                altered.splice(at..at, part);
            }
            5 => {
                let word = WORDS[self.below(WORDS.len())];
                altered.splice(at..(at + self.below(20)).min(file.len()), word.iter().copied());
            }
            // A digit becomes another one: what is hardest to see.
            _ => {
                let digits: Vec<usize> = (0..file.len()).filter(|k| file[*k].is_ascii_digit()).collect();
                if let Some(&at) = digits.get(self.below(digits.len())) {
                    altered[at] = b'0' + (file[at] - b'0' + 1 + self.below(9) as u8) % 10;
                }
            }
        }
        altered
    }
}

fn run(dir: &Path, arguments: &[&str]) -> Output {
    Command::new(PROGRAM).current_dir(dir).args(arguments).output().unwrap()
}

/// Copies the files of a folder, and those of its folders.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let place = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &place);
        } else {
            fs::copy(entry.path(), place).unwrap();
        }
    }
}

/// Alters a file of a folder again and again and runs a command there and `same` says if the answer is right.
fn torture(
    folder: &Path,
    file: &str,
    arguments: &[&str],
    allowed: &[i32],
    same: impl Fn(&Path, &Output) -> bool,
) {
    let good = fs::read(folder.join(file)).unwrap();
    let mut generator = Generator(0x9e37_79b9_7f4a_7c15 ^ file.len() as u64);
    let (mut statuses, mut longest) = (BTreeMap::<i32, u32>::new(), Duration::ZERO);
    for k in 0..mutations() {
        let altered = generator.alter(&good);
        if altered == good {
            continue;
        }
        let dir = tempfile::tempdir().unwrap();
        copy(folder, dir.path());
        fs::write(dir.path().join(file), &altered).unwrap();
        let begin = Instant::now();
        let o = run(dir.path(), arguments);
        longest = longest.max(begin.elapsed());
        let code = o.status.code().unwrap_or(-1);
        *statuses.entry(code).or_default() += 1;
        let said = stderr(&o);
        assert!(allowed.contains(&code), "{file} {k}: {code}: {said}");
        assert!(!said.contains("panicked"), "{file} {k}: {said}");
        if code == 2 {
            // What is missing in a problem is a list, and a mistake in a formula is shown in its line.
            let lines = if file == "problem.toml" { 12 } else { 1 };
            assert!(said.lines().count() <= lines && said.len() < 2000, "{file} {k}: {said}");
            let controls = |c: char| c.is_control() && (lines == 1 || c != '\n');
            assert!(!said.trim_end().contains(controls), "{file} {k}: {said:?}");
        }
        assert!(
            same(dir.path(), &o),
            "{file} {k}: what was altered was not seen: {}",
            String::from_utf8_lossy(&o.stdout)
        );
    }
    println!("{file}: {statuses:?}, longest {longest:?}");
    assert!(longest < IN_TIME, "{file}: {longest:?}");
}

/// Nothing more is asked of the answer than a status.
fn any(_: &Path, _: &Output) -> bool {
    true
}

#[test]
fn files_that_are_stated_by_a_user() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(run(dir.path(), &["new", "problem", "problem.toml"]).status.code(), Some(0));
    torture(dir.path(), "problem.toml", &["check", "problem.toml"], &[0, 2], any);
    let mission = run(dir.path(), &["check", "lunar-perilune", "--all"]).stdout;
    let mission = String::from_utf8(mission).unwrap();
    let mission = &mission[mission.find("mission = ").unwrap()..];
    fs::write(dir.path().join("mission.toml"), mission).unwrap();
    assert_eq!(run(dir.path(), &["check", "mission.toml"]).status.code(), Some(0));
    torture(dir.path(), "mission.toml", &["check", "mission.toml"], &[0, 2], any);
    fs::write(
        dir.path().join("criteria.toml"),
        "preset = \"chang-e-3-fine\"\nslope_max_deg = 6\n\n[belly]\nradius_m = 1.5\nheight_m = 0.8\nclearance_min_m = 0.3\n",
    )
    .unwrap();
    let gen_map = ["terrain", "gen", "map.tif", "--rows", "60", "--cols", "60", "--quiet"];
    assert_eq!(run(dir.path(), &gen_map).status.code(), Some(0));
    let hazard = ["hazard", "map.tif", "--criteria", "criteria.toml", "--quiet"];
    torture(dir.path(), "criteria.toml", &hazard, &[0, 2, 3], any);
    torture(dir.path(), "map.tif", &["hazard", "map.tif", "--quiet", "--memory", "64"], &[0, 2, 3], any);
}

/// Each file of a result directory: an altered one is never vouched for.
#[test]
fn results_that_are_verified() {
    let dir = tempfile::tempdir().unwrap();
    let solve = ["solve", "lunar-two-phase", "--quiet", "--out", "results"];
    assert_eq!(run(dir.path(), &solve).status.code(), Some(0));
    // The program that made it, blanks and a name twice are nothing that is vouched for.
    torture(dir.path(), "results/digests.json", &["verify", "results"], &[0, 2, 4], any);
    for file in ["trajectory.csv", "summary.json", "certificate.json", "mission.toml", "report.html"] {
        torture(dir.path(), &format!("results/{file}"), &["verify", "results"], &[2, 4], any);
    }
    let certify = ["certify", "lunar-two-phase", "results/trajectory.csv", "--no-reference"];
    torture(dir.path(), "results/trajectory.csv", &certify, &[0, 2, 4], any);
}

/// Work that was ended goes on to what it would have been, or the altered file is refused or left.
#[test]
fn files_from_which_work_goes_on() {
    let dir = tempfile::tempdir().unwrap();
    let flights = |samples| {
        [
            "montecarlo",
            "chang-e-3-braking",
            "--position-m",
            "333",
            "--quiet",
            "--samples",
            samples,
            "--out",
            "mc",
        ]
    };
    assert_eq!(run(dir.path(), &flights("12")).status.code(), Some(0));
    let whole = tempfile::tempdir().unwrap();
    assert_eq!(run(whole.path(), &flights("15")).status.code(), Some(0));
    let expected = fs::read(whole.path().join("mc/montecarlo.csv")).unwrap();
    for file in ["mc/montecarlo.csv", "mc/montecarlo.toml"] {
        torture(dir.path(), file, &flights("15"), &[0, 2], |dir, o| {
            o.status.code() == Some(2) || fs::read(dir.join("mc/montecarlo.csv")).unwrap() == expected
        });
    }
    // A search whose checkpoint is there goes on from it, or says that it is none.
    let search = |evaluations| {
        let all = [
            "solve",
            "capsule-reentry",
            "--method",
            "two-layer",
            "--quiet",
            "--seed",
            "3",
            "--checkpoint",
            "search.json",
            "--json",
        ];
        let mut all: Vec<String> = all.map(str::to_owned).into();
        all.extend([
            "--set".into(),
            format!("search.evaluations={evaluations}"),
            "--time-limit".into(),
            "2".into(),
        ]);
        all
    };
    let words = search(100_000_000);
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    assert_eq!(run(dir.path(), &words).status.code(), Some(3));
    torture(dir.path(), "search.json", &words, &[2], any);
}
