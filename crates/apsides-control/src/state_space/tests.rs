//! Closed forms of linear systems.

use nalgebra::Complex;

use super::*;
use crate::margins::LoopAnalysis;
use crate::pid::{Pid, PidGains};
use crate::response::Response;

/// A few operations on doubles.
const ROUNDING: f64 = 1e-12;

trait Responds {
    fn response(&self, input: usize, output: usize, frequency: f64) -> Complex<f64>;
}

impl Responds for StateSpace {
    fn response(&self, input: usize, output: usize, frequency: f64) -> Complex<f64> {
        Response::new(self, input, output).at(frequency)
    }
}

fn near(found: Complex<f64>, expected: Complex<f64>) {
    assert!((found - expected).norm() < ROUNDING * (1.0 + expected.norm()), "{found} {expected}");
}

#[test]
fn response_of_a_transfer_function() {
    // (s + 2) / (s^2 + 3 s + 5) and one with a direct part, (2 s + 1) / (s + 4).
    let s = Complex::new(0.0, 1.7);
    let g = StateSpace::of_transfer(&[1.0, 2.0], &[1.0, 3.0, 5.0], None).unwrap();
    near(g.response(0, 0, 1.7), (s + 2.0) / (s * s + s * 3.0 + 5.0));
    let h = StateSpace::of_transfer(&[2.0, 1.0], &[1.0, 4.0], None).unwrap();
    near(h.response(0, 0, 1.7), (s * 2.0 + 1.0) / (s + 4.0));
    let both = g.series(&h).unwrap();
    assert_eq!(both.size(), [3, 1, 1]);
    near(both.response(0, 0, 1.7), g.response(0, 0, 1.7) * h.response(0, 0, 1.7));
    let l = both.response(0, 0, 1.7);
    near(both.closed(1.0).unwrap().response(0, 0, 1.7), l / (l + 1.0));
}

#[test]
fn delays_of_any_length_are_exact() {
    // Integrator under a held input: G(z) = T / (z - 1) without delay; with tau = (d + f) T it is
    // z^-d (T (1 - f) + T f z^-1) / (z - 1).
    let integrator = StateSpace::of_transfer(&[1.0], &[1.0, 0.0], None).unwrap();
    let t = 0.1;
    for (whole, part) in [(0, 0.0), (0, 0.3), (1, 0.0), (2, 0.75), (3, 0.0)] {
        let delay = t * (f64::from(whole) + part);
        let found = integrator.sampled(t, delay).unwrap();
        let z = Complex::new(0.0, 2.0 * t).exp();
        let expected = z.powi(-whole) * (z.inv() * (t * part) + t * (1.0 - part)) / (z - 1.0);
        near(found.response(0, 0, 2.0), expected);
    }
}

#[test]
fn pid_law_as_a_system() {
    let settings = PidSettings { filter_time: 0.05, ..PidSettings::new(PidGains::new(3.0, 2.0, 0.7), 0.02) };
    let system = StateSpace::of_pid(&settings).unwrap();
    let mut law = Pid::new(settings).unwrap();
    let mut x = DMatrix::zeros(3, 1);
    // The first difference of the law is zero, that of the system is from rest: start both at error 0.
    law.update(0.0);
    for k in 1..200 {
        let e = (0.3 * f64::from(k)).sin();
        let u = (&system.c * &x)[(0, 0)] + system.d[(0, 0)] * e;
        x = &system.a * &x + &system.b * e;
        assert!((u - law.update(e)).abs() < ROUNDING);
    }
}

#[test]
fn one_loop_with_the_others_closed() {
    // 1 + L_i = det(I + L) / det(I + L without channel i).
    let plant = Plant { a: [[-1.0, 0.5], [0.3, -2.0]], b: [[1.0, 0.2], [0.1, 1.5]] };
    let plant = StateSpace::of_plant(&plant, &[[1.0, 0.0], [0.4, 1.0]]).unwrap();
    let law = StateSpace::of_gain(&[[2.0, 0.3], [-0.5, 4.0]], None).unwrap();
    // Broken at the control: the plant, then the law.
    let open = plant.series(&law).unwrap();
    let l = |i, j| open.response(j, i, 0.9);
    let one = Complex::new(1.0, 0.0);
    let det = (one + l(0, 0)) * (one + l(1, 1)) - l(0, 1) * l(1, 0);
    near(open.loop_at(0).unwrap().response(0, 0, 0.9), det / (one + l(1, 1)) - one);
    near(open.loop_at(1).unwrap().response(0, 0, 0.9), det / (one + l(0, 0)) - one);
    assert!(open.loop_at(2).is_err());
    // Channels that do not know of each other.
    let g = StateSpace::of_transfer(&[1.0], &[1.0, 1.0], None).unwrap();
    let pair = g.beside(&g).unwrap();
    assert_eq!(pair.loop_at(1).unwrap().response(0, 0, 0.9), g.response(0, 0, 0.9));
}

#[test]
fn root_locus_of_a_textbook_loop() {
    // K / (s (s + 1) (s + 2)): stable for K < 6, on the axis at +-i sqrt 2 for K = 6; two poles meet at K = 2 sqrt 3 / 9.
    let open = StateSpace::of_transfer(&[1.0], &[1.0, 3.0, 2.0, 0.0], None).unwrap();
    let meet = 2.0 * 3.0_f64.sqrt() / 9.0;
    let locus = open.root_locus(&[0.0, 0.5 * meet, 0.9 * meet, 1.1 * meet, 6.0]).unwrap();
    let real = |p: &LocusPoint| p.poles.iter().all(|e| e.im == 0.0);
    assert!(locus[..3].iter().all(real) && !real(&locus[3]));
    let last = &locus[4].poles;
    assert!(last.iter().any(|e| e.re.abs() < ROUNDING && (e.im - 2.0_f64.sqrt()).abs() < ROUNDING));
    // The pole that starts at -2 goes left to -3.
    let start = locus[0].poles.iter().position(|e| (e.re + 2.0).abs() < ROUNDING).unwrap();
    assert!((last[start].re + 3.0).abs() < ROUNDING);
    assert!(
        open.closed(5.99).unwrap().is_stable().unwrap() && !open.closed(6.01).unwrap().is_stable().unwrap()
    );
}

#[test]
fn root_locus_of_a_double_integrator() {
    // PD law k (kp x + kd v) on x'' = u: s^2 + k kd s + k kp.
    let (kp, kd, t) = (4.0, 3.0, 0.1);
    let plant = Plant { a: [[0.0, 1.0], [0.0, 0.0]], b: [[0.0], [1.0]] };
    let plant = StateSpace::of_plant(&plant, &[[1.0, 0.0], [0.0, 1.0]]).unwrap();
    let gains: Vec<f64> = (0..=80).map(|n| 10_f64.powf(f64::from(n - 40) / 40.0)).collect();
    let open = plant.series(&StateSpace::of_gain(&[[kp, kd]], None).unwrap()).unwrap();
    for point in open.root_locus(&gains).unwrap() {
        let (sum, product) = (-point.gain * kd, point.gain * kp);
        let root = Complex::from(0.25 * sum * sum - product).sqrt();
        same_poles(&point.poles, [root + 0.5 * sum, -root + 0.5 * sum]);
    }
    // Sampled: z^2 - (2 - k kp T^2 / 2 - k kd T) z + 1 + k kp T^2 / 2 - k kd T, and s = ln z / T.
    let law = StateSpace::of_gain(&[[kp, kd]], Some(t)).unwrap();
    let open = plant.sampled(t, 0.0).unwrap().series(&law).unwrap();
    for point in open.continuous_root_locus(&gains).unwrap() {
        let (p, d) = (0.5 * point.gain * kp * t * t, point.gain * kd * t);
        let (half, product) = (1.0 - 0.5 * (p + d), 1.0 + p - d);
        let root = Complex::from(half * half - product).sqrt();
        same_poles(
            &point.poles,
            [root + half, -root + half].map(|z| Complex::new(z.re, z.im + 0.0).ln() / t),
        );
    }
}

/// Up to the order. Where two poles meet they are found to the root of the round-off.
fn same_poles(found: &[Eigenvalue], expected: [Complex<f64>; 2]) {
    let found: Vec<_> = found.iter().map(|p| Complex::new(p.re, p.im)).collect();
    let apart = (expected[0] - expected[1]).norm();
    let off =
        |order: [usize; 2]| (found[0] - expected[order[0]]).norm() + (found[1] - expected[order[1]]).norm();
    let size = 1.0 + expected[0].norm().max(expected[1].norm());
    let allowed = ROUNDING * size * size / apart.max(ROUNDING.sqrt());
    assert!(off([0, 1]).min(off([1, 0])) < 10.0 * allowed, "{found:?} {expected:?}");
}

#[test]
fn branches_pass_one_another() {
    // A loop that has nothing to do with a pole at -3, and a pole that goes from -1 through it: -1 - k.
    let gain = StateSpace::of_transfer(&[1.0], &[1.0, 1.0], None).unwrap();
    let apart = StateSpace::of_plant(&Plant { a: [[-3.0]], b: [[0.0]] }, &[[1.0]]).unwrap();
    let mut both = gain.beside(&apart).unwrap();
    (both.b, both.c, both.d) = (both.b.columns(0, 1).into(), both.c.rows(0, 1).into(), DMatrix::zeros(1, 1));
    let gains: Vec<f64> = (0..=40).map(|n| 0.1 * f64::from(n)).collect();
    let locus = both.root_locus(&gains).unwrap();
    let still = locus[0].poles.iter().position(|p| p.re == -3.0).unwrap();
    for point in &locus {
        assert!((point.poles[still].re + 3.0).abs() < ROUNDING, "{point:?}");
        assert!((point.poles[1 - still].re + 1.0 + point.gain).abs() < ROUNDING, "{point:?}");
    }
}

#[test]
fn a_branch_crosses_the_axis_at_the_gain_margin() {
    // 1 / (s (s + 1) (s + 2)), continuous and sampled with a delay.
    let continuous = StateSpace::of_transfer(&[1.0], &[1.0, 3.0, 2.0, 0.0], None).unwrap();
    for open in [continuous.clone(), continuous.sampled(0.1, 0.25).unwrap()] {
        let margin =
            LoopAnalysis::new(&open, 0.0, [1e-3, 1e3], 600).unwrap().margins().unwrap().gain.unwrap();
        let [before, at, beyond] =
            [0.999, 1.0, 1.001].map(|k| open.continuous_root_locus(&[k * margin.margin]).unwrap().remove(0));
        assert!(before.poles.iter().all(|p| p.re < 0.0) && beyond.poles.iter().any(|p| p.re > 0.0));
        let crosses = |p: &Eigenvalue| {
            p.re.abs() < 100.0 * ROUNDING && (p.im - margin.frequency).abs() < 100.0 * ROUNDING
        };
        assert!(at.poles.iter().any(crosses), "{margin:?} {at:?}");
    }
}

#[test]
fn refusals() {
    let g = StateSpace::of_transfer(&[1.0], &[1.0, 1.0], None).unwrap();
    assert!(StateSpace::of_transfer(&[1.0, 0.0, 0.0], &[1.0, 1.0], None).is_err());
    assert!(StateSpace::of_transfer(&[1.0], &[], None).is_err());
    assert!(StateSpace::of_transfer(&[1.0], &[0.0, 1.0], None).is_err());
    assert!(StateSpace::of_transfer(&[f64::NAN], &[1.0, 1.0], None).is_err());
    assert!(StateSpace::of_gain(&[[1.0]], Some(0.0)).is_err());
    assert!(g.sampled(0.0, 0.0).is_err() && g.sampled(0.1, -0.1).is_err() && g.sampled(0.1, 1e9).is_err());
    let sampled = g.sampled(0.1, 0.0).unwrap();
    assert!(sampled.sampled(0.1, 0.0).is_err() && sampled.series(&g).is_err());
    assert!(g.series(&StateSpace::of_gain(&[[1.0, 1.0]], None).unwrap()).is_err());
    assert!(matches!(
        StateSpace::of_gain(&[[-1.0]], None).unwrap().closed(1.0),
        Err(ControlError::Singular { .. })
    ));
}
