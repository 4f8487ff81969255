//! The samples of a patch: the mask, a method for each plane, values of constant planes, then the streams.

use super::header::Header;
use super::neighbours::Neighbours;
use super::pack::{Packer, Unpacker};
use super::streams::{StreamIter, StreamWriter, Streams};
use super::{CodecError, colour, copy, depth, mask, normal};
use crate::bytes::{Reader, Writer};
use crate::held::Patch;
use crate::image::DepthImage;
use crate::limits::Limits;

/// Method of a plane of one value, which follows; the planes' own methods count from 1.
const CONSTANT: u8 = 0;
/// Method of objects and materials where they are not constant.
const COPY: u8 = 1;
/// Bytes that the packed streams of all planes hold at most, a sample: what does not fit a code, two bytes for each of eight
/// channels.
const STREAM_BYTES_PER_SAMPLE: usize = 8 * 2;
/// Bytes that the frequency tables of all channels hold at most.
const TABLES_BYTES: usize = 8 * 64 * 512;

pub(super) fn write(image: &DepthImage, packer: &mut Packer, out: &mut Writer) {
    mask::write(&image.mask, out);
    if image.depth.is_empty() {
        return;
    }
    let mut streams = StreamWriter::default();
    if !constant(&image.object, out, |out, object| out.u16(object)) {
        let keys: Vec<u32> = image.object.iter().map(|&object| object.into()).collect();
        copy::encode(&keys, 2, &Neighbours::new(&image.mask, &vec![0; keys.len()])).write(&mut streams);
        out.u8(COPY);
    }
    let neighbours = Neighbours::new(&image.mask, &image.object);
    if !constant(&image.material, out, |out, material| out.u8(material)) {
        let keys: Vec<u32> = image.material.iter().map(|&material| material.into()).collect();
        copy::encode(&keys, 1, &neighbours).write(&mut streams);
        out.u8(COPY);
    }
    if !constant(&image.normal, out, |out, [first, second]| out.u16(u16::from_le_bytes([first, second]))) {
        out.u8(normal::write(&image.normal, &neighbours, &mut streams));
    }
    if !constant(&image.depth, out, |out, code| out.u16(code)) {
        out.u8(depth::write(&image.depth, &depth_context(image, &neighbours), &mut streams));
    }
    if !constant(&image.colour, out, |out, colour| colour.iter().for_each(|&channel| out.u8(channel))) {
        out.u8(colour::write(&image.colour, &neighbours, &mut streams));
    }
    streams.write(packer, out);
}

fn depth_context<'a>(image: &'a DepthImage, neighbours: &'a Neighbours) -> depth::Context<'a> {
    depth::Context {
        neighbours,
        camera: &image.camera,
        depth_scale: image.depth_scale,
        mask: &image.mask,
        normal: &image.normal,
    }
}

/// Writes the only value of a plane, if it is the only one.
fn constant<T: PartialEq + Copy>(values: &[T], out: &mut Writer, write: impl Fn(&mut Writer, T)) -> bool {
    let constant = values.iter().all(|value| *value == values[0]);
    if constant {
        out.u8(CONSTANT);
        write(out, values[0]);
    }
    constant
}

/// A plane before its streams are there.
enum Method<T> {
    Constant(T),
    Coded(u8),
}

impl<T: Clone> Method<T> {
    fn read<'a>(
        bytes: &mut Reader<'a>,
        value: impl Fn(&mut Reader<'a>) -> Result<T, CodecError>,
    ) -> Result<Method<T>, CodecError> {
        match bytes.u8()? {
            CONSTANT => value(bytes).map(Method::Constant),
            method => Ok(Method::Coded(method)),
        }
    }

    fn plane(self, count: usize, decode: impl FnOnce(u8) -> Result<Vec<T>, CodecError>) -> Result<Vec<T>, CodecError> {
        match self {
            Method::Constant(value) => Ok(vec![value; count]),
            Method::Coded(method) => decode(method),
        }
    }
}

pub(super) fn read(
    header: Header,
    unpacker: &mut Unpacker,
    bytes: &mut Reader,
    limits: &Limits,
) -> Result<Patch, CodecError> {
    let mask = mask::read(header.camera.size_px(), bytes, limits)?;
    let count = mask.count();
    if count > limits.update_samples {
        return Err(CodecError::TooMuch("samples"));
    }
    let Header { id, purpose, capture_time_s, objects, camera, depth_scale } = header;
    let (depth, normal, colour, object, material) = Default::default();
    let mut image = DepthImage { camera, depth_scale, mask, depth, normal, colour, object, material };
    if count > 0 {
        read_samples(&mut image, count, unpacker, bytes)?;
    }
    Ok(Patch { id, purpose, capture_time_s, objects, image })
}

fn read_samples(
    image: &mut DepthImage,
    count: usize,
    unpacker: &mut Unpacker,
    bytes: &mut Reader,
) -> Result<(), CodecError> {
    let object = Method::read(bytes, |bytes| Ok(bytes.u16()?))?;
    let material = Method::read(bytes, |bytes| Ok(bytes.u8()?))?;
    let normal_ = Method::read(bytes, |bytes| Ok(bytes.u16()?.to_le_bytes()))?;
    let depth_ = Method::read(bytes, |bytes| Ok(bytes.u16()?))?;
    let colour_ = Method::read(bytes, |bytes| Ok([bytes.u8()?, bytes.u8()?, bytes.u8()?]))?;
    let streams = Streams::read(bytes, unpacker, count * STREAM_BYTES_PER_SAMPLE + TABLES_BYTES)?;
    let mut streams = streams.iter();
    image.object = object.plane(count, |method| {
        let keys = read_copied(method, count, 2, &Neighbours::new(&image.mask, &vec![0; count]), &mut streams)?;
        Ok(keys.into_iter().map(|key| key as u16).collect())
    })?;
    let neighbours = Neighbours::new(&image.mask, &image.object);
    image.material = material.plane(count, |method| {
        let keys = read_copied(method, count, 1, &neighbours, &mut streams)?;
        Ok(keys.into_iter().map(|key| key as u8).collect())
    })?;
    image.normal = normal_.plane(count, |method| normal::read(method, count, &neighbours, &mut streams))?;
    image.depth =
        depth_.plane(count, |method| depth::read(method, &depth_context(image, &neighbours), &mut streams))?;
    image.colour = colour_.plane(count, |method| colour::read(method, count, &neighbours, &mut streams))?;
    if streams.is_empty() { Ok(()) } else { Err(CodecError::Damaged("number of streams")) }
}

fn read_copied(
    method: u8,
    count: usize,
    value_bytes: usize,
    neighbours: &Neighbours,
    streams: &mut StreamIter,
) -> Result<Vec<u32>, CodecError> {
    if method == COPY {
        copy::decode(count, value_bytes, neighbours, streams)
    } else {
        Err(CodecError::Damaged("method of ids"))
    }
}
