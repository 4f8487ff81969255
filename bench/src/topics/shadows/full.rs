//! The full geometry as what casts: the paper's baseline draws the maps of a lamp's points straight from it.
//!
//! Triangles are drawn by the pipelines that draw rebuilt surfaces, and compared by the same lookups, so that nothing but what is drawn differs.
//! Corners are given as those surfaces are, in the image of a view from the lamp's middle, which holds all of the scene.

use camera::{Camera, Pinhole};
use glam::{DAffine3, Vec3};
use protocol::{DepthImage, DepthScale, Mask};
use scene::{Scene, Snapshot};
use surface::{PatchMesh, Vertex};

/// An image of one pixel's sample that stands for the scene where a client wants one.
pub(super) fn image(view: Pinhole) -> DepthImage {
    let mut mask = Mask::empty(view.width_px, view.height_px);
    mask.set(0, 0, true);
    DepthImage {
        camera: Camera::Pinhole(view),
        depth_scale: DepthScale { w_min: 1.0, w_step: 0.0 },
        mask,
        depth: vec![0],
        normal: vec![protocol::image::octahedral_code(Vec3::Y)],
        normal_rest: Vec::new(),
        colour_rest: Vec::new(),
        share: Vec::new(),
        ends: Vec::new(),
        colour: vec![[0; 3]],
        object: vec![0],
        material: vec![0],
    }
}

/// All triangles of a scene as it is in a snapshot, in the image of a view that all of it lies before.
pub(super) fn mesh(scene: &Scene, snapshot: &Snapshot, view: &Pinhole) -> PatchMesh {
    let mut mesh = PatchMesh::default();
    let eye_from_world = view.world_from_eye.inverse().to_affine();
    for (index, (instance, world_from_mesh)) in scene.instances.iter().zip(&snapshot.world_from_mesh).enumerate() {
        let of_mesh = &scene.meshes[instance.mesh as usize];
        let deformed = snapshot.deformed.iter().find(|deformed| deformed.instance as usize == index);
        let vertices = deformed.map_or(&of_mesh.vertices, |deformed| &deformed.vertices);
        let first = mesh.vertices.len() as u32;
        let eye_from_mesh = eye_from_world * *world_from_mesh;
        mesh.vertices.extend(vertices.iter().map(|vertex| corner(view, &eye_from_mesh, vertex.position)));
        mesh.indices.extend(of_mesh.indices.iter().map(|index| first + index));
    }
    mesh
}

fn corner(view: &Pinhole, eye_from_mesh: &DAffine3, position: [f32; 3]) -> Vertex {
    let p = eye_from_mesh.transform_point3(Vec3::from(position).as_dvec3());
    let place = p.truncate() * (view.focal_px / p.z) + view.centre_px;
    Vertex {
        u_px: place.x as f32,
        v_px: place.y as f32,
        w: (1.0 / p.z) as f32,
        colour_material: 0,
        normal_object: 0,
        corner_colour_trim: 0,
        corner_normal_mover: 0,
        pixel: 0,
        normal_rests_level_end: 0,
    }
}
