//! Where the lengths of vectors of controls occur in the functions of a phase.

use apsides_ad::Formula;
use apsides_ad::formula::{Operation, Unary};

use crate::cones::{Cone, by_lengths};
use crate::squares::{Root, Summand, root, terms, vector_of_controls};
use crate::{PathConstraint, Phase};

/// The functions of a phase as formulas: that of the equations of motion, those of the path constraints, those of the integrals.
pub(super) struct Lengths<'a> {
    pub(super) phase: &'a Phase,
    pub(super) formulas: Vec<Formula>,
    /// Per path constraint and row, the cone that it keeps a vector in: the formulas have `|u| - r` in place of `u . u - r^2`.
    cones: Vec<Vec<Option<Cone>>>,
    /// Vectors that a limit keeps from being nothing: their lengths have slopes everywhere.
    never_nothing: Vec<Vec<usize>>,
}

/// A value that a vector of controls alone determines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Measure {
    Length,
    Square,
}

impl<'a> Lengths<'a> {
    /// None where a function is no formula: of such a one nothing is known.
    pub(super) fn of(phase: &'a Phase) -> Option<Self> {
        let formulas = phase.functions().map(|f| f.formula()).collect::<Result<_, _>>().ok()?;
        let plain = Self { phase, formulas, cones: Vec::new(), never_nothing: Vec::new() }.with_limits();
        Some(plain.with_cones().unwrap_or(plain))
    }

    /// With cones by lengths; none where there are none, or a vector of one has no length and direction of its own.
    fn with_cones(&self) -> Option<Self> {
        let constraints = self.phase.path.iter().zip(&self.formulas[1..]);
        let cones: Vec<Vec<Option<Cone>>> = constraints
            .map(|(constraint, formula)| {
                let kept = |cone: &Cone| cone.may_be_at_tip && cone.controls(self.phase).is_some();
                Cone::of_rows(self.phase, constraint, formula).into_iter().map(|c| c.filter(kept)).collect()
            })
            .collect();
        let mut formulas = self.formulas.clone();
        for (formula, cones) in formulas[1..].iter_mut().zip(&cones) {
            if cones.iter().any(Option::is_some) {
                *formula = by_lengths(formula, cones).ok()?;
            }
        }
        let written = Self { phase: self.phase, formulas, cones, never_nothing: self.never_nothing.clone() };
        let vectors = written.vectors();
        let mut of_cones = written.cones.iter().flatten().flatten().peekable();
        of_cones.peek()?;
        let is_vector = |controls: Vec<usize>| vectors.contains(&controls);
        of_cones.all(|cone| cone.controls(self.phase).is_some_and(is_vector)).then_some(written)
    }

    /// The cone of a row of a path constraint.
    pub(super) fn cone(&self, constraint: usize, row: usize) -> Option<&Cone> {
        self.cones.get(constraint)?.get(row)?.as_ref()
    }

    fn with_limits(mut self) -> Self {
        for (constraint, formula) in self.phase.path.iter().zip(&self.formulas[1..]) {
            let rows = constraint.rows.iter().zip(formula.outputs());
            for (_, output) in rows.filter(|(row, _)| row.bounds.lower > 0.0) {
                let length = output.checked_sub(formula.inputs()).and_then(|k| self.length(formula, k));
                self.never_nothing.extend(length.or_else(|| self.square(formula, *output)));
            }
        }
        self
    }

    /// True if the length of a vector of controls that may be nothing occurs.
    pub(super) fn occur(&self) -> bool {
        self.formulas.iter().any(|f| (0..f.operations().len()).any(|k| self.length(f, k).is_some()))
    }

    /// Vectors whose lengths occur elsewhere than as the rows of path constraints; none where two of them share a control.
    pub(super) fn vectors(&self) -> Vec<Vec<usize>> {
        let mut found: Vec<Vec<usize>> = Vec::new();
        for (k, formula) in self.formulas.iter().enumerate() {
            // A row that is a length has a square without a kink.
            if self.constraint(k).is_some_and(|c| self.limited(c, k).is_some()) {
                continue;
            }
            for operation in 0..formula.operations().len() {
                if let Some(components) = self.length(formula, operation)
                    && !found.contains(&components)
                {
                    found.push(components);
                }
            }
        }
        let mut all: Vec<usize> = found.concat();
        all.sort_unstable();
        if all.windows(2).any(|w| w[0] == w[1]) { Vec::new() } else { found }
    }

    /// The path constraint of a formula.
    pub(super) fn constraint(&self, formula: usize) -> Option<&'a PathConstraint> {
        formula.checked_sub(1).and_then(|k| self.phase.path.get(k))
    }

    /// The vector whose lengths or squares all rows of a path constraint are, and which of them each row is.
    pub(super) fn limited(
        &self,
        constraint: &PathConstraint,
        formula: usize,
    ) -> Option<(Vec<usize>, Vec<Measure>)> {
        let formula = &self.formulas[formula];
        let mut vector: Option<Vec<usize>> = None;
        let mut measures = Vec::with_capacity(constraint.rows.len());
        for output in formula.outputs() {
            let operation = output.checked_sub(formula.inputs())?;
            let (components, measure) = match self.length(formula, operation) {
                Some(components) => (components, Measure::Length),
                None => (self.square(formula, *output)?, Measure::Square),
            };
            if vector.get_or_insert_with(|| components.clone()) != &components {
                return None;
            }
            measures.push(measure);
        }
        vector.map(|vector| (vector, measures))
    }

    /// The controls of which an operation is the length, in their order; at least two, which may all be nothing.
    pub(super) fn length(&self, formula: &Formula, operation: usize) -> Option<Vec<usize>> {
        let components = match formula.operations()[operation] {
            Operation::Unary(Unary::Sqrt, of) | Operation::Powf(of, 0.5) => self.square(formula, of)?,
            _ => return None,
        };
        (!self.never_nothing.contains(&components)).then_some(components)
    }

    /// The controls of whose vector a value is the square, in their order; at least two.
    pub(super) fn square(&self, formula: &Formula, value: usize) -> Option<Vec<usize>> {
        let of_square = |term: Summand| root(formula, term.value).filter(|_| term.is_added);
        let roots: Vec<Root> = terms(formula, value)?.into_iter().map(of_square).collect::<Option<_>>()?;
        vector_of_controls(self.phase, &roots)
    }
}
