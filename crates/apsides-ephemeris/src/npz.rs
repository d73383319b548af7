//! All columns as arrays of NumPy: a zip archive of files `.npy`, not compressed.
//!
//! Phases and instants are arrays of text, all others of numbers in double precision.
//!
//! NumPy Enhancement Proposal 1 (the format `.npy`); PKWARE, .ZIP File Format Specification, 6.3.10.

use crate::EphemerisError;
use crate::table::Ephemeris;

/// Name of the file.
pub(crate) const FILE: &str = "ephemeris.npz";

/// The archive of a table.
pub(crate) fn write(table: &Ephemeris) -> Result<Vec<u8>, EphemerisError> {
    let rows = table.times.len();
    let mut archive = Archive::default();
    archive.add("phase", &texts((0..rows).map(|row| table.phase_of(row).to_owned()).collect()))?;
    archive
        .add(&table.epoch_header(), &texts((0..rows).map(|row| table.epoch_of(row).calendar()).collect()))?;
    archive.add("time_s", &numbers(&table.times))?;
    for (column, values) in &table.columns {
        archive.add(&column.header(), &numbers(values))?;
    }
    archive.end()
}

/// Bytes to which a header and what comes before it are filled up.
const ALIGNED: usize = 64;

/// Magic, version and header of an array of a type and a length.
fn header(kind: &str, length: usize) -> Vec<u8> {
    let dictionary = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({length},), }}");
    let before = 10 + dictionary.len() + 1;
    let padding = before.next_multiple_of(ALIGNED) - before;
    let size = (dictionary.len() + padding + 1) as u16;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(size.to_le_bytes());
    bytes.extend(dictionary.bytes());
    bytes.extend(std::iter::repeat_n(b' ', padding));
    bytes.push(b'\n');
    bytes
}

fn numbers(values: &[f64]) -> Vec<u8> {
    let mut bytes = header("<f8", values.len());
    values.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    bytes
}

/// Text of a fixed width, filled with zeros.
fn texts(values: Vec<String>) -> Vec<u8> {
    let width = values.iter().map(|v| v.chars().count()).max().unwrap_or(0).max(1);
    let mut bytes = header(&format!("<U{width}"), values.len());
    for value in values {
        let count = value.chars().count();
        let letters = value.chars().map(u32::from).chain(std::iter::repeat_n(0, width - count));
        letters.for_each(|letter| bytes.extend(letter.to_le_bytes()));
    }
    bytes
}

/// A zip archive without compression.
#[derive(Default)]
struct Archive {
    bytes: Vec<u8>,
    directory: Vec<u8>,
    files: u16,
}

/// The first day that the format can say: 1980-01-01, 00:00.
const TIME_AND_DATE: [u16; 2] = [0, 33];

impl Archive {
    fn add(&mut self, name: &str, content: &[u8]) -> Result<(), EphemerisError> {
        let name = format!("{name}.npy");
        let (size, offset) = (small(content.len())?, small(self.bytes.len())?);
        let mut common = Vec::new();
        // Version 2.0, no flags, stored.
        for field in [20_u16, 0, 0, TIME_AND_DATE[0], TIME_AND_DATE[1]] {
            common.extend(field.to_le_bytes());
        }
        for field in [crc32fast::hash(content), size, size] {
            common.extend(field.to_le_bytes());
        }
        common.extend((name.len() as u16).to_le_bytes());
        common.extend(0_u16.to_le_bytes());
        self.bytes.extend(0x0403_4b50_u32.to_le_bytes());
        self.bytes.extend(&common);
        self.bytes.extend(name.bytes());
        self.bytes.extend(content);
        self.directory.extend(0x0201_4b50_u32.to_le_bytes());
        self.directory.extend(20_u16.to_le_bytes());
        self.directory.extend(&common);
        // No comment, first disk, attributes.
        self.directory.extend([0; 10]);
        self.directory.extend(offset.to_le_bytes());
        self.directory.extend(name.bytes());
        self.files += 1;
        Ok(())
    }

    fn end(mut self) -> Result<Vec<u8>, EphemerisError> {
        let (size, offset) = (small(self.directory.len())?, small(self.bytes.len())?);
        self.bytes.extend(&self.directory);
        self.bytes.extend(0x0605_4b50_u32.to_le_bytes());
        self.bytes.extend([0; 4]);
        self.bytes.extend(self.files.to_le_bytes());
        self.bytes.extend(self.files.to_le_bytes());
        self.bytes.extend(size.to_le_bytes());
        self.bytes.extend(offset.to_le_bytes());
        self.bytes.extend([0; 2]);
        Ok(self.bytes)
    }
}

/// A size as the format says it.
fn small(size: usize) -> Result<u32, EphemerisError> {
    u32::try_from(size).map_err(|_| {
        let source = format!("{size} bytes are more than the 4 GiB that an archive has: choose fewer rows");
        EphemerisError::Table { file: FILE, source: source.into() }
    })
}
