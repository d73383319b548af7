//! From terms to instructions: numbers and products that one instruction alone needs become part of it, results that are found
//! together are computed at once, and slots are used again.

use std::collections::{HashMap, VecDeque};

use super::{Graph, Term, Vertex};
use crate::formula::Unary;
use crate::program::{Instruction, Op, Program};

/// No term.
const NONE: Term = Term::MAX;

/// An instruction on terms instead of slots.
struct Draft {
    op: Op,
    operands: [Term; 3],
    number: f64,
    results: [Term; 6],
}

struct Lowering<'a> {
    graph: &'a Graph,
    /// Times that each term is used, outputs included; nothing is computed that is not used.
    uses: Vec<u32>,
    drafts: Vec<Draft>,
}

/// Operation and operands of terms that are computed together.
type Family = (u8, [Term; 3]);

/// The program that computes some terms.
pub(super) fn program(graph: &Graph, outputs: &[Term]) -> Program {
    let mut lowering = Lowering { graph, uses: vec![0; graph.len()], drafts: Vec::new() };
    lowering.count(outputs);
    let families = lowering.families();
    let mut inputs = Vec::new();
    // From the last to the first: the users of a term come before it.
    for term in (0..graph.len()).rev().filter_map(|k| Term::try_from(k).ok()) {
        let node = graph.nodes[term as usize];
        if lowering.uses[term as usize] == 0 {
            continue;
        }
        match families.get(&family(&node)).filter(|_| is_shared(node.op)) {
            _ if node.op == Op::Input => inputs.push((node.operands[0], term)),
            Some(parts) if parts.iter().min() == Some(&term) => lowering.share(node, *parts),
            Some(_) => {}
            None => lowering.select(term, node),
        }
    }
    lowering.drafts.reverse();
    let mut drafts = Vec::with_capacity(lowering.drafts.len());
    let mut producer = vec![NONE; graph.len()];
    while !lowering.drafts.is_empty() {
        let window = lowering.drafts.drain(..WINDOW.min(lowering.drafts.len())).collect();
        schedule(window, &mut producer, &mut drafts);
    }
    allocate(graph, &drafts, &inputs, outputs)
}

/// Instructions that are sorted among each other; more would keep more numbers alive at a time.
const WINDOW: usize = 2048;

/// Sorts instructions by operation as far as their operands allow, since changing the operation costs more than an operation.
fn schedule(window: Vec<Draft>, producer: &mut [Term], sorted: &mut Vec<Draft>) {
    for (k, draft) in (0..).zip(&window) {
        for &result in draft.results.iter().filter(|r| **r != NONE) {
            producer[result as usize] = k;
        }
    }
    let mut waiting = vec![0; window.len()];
    let mut users: Vec<Vec<usize>> = vec![Vec::new(); window.len()];
    for (k, draft) in window.iter().enumerate() {
        for &operand in &draft.operands[..draft.op.arity()] {
            if let Some(users) = users.get_mut(producer[operand as usize] as usize) {
                users.push(k);
                waiting[k] += 1;
            }
        }
    }
    for &result in window.iter().flat_map(|d| &d.results).filter(|r| **r != NONE) {
        producer[result as usize] = NONE;
    }
    let mut ready: Vec<(Op, VecDeque<usize>)> = Vec::new();
    let enqueue = |ready: &mut Vec<(Op, VecDeque<usize>)>, k: usize| {
        let op = window[k].op;
        match ready.iter_mut().find(|r| r.0 == op) {
            Some((_, queue)) => queue.push_back(k),
            None => ready.push((op, VecDeque::from([k]))),
        }
    };
    (0..window.len()).filter(|&k| waiting[k] == 0).for_each(|k| enqueue(&mut ready, k));
    let mut order = Vec::with_capacity(window.len());
    while let Some(next) = (0..ready.len()).rev().max_by_key(|&r| ready[r].1.len())
        && !ready[next].1.is_empty()
    {
        // What becomes ready on the way joins the queue.
        while let Some(k) = ready[next].1.pop_front() {
            order.push(k);
            for &user in &users[k] {
                waiting[user] -= 1;
                if waiting[user] == 0 {
                    enqueue(&mut ready, user);
                }
            }
        }
    }
    let mut window: Vec<Option<Draft>> = window.into_iter().map(Some).collect();
    sorted.extend(order.into_iter().filter_map(|k| window[k].take()));
}

impl Lowering<'_> {
    fn count(&mut self, outputs: &[Term]) {
        for &term in outputs {
            self.uses[term as usize] += 1;
        }
        for (term, node) in self.graph.nodes.iter().enumerate().rev() {
            if self.uses[term] > 0 {
                for &operand in &node.operands[..node.op.arity()] {
                    self.uses[operand as usize] += 1;
                }
            }
        }
    }

    /// Terms of each family with several.
    fn families(&self) -> HashMap<Family, [Term; 6]> {
        let mut families: HashMap<Family, [Term; 6]> = HashMap::new();
        for (term, node) in (0..).zip(&self.graph.nodes) {
            if self.uses[term as usize] > 0 && is_shared(node.op) {
                let part = match node.op {
                    Op::Curve(k) | Op::Surface(k) => usize::from(k),
                    op => usize::from(op == Op::Unary(Unary::Cos)),
                };
                families.entry(family(node)).or_insert([NONE; 6])[part] = term;
            }
        }
        families.retain(|_, parts| parts.iter().filter(|p| **p != NONE).count() > 1);
        families
    }

    fn share(&mut self, node: Vertex, results: [Term; 6]) {
        let op = match node.op {
            Op::Curve(_) => Op::CurveJet,
            Op::Surface(_) => Op::SurfaceJet,
            _ => Op::SinCos,
        };
        self.drafts.push(Draft { op, operands: node.operands, number: 0.0, results });
    }

    fn emit(&mut self, term: Term, op: Op, operands: [Term; 3], number: f64) {
        let results = [term, NONE, NONE, NONE, NONE, NONE];
        self.drafts.push(Draft { op, operands, number, results });
    }

    /// Chooses the instruction of a term.
    fn select(&mut self, term: Term, node: Vertex) {
        let [a, b, _] = node.operands;
        let numbers = match node.op.arity() {
            2 => [a, b].map(|k| self.graph.number(k)),
            _ => [None; 2],
        };
        // The operand that stays and the number.
        let (rest, number, number_first) = match numbers {
            [Some(n), None] => (b, n, true),
            [None, Some(n)] => (a, n, false),
            _ => return self.select_product(term, node),
        };
        let (op, number) = match (node.op, number_first) {
            (Op::Add, _) => (Op::AddNumber, number),
            (Op::Sub, false) => (Op::AddNumber, -number),
            (Op::Sub, true) => (Op::NumberSub, number),
            (Op::Mul, _) => (Op::MulNumber, number),
            (Op::Div, false) => (Op::DivNumber, number),
            (Op::Div, true) => (Op::NumberDiv, number),
            _ => return self.select_product(term, node),
        };
        self.uses[if number_first { a } else { b } as usize] -= 1;
        self.emit(term, op, [rest, rest, rest], number);
    }

    /// A sum with a product that is used here alone computes it, rounded like apart.
    fn select_product(&mut self, term: Term, node: Vertex) {
        let [a, b, _] = node.operands;
        let alone = |k: Term| {
            (self.graph.nodes[k as usize].op == Op::Mul && self.uses[k as usize] == 1 && a != b).then_some(k)
        };
        let (product, other) = match (node.op, alone(b), alone(a)) {
            (Op::Add | Op::Sub, Some(product), _) => (product, a),
            (Op::Add, None, Some(product)) => (product, b),
            _ => return self.emit(term, node.op, node.operands, f64::from_bits(node.number)),
        };
        let [x, y, _] = self.graph.nodes[product as usize].operands;
        let minus = node.op == Op::Sub;
        self.uses[product as usize] = 0;
        for (number, factor) in [(x, y), (y, x)] {
            if let Some(n) = self.graph.number(number) {
                self.uses[number as usize] -= 1;
                return self.emit(
                    term,
                    Op::MulNumberAdd,
                    [factor, factor, other],
                    if minus { -n } else { n },
                );
            }
        }
        self.emit(term, if minus { Op::MulSub } else { Op::MulAdd }, [x, y, other], 0.0);
    }
}

fn is_shared(op: Op) -> bool {
    matches!(op, Op::Unary(Unary::Sin | Unary::Cos) | Op::Curve(_) | Op::Surface(_))
}

fn family(node: &Vertex) -> Family {
    let kind = match node.op {
        Op::Curve(_) => 0,
        Op::Surface(_) => 1,
        _ => 2,
    };
    (kind, node.operands)
}

/// Gives each term a slot while it is needed.
fn allocate(graph: &Graph, drafts: &[Draft], inputs: &[(u32, Term)], outputs: &[Term]) -> Program {
    const ALWAYS: u32 = u32::MAX;
    let mut last_use = vec![0_u32; graph.len()];
    for (k, draft) in (0..).zip(drafts) {
        for &operand in &draft.operands[..draft.op.arity()] {
            last_use[operand as usize] = k;
        }
    }
    for &term in outputs {
        last_use[term as usize] = ALWAYS;
    }
    let mut slots = Slots::default();
    let mut slot_of = vec![0_u32; graph.len()];
    let mut program = Program { tables: graph.tables.clone(), ..Program::default() };
    for &(input, term) in inputs {
        slot_of[term as usize] = slots.take();
        program.inputs.push((input, slot_of[term as usize]));
    }
    for (k, draft) in (0..).zip(drafts) {
        let terms = &draft.operands[..draft.op.arity()];
        // What is no value stays: the index of a table; what is no operand leads to a slot that exists.
        let mut operands = [0; 3];
        if is_shared(draft.op) || matches!(draft.op, Op::CurveJet | Op::SurfaceJet) {
            operands = draft.operands;
        }
        for (operand, &term) in operands.iter_mut().zip(terms) {
            *operand = slot_of[term as usize];
        }
        for (i, &term) in terms.iter().enumerate() {
            if last_use[term as usize] == k && !terms[..i].contains(&term) {
                slots.free.push(slot_of[term as usize]);
            }
        }
        let target = if matches!(draft.op, Op::SinCos | Op::CurveJet | Op::SurfaceJet) {
            // Results must not share slots with each other.
            let places = draft.results.map(|_| slots.take());
            for (&term, &place) in draft.results.iter().zip(&places) {
                if term == NONE {
                    slots.free.push(place);
                } else {
                    slot_of[term as usize] = place;
                }
            }
            program.wide.push(places);
            (program.wide.len() - 1) as u32
        } else {
            let place = slots.take();
            slot_of[draft.results[0] as usize] = place;
            place
        };
        match program.runs.last_mut() {
            Some((op, count)) if *op == draft.op => *count += 1,
            _ => program.runs.push((draft.op, 1)),
        }
        program.instructions.push(Instruction { target, operands, number: draft.number });
    }
    program.outputs = outputs.iter().map(|&term| slot_of[term as usize]).collect();
    program.slots = slots.count.max(1) as usize;
    program
}

#[derive(Default)]
struct Slots {
    count: u32,
    free: Vec<u32>,
}

impl Slots {
    fn take(&mut self) -> u32 {
        self.free.pop().unwrap_or_else(|| {
            self.count += 1;
            self.count - 1
        })
    }
}
