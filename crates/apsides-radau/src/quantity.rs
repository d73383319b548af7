//! Quantities that can stand at bounds: controls, rows of path constraints and states.

use apsides_nlp::SolveReport;
use apsides_ocp::{Bounds, Phase, Variable};

use crate::junction::{Order, columns, order};
use crate::layout::CollocationPhase;

/// Index of a control, of a path constraint row or of a state.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum QuantityKind {
    Control(usize),
    Row(usize),
    State(usize),
}

impl QuantityKind {
    /// Says whether a control is the quantity or stands in its row.
    pub(crate) fn is_moved_by(self, phase: &Phase, control: usize) -> bool {
        match self {
            Self::Control(c) => c == control,
            Self::Row(row) => {
                columns(phase, row).is_some_and(|c| c.contains(&(phase.states.len() + control)))
            }
            Self::State(_) => false,
        }
    }

    /// Says whether nothing but controls stands in a row.
    pub(crate) fn is_of_controls_alone(self, phase: &Phase) -> bool {
        let first = phase.states.len();
        let controls = first..first + phase.controls.len();
        let inputs = if let Self::Row(row) = self { columns(phase, row) } else { None };
        inputs.is_some_and(|inputs| inputs.iter().all(|c| controls.contains(c)))
    }

    /// Says whether there is a control that moves both.
    pub(crate) fn shares_a_control(self, phase: &Phase, other: Self) -> bool {
        (0..phase.controls.len()).any(|c| self.is_moved_by(phase, c) && other.is_moved_by(phase, c))
    }
}

/// A control or path constraint row with bounds between which it can move.
pub(crate) struct Quantity<'a> {
    pub(crate) kind: QuantityKind,
    pub(crate) variable: &'a Variable,
    /// The distance of its bounds, or the size of the only one; none where that is zero.
    range: Option<f64>,
    has_control: bool,
    /// True for a control that the Hamiltonian is linear in.
    pub(crate) affine: bool,
    /// For a row without controls whose arcs along its bounds have junctions, the controls that hold it there; else none.
    pub(crate) held_by: Vec<(usize, &'a Variable)>,
    /// The order of the rate by which they do.
    pub(crate) order: usize,
}

impl<'a> Quantity<'a> {
    /// A quantity with bounds between which it can move.
    pub(crate) fn new(kind: QuantityKind, variable: &'a Variable, has_control: bool) -> Option<Self> {
        let bounds = variable.bounds;
        let width = bounds.upper - bounds.lower;
        let range = if width.is_finite() { Some(width) } else { variable.size() };
        let usable = bounds != Bounds::FREE && !bounds.is_fixed();
        let held_by = Vec::new();
        usable.then_some(Self { kind, variable, range, has_control, affine: false, held_by, order: 0 })
    }

    /// As one without controls that some hold along arcs at its bounds, by a rate of this order.
    pub(crate) fn held_by(self, phase: &'a Phase, order: Order) -> Self {
        let held_by = order.controls.into_iter().map(|c| (c, &phase.controls[c])).collect();
        Self { held_by, order: order.order, ..self }
    }

    /// The distance of its bounds, or the size of the only one; where that is zero, how far from it a quantity that no control occurs in
    /// gets in a phase. What controls may do at once their course says nothing of.
    pub(crate) fn range(&self, p: &CollocationPhase, report: &SolveReport) -> f64 {
        self.range.unwrap_or_else(|| {
            if self.has_control {
                return 1.0;
            }
            let bounds = self.variable.bounds;
            let bound = if bounds.lower.is_finite() { bounds.lower } else { bounds.upper };
            let values = (0..p.nodes.len()).map(|node| self.value(p, node, report));
            let farthest = values.map(|v| (v - bound).abs()).filter(|d| d.is_finite()).fold(0.0, f64::max);
            if farthest > 0.0 { farthest } else { 1.0 }
        })
    }

    /// Its value at a node.
    pub(crate) fn value(&self, p: &CollocationPhase, node: usize, report: &SolveReport) -> f64 {
        match self.kind {
            QuantityKind::Control(c) => report.x[p.control_column(node) + c],
            QuantityKind::Row(row) => match p.rate_arc_at(node, row) {
                Some(arc) if arc.upper => self.variable.bounds.upper,
                Some(_) => self.variable.bounds.lower,
                None => report.constraint_values[p.path_row(node) + row],
            },
            QuantityKind::State(s) => report.x[p.state_column(node) + s],
        }
    }

    /// Says whether it is a row without controls that can have arcs along its bounds.
    pub(crate) fn is_boundary(&self) -> bool {
        !self.held_by.is_empty()
    }
}

/// The quantities that can switch: controls, path constraint rows with controls, and rows without that can have arcs along their bounds;
/// all with bounds, and not fixed.
pub(crate) fn quantities(phase: &Phase) -> Vec<Quantity<'_>> {
    let controls = phase.controls.iter().enumerate().map(|(c, v)| (QuantityKind::Control(c), v));
    let others = controls.chain(rows(phase, true)).filter_map(|(kind, v)| Quantity::new(kind, v, true));
    // Without a control in it a row cannot jump.
    let boundary = rows_without_controls(phase).into_iter().filter_map(|q| {
        let QuantityKind::Row(row) = q.kind else { return None };
        Some(q.held_by(phase, order(phase, row)?))
    });
    others.chain(boundary).collect()
}

/// Path constraint rows without controls that have bounds and are not fixed.
pub(crate) fn rows_without_controls(phase: &Phase) -> Vec<Quantity<'_>> {
    rows(phase, false).filter_map(|(kind, v)| Quantity::new(kind, v, false)).collect()
}

/// Path constraint rows with a control in them that are fixed.
pub(crate) fn equalities(phase: &Phase) -> impl Iterator<Item = QuantityKind> {
    rows(phase, true).filter(|(_, v)| v.bounds.is_fixed()).map(|(kind, _)| kind)
}

/// Path constraint rows with or without a control in them.
fn rows(phase: &Phase, with_control: bool) -> impl Iterator<Item = (QuantityKind, &Variable)> {
    let first = phase.states.len();
    let controls = first..first + phase.controls.len();
    let all = phase.path.iter().flat_map(|path| path.rows.iter().enumerate().map(move |(k, v)| (path, k, v)));
    all.enumerate().filter_map(move |(index, (path, k, v))| {
        let pattern = path.function.pattern();
        let columns = &pattern.columns[pattern.row_offsets[k]..pattern.row_offsets[k + 1]];
        let has_control = columns.iter().any(|c| controls.contains(c));
        (has_control == with_control).then_some((QuantityKind::Row(index), v))
    })
}
