//! Residuals for the fast coder: a byte each, channel after channel, which zstd packs; what does not fit a byte follows as
//! shorts.

use super::CodecError;
use super::residual::{unzigzag, zigzag};
use super::streams::{StreamIter, StreamWriter};

/// A symbol that says: the residual is among the wide ones.
const ESCAPE: u8 = 255;

/// Appends the streams of a plane: one of each channel, then the wide residuals.
pub(super) fn write<const N: usize>(residuals: &[[i16; N]], out: &mut StreamWriter) {
    let mut wide = Vec::new();
    for channel in 0..N {
        let code = |residual: &[i16; N]| zigzag(residual[channel]);
        let symbols: Vec<u8> = residuals.iter().map(|residual| code(residual).min(ESCAPE.into()) as u8).collect();
        let escaped = symbols.iter().zip(residuals).filter(|(symbol, _)| **symbol == ESCAPE);
        wide.extend(escaped.map(|(_, residual)| code(residual)));
        out.push(&symbols);
    }
    out.push_shorts(&wide);
}

/// Fills a plane with the residuals of [`write`].
pub(super) fn read<const N: usize>(residuals: &mut [[i16; N]], streams: &mut StreamIter) -> Result<(), CodecError> {
    const DAMAGED: CodecError = CodecError::Damaged("residuals");
    let mut channels = [[].as_slice(); N];
    for channel in &mut channels {
        *channel = streams.next_of(residuals.len())?;
    }
    for (rank, residual) in residuals.iter_mut().enumerate() {
        *residual = channels.map(|symbols| unzigzag(symbols[rank].into()));
    }
    let mut wide = streams.next()?.as_chunks().0.iter();
    for (channel, symbols) in channels.iter().enumerate() {
        for (rank, _) in symbols.iter().enumerate().filter(|(_, symbol)| **symbol == ESCAPE) {
            residuals[rank][channel] = unzigzag(u16::from_le_bytes(*wide.next().ok_or(DAMAGED)?));
        }
    }
    if wide.len() == 0 { Ok(()) } else { Err(DAMAGED) }
}
