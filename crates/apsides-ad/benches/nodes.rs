//! Value, Jacobian and weighted Hessian of three sets of equations of motion, per node, one node after the other (`value`, `jacobian`, `hessian`)
//! and over many nodes in lanes (`values`, `jacobians`, `hessians`): as a model in Rust, as a formula, and as a model in passes of dual and
//! hyper-dual numbers, which is all that a model without a formula has. `cargo bench -p apsides-ad --bench nodes`; the times divided by the number of
//! nodes are those of a node, which criterion prints as elements per second.

#![allow(clippy::print_stdout)]
use apsides_ad::{Dynamics, NodeFunction, Scalar, dynamics_node, formula_node, vector};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use std::sync::Arc;

type Node = Arc<dyn NodeFunction>;

/// Nodes of a mesh.
const NODES: usize = 256;

/// Planar flight above the Moon; radius, angle, horizontal and vertical speed, mass; thrust angle and throttle.
struct Lunar;

impl Dynamics<5, 2> for Lunar {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 5], u: &[S; 2], _p: &[S; 0]) -> [S; 5] {
        let [r, _, horizontal, vertical, m] = *x;
        let (sin, cos) = u[0].sin_cos();
        let thrust = u[1] * 440.0;
        let turn = horizontal / r;
        [
            vertical,
            turn,
            cos * thrust / m - turn * vertical,
            sin * thrust / m + turn * horizontal - r.powi(-2) * 4.9028e12,
            -thrust / 3050.0,
        ]
    }
}

/// Betts' re-entry of the Space Shuttle: altitude (ft), longitude, latitude, speed (ft/s), path angle, azimuth; angle of attack, bank.
struct Shuttle;

impl Dynamics<6, 2> for Shuttle {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 6], u: &[S; 2], _p: &[S; 0]) -> [S; 6] {
        let [h, _, latitude, v, gamma, psi] = *x;
        let attack = u[0] * 1.0_f64.to_degrees();
        let lift_coefficient = attack * 0.029_244 - 0.207_04;
        let drag_coefficient = attack.square() * 6.214_08e-4 - attack * 6.1592e-3 + 0.078_54;
        let density = (h / -23_800.0).exp() * 0.002_378;
        let pressure_area = density * v.square() * (0.5 * 2690.0 / 6309.4);
        let (lift, drag) = (pressure_area * lift_coefficient, pressure_area * drag_coefficient);
        let r = h + 20_902_900.0;
        let gravity = r.powi(-2) * 1.407_653_9e16;
        let (sin_gamma, cos_gamma) = gamma.sin_cos();
        let (sin_psi, cos_psi) = psi.sin_cos();
        let (sin_bank, cos_bank) = u[1].sin_cos();
        [
            v * sin_gamma,
            v * cos_gamma * sin_psi / (r * latitude.cos()),
            v * cos_gamma * cos_psi / r,
            -drag - gravity * sin_gamma,
            lift * cos_bank / v + cos_gamma * (v / r - gravity / v),
            lift * sin_bank / (v * cos_gamma) + v * cos_gamma * sin_psi * latitude.tan() / r,
        ]
    }
}

/// Thrust and oblateness in modified equinoctial elements (semi-latus rectum in m), with the mass and the direction of the thrust.
struct Equinoctial;

impl Dynamics<7, 3> for Equinoctial {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 7], u: &[S; 3], _p: &[S; 0]) -> [S; 7] {
        let [p, f, g, h, k, l, m] = *x;
        let (mu, j2, radius) = (3.986_004_418e14, 1.082_63e-3, 6_378_137.0);
        let (sin, cos) = l.sin_cos();
        let q = f * cos + g * sin + 1.0;
        let root = (p / mu).sqrt();
        let (tilt, along) = (h * sin - k * cos, h * cos + k * sin);
        let s2 = h * h + k * k + 1.0;
        let size = (p / q * s2.sqrt()).powi(-4) * (-6.0 * mu * j2 * radius * radius);
        let thrust = vector::scale(u, m.recip() * 0.5);
        let radial = thrust[0] + (s2.square() * 0.25 - tilt.square() * 3.0) * size;
        let transverse = thrust[1] + tilt * along * size * 2.0;
        let normal = thrust[2] + tilt * (-s2 + 2.0) * size;
        let lever = root * normal / q;
        let turn = tilt * lever;
        let half = s2 * lever * 0.5;
        [
            p * root * transverse / q * 2.0,
            root * (radial * sin + ((q + 1.0) * cos + f) / q * transverse) - g * turn,
            root * (-radial * cos + ((q + 1.0) * sin + g) / q * transverse) + f * turn,
            half * cos,
            half * sin,
            (p * mu).sqrt() * (q / p).square() + turn,
            vector::norm(u, 1e-9) * (-0.5 / 30_000.0),
        ]
    }
}

/// A model without a formula, since its first state goes through a closure: derivatives are passes of dual and hyper-dual numbers.
struct InPasses<M>(M);

impl<const NX: usize, const NU: usize, M: Dynamics<NX, NU>> Dynamics<NX, NU> for InPasses<M> {
    fn rate<S: Scalar>(&self, t: S, x: &[S; NX], u: &[S; NU], p: &[S; 0]) -> [S; NX] {
        let mut x = *x;
        x[0] = x[0].map(|x| [x, 1.0, 0.0]);
        self.0.rate(t, &x, u, p)
    }
}

fn measure(c: &mut Criterion, name: &str, node: &dyn NodeFunction, start: &[f64]) {
    let (n, m, pattern) = (node.inputs(), node.outputs(), node.pattern());
    let (e, h) = (pattern.jacobian_len(), pattern.hessian_len());
    let z: Vec<f64> =
        (0..NODES * n).map(|k| start[k % n] * (1.0 + 1e-3 * (k / n) as f64 / NODES as f64)).collect();
    let weights: Vec<f64> = (0..NODES * m).map(|k| 1.0 + 0.1 * (k % 11) as f64).collect();
    let (mut out, mut entries) = (vec![0.0; NODES * m], vec![0.0; NODES * e]);
    let mut hessian = vec![0.0; NODES * h];
    let mut group = c.benchmark_group(name);
    group.throughput(Throughput::Elements(NODES as u64));
    let nodes = || {
        (0..NODES).map(|p| (p * n..(p + 1) * n, p * m..(p + 1) * m, p * e..(p + 1) * e, p * h..(p + 1) * h))
    };
    group.bench_function("value", |b| {
        b.iter(|| nodes().for_each(|(i, o, _, _)| node.value(black_box(&z[i]), &mut out[o])));
    });
    group.bench_function("values", |b| b.iter(|| node.values(NODES, black_box(&z), &mut out)));
    group.bench_function("jacobian", |b| {
        b.iter(|| {
            nodes().for_each(|(i, o, e, _)| node.jacobian(black_box(&z[i]), &mut out[o], &mut entries[e]))
        });
    });
    group.bench_function("jacobians", |b| {
        b.iter(|| node.jacobians(NODES, black_box(&z), &mut out, &mut entries));
    });
    group.bench_function("hessian", |b| {
        b.iter(|| {
            nodes().for_each(|(i, o, _, h)| node.hessian(black_box(&z[i]), &weights[o], &mut hessian[h]))
        });
    });
    group.bench_function("hessians", |b| {
        b.iter(|| node.hessians(NODES, black_box(&z), &weights, &mut hessian));
    });
    group.finish();
}

fn nodes(c: &mut Criterion) {
    let cases: [(&str, [Node; 2], &[f64]); 3] = [
        (
            "lunar",
            [dynamics_node(Lunar), dynamics_node(InPasses(Lunar))],
            &[1.75e6, 0.1, 1600.0, -20.0, 280.0, 0.3, 0.8, 10.0],
        ),
        (
            "shuttle",
            [dynamics_node(Shuttle), dynamics_node(InPasses(Shuttle))],
            &[2e5, 0.3, 0.2, 2e4, -0.02, 1.2, 0.3, -0.9, 10.0],
        ),
        (
            "equinoctial",
            [dynamics_node(Equinoctial), dynamics_node(InPasses(Equinoctial))],
            &[7e6, 0.02, 0.1, 0.2, -0.3, 1.1, 900.0, 0.5, 0.7, 0.2, 10.0],
        ),
    ];
    for (name, [model, passes], start) in cases {
        measure(c, &format!("{name}, passes"), &*passes, start);
        measure(c, &format!("{name}, model"), &*model, start);
        let formula = model.formula().expect("elementary functions alone");
        println!("{name}: {} operations", formula.operations().len());
        measure(c, &format!("{name}, formula"), &*formula_node(formula.clone()), start);
        c.bench_function(&format!("{name}, building"), |b| {
            b.iter(|| formula_node(black_box(&formula).clone()))
        });
    }
}

criterion_group!(benches, nodes);
criterion_main!(benches);
