//! What a patch says of itself before its samples: id, purpose, capture time, camera, depth scale, objects.

use std::sync::Arc;

use camera::{Camera, GraphCamera, Pinhole, Rigid, Spoc};
use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3, Vec3};

use super::CodecError;
use super::pack::{Packer, Unpacker};
use crate::bytes::{EndsEarly, Reader, Writer};
use crate::held::{Instance, NextSteps, ObjectPose, ObjectSteps, Patch, PatchId, Purpose, Step};
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

/// Bytes of one object's pose: id and the columns of the affine map.
const OBJECT_BYTES: usize = 2 + 12 * 8;

/// Appends a count and the poses.
pub(crate) fn write_objects(objects: &[ObjectPose], out: &mut Writer) {
    out.u32(u32::try_from(objects.len()).expect("at most one pose an object id"));
    for ObjectPose { object, world_from_object } in objects {
        out.u16(*object);
        for value in world_from_object.to_cols_array() {
            out.f64(value);
        }
    }
}

/// Reads what [`write_objects`] wrote.
pub(crate) fn read_objects(bytes: &mut Reader) -> Result<Vec<ObjectPose>, CodecError> {
    let count = bytes.u32()? as usize;
    if count > bytes.remaining() / OBJECT_BYTES {
        return Err(EndsEarly.into());
    }
    let pose = |bytes: &mut Reader| {
        let object = bytes.u16()?;
        let columns: [f64; 9] = floats(bytes)?;
        let translation = DVec3::from_array(floats(bytes)?);
        let world_from_object = DAffine3 { matrix3: DMat3::from_cols_array(&columns), translation };
        Ok(ObjectPose { object, world_from_object })
    };
    (0..count).map(|_| pose(bytes)).collect()
}

/// Bytes of an object's steps: id, and ways and turns.
const STEPS_BYTES: usize = 2 + 3 * 6 * 4;

/// Appends a count and the steps, and how long one takes where there are any.
pub(crate) fn write_next(next: &NextSteps, out: &mut Writer) {
    out.varint(u32::try_from(next.objects.len()).expect("at most one entry an object id"));
    if !next.objects.is_empty() {
        out.f32(next.step_s);
    }
    for ObjectSteps { object, steps } in &next.objects {
        out.u16(*object);
        let numbers =
            steps.iter().flat_map(|step| [step.way_world, step.turn_world]).flat_map(|vector| vector.to_array());
        numbers.for_each(|number| out.f32(number));
    }
}

/// Reads what [`write_next`] wrote.
pub(crate) fn read_next(bytes: &mut Reader) -> Result<NextSteps, EndsEarly> {
    let count = bytes.varint()? as usize;
    if count > bytes.remaining() / STEPS_BYTES {
        return Err(EndsEarly);
    }
    let step_s = if count > 0 { bytes.f32()? } else { 0.0 };
    let vector = |bytes: &mut Reader| Ok(Vec3::new(bytes.f32()?, bytes.f32()?, bytes.f32()?));
    let step = |bytes: &mut Reader| Ok(Step { way_world: vector(bytes)?, turn_world: vector(bytes)? });
    let object = |bytes: &mut Reader| {
        Ok(ObjectSteps { object: bytes.u16()?, steps: [step(bytes)?, step(bytes)?, step(bytes)?] })
    };
    Ok(NextSteps { step_s, objects: (0..count).map(|_| object(bytes)).collect::<Result<_, _>>()? })
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
