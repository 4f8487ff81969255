//! Residuals for the dense profile and for small patches: each by decisions that learn, so that there are no tables to send.
//!
//! A residual is coded as whether it is zero, its sign, the place of its highest bit in unary, and the bits below. Every decision
//! mixes what several contexts have seen ([`super::mix`]): how large the neighbours' residuals were (as in CALIC: Wu, Memon, Context-based,
//! adaptive, lossless image coding, 1997, §IV), their signs, the channels before, and where other predictions would lie.

use super::bits::{Bits, Probability};
use super::mix::{CONTEXTS, Seen, Weights, decide};
use super::residual::{Predictor, Range, mean, zigzag};
use super::segments::{Around, Segment};

/// Sizes of the neighbours' residuals told apart, and a last one for samples without neighbours.
const LEVELS: usize = 17;
/// Sizes of the channel before.
const LINKS: usize = 5;
/// Contexts of one kind, at most.
const TABLE: usize = 1024;
/// Decisions of a residual that are mixed: whether it is zero, its sign, and the place of its highest bit.
const NODES: usize = PLACE + PLACES;
const ZERO: usize = 0;
const SIGN: usize = 1;
const PLACE: usize = 2;
/// Places told apart.
const PLACES: usize = 14;
/// Sets of weights: samples without all neighbours, and by a quarter of the levels of the others.
const SETS: usize = 1 + LEVELS / 4;
/// The largest activity told apart where it is one of several things, and where it is one of two.
const MOST_ACTIVE: [u8; 2] = [5, 7];

/// What a channel has learned.
struct Channel {
    /// By kind of context, context and decision.
    seen: Vec<Seen>,
    weights: [[Weights; NODES]; SETS],
    /// The two bits below the highest, by its place; the second one by the first one too.
    below_highest: [[[Probability; 3]; PLACES]; SETS],
}

impl Channel {
    fn new() -> Channel {
        let seen = vec![Seen::default(); CONTEXTS * TABLE * NODES];
        Channel {
            seen,
            weights: [[Weights::NEW; NODES]; SETS],
            below_highest: [[[Probability::EVEN; 3]; PLACES]; SETS],
        }
    }

    /// Codes a residual.
    #[inline(always)]
    fn code(&mut self, bits: &mut impl Bits, contexts: [usize; CONTEXTS], set: usize, residual: i16) -> i16 {
        let contexts = std::array::from_fn(|kind| (kind * TABLE + contexts[kind]) * NODES);
        let (seen, weights) = (self.seen.as_mut_slice(), &mut self.weights[set]);
        let below_highest = &mut self.below_highest[set];
        let mut bit =
            |bits: &mut _, node: usize, decision| decide(bits, seen, &contexts, node, &mut weights[node], decision);
        if bit(bits, ZERO, residual == 0) {
            return 0;
        }
        let negative = bit(bits, SIGN, residual < 0);
        // From 1 to 32768.
        let size = u32::from(residual.unsigned_abs()).max(1);
        let known = size.ilog2() as usize;
        let mut place = 0;
        while place < 15 && bit(bits, PLACE + place.min(PLACES - 1), place < known) {
            place += 1;
        }
        let mut read = 1_u32;
        for below in (0..place).rev() {
            let decision = size >> below & 1 == 1;
            let bit = match place - below {
                1 => bits.bit(&mut below_highest[place.min(PLACES - 1)][0], decision),
                2 => bits.bit(&mut below_highest[place.min(PLACES - 1)][1 + (read & 1) as usize], decision),
                _ => bits.bit(&mut Probability::EVEN.clone(), decision),
            };
            read = read << 1 | u32::from(bit);
        }
        let size = read as u16 as i16;
        if negative { size.wrapping_neg() } else { size }
    }
}

/// The level of a sum of four neighbours' codes: about twice as fine as powers of two.
#[inline(always)]
fn level(sum: u32) -> usize {
    let place = (sum | 1).ilog2();
    let fine = 2 * place as usize + (sum >> place.saturating_sub(1) & 1) as usize;
    if sum < 4 { sum as usize } else { fine.min(LEVELS - 2) }
}

/// Steps of a signed value: 13, the middle one 0.
const STEPS: usize = 13;

/// From here on, values are of one step.
const LARGE: i16 = 21;
/// The step of each value from `-LARGE` to `LARGE`.
static STEP: [u8; 2 * LARGE as usize + 1] = steps();

const fn steps() -> [u8; 2 * LARGE as usize + 1] {
    let mut steps = [0; 2 * LARGE as usize + 1];
    let mut value = -LARGE;
    while value <= LARGE {
        let size = match value.unsigned_abs() {
            0 => 0,
            1 => 1,
            2 => 2,
            3..=4 => 3,
            5..=9 => 4,
            10..=20 => 5,
            _ => 6,
        };
        steps[(value + LARGE) as usize] = if value < 0 { 6 - size } else { 6 + size };
        value += 1;
    }
    steps
}

#[inline(always)]
fn step(value: i16) -> usize {
    usize::from(STEP[(value.clamp(-LARGE, LARGE) + LARGE) as usize])
}

/// What surrounds a sample, in one channel.
#[derive(Debug, Clone, Copy)]
struct Neighbourhood {
    /// Values to the left, above, above to the left and above to the right, and what they predict.
    values: [i16; 4],
    predicted: i16,
    /// Residuals to the left, above, and above to the right.
    residuals: [i16; 3],
    around: Around,
    /// See [`code`].
    activity: u8,
}

impl Neighbourhood {
    /// The size of the residuals.
    #[inline(always)]
    fn level(&self) -> usize {
        let [left, up, right] = self.residuals.map(|residual| u32::from(zigzag(residual)));
        match self.around {
            Around::Nothing | Around::Anchor => LEVELS - 1,
            _ => level(2 * left + up + right),
        }
    }

    /// The contexts of this sample, and the set of weights. `before` are the residuals of the channel before and of the one before that,
    /// if there are any.
    #[inline(always)]
    fn contexts(&self, level: usize, before: Option<[i16; 2]>) -> [usize; CONTEXTS] {
        let [left, up, corner, right] = self.values;
        let [left_residual, up_residual, _] = self.residuals;
        let all = usize::from(self.around == Around::All);
        let pair = |a: i16, b: i16| step(a) * STEPS + step(b);
        let toward = |value: i16| value.wrapping_sub(self.predicted);
        let activity = MOST_ACTIVE.map(|most| usize::from(self.activity.min(most)));
        let (last, link, channels) = match before {
            None => (0, 0, pair(up.wrapping_sub(corner), left.wrapping_sub(corner))),
            Some([last, older]) => (last, link(last), pair(last, older) * LEVEL_THIRDS + level / 3),
        };
        [
            (level * LINKS + link) * 2 + all,
            pair(left_residual, up_residual) * (usize::from(MOST_ACTIVE[0]) + 1) + activity[0],
            channels,
            pair(toward(left), toward(up)) * LINKS + link,
            (activity[1] * LEVELS + level) * LINKS + link,
            pair(toward(right), last) * LEVEL_THIRDS + level / 3,
        ]
    }
}

/// Levels where three are taken as one.
const LEVEL_THIRDS: usize = LEVELS.div_ceil(3);

/// How large the residual of the channel before was.
#[inline(always)]
fn link(residual: i16) -> usize {
    ((u32::from(zigzag(residual)) + 1).ilog2() as usize).div_ceil(2).min(LINKS - 2) + 1
}

/// Codes a plane; a reader fills it. `activity` of each sample is how large its residuals were in the planes before, as logarithms, the
/// older ones halved; this plane's are added. What neighbours predict of a sample, `better` may better, by its rank and those to the left and above.
pub(super) fn code<const N: usize, B: Bits>(
    bits: &mut B,
    values: &mut [[i16; N]],
    segments: &[Segment],
    (predictor, range): (Predictor, Range),
    activity: &mut [u8],
    mut better: impl FnMut(usize, i16, [i16; 2]) -> i16,
) {
    let mut channels: [Channel; N] = std::array::from_fn(|_| Channel::new());
    let mut residuals = vec![[0_i16; N]; values.len()];
    for segment in segments {
        let around = segment.around;
        for (column, rank) in segment.ranks().enumerate() {
            let near = segment.near(column);
            let mut before = None;
            let mut sizes = 0;
            for channel in 0..N {
                let near_values = near.map(|rank| if around == Around::Nothing { 0 } else { values[rank][channel] });
                let [left, up, corner, _] = near_values;
                let predicted = match around {
                    Around::All => predictor.predict(left, up, corner),
                    Around::LeftUp => mean(left, up),
                    _ => left,
                };
                let predicted = better(rank, predicted, [left, up]);
                let near_residuals = [near[0], near[1], near[3]].map(|rank| residuals[rank][channel]);
                let activity = activity[rank];
                let here =
                    Neighbourhood { values: near_values, predicted, residuals: near_residuals, around, activity };
                let level = here.level();
                let set = if around == Around::All { 1 + level / 4 } else { 0 };
                let residual = range.residual(values[rank][channel].wrapping_sub(predicted));
                let residual = channels[channel].code(bits, here.contexts(level, before), set, residual);
                values[rank][channel] = range.value(predicted.wrapping_add(residual));
                residuals[rank][channel] = residual;
                before = Some([residual, before.map_or(0, |[last, _]| last)]);
                sizes += u32::from(residual.unsigned_abs());
            }
            activity[rank] = activity[rank] / 2 + (sizes + 1).ilog2() as u8;
        }
    }
}
