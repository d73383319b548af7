//! PDS4 labels (PDS4 Information Model 1, cartography dictionary): an array of two axes, `Line` and `Sample`, of IEEE reals or integers.
//!
//! The size of a pixel comes from `pixel_resolution_x` and `_y` of the cartography dictionary, its place from `upperleft_corner_x` and
//! `_y`, which belong to the corner of the pixel.

use std::io::{Read, Seek};

use roxmltree::{Document, Node, ParsingOptions};

use super::pds::{LONGEST_LABEL, RowLayout, raster};
use super::sample::{Order, Sample};
use super::source::{Head, Store};
use super::{malformed, number, shortened};
use crate::{MapUnit, TerrainError};

pub(super) const NAME: &str = "PDS4";

pub(super) fn open<R: Read + Seek>(
    label: &[u8],
    data: R,
    len: u64,
) -> Result<(Head, Store<R>), TerrainError> {
    if label.len() as u64 > LONGEST_LABEL {
        let problem = format!("{} bytes long: at most {LONGEST_LABEL} are allowed", label.len());
        return Err(malformed(NAME, "label", problem));
    }
    let text = std::str::from_utf8(label).map_err(|_| malformed(NAME, "label", "not text"))?;
    let text = text.trim_start_matches('\u{feff}').trim_start();
    let options = ParsingOptions { nodes_limit: 1 << 18, ..Default::default() };
    let document =
        Document::parse_with_options(text, options).map_err(|e| malformed(NAME, "label", e.to_string()))?;
    let root = document.root_element();
    let kinds = ["Array_2D_Image", "Array_2D_Map", "Array_2D", "Array_3D_Image"];
    let array = root.descendants().find(|n| kinds.contains(&n.tag_name().name()));
    let array =
        array.ok_or_else(|| malformed(NAME, "label", "no Array_2D, Array_2D_Image or Array_2D_Map"))?;

    let [rows, cols] = axes(array)?;
    let element = child(array, "Element_Array")?;
    let (sample, order) = data_type(text_of(element, "data_type")?)?;
    let mut head = Head::plain(NAME, rows, cols, sample);
    head.scale = real(element, "scaling_factor")?.unwrap_or(1.0);
    head.offset = real(element, "value_offset")?.unwrap_or(0.0);
    if let Some(constants) = array.children().find(|n| n.has_tag_name_of("Special_Constants")) {
        for node in constants.children().filter(|n| n.is_element()) {
            let name = node.tag_name().name();
            if name.ends_with("_constant") {
                head.missing.push(constant(name, node.text().unwrap_or_default().trim(), sample)?);
            }
        }
    }
    place(root, &mut head)?;
    let start = match array.children().find(|n| n.has_tag_name_of("offset")) {
        Some(node) => whole("offset", node.text().unwrap_or_default())?,
        None => 0,
    };
    let stride = cols.saturating_mul(sample.size() as u64);
    raster(head, RowLayout { order, start, stride }, data, len)
}

/// Names are compared without their namespace: labels bind it to many prefixes.
trait Named {
    fn has_tag_name_of(&self, name: &str) -> bool;
}

impl Named for Node<'_, '_> {
    fn has_tag_name_of(&self, name: &str) -> bool {
        self.is_element() && self.tag_name().name() == name
    }
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Result<Node<'a, 'i>, TerrainError> {
    node.children().find(|n| n.has_tag_name_of(name)).ok_or_else(|| malformed(NAME, name, "missing"))
}

fn text_of<'a>(node: Node<'a, '_>, name: &str) -> Result<&'a str, TerrainError> {
    Ok(child(node, name)?.text().unwrap_or_default().trim())
}

fn real(node: Node<'_, '_>, name: &str) -> Result<Option<f64>, TerrainError> {
    let found = node.children().find(|n| n.has_tag_name_of(name));
    found.map(|n| number(NAME, name, n.text().unwrap_or_default())).transpose()
}

fn whole(name: &str, text: &str) -> Result<u64, TerrainError> {
    let text = text.trim();
    text.parse()
        .map_err(|_| malformed(NAME, name, format!("{:?} is not a whole number from 0", shortened(text))))
}

/// Numbers of rows and columns.
fn axes(array: Node<'_, '_>) -> Result<[u64; 2], TerrainError> {
    let mut sides = [None; 2];
    let mut order = [0; 2];
    for axis in array.children().filter(|n| n.has_tag_name_of("Axis_Array")) {
        let elements = whole("elements", text_of(axis, "elements")?)?;
        let name = text_of(axis, "axis_name")?.to_ascii_lowercase();
        let at = match name.as_str() {
            "line" | "latitude" | "y" => 0,
            "sample" | "longitude" | "x" => 1,
            _ if elements == 1 => continue,
            _ => {
                return Err(TerrainError::Unsupported {
                    format: NAME,
                    feature: format!("an axis {} of {elements} elements", shortened(&name)),
                    supported: "one band: the axes Line and Sample",
                });
            }
        };
        sides[at] = Some(elements);
        order[at] = whole("sequence_number", text_of(axis, "sequence_number")?)?;
    }
    let [Some(rows), Some(cols)] = sides else {
        return Err(malformed(NAME, "Axis_Array", "the axes Line and Sample are needed"));
    };
    if order[0] >= order[1] {
        return Err(TerrainError::Unsupported {
            format: NAME,
            feature: "an array whose first axis is Sample".to_owned(),
            supported: "Line before Sample",
        });
    }
    Ok([rows, cols])
}

fn data_type(name: &str) -> Result<(Sample, Order), TerrainError> {
    Ok(match name {
        "UnsignedByte" => (Sample::U8, Order::Big),
        "SignedByte" => (Sample::I8, Order::Big),
        "UnsignedMSB2" => (Sample::U16, Order::Big),
        "UnsignedLSB2" => (Sample::U16, Order::Little),
        "SignedMSB2" => (Sample::I16, Order::Big),
        "SignedLSB2" => (Sample::I16, Order::Little),
        "UnsignedMSB4" => (Sample::U32, Order::Big),
        "UnsignedLSB4" => (Sample::U32, Order::Little),
        "SignedMSB4" => (Sample::I32, Order::Big),
        "SignedLSB4" => (Sample::I32, Order::Little),
        "IEEE754MSBSingle" => (Sample::F32, Order::Big),
        "IEEE754LSBSingle" => (Sample::F32, Order::Little),
        "IEEE754MSBDouble" => (Sample::F64, Order::Big),
        "IEEE754LSBDouble" => (Sample::F64, Order::Little),
        _ => {
            return Err(TerrainError::Unsupported {
                format: NAME,
                feature: format!("data_type {}", shortened(name)),
                supported: "bytes, integers of 2 and 4 bytes, IEEE754 singles and doubles, MSB or LSB",
            });
        }
    })
}

/// A number that stands for gaps, in decimal or as bits (`0xFF7FFFFB`).
fn constant(name: &str, text: &str, sample: Sample) -> Result<f64, TerrainError> {
    match text.strip_prefix("0x").or(text.strip_prefix("0X")) {
        Some(digits) => u64::from_str_radix(digits, 16)
            .map(|bits| sample.of_bits(bits))
            .map_err(|_| malformed(NAME, name, format!("{:?} is not a number", shortened(text)))),
        None => number(NAME, name, text),
    }
}

/// Puts size, place, unit and direction of the pixels into `head`.
fn place(root: Node<'_, '_>, head: &mut Head) -> Result<(), TerrainError> {
    let find = |name: &str| root.descendants().find(|n| n.has_tag_name_of(name));
    if let Some(direction) = find("vertical_display_direction") {
        match direction.text().unwrap_or_default().trim() {
            "Top to Bottom" => {}
            "Bottom to Top" => head.south_up = true,
            other => {
                return Err(malformed(NAME, "vertical_display_direction", format!("{:?}", shortened(other))));
            }
        }
    }
    if let Some(direction) = find("horizontal_display_direction") {
        let direction = direction.text().unwrap_or_default().trim();
        if direction != "Left to Right" {
            return Err(TerrainError::Unsupported {
                format: NAME,
                feature: format!("samples {}", shortened(direction)),
                supported: "samples from left to right",
            });
        }
    }
    // A length or an angle with its unit, in metres or degrees.
    let length = |name: &str| -> Result<Option<(f64, MapUnit)>, TerrainError> {
        let Some(node) = find(name) else { return Ok(None) };
        let value = number(NAME, name, node.text().unwrap_or_default())?;
        let unit = node.attribute("unit").unwrap_or("m").to_ascii_lowercase();
        let (factor, unit) = match unit.split('/').next().map(str::trim) {
            Some("m") => (1.0, MapUnit::Metre),
            Some("km") => (1000.0, MapUnit::Metre),
            Some("deg") => (1.0, MapUnit::Degree),
            _ => return Err(malformed(NAME, name, format!("unit {:?}", shortened(&unit)))),
        };
        Ok(Some((factor * value, unit)))
    };
    let Some((east, unit)) = length("pixel_resolution_x")? else { return Ok(()) };
    let south = length("pixel_resolution_y")?.map_or(east, |(south, _)| south);
    head.unit = unit;
    if unit == MapUnit::Degree {
        let axis = length("a_axis_radius")?.map_or_else(|| length("semi_major_radius"), |r| Ok(Some(r)))?;
        head.radius_m = axis.filter(|(_, unit)| *unit == MapUnit::Metre).map(|(radius, _)| radius);
    }
    head.pixel = Some([east, south]);
    let corner = [length("upperleft_corner_x")?, length("upperleft_corner_y")?];
    if let [Some((x, x_unit)), Some((y, y_unit))] = corner {
        if x_unit != unit || y_unit != unit {
            return Err(malformed(
                NAME,
                "upperleft_corner_x",
                "another unit than that of pixel_resolution_x",
            ));
        }
        head.north_west = [x + 0.5 * east, y - 0.5 * south];
    }
    Ok(())
}
