//! [`KktSystem`]: the data flow from triplets to a refined solution.

use crate::analysis::Analysis;
use crate::columns::{MOST_COLUMNS, first_columns};
use crate::inertia::Inertia;
use crate::multifrontal::Multifrontal;
use crate::norms::{all_finite, maximum};
use crate::pivoted::Pivoted;
use crate::refine::{Outcome, Refiner, System};
use crate::scaling::{equilibrate, power_of_two, smallest_row};
use crate::settings::check_nonnegative;
use crate::structure::Structure;
use crate::{KktError, KktSettings};

/// Part of the residual below which a fallback that has not converged was of use.
const OF_USE: f64 = 1e-2;

/// Most factorisations without a fallback after one that was of no use, as a power of two.
const LONGEST_PAUSE: u32 = 5;

/// The accuracy to which a system was solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveQuality {
    /// `|b - A x| / |b|` in the maximum norm, for the system without static shift in its equilibrated rows and
    /// columns. Above the tolerance of the settings: either no better solution was found (singular or extremely
    /// ill-conditioned), or `|x|` is so much larger than `|b|` that the product `A x` rounds to no less. Infinite if the solution
    /// overflows.
    pub residual: f64,
    /// Solves with a factor after the first one.
    pub refinements: usize,
    /// The pivoted LBL^T factorisation was used.
    pub fallback: bool,
}

/// Work done since [`KktSystem::analyse`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct KktCounters {
    /// LDL^T factorisations.
    pub factorisations: usize,
    /// Calls of [`KktSystem::solve`].
    pub solves: usize,
    /// Solves with a factor after the first of each call.
    pub refinements: usize,
    /// Factorisations by pivoted LBL^T.
    pub fallbacks: usize,
}

/// A symmetric indefinite system whose structure is analysed once and whose values change.
///
/// After `analyse` and the first fallback (whose memory is set up when it is first needed) nothing is allocated.
pub struct KktSystem {
    settings: KktSettings,
    /// Elimination order: place `k` holds row `order[k]`.
    order: Vec<u32>,
    primal: usize,
    structure: Structure,
    /// Upper triangle, without the static shift, as given and equilibrated.
    values: Vec<f64>,
    scaled: Vec<f64>,
    /// Static shift of each place: positive in primal rows, negative (zero too) in dual ones.
    static_shifts: Vec<f64>,
    /// Scale of each place.
    scale: Vec<f64>,
    factor: Multifrontal,
    fallback: Option<Pivoted>,
    /// The fallback holds the factor of the present values.
    fallback_current: bool,
    /// Fallbacks in a row that were of no use, and factorisations until there is one again: where a matrix is singular but for
    /// rounding, no order of pivots solves it.
    futile: u32,
    pause: usize,
    factored: bool,
    /// Size of a row of the matrix: 1 after equilibration, else that of the smallest row.
    unit: f64,
    refiner: Refiner,
    rhs: [Vec<f64>; MOST_COLUMNS],
    solution: [Vec<f64>; MOST_COLUMNS],
    counters: KktCounters,
}

impl std::fmt::Debug for KktSystem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("KktSystem")
            .field("n", &self.structure.n)
            .field("primal", &self.primal)
            .field("nonzeros", &self.structure.values())
            .field("factor_nonzeros", &self.factor_nonzeros())
            .field("counters", &self.counters)
            .finish_non_exhaustive()
    }
}

impl KktSystem {
    /// Analyses the structure of an `n` x `n` system whose first `primal` rows are primal (expected positive), the
    /// others dual (expected negative).
    ///
    /// Entry `t` of the triplets stands for the pair `(rows[t], cols[t])` and its mirror image: give one triangle,
    /// either one, even mixed. Duplicates are summed. The diagonal needs no triplets.
    ///
    /// # Errors
    /// Slices of unequal length, indices out of range, an order that is no permutation, negative or non-finite
    /// settings, a system too large for 32-bit indices.
    pub fn analyse(
        n: usize,
        primal: usize,
        rows: &[usize],
        cols: &[usize],
        settings: KktSettings,
    ) -> Result<Self, KktError> {
        settings.check()?;
        if primal > n {
            return Err(KktError::PrimalRows { primal, n });
        }
        if rows.len() != cols.len() {
            return Err(KktError::Dimension { what: "cols", found: cols.len(), expected: rows.len() });
        }
        if n > i32::MAX as usize {
            return Err(KktError::TooLarge { n });
        }
        if let Some(index) = rows.iter().zip(cols).position(|(&i, &j)| i >= n || j >= n) {
            return Err(KktError::OutOfBounds { index, row: rows[index], col: cols[index], n });
        }
        let Analysis { order, structure, factor } = Analysis::new(n, rows, cols, &settings.ordering)?;
        Ok(Self {
            refiner: Refiner::new(n, &settings),
            static_shifts: order
                .iter()
                .map(
                    |&row| {
                        if (row as usize) < primal { settings.static_shift } else { -settings.static_shift }
                    },
                )
                .collect(),
            settings,
            order,
            primal,
            values: vec![0.0; structure.values()],
            scaled: vec![0.0; structure.values()],
            scale: vec![1.0; n],
            factor,
            fallback: None,
            fallback_current: false,
            futile: 0,
            pause: 0,
            factored: false,
            unit: 0.0,
            rhs: std::array::from_fn(|_| vec![0.0; n]),
            solution: std::array::from_fn(|_| vec![0.0; n]),
            counters: KktCounters::default(),
            structure,
        })
    }

    /// Factors the matrix with `values` in the order of the triplets given to [`analyse`](Self::analyse), after adding
    /// `primal_shift` to the diagonal of the primal rows and subtracting `dual_shift` from that of the dual rows.
    /// Both shifts belong to the system that [`solve`](Self::solve) solves.
    ///
    /// The inertia is that of the factor, which also carries the static shift; where a pivot of the fixed order is zero,
    /// it is that of a second, pivoted factorisation. A singular matrix is no error: look
    /// at [`Inertia::zero`], and at the [`SolveQuality`] of the solutions.
    ///
    /// # Errors
    /// Wrong length, values that are not finite, a negative or non-finite shift. No factor is held afterwards.
    pub fn factor(
        &mut self,
        values: &[f64],
        primal_shift: f64,
        dual_shift: f64,
    ) -> Result<Inertia, KktError> {
        self.factored = false;
        self.fallback_current = false;
        let expected = self.structure.triplet_position.len();
        if values.len() != expected {
            return Err(KktError::Dimension { what: "values", found: values.len(), expected });
        }
        check_nonnegative("primal_shift", primal_shift)?;
        check_nonnegative("dual_shift", dual_shift)?;

        self.values.fill(0.0);
        for (&p, &v) in self.structure.triplet_position.iter().zip(values) {
            self.values[p as usize] += v;
        }
        if primal_shift > 0.0 || dual_shift > 0.0 {
            for (&p, &shift) in self.structure.diagonal.iter().zip(&self.static_shifts) {
                // The sign tells primal from dual rows.
                self.values[p as usize] += if shift.is_sign_positive() { primal_shift } else { -dual_shift };
            }
        }
        if !all_finite(&self.values) {
            let index = values.iter().position(|v| !v.is_finite()).unwrap_or(0);
            return Err(KktError::NotFinite { what: "values", index });
        }
        let largest = &mut self.rhs[0];
        if self.settings.equilibrate {
            equilibrate(&self.structure, &self.values, &mut self.scaled, &mut self.scale, largest);
            self.unit = 1.0;
        } else {
            self.structure.measure(&self.values, largest);
            self.structure.scale(&self.values, &mut self.scaled, &self.scale);
            self.unit = smallest_row(largest);
        }
        self.counters.factorisations += 1;
        self.pause = self.pause.saturating_sub(1);
        self.factored = true;
        let inertia = self.factor.factor(&self.scaled, &self.static_shifts, self.unit);
        if inertia.zero == 0 {
            return Ok(inertia);
        }
        // A zero pivot of a fixed order is no proof of a singular matrix: it may be an accident of the order.
        let unit = self.unit;
        Ok(self.pivoted()?.inertia(unit).unwrap_or(inertia))
    }

    /// The pivoted factorisation of the matrix last given to [`factor`](Self::factor).
    fn pivoted(&mut self) -> Result<&mut Pivoted, KktError> {
        let fallback = match &mut self.fallback {
            Some(fallback) => fallback,
            none => none.insert(Pivoted::new(&self.structure)?),
        };
        if !self.fallback_current {
            fallback.factor(&self.scaled, &self.static_shifts);
            self.fallback_current = true;
            self.counters.fallbacks += 1;
        }
        Ok(fallback)
    }

    /// Solves with the matrix last given to [`factor`](Self::factor), without the static shift. If refinement with
    /// the LDL^T factor misses the tolerance, the pivoted LBL^T factorisation continues from its best solution, unless it was of no use
    /// shortly before; the best solution met is returned with its true residual.
    ///
    /// # Errors
    /// No factor, slices not of length `n`, a right-hand side that is not finite.
    pub fn solve(&mut self, rhs: &[f64], solution: &mut [f64]) -> Result<SolveQuality, KktError> {
        self.solve_columns([rhs], [solution]).map(|[quality]| quality)
    }

    /// Solves with at most two right-hand sides, each as by [`solve`](Self::solve): both take less time than one after
    /// the other, as the factor is read once. More of them do not compile.
    ///
    /// # Errors
    /// As [`solve`](Self::solve), for any of them.
    pub fn solve_columns<const R: usize>(
        &mut self,
        rhs: [&[f64]; R],
        solutions: [&mut [f64]; R],
    ) -> Result<[SolveQuality; R], KktError> {
        let n = self.structure.n;
        if !self.factored {
            return Err(KktError::NotFactored);
        }
        for (rhs, solution) in rhs.iter().zip(&solutions) {
            if rhs.len() != n {
                return Err(KktError::Dimension { what: "rhs", found: rhs.len(), expected: n });
            }
            if solution.len() != n {
                return Err(KktError::Dimension { what: "solution", found: solution.len(), expected: n });
            }
            if !all_finite(rhs) {
                let index = rhs.iter().position(|v| !v.is_finite()).unwrap_or(0);
                return Err(KktError::NotFinite { what: "rhs", index });
            }
        }
        self.counters.solves += R;
        let mut units = [1.0; R];
        for ((scaled, rhs), unit) in self.rhs.iter_mut().zip(rhs).zip(&mut units) {
            for ((b, &row), &s) in scaled.iter_mut().zip(&self.order).zip(&self.scale) {
                *b = rhs[row as usize] * s;
            }
            // A right-hand side of about one keeps every norm in range; a power of two is free of rounding.
            let size = maximum(scaled);
            if size > 0.0 {
                *unit = power_of_two(size);
                let inverse = 1.0 / *unit;
                scaled.iter_mut().for_each(|b| *b *= inverse);
            }
        }
        let mut qualities = self.solve_scaled::<R>()?;
        let scaled = qualities.iter_mut().zip(&self.solution);
        for ((quality, scaled), (solution, unit)) in scaled.zip(solutions.into_iter().zip(units)) {
            self.counters.refinements += quality.refinements;
            for ((&x, &row), &s) in scaled.iter().zip(&self.order).zip(&self.scale) {
                solution[row as usize] = x * s * unit;
            }
            if quality.residual.is_nan() || !all_finite(solution) {
                quality.residual = f64::INFINITY;
            }
        }
        Ok(qualities)
    }

    /// `self.solution` from `self.rhs`, the first `R` of both, scaled and in elimination order.
    fn solve_scaled<const R: usize>(&mut self) -> Result<[SolveQuality; R], KktError> {
        let system = |rhs| System::new(&self.structure, &self.scaled, rhs, &self.static_shifts, self.unit);
        let systems = std::array::from_fn(|k| system(&self.rhs[k]));
        let direct: [Outcome; R] =
            self.refiner.solve(systems, &mut self.factor, first_columns(&mut self.solution));
        let mut qualities = direct.map(|direct| SolveQuality {
            residual: direct.residual,
            refinements: direct.solves.saturating_sub(1),
            fallback: false,
        });
        for k in (0..R).filter(|k| !direct[*k].converged) {
            if !self.fallback_current {
                if self.pause > 0 {
                    continue;
                }
                // Of no use until one of its solutions is.
                self.futile = (self.futile + 1).min(LONGEST_PAUSE);
                self.pause = 1 << self.futile;
            }
            self.pivoted()?;
            let Some(fallback) = &mut self.fallback else { continue };
            let (rhs, signs) = (&self.rhs[k], &self.static_shifts);
            let system = System::new(&self.structure, &self.scaled, rhs, signs, self.unit);
            let pivoted = self.refiner.resume(system, fallback, &mut self.solution[k]);
            qualities[k].residual = pivoted.residual;
            qualities[k].refinements += pivoted.solves;
            qualities[k].fallback = true;
            if pivoted.converged || pivoted.residual <= OF_USE * direct[k].residual {
                (self.futile, self.pause) = (0, 0);
            }
        }
        Ok(qualities)
    }

    /// Rows of the system.
    pub fn dimension(&self) -> usize {
        self.structure.n
    }

    /// Entries stored for the LDL^T factor.
    pub fn factor_nonzeros(&self) -> usize {
        self.factor.nonzeros()
    }

    /// Work done so far.
    pub fn counters(&self) -> KktCounters {
        self.counters
    }
}
