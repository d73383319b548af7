//! Monte Carlo runs: samples as CSV, written as they come and read again to go on; statistics as JSON; the ends as a figure.

use std::fs::{File, OpenOptions};
use std::io::{self, BufRead as _, BufReader, BufWriter, Write as _};
use std::path::{Path, PathBuf};

use apsides_pipeline::montecarlo::{Ellipse, Sample, Statistics};
use apsides_pipeline::regular_file;
use apsides_pipeline::whole_file::{WholeFile, publish_together};
use sha2::{Digest as _, Sha256};

use crate::files::{Item, failed, json, replace, table_error};
use crate::trajectory_csv::shortest;
use crate::{Axis, Figure, ReportError, Series};

const DATA: &str = "montecarlo.csv";
const JSON: &str = "montecarlo.json";
const FIGURE: &str = "montecarlo.svg";
/// The mission and its deviations: a file of samples is continued only with the same.
const RUN: &str = "montecarlo.toml";
pub(crate) const INDEX: &str = "index";
/// A number that tells whether a row is as it was written.
const DIGEST: &str = "digest";

/// Points of the outline of an ellipse.
const OUTLINE: usize = 180;

/// The file of the samples of a run.
#[derive(Debug)]
pub struct SampleFile {
    path: PathBuf,
    csv: csv::Writer<BufWriter<File>>,
    statement: String,
}

impl SampleFile {
    /// Opens `montecarlo.csv` of a directory, which is made if need be, and returns the samples that are there: those of the same run
    /// without a gap from index 0 on. A line that was not finished is left out. `names` are those of the deviations, which are functions of the
    /// index. The `statement` of what is flown (mission and steering) is kept in `montecarlo.toml`, so that samples of another mission are not
    /// taken for those of this one.
    ///
    /// # Errors
    /// When the file cannot be read or written, or is of another run.
    pub fn open(
        dir: &Path,
        names: &[&str],
        deviations: impl Fn(usize) -> Vec<f64>,
        columns: &[&str],
        statement: &str,
    ) -> Result<(Self, Vec<Sample>), ReportError> {
        let path = dir.join(DATA);
        let io = |action| {
            let path = path.clone();
            move |source| ReportError::Io { action, path, source }
        };
        std::fs::create_dir_all(dir).map_err(io("create the directory of"))?;
        let stated = dir.join(RUN);
        let done = if path.exists() {
            if regular_file::read_text(&stated).ok().is_none_or(|earlier| earlier != statement) {
                return Err(other("samples of another mission or steering"));
            }
            read(&path, names, deviations, columns, statement)?
        } else {
            Vec::new()
        };
        // Both anew, the samples with what is sound.
        let mut statement_file = WholeFile::create(&stated).map_err(failed("write", &stated))?;
        statement_file.write_all(statement.as_bytes()).map_err(failed("write", &stated))?;
        let mut csv = csv::Writer::from_writer(WholeFile::create(&path).map_err(io("write"))?);
        csv.write_record(heads(names, columns)).map_err(table)?;
        for sample in &done {
            csv.write_record(record(sample, statement)).map_err(table)?;
        }
        let samples = csv.into_inner().map_err(|e| io("write")(e.into_error()))?;
        publish_together(vec![statement_file, samples], &[])
            .map_err(|(path, source)| failed("write", &path)(source))?;
        let file = OpenOptions::new().append(true).open(&path).map_err(io("write"))?;
        let csv = csv::WriterBuilder::new().has_headers(false).from_writer(BufWriter::new(file));
        Ok((Self { path, csv, statement: statement.into() }, done))
    }

    /// Appends a sample.
    ///
    /// # Errors
    /// When the system refuses to write.
    pub fn add(&mut self, sample: &Sample) -> Result<(), ReportError> {
        let unwritten = |e: csv::Error| match e.is_io_error() {
            true => failed("write", &self.path)(e.into()),
            false => table(e),
        };
        self.csv.write_record(record(sample, &self.statement)).map_err(unwritten)
    }

    /// Writes what is not written yet, and returns the path.
    ///
    /// # Errors
    /// When the system refuses to write.
    pub fn finish(mut self) -> Result<PathBuf, ReportError> {
        let settled = self.csv.flush().and_then(|()| {
            let file = self.csv.get_ref().get_ref();
            file.sync_all()?;
            // Samples went on into a file that has no name any more.
            let gone = || io::Error::new(io::ErrorKind::NotFound, "was removed or replaced meanwhile");
            if regular_file::is_at(file, &self.path) { Ok(()) } else { Err(gone()) }
        });
        match settled {
            Ok(()) => Ok(self.path),
            Err(source) => Err(ReportError::Io { action: "write", path: self.path, source }),
        }
    }
}

fn other(found: impl Into<String>) -> ReportError {
    ReportError::OtherRun { file: DATA, found: found.into() }
}

/// Names of the columns.
fn heads<'a>(names: &[&'a str], columns: &[&'a str]) -> Vec<&'a str> {
    [&[INDEX], names, columns, &[DIGEST]].concat()
}

fn table(e: csv::Error) -> ReportError {
    table_error(DATA, e)
}

/// The cells of a sample, the last one made of those before it and of what is flown.
fn record(sample: &Sample, statement: &str) -> Vec<String> {
    let numbers = sample.deviations.iter().chain(&sample.results).copied().map(shortest);
    let mut cells: Vec<String> = std::iter::once(sample.index.to_string()).chain(numbers).collect();
    let mut digest = Sha256::new();
    digest.update(statement);
    digest.update(cells.join(","));
    // So many bytes that every reader of tables has the number to its last digit.
    let number = digest.finalize().iter().take(6).fold(0_u64, |number, byte| number << 8 | u64::from(*byte));
    cells.push(number.to_string());
    cells
}

fn read(
    path: &Path,
    names: &[&str],
    own: impl Fn(usize) -> Vec<f64>,
    columns: &[&str],
    statement: &str,
) -> Result<Vec<Sample>, ReportError> {
    let file = regular_file::open(path).map_err(failed("read", path))?;
    let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(file);
    let expected = heads(names, columns);
    if reader.headers().map_err(table)?.iter().ne(expected.iter().copied()) {
        return Err(other("other columns"));
    }
    let (mut done, mut first_altered) = (Vec::<Sample>::new(), None);
    for line in reader.records() {
        let Ok(line) = line else { break };
        let numbers: Option<Vec<f64>> = line.iter().map(|field| field.parse().ok()).collect();
        let Some(numbers) = numbers.filter(|n| n.len() == expected.len() && n[0] == done.len() as f64) else {
            break;
        };
        let (deviations, results) = numbers[1..=names.len() + columns.len()].split_at(names.len());
        if deviations != own(done.len()) {
            return Err(other("deviations of another seed or other sizes"));
        }
        let sample = Sample { index: done.len(), deviations: deviations.to_vec(), results: results.to_vec() };
        if first_altered.is_none() && line.iter().ne(record(&sample, statement).iter().map(String::as_str)) {
            first_altered = Some(sample.index);
        }
        done.push(sample);
    }
    // The last line may lack its end.
    let ends = line_ends(path).map_err(failed("read", path))?;
    done.truncate(ends.saturating_sub(1));
    match first_altered.filter(|index| *index < done.len()) {
        Some(index) => Err(other(format!("a sample that was altered, that of index {index}"))),
        None => Ok(done),
    }
}

/// The number of lines of a file that have an end.
fn line_ends(path: &Path) -> io::Result<usize> {
    let mut reader = BufReader::new(regular_file::open(path)?);
    let mut ends = 0;
    loop {
        let part = reader.fill_buf()?;
        let length = part.len();
        if length == 0 {
            return Ok(ends);
        }
        ends += part.iter().filter(|b| **b == b'\n').count();
        reader.consume(length);
    }
}

/// Writes `montecarlo.json` and a figure as `montecarlo.svg` into a directory, and returns the paths written.
///
/// # Errors
/// [`ReportError`] with the path and the reason.
pub fn write_statistics(
    dir: &Path,
    figure: &Figure,
    statistics: &Statistics,
) -> Result<Vec<PathBuf>, ReportError> {
    let figure = figure.to_svg().into_bytes();
    let items: Vec<Item> = vec![(JSON, Some(json(JSON, statistics)?)), (FIGURE, Some(figure))];
    replace(dir, &items)
}

/// The ends over ground, to scale, with the ellipses of one and three standard deviations, and that of the state-transition matrix.
#[must_use]
pub fn landing_figure(title: &str, samples: &[Sample], columns: &[&str], statistics: &Statistics) -> Figure {
    let column = |name: &str| columns.iter().position(|c| *c == name);
    let (along, across) = (column("along_m"), column("across_m"));
    let place = |s: &Sample| Some([*s.results.get(across?)?, *s.results.get(along?)?]);
    let ends = samples.iter().filter_map(place).filter(|p| p.iter().all(|v| v.is_finite())).collect();
    let mut figure =
        Figure::new(title, Axis::new("across the course", "m"), Axis::new("along the course", "m"))
            .with(Series::dots("ends", ends));
    if let Some(ellipse) = &statistics.ellipse {
        for (k, sigmas) in [1.0, 3.0].into_iter().enumerate() {
            figure =
                figure.with(Series::line(format!("{sigmas} sigma"), outline(ellipse, sigmas)).colored(k + 1));
        }
    }
    if let Some(ellipse) = &statistics.linear_ellipse {
        figure = figure.with(Series::bound("3 sigma, by the state-transition matrix", outline(ellipse, 3.0)));
    }
    figure.to_scale(1.0)
}

/// The part of all flights whose result is not above a value, for results of one unit: flights that did not end count as above all.
#[must_use]
pub fn distribution_figure(
    title: &str,
    x: Axis,
    samples: &[Sample],
    columns: &[&str],
    results: &[(&str, &str)],
) -> Figure {
    let mut figure = Figure::new(title, x, Axis::new("part of all flights", "-").including(0.0));
    for (name, label) in results {
        let Some(k) = columns.iter().position(|c| c == name) else { continue };
        let mut values: Vec<f64> = samples.iter().map(|s| s.results[k]).filter(|v| v.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let part = |rank: usize| (rank + 1) as f64 / samples.len() as f64;
        // More points than this are not told apart.
        let every = values.len().div_ceil(1000).max(1);
        let points = values.iter().enumerate().step_by(every).map(|(rank, v)| [*v, part(rank)]).collect();
        figure = figure.with(Series::line(*label, points));
    }
    figure
}

fn outline(e: &Ellipse, sigmas: f64) -> Vec<[f64; 2]> {
    let (sin, cos) = e.angle_deg.to_radians().sin_cos();
    let point = |k: usize| {
        let (s, c) = (std::f64::consts::TAU * k as f64 / OUTLINE as f64).sin_cos();
        let (a, b) = (sigmas * e.semi_axes_m[0] * c, sigmas * e.semi_axes_m[1] * s);
        [e.centre_m[1] + a * sin + b * cos, e.centre_m[0] + a * cos - b * sin]
    };
    (0..=OUTLINE).map(point).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use apsides_pipeline::dispersion::Deviations;
    use apsides_pipeline::dispersion::{Guidance, Onboard};
    use apsides_pipeline::montecarlo::MonteCarlo;

    const COLUMNS: &[&str] = &["along_m", "across_m"];
    const STATEMENT: &str = "mission = \"one\"\n";

    fn run(seed: u64) -> MonteCarlo {
        let dispersions = Deviations { position_m: [1.0; 3], ..Deviations::default() };
        let (guidance, onboard) = (Guidance::OpenLoop, Onboard::default());
        MonteCarlo { samples: 9, seed, threads: 1, dispersions, guidance, onboard }
    }

    fn sample(run: &MonteCarlo, index: usize) -> Sample {
        let deviations = run.dispersions.sample(run.seed, index).values().to_vec();
        Sample { index, deviations, results: vec![0.1 * index as f64, f64::NAN] }
    }

    fn open(
        dir: &Path,
        run: &MonteCarlo,
        columns: &'static [&'static str],
    ) -> Result<(SampleFile, Vec<Sample>), ReportError> {
        let own = |index| run.dispersions.sample(run.seed, index).values().to_vec();
        SampleFile::open(dir, &Deviations::names(), own, columns, STATEMENT)
    }

    /// Samples that went into a file without a name are lost, which is said.
    #[cfg(unix)]
    #[test]
    fn a_file_that_was_removed_meanwhile_is_an_output_that_is_lost() {
        let dir = tempfile::tempdir().unwrap();
        let of = run(4);
        let (mut file, _) = open(dir.path(), &of, COLUMNS).unwrap();
        file.add(&sample(&of, 0)).unwrap();
        std::fs::remove_file(dir.path().join(DATA)).unwrap();
        let lost = file.finish().unwrap_err();
        assert!(lost.is_lost_output() && lost.to_string().contains("was removed or replaced"), "{lost}");
    }

    #[test]
    fn a_file_goes_on_after_its_last_whole_line() {
        let dir = tempfile::tempdir().unwrap();
        let of = run(4);
        let (mut file, done) = open(dir.path(), &of, COLUMNS).unwrap();
        assert!(done.is_empty());
        for k in 0..3 {
            file.add(&sample(&of, k)).unwrap();
        }
        let path = file.finish().unwrap();
        let mut text = std::fs::read_to_string(&path).unwrap();
        text.push_str("3,0.5,0.2");
        std::fs::write(&path, text).unwrap();
        let (mut file, done) = open(dir.path(), &of, COLUMNS).unwrap();
        assert_eq!(done.len(), 3);
        assert_eq!((done[2].index, &done[2].deviations), (2, &sample(&of, 2).deviations));
        file.add(&sample(&of, 3)).unwrap();
        file.finish().unwrap();
        let (_, done) = open(dir.path(), &of, COLUMNS).unwrap();
        assert_eq!(done.len(), 4);
        // A result that was altered.
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, text.replacen(",0.2,", ",0.25,", 1)).unwrap();
        let error = open(dir.path(), &of, COLUMNS).err().unwrap().to_string();
        assert!(error.contains("a sample that was altered, that of index 2"), "{error}");
        std::fs::write(&path, text).unwrap();
        // Another statement, another seed, other columns.
        let own = |k| of.dispersions.sample(of.seed, k).values().to_vec();
        let other = SampleFile::open(dir.path(), &Deviations::names(), own, COLUMNS, "another");
        let error = other.err().unwrap().to_string();
        assert!(error.contains("another mission or steering"), "{error}");
        let error = open(dir.path(), &run(5), COLUMNS).err().unwrap().to_string();
        assert!(error.contains("another seed"), "{error}");
        let error = open(dir.path(), &of, &["up_m"]).err().unwrap().to_string();
        assert!(error.contains("other columns"), "{error}");
    }
}
