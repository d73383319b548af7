//! Scales of the controls in the second variation.
//!
//! A scale from bounds far apart would make the curvature of its control so large that those of others are rounding beside it. It is not larger than
//! the control itself, or than the change by which the curvature adds to the Hamiltonian as much as its largest term, or as the least curved
//! of the controls.

use crate::optimality::PhaseConditions;

/// Points at which the curvature is looked at, at most.
const POINTS: usize = 40;

/// The scale of each control.
pub(super) fn of(conditions: &mut PhaseConditions<'_>) -> Vec<f64> {
    let (nx, nu) = (conditions.equations.nx, conditions.equations.nu);
    let width = conditions.equations.width();
    let (mut hamiltonian, mut path) = (vec![0.0; width * width], vec![0.0; width * width]);
    let (mut met, mut bend) = (vec![0.0_f64; nu], vec![0.0_f64; nu]);
    let control = &conditions.found.control;
    let places: Vec<(usize, f64)> = (0..control.segments().len())
        .flat_map(|segment| control.node_times(segment).map(move |time| (segment, time)))
        .collect();
    for (segment, time) in places.iter().step_by(places.len().div_ceil(POINTS).max(1)) {
        conditions.evaluate_within_bounds(*segment, *time);
        let PhaseConditions { equations, point, .. } = &*conditions;
        equations.curvature(&point.costate, &point.multipliers, &mut hamiltonian, &mut path);
        for j in 0..nu {
            let place = (nx + j) * width + nx + j;
            met[j] = met[j].max(point.u[j].abs());
            bend[j] = bend[j].max((hamiltonian[place] + path[place]).abs());
        }
    }
    let scales = &conditions.scaling.controls;
    let curvatures = bend.iter().zip(scales).map(|(b, s)| b * s * s).filter(|c| *c > 0.0);
    let size = curvatures.fold(f64::INFINITY, f64::min).max(conditions.hamiltonian_size);
    let scale = |j: usize| {
        let by_curvature = (size / bend[j]).sqrt();
        scales[j].min(met[j].max(by_curvature))
    };
    (0..nu).map(scale).collect()
}
