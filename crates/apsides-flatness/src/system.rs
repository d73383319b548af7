//! Flat systems with sizes and scalar erased.

use std::sync::Arc;

use apsides_ad::{FlatMap, NodeFunction, flat_node};
use apsides_ocp::Phase;

use crate::FlatnessError;

type Outputs = dyn Fn(f64, &[f64], &[f64], &[f64], &mut [f64]) + Send + Sync;

/// The flat description of one phase: see [`FlatMap`].
#[derive(Clone)]
pub struct FlatSystem {
    /// Number of outputs.
    pub outputs: usize,
    /// Rows of the jet: derivatives `0 .. jet_rows` of each output are inputs of the map.
    pub jet_rows: usize,
    /// Highest derivative of each output that the map depends on.
    pub highest: Vec<usize>,
    /// Number of states.
    pub states: usize,
    /// Number of controls.
    pub controls: usize,
    /// Number of remaining equations.
    pub residuals: usize,
    /// Number of static parameters that the map takes.
    pub parameters: usize,
    /// The map: inputs jet (output by output), parameters, time; outputs states, controls, residuals.
    pub map: Arc<dyn NodeFunction>,
    outputs_of: Arc<Outputs>,
}

impl std::fmt::Debug for FlatSystem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { outputs, highest, states, controls, residuals, parameters, .. } = self;
        write!(
            f,
            "FlatSystem {{ outputs: {outputs}, highest: {highest:?}, states: {states}, controls: {controls}, residuals: \
             {residuals}, parameters: {parameters} }}"
        )
    }
}

impl FlatSystem {
    /// Erases a map.
    pub fn new<
        M,
        const NY: usize,
        const ND: usize,
        const NX: usize,
        const NU: usize,
        const NR: usize,
        const NP: usize,
    >(
        map: M,
    ) -> Self
    where
        M: FlatMap<NY, ND, NX, NU, NR, NP> + 'static,
    {
        let map = Arc::new(map);
        let node = flat_node(Arc::clone(&map));
        let depends = |input: usize| node.pattern().columns.contains(&input);
        let highest = (0..NY).map(|i| (0..ND).rev().find(|d| depends(i * ND + d)).unwrap_or(0)).collect();
        let outputs_of = move |t: f64, x: &[f64], u: &[f64], p: &[f64], out: &mut [f64]| {
            let y = map.outputs(t, &array(x), &array(u), &array(p));
            out.copy_from_slice(&y);
        };
        Self {
            outputs: NY,
            jet_rows: ND,
            highest,
            states: NX,
            controls: NU,
            residuals: NR,
            parameters: NP,
            map: node,
            outputs_of: Arc::new(outputs_of),
        }
    }

    /// Highest derivative of all outputs.
    #[must_use]
    pub fn highest_derivative(&self) -> usize {
        self.highest.iter().copied().max().unwrap_or(0)
    }

    /// Outputs of a state and control; the parameters may be more than the map takes.
    pub(crate) fn outputs_at(&self, t: f64, x: &[f64], u: &[f64], p: &[f64], out: &mut [f64]) {
        (self.outputs_of)(t, x, u, &p[..self.parameters], out);
    }

    /// Sizes against those of the phase.
    pub(crate) fn check(&self, phase: &Phase, parameters: usize) -> Result<(), FlatnessError> {
        let sizes = [
            ("states of the flat system", phase.states.len(), self.states),
            ("controls of the flat system", phase.controls.len(), self.controls),
            (
                "static parameters of the flat system (all or none)",
                if self.parameters == 0 { 0 } else { parameters },
                self.parameters,
            ),
        ];
        for (what, expected, found) in sizes {
            if expected != found {
                let place = format!("phase `{}`", phase.name);
                return Err(FlatnessError::Dimension { place, what, expected, found });
            }
        }
        if self.outputs == 0 {
            let (place, what) = (format!("phase `{}`", phase.name), "outputs of the flat system, or more");
            return Err(FlatnessError::Dimension { place, what, expected: 1, found: 0 });
        }
        Ok(())
    }
}

/// The first `N` values.
fn array<const N: usize>(values: &[f64]) -> [f64; N] {
    std::array::from_fn(|k| values[k])
}
