//! Full layers, verdicts and clearance of maps on one thread, and the spiral on the result.

use std::hint::black_box;

use apsides_terrain::hazard::{HazardOptions, Layer, LayerChoice, SiteCriteria, hazard_map_with};
use apsides_terrain::site::{SiteRequest, choose_sites};
use apsides_terrain::{ElevationMap, Geometry, distance_to_nearest};
use criterion::{Criterion, criterion_group, criterion_main};

/// Hills of several sizes with boulders: enough of everything to be half safe.
fn hills(size: usize, pixel_m: f64) -> ElevationMap {
    let mut heights = vec![0.0; size * size];
    for (k, height) in heights.iter_mut().enumerate() {
        let (north, east) = ((k / size) as f64 * pixel_m, (k % size) as f64 * pixel_m);
        for (length, rise) in [(97.0, 3.0), (31.0, 0.5), (11.0, 0.1)] {
            *height += rise * (east / length).sin() * (north / length + 1.3 * east / length).cos();
        }
        let hash = (k as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40;
        if hash.is_multiple_of(997) {
            *height += 0.5 * pixel_m.min(1.0);
        }
    }
    ElevationMap::from_heights(Geometry::square(size, size, pixel_m).expect("it has pixels"), &heights)
        .expect("there is a height for each pixel")
}

fn layers(c: &mut Criterion) {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread can be had");
    let cases = [
        ("1000 at 1 m", 1000, 1.0, SiteCriteria::CHANG_E_3_COARSE),
        ("2300 at 1 m", 2300, 1.0, SiteCriteria::CHANG_E_3_COARSE),
        ("1000 at 0.1 m", 1000, 0.1, SiteCriteria::CHANG_E_3_FINE),
    ];
    for (name, size, pixel_m, criteria) in cases {
        let map = hills(size, pixel_m);
        let mut group = c.benchmark_group(format!("hazard map {name}"));
        group.sample_size(10);
        let mut run = |what: &str, criteria: SiteCriteria, layers: LayerChoice| {
            let options = HazardOptions { layers, plane: None };
            group.bench_function(what, |b| {
                b.iter(|| {
                    let hazards = one
                        .install(|| hazard_map_with(&map, &criteria, &options))
                        .expect("the criteria are sound");
                    black_box(
                        choose_sites(&map, &hazards, &SiteRequest::default()).expect("the request is sound"),
                    )
                });
            });
        };
        run("all that is tested", criteria, LayerChoice::Tested);
        run("verdicts alone", criteria, LayerChoice::None);
        let nothing = SiteCriteria {
            slope_max_deg: None,
            footpad_slope_max_deg: None,
            roughness_max_m: None,
            ..criteria
        };
        for layer in Layer::ALL {
            run(&format!("{layer} and distances"), nothing, LayerChoice::These(vec![layer]));
        }
        let hazards = one
            .install(|| hazard_map_with(&map, &criteria, &HazardOptions::default()))
            .expect("the criteria are sound");
        let marked = hazards.clearance().map(|c| *c <= 0.0);
        group.bench_function("distances", |b| {
            b.iter(|| black_box(one.install(|| distance_to_nearest(&marked))))
        });
        group.finish();
    }
}

criterion_group!(benches, layers);
criterion_main!(benches);
