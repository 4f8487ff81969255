//! Residuals: the difference of a value from its prediction, zigzagged, a byte each; what does not fit a byte goes to a second
//! stream of shorts.

use super::CodecError;

/// In the byte stream: look in the second one.
const ESCAPE: u8 = 255;

/// 0, -1, 1, -2, ... as 0, 1, 2, 3, ...
fn zigzag(value: i16) -> u16 {
    (value << 1 ^ value >> 15) as u16
}

fn unzigzag(code: u16) -> i16 {
    (code >> 1) as i16 ^ -((code & 1) as i16)
}

/// Collects residuals of up to 16 bits, which wrap.
#[derive(Default)]
pub(super) struct ResidualWriter {
    pub bytes: Vec<u8>,
    pub escaped: Vec<u16>,
}

impl ResidualWriter {
    pub fn with_capacity(count: usize) -> ResidualWriter {
        ResidualWriter { bytes: Vec::with_capacity(count), escaped: Vec::new() }
    }

    pub fn push(&mut self, residual: i16) {
        let code = zigzag(residual);
        if code < u16::from(ESCAPE) {
            self.bytes.push(code as u8);
        } else {
            self.bytes.push(ESCAPE);
            self.escaped.push(code);
        }
    }
}

/// Reads them again.
pub(super) struct ResidualReader<'a> {
    bytes: std::slice::Iter<'a, u8>,
    escaped: std::slice::Iter<'a, [u8; 2]>,
}

impl<'a> ResidualReader<'a> {
    pub fn new(bytes: &'a [u8], escaped: &'a [u8]) -> ResidualReader<'a> {
        ResidualReader { bytes: bytes.iter(), escaped: escaped.as_chunks().0.iter() }
    }

    pub fn next(&mut self) -> Result<i16, CodecError> {
        const DAMAGED: CodecError = CodecError::Damaged("residuals");
        match *self.bytes.next().ok_or(DAMAGED)? {
            ESCAPE => Ok(unzigzag(u16::from_le_bytes(*self.escaped.next().ok_or(DAMAGED)?))),
            code => Ok(unzigzag(u16::from(code))),
        }
    }
}

/// Bits that an ideal coder without context needs for these bytes: the measure by which predictors are chosen.
pub(super) fn entropy_bits(bytes: &[u8]) -> f64 {
    let mut counts = [0_u32; 256];
    for &byte in bytes {
        counts[usize::from(byte)] += 1;
    }
    let total = bytes.len() as f64;
    counts.iter().filter(|&&count| count > 0).map(|&count| -f64::from(count) * (f64::from(count) / total).log2()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_residual_comes_back() {
        let mut writer = ResidualWriter::default();
        (i16::MIN..=i16::MAX).for_each(|value| writer.push(value));
        let escaped: Vec<u8> = writer.escaped.iter().flat_map(|code| code.to_le_bytes()).collect();
        let mut reader = ResidualReader::new(&writer.bytes, &escaped);
        assert!((i16::MIN..=i16::MAX).all(|value| reader.next() == Ok(value)));
        assert!(reader.next().is_err());
    }
}
