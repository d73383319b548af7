//! Events of a solve from mesh to mesh: switches between bounds, contacts, crossings of kinks, and the mesh that has interval ends there.

use apsides_ocp::{Mesh, Ocp, Trajectory};

use crate::RadauError;
use crate::boundary_arcs::with_long_intervals;
use crate::breaks::{Instants, with_instants};
use crate::contact::{Contacts, NextContacts, SolvedMesh};
use crate::crossing::{Crossings, Passages};
use crate::error_estimate::Estimate;
use crate::mesh_solve::MeshSolve;
use crate::refinement::refine;
use crate::settings::RadauSettings;
use crate::settling::Displaced;
use crate::state_bounds::without_arcs;
use crate::switches::{Known, Structure};

/// Most changes of the structure of switches in a solve: what has not settled then is left to refinement.
const MOST_REVISIONS: usize = 8;

/// Most searches for events in a solve: a coarse mesh can show places of them that lead nowhere, where a finer one shows the right ones.
const MOST_SEARCHES: usize = 3;

/// Part of its last move that a kink moves at most where it comes to its place.
const CLOSING_IN: f64 = 0.5;

/// Part of the error of the mesh that they led nowhere from, at which events are looked for again.
const FINER: f64 = 0.1;

/// An excess of the bounds on controls, in units of the tolerance, that is none of breaks close to their places.
const BEYOND: f64 = 100.0;

/// The search for events after each mesh.
pub(crate) struct Events {
    /// Searches that may follow where the present one is given up.
    searches: usize,
    /// Error of a mesh from which on they are looked for again, after they were given up.
    resumes_at: Option<f64>,
    /// True until a last search has begun from an accurate mesh.
    may_end_with_search: bool,
    /// Changes of the structure of switches that are left.
    revisions: usize,
    /// The farthest that a kink moved last, where nothing else changed.
    last_move: f64,
    /// Per phase, the breaks that the mesh has at other zeros of their switching functions than the last one.
    displaced: Vec<Vec<Displaced>>,
    contacts: Contacts,
    crossings: Crossings,
}

impl Events {
    pub(crate) fn new(enabled: bool) -> Self {
        Self {
            searches: if enabled { MOST_SEARCHES - 1 } else { 0 },
            resumes_at: None,
            may_end_with_search: enabled,
            revisions: if enabled { MOST_REVISIONS } else { 0 },
            last_move: f64::INFINITY,
            displaced: Vec::new(),
            contacts: Contacts::new(enabled),
            crossings: Crossings::new(enabled),
        }
    }

    /// Looks for no more of them, until meshes have less error than the one with this error that they led nowhere from.
    pub(crate) fn give_up(&mut self, error: f64) {
        self.resumes_at = (self.searches > 0).then_some(FINER * error);
        self.searches = self.searches.saturating_sub(1);
        self.revisions = 0;
        self.contacts.give_up();
        self.crossings.give_up();
    }

    /// True once, where searches have led nowhere and an accurate mesh shows arcs along bounds that it does not have: their places are then known
    /// well, and costates of a mesh without them are wrong.
    fn may_search_again(
        &self,
        structure: &Structure<'_>,
        solve: &MeshSolve,
        settings: &RadauSettings,
    ) -> bool {
        self.may_end_with_search
            && self.revisions == 0
            && self.resumes_at.is_none()
            && solve.is_accurate(settings)
            && structure.has_arcs()
            && !structure.is_that_of(&solve.trajectory, true)
    }

    /// Compares those of the mesh with the trajectory on it, which gets the errors beside contacts that stand where they should.
    pub(crate) fn step<'a>(
        &mut self,
        ocp: &'a Ocp,
        solve: &mut MeshSolve,
        settings: &RadauSettings,
    ) -> FoundEvents<'a> {
        let is_finer = |error: f64| solve.estimate.error <= error || solve.is_accurate(settings);
        if self.resumes_at.is_some_and(is_finer) {
            let Self { searches, may_end_with_search, .. } = *self;
            *self = Self { searches, may_end_with_search, ..Self::new(true) };
        }
        let known = Known { displaced: &self.displaced, without_arcs: self.contacts.without_arcs() };
        let structure = Structure::of(ocp, &mut solve.nlp, &solve.report, &solve.trajectory, &known);
        let structure = if self.may_search_again(&structure, solve, settings) {
            *self = Self { searches: 0, may_end_with_search: false, ..Self::new(true) };
            Structure::of(ocp, &mut solve.nlp, &solve.report, &solve.trajectory, &Known::default())
        } else {
            structure
        };
        self.displaced = structure.displaced();
        let solved = SolvedMesh {
            ocp,
            report: &solve.report,
            trajectory: &solve.trajectory,
            beside_touch: &solve.estimate.beside_touch,
            settings,
            structure: &structure,
        };
        let contacts = self.contacts.step(&solved, &mut solve.nlp);
        if contacts.settled {
            solve.estimate.add_beside_touch(&mut solve.trajectory);
        }
        let in_bounds = solve.is_in_bounds(settings);
        let has_arcs_found = structure.is_that_of(&solve.trajectory, in_bounds);
        let switches_settled = self.revisions == 0 || has_arcs_found;
        let passages = self.crossings.step(ocp, &solve.trajectory);
        FoundEvents { structure, has_arcs_found, switches_settled, contacts, passages }
    }

    /// The next mesh: refined where events say nothing, with interval ends at those that were found. Those that make no mesh are left out.
    pub(crate) fn next_mesh(
        &mut self,
        found: &FoundEvents<'_>,
        ocp: &Ocp,
        (trajectory, estimate): (&Trajectory, &Estimate),
        plain: &Mesh,
        joints: &[Vec<f64>],
        settings: &RadauSettings,
    ) -> Result<Mesh, RadauError> {
        let FoundEvents { structure, switches_settled, contacts, passages, .. } = found;
        let instants = found.instants();
        // Kinks on their way to their places are no change of the structure.
        let moved = structure.move_of_kinks(trajectory).unwrap_or(f64::INFINITY);
        let closes_in = moved < CLOSING_IN * self.last_move;
        self.last_move = moved;
        if self.revisions == 0 && !closes_in {
            let spared = passages.spared(trajectory.clone());
            let refined = refine(ocp, &contacts.spared(spared), joints, settings)?;
            // Arcs beside which controls are beyond bounds that were left out are none.
            let refined =
                if estimate.controls > BEYOND * settings.tolerance { without_arcs(refined) } else { refined };
            return Ok(with_instants(&refined, &instants).unwrap_or_else(|_| plain.clone()));
        }
        self.revisions -= usize::from(!switches_settled && !closes_in);
        let spared = passages.spared(structure.spared(trajectory));
        let refined = refine(ocp, &contacts.spared(spared), joints, settings)?;
        match structure.mesh(&refined, &instants) {
            Ok(mesh) if !switches_settled => {
                with_long_intervals(ocp, &mesh, trajectory, joints, settings.max_points)
            }
            placed => Ok(placed.unwrap_or_else(|_| plain.clone())),
        }
    }
}

/// The events along a trajectory.
pub(crate) struct FoundEvents<'a> {
    pub(crate) structure: Structure<'a>,
    /// True when the mesh has the breaks and arcs of the structure.
    pub(crate) has_arcs_found: bool,
    /// True then, or when no more are looked for.
    switches_settled: bool,
    pub(crate) contacts: NextContacts,
    passages: Passages,
}

impl FoundEvents<'_> {
    /// True when the mesh has exactly these.
    pub(crate) fn are_settled(&self) -> bool {
        self.switches_settled && self.contacts.settled && self.passages.settled
    }

    /// Per phase, those that stand in one instant.
    fn instants(&self) -> Vec<Instants> {
        let phases = self.contacts.touch_points.iter().zip(&self.passages.phases);
        phases.map(|(t, c)| Instants { touch_points: t.clone(), crossings: c.clone() }).collect()
    }
}
