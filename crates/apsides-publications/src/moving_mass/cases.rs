//! The cases of the figures, with what the paper says of them and the numbers of the reference.

use apsides_control::nonlinear_pid::NonlinearGains;
use apsides_control::pid::PidGains;
use std::f64::consts::PI;

use apsides_missions::moving_mass::{Allocation, Case, Law, Masses};

/// The claim of the paper on a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Claim {
    /// The angles are held.
    Holds,
    /// They swing a little.
    Swings,
    /// They are not held.
    Fails,
    /// It is not said: a case of the reference.
    None,
}

/// A case of a figure.
pub(super) struct Figure {
    pub(super) label: &'static str,
    pub(super) case: Case,
    pub(super) claim: Claim,
    /// Root mean squares of angle of attack and sideslip, deg, by the reference.
    pub(super) reference: [f64; 2],
    /// The reason for which it comes out as it does.
    pub(super) why: &'static str,
}

/// PID gains of (10 m/rad, 5 m/(rad s), 5 m s/rad).
pub(super) fn fixed() -> PidGains {
    PidGains::new(10.0, 5.0, 5.0)
}

/// The rim whose angles a law drives itself.
fn angles(mass: f64, neutral: [f64; 2], law: Law) -> Case {
    let mut case = Case::radial(mass);
    if let Masses::Radial { neutral: place, allocation, .. } = &mut case.masses {
        (*place, *allocation) = (neutral, Allocation::Angles);
    }
    case.law = law;
    case
}

/// The rim whose angles a law drives itself, neutral (0, pi).
pub(super) fn on_angles(mass: f64, law: Law) -> Case {
    angles(mass, [0.0, PI], law)
}

/// The nonlinear law with coefficients of the angle of attack and of the sideslip.
pub(super) fn nonlinear_on_angles([attack, sideslip]: &[[f64; 12]; 2]) -> Law {
    nonlinear(attack, sideslip)
}

fn signed(attack: [f64; 3], sideslip: [f64; 3]) -> Law {
    let gains = [attack, sideslip].map(|[p, i, d]| PidGains::new(p, i, d));
    Law::Pid { gains, filter_time: 0.0 }
}

fn nonlinear(attack: &[f64; 12], sideslip: &[f64; 12]) -> Law {
    let gains = [attack, sideslip].map(NonlinearGains::from_coefficients);
    Law::NonlinearPid { gains, filter_time: 0.0 }
}

/// The linear law (10, 5, 5) with twelve coefficients: the cross of 5 kg stands at its stops whatever the law.
const CROSS_NONLINEAR: [f64; 12] = [10.0, 0.0, 0.0, 1.0, 5.0, 0.0, 0.0, 1.0, 5.0, 0.0, 0.0, 1.0];
/// Coefficients for the rim of 5 kg, neutral (0, pi), of the paper's form, found by differential evolution over 108 descents: of the angle of
/// attack, of the sideslip. Those of the sideslip are negative, which the paper excludes.
pub(super) const RIM_NONLINEAR: [[f64; 12]; 2] = [
    [
        0.04014, 3.20209, 27.89516, 0.73644, 0.67036, 0.33601, 458.58557, 1.2, 2.57284, 0.08443, 1036.08918,
        0.72232,
    ],
    [
        -0.96381, -0.59678, 15.11827, 0.86944, -1.97691, -0.07434, 69.37483, 0.6839, -6.93835, -0.14769,
        157.25986, 1.2,
    ],
];

const SINGULAR: &str = "at a balanced neutral the derivative of the centre of mass by the angles is singular, so that the laws move it along \
                        one line alone";

/// All cases, in the order of the sheet.
pub(super) fn figures() -> Vec<Figure> {
    [without_law(), on_the_cross(), on_the_rim_by_angles(), on_the_rim_by_inversion()]
        .into_iter()
        .flatten()
        .collect()
}

fn figure(label: &'static str, case: Case, claim: Claim, reference: [f64; 2], why: &'static str) -> Figure {
    Figure { label, case, claim, reference, why }
}

fn without_law() -> Vec<Figure> {
    let without = |mut case: Case, offset: [f64; 2]| {
        case.law = Law::None;
        case.vehicle.offset = offset;
        case
    };
    vec![
        figure(
            "no law, no offset",
            without(Case::cross(10.0), [0.0; 2]),
            Claim::Swings,
            [0.11089655112133376, 0.0719584346451454],
            "the capsule is statically stable and damped; what is left is the swing of the entry",
        ),
        figure(
            "no law, 1 cm",
            without(Case::cross(10.0), [0.01; 2]),
            Claim::Fails,
            [2.0336743010710836, 2.0320474742734502],
            "the offset trims the capsule at an angle: CA offset / (D |Cm_alpha|)",
        ),
    ]
}

fn on_the_cross() -> Vec<Figure> {
    let with = |mut case: Case, law: Law| {
        case.law = law;
        case
    };
    let one_sided = Masses::Cross { mass: 10.0, travel: [0.0, 0.7] };
    vec![
        figure(
            "cross 10 kg, PID",
            Case::cross(10.0),
            Claim::Holds,
            [1.0036187403985346e-5, 9.081072437412445e-9],
            "10 kg over 0.70 m of 500 kg is 1.40 cm an axis, more than the offset",
        ),
        figure(
            "cross 10 kg, PID, travel 0 to 70 cm",
            with(
                Case { masses: one_sided, ..Case::cross(10.0) },
                Law::pid(PidGains::new(235.0, 312.1, 4.995)),
            ),
            Claim::None,
            [2.0336743010710836, 2.0320474742734502],
            "a positive offset needs negative positions, which a travel to one side does not have",
        ),
        figure(
            "cross 5 kg, PID",
            Case::cross(5.0),
            Claim::Fails,
            [0.5906, 0.5897],
            "5 kg over 0.70 m of 500 kg is 0.70 cm an axis: the masses stand at their stops; below 350 kg of vehicle they would do",
        ),
        figure(
            "cross 5 kg, PID, gains of the reference",
            with(
                Case::cross(5.0),
                Law::pid(PidGains::new(0.7858760944091405, 0.35346145759918907, 8.46893493447689)),
            ),
            Claim::Fails,
            [0.58853, 0.58811],
            "no gains move the masses beyond their stops",
        ),
        figure(
            "cross 5 kg, nonlinear PID",
            with(Case::cross(5.0), nonlinear(&CROSS_NONLINEAR, &CROSS_NONLINEAR)),
            Claim::Fails,
            [0.592, 0.591],
            "the masses stand at their stops, and no law moves them beyond: 0.59 deg is what statics leaves",
        ),
    ]
}

fn on_the_rim_by_angles() -> Vec<Figure> {
    let (opposite, together) = ([0.0, PI], [0.0, 0.0]);
    vec![
        figure(
            "radial 10 kg, PID on angles, neutral (0, 0)",
            angles(10.0, together, Law::pid(fixed())),
            Claim::Fails,
            [163.5852574153463, 14.063514412385716],
            "both masses start on one side, 3 cm of offset that the law must first undo, with a gain whose sign turns with the angle",
        ),
        figure(
            "radial 10 kg, PID on angles, neutral (0, 180)",
            angles(10.0, opposite, Law::pid(fixed())),
            Claim::Fails,
            [2.0336, 2.0319],
            SINGULAR,
        ),
        figure(
            "radial 10 kg, PID on angles, gains of the reference",
            angles(
                10.0,
                opposite,
                signed(
                    [13.906143791666459, 2.024321369651912, 0.2187933171678959],
                    [-0.020709662969956102, -1.0867031056890946, -2.0487826387991035],
                ),
            ),
            Claim::None,
            [0.004933, 0.0052773],
            "gains with signs fit one direction of the offset; in others they push the wrong way",
        ),
        figure(
            "radial 5 kg, PID on angles, neutral (0, 180)",
            angles(5.0, opposite, Law::pid(fixed())),
            Claim::Fails,
            [2.0336, 2.0319],
            SINGULAR,
        ),
        figure(
            "radial 5 kg, PID on angles, gains of the reference",
            angles(
                5.0,
                opposite,
                signed(
                    [-0.011015808627755244, 3.25213795731869, 8.701357968070347],
                    [0.035926480142973415, -0.311427224956617, -0.21790765271526208],
                ),
            ),
            Claim::None,
            [0.00019687, 0.0044247],
            "gains with signs fit one direction of the offset; in others they push the wrong way",
        ),
        figure(
            "radial 5 kg, nonlinear PID on angles",
            angles(5.0, opposite, nonlinear(&RIM_NONLINEAR[0], &RIM_NONLINEAR[1])),
            Claim::Holds,
            [0.0005, 0.00015],
            "24 coefficients hold the case that they were found for, as a linear law does (below); a law with slopes of fixed sign holds at most \
             half of the directions of an offset, so that what is missing is the inversion, not a nonlinear gain",
        ),
        figure(
            "radial 5 kg, PID on angles, searched the same way",
            angles(5.0, opposite, signed([1.98811, 2.26411, 2.05993], [-13.22609, -0.47161, -0.21791])),
            Claim::None,
            [0.0006, 0.0007],
            "the linear law holds the same case with six numbers",
        ),
    ]
}

fn on_the_rim_by_inversion() -> Vec<Figure> {
    vec![
        figure(
            "radial 10 kg, PID by inversion",
            Case::radial(10.0),
            Claim::None,
            [1.003e-5, 9.663e-8],
            "with the angles in closed form the linear law does what it does on a cross",
        ),
        figure(
            "radial 5 kg, PID by inversion",
            Case::radial(5.0),
            Claim::None,
            [1.5477751358673847e-5, 1.0090763888703325e-5],
            "2 x 5 kg on a rim of 0.75 m reach 1.50 cm in any direction, the offset is 1.41 cm",
        ),
    ]
}
