//! An update as plain bytes, for where bytes can be handed over and values cannot: from a web worker to its page.
//!
//! Nothing is predicted or packed: planes are the bytes of their values, so reading costs little more than copying, at ten
//! bytes a sample, one more of what reflects and two where surfaces end. Both ends are one program on one machine: the form has no versions, and its numbers are the machine's own.
//! It never crosses the network. [`crate::wire`] is for that.

use std::sync::Arc;

use bytemuck::{AnyBitPattern, NoUninit};

use crate::bytes::{EndsEarly, Reader, Writer};
use crate::codec::{self, CodecError, Header, Packer, Unpacker};
use crate::held::{Edit, Patch, PatchId, Update};
use crate::image::{DepthImage, Mask};
use crate::limits::Limits;
use crate::wire::{WireError, decode_table, encode_table};

const CLEAR: u8 = 0;
const ADD: u8 = 1;
const REMOVE: u8 = 2;
const DELETE: u8 = 3;
const TRIM: u8 = 4;
const MOVE: u8 = 5;
const MATERIALS: u8 = 6;
const LIGHT: u8 = 7;
const PLACE: u8 = 8;
const WITHDRAW: u8 = 9;
const SKY: u8 = 10;
const JOIN: u8 = 11;
const BODY: u8 = 12;
const SHIFT: u8 = 13;

/// Appends an update whose masks have the size of their cameras, as those that were decoded do.
pub fn write_update(update: &Update, out: &mut Vec<u8>) {
    let mut writer = Writer { bytes: std::mem::take(out) };
    writer.u64(update.number);
    writer.f64(update.scene_time_s);
    writer.u64(update.pose_seq);
    writer.u64(update.digest);
    writer.u32(count(update.edits.len()));
    update.edits.iter().for_each(|edit| write_edit(edit, &mut writer));
    writer.block(&codec::next_bytes(&update.next));
    *out = writer.bytes;
}

/// The update of [`write_update`]'s bytes; others are refused or give another update, which the digest refuses.
pub fn read_update(bytes: &[u8]) -> Result<Update, WireError> {
    let mut reader = Reader::new(bytes);
    let (number, scene_time_s, pose_seq, digest) = (reader.u64()?, reader.f64()?, reader.u64()?, reader.u64()?);
    let edit_count = reader.u32()? as usize;
    // Every edit takes a byte at least.
    if edit_count > reader.remaining() {
        return Err(EndsEarly.into());
    }
    let edits = (0..edit_count).map(|_| read_edit(&mut reader)).collect::<Result<_, _>>()?;
    let next = codec::next_steps(reader.block()?)?;
    if reader.remaining() > 0 {
        return Err(CodecError::Damaged("bytes after the last step").into());
    }
    Ok(Update { number, scene_time_s, pose_seq, edits, next, digest })
}

fn count(length: usize) -> u32 {
    u32::try_from(length).expect("an update stays under 4 GiB")
}

fn write_edit(edit: &Edit, out: &mut Writer) {
    match edit {
        Edit::Clear => out.u8(CLEAR),
        Edit::Add(patch) => {
            out.u8(ADD);
            write_patch(patch, out);
        }
        Edit::Remove(id) => {
            out.u8(REMOVE);
            out.u32(id.0);
        }
        Edit::Delete(id, addresses) => {
            out.u8(DELETE);
            out.u32(id.0);
            out.u32(count(addresses.len()));
            write_plane(&addresses.iter().map(|&(x, y)| [x, y]).collect::<Vec<_>>(), out);
        }
        Edit::Trim(id, trims) => {
            out.u8(TRIM);
            out.u32(id.0);
            out.u32(count(trims.len()));
            write_plane(&trims.iter().map(|&(x, y, _)| [x, y]).collect::<Vec<_>>(), out);
            write_plane(&trims.iter().map(|&(_, _, extent)| extent).collect::<Vec<_>>(), out);
        }
        Edit::Move(poses) => {
            out.u8(MOVE);
            codec::write_objects(poses, out);
        }
        Edit::Shift(shifts) => {
            out.u8(SHIFT);
            out.block(&codec::shift_bytes(shifts));
        }
        Edit::Place(relief, instances) => {
            out.u8(PLACE);
            codec::write_instances(*relief, instances, out);
        }
        Edit::Withdraw(objects) => {
            out.u8(WITHDRAW);
            codec::write_ids(objects, out);
        }
        Edit::Materials(materials) => {
            out.u8(MATERIALS);
            out.block(&encode_table(materials));
        }
        Edit::Light(lighting) => {
            out.u8(LIGHT);
            out.block(&encode_table(lighting));
        }
        Edit::Sky(sky) => {
            out.u8(SKY);
            codec::write_sky(sky, &mut Packer::new(), out);
        }
        Edit::Body(id, body) => {
            out.u8(BODY);
            out.u32(id.0);
            codec::write_body(body, &mut Packer::new(), out);
        }
        Edit::Join(bits) => {
            out.u8(JOIN);
            out.u64(*bits);
        }
    }
}

fn read_edit(reader: &mut Reader) -> Result<Edit, WireError> {
    Ok(match reader.u8()? {
        CLEAR => Edit::Clear,
        ADD => Edit::Add(Box::new(read_patch(reader)?)),
        REMOVE => Edit::Remove(PatchId(reader.u32()?)),
        DELETE => {
            let (id, count) = (PatchId(reader.u32()?), reader.u32()? as usize);
            let addresses: Vec<[u16; 2]> = read_plane(count, reader)?;
            Edit::Delete(id, addresses.into_iter().map(<(u16, u16)>::from).collect())
        }
        TRIM => {
            let (id, count) = (PatchId(reader.u32()?), reader.u32()? as usize);
            let addresses: Vec<[u16; 2]> = read_plane(count, reader)?;
            let extents: Vec<u8> = read_plane(count, reader)?;
            Edit::Trim(id, addresses.into_iter().zip(extents).map(|([x, y], extent)| (x, y, extent)).collect())
        }
        MOVE => Edit::Move(codec::read_objects(reader)?),
        SHIFT => Edit::Shift(codec::shifts(reader.block()?, codec::MOST_OBJECTS)?),
        PLACE => {
            let (relief, instances) = codec::read_instances(reader)?;
            Edit::Place(relief, instances)
        }
        WITHDRAW => Edit::Withdraw(codec::read_ids(reader)?),
        MATERIALS => Edit::Materials(decode_table(reader.block()?)?),
        LIGHT => Edit::Light(Box::new(decode_table(reader.block()?)?)),
        SKY => Edit::Sky(Arc::new(codec::read_sky(reader, &mut Unpacker::new())?)),
        BODY => {
            let id = PatchId(reader.u32()?);
            Edit::Body(id, Arc::new(codec::read_body(reader, &mut Unpacker::new(), &mut Limits::default())?))
        }
        JOIN => Edit::Join(reader.u64()?),
        _ => return Err(CodecError::Damaged("kind of edit").into()),
    })
}

fn write_patch(patch: &Patch, out: &mut Writer) {
    codec::write_header(patch, out);
    let image = &patch.image;
    write_plane(image.mask.words(), out);
    write_plane(&image.depth, out);
    write_plane(&image.normal, out);
    write_optional(&image.normal_rest, out);
    write_optional(&image.ends, out);
    write_plane(&image.colour, out);
    write_optional(&image.colour_rest, out);
    write_plane(&image.object, out);
    write_plane(&image.material, out);
    write_optional(&image.share, out);
}

fn read_patch(reader: &mut Reader) -> Result<Patch, WireError> {
    let Header { id, purpose, capture_time_s, objects, camera, depth_scale } =
        codec::read_header(reader, &Limits::default())?;
    let mask = read_mask(camera.size_px(), reader)?;
    let count = mask.count();
    let image = DepthImage {
        camera,
        depth_scale,
        mask,
        depth: read_plane(count, reader)?,
        normal: read_plane(count, reader)?,
        normal_rest: read_optional(reader)?,
        ends: read_optional(reader)?,
        colour: read_plane(count, reader)?,
        colour_rest: read_optional(reader)?,
        object: read_plane(count, reader)?,
        material: read_plane(count, reader)?,
        share: read_optional(reader)?,
    };
    Ok(Patch { id, purpose, capture_time_s, objects, image })
}

fn read_mask((width_px, height_px): (u32, u32), reader: &mut Reader) -> Result<Mask, WireError> {
    const DAMAGED: CodecError = CodecError::Damaged("mask");
    let pixels = width_px.checked_mul(height_px).ok_or(DAMAGED)?;
    let words = read_plane(pixels.div_ceil(64) as usize, reader)?;
    Ok(Mask::from_words(width_px, height_px, words).ok_or(DAMAGED)?)
}

/// Appends the bytes of values; how many there are, the reader must know.
fn write_plane<T: NoUninit>(values: &[T], out: &mut Writer) {
    out.bytes.extend_from_slice(bytemuck::cast_slice(values));
}

/// A plane that an image may lack.
fn write_optional<T: NoUninit>(values: &[T], out: &mut Writer) {
    out.u32(count(values.len()));
    write_plane(values, out);
}

fn read_optional<T: NoUninit + AnyBitPattern>(reader: &mut Reader) -> Result<Vec<T>, EndsEarly> {
    let count = reader.u32()? as usize;
    read_plane(count, reader)
}

fn read_plane<T: NoUninit + AnyBitPattern>(count: usize, reader: &mut Reader) -> Result<Vec<T>, EndsEarly> {
    let bytes = reader.take(count.checked_mul(size_of::<T>()).ok_or(EndsEarly)?)?;
    let mut values = vec![T::zeroed(); count];
    bytemuck::cast_slice_mut(&mut values).copy_from_slice(bytes);
    Ok(values)
}
