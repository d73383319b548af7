//! KKT systems with the structure of a planar landing: Legendre-Gauss-Radau transcription, 3 points an interval.
//!
//! Groups: `analyse`, `factor`, `solve` by number of intervals; `order` compares elimination orders; `width` goes over the
//! number of states, with the two LDL^T kernels of faer beside our factorisation.

use std::hint::black_box;
use std::time::Duration;

use apsides_kkt::{KktSettings, KktSystem, Ordering};
use criterion::{Criterion, criterion_group, criterion_main};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::ldlt::factor::LdltRegularization;
use faer::perm::Perm;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMat, Triplet};
use faer::{Par, Side, Spec};

/// Collocation points of an interval.
const POINTS: usize = 3;

/// Differentiation matrix of the Radau points (-1, (1 -+ sqrt 6)/5) and the end point 1.
const D: [[f64; POINTS + 1]; POINTS] = [
    [-4.0, 5.1393877, -1.6393877, 0.5],
    [-1.3424587, 0.1, 1.6, -0.3575413],
    [0.8424587, -3.2, 1.2, 1.1575413],
];

/// Place of a row in time: interval, node of the interval, kind.
#[derive(Clone, Copy)]
struct Place {
    interval: u32,
    node: u32,
    kind: Kind,
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    State,
    Control,
    Multiplier,
    FinalTime,
}

/// Elimination orders under comparison.
#[derive(Clone, Copy, Debug)]
enum Rule {
    /// Approximate minimum degree.
    Amd,
    /// Variables and then multipliers of each node.
    Node,
    /// Variables and then multipliers of each interval.
    Interval,
    /// States of each interval, then its controls and multipliers.
    StatesFirst,
    /// Controls of each interval before its states.
    ControlsFirst,
    /// Controls, states and then multipliers of each node.
    NodeControlsFirst,
    /// Interior nodes of each interval, then its first node, then its multipliers.
    InteriorFirst,
    /// Controls, states and multipliers of the nodes of each interval but its first, then those of the first nodes.
    InsideFirst,
}

struct Landing {
    n: usize,
    primal: usize,
    rows: Vec<usize>,
    cols: Vec<usize>,
    values: Vec<f64>,
    places: Vec<Place>,
}

impl Landing {
    fn new(intervals: usize, nx: usize, nu: usize) -> Self {
        let (width, nodes) = (nx + nu, POINTS * intervals);
        let final_state = nodes * width;
        let final_time = final_state + nx;
        let primal = final_time + 1;
        let n = primal + nodes * nx + nx;
        let mut seed = 1u64;
        let mut random = move || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as f64 / (1u64 << 31) as f64 * 2.0 - 1.0
        };
        let (mut rows, mut cols, mut values) = (Vec::new(), Vec::new(), Vec::new());
        let mut push = |i: usize, j: usize, v: f64| {
            rows.push(i);
            cols.push(j);
            values.push(v);
        };
        let end = Place { interval: intervals as u32, node: 0, kind: Kind::State };
        let mut places = vec![end; n];
        places[final_time].kind = Kind::FinalTime;
        let step = 0.5 / intervals as f64;
        for node in 0..nodes {
            let (interval, point) = (node / POINTS, node % POINTS);
            for a in 0..width {
                let kind = if a < nx { Kind::State } else { Kind::Control };
                places[node * width + a] = Place { interval: interval as u32, node: point as u32, kind };
                for b in 0..=a {
                    let v = 0.1 * step * random() + if a == b { 2.0 * step } else { 0.0 };
                    push(node * width + a, node * width + b, v);
                }
                push(final_time, node * width + a, 0.1 * step * random());
            }
            for i in 0..nx {
                let dual = primal + node * nx + i;
                places[dual] =
                    Place { interval: interval as u32, node: point as u32, kind: Kind::Multiplier };
                for (m, &d) in D[point].iter().enumerate() {
                    let target = node - point + m;
                    push(dual, if target == nodes { final_state + i } else { target * width + i }, d);
                }
                for a in 0..width {
                    push(dual, node * width + a, step * random());
                }
                push(dual, final_time, step * random());
            }
        }
        for i in 0..nx {
            push(final_state + i, final_state + i, step);
            push(primal + nodes * nx + i, final_state + i, 1.0);
            places[primal + nodes * nx + i].kind = Kind::Multiplier;
        }
        push(final_time, final_time, 1.0);
        Self { n, primal, rows, cols, values, places }
    }

    fn ordering(&self, rule: Rule) -> Ordering {
        let points = POINTS as u32;
        let stage = |p: &Place| {
            let late = u32::from(p.kind == Kind::Multiplier);
            match (rule, p.kind) {
                (_, Kind::FinalTime) => u32::MAX,
                (Rule::Node, _) => 2 * (p.interval * points + p.node) + late,
                (Rule::NodeControlsFirst, kind) => {
                    3 * (p.interval * points + p.node) + u32::from(kind != Kind::Control) + late
                }
                (Rule::StatesFirst, kind) => 2 * p.interval + u32::from(kind != Kind::State),
                (Rule::ControlsFirst, kind) => 3 * p.interval + u32::from(kind != Kind::Control) + late,
                (Rule::InsideFirst, kind) => {
                    let after = if p.node == 0 { self.n as u32 } else { 0 };
                    3 * (after + p.interval) + u32::from(kind != Kind::Control) + late
                }
                (Rule::InteriorFirst, _) => {
                    3 * p.interval + if late == 1 { 2 } else { u32::from(p.node == 0) }
                }
                _ => 2 * p.interval + late,
            }
        };
        match rule {
            Rule::Amd => Ordering::Amd,
            _ => Ordering::Stages(self.places.iter().map(stage).collect()),
        }
    }

    fn analyse(&self, rule: Rule) -> KktSystem {
        let settings = KktSettings { ordering: self.ordering(rule), ..KktSettings::default() };
        KktSystem::analyse(self.n, self.primal, &self.rows, &self.cols, settings).expect("well-posed")
    }

    /// The matrix with a small shift, lower triangle, and the elimination order of a rule.
    fn matrix(&self, rule: Rule) -> (SparseColMat<u32, f64>, Perm<u32>) {
        let shift =
            (0..self.n).map(|i| Triplet::new(i as u32, i as u32, if i < self.primal { 1e-9 } else { -1e-9 }));
        let triplets: Vec<_> = (0..self.rows.len())
            .map(|t| (self.rows[t].max(self.cols[t]), self.rows[t].min(self.cols[t]), self.values[t]))
            .map(|(row, col, value)| Triplet::new(row as u32, col as u32, value))
            .chain(shift)
            .collect();
        let matrix = SparseColMat::try_new_from_triplets(self.n, self.n, &triplets).expect("in range");
        let Ordering::Stages(stages) = self.ordering(rule) else {
            unreachable!("invariant: a rule by stages")
        };
        let mut forward: Vec<u32> = (0..self.n as u32).collect();
        forward.sort_by_key(|&i| stages[i as usize]);
        let mut inverse = vec![0u32; self.n];
        for (k, &i) in forward.iter().enumerate() {
            inverse[i as usize] = k as u32;
        }
        (matrix, Perm::new_checked(forward.into(), inverse.into(), self.n))
    }
}

fn scaling(c: &mut Criterion) {
    for intervals in [20, 100, 1000, 5000] {
        let landing = Landing::new(intervals, 5, 1);
        let id = |name: &str| format!("{name}/{intervals}");
        c.bench_function(&id("analyse"), |b| {
            b.iter(|| landing.analyse(Rule::InsideFirst));
        });
        let mut system = landing.analyse(Rule::InsideFirst);
        c.bench_function(&id("factor"), |b| {
            b.iter(|| system.factor(black_box(&landing.values), 0.0, 0.0).expect("finite"));
        });
        let rhs: Vec<f64> = (0..landing.n).map(|i| (i as f64).sin()).collect();
        let mut x = vec![0.0; landing.n];
        c.bench_function(&id("solve"), |b| {
            b.iter(|| system.solve(black_box(&rhs), &mut x).expect("factored"));
        });
    }
}

fn order(c: &mut Criterion) {
    let landing = Landing::new(1000, 5, 1);
    let rules = [
        Rule::Amd,
        Rule::Node,
        Rule::NodeControlsFirst,
        Rule::Interval,
        Rule::StatesFirst,
        Rule::ControlsFirst,
        Rule::InteriorFirst,
        Rule::InsideFirst,
    ];
    for rule in rules {
        let mut system = landing.analyse(rule);
        c.bench_function(&format!("order/factor/{rule:?}"), |b| {
            b.iter(|| system.factor(black_box(&landing.values), 0.0, 0.0).expect("finite"));
        });
        let rhs: Vec<f64> = (0..landing.n).map(|i| (i as f64).sin()).collect();
        let mut x = vec![0.0; landing.n];
        c.bench_function(&format!("order/solve/{rule:?}"), |b| {
            b.iter(|| system.solve(black_box(&rhs), &mut x).expect("factored"));
        });
    }
}

fn width(c: &mut Criterion) {
    for nx in [2, 4, 6, 8, 10, 12, 16] {
        let landing = Landing::new(300, nx, 3);
        let mut system = landing.analyse(Rule::NodeControlsFirst);
        c.bench_function(&format!("width/{nx}"), |b| {
            b.iter(|| system.factor(black_box(&landing.values), 0.0, 0.0).expect("finite"));
        });
        for (kernel, threshold) in [
            ("simplicial", SupernodalThreshold::FORCE_SIMPLICIAL),
            ("supernodal", SupernodalThreshold::FORCE_SUPERNODAL),
        ] {
            faer_kernel(c, &landing, &format!("width/faer_{kernel}/{nx}"), threshold);
        }
    }
}

/// LDL^T of faer alone, without equilibration and checks.
fn faer_kernel(c: &mut Criterion, landing: &Landing, name: &str, threshold: SupernodalThreshold) {
    let (matrix, order) = landing.matrix(Rule::NodeControlsFirst);
    let params = CholeskySymbolicParams {
        supernodal_flop_ratio_threshold: threshold,
        ..CholeskySymbolicParams::default()
    };
    let ordering = SymmetricOrdering::Custom(order.as_ref());
    let symbolic =
        factorize_symbolic_cholesky(matrix.symbolic(), Side::Lower, ordering, params).expect("enough memory");
    let mut values = vec![0.0; symbolic.len_val()];
    let scratch = symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Spec::default());
    let mut memory = MemBuffer::new(scratch);
    c.bench_function(name, |b| {
        b.iter(|| {
            let stack = MemStack::new(&mut memory);
            let regularization = LdltRegularization::default();
            symbolic
                .factorize_numeric_ldlt(
                    &mut values,
                    black_box(matrix.as_ref()),
                    Side::Lower,
                    regularization,
                    Par::Seq,
                    stack,
                    Spec::default(),
                )
                .map(|_| ())
                .expect("regular")
        });
    });
}

criterion_group! {
    name = kkt_landing;
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(800));
    targets = scaling, order, width
}
criterion_main!(kkt_landing);
