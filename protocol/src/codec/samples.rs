//! The samples of a patch: a byte that names the coder, the mask, and what the coder makes of the planes: the dense one a method for
//! each plane, and what the methods need.
//!
//! Everything that is decided or learned travels in one stream of decisions ([`super::bits`]): of the dense coder everything, of
//! the fast one ([`super::fast`]) the mask and what was counted.

use super::bits::{BitReader, BitWriter, Bits};
use super::colour::ColourSteps;
use super::facets::{Facets, surface_of};
use super::header::Header;
use super::labels::{self, Label};
use super::residual::{self, Predictor, Range};
use super::segments::{Segment, leading, segments};
use super::{CodecError, Coding, Profile, dense, ends, fast, outline, quarters, rest};
use crate::bytes::{Reader, Writer};
use crate::held::Patch;
use crate::image::{DepthImage, Mask};
use crate::limits::Limits;

/// Patches of fewer samples are always coded densely: the fast coder's frequencies would outweigh them.
const SMALL: usize = 8192;

/// How a plane is coded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Method {
    /// One value.
    Constant,
    /// Few values, see [`labels`].
    Labels,
    /// See [`residual`].
    Residual(Predictor),
}

impl Method {
    fn code(self, bits: &mut impl Bits) -> Result<Method, CodecError> {
        let place = |predictor| Predictor::ALL.iter().position(|&p| p == predictor).expect("all are listed") as u32;
        let code = match self {
            Method::Constant => 0,
            Method::Labels => 1,
            Method::Residual(predictor) => 2 + place(predictor),
        };
        match bits.raw(code, 3) {
            0 => Ok(Method::Constant),
            1 => Ok(Method::Labels),
            code => {
                let predictor = Predictor::ALL.get(code as usize - 2);
                predictor.map(|&predictor| Method::Residual(predictor)).ok_or(CodecError::Damaged("method"))
            }
        }
    }
}

/// Writes a plane of one value or of labels.
fn write_labels<T: Label>(bits: &mut BitWriter, values: &[T], segments: &[Segment]) {
    let method = constant_or_labels(values);
    method.code(bits).expect("a writer reads what it wrote");
    if method == Method::Constant {
        value(bits, values[0]);
    } else {
        labels::code(bits, &mut values.to_vec(), segments).expect("planes in memory are sound");
    }
}

/// Reads a plane of `count` samples of one value or of labels.
fn read_labels<T: Label>(
    bits: &mut BitReader,
    method: Method,
    count: usize,
    segments: &[Segment],
) -> Result<Vec<T>, CodecError> {
    match method {
        Method::Constant => Ok(vec![value(bits, T::default()); count]),
        Method::Labels => {
            let mut values = vec![T::default(); count];
            labels::code(bits, &mut values, segments).map(|()| values)
        }
        Method::Residual(_) => Err(CodecError::Damaged("method of ids")),
    }
}

/// Codes a single value.
fn value<T: Label>(bits: &mut impl Bits, value: T) -> T {
    let mut bytes = value.to_bytes();
    for byte in &mut bytes[..T::BYTES] {
        *byte = bits.raw((*byte).into(), 8) as u8;
    }
    T::from_bytes(bytes)
}

fn constant_or_labels<T: Label>(values: &[T]) -> Method {
    if leading(values, values[0]) == values.len() { Method::Constant } else { Method::Labels }
}

/// Writes planes by decisions.
struct Writing {
    bits: BitWriter,
    /// See [`dense::code`].
    activity: Vec<u8>,
}

impl Writing {
    fn materials(&mut self, image: &DepthImage, segments: &[Segment]) {
        if materials_vary(image) {
            let codes: Vec<[i16; 1]> = image.material.iter().map(|&code| [code.into()]).collect();
            self.plane(&image.material, &codes, segments, Range::Byte, as_is);
        } else {
            write_labels(&mut self.bits, &image.material, segments);
        }
    }

    /// A plane that is `values` as numbers and may be coded as `labels`.
    fn plane<T: Label, const N: usize>(
        &mut self,
        labels: &[T],
        values: &[[i16; N]],
        segments: &[Segment],
        range: Range,
        better: impl FnMut(usize, i16, [i16; 2]) -> i16,
    ) {
        let method = choose(labels, values, segments, range);
        let Method::Residual(predictor) = method else { return write_labels(&mut self.bits, labels, segments) };
        method.code(&mut self.bits).expect("a writer reads what it wrote");
        dense::code(&mut self.bits, &mut values.to_vec(), segments, (predictor, range), &mut self.activity, better);
    }
}

/// Whether materials differ within an object, as where textures tell them (then near codes stand for what is alike), rather than from
/// object to object.
fn materials_vary(image: &DepthImage) -> bool {
    let pairs = image.material.array_windows().zip(image.object.array_windows());
    let changes = pairs.filter(|([a, b], [before, after])| before == after && a != b).count();
    changes > image.sample_count() / 64
}

fn choose<T: Label, const N: usize>(labels: &[T], values: &[[i16; N]], segments: &[Segment], range: Range) -> Method {
    /// Contexts take off at least so much of what residuals cost without.
    const CONTEXT_GAIN: f64 = 0.85;
    /// An exception is cheaper than this only where most are alike.
    const EXCEPTION_BITS: f64 = 5.0;
    if constant_or_labels(labels) == Method::Constant {
        return Method::Constant;
    }
    let some = residual::some_segments(segments);
    let share = some.iter().map(|segment| f64::from(segment.count)).sum::<f64>() / labels.len() as f64;
    let costs =
        Predictor::ALL.map(|predictor| (predictor, residual::cost_bits(values, &some, predictor, range) / share));
    let (predictor, bits) = costs.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).expect("there are predictors");
    let bits = bits * CONTEXT_GAIN;
    let exceptions = labels::exceptions(labels, &some) as f64 / share;
    if exceptions * EXCEPTION_BITS > bits {
        return Method::Residual(predictor);
    }
    let mut trial = BitWriter::new();
    labels::code(&mut trial, &mut labels.to_vec(), segments).expect("planes in memory are sound");
    if ((trial.finish().len() * 8) as f64) < bits { Method::Labels } else { Method::Residual(predictor) }
}

pub(super) fn write(image: &DepthImage, coding: Coding, out: &mut Writer) {
    let profile = if image.sample_count() < SMALL { Profile::Dense } else { coding.profile };
    out.u8(Coding { profile, ..coding }.to_byte());
    let mut bits = BitWriter::new();
    outline::code(&mut bits, &mut image.mask.clone()).expect("the frame of a mask fits it");
    match profile {
        Profile::Fast => {
            let apart = materials_vary(image);
            let [symbols, literals] = fast::write(image, coding.colour, apart, &mut bits);
            if bits.decide(NO_VARYING, apart) {
                let mut writing = Writing { bits, activity: vec![0; image.sample_count()] };
                writing.materials(image, &segments(&image.mask, Some(&image.object)));
                bits = writing.bits;
            }
            rest::code(&mut bits, image, image.normal_rest.clone());
            quarters::code(&mut bits, image, image.colour_rest.clone());
            let ends = ends::write(image, &mut bits);
            write_shares(&mut bits, image);
            for block in [&bits.finish(), &symbols, &literals, &ends] {
                out.varint_block(block);
            }
        }
        Profile::Dense => {
            let mut writing = Writing { bits, activity: vec![0; image.sample_count()] };
            if image.sample_count() > 0 {
                write_planes(image, coding.colour, &mut writing);
            }
            out.varint_block(&writing.bits.finish());
        }
    }
}

/// Predictions that nothing betters.
fn as_is(_: usize, predicted: i16, _: [i16; 2]) -> i16 {
    predicted
}

fn write_planes(image: &DepthImage, steps: ColourSteps, writing: &mut Writing) {
    write_labels(&mut writing.bits, &image.object, &segments(&image.mask, None));
    let segments = segments(&image.mask, Some(&image.object));
    writing.materials(image, &segments);
    let normal: Vec<[i16; 2]> = image.normal.iter().map(|code| code.map(i16::from)).collect();
    writing.plane(&image.normal, &normal, &segments, Range::Byte, as_is);
    let depth: Vec<[i16; 1]> = image.depth.iter().map(|&code| [code as i16]).collect();
    let facets = Facets::find(image, |rank| surface_of(image, false, rank));
    let facets = facets.code(&mut writing.bits, image.mask.size_px()).expect("facets in memory are sound");
    let better = facets.along(&image.mask, |rank| surface_of(image, false, rank));
    writing.plane(&image.depth, &depth, &segments, Range::Short, better);
    writing.plane(&image.colour, &steps.codes_of_all(&image.colour), &segments, Range::Short, as_is);
    rest::code(&mut writing.bits, image, image.normal_rest.clone());
    quarters::code(&mut writing.bits, image, image.colour_rest.clone());
    ends::code(&mut writing.bits, image, image.ends.clone());
    write_shares(&mut writing.bits, image);
}

/// That the fast coder tells materials along with objects, in 1/32768: it nearly always does, at no bytes.
const NO_VARYING: u32 = 32_767;

/// That an image has no shares, in 1/32768: it next to always comes, at no bytes.
const NO_SHARES: u32 = 32_767;

/// Writes [`DepthImage::share`]; behind all other planes, by the objects.
fn write_shares(bits: &mut BitWriter, image: &DepthImage) {
    if bits.decide(NO_SHARES, !image.share.is_empty()) {
        let segments = segments(&image.mask, Some(&image.object));
        labels::code(bits, &mut image.share.clone(), &segments).expect("planes in memory are sound");
    }
}

fn read_shares(bits: &mut BitReader, image: &DepthImage) -> Result<Vec<u8>, CodecError> {
    if !bits.decide(NO_SHARES, false) {
        return Ok(Vec::new());
    }
    let mut share = vec![0; image.sample_count()];
    labels::code(bits, &mut share, &segments(&image.mask, Some(&image.object)))?;
    let is_share = |share: &u8| (1..=DepthImage::WHOLE).contains(share);
    if share.iter().all(is_share) { Ok(share) } else { Err(CodecError::Damaged("share")) }
}

/// Reads planes by decisions.
struct Reading<'a> {
    bits: BitReader<'a>,
    /// See [`dense::code`].
    activity: Vec<u8>,
}

impl Reading<'_> {
    fn materials(&mut self, count: usize, segments: &[Segment]) -> Result<Vec<u8>, CodecError> {
        let codes = |values: &[[i16; 1]]| values.iter().map(|value| value[0] as u8).collect();
        self.plane(count, segments, Range::Byte, codes, as_is)
    }

    /// A plane of `count` ids, which have no residuals.
    fn ids<T: Label>(&mut self, count: usize, segments: &[Segment]) -> Result<Vec<T>, CodecError> {
        let method = Method::Constant.code(&mut self.bits)?;
        read_labels(&mut self.bits, method, count, segments)
    }

    /// A plane of `count` samples; `labels` makes it from numbers.
    fn plane<T: Label, const N: usize>(
        &mut self,
        count: usize,
        segments: &[Segment],
        range: Range,
        labels: impl Fn(&[[i16; N]]) -> Vec<T>,
        better: impl FnMut(usize, i16, [i16; 2]) -> i16,
    ) -> Result<Vec<T>, CodecError> {
        let predictor = match Method::Constant.code(&mut self.bits)? {
            Method::Residual(predictor) => predictor,
            method => return read_labels(&mut self.bits, method, count, segments),
        };
        let mut values = vec![[0; N]; count];
        dense::code(&mut self.bits, &mut values, segments, (predictor, range), &mut self.activity, better);
        Ok(labels(&values))
    }
}

pub(super) fn read(header: Header, bytes: &mut Reader, limits: &Limits) -> Result<Patch, CodecError> {
    let coding = Coding::from_byte(bytes.u8()?)?;
    let (width_px, height_px) = header.camera.size_px();
    if width_px as usize * height_px as usize > limits.update_pixels {
        return Err(CodecError::TooMuch("pixels"));
    }
    let mut bits = BitReader::new(bytes.varint_block()?);
    let mut mask = Mask::empty(width_px, height_px);
    outline::code(&mut bits, &mut mask)?;
    let count = mask.count();
    if count > limits.update_samples {
        return Err(CodecError::TooMuch("samples"));
    }
    let Header { id, purpose, capture_time_s, objects, camera, depth_scale } = header;
    let (depth, normal, normal_rest, ends, colour, colour_rest, object, material, share) = Default::default();
    let mut image = DepthImage {
        camera,
        depth_scale,
        mask,
        depth,
        normal,
        normal_rest,
        ends,
        colour,
        colour_rest,
        object,
        material,
        share,
    };
    match coding.profile {
        Profile::Fast => {
            let (symbols, literals, ends) = (bytes.varint_block()?, bytes.varint_block()?, bytes.varint_block()?);
            fast::read(&mut image, coding.colour, &mut bits, symbols, literals)?;
            if bits.decide(NO_VARYING, false) {
                let mut reading = Reading { bits, activity: vec![0; count] };
                image.material = reading.materials(count, &segments(&image.mask, Some(&image.object)))?;
                bits = reading.bits;
            }
            image.normal_rest = rest::code(&mut bits, &image, Vec::new());
            image.colour_rest = quarters::code(&mut bits, &image, Vec::new());
            image.ends = ends::read(&image, &mut bits, ends)?;
            image.share = read_shares(&mut bits, &image)?;
        }
        Profile::Dense if count > 0 => {
            let mut reading = Reading { bits, activity: vec![0; count] };
            read_planes(&mut image, count, coding.colour, &mut reading)?;
        }
        Profile::Dense => {}
    }
    Ok(Patch { id, purpose, capture_time_s, objects, image })
}

fn read_planes(
    image: &mut DepthImage,
    count: usize,
    steps: ColourSteps,
    reading: &mut Reading,
) -> Result<(), CodecError> {
    image.object = reading.ids(count, &segments(&image.mask, None))?;
    let segments = segments(&image.mask, Some(&image.object));
    image.material = reading.materials(count, &segments)?;
    let normals = |values: &[[i16; 2]]| values.iter().map(|value| value.map(|value| value as u8)).collect();
    image.normal = reading.plane(count, &segments, Range::Byte, normals, as_is)?;
    let depths = |values: &[[i16; 1]]| values.iter().map(|value| value[0] as u16).collect();
    let facets = Facets::none(image.mask.size_px()).code(&mut reading.bits, image.mask.size_px())?;
    let better = facets.along(&image.mask, |rank| surface_of(image, false, rank));
    image.depth = reading.plane(count, &segments, Range::Short, depths, better)?;
    image.colour = reading.plane(count, &segments, Range::Short, |values| steps.rgb_of_all(values), as_is)?;
    image.normal_rest = rest::code(&mut reading.bits, image, Vec::new());
    image.colour_rest = quarters::code(&mut reading.bits, image, Vec::new());
    image.ends = ends::code(&mut reading.bits, image, Vec::new());
    image.share = read_shares(&mut reading.bits, image)?;
    Ok(())
}
