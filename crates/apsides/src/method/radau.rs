//! Collocation by `apsides-radau`.

use apsides_nlp::Observer;
use apsides_ocp::{Guess, Mesh, Ocp, Trajectory};
use apsides_radau::{Radau, RadauSettings, RadauSolution};

use super::{Shortfall, Solution};
use crate::key::{Key, Range};
use crate::{Counters, Error, Mission};

const MESH_TOLERANCE: &str = "radau.mesh_tolerance";

pub(super) const KEYS: &[Key] = &[
    Key::count("radau.intervals", 10, 1, 100_000, "mesh intervals per phase of the first mesh"),
    Key::count("radau.points", 5, 1, 60, "collocation points per interval of the first mesh"),
    Key::number(MESH_TOLERANCE, 1e-10, Range::open(0.0, 1.0), "largest relative error between points"),
    Key::count("radau.max_meshes", 20, 1, 1000, "most meshes solved; 1 switches refinement off"),
    Key::number("radau.nlp_tolerance", 1e-10, Range::open(0.0, 1.0), "scaled optimality error of each solve"),
];

impl Mission {
    /// Solves by collocation; the mesh is that of `start` where it has been made for collocation.
    pub(super) fn solve_by_radau(
        &self,
        ocp: &Ocp,
        guess: &Guess,
        start: Option<&Trajectory>,
        observer: &mut dyn Observer,
    ) -> Result<Solution, Error> {
        // Costates mark a mesh that was made for collocation.
        let mesh = match start.filter(|t| t.phases.iter().all(|p| p.costate.is_some())) {
            Some(t) => Mesh { phases: t.phases.iter().map(|p| p.mesh.clone()).collect() },
            None => self.first_mesh(ocp)?,
        };
        self.solve_by_radau_on(ocp, guess, mesh, observer)
    }

    /// Solves by collocation from a mesh.
    pub(super) fn solve_by_radau_on(
        &self,
        ocp: &Ocp,
        guess: &Guess,
        mesh: Mesh,
        observer: &mut dyn Observer,
    ) -> Result<Solution, Error> {
        let method = self.radau();
        let solution = method.solve_on(ocp, guess, mesh, observer)?;
        Ok(of_radau(solution, &method.settings))
    }

    pub(crate) fn radau(&self) -> Radau {
        let mut settings = RadauSettings {
            tolerance: self.values.number(MESH_TOLERANCE),
            max_refinements: self.values.count("radau.max_meshes") - 1,
            threads: self.threads,
            ..RadauSettings::default()
        };
        settings.nlp.tolerance = self.values.number("radau.nlp_tolerance");
        Radau { settings }
    }

    /// The mission, solved no more accurately between the points of the mesh than this.
    pub(crate) fn with_mesh_tolerance_from(&self, least: f64) -> Self {
        let tolerance = self.values.number(MESH_TOLERANCE).max(least);
        Self { values: self.values.with_number(MESH_TOLERANCE, tolerance), ..self.clone() }
    }

    pub(crate) fn first_mesh(&self, ocp: &Ocp) -> Result<Mesh, Error> {
        let (intervals, points) = (self.values.count("radau.intervals"), self.values.count("radau.points"));
        Ok(Mesh::uniform(ocp, intervals, points)?)
    }
}

fn of_radau(solution: RadauSolution, settings: &RadauSettings) -> Solution {
    let last = solution.meshes.last();
    let shortfall = (!solution.accurate).then(|| {
        Shortfall::mesh(format!(
            "the error between the points is {:.1e}, above `radau.mesh_tolerance` = {:.1e}; raise `radau.max_meshes`",
            last.map_or(f64::NAN, |m| m.error),
            settings.tolerance
        ))
    });
    Solution {
        status: solution.status,
        shortfall,
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
        search: None,
        report: Some(solution.report),
        trajectory: solution.trajectory,
    }
}
