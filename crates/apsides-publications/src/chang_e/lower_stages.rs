//! The hover and the last stage: nominal accelerations (5.17) to (5.20), and a uniform deceleration beside the optimum (5.23).

use apsides_dynamics::powered_descent::MOON_ROTATION_RATE;
use apsides_ocp::PhaseTrajectory;

use super::case::{LANDING, SolvedCase, solve};
use super::comparison::{self, row, to};
use super::orbit::{MU, RADIUS};
use crate::change::{Change, number};
use crate::sheet::Sheet;
use crate::stop::Stop;
use crate::workers::Workers;

/// Altitude of the hover, m, and latitude of the site, deg, of the contest.
const HOVER_M: f64 = 100.0;
const LATITUDE_DEG: f64 = 44.12;
/// Exhaust velocity of the contest, m/s.
const EXHAUST_VELOCITY: f64 = 2940.0;
/// Largest and least thrust of the contest, N.
const THRUSTS: [f64; 2] = [7500.0, 1500.0];
/// The mission states the specific impulse to this part of the exhaust velocity.
const ROUNDED: f64 = 1e-6;

const HOVERING: &[Change<'static>] = &[number("hover_time_s", 5.0)];

/// The phase of a solution by its name, with its first and its last state.
fn ends<'a>(solved: &'a SolvedCase, name: &str) -> Option<(&'a PhaseTrajectory, [Vec<f64>; 2])> {
    let phase = solved.trajectory.phases.iter().find(|p| p.name == name)?;
    Some((phase, [phase.initial_time, phase.final_time].map(|t| phase.state_at(t))))
}

/// Nominal accelerations of the hover by the equations of the paper, and the acceleration by the thrust that is flown.
pub(super) fn hover(workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let solved = solve(LANDING, HOVERING, &mut *workers.observer)?;
    let radius = RADIUS + HOVER_M;
    let (sin, cos) = LATITUDE_DEG.to_radians().sin_cos();
    let gravity = MU / (radius * radius);
    let centrifugal = radius * cos * MOON_ROTATION_RATE * MOON_ROTATION_RATE;
    let (radial, along) = (centrifugal * cos - gravity, centrifugal * sin);
    // m' = -m a / c at rest.
    let flown = ends(&solved, "hover").and_then(|(phase, [start, end])| {
        let change = (start.last()? / end.last()?).ln();
        Some(EXHAUST_VELOCITY * change / (phase.final_time - phase.initial_time))
    });
    let by_thrust = radial.hypot(along);
    let micro = 1e6;
    let mut sheet = comparison::sheet(
        "hover",
        "Hover at 100 m above the site at 44.12 deg north: nominal accelerations (5.17) to (5.20)",
        vec![
            row("gravity g_c, m/s2", None, gravity, None, ""),
            row("centrifugal g_c' = r_c' omega^2, um/s2", None, micro * centrifugal, None, ""),
            row("radial a_r = g_c' cos(theta) - g_c, m/s2", None, radial, None, ""),
            row("along the meridian a_f = g_c' sin(theta), um/s2", None, micro * along, None, ""),
            row(
                "acceleration by the thrust, flown, m/s2",
                None,
                flown.unwrap_or(f64::NAN),
                to(by_thrust, ROUNDED * by_thrust),
                "",
            ),
        ],
    );
    solved.check("with a hover", &mut sheet);
    sheet.findings.push(format!(
        "r_c' is the distance from the axis, theta the latitude. The reference of the flown acceleration is (a_r^2 + a_f^2)^(1/2); the thrust tilts by {:.2} \
         millionths of a right angle towards the pole, so that a hover that is straight up lacks nothing.",
        micro * (along / -radial).atan() / std::f64::consts::FRAC_PI_2
    ));
    Ok(sheet)
}

/// The last stage from the same start by a uniform deceleration and at least propellant.
pub(super) fn last_stage(workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let solved = solve(LANDING, &[], &mut *workers.observer)?;
    let mut sheet = Sheet::new(
        "last-stage",
        "Stage 6, from 30 m to rest at 4 m: a uniform deceleration (summary of the paper) beside the optimum (5.23) from the same start",
        "flight",
        &[("propellant_kg", 4), ("time_s", 4), ("least_thrust_n", 1), ("largest_thrust_n", 1)],
    );
    solved.check("the landing", &mut sheet);
    let Some((phase, [start, end])) = ends(&solved, "descent") else { return Ok(sheet) };
    let (&[top, speed, mass], &[bottom, _, left]) = (&start[..], &end[..]) else { return Ok(sheet) };
    let least = mass - left;
    sheet.push(
        "optimum",
        vec![Some(least), Some(phase.final_time - phase.initial_time), Some(THRUSTS[1]), Some(THRUSTS[0])],
    );
    let uniform = uniform_deceleration(top - bottom, -speed, mass, 0.5 * (top + bottom));
    let [propellant, time, low, high] = uniform;
    sheet.push("uniform deceleration", uniform.map(Some).to_vec());
    sheet.findings.push(format!(
        "From {:.3} m/s downwards and {mass:.2} kg a uniform deceleration takes {propellant:.3} kg and {time:.2} s at {low:.0} to {high:.0} N, the optimum \
         {least:.3} kg: it falls at the least thrust and brakes at full thrust. The paper's summary says the one, its equation (5.23) asks for the other; \
         neither is printed in numbers.",
        -speed
    ));
    Ok(sheet)
}

/// Propellant (kg), time (s), least and largest thrust (N) of a uniform deceleration from a speed downwards (m/s) over a height (m), from a
/// mass (kg), with the gravity at a distance from the centre (m).
fn uniform_deceleration(height: f64, speed: f64, mass: f64, radius: f64) -> [f64; 4] {
    let deceleration = speed * speed / (2.0 * height);
    let time = 2.0 * height / speed;
    let by_thrust = deceleration + MU / (radius * radius);
    let left = mass * (-by_thrust * time / EXHAUST_VELOCITY).exp();
    [mass - left, time, left * by_thrust, mass * by_thrust]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-9;

    /// By hand: 8 m/s over 16 m take 4 s at 2 m/s2, with 1.625 m/s2 of gravity at 1737 km 3.625 m/s2 by the thrust.
    #[test]
    fn a_uniform_deceleration_by_hand() {
        let radius = (MU / 1.625_f64).sqrt();
        let [propellant, time, low, high] = uniform_deceleration(16.0, 8.0, 1000.0, radius);
        assert_eq!(time, 4.0);
        let left = 1000.0 * (-3.625_f64 * 4.0 / 2940.0).exp();
        assert!((propellant - (1000.0 - left)).abs() < ROUNDING);
        assert!((low - 3.625 * left).abs() < 1e3 * ROUNDING && (high - 3625.0).abs() < 1e3 * ROUNDING);
    }
}
