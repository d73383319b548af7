//! Stored numbers: their types, byte order and the values that stand for gaps.

/// Type of a stored number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sample {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    F32,
    F64,
}

impl Sample {
    /// Size, bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Sample::U8 | Sample::I8 => 1,
            Sample::U16 | Sample::I16 => 2,
            Sample::U32 | Sample::I32 | Sample::F32 => 4,
            Sample::F64 => 8,
        }
    }

    /// True for IEEE 754 numbers.
    pub(super) fn is_real(self) -> bool {
        matches!(self, Sample::F32 | Sample::F64)
    }

    /// The integer type of `bits` bits.
    pub(super) fn integer(bits: u64, signed: bool) -> Option<Sample> {
        Some(match (bits, signed) {
            (8, false) => Sample::U8,
            (8, true) => Sample::I8,
            (16, false) => Sample::U16,
            (16, true) => Sample::I16,
            (32, false) => Sample::U32,
            (32, true) => Sample::I32,
            _ => return None,
        })
    }

    /// The IEEE 754 type of `bits` bits.
    pub(super) fn real(bits: u64) -> Option<Sample> {
        match bits {
            32 => Some(Sample::F32),
            64 => Some(Sample::F64),
            _ => None,
        }
    }

    /// `value` as a number of this type would hold it: the value for gaps is written in decimal, the pixels are not.
    pub(super) fn nearest(self, value: f64) -> f64 {
        if self == Sample::F32 { f64::from(value as f32) } else { value }
    }

    /// The number whose bits are the lowest of `bits`.
    pub(super) fn of_bits(self, bits: u64) -> f64 {
        match self {
            Sample::U8 => f64::from(bits as u8),
            Sample::I8 => f64::from(bits as u8 as i8),
            Sample::U16 => f64::from(bits as u16),
            Sample::I16 => f64::from(bits as u16 as i16),
            Sample::U32 => f64::from(bits as u32),
            Sample::I32 => f64::from(bits as u32 as i32),
            Sample::F32 => f64::from(f32::from_bits(bits as u32)),
            Sample::F64 => f64::from_bits(bits),
        }
    }

    /// Numbers from `bytes`, whose length is a multiple of the size, into `out`.
    pub(super) fn decode(self, bytes: &[u8], order: Order, out: &mut [f64]) {
        match self {
            Sample::U8 => each(bytes, order, out, |[b]: [u8; 1]| b.into()),
            Sample::I8 => each(bytes, order, out, |b| i8::from_le_bytes(b).into()),
            Sample::U16 => each(bytes, order, out, |b| u16::from_le_bytes(b).into()),
            Sample::I16 => each(bytes, order, out, |b| i16::from_le_bytes(b).into()),
            Sample::U32 => each(bytes, order, out, |b| u32::from_le_bytes(b).into()),
            Sample::I32 => each(bytes, order, out, |b| i32::from_le_bytes(b).into()),
            Sample::F32 => each(bytes, order, out, |b| f32::from_le_bytes(b).into()),
            Sample::F64 => each(bytes, order, out, f64::from_le_bytes),
        }
    }
}

/// Numbers of `N` bytes, given to `number` in little-endian order.
fn each<const N: usize>(bytes: &[u8], order: Order, out: &mut [f64], number: impl Fn([u8; N]) -> f64) {
    for (value, stored) in out.iter_mut().zip(bytes.as_chunks::<N>().0) {
        let mut stored = *stored;
        if order == Order::Big {
            stored.reverse();
        }
        *value = number(stored);
    }
}

/// Byte order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    Little,
    Big,
}

impl Order {
    /// The order of this computer.
    pub(super) const NATIVE: Order = if cfg!(target_endian = "big") { Order::Big } else { Order::Little };

    /// Up to eight bytes as an unsigned number.
    pub(super) fn bits(self, bytes: &[u8]) -> u64 {
        let join = |bits: u64, byte: &u8| (bits << 8) | u64::from(*byte);
        match self {
            Order::Little => bytes.iter().rev().fold(0, join),
            Order::Big => bytes.iter().fold(0, join),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_become_numbers_in_both_orders() {
        let mut out = [0.0; 1];
        for (sample, little, value) in [
            (Sample::I8, vec![0xfe], -2.0),
            (Sample::U16, vec![0x34, 0x12], 4660.0),
            (Sample::I16, vec![0x01, 0x80], -32767.0),
            (Sample::I32, vec![0xff; 4], -1.0),
            (Sample::U32, vec![0xff; 4], 4294967295.0),
            (Sample::F32, 1.5f32.to_le_bytes().to_vec(), 1.5),
            (Sample::F64, (-0.1f64).to_le_bytes().to_vec(), -0.1),
        ] {
            sample.decode(&little, Order::Little, &mut out);
            assert_eq!(out[0], value);
            let big: Vec<u8> = little.iter().rev().copied().collect();
            sample.decode(&big, Order::Big, &mut out);
            assert_eq!(out[0], value);
        }
    }

    #[test]
    fn a_decimal_gap_value_matches_its_single_precision_form() {
        assert_eq!(Sample::F32.nearest(-3.4028226550889045e38), f64::from(f32::from_bits(0xff7f_fffb)));
        assert_eq!(Sample::F64.nearest(0.1), 0.1);
    }
}
