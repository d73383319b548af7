//! Table 7: thrust along the velocity in place of the optimal direction, for the times of the optimal burns.

use apsides_ad::Dynamics;
use apsides_dynamics::elements::{PlanarEquinoctial, PlanarPolar};
use apsides_dynamics::equinoctial::PlanarVelocityThrust;
use apsides_dynamics::kepler::longitude_after;
use apsides_ode::{FnSystem, Integrator, OdeSettings, Status};

use super::burns::Apsis;
use super::printed::{PRINTED_CORRECTION, STATED_MASS, TABLE_7, TWO_BURNS, USED_MASS};
use super::stage::{Stage, Stop, keep};
use crate::sheet::Sheet;

/// State at the end of a burn: `[p, f, g, L, m]`.
pub(super) type End = [f64; 5];

/// Full thrust along the velocity for a time (s), half of it before an apsis of the orbit `p`, `f`, `g`.
pub(super) fn burn(
    stage: &Stage,
    [p, f, g]: [f64; 3],
    apsis: Apsis,
    mass: f64,
    time: f64,
) -> Result<End, Stop> {
    let failed = |why: String| Stop::NotSolved(format!("thrust along the velocity: {why}"));
    let at = PlanarEquinoctial::new([p, f, g, g.atan2(f) + apsis.longitude()]);
    let ignition = longitude_after(stage.mu(), &at, -0.5 * time).map_err(|e| failed(e.to_string()))?;
    let model = PlanarVelocityThrust(stage.flight);
    let system = FnSystem::new(5, |t, x: &[f64], dx: &mut [f64]| {
        dx.copy_from_slice(&model.rate(t, &[x[0], x[1], x[2], x[3], x[4]], &[], &[]));
    });
    let mut end = [0.0; 5];
    let summary = Integrator::new(5, OdeSettings::default())
        .and_then(|mut i| i.integrate(&system, 0.0, &[p, f, g, ignition, mass], time, &mut end))
        .map_err(|e| failed(e.to_string()))?;
    if summary.status == Status::Completed {
        Ok(end)
    } else {
        Err(failed("the integration ends early".into()))
    }
}

fn polar(stage: &Stage, [p, f, g, l, _]: End) -> PlanarPolar {
    PlanarEquinoctial::new([p, f, g, l]).to_polar(stage.mu())
}

/// Distance (km) and speed (m/s) by which a state misses the target orbit.
fn miss(stage: &Stage, end: &PlanarPolar) -> (f64, f64) {
    let circular = (stage.mu() / stage.target_radius).sqrt();
    let speed = (end.horizontal_speed - circular).hypot(end.radial_speed);
    ((end.radius - stage.target_radius) / 1e3, speed)
}

/// Least sum of two horizontal impulses at apses that lead from an orbit with these apses to the target, m/s: the first makes the other
/// apsis that of the target.
fn correction(stage: &Stage, apses: [f64; 2]) -> f64 {
    let (body, target) = (stage.flight.body, stage.target_radius);
    let speed = |radius: f64, other: f64| body.orbital_speed(radius, 0.5 * (radius + other));
    let by_way_of = |at: f64, other: f64| {
        (speed(at, target) - speed(at, other)).abs() + (speed(target, target) - speed(target, at)).abs()
    };
    by_way_of(apses[0], apses[1]).min(by_way_of(apses[1], apses[0]))
}

/// Table 7: the burn times are those of the propellants of Table 2, the second burn begins on its orbit.
pub(super) fn table_7(stages: &[Stage; 2]) -> Result<Sheet, Stop> {
    let columns = [
        ("radius", 5),
        ("radial_speed", 6),
        ("horizontal_speed", 5),
        ("radius_less_target_km", 2),
        ("speed_from_target_m_s", 2),
    ];
    let title = "Table 7: end of two burns with thrust along the velocity, canonical units";
    let mut sheet = Sheet::new("table-7", title, "flight", &columns);
    let filled = fill(&mut sheet, stages);
    keep(&mut sheet, filled)?;
    Ok(sheet)
}

fn fill(sheet: &mut Sheet, [used, stated]: &[Stage; 2]) -> Result<(), Stop> {
    let [first, second] = TWO_BURNS;
    let Some(orbit) = first.orbit() else { return Ok(()) };
    let (unit, _) = used.canonical();
    let [r, u, v] = TABLE_7;
    let printed = PlanarPolar {
        radius: r * used.parking_radius,
        angle: 0.0,
        horizontal_speed: v * unit,
        radial_speed: u * unit,
    };
    let mut rows = vec![("printed".to_owned(), printed)];
    let mut ends = Vec::new();
    for stage in [used, stated] {
        let from = [orbit.latus_rectum(), orbit.eccentricity, 0.0];
        let end = burn(
            stage,
            from,
            Apsis::Apogee,
            stage.mass - first.propellant,
            second.time_of_propellant(stage),
        )?;
        rows.push((format!("second burn, {} kg", stage.mass), polar(stage, end)));
        ends.push(end);
    }
    let parking = [used.parking_radius, 0.0, 0.0];
    let [p, f, g, _, mass] = burn(used, parking, Apsis::Perigee, used.mass, first.time_of_propellant(used))?;
    let end = burn(used, [p, f, g], Apsis::Apogee, mass, second.time_of_propellant(used))?;
    rows.push((format!("both burns, {} kg", used.mass), polar(used, end)));
    sheet.findings.push(format!(
        "along the velocity the first burn reaches a semi-major axis of {:.0} km, the printed one is {:.0} km: Table 7 is the last \
         burn alone",
        p / (1.0 - f * f - g * g) / 1e3,
        orbit.axis / 1e3
    ));
    for (label, end) in &rows {
        let (radius, speed) = miss(used, end);
        let values = [
            end.radius / used.parking_radius,
            end.radial_speed / unit,
            end.horizontal_speed / unit,
            radius,
            speed,
        ];
        sheet.push(label.clone(), values.map(Some).to_vec());
    }
    if let Some(&[p, f, g, _, mass]) = ends.first() {
        let e = f.hypot(g);
        let change = correction(used, [p / (1.0 + e), p / (1.0 - e)]);
        let burnt = mass - used.flight.engine.mass_after(mass, change);
        sheet.findings.push(format!(
            "correcting the orbit after the second burn along the velocity takes {change:.1} m/s and {burnt:.1} kg, not about \
             {PRINTED_CORRECTION} kg"
        ));
    }
    if let [_, used, stated, ..] = &rows[..] {
        let miss = |end: &PlanarPolar| {
            (end.horizontal_speed - printed.horizontal_speed).hypot(end.radial_speed - printed.radial_speed)
        };
        sheet.findings.push(format!(
            "the printed end is {:.2} m/s from that with {USED_MASS} kg and {:.2} m/s from that with {STATED_MASS} kg",
            miss(&used.1),
            miss(&stated.1)
        ));
    }
    Ok(())
}
