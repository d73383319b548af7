//! Initial states that a linkage makes equal, up to a constant, to a final state of an earlier phase.

use crate::{EndpointConstraint, EndpointInput, Ocp};

/// `initial state = final state of the phase + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// Index of the earlier phase.
    pub phase: usize,
    /// Index of its state.
    pub state: usize,
    /// Constant that is added.
    pub offset: f64,
}

/// An equality row `from - to = constant` between phases.
struct Link {
    row: usize,
    to: (usize, usize),
    from: Source,
}

/// The source of each initial state, per phase and state, if it has one in a phase with a smaller index.
#[must_use]
pub fn sources(ocp: &Ocp) -> Vec<Vec<Option<Source>>> {
    let mut sources: Vec<Vec<Option<Source>>> =
        ocp.phases.iter().map(|p| vec![None; p.states.len()]).collect();
    for link in ocp.constraints.iter().flat_map(links) {
        let place = &mut sources[link.to.0][link.to.1];
        if link.from.phase < link.to.0 {
            place.get_or_insert(link.from);
        }
    }
    sources
}

/// For each row of a constraint, the phase and state whose initial value a linkage determines.
#[must_use]
pub fn linked_rows(constraint: &EndpointConstraint) -> Vec<Option<(usize, usize)>> {
    let mut rows = vec![None; constraint.rows.len()];
    for link in links(constraint) {
        rows[link.row] = Some(link.to);
    }
    rows
}

fn links(constraint: &EndpointConstraint) -> Vec<Link> {
    let function = constraint.function.as_ref();
    let pattern = function.pattern();
    let mut constants = vec![0.0; function.outputs()];
    let mut slopes = vec![0.0; pattern.jacobian_len()];
    // For a linear row the values at zero are its constant and the slopes hold everywhere.
    function.jacobian(&vec![0.0; function.inputs()], &mut constants, &mut slopes);
    let mut found = Vec::new();
    for (row, variable) in constraint.rows.iter().enumerate() {
        let entries = pattern.row_offsets[row]..pattern.row_offsets[row + 1];
        let (columns, slopes) = (&pattern.columns[entries.clone()], &slopes[entries]);
        let linear = !pattern.hessian.iter().any(|(i, j)| columns.contains(i) || columns.contains(j));
        let &[a, b] = columns else { continue };
        let &[slope_a, slope_b] = slopes else { continue };
        if !linear || !variable.bounds.is_fixed() || slope_a.abs() != 1.0 || slope_b != -slope_a {
            continue;
        }
        let (from, to, slope) = match (constraint.inputs[a], constraint.inputs[b]) {
            (
                EndpointInput::FinalState { phase, state },
                EndpointInput::InitialState { phase: p, state: s },
            ) => ((phase, state), (p, s), slope_a),
            (
                EndpointInput::InitialState { phase: p, state: s },
                EndpointInput::FinalState { phase, state },
            ) => ((phase, state), (p, s), slope_b),
            _ => continue,
        };
        // slope * (from - to) + constant = bound
        let offset = (constants[row] - variable.bounds.lower) / slope;
        if from.0 != to.0 && offset.is_finite() {
            found.push(Link { row, to, from: Source { phase: from.0, state: from.1, offset } });
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Variable;
    use apsides_ad::{Scalar, VectorFunction, vector_node};

    /// `[b - a + 3, a c]`.
    struct Rows;
    impl VectorFunction<3, 2> for Rows {
        fn evaluate<S: Scalar>(&self, z: &[S; 3]) -> [S; 2] {
            [z[1] - z[0] + 3.0, z[2].sin()]
        }
    }

    /// `b - a + a c`.
    struct Bent;
    impl VectorFunction<3, 1> for Bent {
        fn evaluate<S: Scalar>(&self, z: &[S; 3]) -> [S; 1] {
            [z[1] - z[0] + z[0] * z[2]]
        }
    }

    fn inputs() -> Vec<EndpointInput> {
        vec![
            EndpointInput::FinalState { phase: 0, state: 1 },
            EndpointInput::InitialState { phase: 1, state: 2 },
            EndpointInput::Parameter { index: 0 },
        ]
    }

    #[test]
    fn an_offset_is_found_with_its_sign() {
        let constraint = EndpointConstraint {
            name: "stage".into(),
            rows: vec![Variable::new("drop", "kg").equal_to(-7.0), Variable::new("other", "-").equal_to(0.0)],
            inputs: inputs(),
            function: vector_node(Rows),
        };
        let found = links(&constraint);
        assert_eq!(found.len(), 1);
        // b - a + 3 = -7, so b = a - 10
        assert_eq!(found[0].from, Source { phase: 0, state: 1, offset: -10.0 });
        assert_eq!(linked_rows(&constraint), [Some((1, 2)), None]);
    }

    #[test]
    fn nonlinear_or_inequality_rows_are_no_links() {
        let bent = EndpointConstraint {
            name: "bent".into(),
            rows: vec![Variable::new("r", "-").equal_to(0.0)],
            inputs: inputs(),
            function: vector_node(Bent),
        };
        assert!(links(&bent).is_empty());
        let loose = EndpointConstraint {
            name: "loose".into(),
            rows: vec![Variable::new("r", "-").within(0.0, 1.0), Variable::new("other", "-")],
            inputs: inputs(),
            function: vector_node(Rows),
        };
        assert!(links(&loose).is_empty());
    }
}
