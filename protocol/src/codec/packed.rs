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
        let symbols = out.push_with(residuals.iter().map(|residual| code(residual).min(ESCAPE.into()) as u8));
        escapes(symbols, |rank| wide.push(code(&residuals[rank])));
    }
    out.push_shorts(&wide);
}

/// The residuals of [`write`], `count` of each channel.
pub(super) fn read<const N: usize>(count: usize, streams: &mut StreamIter) -> Result<Vec<[i16; N]>, CodecError> {
    const DAMAGED: CodecError = CodecError::Damaged("residuals");
    let mut channels = [[].as_slice(); N];
    for channel in &mut channels {
        *channel = streams.next_of(count)?;
    }
    let residual = |rank: usize| std::array::from_fn(|channel| unzigzag(channels[channel][rank].into()));
    let mut residuals: Vec<[i16; N]> = (0..count).map(residual).collect();
    let mut wide = streams.next()?.as_chunks().0.iter();
    let mut missing = false;
    for (channel, symbols) in channels.iter().enumerate() {
        escapes(symbols, |rank| match wide.next() {
            Some(&code) => residuals[rank][channel] = unzigzag(u16::from_le_bytes(code)),
            None => missing = true,
        });
    }
    if missing || wide.len() > 0 { Err(DAMAGED) } else { Ok(residuals) }
}

/// Hands the rank of each escape to `take`. Stretches without one are passed over at once.
fn escapes(symbols: &[u8], mut take: impl FnMut(usize)) {
    const STRETCH: usize = 64;
    for (index, stretch) in symbols.chunks(STRETCH).enumerate() {
        if stretch.iter().fold(false, |any, &symbol| any | (symbol == ESCAPE)) {
            let ranks = stretch.iter().enumerate().filter(|(_, symbol)| **symbol == ESCAPE);
            ranks.for_each(|(rank, _)| take(index * STRETCH + rank));
        }
    }
}
