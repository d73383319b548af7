//! The state-transition matrix of the main braking: sizes of its blocks.

use super::case::{BRAKING, outcome};
use super::comparison::{self, Compared, Known, to};
use super::deviations::{flights, steered};
use super::orbit::{MU, RADIUS};
use crate::sheet::Sheet;
use crate::stop::Stop;
use crate::workers::Workers;
use apsides_pipeline::dispersion::Deviations;
use apsides_pipeline::dispersion::Guidance;

/// Deviations of position (m) and velocity (m/s) to both sides; what is cubic in them is below 1e-9 of the differences.
const STEPS: [f64; 2] = [10.0, 0.01];

/// Blocks, row by row: to position, to velocity, each from position and from velocity.
type Blocks = [[[[f64; 3]; 3]; 2]; 2];

pub(super) fn sheet(workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let (mission, plan) = outcome(BRAKING, &[], &mut *workers.observer)?;
    let flights = flights(&mission, &plan)?;
    let mut blocks: Blocks = Default::default();
    let open = steered(Guidance::OpenLoop);
    for column in 0..6 {
        let at = |sign: f64| {
            let mut d = Deviations::default();
            let side = if column < 3 { &mut d.position_m } else { &mut d.velocity_m_s };
            side[column % 3] = sign * STEPS[column / 3];
            flights
                .fly(&d, &open.guidance, &open.onboard)
                .ok_or_else(|| Stop::NotSolved("a flight does not end".into()))
        };
        let (above, below) = (at(1.0)?, at(-1.0)?);
        for row in 0..6 {
            blocks[row / 3][column / 3][row % 3][column % 3] =
                (above[row] - below[row]) / (2.0 * STEPS[column / 3]);
        }
    }
    let distance = RADIUS + 15e3;
    let time = (distance.powi(3) / MU).sqrt();
    let norms = blocks.map(|row| row.map(|block| norm(&block)));
    let [[rr, rv], [vr, vv]] = norms;
    let printed = |power: i32| Some(Known { value: 10_f64.powi(power), within: 0.9 * 10_f64.powi(power) });
    let row = |label, found, reference: f64, power: Option<i32>| Compared {
        label,
        printed: power.and_then(printed),
        found,
        reference: to(reference, 1e-5 * reference),
        why: power.filter(|p| *p > 0).map_or("", |_| "no block of this arc is that large").into(),
    };
    let rows = vec![
        row("position to position, normalised", rr, 1.168_501_389, Some(2)),
        row("velocity to position, normalised", rv / time, 0.428_409_952, Some(0)),
        row("position to velocity, normalised", vr * time, 0.855_680_016, Some(4)),
        row("velocity to velocity, normalised", vv, 1.170_339_433, Some(2)),
        row("velocity to position, s", rv, 448.687_260_755, None),
        row("position to velocity, 1/s", vr, 8.170_096_793e-4, None),
    ];
    let mut sheet = comparison::sheet(
        "transition",
        "State-transition matrix of the main braking, thrust fixed in space: largest singular values of its blocks beside the \
         printed orders of magnitude (reference: variational equations)",
        rows,
    );
    sheet.findings.push(format!(
        "Unit of time of the normalised blocks: {time:.3} s, of an orbit at the perilune; by central differences of flights here."
    ));
    Ok(sheet)
}

/// Largest singular value: power iteration on the square.
fn norm(a: &[[f64; 3]; 3]) -> f64 {
    let mut x = [1.0, 0.7, 0.4];
    let mut size = 0.0;
    for _ in 0..500 {
        let y = [0, 1, 2].map(|i| (0..3).map(|j| a[i][j] * x[j]).sum::<f64>());
        let z = [0, 1, 2].map(|j| (0..3).map(|i| a[i][j] * y[i]).sum::<f64>());
        let length = z.iter().map(|c| c * c).sum::<f64>().sqrt();
        if length == 0.0 {
            return 0.0;
        }
        size = length.sqrt();
        x = z.map(|c| c / length);
    }
    size
}
