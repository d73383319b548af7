//! The structure of the derivatives of a formula, by sets of inputs instead of words of bits: any number of inputs.

use std::collections::{BTreeSet, HashSet};
use std::rc::Rc;

use crate::linear::Linearised;
use crate::pattern::NodePattern;

/// Inputs that a variable depends on, in ascending order.
struct Inputs {
    /// Tells sets apart.
    id: usize,
    members: Vec<u32>,
}

/// The pattern of a formula.
pub(crate) fn pattern(formula: &Linearised) -> NodePattern {
    let variables = &formula.variables;
    let mut last_use: Vec<usize> = (0..variables.len()).collect();
    for (i, variable) in variables.iter().enumerate() {
        variable.first.iter().for_each(|&(j, _)| last_use[j as usize] = i);
        variable.second.iter().for_each(|&(j, k, _)| {
            last_use[j as usize] = i;
            last_use[k as usize] = i;
        });
    }
    for variable in formula.outputs.iter().filter_map(|o| o.1) {
        last_use[variable as usize] = usize::MAX;
    }
    let mut sets: Vec<Option<Rc<Inputs>>> = Vec::with_capacity(variables.len());
    let mut ids = 0;
    let mut set = |members: Vec<u32>| {
        ids += 1;
        Rc::new(Inputs { id: ids, members })
    };
    let (mut pairs, mut crossed) = (BTreeSet::new(), HashSet::new());
    for (i, variable) in variables.iter().enumerate() {
        if i < formula.inputs {
            sets.push(Some(set(vec![i as u32])));
            continue;
        }
        for &(j, k, _) in &variable.second {
            if let (Some(a), Some(b)) = (&sets[j as usize], &sets[k as usize])
                && crossed.insert((a.id, b.id))
            {
                for &p in &a.members {
                    pairs.extend(b.members.iter().map(|&q| (p.max(q) as usize, p.min(q) as usize)));
                }
            }
        }
        let mut union: Option<Rc<Inputs>> = None;
        for operand in variable.first.iter().filter_map(|&(j, _)| sets[j as usize].as_ref()) {
            union = Some(match union {
                None => Rc::clone(operand),
                Some(known) => joined(known, operand, &mut set),
            });
        }
        sets.push(Some(union.unwrap_or_else(|| set(Vec::new()))));
        let operands =
            variable.first.iter().map(|f| f.0).chain(variable.second.iter().flat_map(|s| [s.0, s.1]));
        for j in operands {
            if last_use[j as usize] == i {
                sets[j as usize] = None;
            }
        }
    }
    let mut pattern =
        NodePattern { row_offsets: vec![0], columns: Vec::new(), hessian: pairs.into_iter().collect() };
    for &(_, variable) in &formula.outputs {
        if let Some(set) = variable.and_then(|v| sets[v as usize].as_ref()) {
            pattern.columns.extend(set.members.iter().map(|&k| k as usize));
        }
        pattern.row_offsets.push(pattern.columns.len());
    }
    pattern
}

/// The union of two sets, which is one of them where it can be.
fn joined(a: Rc<Inputs>, b: &Rc<Inputs>, set: &mut impl FnMut(Vec<u32>) -> Rc<Inputs>) -> Rc<Inputs> {
    if holds(&a, b) {
        return a;
    }
    if holds(b, &a) {
        return Rc::clone(b);
    }
    let mut members = Vec::with_capacity(a.members.len() + b.members.len());
    let (mut x, mut y) = (a.members.iter().peekable(), b.members.iter().peekable());
    while let (Some(&&p), Some(&&q)) = (x.peek(), y.peek()) {
        members.push(p.min(q));
        if p <= q {
            x.next();
        }
        if q <= p {
            y.next();
        }
    }
    members.extend(x);
    members.extend(y);
    set(members)
}

/// Says whether the members of one set are members of the other.
fn holds(a: &Inputs, b: &Inputs) -> bool {
    a.id == b.id
        || b.members.len() <= a.members.len() && b.members.iter().all(|k| a.members.binary_search(k).is_ok())
}
