//! Rows of samples: one line each, ended by a number that is made of the line and of what is flown.

use std::fs::File;
use std::io::{self, BufRead as _, BufReader, Read as _, Seek as _, SeekFrom};
use std::ops::Range;
use std::path::Path;
use std::str::FromStr;

use apsides_pipeline::montecarlo::Sample;
use apsides_pipeline::regular_file;
use sha2::{Digest as _, Sha256};

use crate::ReportError;
use crate::files::{failed, table_error};
use crate::trajectory_csv::shortest;

/// Name of the file of samples.
pub(crate) const DATA: &str = "montecarlo.csv";
/// The column of the index.
pub(crate) const INDEX: &str = "index";
/// The column of a number that tells whether a row is as it was written.
const DIGEST: &str = "digest";

/// Bytes that no line has.
const LONGEST_LINE: u64 = 1 << 20;

/// The part of a row that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cells {
    All,
    /// No deviations.
    Results,
}

/// The columns of samples, and what they are samples of.
#[derive(Clone, Debug)]
pub(crate) struct RowFormat {
    heads: Vec<u8>,
    deviations: usize,
    results: usize,
    /// After the statement of what is flown.
    digest: Sha256,
}

impl RowFormat {
    pub(crate) fn new(names: &[&str], columns: &[&str], statement: &str) -> Result<Self, ReportError> {
        let mut table = csv::Writer::from_writer(Vec::new());
        table
            .write_record([&[INDEX], names, columns, &[DIGEST]].concat())
            .map_err(|e| table_error(DATA, e))?;
        let heads = table.into_inner().map_err(|e| table_error(DATA, e.into_error()))?;
        let digest = Sha256::new_with_prefix(statement);
        Ok(Self { heads, deviations: names.len(), results: columns.len(), digest })
    }

    /// The first line.
    pub(crate) fn heads(&self) -> &[u8] {
        &self.heads
    }

    /// The number at the end of a row, made of what is before it.
    fn number(&self, cells: &[u8]) -> u64 {
        let digest = self.digest.clone().chain_update(cells).finalize();
        // So many bytes that every reader of tables has the number to its last digit.
        digest.iter().take(6).fold(0_u64, |number, byte| number << 8 | u64::from(*byte))
    }

    /// The line of a sample.
    pub(crate) fn line(&self, sample: &Sample) -> String {
        let mut line = sample.index.to_string();
        for number in sample.deviations.iter().chain(&sample.results) {
            line.push(',');
            line += &shortest(*number);
        }
        let number = self.number(line.as_bytes());
        line += &format!(",{number}\n");
        line
    }

    /// The sample of a line; none of one that lacks its end or has no such cells.
    pub(crate) fn sample(&self, line: &[u8]) -> Option<Sample> {
        self.sample_with(line, Cells::All)
    }

    fn sample_with(&self, line: &[u8], read: Cells) -> Option<Sample> {
        // By bytes, and into lists of known length: most of the time of a merge goes by here.
        let mut cells = line.strip_suffix(b"\n")?.split(|byte| *byte == b',');
        let index = number(cells.next()?)?;
        if read == Cells::Results {
            for _ in 0..self.deviations {
                cells.next()?;
            }
        }
        let mut numbers = |count: usize| -> Option<Vec<f64>> {
            let mut list = Vec::with_capacity(count);
            for _ in 0..count {
                list.push(number(cells.next()?)?);
            }
            Some(list)
        };
        let sample = Sample {
            index,
            deviations: match read {
                Cells::All => numbers(self.deviations)?,
                Cells::Results => Vec::new(),
            },
            results: numbers(self.results)?,
            fault: None,
        };
        number::<u64>(cells.next()?)?;
        cells.next().is_none().then_some(sample)
    }

    /// True for a line with all cells as they were written.
    pub(crate) fn is_sound(&self, line: &[u8]) -> bool {
        let Some(end) = line.iter().rposition(|byte| *byte == b',') else { return false };
        let (cells, number) = line.split_at(end);
        number == format!(",{}\n", self.number(cells)).as_bytes()
    }

    /// The place behind the last whole line and its sample, looked for from the end of the file; none where that line is not sound or has no
    /// sample.
    pub(crate) fn last(&self, path: &Path) -> io::Result<Option<(u64, Sample)>> {
        let mut file = regular_file::open(path)?;
        let length = file.metadata()?.len();
        let begin = length.saturating_sub(2 * LONGEST_LINE).max(self.heads.len() as u64);
        file.seek(SeekFrom::Start(begin))?;
        let mut tail = Vec::new();
        file.take(2 * LONGEST_LINE).read_to_end(&mut tail)?;
        let Some(end) = tail.iter().rposition(|byte| *byte == b'\n') else { return Ok(None) };
        let start = tail[..end].iter().rposition(|byte| *byte == b'\n').map_or(0, |at| at + 1);
        let line = &tail[start..=end];
        let sample = self.sample(line).filter(|_| self.is_sound(line));
        Ok(sample.map(|sample| (begin + end as u64 + 1, sample)))
    }

    /// Opens a file behind its first line, which has to be that of these columns.
    pub(crate) fn open(&self, path: &Path) -> Result<RowReader<'_>, ReportError> {
        let mut reader = BufReader::new(regular_file::open(path).map_err(failed("read", path))?);
        let mut line = Vec::new();
        next_line(&mut reader, &mut line).map_err(failed("read", path))?;
        if line != self.heads {
            return Err(other("other columns"));
        }
        Ok(RowReader { format: self, reader, line })
    }
}

fn number<T: FromStr>(cell: &[u8]) -> Option<T> {
    std::str::from_utf8(cell).ok()?.parse().ok()
}

fn next_line(reader: &mut BufReader<File>, line: &mut Vec<u8>) -> io::Result<usize> {
    line.clear();
    reader.by_ref().take(LONGEST_LINE).read_until(b'\n', line)
}

/// Rows from the first on.
pub(crate) struct RowReader<'a> {
    format: &'a RowFormat,
    reader: BufReader<File>,
    line: Vec<u8>,
}

impl RowReader<'_> {
    /// The next line with its sample; none at the end of the file, and none of what is no row.
    pub(crate) fn next(&mut self) -> io::Result<Option<(&[u8], Sample)>> {
        self.next_with(Cells::All)
    }

    fn next_with(&mut self, read: Cells) -> io::Result<Option<(&[u8], Sample)>> {
        next_line(&mut self.reader, &mut self.line)?;
        Ok(self.format.sample_with(&self.line, read).map(|sample| (self.line.as_slice(), sample)))
    }

    /// Hands on the rows of indices. With `checked` each has to be as it was written, else it is enough that the indices are right, and samples
    /// have no deviations.
    ///
    /// # Errors
    /// A row that is missing, or was altered.
    pub(crate) fn each(
        mut self,
        path: &Path,
        indices: Range<usize>,
        checked: bool,
        mut each: impl FnMut(&[u8], &Sample) -> Result<(), ReportError>,
    ) -> Result<(), ReportError> {
        for index in indices {
            let format = self.format;
            let read = if checked { Cells::All } else { Cells::Results };
            match self.next_with(read).map_err(failed("read", path))? {
                Some((line, sample)) if sample.index == index && (!checked || format.is_sound(line)) => {
                    each(line, &sample)?;
                }
                Some((_, sample)) if sample.index == index => return Err(altered(index)),
                _ => return Err(other(format!("no row of sample {index} where it should be"))),
            }
        }
        Ok(())
    }
}

pub(crate) fn altered(index: usize) -> ReportError {
    other(format!("a sample that was altered, that of index {index}"))
}

pub(crate) fn other(found: impl Into<String>) -> ReportError {
    ReportError::OtherRun { file: DATA, found: found.into() }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_row_is_read_as_it_was_written_or_not_at_all() {
        let format = RowFormat::new(&["mass_kg"], &["along_m", "across_m"], "mission = \"one\"\n").unwrap();
        assert_eq!(format.heads(), b"index,mass_kg,along_m,across_m,digest\n");
        let sample =
            Sample { index: 7, deviations: vec![-1.5e-300], results: vec![0.1, f64::INFINITY], fault: None };
        let line = format.line(&sample).into_bytes();
        assert_eq!(format.sample(&line), Some(sample));
        assert!(format.is_sound(&line));
        for at in 0..line.len() {
            let mut altered = line.clone();
            altered[at] ^= 1;
            assert!(!format.is_sound(&altered), "byte {at}");
            assert_eq!(format.sample(&line[..at]), None);
        }
        let another = RowFormat::new(&["mass_kg"], &["along_m", "across_m"], "mission = \"two\"\n").unwrap();
        assert!(!another.is_sound(&line));
    }

    /// A line without an end, as of a device, takes no memory.
    #[test]
    fn a_line_without_measure_is_no_row() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(DATA);
        let format = RowFormat::new(&[], &["a"], "").unwrap();
        std::fs::write(&path, [format.heads(), &vec![b'1'; 3 << 20]].concat()).unwrap();
        assert!(format.open(&path).unwrap().next().unwrap().is_none());
        assert!(format.last(&path).unwrap().is_none());
    }
}
