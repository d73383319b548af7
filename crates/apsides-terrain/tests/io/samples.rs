//! Small files made in memory.

use std::io::Write;

use flate2::write::ZlibEncoder;

/// A TIFF with one band.
#[derive(Clone)]
pub(crate) struct Tiff {
    pub big_endian: bool,
    pub big: bool,
    pub rows: usize,
    pub cols: usize,
    /// Bits of a number and sample format (1 unsigned, 2 signed, 3 real).
    pub kind: (u16, u16),
    pub compression: u16,
    pub predictor: u16,
    /// Rows and columns of a tile, or rows of a strip.
    pub tile: (usize, Option<usize>),
    pub values: Vec<f64>,
    pub tags: Vec<Tag>,
}

/// Number, field type and bytes of a tag, in the byte order of the file.
#[derive(Clone)]
pub(crate) enum Tag {
    Short(u16, Vec<u16>),
    Long(u16, Vec<u32>),
    Long8(u16, Vec<u64>),
    Real(u16, Vec<f64>),
    Text(u16, &'static str),
}

/// Pixel scale and tie point of pixels of `pixel` metres whose first pixel has its corner at (x, y).
pub(crate) fn place(pixel: f64, x: f64, y: f64) -> Vec<Tag> {
    vec![Tag::Real(33550, vec![pixel, pixel, 0.0]), Tag::Real(33922, vec![0.0, 0.0, 0.0, x, y, 0.0])]
}

/// Geokeys whose values are in the directory.
pub(crate) fn keys(keys: &[(u16, u16)]) -> Tag {
    let mut list = vec![1, 1, 0, keys.len() as u16];
    for &(key, value) in keys {
        list.extend([key, 0, 1, value]);
    }
    Tag::Short(34735, list)
}

impl Tiff {
    pub(crate) fn new(rows: usize, cols: usize, values: Vec<f64>) -> Tiff {
        Tiff {
            big_endian: false,
            big: false,
            rows,
            cols,
            kind: (32, 3),
            compression: 1,
            predictor: 1,
            tile: (rows, None),
            values,
            tags: place(1.0, 0.0, 0.0),
        }
    }

    fn order(&self, little: &[u8]) -> Vec<u8> {
        if self.big_endian { little.iter().rev().copied().collect() } else { little.to_vec() }
    }

    fn number(&self, value: f64) -> Vec<u8> {
        match self.kind {
            (64, 3) => self.order(&value.to_le_bytes()),
            (_, 3) => self.order(&(value as f32).to_le_bytes()),
            (bits, _) => self.order(&(value as i64).to_le_bytes()[..usize::from(bits) / 8]),
        }
    }

    /// The bytes of one row of a chunk, after the predictor.
    fn row(&self, values: &[f64]) -> Vec<u8> {
        let size = usize::from(self.kind.0) / 8;
        match self.predictor {
            2 => {
                let mut last = 0.0;
                let differences = values.iter().map(|&v| v - std::mem::replace(&mut last, v));
                differences.flat_map(|d| self.number(d)).collect()
            }
            3 => {
                let numbers: Vec<u8> = values
                    .iter()
                    .flat_map(|&v| {
                        if size == 8 { v.to_be_bytes().to_vec() } else { (v as f32).to_be_bytes().to_vec() }
                    })
                    .collect();
                let planes: Vec<u8> =
                    (0..size).flat_map(|k| numbers.iter().skip(k).step_by(size).copied()).collect();
                let mut last = 0;
                planes.iter().map(|&b| b.wrapping_sub(std::mem::replace(&mut last, b))).collect()
            }
            _ => values.iter().flat_map(|&v| self.number(v)).collect(),
        }
    }

    fn compressed(&self, rows: &[Vec<u8>]) -> Vec<u8> {
        match self.compression {
            8 | 32946 => {
                let mut encoder = ZlibEncoder::new(Vec::new(), flate2::Compression::default());
                rows.iter().for_each(|r| encoder.write_all(r).unwrap());
                encoder.finish().unwrap()
            }
            5 => {
                let mut encoder = weezl::encode::Encoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8);
                encoder.encode(&rows.concat()).unwrap()
            }
            32773 => rows.iter().flat_map(|r| pack_bits(r)).collect(),
            _ => rows.concat(),
        }
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        let (height, width) = (self.tile.0, self.tile.1.unwrap_or(self.cols));
        let mut file: Vec<u8> = vec![0; 16];
        let (mut offsets, mut sizes) = (Vec::new(), Vec::new());
        for first_row in (0..self.rows).step_by(height) {
            for first_col in (0..self.cols).step_by(width) {
                let last = if self.tile.1.is_some() {
                    first_row + height
                } else {
                    self.rows.min(first_row + height)
                };
                let value = |r: usize, c: usize| {
                    if r < self.rows && c < self.cols { self.values[r * self.cols + c] } else { 0.0 }
                };
                let rows: Vec<Vec<u8>> = (first_row..last)
                    .map(|r| {
                        let values: Vec<f64> = (first_col..first_col + width).map(|c| value(r, c)).collect();
                        self.row(&values)
                    })
                    .collect();
                let chunk = self.compressed(&rows);
                offsets.push(file.len() as u64);
                sizes.push(chunk.len() as u64);
                file.extend(chunk);
                file.resize(file.len().next_multiple_of(2), 0);
            }
        }
        let list = |tag: u16, values: Vec<u64>| {
            if self.big {
                Tag::Long8(tag, values)
            } else {
                Tag::Long(tag, values.iter().map(|&v| v as u32).collect())
            }
        };
        let mut tags = vec![
            Tag::Long(256, vec![self.cols as u32]),
            Tag::Long(257, vec![self.rows as u32]),
            Tag::Short(258, vec![self.kind.0]),
            Tag::Short(259, vec![self.compression]),
            Tag::Short(262, vec![1]),
            Tag::Short(277, vec![1]),
            Tag::Short(317, vec![self.predictor]),
            Tag::Short(339, vec![self.kind.1]),
        ];
        if self.tile.1.is_some() {
            tags.push(Tag::Short(322, vec![width as u16]));
            tags.push(Tag::Short(323, vec![height as u16]));
            tags.extend([list(324, offsets), list(325, sizes)]);
        } else {
            tags.push(Tag::Long(278, vec![height as u32]));
            tags.extend([list(273, offsets), list(279, sizes)]);
        }
        // A tag given by the test takes the place of that of the file.
        tags.retain(|t| !self.tags.iter().any(|own| own.number() == t.number()));
        tags.extend(self.tags.iter().cloned());
        tags.sort_by_key(Tag::number);
        self.finish(file, &tags)
    }

    fn finish(&self, mut file: Vec<u8>, tags: &[Tag]) -> Vec<u8> {
        let inline = if self.big { 8 } else { 4 };
        let word = |n: u64| self.order(&n.to_le_bytes()[..inline]);
        let start = file.len() as u64;
        let mut head = if self.big_endian { b"MM".to_vec() } else { b"II".to_vec() };
        head.extend(self.order(&(if self.big { 43u16 } else { 42 }).to_le_bytes()));
        if self.big {
            head.extend(self.order(&8u16.to_le_bytes()));
            head.extend([0, 0]);
        }
        head.extend(word(start));
        file[..head.len()].copy_from_slice(&head);
        let count = tags.len() as u64;
        let mut directory = self.order(&count.to_le_bytes()[..if self.big { 8 } else { 2 }]);
        let table = directory.len() + tags.len() * (4 + 2 * inline) + inline;
        let mut values = Vec::new();
        for tag in tags {
            let (kind, count, mut bytes) = tag.encoded(self);
            directory.extend(self.order(&tag.number().to_le_bytes()));
            directory.extend(self.order(&u16::to_le_bytes(kind)));
            directory.extend(word(count as u64));
            if bytes.len() <= inline {
                bytes.resize(inline, 0);
                directory.extend(bytes);
            } else {
                directory.extend(word(start + (table + values.len()) as u64));
                values.extend(bytes);
            }
        }
        directory.extend(word(0));
        file.extend(directory);
        file.extend(values);
        file
    }
}

impl Tag {
    pub(crate) fn number(&self) -> u16 {
        match self {
            Tag::Short(n, _) | Tag::Long(n, _) | Tag::Long8(n, _) | Tag::Real(n, _) | Tag::Text(n, _) => *n,
        }
    }

    fn encoded(&self, file: &Tiff) -> (u16, usize, Vec<u8>) {
        match self {
            Tag::Short(_, v) => (3, v.len(), v.iter().flat_map(|n| file.order(&n.to_le_bytes())).collect()),
            Tag::Long(_, v) => (4, v.len(), v.iter().flat_map(|n| file.order(&n.to_le_bytes())).collect()),
            Tag::Long8(_, v) => (16, v.len(), v.iter().flat_map(|n| file.order(&n.to_le_bytes())).collect()),
            Tag::Real(_, v) => (12, v.len(), v.iter().flat_map(|n| file.order(&n.to_le_bytes())).collect()),
            Tag::Text(_, t) => (2, t.len() + 1, [t.as_bytes(), b"\0"].concat()),
        }
    }
}

/// PackBits of TIFF 6.0, section 9.
fn pack_bits(row: &[u8]) -> Vec<u8> {
    let mut packed = Vec::new();
    let mut at = 0;
    while at < row.len() {
        let run = row[at..].iter().take(128).take_while(|&&b| b == row[at]).count();
        if run > 1 {
            packed.extend([(257 - run) as u8, row[at]]);
            at += run;
        } else {
            let literal = row[at..].iter().take(128).len();
            let end =
                (1..literal).find(|&k| row[at + k] == row[at + k - 1]).map_or(literal, |k| k - 1).max(1);
            packed.push((end - 1) as u8);
            packed.extend(&row[at..at + end]);
            at += end;
        }
    }
    packed
}

/// A NumPy array of version 1, 2 or 3.
pub(crate) fn npy(version: u8, descr: &str, fortran: bool, shape: &str, data: &[u8]) -> Vec<u8> {
    let order = if fortran { "True" } else { "False" };
    let header = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY".to_vec();
    bytes.extend([version, 0]);
    if version == 1 {
        bytes.extend((header.len() as u16).to_le_bytes());
    } else {
        bytes.extend((header.len() as u32).to_le_bytes());
    }
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

/// A grey PNG.
pub(crate) fn png(rows: u32, cols: u32, sixteen: bool, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, cols, rows);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(if sixteen { png::BitDepth::Sixteen } else { png::BitDepth::Eight });
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(data).unwrap();
    writer.finish().unwrap();
    bytes
}

pub(crate) const PDS3_IMAGE: &str = "\
OBJECT = IMAGE
  LINES = 2
  LINE_SAMPLES = 3
  SAMPLE_TYPE = MSB_INTEGER
  SAMPLE_BITS = 16
  SCALING_FACTOR = 0.5
  OFFSET = 1737400. /* radius */
  MISSING_CONSTANT = -32768
  BANDS = 1
END_OBJECT = IMAGE
OBJECT = IMAGE_MAP_PROJECTION
  MAP_SCALE = 0.118 <KM/PIXEL>
  LINE_PROJECTION_OFFSET = 10.5
  SAMPLE_PROJECTION_OFFSET = 20.5
END_OBJECT = IMAGE_MAP_PROJECTION
END
";

/// A PDS3 label with its raster behind it.
pub(crate) fn pds3() -> Vec<u8> {
    let mut bytes =
        format!("PDS_VERSION_ID = PDS3\r\nRECORD_BYTES = 512\r\n^IMAGE = 3\r\n{PDS3_IMAGE}").into_bytes();
    bytes.resize(1024, b' ');
    for v in [2i16, 4, 6, -32768, -2, 0] {
        bytes.extend(v.to_be_bytes());
    }
    bytes
}

pub(crate) const PDS4: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Product_Observational xmlns="http://pds.nasa.gov/pds4/pds/v1" xmlns:cart="http://pds.nasa.gov/pds4/cart/v1" xmlns:disp="http://pds.nasa.gov/pds4/disp/v1">
  <disp:Display_Direction>
    <disp:horizontal_display_direction>Left to Right</disp:horizontal_display_direction>
    <disp:vertical_display_direction>Top to Bottom</disp:vertical_display_direction>
  </disp:Display_Direction>
  <cart:Cartography>
    <cart:pixel_resolution_x unit="m/pixel">2.0</cart:pixel_resolution_x>
    <cart:pixel_resolution_y unit="m/pixel">2.0</cart:pixel_resolution_y>
    <cart:upperleft_corner_x unit="m">100.0</cart:upperleft_corner_x>
    <cart:upperleft_corner_y unit="m">-50.0</cart:upperleft_corner_y>
  </cart:Cartography>
  <File_Area_Observational><Array_2D_Image>
    <offset unit="byte">8</offset>
    <axes>2</axes>
    <Element_Array><data_type>IEEE754LSBSingle</data_type><scaling_factor>2</scaling_factor><value_offset>1</value_offset></Element_Array>
    <Axis_Array><axis_name>Line</axis_name><elements>2</elements><sequence_number>1</sequence_number></Axis_Array>
    <Axis_Array><axis_name>Sample</axis_name><elements>3</elements><sequence_number>2</sequence_number></Axis_Array>
    <Special_Constants><missing_constant>0xFF7FFFFB</missing_constant></Special_Constants>
  </Array_2D_Image></File_Area_Observational>
</Product_Observational>
"#;

/// The raster of [`PDS4`].
pub(crate) fn pds4_data() -> Vec<u8> {
    let mut bytes = vec![0; 8];
    for v in [1.0f32, 2.0, 3.0, f32::from_bits(0xff7f_fffb), 5.0, 6.0] {
        bytes.extend(v.to_le_bytes());
    }
    bytes
}

pub(crate) const ASCII: &str =
    "ncols 3\nnrows 2\nxllcorner 100\nyllcorner 50\ncellsize 2\nNODATA_value -9999\n1 2.5 3\n-9999 5 -6e0\n";
