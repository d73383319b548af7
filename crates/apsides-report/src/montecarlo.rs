//! Monte Carlo runs: samples as CSV, written as they come and read again to go on; statistics as JSON; the ends as a figure.

use std::fs::{File, OpenOptions};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use apsides::dispersion::Deviations;
use apsides::montecarlo::{Ellipse, MonteCarlo, Sample, Statistics};

use crate::directory::{Item, json, replace};
use crate::trajectory_csv::shortest;
use crate::{Axis, Figure, ReportError, Series};

const DATA: &str = "montecarlo.csv";
const JSON: &str = "montecarlo.json";
const FIGURE: &str = "montecarlo.svg";
/// What is flown: a file of samples goes on only with the same.
const RUN: &str = "montecarlo.toml";
pub(crate) const INDEX: &str = "index";

/// Points of the outline of an ellipse.
const OUTLINE: usize = 180;

/// The file of the samples of a run.
#[derive(Debug)]
pub struct SampleFile {
    path: PathBuf,
    csv: csv::Writer<BufWriter<File>>,
}

impl SampleFile {
    /// Opens `montecarlo.csv` of a directory, which is made if need be, and returns the samples that are there: those of the same run
    /// without a gap from index 0 on. A line that was not finished is left out. The mission file of the plan (`mission_file`) and the steering
    /// are kept in `montecarlo.toml`, so that samples of another mission are not taken for those of this one.
    ///
    /// # Errors
    /// When the file cannot be read or written, or is of another run.
    pub fn open(
        dir: &Path,
        run: &MonteCarlo,
        columns: &'static [&'static str],
        mission_file: &str,
    ) -> Result<(Self, Vec<Sample>), ReportError> {
        let path = dir.join(DATA);
        let io = |action| {
            let path = path.clone();
            move |source| ReportError::Io { action, path, source }
        };
        std::fs::create_dir_all(dir).map_err(io("create the directory of"))?;
        let statement = statement(run, mission_file)?;
        let stated = dir.join(RUN);
        let done = if path.exists() {
            if std::fs::read_to_string(&stated).ok().is_none_or(|earlier| earlier != statement) {
                return Err(other("samples of another mission or steering"));
            }
            read(&path, run, columns)?
        } else {
            Vec::new()
        };
        std::fs::write(&stated, statement).map_err(io("write"))?;
        // The file anew with what is sound, in one step.
        let next = dir.join(format!("{DATA}.part"));
        let mut csv = csv::Writer::from_writer(BufWriter::new(File::create(&next).map_err(io("write"))?));
        let heads = std::iter::once(INDEX).chain(Deviations::names()).chain(columns.iter().copied());
        csv.write_record(heads).map_err(table)?;
        for sample in &done {
            csv.write_record(record(sample)).map_err(table)?;
        }
        csv.flush().map_err(io("write"))?;
        drop(csv);
        std::fs::rename(&next, &path).map_err(io("write"))?;
        let file = OpenOptions::new().append(true).open(&path).map_err(io("write"))?;
        let csv = csv::WriterBuilder::new().has_headers(false).from_writer(BufWriter::new(file));
        Ok((Self { path, csv }, done))
    }

    /// Appends a sample.
    ///
    /// # Errors
    /// When the system refuses to write.
    pub fn add(&mut self, sample: &Sample) -> Result<(), ReportError> {
        self.csv.write_record(record(sample)).map_err(table)
    }

    /// Writes what is not written yet, and returns the path.
    ///
    /// # Errors
    /// When the system refuses to write.
    pub fn finish(mut self) -> Result<PathBuf, ReportError> {
        match self.csv.flush() {
            Ok(()) => Ok(self.path),
            Err(source) => Err(ReportError::Io { action: "write", path: self.path, source }),
        }
    }
}

/// The mission, and how its flights are steered.
fn statement(run: &MonteCarlo, mission_file: &str) -> Result<String, ReportError> {
    let steering = serde_json::to_string(&(&run.guidance, &run.onboard))
        .map_err(|source| ReportError::Json { file: RUN, source })?;
    Ok(format!("# Steering: {steering}\n{mission_file}"))
}

fn other(what: &str) -> ReportError {
    ReportError::Table {
        file: DATA,
        reason: format!("the file in the directory has {what}: choose another directory, or remove it"),
    }
}

fn table(e: csv::Error) -> ReportError {
    ReportError::Table { file: DATA, reason: e.to_string() }
}

fn record(sample: &Sample) -> impl Iterator<Item = String> + '_ {
    let numbers = sample.deviations.iter().chain(&sample.results).copied().map(shortest);
    std::iter::once(sample.index.to_string()).chain(numbers)
}

fn read(path: &Path, run: &MonteCarlo, columns: &'static [&'static str]) -> Result<Vec<Sample>, ReportError> {
    let mut reader = csv::ReaderBuilder::new().flexible(true).from_path(path).map_err(table)?;
    let heads: Vec<String> = reader.headers().map_err(table)?.iter().map(str::to_owned).collect();
    let expected: Vec<&str> =
        std::iter::once(INDEX).chain(Deviations::names()).chain(columns.iter().copied()).collect();
    if heads != expected {
        return Err(other("other columns"));
    }
    let mut done: Vec<Sample> = Vec::new();
    for line in reader.records() {
        let Ok(line) = line else { break };
        let numbers: Option<Vec<f64>> = line.iter().map(|field| field.parse().ok()).collect();
        let Some(numbers) = numbers.filter(|n| n.len() == expected.len() && n[0] == done.len() as f64) else {
            break;
        };
        let (deviations, results) = numbers[1..].split_at(Deviations::names().len());
        let own = run.dispersions.sample(run.seed, done.len()).values();
        if deviations != own {
            return Err(other("deviations of another seed or other sizes"));
        }
        done.push(Sample { index: done.len(), deviations: deviations.to_vec(), results: results.to_vec() });
    }
    // The last line may lack its end.
    let text = std::fs::read(path).unwrap_or_default();
    let ends = text.iter().filter(|b| **b == b'\n').count();
    done.truncate(ends.saturating_sub(1));
    Ok(done)
}

/// Writes `montecarlo.json` and `montecarlo.svg` into a directory, and returns the paths written.
///
/// # Errors
/// [`ReportError`] with the path and the reason.
pub fn write_statistics(
    dir: &Path,
    title: &str,
    samples: &[Sample],
    columns: &'static [&'static str],
    statistics: &Statistics,
) -> Result<Vec<PathBuf>, ReportError> {
    let figure = landing_figure(title, samples, columns, statistics).to_svg()?.into_bytes();
    let items: Vec<Item> = vec![(JSON, Some(json(JSON, statistics)?)), (FIGURE, Some(figure))];
    replace(dir, &items)
}

/// The ends over ground, to scale, with the ellipses of one and three standard deviations, and that of the state-transition matrix.
#[must_use]
pub fn landing_figure(
    title: &str,
    samples: &[Sample],
    columns: &'static [&'static str],
    statistics: &Statistics,
) -> Figure {
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
    use apsides::montecarlo::{Guidance, Onboard};

    const COLUMNS: &[&str] = &["along_m", "across_m"];
    const MISSION: &str = "mission = \"one\"\n";

    fn run(seed: u64) -> MonteCarlo {
        let dispersions = Deviations { position_m: [1.0; 3], ..Deviations::default() };
        let (guidance, onboard) = (Guidance::OpenLoop, Onboard::default());
        MonteCarlo { samples: 9, seed, threads: 1, dispersions, guidance, onboard }
    }

    fn sample(run: &MonteCarlo, index: usize) -> Sample {
        let deviations = run.dispersions.sample(run.seed, index).values().to_vec();
        Sample { index, deviations, results: vec![0.1 * index as f64, f64::NAN] }
    }

    #[test]
    fn a_file_goes_on_after_its_last_whole_line() {
        let dir = tempfile::tempdir().unwrap();
        let of = run(4);
        let (mut file, done) = SampleFile::open(dir.path(), &of, COLUMNS, MISSION).unwrap();
        assert!(done.is_empty());
        for k in 0..3 {
            file.add(&sample(&of, k)).unwrap();
        }
        let path = file.finish().unwrap();
        let mut text = std::fs::read_to_string(&path).unwrap();
        text.push_str("3,0.5,0.2");
        std::fs::write(&path, text).unwrap();
        let (mut file, done) = SampleFile::open(dir.path(), &of, COLUMNS, MISSION).unwrap();
        assert_eq!(done.len(), 3);
        assert_eq!((done[2].index, &done[2].deviations), (2, &sample(&of, 2).deviations));
        file.add(&sample(&of, 3)).unwrap();
        file.finish().unwrap();
        let (_, done) = SampleFile::open(dir.path(), &of, COLUMNS, MISSION).unwrap();
        assert_eq!(done.len(), 4);
        // Another mission, another steering, another seed, other columns.
        let refused = |run: &MonteCarlo, mission: &str| {
            SampleFile::open(dir.path(), run, COLUMNS, mission).err().unwrap().to_string()
        };
        let law = MonteCarlo { guidance: Guidance::Polynomial, ..of.clone() };
        for error in [refused(&of, "mission = \"two\"\n"), refused(&law, MISSION)] {
            assert!(error.contains("another mission or steering"), "{error}");
        }
        let error = SampleFile::open(dir.path(), &run(5), COLUMNS, MISSION).err().unwrap().to_string();
        assert!(error.contains("another seed"), "{error}");
        let error = SampleFile::open(dir.path(), &of, &["up_m"], MISSION).err().unwrap().to_string();
        assert!(error.contains("other columns"), "{error}");
    }
}
