//! Meshes: intervals of a phase, the number of collocation points in each, and arcs between switches of a control.

use crate::{Bounds, Ocp, OcpError};

/// A break this much closer to one neighbouring end than to the other is beside it.
const BESIDE: f64 = 0.25;

/// The behaviour of a control or of a path constraint row along an arc.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArcKind {
    /// It is held at its lower bound.
    Lower,
    /// It is held at its upper bound.
    Upper,
    /// A control between its bounds that the Hamiltonian is linear in: of one degree less than its points would allow, since
    /// along a singular arc the highest one is an oscillation that gains from the error of the rule.
    Singular,
    /// It is clear of its bounds, or follows from path constraints and what else is held: its bounds are left out.
    Free,
}

impl ArcKind {
    /// The value that a quantity with these bounds is held at.
    #[must_use]
    pub fn held(self, bounds: &Bounds) -> Option<f64> {
        match self {
            Self::Lower => Some(bounds.lower),
            Self::Upper => Some(bounds.upper),
            Self::Singular | Self::Free => None,
        }
    }
}

/// An inner interval end that divides a phase into arcs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Break {
    /// Index of the end among [`PhaseMesh::fractions`].
    pub end: usize,
    /// True if its time is an unknown; else it stays at its fraction of the phase.
    pub free: bool,
    /// True where a path constraint row meets its bound tangentially while a control is at its own, which that control leaves without a jump.
    pub is_tangent: bool,
}

/// An inner interval end at which a path constraint row without controls touches its bound, in this instant alone.
///
/// The multiplier of the row is an impulse there, so that costates jump. A method may hold the row at the bound at this end, and
/// leave its bounds out elsewhere in the two intervals beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TouchPoint {
    /// Index of the end among [`PhaseMesh::fractions`].
    pub end: usize,
    /// Index of the path constraint row, in the phase's order.
    pub row: usize,
    /// True if the upper bound is touched, false if the lower one is.
    pub upper: bool,
}

/// An inner interval end at which a state passes a kink of the equations. A method that knows it takes its time as an unknown and holds the
/// state there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crossing {
    /// Index of the end among [`PhaseMesh::fractions`].
    pub end: usize,
    /// Index among [`crate::Phase::kinks`].
    pub kink: usize,
    /// True where the quantity passes its value upwards: the equations behind are those above it.
    pub rising: bool,
}

/// The quantities whose behaviour along one arc of a phase is known.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PhaseArc {
    /// Per control, in the phase's order; empty when nothing is known.
    pub controls: Vec<Option<ArcKind>>,
    /// Per path constraint row, in the phase's order; empty when nothing is known.
    pub rows: Vec<Option<ArcKind>>,
}

/// Mesh of one phase on the normalised time from 0 to 1.
///
/// Some interval ends may be breaks: a method that knows them takes the times of free ones as unknowns. They divide the phase
/// into arcs, along which controls and path constraint rows may be held at a bound.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseMesh {
    fractions: Vec<f64>,
    points: Vec<usize>,
    breaks: Vec<Break>,
    arcs: Vec<PhaseArc>,
    touch_points: Vec<TouchPoint>,
    crossings: Vec<Crossing>,
}

impl PhaseMesh {
    /// `intervals` equal intervals with `points` collocation points each.
    ///
    /// # Errors
    /// [`OcpError::Mesh`] when either is zero.
    pub fn uniform(intervals: usize, points: usize) -> Result<Self, OcpError> {
        let fractions = (0..=intervals).map(|k| k as f64 / intervals.max(1) as f64).collect();
        Self::new(fractions, vec![points; intervals])
    }

    /// Interval ends from 0 to 1 and points per interval.
    ///
    /// # Errors
    /// [`OcpError::Mesh`] when the ends do not increase from 0 to 1 or an interval has no point.
    pub fn new(fractions: Vec<f64>, points: Vec<usize>) -> Result<Self, OcpError> {
        let fail =
            |reason: &str| Err(OcpError::Mesh { place: "mesh of a phase".into(), reason: reason.into() });
        if points.is_empty() || fractions.len() != points.len() + 1 {
            return fail("needs at least one interval and one end more than intervals");
        }
        if points.contains(&0) {
            return fail("every interval needs at least one point");
        }
        let ends = fractions[0] == 0.0 && fractions[points.len()] == 1.0;
        if !ends || fractions.iter().any(|f| f.is_nan()) || fractions.windows(2).any(|w| w[0] >= w[1]) {
            return fail("the interval ends must increase from 0 to 1");
        }
        let arcs = vec![PhaseArc::default()];
        Ok(Self {
            fractions,
            points,
            breaks: Vec::new(),
            arcs,
            touch_points: Vec::new(),
            crossings: Vec::new(),
        })
    }

    /// The same mesh with further interval ends between 0 and 1; an interval that is divided gives its points to each part. Those that are
    /// ends already stay as they are.
    ///
    /// # Errors
    /// [`OcpError::Mesh`] when one of them is not between 0 and 1.
    pub fn with_ends(&self, further: &[f64]) -> Result<Self, OcpError> {
        let mut fractions = self.fractions.clone();
        let mut points = self.points.clone();
        for &f in further {
            let k = fractions.partition_point(|end| *end < f);
            if fractions.get(k) == Some(&f) {
                continue;
            }
            fractions.insert(k, f);
            points.insert(k.saturating_sub(1), points.get(k.saturating_sub(1)).copied().unwrap_or(0));
        }
        let mesh = Self::new(fractions, points)?;
        let index = |end: usize| mesh.fractions.partition_point(|f| *f < self.fractions[end]);
        let breaks = self.breaks.iter().map(|b| Break { end: index(b.end), ..*b }).collect();
        let touch_points = self.touch_points.iter().map(|t| TouchPoint { end: index(t.end), ..*t }).collect();
        let crossings = self.crossings.iter().map(|c| Crossing { end: index(c.end), ..*c }).collect();
        Ok(Self { breaks, arcs: self.arcs.clone(), touch_points, crossings, ..mesh })
    }

    /// The same mesh with its inner ends that are within a distance of these places moved there, and no unknown of the times of breaks
    /// there. A free break that is next to such an end, and closer to it than to its other neighbour by much, is at that end.
    ///
    /// # Errors
    /// [`OcpError::Mesh`] when the ends then do not increase.
    pub fn with_fixed_ends(&self, places: &[f64], distance: f64) -> Result<Self, OcpError> {
        let mut mesh = self.clone();
        let mut is_fixed = vec![false; self.fractions.len()];
        for (end, f) in mesh.fractions.iter_mut().enumerate().take(self.intervals()).skip(1) {
            let Some(place) = places.iter().find(|place| (**place - *f).abs() <= distance) else { continue };
            (*f, is_fixed[end]) = (*place, true);
            mesh.breaks.iter_mut().filter(|b| b.end == end).for_each(|b| b.free = false);
        }
        Self::new(mesh.fractions.clone(), mesh.points.clone())?;
        // From the last one on, so that the indices of those before stay.
        for k in (0..mesh.breaks.len()).rev() {
            let Break { end, free: true, .. } = mesh.breaks[k] else { continue };
            let length = |interval: usize| mesh.fractions[interval + 1] - mesh.fractions[interval];
            let [left, right] = [length(end - 1), length(end)];
            let is_taken = |end: usize| mesh.breaks.iter().any(|b| b.end == end);
            let to = if is_fixed[end - 1] && left <= BESIDE * right && !is_taken(end - 1) {
                end - 1
            } else if is_fixed[end + 1] && right <= BESIDE * left && !is_taken(end + 1) {
                end
            } else {
                continue;
            };
            mesh.remove_end(end);
            is_fixed.remove(end);
            (mesh.breaks[k].end, mesh.breaks[k].free) = (to, false);
        }
        Ok(mesh)
    }

    /// Joins the two intervals at an inner end.
    fn remove_end(&mut self, end: usize) {
        self.fractions.remove(end);
        let points = self.points.remove(end);
        self.points[end - 1] = self.points[end - 1].max(points);
        self.touch_points.retain(|t| t.end != end);
        self.crossings.retain(|c| c.end != end);
        let ends = self.breaks.iter_mut().map(|b| &mut b.end);
        let ends = ends.chain(self.touch_points.iter_mut().map(|t| &mut t.end));
        ends.chain(self.crossings.iter_mut().map(|c| &mut c.end)).filter(|e| **e > end).for_each(|e| *e -= 1);
    }

    /// The same mesh with other numbers of points.
    ///
    /// # Errors
    /// [`OcpError::Mesh`] when there is not one number for each interval, or one is zero.
    pub fn with_points(self, points: Vec<usize>) -> Result<Self, OcpError> {
        let Self { points, .. } = Self::new(self.fractions.clone(), points)?;
        Ok(Self { points, ..self })
    }

    /// The same intervals with breaks at the listed interval ends (1 to `intervals - 1`, increasing) and one arc more than
    /// breaks.
    ///
    /// # Errors
    /// [`OcpError::Mesh`] when a break is no inner interval end, or a number does not fit.
    pub fn with_arcs(self, breaks: Vec<Break>, arcs: Vec<PhaseArc>) -> Result<Self, OcpError> {
        let inner = breaks.iter().all(|b| (1..self.intervals()).contains(&b.end));
        if !inner || breaks.windows(2).any(|w| w[0].end >= w[1].end) || arcs.len() != breaks.len() + 1 {
            let reason =
                "breaks must be increasing inner interval ends, with one arc more than breaks".into();
            return Err(OcpError::Mesh { place: "mesh of a phase".into(), reason });
        }
        Ok(Self { breaks, arcs, ..self })
    }

    /// The same intervals with touch points at the listed interval ends (1 to `intervals - 1`), in increasing order of ends, then
    /// of rows.
    ///
    /// # Errors
    /// [`OcpError::Mesh`] when one is at no inner interval end, or they do not increase.
    pub fn with_touch_points(self, touch_points: Vec<TouchPoint>) -> Result<Self, OcpError> {
        let inner = touch_points.iter().all(|t| (1..self.intervals()).contains(&t.end));
        if !inner || touch_points.windows(2).any(|w| (w[0].end, w[0].row) >= (w[1].end, w[1].row)) {
            let reason = "touch points must be inner interval ends in increasing order".into();
            return Err(OcpError::Mesh { place: "mesh of a phase".into(), reason });
        }
        Ok(Self { touch_points, ..self })
    }

    /// The same intervals with crossings at the listed interval ends (1 to `intervals - 1`), which increase.
    ///
    /// # Errors
    /// [`OcpError::Mesh`] when one is at no inner interval end, or they do not increase.
    pub fn with_crossings(self, crossings: Vec<Crossing>) -> Result<Self, OcpError> {
        let inner = crossings.iter().all(|c| (1..self.intervals()).contains(&c.end));
        if !inner || crossings.windows(2).any(|w| w[0].end >= w[1].end) {
            let reason = "crossings must be increasing inner interval ends".into();
            return Err(OcpError::Mesh { place: "mesh of a phase".into(), reason });
        }
        Ok(Self { crossings, ..self })
    }

    /// The same intervals without breaks, touch points and crossings.
    #[must_use]
    pub fn without_arcs(self) -> Self {
        Self {
            breaks: Vec::new(),
            arcs: vec![PhaseArc::default()],
            touch_points: Vec::new(),
            crossings: Vec::new(),
            ..self
        }
    }

    /// Interval ends that divide the phase into arcs.
    #[must_use]
    pub fn breaks(&self) -> &[Break] {
        &self.breaks
    }

    /// The arcs between the breaks, one more than breaks.
    #[must_use]
    pub fn arcs(&self) -> &[PhaseArc] {
        &self.arcs
    }

    /// Intervals of an arc.
    #[must_use]
    pub fn arc_intervals(&self, arc: usize) -> std::ops::Range<usize> {
        let start = if arc == 0 { 0 } else { self.breaks[arc - 1].end };
        start..self.breaks.get(arc).map_or(self.intervals(), |b| b.end)
    }

    /// The contacts of path constraint rows with their bounds.
    #[must_use]
    pub fn touch_points(&self) -> &[TouchPoint] {
        &self.touch_points
    }

    /// The crossings of states over kinks of the equations.
    #[must_use]
    pub fn crossings(&self) -> &[Crossing] {
        &self.crossings
    }

    /// Returns true if there is more than one arc, or something is known of the only one, or there is a touch point or a crossing.
    #[must_use]
    pub fn has_arcs(&self) -> bool {
        let instants = !self.touch_points.is_empty() || !self.crossings.is_empty();
        !self.breaks.is_empty() || self.arcs[0] != PhaseArc::default() || instants
    }

    /// Interval ends from 0 to 1.
    #[must_use]
    pub fn fractions(&self) -> &[f64] {
        &self.fractions
    }

    /// Collocation points per interval.
    #[must_use]
    pub fn points(&self) -> &[usize] {
        &self.points
    }

    /// Number of intervals.
    #[must_use]
    pub fn intervals(&self) -> usize {
        self.points.len()
    }

    /// Collocation points of the phase.
    #[must_use]
    pub fn total_points(&self) -> usize {
        self.points.iter().sum()
    }
}

/// Meshes of all phases of a problem.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// One mesh per phase.
    pub phases: Vec<PhaseMesh>,
}

impl Mesh {
    /// The same uniform mesh in every phase.
    ///
    /// # Errors
    /// [`OcpError::Mesh`] when either number is zero.
    pub fn uniform(ocp: &Ocp, intervals: usize, points: usize) -> Result<Self, OcpError> {
        let phase = PhaseMesh::uniform(intervals, points)?;
        Ok(Self { phases: vec![phase; ocp.phases.len()] })
    }
}
