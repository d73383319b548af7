//! Derivatives of a formula as terms of its graph.
//!
//! Jacobians come from tangents (`t_i = sum_j g_j t_j`, one for each input that a value depends on) or from adjoints
//! (`a_j += a_i g_j`, one pass for each output), whichever takes fewer terms. Weighted Hessians come from second-order adjoints (edge pushing:
//! R. Gower and M. Mello 2012, doi 10.1080/10556788.2011.580098): the adjoint of a value `i` is `d(sum w f)/di`, the second adjoint of
//! a pair the second derivative with respect to both, the values before them being held; eliminating `i = g(j, ..)` moves its
//! adjoints to its operands:
//!
//! ```text
//! a_j += a_i g_j;   h_jk += a_i g_jk;   h_pj += h_pi g_j (p < i);   h_jk += h_ii g_j g_k
//! ```
//!
//! Where a formula has so many values that reach each other that these would take too many terms, tangents along one direction, and adjoints
//! of such tangents, are computed once for each direction.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use crate::graph::{Graph, Term};
use crate::linear::{Linearised, Variable};
use crate::pattern::NodePattern;

/// Terms that a derivative may take before directions are to be preferred.
#[derive(Clone, Copy)]
pub(crate) struct Budget(pub(crate) usize);

impl Budget {
    /// Fails once the graph has grown too large.
    fn check(self, graph: &Graph) -> Option<()> {
        (graph.len() <= self.0).then_some(())
    }
}

/// Tangents of a variable by inputs, in ascending order.
type Row = Vec<(u32, Term)>;

/// Jacobian entries in the order of the pattern, by tangents.
pub(crate) fn by_tangents(f: &mut Linearised, pattern: &NodePattern, budget: Budget) -> Option<Vec<Term>> {
    let (graph, zero, one) = ends(&mut f.graph);
    let mut last_use = vec![0; f.variables.len()];
    for (i, variable) in f.variables.iter().enumerate() {
        variable.first.iter().for_each(|&(j, _)| last_use[j as usize] = i);
    }
    for variable in f.outputs.iter().filter_map(|o| o.1) {
        last_use[variable as usize] = usize::MAX;
    }
    let mut rows: Vec<Row> = Vec::with_capacity(f.variables.len());
    let mut work = 0;
    for (i, variable) in f.variables.iter().enumerate() {
        if i < f.inputs {
            rows.push(vec![(i as u32, one)]);
            continue;
        }
        let mut row: Row = Vec::new();
        for (place, &(j, g)) in variable.first.iter().enumerate() {
            let again = variable.first[place + 1..].iter().any(|f| f.0 == j);
            let operand = if last_use[j as usize] == i && !again {
                std::mem::take(&mut rows[j as usize])
            } else {
                rows[j as usize].clone()
            };
            let scaled = operand.into_iter().map(|(k, t)| (k, product(graph, variable, g, t)));
            let scaled: Row = scaled.collect();
            row = if row.is_empty() { scaled } else { sum(graph, row, scaled) };
        }
        work += row.len();
        budget.check(graph)?;
        (work <= budget.0).then_some(())?;
        rows.push(row);
    }
    let mut entries = Vec::with_capacity(pattern.jacobian_len());
    for (r, &(_, variable)) in f.outputs.iter().enumerate() {
        let row: &[(u32, Term)] = variable.map_or(&[], |v| &rows[v as usize]);
        for &c in &pattern.columns[pattern.row_offsets[r]..pattern.row_offsets[r + 1]] {
            let found = row.binary_search_by_key(&c, |e| e.0 as usize);
            entries.push(found.map_or(zero, |k| row[k].1));
        }
    }
    Some(entries)
}

/// Partial derivative times tangent; what is not chosen may be anything.
fn product(graph: &mut Graph, variable: &Variable, g: Term, tangent: Term) -> Term {
    if variable.chooses { graph.guarded(g, tangent) } else { graph.mul(tangent, g) }
}

/// Sum of rows.
fn sum(graph: &mut Graph, a: Row, b: Row) -> Row {
    let mut row = Row::with_capacity(a.len() + b.len());
    let (mut a, mut b) = (a.into_iter().peekable(), b.into_iter().peekable());
    loop {
        match (a.peek().copied(), b.peek().copied()) {
            (Some((i, s)), Some((j, t))) if i == j => {
                row.push((i, graph.add(s, t)));
                a.next();
                b.next();
            }
            (Some(x), y) if y.is_none_or(|y| x.0 < y.0) => {
                row.push(x);
                a.next();
            }
            (_, Some(y)) => {
                row.push(y);
                b.next();
            }
            _ => return row,
        }
    }
}

/// Jacobian entries in the order of the pattern, by adjoints.
pub(crate) fn by_adjoints(f: &mut Linearised, pattern: &NodePattern, budget: Budget) -> Option<Vec<Term>> {
    let (graph, zero, one) = ends(&mut f.graph);
    let mut entries = Vec::with_capacity(pattern.jacobian_len());
    for (r, &(_, variable)) in f.outputs.iter().enumerate() {
        let mut adjoints: BTreeMap<u32, Term> = variable.map(|v| (v, one)).into_iter().collect();
        while let Some(last) = adjoints.last_entry()
            && *last.key() as usize >= f.inputs
        {
            let (i, adjoint) = last.remove_entry();
            let variable = &f.variables[i as usize];
            for &(j, g) in &variable.first {
                let part = pull(graph, variable, adjoint, g);
                accumulate(graph, &mut adjoints, j, part);
            }
            budget.check(graph)?;
        }
        for &c in &pattern.columns[pattern.row_offsets[r]..pattern.row_offsets[r + 1]] {
            entries.push(adjoints.get(&(c as u32)).copied().unwrap_or(zero));
        }
    }
    Some(entries)
}

/// Adjoint times partial derivative; where a choice has left the value out, the derivative may be anything.
fn pull(graph: &mut Graph, variable: &Variable, adjoint: Term, g: Term) -> Term {
    if variable.optional { graph.guarded(adjoint, g) } else { graph.mul(adjoint, g) }
}

fn accumulate<K: Ord>(graph: &mut Graph, adjoints: &mut BTreeMap<K, Term>, key: K, part: Term) {
    match adjoints.entry(key) {
        Entry::Vacant(place) => {
            place.insert(part);
        }
        Entry::Occupied(mut sum) => {
            let added = graph.add(*sum.get(), part);
            sum.insert(added);
        }
    }
}

fn ends(graph: &mut Graph) -> (&mut Graph, Term, Term) {
    let (zero, one) = (graph.constant(0.0), graph.constant(1.0));
    (graph, zero, one)
}

/// Adjoints of the outputs: their weights, which are the inputs after those of the formula.
fn seeds(f: &mut Linearised) -> BTreeMap<u32, Term> {
    let mut adjoints = BTreeMap::new();
    for (output, &(_, variable)) in f.outputs.iter().enumerate() {
        if let Some(v) = variable {
            let weight = f.graph.input(f.inputs + output);
            accumulate(&mut f.graph, &mut adjoints, v, weight);
        }
    }
    adjoints
}

/// Entries of the weighted Hessian in the order of the pattern; weights are the inputs after those of the formula.
pub(crate) fn by_edges(f: &mut Linearised, pattern: &NodePattern, budget: Budget) -> Option<Vec<Term>> {
    let mut first = seeds(f);
    // By the pair of variables, the later one first.
    let mut second: BTreeMap<(u32, u32), Term> = BTreeMap::new();
    let (graph, zero, _) = ends(&mut f.graph);
    for i in (f.inputs..f.variables.len()).rev() {
        let i = i as u32;
        let variable = &f.variables[i as usize];
        if let Some(adjoint) = first.remove(&i) {
            for &(j, g) in &variable.first {
                let part = pull(graph, variable, adjoint, g);
                accumulate(graph, &mut first, j, part);
            }
            for &(j, k, g) in &variable.second {
                let part = pull(graph, variable, adjoint, g);
                accumulate(graph, &mut second, (j, k), part);
            }
        }
        // What is left has no later member.
        let mut pairs = second.split_off(&(i, 0));
        let own = pairs.remove(&(i, i));
        for ((_, p), edge) in pairs {
            for &(j, g) in &variable.first {
                let part = pull(graph, variable, edge, g);
                // A diagonal entry is reached from both sides.
                for _ in 0..times(p, j) {
                    accumulate(graph, &mut second, (p.max(j), p.min(j)), part);
                }
            }
        }
        for (place, &(j, g)) in own.iter().flat_map(|_| variable.first.iter().enumerate()) {
            let half = pull(graph, variable, own.unwrap_or(zero), g);
            let part = pull(graph, variable, half, g);
            accumulate(graph, &mut second, (j, j), part);
            for &(k, g) in &variable.first[place + 1..] {
                let part = pull(graph, variable, half, g);
                for _ in 0..times(j, k) {
                    accumulate(graph, &mut second, (j.max(k), j.min(k)), part);
                }
            }
        }
        budget.check(graph)?;
    }
    let entry = |&(i, j): &(usize, usize)| second.get(&(i as u32, j as u32)).copied().unwrap_or(zero);
    Some(pattern.hessian.iter().map(entry).collect())
}

/// The number of times that the edge of a pair counts.
fn times(i: u32, j: u32) -> usize {
    if i == j { 2 } else { 1 }
}

/// The derivative of each output along a direction, the components of which are the inputs after those of the formula and the
/// weights.
pub(crate) fn along_direction(f: &mut Linearised) -> Vec<Term> {
    let tangents = tangents(f);
    let zero = f.graph.constant(0.0);
    f.outputs.iter().map(|o| o.1.map_or(zero, |v| tangents[v as usize])).collect()
}

fn tangents(f: &mut Linearised) -> Vec<Term> {
    let (graph, zero, _) = ends(&mut f.graph);
    let mut tangents: Vec<Term> = Vec::with_capacity(f.variables.len());
    for (i, variable) in f.variables.iter().enumerate() {
        let mut tangent = zero;
        if i < f.inputs {
            tangent = graph.input(f.inputs + f.outputs.len() + i);
        }
        for &(j, g) in &variable.first {
            let part = product(graph, variable, g, tangents[j as usize]);
            tangent = graph.add(tangent, part);
        }
        tangents.push(tangent);
    }
    tangents
}

/// The derivative along a direction of the gradient of the weighted sum of the outputs.
pub(crate) fn gradient_along_direction(f: &mut Linearised) -> Vec<Term> {
    let tangents = tangents(f);
    let seeds = seeds(f);
    let (graph, zero, _) = ends(&mut f.graph);
    let mut adjoints = vec![zero; f.variables.len()];
    let mut turned = adjoints.clone();
    for (v, weight) in seeds {
        adjoints[v as usize] = weight;
    }
    for i in (f.inputs..f.variables.len()).rev() {
        let variable = &f.variables[i];
        let (adjoint, turn) = (adjoints[i], turned[i]);
        for &(j, g) in &variable.first {
            for (sums, source) in [(&mut adjoints, adjoint), (&mut turned, turn)] {
                let part = pull(graph, variable, source, g);
                sums[j as usize] = graph.add(sums[j as usize], part);
            }
        }
        for &(j, k, g) in &variable.second {
            let bend = pull(graph, variable, adjoint, g);
            for (to, from) in [(j, k), (k, j)].into_iter().take(if j == k { 1 } else { 2 }) {
                let part = graph.guarded(bend, tangents[from as usize]);
                turned[to as usize] = graph.add(turned[to as usize], part);
            }
        }
    }
    turned.truncate(f.inputs);
    turned
}
