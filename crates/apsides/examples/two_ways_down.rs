//! A soft landing on the Moon from a 100 km orbit and from a perilune of 15 km: time, mass, and what lowering the perilune saves.
#![allow(clippy::print_stdout)]

use apsides::Error;

fn main() -> Result<(), Error> {
    let mut masses = [0.0; 2];
    for (k, name) in ["lunar-direct", "lunar-perilune"].into_iter().enumerate() {
        let outcome = apsides::load(name, &[])?.solve(None, &mut ())?;
        let summary = &outcome.summary;
        let (time, mass) = (summary.results["flight_time_s"], summary.results["final_mass_kg"]);
        println!("{name}: {}, {time:.6} s, {mass:.6} kg", summary.status);
        println!("  {}", summary.certificate.verdict);
        assert!(summary.certificate.is_verified());
        masses[k] = mass;
    }
    println!("the perilune saves {:.3} kg", masses[1] - masses[0]);
    // 153.736491 kg and 149.887256 kg by indirect shooting (tests/references/lunar_landing.py).
    assert!((masses[1] - masses[0] - 3.849_234).abs() < 1e-5);
    Ok(())
}
