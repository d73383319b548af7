//! The landing orbit: speeds and places of its apsides.

use apsides_dynamics::great_circle::central_angle;

use super::case::{BRAKING, SolvedCase, solve};
use super::comparison::{self, Compared, row, to};
use crate::change::{Change, number};
use crate::sheet::Sheet;
use crate::stop::Stop;
use crate::workers::Workers;

/// Longitude and latitude as printed, deg.
pub(super) const PRINTED_PERILUNE: [f64; 2] = [-20.08, 30.1];
const PRINTED_APOLUNE: [f64; 2] = [160.49, -22.45];
pub(super) const SITE: [f64; 2] = [-19.51, 44.12];
/// m3/s2, m: as in the listing of the paper.
pub(super) const MU: f64 = 4.902_793_455e12;
pub(super) const RADIUS: f64 = 1_737_013.0;
const PERILUNE: f64 = RADIUS + 15e3;
const APOLUNE: f64 = RADIUS + 100e3;

/// Angle between two places of longitude and latitude; deg.
pub(super) fn arc(from: [f64; 2], to: [f64; 2]) -> f64 {
    central_angle(from.map(f64::to_radians), to.map(f64::to_radians)).to_degrees()
}

pub(super) fn sheet(workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let cases: [&[Change<'_>]; 2] =
        [&[], &[number("site_altitude_m", -2641.0), number("start_speed_m_s", f64::INFINITY)]];
    let [mean, low] = workers.each(&cases, |c, observer| solve(BRAKING, c, observer))?;
    let rows = [speeds(&mean, &low), places(&mean)].into_iter().flatten().collect();
    let mut sheet = comparison::sheet("orbit", "Landing orbit: perilune and apolune", rows);
    mean.check("altitudes from the mean radius", &mut sheet);
    low.check("altitudes from the site", &mut sheet);
    Ok(sheet)
}

fn speeds(mean: &SolvedCase, low: &SolvedCase) -> Vec<Compared<'static>> {
    let speeds = ["perilune_speed_m_s", "apolune_speed_m_s"];
    let [perilune, apolune] = speeds.map(|k| mean.get(k));
    let [low_perilune, low_apolune] = speeds.map(|k| low.get(k));
    // v1 of (5.9) is sqrt(2 g / (r1 + r2)) r2, v2 the same with r1.
    let by_gravity = |g: f64, radius: f64| (2.0 * g / (PERILUNE + APOLUNE)).sqrt() * radius;
    let (surface, fitting) = (MU / (RADIUS * RADIUS), MU / (PERILUNE * APOLUNE));
    let equal_areas = format!(
        "r1 v1 = r2 v2, as the paper has it, gives {:.1} m/s from the printed speed at the perilune",
        1692.0 * PERILUNE / APOLUNE
    );
    let wrong_gravity = format!(
        "with the gravity on the surface, {surface:.4} m/s2, (5.9) does not give the printed speed; the energy asks for mu / (r1 r2) = \
         {fitting:.4} m/s2 there"
    );
    vec![
        row(
            "speed at the perilune, m/s",
            to(1692.0, 1.0),
            perilune,
            to(1_692.528_331_310, 1e-6),
            "truncated",
        ),
        row("speed at the apolune, m/s", to(1639.0, 1.0), apolune, to(1_614.213_747_711, 1e-6), equal_areas),
        row(
            "speed at the perilune by (5.9), m/s",
            to(1692.0, 1.0),
            by_gravity(surface, APOLUNE),
            to(1_748.065_313_717, 1e-6),
            wrong_gravity.as_str(),
        ),
        row(
            "speed at the apolune by (5.9), m/s",
            to(1639.0, 1.0),
            by_gravity(surface, PERILUNE),
            to(1_667.180_991_360, 1e-6),
            wrong_gravity.as_str(),
        ),
        row(
            "speed at the perilune, altitudes from the site, m/s",
            None,
            low_perilune,
            to(1_693.834_319_532, 1e-6),
            "",
        ),
        row(
            "speed at the apolune, altitudes from the site, m/s",
            None,
            low_apolune,
            to(1_615.346_468_017, 1e-6),
            "",
        ),
    ]
}

fn places(mean: &SolvedCase) -> Vec<Compared<'static>> {
    let place = ["perilune_longitude_deg", "perilune_latitude_deg"].map(|k| mean.get(k));
    let far = ["apolune_longitude_deg", "apolune_latitude_deg"].map(|k| mean.get(k));
    let antipode = [PRINTED_PERILUNE[0] + 180.0, -PRINTED_PERILUNE[1]];
    let flat = "the optimum is flat, another arc of the braking costs grams (sheet `downrange`)";
    vec![
        row(
            "longitude of the perilune, deg",
            to(PRINTED_PERILUNE[0], 5e-3),
            place[0],
            to(-19.476_129_4, 1e-5),
            flat,
        ),
        row(
            "latitude of the perilune, deg",
            to(PRINTED_PERILUNE[1], 5e-2),
            place[1],
            to(30.796_200_9, 1e-4),
            flat,
        ),
        row(
            "longitude of the apolune, deg",
            to(PRINTED_APOLUNE[0], 5e-3),
            far[0],
            to(160.523_870_6, 1e-5),
            flat,
        ),
        row(
            "latitude of the apolune, deg",
            to(PRINTED_APOLUNE[1], 5e-3),
            far[1],
            to(-30.796_200_9, 1e-4),
            "the apolune is opposite to the perilune",
        ),
        row(
            "angle from the printed apolune to the opposite of the printed perilune, deg",
            to(0.0, 1e-2),
            arc(antipode, PRINTED_APOLUNE),
            to(7.667_011_020_6, 1e-6),
            "both cannot be apsides of one orbit",
        ),
        row(
            "arc from the printed perilune to the site, deg",
            None,
            arc(PRINTED_PERILUNE, SITE),
            to(14.027_266_854_6, 1e-6),
            "",
        ),
    ]
}
