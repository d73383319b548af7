//! Monte Carlo runs, whole or joined from parts: statistics as JSON, figure, page and manifest, made of the stored samples alone.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use apsides_pipeline::montecarlo::{Statistics, statistics_in_passes};
use apsides_pipeline::regular_file;
use apsides_pipeline::shard::{Joined, Part, SHARD, Shard, ShardState};
use apsides_pipeline::whole_file::WholeFile;
use serde_json::Value;

use crate::files::{Item, failed, json, replace_beside};
use crate::sample_faults::FaultFile;
use crate::sample_figure::{Picture, SampleFigure};
use crate::sample_file::{RUN, RowsDigest, SampleLayout, StoredSamples};
use crate::sample_page::page;
use crate::sample_rows::{DATA, other};
use crate::{ReportError, stacked_svg};

const JSON: &str = "montecarlo.json";
const FIGURE: &str = "montecarlo.svg";
const PAGE: &str = "montecarlo.html";

/// Names in the settings of a manifest: of deviations, of results, and what is drawn.
const DEVIATIONS: &str = "deviations";
const RESULTS: &str = "results";
const DRAWN: &str = "figure";

/// A form of the samples beside CSV.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleTable {
    /// None.
    CsvAlone,
    /// Parquet.
    #[cfg(feature = "parquet")]
    Parquet,
}

/// States in a manifest what decides the samples beside the mission: the layout of the rows, the sizes of the deviations, the figure.
pub fn state_samples(shard: &mut Shard, layout: &SampleLayout<'_>, sizes: &[f64], figure: &SampleFigure) {
    let settings = &mut shard.settings;
    for (name, size) in layout.names.iter().zip(sizes) {
        settings.insert(format!("sigma of {name}"), Value::from(*size));
    }
    settings.insert(DEVIATIONS.into(), layout.names.into());
    settings.insert(RESULTS.into(), layout.columns.into());
    settings.insert(DRAWN.into(), serde_json::to_value(figure).unwrap_or_default());
}

/// Samples of a part, and how many of them.
struct Source<'a> {
    stored: StoredSamples,
    count: usize,
    /// The digest that its rows have to have, with the manifest that states it.
    stated: Option<(&'a Path, &'a str)>,
}

/// Writes what is made of the samples of a run, or of a part of one, into its directory: `montecarlo.json`, `montecarlo.svg`, `montecarlo.html`
/// and the manifest, whose counts, state and digest are set here. Returns the statistics and the paths written.
///
/// # Errors
/// A row that is missing or was altered; the system's.
pub fn write_samples(
    dir: &Path,
    stored: StoredSamples,
    layout: &SampleLayout<'_>,
    figure: &SampleFigure,
    shard: Shard,
    table: SampleTable,
) -> Result<(Statistics, Vec<PathBuf>), ReportError> {
    let source = Source { count: shard.done, stored, stated: None };
    let work = Work { dir, layout, figure, table };
    let data = source.stored.path().to_owned();
    let (statistics, mut files) = work.write(&[source], shard, None, &mut |_| {})?;
    files.insert(0, data);
    files.push(dir.join(RUN));
    Ok((statistics, files))
}

/// Sets the number of samples of a part that is not at its end to that of the rows which are there, and adds the faults among them: the manifest
/// of a part that was killed is that of its beginning.
///
/// # Errors
/// Rows of other columns; the system's.
pub fn recount(part: &mut Part) -> Result<(), ReportError> {
    let Part { place, shard } = part;
    if shard.state.is_complete() {
        return Ok(());
    }
    let (names, columns) = (stated_words(shard, DEVIATIONS)?, stated_words(shard, RESULTS)?);
    let layout = SampleLayout { names: &names, columns: &columns, statement: "", first: shard.first };
    let done = StoredSamples::in_directory(place, &layout)?.whole_rows(shard.count)?;
    let end = shard.first + done;
    let mut faults = FaultFile::read(place, end)?;
    faults.extend(shard.faults.iter().filter(|fault| fault.index < end).cloned());
    faults.sort_by_key(|fault| fault.index);
    faults.dedup_by_key(|fault| fault.index);
    (shard.done, shard.faults) = (done, faults);
    Ok(())
}

/// Joins the samples of parts into a directory, which then has what a single run would have written. `told` gets the number of samples that were
/// read.
///
/// # Errors
/// Rows that are missing, were altered or are not those of the manifest; the system's. Nothing is written then.
pub fn merge_samples(
    out: &Path,
    joined: &Joined,
    table: SampleTable,
    told: &mut dyn FnMut(usize),
) -> Result<(Statistics, Vec<PathBuf>), ReportError> {
    let whole = &joined.whole;
    let (names, columns) = (stated_words(whole, DEVIATIONS)?, stated_words(whole, RESULTS)?);
    let drawn = whole.settings.get(DRAWN).cloned().unwrap_or_default();
    let figure: SampleFigure =
        serde_json::from_value(drawn).map_err(|_| other(format!("a manifest without `{DRAWN}`")))?;
    let mut statement = None;
    let mut sources = Vec::with_capacity(joined.parts.len());
    for part in &joined.parts {
        let path = part.place.join(RUN);
        let text = regular_file::read_text(&path).map_err(failed("read", &path))?;
        if !part.shard.states(&text) {
            let problem = "is not the statement of its manifest: run the command of the part again";
            return Err(ReportError::Directory { path, problem });
        }
        let layout =
            SampleLayout { names: &names, columns: &columns, statement: &text, first: part.shard.first };
        let stored = StoredSamples::in_directory(&part.place, &layout)?;
        let stated = part.shard.rows_sha256.as_deref().unwrap_or_default();
        // That of a part at work does not state its rows yet.
        let stated = part.shard.state.is_complete().then_some((&*part.place, stated));
        sources.push(Source { stored, count: part.shard.done, stated });
        statement.get_or_insert(text);
    }
    let statement = statement.unwrap_or_default();
    let layout = SampleLayout { names: &names, columns: &columns, statement: &statement, first: whole.first };
    let path = out.join(DATA);
    let mut data = WholeFile::create(&path).map_err(failed("write", &path))?;
    if let Some(source) = sources.first() {
        data.write_all(source.stored.heads()).map_err(failed("write", &path))?;
    }
    let work = Work { dir: out, layout: &layout, figure: &figure, table };
    let (statistics, mut files) = work.write(&sources, whole.clone(), Some(data), told)?;
    files.insert(0, path);
    Ok((statistics, files))
}

/// Words of the settings of a manifest.
fn stated_words<'a>(shard: &'a Shard, name: &str) -> Result<Vec<&'a str>, ReportError> {
    let list = shard.settings.get(name).and_then(Value::as_array);
    let words = list.and_then(|list| list.iter().map(Value::as_str).collect());
    words.ok_or_else(|| other(format!("a manifest without `{name}`")))
}

/// The results that are made of samples, and their place.
struct Work<'a> {
    dir: &'a Path,
    layout: &'a SampleLayout<'a>,
    figure: &'a SampleFigure,
    #[cfg_attr(not(feature = "parquet"), allow(dead_code, reason = "there is one table alone"))]
    table: SampleTable,
}

impl Work<'_> {
    /// `joined` takes the lines of all sources.
    fn write(
        &self,
        sources: &[Source<'_>],
        mut shard: Shard,
        mut joined: Option<WholeFile>,
        told: &mut dyn FnMut(usize),
    ) -> Result<(Statistics, Vec<PathBuf>), ReportError> {
        let data = self.dir.join(DATA);
        let count = sources.iter().map(|s| s.count).sum();
        let mut picture = Picture::of(count);
        let mut digest = RowsDigest::default();
        #[cfg(feature = "parquet")]
        let mut parquet = match self.table {
            SampleTable::Parquet => {
                Some(crate::parquet_samples::SampleParquet::create(self.dir, self.layout)?)
            }
            SampleTable::CsvAlone => None,
        };
        let mut passes = 0;
        let linear = shard.linear_covariance.clone();
        let statistics = statistics_in_passes(self.layout.columns, linear, |each| {
            passes += 1;
            for source in sources {
                if passes > 1 {
                    source.stored.each_again(source.count, &mut *each)?;
                    continue;
                }
                let mut own = RowsDigest::default();
                source.stored.each_line(source.count, &mut own, |line, sample| {
                    each(sample);
                    picture.add(sample);
                    told(1);
                    digest.add(line);
                    #[cfg(feature = "parquet")]
                    if let Some(parquet) = &mut parquet {
                        parquet.add(sample)?;
                    }
                    match &mut joined {
                        Some(file) => file.write_all(line).map_err(failed("write", &data)),
                        None => Ok(()),
                    }
                })?;
                if let Some((place, stated)) = source.stated
                    && own.words() != stated
                {
                    let problem =
                        "has samples that are not those of its manifest: run the command of the part again";
                    return Err(ReportError::Directory { path: place.into(), problem });
                }
            }
            Ok(())
        })?;
        let statistics = Statistics { faults: shard.faults.clone(), ..statistics };
        shard.done = statistics.samples;
        shard.failed = statistics.failed;
        if shard.done == shard.count {
            shard.rows_sha256 = Some(digest.words());
            shard.state = match shard.failed {
                0 => ShardState::Complete,
                _ => ShardState::CompleteWithFailures,
            };
        }
        let title = picture.title(&shard.mission, statistics.samples);
        let figure = self.figure.draw(&title, &picture, self.layout.columns, &statistics);
        let mut items: Vec<Item> = vec![
            (JSON, Some(json(JSON, &statistics)?)),
            (FIGURE, Some(stacked_svg(std::slice::from_ref(&figure)).into_bytes())),
            (PAGE, Some(page(&shard, self.layout.statement, &statistics, &figure).into_bytes())),
            (SHARD, Some(shard.to_file().into_bytes())),
        ];
        let mut files: Vec<WholeFile> = Vec::new();
        if let Some(file) = joined {
            files.push(file);
            items.push((RUN, Some(self.layout.statement.as_bytes().to_vec())));
        }
        #[cfg(feature = "parquet")]
        let table = match parquet {
            Some(parquet) => {
                let (path, file) = parquet.finish()?;
                files.push(file);
                Some(path)
            }
            None => None,
        };
        #[cfg_attr(not(feature = "parquet"), allow(unused_mut, reason = "nothing is added"))]
        let mut written = replace_beside(self.dir, files, &items)?;
        #[cfg(feature = "parquet")]
        written.splice(0..0, table);
        Ok((statistics, written))
    }
}

/// Writes the manifest of a part that is at work.
///
/// # Errors
/// The system's.
pub fn write_shard(dir: &Path, shard: &Shard) -> Result<(), ReportError> {
    replace_beside(dir, Vec::new(), &[(SHARD, Some(shard.to_file().into_bytes()))]).map(drop)
}
