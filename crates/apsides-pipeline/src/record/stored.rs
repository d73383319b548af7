//! Trajectories as files keep them: every number by its bits.

use std::sync::Arc;

use apsides_basis::Barycentric;
use apsides_ocp::mesh::{ArcKind, Break, Crossing, PhaseArc, PhaseMesh, TouchPoint};
use apsides_ocp::{Contact, PhaseTrajectory, PiecewisePolynomial, Segment, Trajectory};
use serde::{Deserialize, Serialize};

/// Numbers by their bits.
type Bits = Vec<u64>;

fn bits(numbers: &[f64]) -> Bits {
    numbers.iter().map(|v| v.to_bits()).collect()
}

fn numbers(bits: &[u64]) -> Vec<f64> {
    bits.iter().copied().map(f64::from_bits).collect()
}

/// A trajectory.
#[derive(Serialize, Deserialize)]
pub(super) struct Stored {
    phases: Vec<StoredPhase>,
    parameters: Bits,
    objective: u64,
    constraint_multipliers: Option<Vec<Bits>>,
}

#[derive(Serialize, Deserialize)]
struct StoredPhase {
    name: String,
    times: [u64; 2],
    mesh: StoredMesh,
    state: StoredPolynomial,
    control: StoredPolynomial,
    costate: Option<StoredPolynomial>,
    path_multipliers: Option<StoredPolynomial>,
    /// End, row, multiplier.
    contacts: Vec<(usize, usize, u64)>,
    integral_multipliers: Option<Bits>,
    interval_errors: Bits,
}

#[derive(Serialize, Deserialize)]
struct StoredPolynomial {
    dimension: usize,
    breaks: Bits,
    /// Nodes that segments share.
    bases: Vec<Bits>,
    /// The place of its nodes, and the values.
    segments: Vec<(usize, Bits)>,
}

#[derive(Serialize, Deserialize)]
struct StoredMesh {
    fractions: Bits,
    points: Vec<usize>,
    /// End, free, tangent.
    breaks: Vec<(usize, bool, bool)>,
    /// Controls and rows.
    arcs: Vec<[Vec<Option<u8>>; 2]>,
    touch_points: Vec<(usize, usize, bool)>,
    crossings: Vec<(usize, usize, bool)>,
}

/// Kinds of arcs by their place.
const KINDS: [ArcKind; 4] = [ArcKind::Lower, ArcKind::Upper, ArcKind::Singular, ArcKind::Free];

impl Stored {
    pub(super) fn of(t: &Trajectory) -> Self {
        Self {
            phases: t.phases.iter().map(StoredPhase::of).collect(),
            parameters: bits(&t.parameters),
            objective: t.objective.to_bits(),
            constraint_multipliers: t
                .constraint_multipliers
                .as_ref()
                .map(|all| all.iter().map(|m| bits(m)).collect()),
        }
    }

    /// The trajectory; none where the numbers make none.
    pub(super) fn restored(&self) -> Option<Trajectory> {
        Some(Trajectory {
            phases: self.phases.iter().map(StoredPhase::restored).collect::<Option<_>>()?,
            parameters: numbers(&self.parameters),
            objective: f64::from_bits(self.objective),
            constraint_multipliers: self
                .constraint_multipliers
                .as_ref()
                .map(|all| all.iter().map(|m| numbers(m)).collect()),
        })
    }
}

impl StoredPhase {
    fn of(t: &PhaseTrajectory) -> Self {
        Self {
            name: t.name.clone(),
            times: [t.initial_time, t.final_time].map(f64::to_bits),
            mesh: StoredMesh::of(&t.mesh),
            state: StoredPolynomial::of(&t.state),
            control: StoredPolynomial::of(&t.control),
            costate: t.costate.as_ref().map(StoredPolynomial::of),
            path_multipliers: t.path_multipliers.as_ref().map(StoredPolynomial::of),
            contacts: t.contacts.iter().map(|c| (c.end, c.row, c.multiplier.to_bits())).collect(),
            integral_multipliers: t.integral_multipliers.as_deref().map(bits),
            interval_errors: bits(&t.interval_errors),
        }
    }

    fn restored(&self) -> Option<PhaseTrajectory> {
        let optional = |p: &Option<StoredPolynomial>| match p {
            Some(p) => p.restored().map(Some),
            None => Some(None),
        };
        let contact = |&(end, row, multiplier): &(usize, usize, u64)| Contact {
            end,
            row,
            multiplier: f64::from_bits(multiplier),
        };
        let [initial_time, final_time] = self.times.map(f64::from_bits);
        Some(PhaseTrajectory {
            name: self.name.clone(),
            initial_time,
            final_time,
            mesh: self.mesh.restored()?,
            state: self.state.restored()?,
            control: self.control.restored()?,
            costate: optional(&self.costate)?,
            path_multipliers: optional(&self.path_multipliers)?,
            contacts: self.contacts.iter().map(contact).collect(),
            integral_multipliers: self.integral_multipliers.as_deref().map(numbers),
            interval_errors: numbers(&self.interval_errors),
        })
    }
}

impl StoredPolynomial {
    fn of(p: &PiecewisePolynomial) -> Self {
        let mut bases: Vec<Bits> = Vec::new();
        let segment = |s: &Segment| {
            let nodes = bits(s.basis.nodes());
            let place = bases.iter().position(|b| *b == nodes).unwrap_or_else(|| {
                bases.push(nodes);
                bases.len() - 1
            });
            (place, bits(&s.values))
        };
        let segments = p.segments().iter().map(segment).collect();
        Self { dimension: p.dimension(), breaks: bits(p.breaks()), bases, segments }
    }

    fn restored(&self) -> Option<PiecewisePolynomial> {
        let bases = self.bases.iter().map(|nodes| Barycentric::new(&numbers(nodes)).map(Arc::new));
        let bases = bases.collect::<Result<Vec<_>, _>>().ok()?;
        let segment = |(place, values): &(usize, Bits)| {
            Some(Segment { basis: Arc::clone(bases.get(*place)?), values: numbers(values) })
        };
        let segments = self.segments.iter().map(segment).collect::<Option<_>>()?;
        PiecewisePolynomial::new(self.dimension, numbers(&self.breaks), segments).ok()
    }
}

impl StoredMesh {
    fn of(m: &PhaseMesh) -> Self {
        let place = |kind: &Option<ArcKind>| {
            kind.and_then(|kind| KINDS.iter().position(|k| *k == kind)).map(|place| place as u8)
        };
        let places = |kinds: &[Option<ArcKind>]| kinds.iter().map(place).collect::<Vec<_>>();
        Self {
            fractions: bits(m.fractions()),
            points: m.points().to_vec(),
            breaks: m.breaks().iter().map(|b| (b.end, b.free, b.is_tangent)).collect(),
            arcs: m.arcs().iter().map(|a| [places(&a.controls), places(&a.rows)]).collect(),
            touch_points: m.touch_points().iter().map(|t| (t.end, t.row, t.upper)).collect(),
            crossings: m.crossings().iter().map(|c| (c.end, c.kink, c.rising)).collect(),
        }
    }

    fn restored(&self) -> Option<PhaseMesh> {
        let kinds = |places: &[Option<u8>]| {
            let kind = |place: &Option<u8>| match place {
                Some(place) => KINDS.get(usize::from(*place)).map(|kind| Some(*kind)),
                None => Some(None),
            };
            places.iter().map(kind).collect::<Option<Vec<_>>>()
        };
        let arc = |[controls, rows]: &[Vec<Option<u8>>; 2]| {
            Some(PhaseArc { controls: kinds(controls)?, rows: kinds(rows)? })
        };
        let breaks =
            self.breaks.iter().map(|&(end, free, is_tangent)| Break { end, free, is_tangent }).collect();
        let arcs = self.arcs.iter().map(arc).collect::<Option<Vec<_>>>()?;
        let touches = self.touch_points.iter().map(|&(end, row, upper)| TouchPoint { end, row, upper });
        let crossings = self.crossings.iter().map(|&(end, kink, rising)| Crossing { end, kink, rising });
        let mesh = PhaseMesh::new(numbers(&self.fractions), self.points.clone()).ok()?;
        let mesh = mesh.with_arcs(breaks, arcs).ok()?.with_touch_points(touches.collect()).ok()?;
        mesh.with_crossings(crossings.collect()).ok()
    }
}
