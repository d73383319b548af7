//! The methods behind the key `method`, with one face: what they take from the mission's values, and what a solution says.

use apsides_flatness::{
    BoundRows, Breaks, FlatSystem, Flatness, FlatnessSettings, FlatnessSolution, Placement, SplineSettings,
};
use apsides_nlp::{Observer, SolveReport, Status};
use apsides_ocp::{Guess, Mesh, Ocp, Trajectory};
use apsides_radau::{Radau, RadauSettings, RadauSolution};

use crate::key::{Key, Range, Values};
use crate::missions::Posed;
use crate::{Counters, Error, Mission};

pub(crate) const RADAU: &str = "radau";
pub(crate) const FLATNESS: &str = "flatness";

/// Keys of the methods, the same for all missions.
pub(crate) const KEYS: &[Key] = &[
    Key::choice("method", &[RADAU, FLATNESS], "how the problem is solved"),
    Key::count("radau.intervals", 10, 1, 100_000, "mesh intervals per phase of the first mesh"),
    Key::count("radau.points", 5, 1, 60, "collocation points per interval of the first mesh"),
    Key::number(
        "radau.mesh_tolerance",
        1e-10,
        Range::open(0.0, 1.0),
        "largest relative error between points",
    ),
    Key::count("radau.max_meshes", 20, 1, 1000, "most meshes solved; 1 switches refinement off"),
    Key::number("radau.nlp_tolerance", 1e-10, Range::open(0.0, 1.0), "scaled optimality error of each solve"),
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

/// A solution by any method.
pub(crate) struct Solution {
    pub(crate) trajectory: Trajectory,
    pub(crate) status: Status,
    /// Whether the error between the points meets the tolerance.
    pub(crate) accurate: bool,
    /// That error, relative.
    pub(crate) error: f64,
    /// What would mend an error above the tolerance.
    pub(crate) remedy: String,
    pub(crate) counters: Counters,
    pub(crate) report: SolveReport,
    /// The constraint that could not be met.
    pub(crate) unmet: Option<String>,
    pub(crate) warnings: Vec<String>,
    pub(crate) switches: Vec<String>,
}

impl Mission {
    /// Solves by the method of the mission's values. `start` replaces the mission's own guess.
    pub(crate) fn solve_by_method(
        &self,
        posed: &Posed,
        start: Option<&Trajectory>,
        observer: &mut dyn Observer,
    ) -> Result<Solution, Error> {
        let guess = start.map_or_else(|| posed.guess.clone(), Guess::earlier);
        if self.values.word("method") == FLATNESS {
            let systems = posed.flat_systems.as_deref().ok_or_else(|| self.not_flat())?;
            return flatness(&self.values, &posed.ocp, systems, &guess, observer);
        }
        // Costates mark a mesh that was made for collocation.
        let mesh = match start.filter(|t| t.phases.iter().all(|p| p.costate.is_some())) {
            Some(t) => Mesh { phases: t.phases.iter().map(|p| p.mesh.clone()).collect() },
            None => self.first_mesh(&posed.ocp)?,
        };
        let method = self.radau();
        let solution = method.solve_on(&posed.ocp, &guess, mesh, observer)?;
        Ok(of_radau(solution, &method.settings))
    }

    /// Whether the method can fly the mission.
    pub(crate) fn check_method(&self) -> Result<(), Error> {
        match self.values.word("method") {
            FLATNESS if self.pose()?.flat_systems.is_none() => Err(self.not_flat()),
            _ => Ok(()),
        }
    }

    fn not_flat(&self) -> Error {
        Error::Conflict {
            place: format!("mission `{}`", self.name()),
            reason: "`method` is \"flatness\", which flies full thrust in a direction that may jump; choose `throttle` = \
                     \"full\" and `max_pitch_rate_deg_s` = inf, or `method` = \"radau\""
                .into(),
        }
    }

    pub(crate) fn radau(&self) -> Radau {
        let mut settings = RadauSettings {
            mesh_tolerance: self.values.number("radau.mesh_tolerance"),
            max_meshes: self.values.count("radau.max_meshes"),
            threads: self.threads,
            ..RadauSettings::default()
        };
        settings.nlp.tolerance = self.values.number("radau.nlp_tolerance");
        Radau { settings }
    }

    pub(crate) fn first_mesh(&self, ocp: &Ocp) -> Result<Mesh, Error> {
        let (intervals, points) = (self.values.count("radau.intervals"), self.values.count("radau.points"));
        Ok(Mesh::uniform(ocp, intervals, points)?)
    }
}

fn of_radau(solution: RadauSolution, settings: &RadauSettings) -> Solution {
    let last = solution.meshes.last();
    let error = last.map_or(f64::NAN, |m| m.error);
    Solution {
        status: solution.status,
        accurate: solution.accurate,
        error,
        remedy: format!(
            "above `radau.mesh_tolerance` = {:.1e}; raise `radau.max_meshes`",
            settings.mesh_tolerance
        ),
        counters: Counters {
            iterations: solution.meshes.iter().map(|m| m.iterations).sum(),
            factorisations: solution.meshes.iter().map(|m| m.factorisations).sum(),
            variables: last.map_or(0, |m| m.variables),
            constraints: last.map_or(0, |m| m.constraints),
            mesh_iterations: solution.meshes.len(),
        },
        unmet: solution.unmet.map(|unmet| unmet.to_string()),
        warnings: solution.warnings.iter().map(ToString::to_string).collect(),
        switches: solution.switches.iter().map(ToString::to_string).collect(),
        report: solution.report,
        trajectory: solution.trajectory,
    }
}

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

fn flatness(
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
    let remedy = if splines.iter().all(|s| s.refine) {
        format!(
            "above {:.1e} after {} refinements",
            method.settings.defect_tolerance,
            solution.solves.len().saturating_sub(1)
        )
    } else {
        "so that the curves are no trajectories; set `flatness.refine` = true".into()
    };
    Ok(Solution {
        status: solution.status,
        accurate: solution.accurate,
        error: solution.error,
        remedy,
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
        report: solution.report,
        trajectory: solution.trajectory,
    })
}
