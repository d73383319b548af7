//! The smallest sphere around points, as a second-order cone program; then the points move, and the program is solved again.
#![allow(clippy::print_stdout)]

use apsides_conic::{Cone, ConicData, ConicError, ConicProgram, ConicSettings, Status, Triplets};

/// Corners of a box, and a point inside.
const POINTS: [[f64; 3]; 5] =
    [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 4.0, 0.0], [2.0, 4.0, 4.0], [1.0, 1.0, 1.0]];

/// `b` of the cones `(r, c - p)`: what is added to `(r, c)`.
fn right_hand_side(points: &[[f64; 3]]) -> Vec<f64> {
    points.iter().flat_map(|p| [0.0, -p[0], -p[1], -p[2]]).collect()
}

fn main() -> Result<(), ConicError> {
    // Variables: radius and centre. A x + s = b with s = (r, c - p) makes A minus the identity.
    let mut matrix = Triplets::default();
    for point in 0..POINTS.len() {
        (0..4).for_each(|k| matrix.push(4 * point + k, k, -1.0));
    }
    let data = ConicData {
        linear: vec![1.0, 0.0, 0.0, 0.0],
        quadratic: Triplets::default(),
        matrix,
        right_hand_side: right_hand_side(&POINTS),
        cones: vec![Cone::SecondOrder(4); POINTS.len()],
    };
    let mut program = ConicProgram::new(&data, ConicSettings::default())?;
    assert_eq!(program.solve(), Status::Solved);
    println!("radius {:.9}, centre {:.6?}", program.x()[0], &program.x()[1..]);
    // Half the diagonal of the box 2 x 4 x 4.
    assert!((program.x()[0] - 3.0).abs() < 1e-7);

    let twice = POINTS.map(|p| p.map(|c| 2.0 * c));
    program.set_right_hand_side(&right_hand_side(&twice))?;
    assert_eq!(program.solve(), Status::Solved);
    println!("radius {:.9} for points twice as far", program.x()[0]);
    assert!((program.x()[0] - 6.0).abs() < 1e-6);
    Ok(())
}
