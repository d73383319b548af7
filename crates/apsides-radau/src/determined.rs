//! Controls that follow from others along an arc, by the path constraints that are held there.
//!
//! Along a coast a magnitude and the thrust below it are both nothing, and so is the distance between them: of three statements one follows from
//! the two others. Held all the same it has no multiplier of its own, and those of the others say nothing. A control that follows is left to
//! the constraint: its bounds, and the condition on its degree along a singular arc, are none of the program.

use apsides_ocp::{Bounds, Phase};

use crate::activity::Class;
use crate::quantity::{Quantity, QuantityKind, equalities};

/// A control that a held path constraint determines.
pub(crate) struct Determined {
    pub(crate) control: usize,
    /// True if all other controls of the constraint are held, or follow from what is held: nothing is left for bounds to keep.
    pub(crate) by_what_is_held: bool,
}

/// The controls that follow along an arc with these classes, one for each row of linear controls alone that is held there all along. One that
/// can swing between two bounds says more of where the arcs end than another one. Of others the one that is pushed least
/// against its bound follows: its multiplier comes down to zero first where that of the row changes, and those of all others keep their signs.
pub(crate) fn determined(
    phase: &Phase,
    quantities: &[Quantity<'_>],
    class: &[Class],
    whole: &[bool],
    push: impl Fn(usize) -> f64,
) -> Vec<Determined> {
    let place = |c: usize| quantities.iter().position(|q| q.kind == QuantityKind::Control(c));
    let is_between = |c: &usize| place(*c).is_some_and(|k| class[k] == Class::Between);
    let can_swing = |c: &usize| {
        let Bounds { lower, upper } = phase.controls[*c].bounds;
        lower.is_finite() && upper.is_finite()
    };
    let held = (0..quantities.len()).filter(|k| class[*k] != Class::Between && whole[*k]);
    let kinds = held.map(|k| quantities[k].kind).chain(equalities(phase));
    let held_rows = kinds.filter(|kind| matches!(kind, QuantityKind::Row(_)));
    let rows = held_rows.filter_map(|row| Some((linear_controls(phase, quantities, row)?, row)));
    let mut rows: Vec<(Vec<usize>, QuantityKind)> = rows.collect();
    // A row with fewer controls has less to choose from.
    rows.sort_by_key(|(controls, _)| controls.len());
    let mut chosen: Vec<(usize, &[usize])> = Vec::new();
    // Where a state enters a row, too, one that is at its bound does not follow: it is the state that is kept.
    let mut moved: Vec<usize> = Vec::new();
    for (row, kind) in &rows {
        let open = row.iter().filter(|c| chosen.iter().all(|(other, _)| other != *c));
        let push = |c: &usize| place(*c).map_or(0.0, &push);
        let rank = |c: &usize| (!is_between(c), can_swing(c));
        let control = open.min_by(|a, b| rank(a).cmp(&rank(b)).then(push(a).total_cmp(&push(b))));
        chosen.extend(control.map(|c| (*c, row.as_slice())));
        moved.extend(control.filter(|c| !is_between(c) && !kind.is_of_controls_alone(phase)));
    }
    // A control follows from what is held where all others of its row are held, or follow themselves.
    let mut settled: Vec<usize> = Vec::new();
    loop {
        let is_settled =
            |c: &usize| settled.contains(c) || !is_between(c) && chosen.iter().all(|(f, _)| f != c);
        let follows = |(control, row): &&(usize, &[usize])| {
            !settled.contains(control)
                && !moved.contains(control)
                && row.iter().all(|c| c == control || is_settled(c))
        };
        let Some((control, _)) = chosen.iter().find(follows) else { break };
        settled.push(*control);
    }
    let determined = chosen
        .iter()
        .map(|(control, _)| Determined { control: *control, by_what_is_held: settled.contains(control) });
    determined.collect()
}

/// Says whether two quantities are linear controls that a path constraint of such controls alone binds to each other.
pub(crate) fn are_bound(phase: &Phase, quantities: &[Quantity<'_>], one: usize, other: usize) -> bool {
    let [a, b] = [one, other].map(|k| match quantities[k].kind {
        QuantityKind::Control(c) => Some(c),
        _ => None,
    });
    let binds = |row: Vec<usize>| [a, b].iter().all(|c| c.is_some_and(|c| row.contains(&c)));
    let rows = (0..phase.path_rows()).map(QuantityKind::Row);
    one != other && rows.filter_map(|row| linear_controls(phase, quantities, row)).any(binds)
}

/// The controls of a row; none if it has none, or one that the Hamiltonian is not linear in.
fn linear_controls(phase: &Phase, quantities: &[Quantity<'_>], row: QuantityKind) -> Option<Vec<usize>> {
    let controls: Vec<usize> = (0..phase.controls.len()).filter(|c| row.is_moved_by(phase, *c)).collect();
    let is_linear = |c: &usize| quantities.iter().any(|q| q.affine && q.kind == QuantityKind::Control(*c));
    (!controls.is_empty() && controls.iter().all(is_linear)).then_some(controls)
}
