//! The mask: which pixels hold a sample, by an adaptive binary coder whose context is the ten pixels nearest in this row and the
//! two above (the template of JBIG, ITU-T T.82, §6.7.1). Runs of 64 pixels that go on as the row above take one decision.

use super::CodecError;
use super::binary::{BinaryReader, BinaryWriter, Probability};
use crate::bytes::{Reader, Writer};
use crate::image::Mask;
use crate::limits::Limits;

/// Pixels that one decision may settle.
const RUN_PX: usize = 64;
/// Holes around the image, so that contexts need no bounds.
const MARGIN: usize = 2;

/// What both ends know while they go through the pixels.
struct Model {
    /// By context: five pixels of the row above, three of the one above that, two of this row.
    pixels: [Probability; 1024],
    /// By what the run would hold.
    runs: [Probability; 2],
}

impl Model {
    fn new() -> Model {
        Model { pixels: [Probability::EVEN; 1024], runs: [Probability::EVEN; 2] }
    }
}

/// This row and the two above it, a byte a pixel.
struct Rows {
    above2: Vec<u8>,
    above: Vec<u8>,
    here: Vec<u8>,
}

impl Rows {
    fn new(width_px: usize) -> Rows {
        let row = vec![0; width_px + 2 * MARGIN];
        Rows { above2: row.clone(), above: row.clone(), here: row }
    }

    fn next(&mut self) {
        std::mem::swap(&mut self.above2, &mut self.above);
        std::mem::swap(&mut self.above, &mut self.here);
        self.here.fill(0);
    }

    /// The value that a run from `x` most likely has throughout, if the pixel before it and all above it have it.
    fn run(&self, x: usize, length: usize) -> Option<u8> {
        let value = self.here[x + MARGIN - 1];
        let above = &self.above[x + MARGIN - 1..x + MARGIN + length + 1];
        above.iter().all(|&pixel| pixel == value).then_some(value)
    }
}

/// Goes through all pixels; `decide(probability, value)` codes or reads one decision and gives its outcome.
fn each_pixel(
    (width_px, height_px): (usize, usize),
    mut decide: impl FnMut(&mut Probability, &dyn Fn() -> bool) -> bool,
    known: Option<&Mask>,
    found: &mut Mask,
) {
    let mut model = Model::new();
    let mut rows = Rows::new(width_px);
    let truth = |x: usize, y: usize| known.is_some_and(|mask| mask.get(x as u32, y as u32));
    for y in 0..height_px {
        rows.next();
        for start in (0..width_px).step_by(RUN_PX) {
            let length = RUN_PX.min(width_px - start);
            if let Some(value) = rows.run(start, length) {
                let whole = || (start..start + length).all(|x| truth(x, y) == (value != 0));
                if decide(&mut model.runs[usize::from(value)], &whole) {
                    rows.here[start + MARGIN..start + MARGIN + length].fill(value);
                    continue;
                }
            }
            pixels_of_run(&mut rows, &mut model, start..start + length, |probability, x| {
                decide(probability, &|| truth(x, y))
            });
        }
        if known.is_none() {
            for (x, _) in rows.here[MARGIN..MARGIN + width_px].iter().enumerate().filter(|(_, pixel)| **pixel != 0) {
                found.set(x as u32, y as u32, true);
            }
        }
    }
}

fn pixels_of_run(
    rows: &mut Rows,
    model: &mut Model,
    columns: std::ops::Range<usize>,
    mut decide: impl FnMut(&mut Probability, usize) -> bool,
) {
    let bits = |row: &[u8]| row.iter().fold(0, |bits, &pixel| bits << 1 | usize::from(pixel));
    // Pixel x of the image is at x + MARGIN.
    let first = columns.start;
    let mut above2 = bits(&rows.above2[first..first + 3]);
    let mut above = bits(&rows.above[first..first + 4]);
    let mut here = bits(&rows.here[first..first + 2]);
    for x in columns {
        above2 = (above2 << 1 | usize::from(rows.above2[(x + 3).min(rows.above2.len() - 1)])) & 0b111;
        above = (above << 1 | usize::from(rows.above[x + 4])) & 0b1_1111;
        let pixel = decide(&mut model.pixels[above << 5 | above2 << 2 | here], x);
        here = (here << 1 | usize::from(pixel)) & 0b11;
        rows.here[x + MARGIN] = pixel.into();
    }
}

pub(super) fn write(mask: &Mask, out: &mut Writer) {
    let (width_px, height_px) = mask.size_px();
    let mut writer = BinaryWriter::new();
    let decide = |probability: &mut Probability, value: &dyn Fn() -> bool| {
        let value = value();
        writer.push(probability, value);
        value
    };
    each_pixel((width_px as usize, height_px as usize), decide, Some(mask), &mut Mask::empty(0, 0));
    out.block(&writer.finish());
}

pub(super) fn read((width_px, height_px): (u32, u32), bytes: &mut Reader, limits: &Limits) -> Result<Mask, CodecError> {
    let (width, height) = (width_px as usize, height_px as usize);
    if width * height > limits.update_pixels {
        return Err(CodecError::TooMuch("pixels"));
    }
    let mut mask = Mask::empty(width_px, height_px);
    let mut reader = BinaryReader::new(bytes.block()?);
    each_pixel((width, height), |probability, _| reader.next(probability), None, &mut mask);
    Ok(mask)
}
