//! The file of the samples of a run or of a part of it: written as they come, continued where it ends.

use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Write as _};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use apsides_pipeline::digest::digits;
use apsides_pipeline::montecarlo::Sample;
use apsides_pipeline::regular_file;
use apsides_pipeline::whole_file::{WholeFile, publish_together};
use sha2::{Digest as _, Sha256};

use crate::ReportError;
use crate::files::failed;
use crate::sample_rows::{DATA, RowFormat, altered, other};

/// The mission and its deviations: a file of samples is continued only with the same.
pub(crate) const RUN: &str = "montecarlo.toml";

/// Longest time for which samples are held back from the file.
const HELD_BACK: Duration = Duration::from_secs(1);

/// The layout of samples: names of their deviations and results, and the statement of mission and steering.
#[derive(Clone, Copy, Debug)]
pub struct SampleLayout<'a> {
    /// Names of the deviations.
    pub names: &'a [&'a str],
    /// Names of the results.
    pub columns: &'a [&'a str],
    /// Mission and steering.
    pub statement: &'a str,
    /// Index of the first sample.
    pub first: usize,
}

/// The file of the samples of a run.
#[derive(Debug)]
pub struct SampleFile {
    path: PathBuf,
    writer: BufWriter<File>,
    written: Instant,
    format: RowFormat,
    first: usize,
}

impl SampleFile {
    /// Opens `montecarlo.csv` of a directory, which is made if need be, and returns the number of samples that are there: those of the same
    /// run without a gap from the first index on. A line that was not finished is left out. The `deviations` are functions of the index. The
    /// statement of what is flown is kept in `montecarlo.toml`, so that samples of another mission are not taken for those of this one.
    ///
    /// No more than the beginning and the end is read of a file whose last whole line is sound; all of it is read when it is finished.
    ///
    /// # Errors
    /// When the file cannot be read or written, or is of another run.
    pub fn open(
        dir: &Path,
        layout: &SampleLayout<'_>,
        deviations: impl Fn(usize) -> Vec<f64>,
    ) -> Result<(Self, usize), ReportError> {
        let path = dir.join(DATA);
        let format = RowFormat::new(layout.names, layout.columns, layout.statement)?;
        std::fs::create_dir_all(dir).map_err(failed("create the directory of", &path))?;
        let stated = dir.join(RUN);
        let end = if path.exists() {
            if regular_file::read_text(&stated).ok().is_none_or(|earlier| earlier != layout.statement) {
                return Err(other("samples of another mission or steering"));
            }
            Some(sound_end(&path, &format, layout.first, deviations)?)
        } else {
            begin(&path, &stated, &format, layout.statement)?;
            None
        };
        let mut file = OpenOptions::new().append(true).open(&path).map_err(failed("write", &path))?;
        if let Some((bytes, _)) = end {
            // What was not finished.
            file.set_len(bytes).and_then(|()| file.flush()).map_err(failed("write", &path))?;
        }
        let done = end.map_or(0, |(_, done)| done);
        let (writer, written) = (BufWriter::new(file), Instant::now());
        Ok((Self { path, writer, written, format, first: layout.first }, done))
    }

    /// Appends a sample.
    ///
    /// # Errors
    /// When the system refuses to write.
    pub fn add(&mut self, sample: &Sample) -> Result<(), ReportError> {
        let mut written = self.writer.write_all(self.format.line(sample).as_bytes());
        if self.written.elapsed() >= HELD_BACK {
            written = written.and_then(|()| self.writer.flush());
            self.written = Instant::now();
        }
        written.map_err(failed("write", &self.path))
    }

    /// Writes what is not written yet.
    ///
    /// # Errors
    /// When the system refuses to write, or the file is not at its place any more.
    pub fn finish(mut self) -> Result<StoredSamples, ReportError> {
        let settled = self.writer.flush().and_then(|()| {
            let file = self.writer.get_ref();
            file.sync_all()?;
            // Samples went on into a file that has no name any more.
            let gone = || io::Error::new(io::ErrorKind::NotFound, "was removed or replaced meanwhile");
            if regular_file::is_at(file, &self.path) { Ok(()) } else { Err(gone()) }
        });
        settled.map_err(failed("write", &self.path))?;
        Ok(StoredSamples { path: self.path, format: self.format, first: self.first })
    }
}

/// Samples in a file that is complete.
#[derive(Debug)]
pub struct StoredSamples {
    path: PathBuf,
    format: RowFormat,
    first: usize,
}

impl StoredSamples {
    /// Samples that another process wrote.
    ///
    /// # Errors
    /// Names without a form as a table.
    pub(crate) fn in_directory(dir: &Path, layout: &SampleLayout<'_>) -> Result<Self, ReportError> {
        let format = RowFormat::new(layout.names, layout.columns, layout.statement)?;
        Ok(Self { path: dir.join(DATA), format, first: layout.first })
    }

    /// The number of whole rows from the first index on without a gap, not more than a limit. A row that was altered counts: it is found where
    /// rows are read.
    pub(crate) fn whole_rows(&self, limit: usize) -> Result<usize, ReportError> {
        let mut rows = self.format.open(&self.path)?;
        let mut count = 0;
        while count < limit {
            match rows.next().map_err(failed("read", &self.path))? {
                Some((_, sample)) if sample.index == self.first + count => count += 1,
                _ => break,
            }
        }
        Ok(count)
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its first line.
    pub(crate) fn heads(&self) -> &[u8] {
        self.format.heads()
    }

    /// Hands on the first `count` samples, each with its line, and adds the lines to a digest; each has to be as it was written.
    ///
    /// # Errors
    /// A row that is missing or was altered; those of `each`.
    pub(crate) fn each_line(
        &self,
        count: usize,
        digest: &mut RowsDigest,
        mut each: impl FnMut(&[u8], &Sample) -> Result<(), ReportError>,
    ) -> Result<(), ReportError> {
        self.format.open(&self.path)?.each(&self.path, self.indices(count), true, |line, sample| {
            digest.add(line);
            each(line, sample)
        })
    }

    /// As [`each_line`](Self::each_line), without its checks and without the deviations.
    pub(crate) fn each_again(&self, count: usize, mut each: impl FnMut(&Sample)) -> Result<(), ReportError> {
        self.format.open(&self.path)?.each(&self.path, self.indices(count), false, |_, sample| {
            each(sample);
            Ok(())
        })
    }

    fn indices(&self, count: usize) -> Range<usize> {
        self.first..self.first + count
    }
}

/// A digest of rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct RowsDigest(Sha256);

impl RowsDigest {
    pub(crate) fn add(&mut self, line: &[u8]) {
        self.0.update(line);
    }

    /// The digest in hexadecimal digits.
    pub(crate) fn words(self) -> String {
        digits(&self.0.finalize())
    }
}

/// Begins a file, with the statement of what is flown beside it.
fn begin(path: &Path, stated: &Path, format: &RowFormat, statement: &str) -> Result<(), ReportError> {
    let file = |path: &Path, content: &[u8]| -> Result<WholeFile, ReportError> {
        let mut file = WholeFile::create(path).map_err(failed("write", path))?;
        file.write_all(content).map_err(failed("write", path))?;
        Ok(file)
    };
    let files = vec![file(stated, statement.as_bytes())?, file(path, format.heads())?];
    publish_together(files, &[]).map_err(|(path, source)| failed("write", &path)(source))
}

/// The place behind the rows that are sound, and their number.
fn sound_end(
    path: &Path,
    format: &RowFormat,
    first: usize,
    own: impl Fn(usize) -> Vec<f64>,
) -> Result<(u64, usize), ReportError> {
    let check = |sample: &Sample| match sample.deviations == own(sample.index) {
        true => Ok(()),
        false => Err(other("deviations of another seed or other sizes")),
    };
    let mut rows = format.open(path)?;
    let begin = rows.next().map_err(failed("read", path))?.map(|(_, sample)| sample.index);
    match begin {
        // An unfinished first line, or none.
        None => return Ok((format.heads().len() as u64, 0)),
        Some(begin) if begin != first => {
            return Err(other(format!("samples from index {begin} on, not from {first} on")));
        }
        Some(_) => {}
    }
    if let Some((bytes, last)) = format.last(path).map_err(failed("read", path))?
        && last.index >= first
    {
        check(&last)?;
        return Ok((bytes, last.index - first + 1));
    }
    // The end is not as it was written: all before it is looked at.
    let mut rows = format.open(path)?;
    let (mut bytes, mut done, mut first_altered) = (format.heads().len() as u64, 0, None);
    while let Some((line, sample)) = rows.next().map_err(failed("read", path))? {
        if sample.index != first + done {
            break;
        }
        check(&sample)?;
        if first_altered.is_none() && !format.is_sound(line) {
            first_altered = Some(sample.index);
        }
        bytes += line.len() as u64;
        done += 1;
    }
    match first_altered {
        Some(index) => Err(altered(index)),
        None => Ok((bytes, done)),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use apsides_pipeline::dispersion::Deviations;

    const NAMES: &[&str] = &Deviations::names();
    const COLUMNS: &[&str] = &["along_m", "across_m"];
    const STATEMENT: &str = "mission = \"one\"\n";

    fn own(seed: u64) -> impl Fn(usize) -> Vec<f64> {
        let dispersions = Deviations { position_m: [1.0; 3], ..Deviations::default() };
        move |index| dispersions.sample(seed, index).values().to_vec()
    }

    fn sample(index: usize) -> Sample {
        Sample { index, deviations: own(4)(index), results: vec![0.1 * index as f64, f64::NAN], fault: None }
    }

    fn layout(first: usize) -> SampleLayout<'static> {
        SampleLayout { names: NAMES, columns: COLUMNS, statement: STATEMENT, first }
    }

    fn open(dir: &Path, first: usize) -> Result<(SampleFile, usize), ReportError> {
        SampleFile::open(dir, &layout(first), own(4))
    }

    fn refused(found: Result<(SampleFile, usize), ReportError>) -> String {
        found.err().unwrap().to_string()
    }

    /// Samples that went into a file without a name are lost, which is said.
    #[cfg(unix)]
    #[test]
    fn a_file_that_was_removed_meanwhile_is_an_output_that_is_lost() {
        let dir = tempfile::tempdir().unwrap();
        let (mut file, _) = open(dir.path(), 0).unwrap();
        file.add(&sample(0)).unwrap();
        std::fs::remove_file(dir.path().join(DATA)).unwrap();
        let lost = file.finish().unwrap_err();
        assert!(lost.is_lost_output() && lost.to_string().contains("was removed or replaced"), "{lost}");
    }

    /// The rows that are read of a finished file.
    fn rows(stored: &StoredSamples, count: usize) -> Result<Vec<usize>, ReportError> {
        let mut found = Vec::new();
        stored.each_line(count, &mut RowsDigest::default(), |_, sample| {
            found.push(sample.index);
            Ok(())
        })?;
        Ok(found)
    }

    #[test]
    fn a_file_goes_on_after_its_last_whole_line() {
        for first in [0, 250_000] {
            let dir = tempfile::tempdir().unwrap();
            let (mut file, done) = open(dir.path(), first).unwrap();
            assert_eq!(done, 0);
            for k in 0..3 {
                file.add(&sample(first + k)).unwrap();
            }
            let path = file.finish().unwrap().path;
            let sound = std::fs::read_to_string(&path).unwrap();
            // A line that was cut at any byte is flown again.
            let begin = sound[..sound.len() - 1].rfind('\n').unwrap() + 1;
            for at in begin..sound.len() {
                std::fs::write(&path, &sound[..at]).unwrap();
                let (mut file, done) = open(dir.path(), first).unwrap();
                assert_eq!(done, 2);
                file.add(&sample(first + 2)).unwrap();
                file.finish().unwrap();
                assert_eq!(std::fs::read_to_string(&path).unwrap(), sound, "cut at {at}");
            }
            // Blocks of zeros, as of a machine that lost power.
            std::fs::write(&path, [sound.as_bytes(), &[0; 4096], b"\n"].concat()).unwrap();
            let (mut file, done) = open(dir.path(), first).unwrap();
            assert_eq!(done, 3);
            file.add(&sample(first + 3)).unwrap();
            assert_eq!(rows(&file.finish().unwrap(), 4).unwrap(), (first..first + 4).collect::<Vec<_>>());
        }
    }

    #[test]
    fn what_was_altered_or_is_of_another_run_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let (mut file, _) = open(dir.path(), 0).unwrap();
        (0..4).for_each(|k| file.add(&sample(k)).unwrap());
        let stored = file.finish().unwrap();
        let path = stored.path().to_owned();
        let sound = std::fs::read_to_string(&path).unwrap();
        // A result in the middle: found where all rows are read, which is before anything is made of them.
        std::fs::write(&path, sound.replacen(",0.2,", ",0.25,", 1)).unwrap();
        assert_eq!(open(dir.path(), 0).unwrap().1, 4);
        let error = rows(&stored, 4).unwrap_err().to_string();
        assert!(error.contains("a sample that was altered, that of index 2"), "{error}");
        // One at the end: found before anything is flown.
        std::fs::write(&path, sound.replacen(",0.30000000000000004,", ",0.25,", 1)).unwrap();
        assert!(refused(open(dir.path(), 0)).contains("that of index 3"));
        // A row that is missing, and two in the wrong order.
        let lines: Vec<&str> = sound.split_inclusive('\n').collect();
        for (order, index) in [(&[0, 1, 3, 4][..], 1), (&[0, 1, 3, 2, 4], 1), (&[0, 1, 2, 2, 3, 4], 2)] {
            std::fs::write(&path, order.iter().map(|k| lines[*k]).collect::<String>()).unwrap();
            let error = rows(&stored, 4).unwrap_err().to_string();
            assert!(error.contains(&format!("no row of sample {index} where it should be")), "{error}");
        }
        std::fs::write(&path, &sound).unwrap();
        let layouts = [
            (SampleLayout { statement: "another", ..layout(0) }, "another mission or steering"),
            (SampleLayout { columns: &["up_m", "along_m"], ..layout(0) }, "other columns"),
            (layout(2), "samples from index 0 on, not from 2 on"),
        ];
        for (layout, part) in layouts {
            let error = refused(SampleFile::open(dir.path(), &layout, own(4)));
            assert!(error.contains(part), "{error}");
        }
        let error = refused(SampleFile::open(dir.path(), &layout(0), own(5)));
        assert!(error.contains("another seed"), "{error}");
    }
}
