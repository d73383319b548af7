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
    /// True if the law is the one of the reference.
    pub(super) law_known: bool,
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

fn signed(attack: [f64; 3], sideslip: [f64; 3]) -> Law {
    let gains = [attack, sideslip].map(|[p, i, d]| PidGains::new(p, i, d));
    Law::Pid { gains, filter_time: 0.0 }
}

fn nonlinear(attack: &[f64; 12], sideslip: &[f64; 12]) -> Law {
    let gains = [attack, sideslip].map(NonlinearGains::from_coefficients);
    Law::NonlinearPid { gains, filter_time: 0.0 }
}

/// Coefficients of the reference for the cross of 5 kg, both angles.
const CROSS_NONLINEAR: [f64; 12] = [
    0.29422937390327253,
    6.091074648783794,
    15.830446009812645,
    1.0411621373296747,
    0.023257147392095813,
    0.36808929084532815,
    824.989028940133,
    1.0320267237258294,
    0.1865104992558011,
    11.76064489209629,
    9958.847155537233,
    0.5450239150473402,
];
/// Coefficients of the reference for the rim of 5 kg, neutral (0, pi): of the angle of attack, of the sideslip.
const RIM_NONLINEAR: [[f64; 12]; 2] = [
    [
        0.022108929563303212,
        0.06718975522288631,
        10.321990231653983,
        0.8789034800162532,
        4.2187776953098455,
        1.3578682942706408,
        3975.2376719402787,
        0.8037344014958732,
        3.0047973310697027,
        0.1622423684148214,
        36.659889055748394,
        0.8117964602270858,
    ],
    [
        -0.10851139604544224,
        -0.11071007715502383,
        17.668171841935315,
        0.6721132035097583,
        -0.06608879149574358,
        -0.2091227428928524,
        7.135599812833663,
        0.8557100468952759,
        -0.014071943756580194,
        -13.24284580108801,
        7.60279253474035,
        0.7522113086464044,
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
    Figure { label, case, claim, reference, why, law_known: true }
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
        Figure {
            law_known: false,
            ..figure(
                "cross 5 kg, nonlinear PID",
                with(Case::cross(5.0), nonlinear(&CROSS_NONLINEAR, &CROSS_NONLINEAR)),
                Claim::Fails,
                [0.5883, 0.5882],
                "with the form at hand the masses do not even come to their stops, and no law moves them beyond",
            )
        },
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
        Figure {
            law_known: false,
            ..figure(
                "radial 5 kg, nonlinear PID on angles",
                angles(5.0, opposite, nonlinear(&RIM_NONLINEAR[0], &RIM_NONLINEAR[1])),
                Claim::Holds,
                [0.0006465, 0.004607],
                "the reference holds its own case with 24 coefficients, not other directions (45 deg) nor another entry angle (6 deg): what \
                 is missing is the inversion, not a nonlinear gain",
            )
        },
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
