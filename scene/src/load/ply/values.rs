//! What follows the header of a PLY file.

use std::str::SplitAsciiWhitespace;

use super::header::Type;

/// The values after the header, one after another.
pub(super) enum Values<'a> {
    Ascii(SplitAsciiWhitespace<'a>),
    Binary { bytes: &'a [u8], big_endian: bool },
}

impl Values<'_> {
    /// The next value; every type fits an f64 exactly.
    pub fn next(&mut self, kind: Type) -> Result<f64, &'static str> {
        match self {
            Values::Ascii(words) => {
                let word = words.next().ok_or("the file ends too early")?;
                word.parse().map_err(|_| "a value is not a number")
            }
            Values::Binary { bytes, big_endian } => {
                let (value, rest) = bytes.split_at_checked(kind.bytes()).ok_or("the file ends too early")?;
                *bytes = rest;
                let mut b = [0_u8; 8];
                b[..value.len()].copy_from_slice(value);
                if *big_endian {
                    b[..value.len()].reverse();
                }
                let low = u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
                Ok(match kind {
                    Type::I8 => f64::from(b[0] as i8),
                    Type::U8 => f64::from(b[0]),
                    Type::I16 => f64::from(low as i16),
                    Type::U16 => f64::from(low as u16),
                    Type::I32 => f64::from(low as i32),
                    Type::U32 => f64::from(low),
                    Type::F32 => f64::from(f32::from_bits(low)),
                    Type::F64 => f64::from_le_bytes(b),
                })
            }
        }
    }

    /// A list's length: a whole number.
    pub fn length(&mut self, kind: Type) -> Result<u64, &'static str> {
        let length = self.next(kind)?;
        if length >= 0.0 && length.fract() == 0.0 {
            Ok(length as u64)
        } else {
            Err("a list's length is no whole number")
        }
    }
}
