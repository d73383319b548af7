//! Samples of a Monte Carlo run as Parquet, row group after row group.
//!
//! A Parquet file ends with its index and cannot be continued: the file of a run that was stopped is `montecarlo.csv`, and this one is
//! made of all samples at the end.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use apsides_pipeline::montecarlo::Sample;
use apsides_pipeline::whole_file::WholeFile;
use parquet::basic::{Repetition, Type as Physical};
use parquet::data_type::{DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use crate::ReportError;
use crate::files::{failed, table_error};
use crate::sample_file::SampleLayout;
use crate::sample_rows::INDEX;

const DATA: &str = "montecarlo.parquet";
/// Samples of a row group: some 10 MB.
const ROWS: usize = 65_536;

/// `montecarlo.parquet` in the making: the columns of `montecarlo.csv`, the index as a 64-bit integer, all others as 64-bit floating-point
/// numbers, without compression.
pub(crate) struct SampleParquet {
    path: PathBuf,
    rows: Rows<WholeFile>,
}

impl SampleParquet {
    /// Begins the file of a directory.
    pub(crate) fn create(dir: &Path, layout: &SampleLayout<'_>) -> Result<Self, ReportError> {
        let path = dir.join(DATA);
        let file = WholeFile::create(&path).map_err(failed("write", &path))?;
        let rows = Rows::new(file, layout.names, layout.columns, ROWS).map_err(|e| table_error(DATA, e))?;
        Ok(Self { path, rows })
    }

    pub(crate) fn add(&mut self, sample: &Sample) -> Result<(), ReportError> {
        self.rows.add(sample).map_err(|e| table_error(DATA, e))
    }

    /// The file, not in its place yet.
    pub(crate) fn finish(self) -> Result<(PathBuf, WholeFile), ReportError> {
        Ok((self.path, self.rows.finish().map_err(|e| table_error(DATA, e))?))
    }
}

/// Samples that go into row groups.
struct Rows<W: std::io::Write + Send> {
    writer: SerializedFileWriter<W>,
    waiting: Vec<Sample>,
    rows: usize,
}

impl<W: std::io::Write + Send> Rows<W> {
    fn new(file: W, names: &[&str], columns: &[&str], rows: usize) -> Result<Self, ParquetError> {
        let column = |name: &str, kind| -> Result<_, ParquetError> {
            let column = Type::primitive_type_builder(name, kind).with_repetition(Repetition::REQUIRED);
            Ok(Arc::new(column.build()?))
        };
        let mut fields = vec![column(INDEX, Physical::INT64)?];
        for name in names.iter().chain(columns) {
            fields.push(column(name, Physical::DOUBLE)?);
        }
        let schema = Type::group_type_builder("samples").with_fields(fields).build()?;
        let writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::default())?;
        Ok(Self { writer, waiting: Vec::new(), rows })
    }

    fn add(&mut self, sample: &Sample) -> Result<(), ParquetError> {
        self.waiting.push(sample.clone());
        if self.waiting.len() < self.rows { Ok(()) } else { self.group() }
    }

    /// Writes a row group.
    fn group(&mut self) -> Result<(), ParquetError> {
        let part = std::mem::take(&mut self.waiting);
        let mut group = self.writer.next_row_group()?;
        let mut place = 0;
        while let Some(mut column) = group.next_column()? {
            if place == 0 {
                let values: Vec<i64> = part.iter().map(|s| s.index as i64).collect();
                column.typed::<Int64Type>().write_batch(&values, None, None)?;
            } else {
                let of = |s: &Sample| s.deviations.iter().chain(&s.results).nth(place - 1).copied();
                let values: Vec<f64> = part.iter().map(|s| of(s).unwrap_or(f64::NAN)).collect();
                column.typed::<DoubleType>().write_batch(&values, None, None)?;
            }
            column.close()?;
            place += 1;
        }
        group.close()?;
        Ok(())
    }

    fn finish(mut self) -> Result<W, ParquetError> {
        if !self.waiting.is_empty() {
            self.group()?;
        }
        self.writer.into_inner()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use std::fs::File;

    use apsides_pipeline::dispersion::Deviations;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;

    #[test]
    fn every_number_is_read_back_from_every_row_group() {
        const NAMES: &[&str] = &Deviations::names();
        let (deviations, first) = (NAMES.len(), 1 + NAMES.len());
        let sample = |index: usize| {
            let deviations = (0..deviations).map(|k| index as f64 + 0.1 * k as f64).collect();
            Sample { index, deviations, results: vec![-(index as f64) / 3.0, f64::NAN], fault: None }
        };
        let samples: Vec<Sample> = (0..10).map(sample).collect();
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("samples.parquet");
        let file = File::create(&path).unwrap();
        let mut rows = Rows::new(file, NAMES, &["along_m", "across_m"], 4).unwrap();
        samples.iter().for_each(|sample| rows.add(sample).unwrap());
        rows.finish().unwrap();
        let reader = SerializedFileReader::new(File::open(&path).unwrap()).unwrap();
        assert_eq!(reader.metadata().num_row_groups(), 3);
        let names: Vec<String> = (reader.metadata().file_metadata().schema_descr().columns().iter())
            .map(|c| c.name().to_owned())
            .collect();
        assert_eq!(
            (names.len(), &names[0][..], &names[1][..], &names[first][..]),
            (first + 2, "index", NAMES[0], "along_m")
        );
        let mut rows = 0;
        for (row, s) in reader.get_row_iter(None).unwrap().zip(&samples) {
            let row = row.unwrap();
            assert_eq!(row.get_long(0).unwrap(), s.index as i64);
            for (k, d) in s.deviations.iter().enumerate() {
                assert_eq!(row.get_double(1 + k).unwrap(), *d);
            }
            assert_eq!(row.get_double(first).unwrap(), s.results[0]);
            assert!(row.get_double(first + 1).unwrap().is_nan());
            rows += 1;
        }
        assert_eq!(rows, 10);
    }

    #[test]
    fn the_file_of_a_directory_is_replaced() {
        let dir = tempfile::tempdir().unwrap();
        for _ in 0..2 {
            let layout = SampleLayout { names: &[], columns: &["up_m"], statement: "", first: 0 };
            let (path, file) = SampleParquet::create(dir.path(), &layout).unwrap().finish().unwrap();
            file.publish().unwrap();
            assert!(path.ends_with("montecarlo.parquet") && path.exists());
        }
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
    }
}
