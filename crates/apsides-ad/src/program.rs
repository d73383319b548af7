//! Straight-line programs over slots, for one point or for several in lanes.
//!
//! Each instruction reads slots and writes slots, and no slot is read before it is written, so that nothing is cleared. Slots whose
//! number is not needed any more are used again. All lane counts do the same operations in the same order, without fused
//! multiplication and addition, and call the same scalar functions: results do not depend on lanes or on the machine's vector
//! instructions.
//!
//! Slots stand in a workspace of the thread, which grows to the largest program that the thread has run: after that nothing is
//! allocated.

use std::cell::RefCell;
use std::sync::Arc;

use pulp::{Arch, Simd, WithSimd};

use crate::Scalar;
use crate::formula::Unary;
use crate::scalar::{follows, guarded, ln_or_zero, precedes, sign};
use crate::table::Table;

/// An operation on up to three operands `a`, `b`, `c` and a number `n`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Op {
    /// Input `a`; no instruction.
    Input,
    /// `n`.
    Constant,
    /// `a + b`.
    Add,
    /// `a - b`.
    Sub,
    /// `a b`.
    Mul,
    /// `a / b`.
    Div,
    /// `a b`, zero where `a` is zero.
    Guarded,
    /// A function of `a`.
    Unary(Unary),
    /// Integer power of `a`.
    Powi(i32),
    /// `a^n`.
    Powf,
    /// `b / c` where the power `a` of `c` is a normal number, else `c^n`.
    LowerPower,
    /// `a^b`.
    Pow,
    /// Logarithm of `a`, zero at zero.
    LnOrZero,
    /// Angle of the point `(b, a)`.
    Atan2,
    /// The smaller one.
    Min,
    /// The larger one.
    Max,
    /// One where `a` is the smaller, else zero.
    IsMin,
    /// One where `a` is the larger, else zero.
    IsMax,
    /// One where `a` is at least zero, else zero.
    IsNonNegative,
    /// `b` where `a` is at least zero, else `c`.
    Select,
    /// Derivative of a number of a table, which is `c`, at `a`.
    Curve(u8),
    /// Part of a number of the derivatives of a table, which is `c`, at `a` and `b`.
    Surface(u8),
    /// `a + n`.
    AddNumber,
    /// `a n`.
    MulNumber,
    /// `n - a`.
    NumberSub,
    /// `a / n`.
    DivNumber,
    /// `n / a`.
    NumberDiv,
    /// `a b + c`.
    MulAdd,
    /// `c - a b`.
    MulSub,
    /// `a n + c`.
    MulNumberAdd,
    /// Sine and cosine of `a`; the target is a place in [`Program::wide`], as of the next ones.
    SinCos,
    /// Value and derivatives of a table, which is `c`, at `a`.
    CurveJet,
    /// Value and derivatives of a table, which is `c`, at `a` and `b`.
    SurfaceJet,
}

/// The slots of an operation's operands and result.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Instruction {
    pub(crate) target: u32,
    pub(crate) operands: [u32; 3],
    pub(crate) number: f64,
}

/// A straight-line program.
#[derive(Debug, Default)]
pub(crate) struct Program {
    pub(crate) instructions: Vec<Instruction>,
    /// Operations with the numbers of instructions in a row that they have.
    pub(crate) runs: Vec<(Op, usize)>,
    /// Slots of the results of operations with several.
    pub(crate) wide: Vec<[u32; 6]>,
    /// Inputs that the program needs, with their slots.
    pub(crate) inputs: Vec<(u32, u32)>,
    /// Slot of each output.
    pub(crate) outputs: Vec<u32>,
    pub(crate) slots: usize,
    pub(crate) tables: Arc<[Arc<Table>]>,
}

impl Op {
    /// Number of operands that are values.
    pub(crate) fn arity(self) -> usize {
        match self {
            Self::Input | Self::Constant => 0,
            Self::Unary(_)
            | Self::Powi(_)
            | Self::Powf
            | Self::LnOrZero
            | Self::IsNonNegative
            | Self::Curve(_)
            | Self::AddNumber
            | Self::MulNumber
            | Self::NumberSub
            | Self::DivNumber
            | Self::NumberDiv
            | Self::SinCos
            | Self::CurveJet => 1,
            Self::Add
            | Self::Sub
            | Self::Mul
            | Self::Div
            | Self::Guarded
            | Self::Pow
            | Self::Atan2
            | Self::Min
            | Self::Max
            | Self::IsMin
            | Self::IsMax
            | Self::Surface(_)
            | Self::SurfaceJet => 2,
            Self::LowerPower | Self::Select | Self::MulAdd | Self::MulSub => 3,
            // `b` is free.
            Self::MulNumberAdd => 3,
        }
    }

    /// The result of an operation with one; `table` is that which it looks up.
    #[inline]
    pub(crate) fn apply(self, [a, b, c]: [f64; 3], n: f64, table: Option<&Table>) -> f64 {
        match self {
            Self::Constant => n,
            Self::Add => a + b,
            Self::Sub => a - b,
            Self::Mul => a * b,
            Self::Div => a / b,
            Self::Guarded => guarded(a, b),
            Self::Unary(f) => f.apply(a),
            Self::Powi(n) => a.powi(n),
            Self::Powf => a.powf(n),
            Self::LowerPower => {
                if a.is_normal() {
                    b / c
                } else {
                    c.powf(n)
                }
            }
            Self::Pow => a.powf(b),
            Self::LnOrZero => ln_or_zero(a),
            Self::Atan2 => a.atan2(b),
            Self::Min => Scalar::min(a, b),
            Self::Max => Scalar::max(a, b),
            Self::IsMin => indicator(precedes(a, b), a + b),
            Self::IsMax => indicator(follows(a, b), a + b),
            Self::IsNonNegative => indicator(a >= 0.0, a),
            Self::Select => a.select(b, c),
            Self::Curve(k) => table.map_or(f64::NAN, |t| t.curve_jet(a)[usize::from(k)]),
            Self::Surface(k) => table.map_or(f64::NAN, |t| t.surface_jet(a, b)[usize::from(k)]),
            Self::AddNumber => a + n,
            Self::MulNumber => a * n,
            Self::NumberSub => n - a,
            Self::DivNumber => a / n,
            Self::NumberDiv => n / a,
            Self::MulAdd => a * b + c,
            Self::MulSub => c - a * b,
            Self::MulNumberAdd => a * n + c,
            Self::Input | Self::SinCos | Self::CurveJet | Self::SurfaceJet => f64::NAN,
        }
    }
}

/// One or zero, NaN where the numbers that the condition is made of are not.
#[inline]
fn indicator(condition: bool, of: f64) -> f64 {
    if of.is_nan() {
        of
    } else if condition {
        1.0
    } else {
        0.0
    }
}

thread_local! {
    static WORKSPACE: RefCell<Vec<f64>> = const { RefCell::new(Vec::new()) };
}

/// Points at once: a cache line of numbers, to which the workspace is aligned.
pub(crate) const LANES: usize = 8;

/// Fewer points are computed one by one; more fill a pass whose other lanes repeat the last.
const WORTH_LANES: usize = 3;

/// The results of a program at one point.
pub(crate) struct Results<'a> {
    outputs: &'a [u32],
    slots: &'a [f64],
    lanes: usize,
    lane: usize,
}

impl Results<'_> {
    /// All of them in their order.
    #[inline(always)]
    pub(crate) fn iter(&self) -> impl Iterator<Item = f64> + '_ {
        self.outputs.iter().map(|&slot| self.slots[slot as usize * self.lanes + self.lane])
    }

    /// Writes those from a number on.
    #[inline(always)]
    pub(crate) fn write(&self, first: usize, target: &mut [f64]) {
        for (number, &slot) in target.iter_mut().zip(&self.outputs[first..]) {
            *number = self.slots[slot as usize * self.lanes + self.lane];
        }
    }
}

/// A program with its points.
struct Run<'a, I, O> {
    program: &'a Program,
    points: usize,
    slots: &'a mut [f64],
    input: I,
    output: O,
}

impl<I: Fn(usize, usize) -> f64, O: FnMut(usize, Results<'_>)> WithSimd for Run<'_, I, O> {
    type Output = ();

    /// The vector instructions follow from the target features of the caller alone.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.call();
    }
}

impl<I: Fn(usize, usize) -> f64, O: FnMut(usize, Results<'_>)> Run<'_, I, O> {
    #[inline(always)]
    fn call(mut self) {
        let mut first = 0;
        while self.points - first >= WORTH_LANES {
            self.pass::<LANES>(first);
            first = (first + LANES).min(self.points);
        }
        for point in first..self.points {
            self.pass::<1>(point);
        }
    }

    /// Computes `L` points, or those that are left.
    #[inline(always)]
    fn pass<const L: usize>(&mut self, first: usize) {
        let (slots, _) = self.slots.as_chunks_mut::<L>();
        let last = self.points - 1;
        for &(k, slot) in &self.program.inputs {
            slots[slot as usize] =
                std::array::from_fn(|lane| (self.input)(k as usize, (first + lane).min(last)));
        }
        let mut rest = self.program.instructions.as_slice();
        for &(op, count) in &self.program.runs {
            let (run, after) = rest.split_at(count);
            self.program.step(op, run, slots);
            rest = after;
        }
        for lane in 0..L.min(self.points - first) {
            let results = Results { outputs: &self.program.outputs, slots: self.slots, lanes: L, lane };
            (self.output)(first + lane, results);
        }
    }
}

impl Program {
    /// Runs the program at several points. `input(k, point)` is an input, and `output(point, results)` gets the results of each point.
    pub(crate) fn run(
        &self,
        points: usize,
        input: impl Fn(usize, usize) -> f64,
        output: impl FnMut(usize, Results<'_>),
    ) {
        WORKSPACE.with_borrow_mut(|workspace| {
            let needed = self.slots * LANES + LANES;
            if workspace.len() < needed {
                workspace.resize(needed, 0.0);
            }
            let start = workspace.as_ptr().align_offset(LANES * size_of::<f64>()).min(LANES);
            let slots = &mut workspace[start..start + self.slots * LANES];
            let run = Run { program: self, points, slots, input, output };
            // A single point gains nothing from vector instructions.
            if points < WORTH_LANES { run.call() } else { Arch::new().dispatch(run) }
        });
    }

    /// Runs instructions of one operation.
    #[inline(always)]
    fn step<const L: usize>(&self, op: Op, run: &[Instruction], v: &mut [[f64; L]]) {
        macro_rules! each {
            (|$t:ident, $i:ident, $j:ident, $k:ident, $n:ident| $body:expr) => {
                for &Instruction { target, operands: [$i, $j, $k], number: $n } in run {
                    let ($t, $i, $j, $k) = (target as usize, $i as usize, $j as usize, $k as usize);
                    $body
                }
            };
        }
        macro_rules! lanes {
            (|$a:ident, $n:ident| $result:expr) => {
                each!(|t, i, _j, _k, $n| {
                    let $a = v[i];
                    v[t] = std::array::from_fn(|l| {
                        let $a = $a[l];
                        $result
                    });
                })
            };
            (|$a:ident, $b:ident, _| $result:expr) => {
                each!(|t, i, j, _k, _n| {
                    let ($a, $b) = (v[i], v[j]);
                    v[t] = std::array::from_fn(|l| {
                        let ($a, $b) = ($a[l], $b[l]);
                        $result
                    });
                })
            };
            (|$a:ident, $b:ident, $c:ident, $n:ident| $result:expr) => {
                each!(|t, i, j, k, $n| {
                    let ($a, $b, $c) = (v[i], v[j], v[k]);
                    v[t] = std::array::from_fn(|l| {
                        let ($a, $b, $c) = ($a[l], $b[l], $c[l]);
                        $result
                    });
                })
            };
        }
        match op {
            Op::Constant => each!(|t, _i, _j, _k, n| v[t] = [n; L]),
            Op::Add => lanes!(|a, b, _| a + b),
            Op::Sub => lanes!(|a, b, _| a - b),
            Op::Mul => lanes!(|a, b, _| a * b),
            Op::Div => lanes!(|a, b, _| a / b),
            Op::AddNumber => lanes!(|a, n| a + n),
            Op::MulNumber => lanes!(|a, n| a * n),
            Op::NumberSub => lanes!(|a, n| n - a),
            Op::DivNumber => lanes!(|a, n| a / n),
            Op::NumberDiv => lanes!(|a, n| n / a),
            Op::MulAdd => lanes!(|a, b, c, _n| a * b + c),
            Op::MulSub => lanes!(|a, b, c, _n| c - a * b),
            Op::MulNumberAdd => each!(|t, i, _j, k, n| {
                let (a, c) = (v[i], v[k]);
                v[t] = std::array::from_fn(|l| a[l] * n + c[l]);
            }),
            Op::Guarded => lanes!(|a, b, _| guarded(a, b)),
            Op::Unary(Unary::Neg) => lanes!(|a, _n| -a),
            Op::Unary(Unary::Sqrt) => lanes!(|a, _n| a.sqrt()),
            Op::Unary(Unary::Abs) => lanes!(|a, _n| a.abs()),
            Op::Unary(Unary::Sign) => lanes!(|a, _n| sign(a)),
            Op::SinCos => each!(|t, i, _j, _k, _n| {
                let both = v[i].map(f64::sin_cos);
                let [sine, cosine, ..] = self.wide[t];
                v[sine as usize] = both.map(|(s, _)| s);
                v[cosine as usize] = both.map(|(_, c)| c);
            }),
            Op::CurveJet => each!(|t, i, _j, k, _n| {
                let jets = v[i].map(|a| self.tables[k].curve_jet(a));
                for (part, &slot) in self.wide[t][..3].iter().enumerate() {
                    v[slot as usize] = jets.map(|jet| jet[part]);
                }
            }),
            Op::SurfaceJet => each!(|t, i, j, k, _n| {
                let (a, b) = (v[i], v[j]);
                let jets: [[f64; 6]; L] = std::array::from_fn(|l| self.tables[k].surface_jet(a[l], b[l]));
                for (part, &slot) in self.wide[t].iter().enumerate() {
                    v[slot as usize] = jets.map(|jet| jet[part]);
                }
            }),
            Op::Curve(_) | Op::Surface(_) => each!(|t, i, j, k, n| {
                let (a, b, table) = (v[i], v[j], &*self.tables[k]);
                v[t] = std::array::from_fn(|l| op.apply([a[l], b[l], 0.0], n, Some(table)));
            }),
            // What calls a scalar function lane by lane.
            _ => lanes!(|a, b, c, n| op.apply([a, b, c], n, None)),
        }
    }
}
