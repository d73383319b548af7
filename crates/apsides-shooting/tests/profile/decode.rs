//! From decision vectors to profiles.

use apsides_ocp::Bounds;
use apsides_shooting::profile::{MAX_DEGREE, Profile, ProfileShape};
use proptest::prelude::*;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-14;

const BOUNDS: [Bounds; 2] = [Bounds::new(-1.5, 2.0), Bounds::new(10.0, 11.0)];

fn shape(degree: usize, least: usize, most: usize, free_lengths: bool, continuous: bool) -> ProfileShape {
    ProfileShape {
        least_intervals: least,
        free_lengths,
        continuous: continuous && degree > 0,
        ..ProfileShape::new(degree, most, BOUNDS.to_vec())
    }
}

fn value(profile: &Profile, s: f64) -> [f64; 2] {
    let mut out = [0.0; 2];
    profile.at(s, &mut out);
    out
}

/// Shapes of every kind with a decision vector that may leave the box by a tenth of its size.
fn decoded() -> impl Strategy<Value = (ProfileShape, Vec<f64>)> {
    let shapes = (0..=MAX_DEGREE, 1..5_usize, 0..4_usize, any::<bool>(), any::<bool>()).prop_map(
        |(degree, least, more, free, continuous)| shape(degree, least, least + more, free, continuous),
    );
    shapes.prop_flat_map(|shape| {
        let count = shape.variables();
        (Just(shape), prop::collection::vec(-0.1..1.1, count)).prop_map(|(shape, parts)| {
            let (lower, upper) = shape.space().unwrap();
            let ends = lower.iter().zip(&upper);
            let decision = ends.zip(parts).map(|((a, b), part)| a + part * (b - a)).collect();
            (shape, decision)
        })
    })
}

proptest! {
    #[test]
    fn values_stay_inside((shape, decision) in decoded(), s in -0.2..1.2) {
        let profile = shape.decode(&decision).unwrap();
        for (v, b) in value(&profile, s).iter().zip(&BOUNDS) {
            prop_assert!(b.lower <= *v && *v <= b.upper, "{v}");
        }
    }

    #[test]
    fn lengths_sum_to_one((shape, decision) in decoded()) {
        let profile = shape.decode(&decision).unwrap();
        let joints = profile.joints();
        prop_assert!((shape.least_intervals..=shape.most_intervals).contains(&profile.intervals()));
        prop_assert_eq!((joints[0], joints[joints.len() - 1]), (0.0, 1.0));
        let lengths: Vec<f64> = joints.windows(2).map(|w| w[1] - w[0]).collect();
        let longest = lengths.iter().copied().fold(0.0, f64::max);
        prop_assert!(lengths.iter().all(|l| *l > 0.0 && longest <= shape.length_ratio * l * (1.0 + 1e-9)));
        prop_assert!((lengths.iter().sum::<f64>() - 1.0).abs() < ROUNDING);
    }

    #[test]
    fn nodes_have_the_values_given((shape, decision) in decoded()) {
        let profile = shape.decode(&decision).unwrap();
        let points = profile.nodes().len();
        let stride = if shape.continuous { shape.degree } else { points };
        let mut out = [0.0; 2];
        for k in 0..profile.intervals() {
            let (a, b) = (profile.joints()[k], profile.joints()[k + 1]);
            for (j, x) in profile.nodes().iter().enumerate() {
                profile.at_in(k, a + 0.5 * (x + 1.0) * (b - a), &mut out);
                for c in 0..2 {
                    let given = decision[(k * stride + j) * 2 + c].clamp(BOUNDS[c].lower, BOUNDS[c].upper);
                    prop_assert!((out[c] - given).abs() < 100.0 * ROUNDING * given.abs().max(1.0));
                    prop_assert_eq!(profile.nodal_values(k)[2 * j + c], given);
                }
            }
        }
    }

    #[test]
    fn joints_are_continuous_where_wanted((shape, decision) in decoded()) {
        let profile = shape.decode(&decision).unwrap();
        let (mut left, mut right) = ([0.0; 2], [0.0; 2]);
        for k in 1..profile.intervals() {
            profile.at_in(k - 1, profile.joints()[k], &mut left);
            profile.at_in(k, profile.joints()[k], &mut right);
            let jump = (left[0] - right[0]).abs().max((left[1] - right[1]).abs());
            prop_assert!(!shape.continuous || jump < 1e3 * ROUNDING, "{jump}");
            prop_assert_eq!(value(&profile, profile.joints()[k]), right);
        }
    }
}

/// A polynomial of the degree of the profile is met exactly.
#[test]
fn polynomials_of_every_degree() {
    for degree in 0..=MAX_DEGREE {
        let p = |x: f64| (0..=degree).map(|k| x.powi(k as i32) / (k + 2) as f64).sum::<f64>();
        for continuous in [false, true] {
            if continuous && degree == 0 {
                continue;
            }
            let shape =
                ProfileShape { continuous, ..ProfileShape::new(degree, 3, vec![Bounds::new(-10.0, 10.0)]) };
            let nodes = Profile::new(&shape).unwrap().nodes().to_vec();
            let mut decision = vec![0.0; shape.variables()];
            let stride = if continuous { degree } else { degree + 1 };
            for k in 0..3 {
                for (j, x) in nodes.iter().enumerate() {
                    decision[k * stride + j] = p((k as f64 + 0.5 * (x + 1.0)) / 3.0);
                }
            }
            let profile = shape.decode(&decision).unwrap();
            for k in 0..=60 {
                let s = f64::from(k) / 60.0;
                let mut out = [0.0];
                profile.at(s, &mut out);
                let expected = if degree == 0 { 0.5 } else { p(s) };
                assert!(
                    (out[0] - expected).abs() < 10.0 * ROUNDING,
                    "{degree} at {s}: {} {expected}",
                    out[0]
                );
            }
        }
    }
}

/// Weights 1, 3, 4 of lengths; a number of 2.4 is two sub-intervals, so that only the first two weights count.
#[test]
fn lengths_and_number() {
    let shape = shape(0, 1, 3, true, false);
    let decision = [0.0, 10.0, 1.0, 10.5, 2.0, 11.0, 0.25, 0.75, 1.0, 2.4];
    let profile = shape.decode(&decision).unwrap();
    assert_eq!(profile.joints(), [0.0, 0.25, 1.0]);
    assert_eq!((value(&profile, 0.2), value(&profile, 0.3)), ([0.0, 10.0], [1.0, 10.5]));
    let all = shape.decode(&[&decision[..9], &[3.49]].concat()).unwrap();
    assert_eq!(all.joints(), [0.0, 0.125, 0.5, 1.0]);
    // Rounding gives each number the same share of the box.
    let (lower, upper) = shape.space().unwrap();
    assert_eq!((lower[9], upper[9]), (0.5, 3.5));
    assert_eq!(shape.decode(&[&decision[..9], &[3.5]].concat()).unwrap().intervals(), 3);
    assert_eq!(shape.decode(&[&decision[..9], &[0.5]].concat()).unwrap().intervals(), 1);
}

/// Between nodes at the bounds a parabola would leave them.
#[test]
fn values_between_the_nodes_are_cut_off() {
    let shape = ProfileShape::new(2, 1, vec![Bounds::new(0.0, 1.0)]);
    let profile = shape.decode(&[0.0, 1.0, 1.0]).unwrap();
    let mut out = [0.0];
    // 1 + x / 2 - x^2 / 2, largest at x = 1/2 with 1.125.
    profile.at(0.75, &mut out);
    assert_eq!(out[0], 1.0);
    profile.at(0.25, &mut out);
    assert!((out[0] - 0.625).abs() < 0.1 * ROUNDING);
}

/// Degrees 0.4, 1.6 and 3.2 are 0, 2 and 3: the first value alone; the first two and the last at the nodes of a parabola; all four.
#[test]
fn degrees_of_their_own() {
    let shape = ProfileShape {
        most_degree: 3,
        least_intervals: 2,
        ..ProfileShape::new(0, 3, vec![Bounds::new(-10.0, 10.0)])
    };
    assert_eq!(shape.variables(), 12 + 3 + 1);
    let (lower, upper) = shape.space().unwrap();
    assert_eq!(
        (lower[12..].to_vec(), upper[12..].to_vec()),
        (vec![-0.5, -0.5, -0.5, 1.5], vec![3.5, 3.5, 3.5, 3.5])
    );
    let cubic = |x: f64| 1.0 + x - 2.0 * x * x + 0.5 * x * x * x;
    let full = ProfileShape::new(3, 1, vec![Bounds::new(-10.0, 10.0)]);
    let nodes = Profile::new(&full).unwrap().nodes().to_vec();
    let third: Vec<f64> = nodes.iter().map(|x| cubic(*x)).collect();
    // Of 3 x^2 - x + 1 at -1, 0 and 1; the third value has no effect.
    let decision = [&[4.0, 9.0, 9.0, 9.0, 5.0, 1.0, 9.0, 3.0], &third[..], &[0.4, 1.6, 3.2, 2.9]].concat();
    let profile = shape.decode(&decision).unwrap();
    assert_eq!(profile.degrees(), [0, 2, 3]);
    let at = |interval: usize, x: f64| {
        let mut out = [0.0];
        profile.at_in(interval, (interval as f64 + 0.5 * (x + 1.0)) / 3.0, &mut out);
        out[0]
    };
    for x in [-0.9, -0.3, 0.0, 0.2, 0.95] {
        for (interval, expected) in [(0, 4.0), (1, 3.0 * x * x - x + 1.0), (2, cubic(x))] {
            assert!(
                (at(interval, x) - expected).abs() < 10.0 * ROUNDING,
                "{interval} at {x}: {}",
                at(interval, x)
            );
        }
    }
    // Values at the nodes of the largest degree, whatever that of the sub-interval.
    for (x, value) in profile.nodes().iter().zip(profile.nodal_values(1)) {
        assert!((value - (3.0 * x * x - x + 1.0)).abs() < 10.0 * ROUNDING);
    }
    // With two sub-intervals the third has no effect; joined ones share the value at the joint.
    let two = shape.decode(&[&decision[..15], &[2.0]].concat()).unwrap();
    assert_eq!(two.degrees(), [0, 2]);
    let joined = ProfileShape { continuous: true, degree: 1, most_degree: 3, ..shape.clone() };
    let decision = [1.0, 0.3, -0.7, 2.0, 0.1, 0.2, -3.0, 0.5, 0.4, 0.6, 1.0, 3.0, 2.0, 3.0];
    let profile = joined.decode(&decision).unwrap();
    assert_eq!(profile.degrees(), [1, 3, 2]);
    for (joint, expected) in [(0, 2.0), (1, -3.0)] {
        let (mut left, mut right) = ([0.0], [0.0]);
        profile.at_in(joint, profile.joints()[joint + 1], &mut left);
        profile.at_in(joint + 1, profile.joints()[joint + 1], &mut right);
        assert!(
            (left[0] - expected).abs() < 10.0 * ROUNDING && (right[0] - expected).abs() < 10.0 * ROUNDING
        );
    }
}

#[test]
fn a_number_that_is_none_shows() {
    let shape = ProfileShape::new(0, 2, vec![Bounds::new(0.0, 1.0)]);
    let profile = shape.decode(&[f64::NAN, 0.5]).unwrap();
    let mut out = [0.0];
    profile.at(0.2, &mut out);
    assert!(out[0].is_nan());
    profile.at(f64::NAN, &mut out);
    assert!(out[0].is_nan());
}

#[test]
fn shapes_that_are_refused() {
    let good = shape(2, 1, 3, true, false);
    let refused = |bad: ProfileShape| bad.space().unwrap_err().to_string();
    assert_eq!(
        refused(ProfileShape { degree: 6, ..good.clone() }),
        "setting `degree` is 6, allowed is a whole number from 0 to 5"
    );
    assert_eq!(
        refused(ProfileShape { most_degree: 6, ..good.clone() }),
        "setting `most_degree` is 6, allowed is from degree to 5"
    );
    assert!(refused(ProfileShape { most_degree: 1, ..good.clone() }).contains("most_degree"));
    assert!(refused(ProfileShape { least_intervals: 0, ..good.clone() }).contains("least_intervals"));
    assert!(refused(ProfileShape { most_intervals: 0, ..good.clone() }).contains("most_intervals"));
    assert!(refused(ProfileShape { length_ratio: 1.0, ..good.clone() }).contains("length_ratio"));
    assert!(refused(ProfileShape { length_ratio: f64::NAN, ..good.clone() }).contains("length_ratio"));
    assert!(refused(ProfileShape { degree: 0, continuous: true, ..good.clone() }).contains("continuous"));
    assert!(refused(ProfileShape { bounds: vec![], ..good.clone() }).contains("no component"));
    for bounds in [Bounds::new(1.0, 0.0), Bounds::at_least(0.0), Bounds::new(f64::NAN, 1.0)] {
        assert!(refused(ProfileShape { bounds: vec![bounds], ..good.clone() }).contains("component 0"));
    }
    assert_eq!(
        good.decode(&[0.0; 3]).unwrap_err().to_string(),
        "profile: expected 22 decision variables, found 3"
    );
}
