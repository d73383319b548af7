//! Over which meridian is a geostationary satellite whose position in axes of the ICRF is known?
//!
//! At J2000 the prime meridian stands at the right ascension 190.147 + 90 deg of the IAU report, so that the satellite on the first axis is
//! over 360 - 280.147 = 79.853 deg east; a mean solar day later the Earth has turned by 360.9856 deg.
#![allow(clippy::print_stdout)]

use apsides_ephemeris::{CentralBody, Epoch};

/// Discretisation: the pole moves by 0.6 deg in a century.
const POLE_MOVES: f64 = 1e-4;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let j2000: Epoch = "2000-01-01T12:00:00 TDB".parse()?;
    let over = |epoch: Epoch| {
        let (r, v) =
            CentralBody::Earth.orientation(&epoch).to_fixed([42_164e3, 0.0, 0.0], [0.0, 3_074.7, 0.0]);
        println!(
            "{epoch}: longitude {:.4} deg, {:.2} m/s over the ground",
            r[1].atan2(r[0]).to_degrees(),
            v[0].hypot(v[1])
        );
        r[1].atan2(r[0]).to_degrees()
    };
    let (first, later) = (over(j2000), over(j2000.elapsed(86_400.0)));
    assert!((first - 79.853).abs() < POLE_MOVES);
    assert!((first - later - 0.985_623_5).abs() < POLE_MOVES);
    Ok(())
}
