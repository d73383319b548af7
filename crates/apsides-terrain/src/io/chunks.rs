//! Compressed strips and tiles of a TIFF.

use std::io::{Read, Seek};

use super::sample::{Order, Sample};
use super::{bytes_at, malformed, unreadable};
use crate::TerrainError;

mod codec;
mod lerc;

pub(super) const NAME: &str = "GeoTIFF";

/// Most bytes of one strip or tile, compressed or not.
const LARGEST: u64 = 1 << 28;
/// Bytes of decoded strips and tiles that are kept.
const KEPT: usize = 1 << 26;

/// The places of the strips or tiles of a raster.
pub(super) struct Grid {
    pub(super) rows: u64,
    pub(super) cols: u64,
    pub(super) chunk_rows: u64,
    pub(super) chunk_cols: u64,
    pub(super) offsets: Vec<u64>,
    /// Compressed bytes of each; zero for a chunk of gaps.
    pub(super) sizes: Vec<u64>,
}

/// A compression of TIFF.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Compression {
    None,
    Lzw,
    Deflate,
    PackBits,
    Zstd,
    /// LERC, and what its blobs are packed with once more.
    Lerc(LercPacking),
}

/// The compression around the blobs of LERC.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LercPacking {
    None,
    Deflate,
    Zstd,
}

/// Compressions that are told by name though they are not read: codes of TIFF 6.0 and of libtiff.
const NAMED: [(u64, &str); 13] = [
    (2, "CCITT RLE"),
    (3, "CCITT group 3"),
    (4, "CCITT group 4"),
    (6, "old JPEG"),
    (7, "JPEG"),
    (32809, "ThunderScan"),
    (34661, "JBIG"),
    (34676, "SGI log"),
    (34712, "JPEG 2000"),
    (34925, "LZMA"),
    (50001, "WebP"),
    (50002, "JPEG XL"),
    (52546, "JPEG XL"),
];

impl Compression {
    /// The compression of a code of the tag; `lerc` are the parameters of LERC (tag 50674): its version and the code of its packing.
    pub(super) fn of(code: u64, lerc: Option<&[u64]>) -> Result<Compression, TerrainError> {
        Ok(match code {
            1 => Compression::None,
            5 => Compression::Lzw,
            8 | 32946 => Compression::Deflate,
            32773 => Compression::PackBits,
            50000 | 34926 => Compression::Zstd,
            34887 => Compression::Lerc(match lerc {
                Some([_, 0, ..]) => LercPacking::None,
                Some([_, 1, ..]) => LercPacking::Deflate,
                Some([_, 2, ..]) => LercPacking::Zstd,
                other => {
                    let found = other.map_or("missing".to_owned(), |p| format!("{:?}", &p[..p.len().min(4)]));
                    let problem =
                        format!("{found}: a version and 0 (none), 1 (deflate) or 2 (zstd) are needed");
                    return Err(malformed(NAME, "parameters of LERC (tag 50674)", problem));
                }
            }),
            _ => {
                let name =
                    NAMED.iter().find(|(c, _)| *c == code).map_or(String::new(), |(_, n)| format!(" ({n})"));
                return Err(TerrainError::Unsupported {
                    format: NAME,
                    feature: format!("compression {code}{name}"),
                    supported: "none (1), LZW (5), deflate (8, 32946), PackBits (32773), zstd (50000), LERC (34887); \
                                `gdal_translate -co COMPRESS=DEFLATE in.tif out.tif` converts a file",
                });
            }
        })
    }

    /// Most bytes that can come out of one compressed byte: 258 bytes from two bits of deflate; a string of at most 4096 bytes from a
    /// code of at least 9 bits; 128 bytes from two; a block of zstd of at most 2^17 bytes from four. A blob of LERC may hold one height
    /// for all pixels.
    fn expansion(self) -> u64 {
        match self {
            Compression::None => 1,
            Compression::Deflate => 1032,
            Compression::Lzw => 4096,
            Compression::PackBits => 64,
            Compression::Zstd => 1 << 15,
            Compression::Lerc(_) => u64::MAX,
        }
    }
}

/// The storage of the numbers of a chunk.
#[derive(Clone, Copy)]
pub(super) struct Coding {
    pub(super) sample: Sample,
    pub(super) order: Order,
    pub(super) compression: Compression,
    /// Code of TIFF: 1, 2 or 3.
    pub(super) predictor: u64,
}

impl Coding {
    /// Order of the bytes of decoded numbers: the floating-point predictor leaves big-endian ones.
    fn decoded(self) -> Order {
        let planes = self.predictor == 3 && !matches!(self.compression, Compression::Lerc(_));
        if planes { Order::Big } else { self.order }
    }
}

/// Strips or tiles that are decoded when they are needed.
pub(super) struct Chunks<R> {
    reader: R,
    coding: Coding,
    grid: Grid,
    /// Decoded chunks, the latest used last.
    kept: Vec<(usize, Vec<u8>)>,
    scratch: Vec<u8>,
}

impl<R: Read + Seek> Chunks<R> {
    pub(super) fn new(reader: R, coding: Coding, grid: Grid) -> Result<Chunks<R>, TerrainError> {
        let bytes = grid
            .chunk_cols
            .checked_mul(coding.sample.size() as u64)
            .and_then(|row| row.checked_mul(grid.chunk_rows.min(grid.rows)));
        if bytes.is_none_or(|b| b > LARGEST) {
            return Err(TerrainError::Unsupported {
                format: NAME,
                feature: format!(
                    "compressed strips or tiles of {} x {} pixels",
                    grid.chunk_rows, grid.chunk_cols
                ),
                supported: "at most 256 MiB in one strip or tile",
            });
        }
        Ok(Chunks { reader, coding, grid, kept: Vec::new(), scratch: Vec::new() })
    }

    /// Most bytes that can come out of one compressed byte.
    pub(super) fn expansion(&self) -> u64 {
        self.coding.compression.expansion()
    }

    /// Fills `out`, rows of `cols` numbers, from the window whose first pixel is (`row`, `col`). The window is inside the raster.
    pub(super) fn fill(
        &mut self,
        row: usize,
        col: usize,
        cols: usize,
        out: &mut [f64],
    ) -> Result<(), TerrainError> {
        let (height, width) = (self.grid.chunk_rows as usize, self.grid.chunk_cols as usize);
        let across = (self.grid.cols as usize).div_ceil(width);
        let (end_row, end_col) = (row + out.len() / cols, col + cols);
        let (sample, order) = (self.coding.sample, self.coding.decoded());
        let size = sample.size();
        for cr in row / height..=(end_row - 1) / height {
            for cc in col / width..=(end_col - 1) / width {
                let index = cr * across + cc;
                if self.grid.sizes[index] == 0 {
                    continue;
                }
                let (first_row, first_col) = (cr * height, cc * width);
                let rows_here = row.max(first_row)..end_row.min(first_row + height);
                let cols_here = col.max(first_col)..end_col.min(first_col + width);
                let bytes = self.chunk(index, first_row)?;
                for r in rows_here {
                    let from = ((r - first_row) * width + cols_here.start - first_col) * size;
                    let to = (r - row) * cols + cols_here.start - col;
                    let out = &mut out[to..to + cols_here.len()];
                    sample.decode(&bytes[from..from + cols_here.len() * size], order, out);
                }
            }
        }
        Ok(())
    }

    /// The decoded rows of a chunk that are inside the map, with the columns beyond its edge.
    fn chunk(&mut self, index: usize, first_row: usize) -> Result<&[u8], TerrainError> {
        if let Some(at) = self.kept.iter().position(|(i, _)| *i == index) {
            let found = self.kept.remove(at);
            self.kept.push(found);
        } else {
            let rows = (self.grid.chunk_rows as usize).min(self.grid.rows as usize - first_row);
            let count = rows * self.grid.chunk_cols as usize * self.coding.sample.size();
            let mut held: usize = self.kept.iter().map(|(_, b)| b.len()).sum();
            while held + count > KEPT && !self.kept.is_empty() {
                held -= self.kept.remove(0).1.len();
            }
            let bytes = self.decode(index, count)?;
            self.kept.push((index, bytes));
        }
        Ok(self.kept.last().map_or(&[], |(_, bytes)| bytes))
    }

    fn decode(&mut self, index: usize, count: usize) -> Result<Vec<u8>, TerrainError> {
        let Coding { sample, order, compression, predictor } = self.coding;
        let place = || format!("strip or tile {index}");
        let size = self.grid.sizes[index].min(LARGEST);
        let packed = bytes_at(&mut self.reader, self.grid.offsets[index], size);
        let packed = packed.map_err(|e| unreadable(NAME, place(), e))?;
        if count as u64 > (packed.len() as u64).saturating_mul(compression.expansion()) {
            let problem = format!("{} bytes cannot hold {count}", packed.len());
            return Err(malformed(NAME, place(), problem));
        }
        let row = self.grid.chunk_cols as usize * sample.size();
        if let Compression::Lerc(packing) = compression {
            let [whole, kept] = [self.grid.chunk_rows as usize, count / row];
            let form = lerc::Form { sample, order, cols: self.grid.chunk_cols as usize, rows: whole };
            return lerc::decode(packing, &packed, form, kept).map_err(|e| malformed(NAME, place(), e));
        }
        let mut bytes = vec![0; count];
        codec::unpack(compression, &packed, &mut bytes).map_err(|e| malformed(NAME, place(), e))?;
        match predictor {
            2 => bytes.chunks_exact_mut(row).for_each(|r| codec::sum_numbers(r, sample.size(), order)),
            3 => {
                self.scratch.resize(row, 0);
                for r in bytes.chunks_exact_mut(row) {
                    codec::sum_planes(r, sample.size(), &mut self.scratch);
                }
            }
            _ => {}
        }
        Ok(bytes)
    }
}
