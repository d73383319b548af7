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
use crate::montecarlo::INDEX;

const DATA: &str = "montecarlo.parquet";
/// Samples of a row group: some 10 MB.
const ROWS: usize = 65_536;

/// Writes `montecarlo.parquet` into a directory, in one step, and returns its path: the columns of `montecarlo.csv`, the index as a 64-bit
/// integer, all others as 64-bit floating-point numbers, without compression.
///
/// # Errors
/// When the system refuses to write.
pub fn write_parquet(
    dir: &Path,
    samples: &[Sample],
    names: &[&str],
    columns: &[&str],
) -> Result<PathBuf, ReportError> {
    let path = dir.join(DATA);
    let mut file = WholeFile::create(&path).map_err(failed("write", &path))?;
    write(&mut file, samples, names, columns, ROWS).map_err(|e| table_error(DATA, e))?;
    file.publish().map_err(failed("write", &path))?;
    Ok(path)
}

fn write(
    file: impl std::io::Write + Send,
    samples: &[Sample],
    names: &[&str],
    columns: &[&str],
    rows: usize,
) -> Result<(), ParquetError> {
    let column = |name: &str, kind| -> Result<_, ParquetError> {
        let column = Type::primitive_type_builder(name, kind).with_repetition(Repetition::REQUIRED);
        Ok(Arc::new(column.build()?))
    };
    let mut fields = vec![column(INDEX, Physical::INT64)?];
    for name in names.iter().chain(columns) {
        fields.push(column(name, Physical::DOUBLE)?);
    }
    let schema = Type::group_type_builder("samples").with_fields(fields).build()?;
    let mut writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::default())?;
    for part in samples.chunks(rows) {
        let mut group = writer.next_row_group()?;
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
    }
    writer.close()?;
    Ok(())
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
        let sample = |index: usize| {
            let deviations = (0..9).map(|k| index as f64 + 0.1 * f64::from(k)).collect();
            Sample { index, deviations, results: vec![-(index as f64) / 3.0, f64::NAN] }
        };
        let samples: Vec<Sample> = (0..10).map(sample).collect();
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("samples.parquet");
        write(File::create(&path).unwrap(), &samples, &Deviations::names(), &["along_m", "across_m"], 4)
            .unwrap();
        let reader = SerializedFileReader::new(File::open(&path).unwrap()).unwrap();
        assert_eq!(reader.metadata().num_row_groups(), 3);
        let names: Vec<String> = (reader.metadata().file_metadata().schema_descr().columns().iter())
            .map(|c| c.name().to_owned())
            .collect();
        assert_eq!(
            (names.len(), &names[0][..], &names[1][..], &names[10][..]),
            (12, "index", "start_up_m", "along_m")
        );
        let mut rows = 0;
        for (row, s) in reader.get_row_iter(None).unwrap().zip(&samples) {
            let row = row.unwrap();
            assert_eq!(row.get_long(0).unwrap(), s.index as i64);
            for (k, d) in s.deviations.iter().enumerate() {
                assert_eq!(row.get_double(1 + k).unwrap(), *d);
            }
            assert_eq!(row.get_double(10).unwrap(), s.results[0]);
            assert!(row.get_double(11).unwrap().is_nan());
            rows += 1;
        }
        assert_eq!(rows, 10);
    }

    #[test]
    fn the_file_of_a_directory_is_replaced() {
        let dir = tempfile::tempdir().unwrap();
        for _ in 0..2 {
            let path = write_parquet(dir.path(), &[], &["up_m"]).unwrap();
            assert!(path.ends_with("montecarlo.parquet") && path.exists());
        }
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
    }
}
