//! Flat outputs on B-splines by `apsides-flatness`.

use apsides_flatness::{
    BoundRows, Breaks, FlatSystem, Flatness, FlatnessSettings, FlatnessSolution, Placement, SplineSettings,
};
use apsides_nlp::Observer;
use apsides_ocp::{Guess, Ocp};

use super::{Shortfall, Solution};
use crate::key::{Key, Values};
use crate::{Counters, Error};

pub(super) const KEYS: &[Key] = &[
    Key::count("flatness.order", 0, 0, 32, "order of the splines; 0: four above their highest derivative"),
    Key::count("flatness.segments", 4, 1, 1000, "equal polynomial segments per phase"),
    Key::count(
        "flatness.points",
        4,
        1,
        1000,
        "collocation points per phase; of each segment where they are placed by segment",
    ),
    Key::choice(
        "flatness.placement",
        &["gauss-per-segment", "uniform", "gauss", "lobatto", "chebyshev", "greville"],
        "where the points are: in each segment, of splines just as smooth as the states must be; or over the whole phase, \
         of splines as smooth as their order allows",
    ),
    Key::flag(
        "flatness.refine",
        true,
        "refine splines until they meet the equations of motion between the points",
    ),
];

fn spline_settings(v: &Values) -> SplineSettings {
    let (order, segments) = (v.count("flatness.order"), v.count("flatness.segments"));
    let placement = match v.word("flatness.placement") {
        "uniform" => Placement::Uniform,
        "gauss" => Placement::Gauss,
        "lobatto" => Placement::Lobatto,
        "chebyshev" => Placement::Chebyshev,
        "greville" => Placement::Greville,
        _ => Placement::GaussPerSegment,
    };
    SplineSettings {
        order: (order > 0).then_some(order),
        breaks: match placement {
            Placement::GaussPerSegment => Breaks::Collocation(segments),
            _ => Breaks::Uniform(segments),
        },
        points: v.count("flatness.points"),
        placement,
        refine: v.flag("flatness.refine"),
    }
}

/// Solves by flat outputs.
pub(super) fn solve(
    v: &Values,
    ocp: &Ocp,
    systems: &[FlatSystem],
    guess: &Guess,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    let method = Flatness {
        settings: FlatnessSettings {
            spline: spline_settings(v),
            // Landings are well posed without the bounds of their states.
            bounds: BoundRows::WhereExceeded,
            ..FlatnessSettings::default()
        },
    };
    let splines = vec![method.settings.spline.clone(); ocp.phases.len()];
    let solution: FlatnessSolution = method.solve_on(ocp, systems, guess, &splines, observer)?;
    let all = || solution.presolve.iter().chain(&solution.solves);
    let last = solution.solves.last();
    let shortfall = (!solution.accurate).then(|| {
        let (error, tolerance) = (solution.error, method.settings.tolerance);
        let refinements = solution.solves.len().saturating_sub(1);
        let text = if !splines.iter().all(|s| s.refine) {
            format!(
                "the error between the points is {error:.1e}, so that the curves are no trajectories; set `flatness.refine` = true"
            )
        } else if error > tolerance {
            format!("the error between the points is {error:.1e}, above {tolerance:.1e} after {refinements} refinements")
        } else {
            format!("the objective has not settled after {refinements} refinements")
        };
        Shortfall::mesh(text)
    });
    Ok(Solution {
        status: solution.status,
        shortfall,
        counters: Counters {
            iterations: all().map(|s| s.iterations).sum(),
            factorisations: all().map(|s| s.factorisations).sum(),
            variables: last.map_or(0, |s| s.variables),
            constraints: last.map_or(0, |s| s.constraints),
            mesh_iterations: solution.solves.len(),
        },
        unmet: solution.unmet.as_ref().map(ToString::to_string),
        warnings: Vec::new(),
        switches: Vec::new(),
        search: None,
        report: Some(solution.report),
        trajectory: solution.trajectory,
    })
}
