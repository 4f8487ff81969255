//! What a patch says of itself before its samples: id, purpose, capture time, camera, depth scale, objects.

use std::sync::Arc;

use camera::{Camera, GraphCamera, Pinhole, Rigid, Spoc};
use glam::{DQuat, DVec2, DVec3};

use super::CodecError;
use super::pack::{Packer, Unpacker};
use super::poses::{read_objects, write_objects};
use crate::bytes::{EndsEarly, Reader, Writer};
use crate::held::{Instance, ObjectPose, Patch, PatchId, Purpose};
use crate::image::DepthScale;
use crate::limits::Limits;
use crate::wire::graph;

/// A patch without its samples.
#[derive(Debug, Clone)]
pub(crate) struct Header {
    pub id: PatchId,
    pub purpose: Purpose,
    pub capture_time_s: f64,
    pub objects: Vec<ObjectPose>,
    pub camera: Camera,
    pub depth_scale: DepthScale,
}

const PINHOLE: u8 = 0;
const SPOC: u8 = 1;
const GRAPH: u8 = 2;

pub(crate) fn write(patch: &Patch, out: &mut Writer) {
    out.u32(patch.id.0);
    let (tag, index) = match patch.purpose {
        Purpose::Eye => (0, 0),
        Purpose::Light(light) => (1, light),
        Purpose::Impostor(object) => (2, object),
        Purpose::Environment => (3, 0),
        Purpose::Relief(object) => (4, object),
        Purpose::Inside(object) => (5, object),
        Purpose::Rest => (6, 0),
        Purpose::Camera => (7, 0),
        Purpose::Occluders => (8, 0),
        Purpose::Layer(layer) => (9, layer.into()),
        Purpose::Body => (10, 0),
    };
    out.u8(tag);
    out.u16(index);
    out.f64(patch.capture_time_s);
    match &patch.image.camera {
        Camera::Pinhole(camera) => {
            out.u8(PINHOLE);
            write_pinhole(camera, out);
        }
        Camera::Spoc(camera) => {
            out.u8(SPOC);
            write_pinhole(&camera.pinhole, out);
            let Spoc { pinhole: _, pole_px, push_from_m, push_to_m, push_max_px, ramp_px } = camera;
            for value in [pole_px.x, pole_px.y, *push_from_m, *push_to_m, *push_max_px, *ramp_px] {
                out.f64(value);
            }
        }
        Camera::Graph(camera) => {
            out.u8(GRAPH);
            // The same planes bound many frusta: packed, a description takes a third of its bytes.
            let description = graph::encode_graph(camera);
            out.varint(u32::try_from(description.len()).expect("descriptions are capped"));
            Packer::new().pack(&description, out);
        }
    }
    out.f32(patch.image.depth_scale.w_min);
    out.f32(patch.image.depth_scale.w_step);
    write_objects(&patch.objects, out);
}

pub(crate) fn read(bytes: &mut Reader, limits: &Limits) -> Result<Header, CodecError> {
    let id = PatchId(bytes.u32()?);
    let (tag, index) = (bytes.u8()?, bytes.u16()?);
    let purpose = match tag {
        0 => Purpose::Eye,
        1 => Purpose::Light(index),
        2 => Purpose::Impostor(index),
        3 => Purpose::Environment,
        4 => Purpose::Relief(index),
        5 => Purpose::Inside(index),
        6 => Purpose::Rest,
        7 => Purpose::Camera,
        8 => Purpose::Occluders,
        9 if index < Purpose::LAYERS.into() => Purpose::Layer(index as u8),
        10 => Purpose::Body,
        _ => return Err(CodecError::Damaged("purpose")),
    };
    let capture_time_s = bytes.f64()?;
    let camera = match bytes.u8()? {
        PINHOLE => Camera::Pinhole(read_pinhole(bytes)?),
        SPOC => Camera::Spoc(read_spoc(bytes)?),
        GRAPH => Camera::Graph(Arc::new(read_graph(bytes)?)),
        _ => return Err(CodecError::Damaged("kind of camera")),
    };
    if !camera.is_valid() {
        return Err(CodecError::Damaged("camera"));
    }
    let (width_px, height_px) = camera.size_px();
    if width_px > limits.image_side_px || height_px > limits.image_side_px {
        return Err(CodecError::TooMuch("pixels of an image's side"));
    }
    let depth_scale = DepthScale { w_min: bytes.f32()?, w_step: bytes.f32()? };
    let objects = read_objects(bytes)?;
    Ok(Header { id, purpose, capture_time_s, objects, camera, depth_scale })
}

fn read_graph(bytes: &mut Reader) -> Result<GraphCamera, CodecError> {
    let length = bytes.varint()? as usize;
    if length > graph::GRAPH_LIMIT_BYTES {
        return Err(CodecError::TooMuch("bytes of a graph camera"));
    }
    let description = Unpacker::new().unpack(bytes, length)?;
    graph::decode_graph(&description).ok_or(CodecError::Damaged("camera"))
}

fn write_pinhole(camera: &Pinhole, out: &mut Writer) {
    let Pinhole { world_from_eye, width_px, height_px, focal_px, centre_px, near_m } = camera;
    for value in world_from_eye.rotation.to_array().into_iter().chain(world_from_eye.translation.to_array()) {
        out.f64(value);
    }
    out.u32(*width_px);
    out.u32(*height_px);
    for value in [*focal_px, centre_px.x, centre_px.y, *near_m] {
        out.f64(value);
    }
}

fn read_pinhole(bytes: &mut Reader) -> Result<Pinhole, EndsEarly> {
    let rotation = DQuat::from_array(floats(bytes)?);
    let translation = DVec3::from_array(floats(bytes)?);
    let (width_px, height_px) = (bytes.u32()?, bytes.u32()?);
    let [focal_px, centre_x, centre_y, near_m] = floats(bytes)?;
    let world_from_eye = Rigid { rotation, translation };
    Ok(Pinhole { world_from_eye, width_px, height_px, focal_px, centre_px: DVec2::new(centre_x, centre_y), near_m })
}

fn read_spoc(bytes: &mut Reader) -> Result<Spoc, EndsEarly> {
    let pinhole = read_pinhole(bytes)?;
    let [pole_x, pole_y, push_from_m, push_to_m, push_max_px, ramp_px] = floats(bytes)?;
    Ok(Spoc { pinhole, pole_px: DVec2::new(pole_x, pole_y), push_from_m, push_to_m, push_max_px, ramp_px })
}

fn floats<const N: usize>(bytes: &mut Reader) -> Result<[f64; N], EndsEarly> {
    let mut values = [0.0; N];
    for value in &mut values {
        *value = bytes.f64()?;
    }
    Ok(values)
}

/// Appends what objects a relief shows: its id, their poses, and a tint each.
pub(crate) fn write_instances(relief: PatchId, instances: &[Instance], out: &mut Writer) {
    out.u32(relief.0);
    write_objects(&instances.iter().map(|instance| instance.pose).collect::<Vec<_>>(), out);
    instances.iter().flat_map(|instance| instance.tint).for_each(|byte| out.u8(byte));
}

/// Reads what [`write_instances`] wrote.
pub(crate) fn read_instances(bytes: &mut Reader) -> Result<(PatchId, Vec<Instance>), CodecError> {
    let relief = PatchId(bytes.u32()?);
    let poses = read_objects(bytes)?;
    let tints = bytes.take(poses.len() * 3)?.as_chunks::<3>().0;
    Ok((relief, poses.into_iter().zip(tints).map(|(pose, &tint)| Instance { pose, tint }).collect()))
}

/// Appends object ids and their count.
pub(crate) fn write_ids(objects: &[u16], out: &mut Writer) {
    out.u32(u32::try_from(objects.len()).expect("at most 65,536 object ids"));
    objects.iter().for_each(|&object| out.u16(object));
}

/// Reads what [`write_ids`] wrote.
pub(crate) fn read_ids(bytes: &mut Reader) -> Result<Vec<u16>, CodecError> {
    let count = bytes.u32()? as usize;
    if count > bytes.remaining() / size_of::<u16>() {
        return Err(EndsEarly.into());
    }
    (0..count).map(|_| Ok(bytes.u16()?)).collect()
}
