//! Coloured pictures.

use apsides_terrain::io::{ColourMap, Legend, write_png};
use apsides_terrain::{Geometry, Raster, TerrainError};

fn decoded(bytes: &[u8]) -> (usize, usize, Vec<u8>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    (info.height as usize, info.width as usize, pixels)
}

#[test]
fn values_become_colours_and_gaps_are_transparent() {
    let raster = Raster::new(Geometry::square(1, 4, 1.0).unwrap(), vec![0.0, f32::NAN, 5.0, 10.0]).unwrap();
    let mut bytes = Vec::new();
    write_png(&mut bytes, &raster, ColourMap::Grey, None, None).unwrap();
    let (rows, cols, pixels) = decoded(&bytes);
    assert_eq!((rows, cols), (1, 4));
    assert_eq!(pixels, [0, 0, 0, 255, 0, 0, 0, 0, 128, 128, 128, 255, 255, 255, 255, 255]);
    let range = Some([5.0, 5.0]);
    let failed = write_png(Vec::new(), &raster, ColourMap::Grey, range, None);
    assert!(matches!(failed, Err(TerrainError::Number { .. })));
}

#[test]
fn a_legend_stands_beside_the_picture() {
    let values = (0..60 * 40).map(|k| k as f32).collect();
    let raster = Raster::new(Geometry::square(60, 40, 1.0).unwrap(), values).unwrap();
    let mut bytes = Vec::new();
    let legend = Legend { unit: "m".to_owned() };
    write_png(&mut bytes, &raster, ColourMap::Viridis, Some([0.0, 99.5]), Some(&legend)).unwrap();
    let (rows, cols, pixels) = decoded(&bytes);
    // 4 + 10 + 4 dots, "99.5 m" of 6 letters of 6 dots, 4 dots.
    assert_eq!((rows, cols), (60, 40 + 58));
    let pixel = |row: usize, col: usize| &pixels[4 * (row * cols + col)..][..4];
    // The bar from the last colour on top to the first at the bottom.
    assert_eq!(pixel(0, 50), [0xfd, 0xe7, 0x25, 255]);
    assert_eq!(pixel(59, 50), [0x44, 0x01, 0x54, 255]);
    let black = (0..rows)
        .flat_map(|r| (58..cols).map(move |c| (r, c)))
        .filter(|&(r, c)| pixel(r, c) == [0, 0, 0, 255]);
    assert!(black.count() > 60);
}

#[test]
fn a_single_gap_and_a_flat_raster_have_pictures() {
    for value in [f32::NAN, 3.0] {
        let raster = Raster::filled(Geometry::square(1, 1, 1.0).unwrap(), value);
        let mut bytes = Vec::new();
        write_png(&mut bytes, &raster, ColourMap::Magma, None, Some(&Legend::default())).unwrap();
        assert_eq!(decoded(&bytes).0, 18);
    }
}
