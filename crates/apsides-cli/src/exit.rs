//! The one table of exit statuses, and the sentence of a command that does not do its work.

use std::io;
use std::path::Path;

use apsides::Summary;
use apsides::pipeline::whole_file::is_refusal;
use apsides_report::ReportError;

use crate::sentence::{name, wrapped};

/// The exit status of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Exit {
    /// Optimal and verified.
    Verified = 0,
    /// Bad input.
    BadInput = 2,
    /// Not converged or infeasible.
    NotSolved = 3,
    /// Solved but not verified.
    NotVerified = 4,
    /// An output is lost.
    Unwritten = 5,
    /// All is there, some samples have no result.
    Failures = 6,
    /// A panic.
    Fault = 101,
    /// A signal ended the work.
    Interrupted = 130,
}

/// Every status with its meaning, for all commands; the worse ones further down, the interrupt and lost outputs above bad input.
const TABLE: [(Exit, &str); 8] = [
    (
        Exit::Verified,
        "done: what was solved is optimal and verified, what was asked for is shown and written",
    ),
    (Exit::BadInput, "bad input: a sentence on stderr says what is allowed; nothing is written"),
    (
        Exit::NotSolved,
        "not solved: not converged or infeasible; a time limit ended the work; a flight failed (simulate), no gains hold (tune), ends are missing (footprint), parts are not at their end (merge), no site is safe (hazard). What was found is shown and written",
    ),
    (
        Exit::NotVerified,
        "solved, but not verified: see the certificate; files that are not what they claim (verify)",
    ),
    (
        Exit::Unwritten,
        "an output could not be written (a file, a checkpoint, stdout); what is on the disk stays",
    ),
    (
        Exit::Failures,
        "complete, but some flights have no result (montecarlo, merge): nothing is left to do; work that ended before its end has 3 or 130",
    ),
    (Exit::Fault, "a fault of the program itself: please report the message"),
    (
        Exit::Interrupted,
        "interrupted by Ctrl-C, SIGTERM or SIGHUP: what was done is shown and written, a second signal ends at once",
    ),
];

/// The table as text, in lines that fit a terminal.
pub(crate) fn statuses() -> String {
    let rows = TABLE.iter().map(|(exit, meaning)| {
        let head = format!("{:>5}  ", *exit as u8);
        wrapped(&" ".repeat(head.len()), meaning).replacen(&" ".repeat(head.len()), &head, 1)
    });
    format!("Exit status:\n{}", rows.collect::<String>())
}

impl Exit {
    pub(crate) fn of(summary: &Summary) -> Self {
        match (summary.status.as_str(), summary.certificate.is_verified()) {
            ("optimal" | "acceptable", true) => Self::Verified,
            ("optimal" | "acceptable", false) => Self::NotVerified,
            _ => Self::NotSolved,
        }
    }

    /// The worse one of two.
    pub(crate) fn or(self, other: Self) -> Self {
        let rank = |exit| match exit {
            Self::Verified => 0,
            Self::NotVerified => 1,
            Self::Failures => 2,
            Self::NotSolved => 3,
            Self::BadInput => 4,
            Self::Interrupted => 5,
            Self::Unwritten => 6,
            Self::Fault => 7,
        };
        if rank(other) > rank(self) { other } else { self }
    }
}

/// One sentence for the reader, and the status that goes with it.
#[derive(Debug)]
pub(crate) struct Refusal {
    pub(crate) exit: Exit,
    pub(crate) sentence: String,
}

impl From<String> for Refusal {
    fn from(sentence: String) -> Self {
        Self { exit: Exit::BadInput, sentence }
    }
}

impl From<&str> for Refusal {
    fn from(sentence: &str) -> Self {
        sentence.to_owned().into()
    }
}

impl From<ReportError> for Refusal {
    fn from(e: ReportError) -> Self {
        let exit = if e.is_lost_output() { Exit::Unwritten } else { Exit::BadInput };
        Self { exit, sentence: e.to_string() }
    }
}

/// Bad input.
pub(crate) fn refusal(e: impl std::fmt::Display) -> Refusal {
    e.to_string().into()
}

/// A file that is not written: by the system's fault, or since its name is no file's.
pub(crate) fn unwritten(path: &Path) -> impl Fn(io::Error) -> Refusal + use<> {
    let path = path.to_owned();
    move |e| {
        let exit = if is_refusal(&e) { Exit::BadInput } else { Exit::Unwritten };
        Refusal { exit, sentence: format!("{}: {e}", name(&path.to_string_lossy())) }
    }
}

/// A file of a directory that was there when the work began: whatever keeps it from being written now, it is lost.
pub(crate) fn lost(path: &Path) -> impl Fn(io::Error) -> Refusal + use<> {
    let of = unwritten(path);
    move |e| Refusal { exit: Exit::Unwritten, ..of(e) }
}

/// A file that is not written, named by its option.
pub(crate) fn unwritten_option(option: &str, path: &Path) -> impl Fn(io::Error) -> Refusal + use<> {
    let (option, of) = (option.to_owned(), unwritten(path));
    move |e| {
        let Refusal { exit, sentence } = of(e);
        Refusal { exit, sentence: format!("{option} {sentence}") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_status_is_in_the_table_once() {
        let numbers: Vec<u8> = TABLE.iter().map(|(exit, _)| *exit as u8).collect();
        assert_eq!(numbers, [0, 2, 3, 4, 5, 6, 101, 130]);
        assert!(statuses().lines().all(|l| l.len() <= 80));
    }

    #[test]
    fn the_worse_status_wins() {
        assert_eq!(Exit::Verified.or(Exit::NotVerified), Exit::NotVerified);
        assert_eq!(Exit::NotSolved.or(Exit::NotVerified), Exit::NotSolved);
        assert_eq!(Exit::Interrupted.or(Exit::Unwritten), Exit::Unwritten);
    }
}
