//! Bytes of a body: planes of what vertices differ by from the one before, indices as how far they lie below the next new vertex, and what bones
//! do as how their numbers bend over time.
//!
//! Vertices lie in the order in which triangles first use them ([`Body`]'s maker sees to that, not the reader), so an index is mostly a small number.

use super::{CodecError, Packer, Unpacker};
use crate::body::{Body, Clip, Skin, Wrap};
use crate::bytes::{Reader, Writer};
use crate::limits::Limits;

const DOUBLE_SIDED: u8 = 1;
const NEAREST: u8 = 2;
const HAS_UVS: u8 = 4;
const HAS_COLOURS: u8 = 8;
const IS_BENT: u8 = 16;
const CUT_OUT: u8 = 32;
const HAS_NORMALS: u8 = 64;

/// Appends a body.
pub(crate) fn write_body(body: &Body, packer: &mut Packer, out: &mut Writer) {
    let flag = |is: bool, flag: u8| if is { flag } else { 0 };
    out.u8(flag(body.double_sided, DOUBLE_SIDED)
        | flag(body.nearest, NEAREST)
        | flag(!body.uvs.is_empty(), HAS_UVS)
        | flag(!body.colours.is_empty(), HAS_COLOURS)
        | flag(body.cut_out, CUT_OUT)
        | flag(!body.normals.is_empty(), HAS_NORMALS)
        | flag(body.skin.is_some(), IS_BENT));
    body.wrap.iter().for_each(|&wrap| out.u8(wrap as u8));
    let numbers = body.least.iter().chain(&body.step).chain(body.bounds.as_flattened());
    numbers.chain(&body.least_uv).chain(&body.step_uv).for_each(|&number| out.f32(number));
    out.u32(u32::try_from(body.positions.len()).expect("fewer than 2^32 vertices"));
    out.u32(u32::try_from(body.indices.len()).expect("fewer than 2^32 indices"));
    write_shorts(&body.positions, packer, out);
    write_shorts(&body.normals, packer, out);
    write_shorts(&body.uvs, packer, out);
    write_bytes(&body.colours, packer, out);
    let mut next = 0;
    let below = body.indices.iter().map(|&index| {
        let below = index.wrapping_sub(next);
        next = next.max(index.wrapping_add(1));
        // A new vertex is 0, one behind it 1.
        zigzag(below.wrapping_neg() as i32)
    });
    write_numbers(below, packer, out);
    if let Some(skin) = &body.skin {
        write_bytes(&skin.bones, packer, out);
        write_shorts(&skin.shares, packer, out);
        write_clip(&skin.clip, packer, out);
    }
}

/// Reads what [`write_body`] wrote, and takes its vertices and numbers off `left`.
pub(crate) fn read_body(bytes: &mut Reader, unpacker: &mut Unpacker, left: &mut Limits) -> Result<Body, CodecError> {
    let flags = bytes.u8()?;
    let wrap = [read_wrap(bytes)?, read_wrap(bytes)?];
    let (least, step) = (floats(bytes)?, floats(bytes)?);
    let bounds = [floats(bytes)?, floats(bytes)?];
    let (least_uv, step_uv) = (floats(bytes)?, floats(bytes)?);
    let vertices = take(&mut left.body_vertices, bytes.u32()?, "vertices of bodies")?;
    let indices = take(&mut left.body_indices, bytes.u32()?, "indices of bodies")?;
    let of = |is: bool| if is { vertices } else { 0 };
    let positions = read_shorts(bytes, unpacker, vertices)?;
    let normals = read_shorts(bytes, unpacker, of(flags & HAS_NORMALS != 0))?;
    let uvs = read_shorts(bytes, unpacker, of(flags & HAS_UVS != 0))?;
    let colours = read_bytes(bytes, unpacker, of(flags & HAS_COLOURS != 0))?;
    let mut next = 0_u32;
    let indices = read_numbers(bytes, unpacker, indices)?.into_iter().map(|number| {
        let index = next.wrapping_sub(unzigzag(number) as u32);
        next = next.max(index.wrapping_add(1));
        index
    });
    let indices = indices.collect();
    let skin = if flags & IS_BENT == 0 {
        None
    } else {
        let bones = read_bytes(bytes, unpacker, vertices)?;
        let shares = read_shorts(bytes, unpacker, vertices)?;
        Some(Skin { bones, shares, clip: read_clip(bytes, unpacker, left)? })
    };
    let is = |flag: u8| flags & flag != 0;
    let body = Body {
        positions,
        least,
        step,
        normals,
        uvs,
        least_uv,
        step_uv,
        colours,
        indices,
        double_sided: is(DOUBLE_SIDED),
        cut_out: is(CUT_OUT),
        wrap,
        nearest: is(NEAREST),
        bounds,
        skin,
    };
    if body.is_whole() { Ok(body) } else { Err(CodecError::Damaged("body")) }
}

fn write_clip(clip: &Clip, packer: &mut Packer, out: &mut Writer) {
    out.f64(clip.period_s);
    out.u16(clip.bones);
    out.f32(clip.linear_step);
    out.f32(clip.offset_step);
    out.u32(u32::try_from(clip.codes.len()).expect("fewer than 2^32 numbers"));
    let tracks = Clip::NUMBERS * usize::from(clip.bones);
    let bends = (0..tracks).flat_map(|track| {
        let (mut last, mut before) = (0_i32, 0_i32);
        clip.codes.iter().skip(track).step_by(tracks.max(1)).map(move |&code| {
            let bend = code.wrapping_sub(goes_on(last, before));
            (before, last) = (last, code);
            zigzag(bend)
        })
    });
    write_numbers(bends, packer, out);
}

fn read_clip(bytes: &mut Reader, unpacker: &mut Unpacker, left: &mut Limits) -> Result<Clip, CodecError> {
    let (period_s, bones) = (bytes.f64()?, bytes.u16()?);
    let (linear_step, offset_step) = (bytes.f32()?, bytes.f32()?);
    let count = take(&mut left.body_clip_numbers, bytes.u32()?, "numbers of clips")?;
    let tracks = Clip::NUMBERS * usize::from(bones);
    if tracks == 0 || !count.is_multiple_of(tracks) {
        return Err(CodecError::Damaged("clip"));
    }
    let bends = read_numbers(bytes, unpacker, count)?;
    let mut codes = vec![0; count];
    for (track, bends) in bends.chunks_exact((count / tracks).max(1)).enumerate() {
        let (mut last, mut before) = (0_i32, 0_i32);
        for (moment, &bend) in bends.iter().enumerate() {
            let code = goes_on(last, before).wrapping_add(unzigzag(bend));
            (before, last) = (last, code);
            codes[moment * tracks + track] = code;
        }
    }
    Ok(Clip { period_s, bones, linear_step, offset_step, codes })
}

/// What a number is expected to be that goes on as it went.
fn goes_on(last: i32, before: i32) -> i32 {
    last.wrapping_mul(2).wrapping_sub(before)
}

fn zigzag(number: i32) -> u32 {
    ((number << 1) ^ (number >> 31)) as u32
}

fn unzigzag(number: u32) -> i32 {
    (number >> 1) as i32 ^ -((number & 1) as i32)
}

/// Takes a count off what is left of a limit.
fn take(left: &mut usize, count: u32, what: &'static str) -> Result<usize, CodecError> {
    let count = count as usize;
    *left = left.checked_sub(count).ok_or(CodecError::TooMuch(what))?;
    Ok(count)
}

fn read_wrap(bytes: &mut Reader) -> Result<Wrap, CodecError> {
    match bytes.u8()? {
        0 => Ok(Wrap::Repeat),
        1 => Ok(Wrap::Mirror),
        2 => Ok(Wrap::Clamp),
        _ => Err(CodecError::Damaged("wrap of a body")),
    }
}

fn floats<const N: usize>(bytes: &mut Reader) -> Result<[f32; N], CodecError> {
    let mut numbers = [0.0; N];
    for number in &mut numbers {
        *number = bytes.f32()?;
    }
    Ok(numbers)
}

/// Of each column two planes: the low and the high bytes of what vertices differ by from the one before.
fn write_shorts<const N: usize>(rows: &[[u16; N]], packer: &mut Packer, out: &mut Writer) {
    for column in 0..N {
        let (mut low, mut high, mut before) = (Vec::with_capacity(rows.len()), Vec::with_capacity(rows.len()), 0_u16);
        for row in rows {
            let difference = row[column].wrapping_sub(before) as i16;
            let [low_byte, high_byte] = (((difference << 1) ^ (difference >> 15)) as u16).to_le_bytes();
            low.push(low_byte);
            high.push(high_byte);
            before = row[column];
        }
        packer.pack(&low, out);
        packer.pack(&high, out);
    }
}

fn read_shorts<const N: usize>(
    bytes: &mut Reader,
    unpacker: &mut Unpacker,
    count: usize,
) -> Result<Vec<[u16; N]>, CodecError> {
    let mut columns = Vec::with_capacity(N);
    for _ in 0..N {
        let (low, high) = (unpacker.unpack(bytes, count)?, unpacker.unpack(bytes, count)?);
        let mut before = 0_u16;
        let column = low.iter().zip(&high).map(|(&low, &high)| {
            let coded = u16::from_le_bytes([low, high]);
            before = before.wrapping_add((coded >> 1) ^ 0_u16.wrapping_sub(coded & 1));
            before
        });
        columns.push(column.collect::<Vec<u16>>());
    }
    Ok((0..count).map(|row| std::array::from_fn(|column| columns[column][row])).collect())
}

fn write_bytes<const N: usize>(rows: &[[u8; N]], packer: &mut Packer, out: &mut Writer) {
    (0..N).for_each(|column| packer.pack(&rows.iter().map(|row| row[column]).collect::<Vec<u8>>(), out));
}

fn read_bytes<const N: usize>(
    bytes: &mut Reader,
    unpacker: &mut Unpacker,
    count: usize,
) -> Result<Vec<[u8; N]>, CodecError> {
    let columns = (0..N).map(|_| unpacker.unpack(bytes, count)).collect::<Result<Vec<_>, _>>()?;
    Ok((0..count).map(|row| std::array::from_fn(|column| columns[column][row])).collect())
}

/// Numbers that are mostly small, as bytes of seven bits each.
fn write_numbers(numbers: impl Iterator<Item = u32>, packer: &mut Packer, out: &mut Writer) {
    let mut coded = Writer::default();
    numbers.for_each(|number| coded.varint(number));
    out.u32(u32::try_from(coded.bytes.len()).expect("fewer than 2^32 bytes"));
    packer.pack(&coded.bytes, out);
}

fn read_numbers(bytes: &mut Reader, unpacker: &mut Unpacker, count: usize) -> Result<Vec<u32>, CodecError> {
    let length = bytes.u32()? as usize;
    // A number takes one to five bytes.
    if length < count || length > count.saturating_mul(5) {
        return Err(CodecError::Damaged("numbers of a body"));
    }
    let coded = unpacker.unpack(bytes, length)?;
    let mut coded = Reader::new(&coded);
    let numbers = (0..count).map(|_| coded.varint()).collect::<Result<Vec<_>, _>>()?;
    if coded.remaining() == 0 { Ok(numbers) } else { Err(CodecError::Damaged("numbers of a body")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of triangles that two bones bend.
    fn body(vertices: usize) -> Body {
        let number = |index: usize, factor: usize| (index * factor % 1021) as u16;
        let clip = Clip {
            period_s: 1.5,
            bones: 2,
            linear_step: 1e-4,
            offset_step: 1e-3,
            codes: (0..4 * 2 * Clip::NUMBERS as i32)
                .map(|index| (index % 24) * 100 + (index / 24) * 7 - 1000)
                .collect(),
        };
        Body {
            positions: (0..vertices).map(|at| [number(at, 61), number(at, 7), u16::MAX - number(at, 3)]).collect(),
            least: [-1.0, 0.0, 2.5],
            step: [1e-4, 2e-4, 0.0],
            normals: (0..vertices).map(|at| [number(at, 5), number(at, 11)]).collect(),
            uvs: (0..vertices).map(|at| [number(at, 2), 60_000]).collect(),
            least_uv: [-0.5, 0.0],
            step_uv: [1e-5; 2],
            colours: (0..vertices).map(|at| [at as u8, 255, 3]).collect(),
            indices: (0..vertices as u32 - 2).flat_map(|at| [at, at + 1, at + 2]).collect(),
            double_sided: true,
            cut_out: true,
            wrap: [Wrap::Clamp, Wrap::Mirror],
            nearest: false,
            bounds: [[-2.0; 3], [3.0; 3]],
            skin: Some(Skin {
                bones: (0..vertices).map(|at| [(at % 2) as u8, 0, 1, 0]).collect(),
                shares: (0..vertices).map(|at| [60_000, 5_000, 0, at as u16 % 536]).collect(),
                clip,
            }),
        }
    }

    fn written(body: &Body) -> Vec<u8> {
        let mut out = Writer::default();
        write_body(body, &mut Packer::thorough(), &mut out);
        out.bytes
    }

    fn read(bytes: &[u8], limits: &Limits) -> Result<Body, CodecError> {
        read_body(&mut Reader::new(bytes), &mut Unpacker::new(), &mut limits.clone())
    }

    #[test]
    fn a_body_comes_back_as_it_is() {
        let bent = body(200);
        let rigid = Body {
            skin: None,
            colours: Vec::new(),
            uvs: Vec::new(),
            nearest: true,
            cut_out: false,
            normals: Vec::new(),
            ..bent.clone()
        };
        let far_apart = Body { indices: vec![150, 0, 199, 3, 3, 198], ..rigid.clone() };
        for body in [bent, rigid, far_apart] {
            assert_eq!(read(&written(&body), &Limits::default()), Ok(body));
        }
    }

    #[test]
    fn damaged_bytes_are_refused_or_make_another_body() {
        let bytes = written(&body(40));
        for cut in 0..bytes.len() {
            assert!(read(&bytes[..cut], &Limits::default()).is_err(), "cut to {cut} bytes");
        }
        for index in 0..8 * bytes.len() {
            let mut damaged = bytes.clone();
            damaged[index / 8] ^= 1 << (index % 8);
            if let Ok(body) = read(&damaged, &Limits::default()) {
                assert!(body.is_whole());
            }
        }
    }

    #[test]
    fn no_more_is_read_than_limits_allow() {
        let bytes = written(&body(40));
        let all = Limits::default();
        for limits in [
            Limits { body_vertices: 39, ..all.clone() },
            Limits { body_indices: 113, ..all.clone() },
            Limits { body_clip_numbers: 95, ..all.clone() },
        ] {
            assert!(matches!(read(&bytes, &limits), Err(CodecError::TooMuch(_))));
        }
        assert!(read(&bytes, &Limits { body_vertices: 40, body_indices: 114, body_clip_numbers: 96, ..all }).is_ok());
    }
}
