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

/// An operation with the slots of its operands and the first slot of its results.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Instruction {
    pub(crate) op: Op,
    pub(crate) target: u32,
    pub(crate) operands: [u32; 3],
    pub(crate) number: f64,
}

/// A straight-line program.
#[derive(Debug, Default)]
pub(crate) struct Program {
    pub(crate) instructions: Vec<Instruction>,
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

/// Numbers to which the workspace is aligned: a cache line.
const ALIGNMENT: usize = 8;

impl Program {
    /// Runs the program for `L` points at once. `input(k, lane)` is an input, and `output` gets all results with the number of the
    /// output; lanes of no use have any input.
    #[inline(always)]
    pub(crate) fn run<const L: usize>(
        &self,
        input: impl Fn(usize, usize) -> f64,
        mut output: impl FnMut(usize, &[f64; L]),
    ) {
        WORKSPACE.with_borrow_mut(|workspace| {
            let needed = self.slots * L + ALIGNMENT;
            if workspace.len() < needed {
                workspace.resize(needed, 0.0);
            }
            let start = workspace.as_ptr().align_offset(ALIGNMENT * size_of::<f64>()).min(ALIGNMENT);
            let (slots, _) = workspace[start..start + self.slots * L].as_chunks_mut::<L>();
            for &(k, slot) in &self.inputs {
                slots[slot as usize] = std::array::from_fn(|lane| input(k as usize, lane));
            }
            for instruction in &self.instructions {
                self.step(instruction, slots);
            }
            for (k, &slot) in self.outputs.iter().enumerate() {
                output(k, &slots[slot as usize]);
            }
        });
    }

    #[inline(always)]
    fn step<const L: usize>(&self, instruction: &Instruction, v: &mut [[f64; L]]) {
        let Instruction { op, target, operands: [i, j, k], number: n } = *instruction;
        let (t, i, j, k) = (target as usize, i as usize, j as usize, k as usize);
        macro_rules! lanes {
            (|$($x:ident = $place:ident),*| $result:expr) => {{
                $(let $x = v[$place];)*
                v[t] = std::array::from_fn(|l| { $(let $x = $x[l];)* $result });
            }};
        }
        match op {
            Op::Constant => v[t] = [n; L],
            Op::Add => lanes!(|a = i, b = j| a + b),
            Op::Sub => lanes!(|a = i, b = j| a - b),
            Op::Mul => lanes!(|a = i, b = j| a * b),
            Op::Div => lanes!(|a = i, b = j| a / b),
            Op::AddNumber => lanes!(|a = i| a + n),
            Op::MulNumber => lanes!(|a = i| a * n),
            Op::NumberSub => lanes!(|a = i| n - a),
            Op::DivNumber => lanes!(|a = i| a / n),
            Op::NumberDiv => lanes!(|a = i| n / a),
            Op::MulAdd => lanes!(|a = i, b = j, c = k| a * b + c),
            Op::MulSub => lanes!(|a = i, b = j, c = k| c - a * b),
            Op::MulNumberAdd => lanes!(|a = i, c = k| a * n + c),
            Op::Guarded => lanes!(|a = i, b = j| guarded(a, b)),
            Op::Unary(Unary::Neg) => lanes!(|a = i| -a),
            Op::Unary(Unary::Sqrt) => lanes!(|a = i| a.sqrt()),
            Op::Unary(Unary::Abs) => lanes!(|a = i| a.abs()),
            Op::Unary(Unary::Sign) => lanes!(|a = i| sign(a)),
            Op::SinCos => {
                let both = v[i].map(f64::sin_cos);
                let [sine, cosine, ..] = self.wide[t];
                v[sine as usize] = both.map(|(s, _)| s);
                v[cosine as usize] = both.map(|(_, c)| c);
            }
            Op::CurveJet => {
                let jets = v[i].map(|a| self.tables[k].curve_jet(a));
                for (part, &slot) in self.wide[t][..3].iter().enumerate() {
                    v[slot as usize] = jets.map(|jet| jet[part]);
                }
            }
            Op::SurfaceJet => {
                let (a, b) = (v[i], v[j]);
                let jets: [[f64; 6]; L] = std::array::from_fn(|l| self.tables[k].surface_jet(a[l], b[l]));
                for (part, &slot) in self.wide[t].iter().enumerate() {
                    v[slot as usize] = jets.map(|jet| jet[part]);
                }
            }
            Op::Curve(_) | Op::Surface(_) => {
                let (a, b, table) = (v[i], v[j], &*self.tables[k]);
                v[t] = std::array::from_fn(|l| op.apply([a[l], b[l], 0.0], n, Some(table)));
            }
            // What calls a scalar function lane by lane.
            _ => {
                let [a, b, c] = [i, j, k].map(|place| v[place]);
                v[t] = std::array::from_fn(|l| op.apply([a[l], b[l], c[l]], n, None));
            }
        }
    }
}
