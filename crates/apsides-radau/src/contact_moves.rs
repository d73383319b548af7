//! Where contacts should be: Newton's method for the rates of their rows.
//!
//! An interval end that moves changes the program; how the solution follows is one more solve with the factorised optimality
//! conditions. Contacts act on each other, so that all rates are derived by all places.

use apsides_nlp::{InteriorPoint, Perturbation, SolveReport};
use apsides_ocp::{Mesh, Trajectory};

use crate::RadauError;
use crate::activity::rows_without_controls;
use crate::contact::{Placed, RowCourse, SolvedMesh};
use crate::transcription::Transcription;

/// Half width of difference quotients, as a part of the shorter interval beside a contact.
const DIFFERENCE: f64 = 1e-4;

/// Longest move, as a part of the interval that it leads into.
const LONGEST_MOVE: f64 = 0.5;

/// Without a derivative: part of the distance to the extremum of the row, which moves against the contact.
const CAREFUL: f64 = 0.5;

/// Part of the interval after a contact at which the rate of the row is looked at for that distance.
const AHEAD: f64 = 1e-3;

/// Error of an interval from which on places of contacts say nothing: the mesh is refined first.
pub(crate) const ROUGH: f64 = 1e-4;

/// Moves contacts to where their rates should vanish; none while the mesh is too rough for that.
pub(crate) fn place(solved: &SolvedMesh<'_>, nlp: &mut Transcription, placed: &mut [Placed]) -> bool {
    let errors = |p: &Placed| &solved.trajectory.phases[p.phase].interval_errors[p.end - 1..=p.end];
    if placed.iter().any(|p| errors(p).iter().any(|e| *e > ROUGH)) {
        return false;
    }
    let moves = newton(solved, nlp, placed).ok().flatten();
    for (k, p) in placed.iter_mut().enumerate() {
        let fractions = solved.trajectory.phases[p.phase].mesh.fractions();
        let (before, here, after) = (fractions[p.end - 1], fractions[p.end], fractions[p.end + 1]);
        let wanted = moves.as_ref().map_or_else(|| careful(solved, p), |m| m[k]);
        let change = wanted.clamp(LONGEST_MOVE * (before - here), LONGEST_MOVE * (after - here));
        p.at = here + change;
    }
    true
}

/// Changes of the normalised times; none where the solution does not follow or the equations are singular.
fn newton(
    solved: &SolvedMesh<'_>,
    nlp: &mut Transcription,
    placed: &[Placed],
) -> Result<Option<Vec<f64>>, RadauError> {
    let solver = InteriorPoint { settings: solved.settings.nlp.clone() };
    let mut sensitivity = solver.sensitivity(nlp, solved.report)?;
    let n = placed.len();
    let mut matrix = vec![0.0; n * (n + 1)];
    // How far an end goes on the moved mesh of the trajectory, per unit on the mesh of the program.
    let mut stretch = vec![1.0; n];
    for (j, p) in placed.iter().enumerate() {
        let mesh = &solved.mesh.phases[p.phase];
        let (f, at) = (mesh.fractions(), mesh.fractions()[p.end]);
        let h = DIFFERENCE * (at - f[p.end - 1]).min(f[p.end + 1] - at);
        let transcribe = |change: f64| -> Result<Transcription, RadauError> {
            let mut moved: Mesh = solved.mesh.clone();
            moved.phases[p.phase] = mesh.with_end_at(p.end, at + change)?;
            Transcription::new(solved.ocp, &moved, solved.guess)
        };
        let (mut before, mut after) = (transcribe(-h)?, transcribe(h)?);
        let perturbation = Perturbation::between(&mut before, &mut after, solved.report, 2.0 * h)?;
        let derivative = sensitivity.solve(&perturbation)?;
        let follow = |nlp: &Transcription, change: f64| -> Result<Trajectory, RadauError> {
            let x = solved.report.x.iter().zip(&derivative.x).map(|(x, dx)| x + change * dx).collect();
            nlp.trajectory(solved.ocp, &SolveReport { x, ..solved.report.clone() })
        };
        let (low, high) = (follow(&before, -h)?, follow(&after, h)?);
        let place = |t: &Trajectory| t.phases[p.phase].mesh.fractions()[p.end];
        stretch[j] = (place(&high) - place(&low)) / (2.0 * h);
        for (i, other) in placed.iter().enumerate() {
            matrix[i * (n + 1) + j] = (rate(solved, &high, other) - rate(solved, &low, other)) / (2.0 * h);
        }
    }
    for (i, p) in placed.iter().enumerate() {
        matrix[i * (n + 1) + n] = -p.rate;
    }
    Ok(solution(n, matrix).map(|moves| moves.iter().zip(&stretch).map(|(m, s)| m * s).collect()))
}

/// A part of the way to the extremum of the row.
fn careful(solved: &SolvedMesh<'_>, p: &Placed) -> f64 {
    let f = solved.trajectory.phases[p.phase].mesh.fractions();
    let ahead = AHEAD * (f[p.end + 1] - f[p.end]);
    let time = solved.trajectory.phases[p.phase].time_at(f[p.end] + ahead);
    let later =
        with_course(solved, solved.trajectory, p, |course| course.rate(p.end, time, p.touch.point.upper));
    let way = ahead * p.rate / (p.rate - later);
    if way.is_finite() { CAREFUL * way } else { 0.0 }
}

/// Rate of the row of a contact along a trajectory.
fn rate(solved: &SolvedMesh<'_>, trajectory: &Trajectory, p: &Placed) -> f64 {
    with_course(solved, trajectory, p, |course| course.rate_at_end(p.end, p.touch.point.upper))
}

fn with_course(
    solved: &SolvedMesh<'_>,
    trajectory: &Trajectory,
    p: &Placed,
    value: impl FnOnce(&mut RowCourse<'_>) -> f64,
) -> f64 {
    let (phase, t) = (&solved.ocp.phases[p.phase], &trajectory.phases[p.phase]);
    let rows = rows_without_controls(phase);
    let mut courses = rows.iter().filter_map(|q| RowCourse::new(phase, t, &trajectory.parameters, q));
    courses.find(|c| c.row == p.touch.point.row).map_or(f64::NAN, |mut course| value(&mut course))
}

/// Solves `n` linear equations, row-major with the right-hand sides as last column, by elimination with pivots.
fn solution(n: usize, mut a: Vec<f64>) -> Option<Vec<f64>> {
    let width = n + 1;
    for k in 0..n {
        let size = |row: &usize| a[row * width + k].abs();
        let pivot = (k..n).max_by(|i, j| size(i).total_cmp(&size(j)))?;
        if !(size(&pivot) > 0.0 && size(&pivot).is_finite()) {
            return None;
        }
        for c in 0..width {
            a.swap(k * width + c, pivot * width + c);
        }
        for i in (0..n).filter(|i| *i != k) {
            let factor = a[i * width + k] / a[k * width + k];
            for c in k..width {
                a[i * width + c] -= factor * a[k * width + c];
            }
        }
    }
    let x: Vec<f64> = (0..n).map(|k| a[k * width + n] / a[k * width + k]).collect();
    x.iter().all(|v| v.is_finite()).then_some(x)
}

#[cfg(test)]
mod tests {
    use super::solution;

    #[test]
    fn linear_equations_with_a_zero_pivot() {
        // 2 y = 4, 3 x + y = 5.
        assert_eq!(solution(2, vec![0.0, 2.0, 4.0, 3.0, 1.0, 5.0]), Some(vec![1.0, 2.0]));
        assert_eq!(solution(2, vec![1.0, 2.0, 3.0, 2.0, 4.0, 6.0]), None);
        assert_eq!(solution(1, vec![f64::NAN, 1.0]), None);
    }
}
