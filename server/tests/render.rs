//! Pictures whose every pixel is known.

mod common;

use camera::{Pinhole, Rigid};
use common::*;
use glam::{DAffine3, DVec3, Vec3};
use protocol::image::{octahedral_normal, octahedral_normal_with_rest};
use scene::load::LoadLimits;
use scene::model::{Bumps, SAME_UV, UvSet};
use scene::{Deformed, Material};
use vantage_server::discretize::Discretization;
use vantage_server::render::SceneRenderer;

const SIZE_PX: u32 = 64;

#[test]
fn a_plane_has_its_inverse_depth_everywhere() {
    let gpu = gpu();
    let scale = DAffine3::from_scale(DVec3::splat(100.0));
    let scene = scene(vec![square(3, 0)], vec![Material::default()], &[(0, scale)]);
    let camera = looking_back(DVec3::new(0.3, -0.2, 4.0), SIZE_PX);
    let picture = truth(&gpu, &scene, &camera);
    for w in &picture.w {
        assert!((w * 4.0 - 1.0).abs() < 2e-6, "w {w} instead of 1/4");
    }
    // A slanted plane: w is linear in the image.
    let slanted =
        Pinhole { world_from_eye: Rigid::look_along(DVec3::new(0.0, 0.0, 4.0), DVec3::new(0.5, 0.0, -1.0)), ..camera };
    let picture = truth(&gpu, &scene, &slanted);
    for (index, w) in picture.w.iter().enumerate() {
        let (x, y) = ((index % 64) as f64 + 0.5, (index / 64) as f64 + 0.5);
        let ray_world = slanted.world_from_eye.transform_vector(slanted.ray_eye_from_image(x, y));
        let expected = -ray_world.z / 4.0;
        if (expected as f32) > 0.01 {
            assert!((f64::from(*w) - expected).abs() < 1e-6, "w {w} instead of {expected} at {x}, {y}");
        }
    }
}

#[test]
fn a_sphere_has_its_outline_and_normals() {
    let gpu = gpu();
    let mirror = Material { metallic: 1.0, roughness: 0.0, ..Material::default() };
    let scene = scene(vec![sphere(64, 0)], vec![mirror], &[(0, DAffine3::IDENTITY)]);
    let camera = looking_back(DVec3::new(0.0, 0.0, 3.0), 128);
    let captures = captures(&renderer(&gpu, &scene, &camera), &[camera], Discretization::Conventional);
    let mut wrong = 0;
    let mut off = Vec::new();
    for (index, ids) in captures[0].ids.iter().enumerate() {
        let (x, y) = ((index % 128) as f64 + 0.5, (index / 128) as f64 + 0.5);
        let ray = camera.ray_eye_from_image(x, y);
        // First hit of the ray with the unit sphere around (0, 0, 3) of eye space.
        let (a, b) = (ray.length_squared(), 3.0 * ray.z);
        let inside = b * b - a * 8.0;
        wrong += u32::from((inside > 0.0) != (ids[0] != 0));
        if inside > 0.05 && ids[0] != 0 {
            let z = (b - inside.sqrt()) / a;
            assert!((f64::from(captures[0].w(index)) * z - 1.0).abs() < 2e-3);
            let normal_world = camera.world_from_eye.transform_point(ray * z).as_vec3().normalize();
            let stored = octahedral_normal(captures[0].normal_code(index));
            assert!(stored.dot(normal_world) > 0.9995, "{stored} instead of {normal_world}");
            let rest = captures[0].rests[index][0];
            let fine = octahedral_normal_with_rest(captures[0].normal_code(index), rest);
            off.push([stored, fine].map(|stored| stored.distance(normal_world)));
        }
    }
    // A mirror's normals come finely; interpolating between the corners of triangles errs too.
    let mean = |of: usize| off.iter().map(|off| off[of]).sum::<f32>() / off.len() as f32;
    assert!(mean(1) * 4.0 < mean(0), "{} with what codes leave off, {} without", mean(1), mean(0));
    // Only pixels that the outline cuts: its length is about 2 pi 22.6 pixels.
    assert!(wrong < 60, "{wrong} pixels differ at the outline");
}

#[test]
fn back_faces_are_culled_unless_two_sided_or_mirrored() {
    let gpu = gpu();
    let two_sided = Material { double_sided: true, ..Material::default() };
    let turned = DAffine3::from_rotation_y(std::f64::consts::PI);
    let mirrored = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let camera = looking_back(DVec3::new(0.0, 0.0, 1.5), SIZE_PX);
    let covered = |material: &Material, world_from_mesh: DAffine3| {
        let scene = scene(vec![square(1, 0)], vec![material.clone()], &[(0, world_from_mesh)]);
        let renderer = renderer(&gpu, &scene, &camera);
        let image = captures(&renderer, &[camera], Discretization::Conventional).remove(0);
        let middle = (SIZE_PX * SIZE_PX / 2 + SIZE_PX / 2) as usize;
        (image.ids[middle][0] != 0).then(|| octahedral_normal(image.normal_code(middle)))
    };
    let one_sided = Material::default();
    let facing = Some(Vec3::Z);
    assert_eq!(covered(&one_sided, DAffine3::IDENTITY), facing);
    assert_eq!(covered(&one_sided, turned), None);
    assert_eq!(covered(&one_sided, mirrored), facing);
    assert_eq!(covered(&one_sided, mirrored * turned), None);
    for world_from_mesh in [DAffine3::IDENTITY, turned, mirrored, mirrored * turned] {
        assert_eq!(covered(&two_sided, world_from_mesh), facing, "the normal faces the eye");
    }
}

/// glTF 2.0, 3.7.4: a node whose map turns left to right shows the same side of its faces as one that does not.
#[test]
fn a_mirrored_node_of_a_file_shows_the_side_that_its_faces_have() {
    let folder = std::env::temp_dir().join(format!("vantage-mirrored-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    // A square of 2 m that faces +z.
    let corners: [f32; 12] = [-1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 1.0, 1.0, 0.0, -1.0, 1.0, 0.0];
    let indices: [u16; 6] = [0, 1, 2, 0, 2, 3];
    let bytes = [bytemuck::cast_slice(&corners), bytemuck::cast_slice::<u16, u8>(&indices)].concat();
    std::fs::write(folder.join("square.bin"), bytes).expect("written");
    let gpu = gpu();
    let is_seen = |scale: [f64; 3], from_m: f64| {
        let text = format!(
            r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0, "scale": {scale:?}}}],
            "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1}}]}}],
            "buffers": [{{"uri": "square.bin", "byteLength": 60}}],
            "bufferViews": [{{"buffer": 0, "byteOffset": 0, "byteLength": 48}}, {{"buffer": 0, "byteOffset": 48, "byteLength": 12}}],
            "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]}},
            {{"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}}]}}"#
        );
        let path = folder.join("square.gltf");
        std::fs::write(&path, text).expect("written");
        let scene = scene::load::load(&path, &LoadLimits::default(), &|_| {}).expect("a sound file");
        let eye = Rigid::look_at(DVec3::new(0.0, 0.0, from_m), DVec3::ZERO);
        let camera = Pinhole::symmetric(eye, (SIZE_PX, SIZE_PX), 1.0, 0.1);
        let image = captures(&renderer(&gpu, &scene, &camera), &[camera], Discretization::Conventional).remove(0);
        image.ids[(SIZE_PX * SIZE_PX / 2 + SIZE_PX / 2) as usize][0] != 0
    };
    for scale in [[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, -2.0, 1.0]] {
        assert_eq!((is_seen(scale, 2.0), is_seen(scale, -2.0)), (true, false), "{scale:?}");
    }
    // Turned round along z it faces the other way.
    assert_eq!((is_seen([1.0, 1.0, -1.0], 2.0), is_seen([1.0, 1.0, -1.0], -2.0)), (false, true));
    std::fs::remove_dir_all(&folder).expect("was written");
}

#[test]
fn textures_keep_their_bytes_and_average_in_linear_light() {
    let gpu = gpu();
    let textured = Material { texture: Some(0), ..Material::default() };
    let mut near = scene(vec![square(1, 0)], vec![textured], &[(0, DAffine3::IDENTITY)]);
    // One texel a pixel at distance 1 with 90 degrees: the square fills the image.
    near.textures =
        vec![texture(SIZE_PX, SIZE_PX, true, |x, y| [(x * 4) as u8, (y * 4) as u8, ((x ^ y) * 4) as u8, 255])];
    let camera = looking_back(DVec3::new(0.0, 0.0, 1.0), SIZE_PX);
    let renderer_near = renderer(&gpu, &near, &camera);
    let image = captures(&renderer_near, &[camera], Discretization::Conventional).remove(0);
    let worst = image.colour.chunks(4).zip(near.textures[0].rgba.chunks(16));
    for (stored, texels) in worst {
        for (stored, texel) in stored.iter().zip(texels.chunks(4)) {
            assert!((0..3).all(|channel| stored[channel].abs_diff(texel[channel]) <= 1), "{stored:?} {texel:?}");
        }
    }
    // From afar checks of black and white become linear 0.5, which is sRGB 188.
    let mut far = near.clone();
    far.textures = vec![texture(256, 256, false, |x, y| [if (x + y) % 2 == 0 { 255 } else { 0 }; 4])];
    let camera = looking_back(DVec3::new(0.0, 0.0, 2.0), SIZE_PX);
    let renderer_far = renderer(&gpu, &far, &camera);
    let image = captures(&renderer_far, &[camera], Discretization::Conventional).remove(0);
    let middle = image.colour[(SIZE_PX * SIZE_PX / 2 + SIZE_PX / 2) as usize];
    assert!(middle[..3].iter().all(|value| value.abs_diff(188) <= 2), "{middle:?}");
}

#[test]
fn alpha_below_the_cut_off_leaves_a_hole() {
    let gpu = gpu();
    let leaf = Material { texture: Some(0), alpha_cutoff: Some(0.5), ..Material::default() };
    let behind = DAffine3::from_translation(DVec3::new(0.0, 0.0, -0.5)) * DAffine3::from_scale(DVec3::splat(5.0));
    let mut scene = scene(
        vec![square(1, 0), square(1, 1)],
        vec![leaf, coloured([0.0, 0.0, 1.0, 1.0])],
        &[(0, DAffine3::IDENTITY), (1, behind)],
    );
    scene.textures = vec![texture(2, 1, true, |x, _| [200, 0, 0, if x == 0 { 127 } else { 128 }])];
    let camera = looking_back(DVec3::new(0.0, 0.0, 1.0), SIZE_PX);
    let picture = truth(&gpu, &scene, &camera);
    let row = (SIZE_PX * SIZE_PX / 2) as usize;
    assert_eq!(picture.object[row + 10], 1, "the left half is cut out");
    assert_eq!(picture.object[row + 50], 0, "the right half is there");
}

#[test]
fn deformed_vertices_are_drawn() {
    let gpu = gpu();
    let mut scene = scene(vec![square(1, 0)], vec![Material::default()], &[(0, DAffine3::IDENTITY); 2]);
    scene.instances[1].deforms = true;
    let mut vertices = scene.meshes[0].vertices.clone();
    vertices.iter_mut().for_each(|vertex| vertex.position[2] += 0.5);
    scene.animation = std::sync::Arc::new(Still {
        world_from_mesh: vec![DAffine3::IDENTITY; 2],
        deformed: vec![Deformed { instance: 1, vertices }],
    });
    let camera = looking_back(DVec3::new(0.0, 0.0, 1.5), SIZE_PX);
    let mut renderer = renderer(&gpu, &scene, &camera);
    renderer.update(&scene.at(1.0), camera.world_from_eye.translation).expect("same scene");
    let image = captures(&renderer, &[camera], Discretization::Conventional).remove(0);
    let middle = (SIZE_PX * SIZE_PX / 2 + SIZE_PX / 2) as usize;
    assert_eq!(image.object(middle), 1);
    assert!((image.w(middle) - 1.0).abs() < 1e-5);
}

/// A few spheres before a wall.
fn crowd(offset: DVec3) -> (scene::Scene, Vec<Pinhole>) {
    let place = |x: f64, y: f64, z: f64| DAffine3::from_translation(offset + DVec3::new(x, y, z));
    let mut placed: Vec<_> = (0..9)
        .map(|index| (1, place(f64::from(index % 3) * 2.3 - 2.3, f64::from(index / 3) * 2.3 - 2.3, 0.0)))
        .collect();
    placed.push((0, place(0.0, 0.0, -3.0) * DAffine3::from_scale(DVec3::splat(12.0))));
    let materials = vec![coloured([0.8, 0.2, 0.1, 1.0]), coloured([0.1, 0.6, 0.3, 1.0])];
    let mut scene = scene(vec![square(8, 0), sphere(6, 1)], materials, &placed);
    scene.bounds = scene::Bounds { min: offset - 12.0, max: offset + 12.0 };
    let eyes = [(0.0, 0.0), (0.9, 0.1), (-0.8, -0.4), (0.1, 0.9)];
    let cameras = eyes.iter().map(|&(x, y)| looking_back(offset + DVec3::new(x, y, 4.5), 96)).collect();
    (scene, cameras)
}

#[test]
fn pulled_vertices_give_equal_ids() {
    let gpu = gpu();
    assert!(gpu.caps.primitive_index, "this test compares with the native path");
    let (scene, cameras) = crowd(DVec3::ZERO);
    let native = renderer(&gpu, &scene, &cameras[0]);
    let mut pulled = SceneRenderer::with_pulling(&gpu, &scene).expect("the scene uploads");
    pulled.update(&scene.at(0.0), cameras[0].world_from_eye.translation).expect("same scene");
    assert!(native.kind().native && !pulled.kind().native);
    for method in [Discretization::Conventional, Discretization::PIXEL] {
        let ours = captures(&native, &cameras, method);
        let theirs = captures(&pulled, &cameras, method);
        for (ours, theirs) in ours.iter().zip(&theirs) {
            assert!(ours.ids.iter().any(|ids| ids[0] != 0));
            assert_eq!(ours.ids, theirs.ids, "{method:?}");
            assert_eq!(ours.depth, theirs.depth, "{method:?}");
        }
    }
}

#[test]
fn a_scene_far_from_the_origin_looks_the_same() {
    let gpu = gpu();
    let pictures = [DVec3::ZERO, DVec3::new(1e7, -3e6, 5e6)].map(|offset| {
        let (scene, cameras) = crowd(offset);
        truth(&gpu, &scene, &cameras[1])
    });
    let [near, far] = &pictures;
    let pixels = near.triangle.len();
    let same = (0..pixels).filter(|&index| near.triangle[index] == far.triangle[index]).count();
    // Positions near 1e7 m are f64 steps of 2e-9 m; a pixel may flip where an edge runs through its middle.
    assert!(same * 1000 >= pixels * 999, "{same} of {pixels} pixels have the same triangle");
    for index in (0..pixels).filter(|&index| near.triangle[index] == far.triangle[index]) {
        assert!((near.w[index] - far.w[index]).abs() <= 1e-6 * near.w[index]);
        assert!((0..3).all(|channel| near.colour[index][channel].abs_diff(far.colour[index][channel]) <= 1));
    }
}

#[test]
fn a_normal_map_tilts_along_its_texture_coordinates() {
    let gpu = gpu();
    // 0.48 to the right and 0.36 to the upper edge of the map, 0.8 along the normal.
    let code = |tilt: f32| ((tilt + 1.0) / 2.0 * 255.0).round() as u8;
    let bumpy = |scale| Material {
        bumps: Some(Bumps { texture: 0, uv_set: UvSet::First, from_uv: SAME_UV, scale }),
        double_sided: true,
        ..Material::default()
    };
    let turned = DAffine3::from_rotation_z(std::f64::consts::FRAC_PI_2);
    let cases = [
        (false, 1.0, DAffine3::IDENTITY, Vec3::new(0.48, 0.36, 0.8)),
        // Half as steep.
        (false, 0.5, DAffine3::IDENTITY, Vec3::new(0.24, 0.18, 0.8).normalize()),
        (false, 1.0, turned, Vec3::new(-0.36, 0.48, 0.8)),
        (false, 1.0, DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)), Vec3::new(-0.48, 0.36, 0.8)),
        // From behind it is turned round as a whole: what stands out in front is a dent there.
        (false, 1.0, DAffine3::from_rotation_y(std::f64::consts::PI), Vec3::new(0.48, -0.36, 0.8)),
        // By coordinates of the second set, which run down and to the right: right tilts down, and up tilts to the left.
        (true, 1.0, DAffine3::IDENTITY, Vec3::new(-0.36, -0.48, 0.8)),
    ];
    for (by_second, scale, placed, expected) in cases {
        let mut scene = scene(vec![square(3, 0)], vec![bumpy(scale)], &[(0, placed)]);
        scene.textures = vec![texture(2, 2, false, |_, _| [code(0.48), code(0.36), code(0.8), 255])];
        if by_second {
            scene.materials[0].bumps.as_mut().expect("bumpy").uv_set = UvSet::Second;
            let mesh = &mut scene.meshes[0];
            mesh.second_uvs = mesh.vertices.iter().map(|vertex| [vertex.uv[1], vertex.uv[0]]).collect();
        }
        let camera = looking_back(DVec3::new(0.0, 0.0, 0.9), SIZE_PX);
        let captures = captures(&renderer(&gpu, &scene, &camera), &[camera], Discretization::Conventional);
        for (index, ids) in captures[0].ids.iter().enumerate() {
            assert!(ids[0] != 0, "the square fills the view");
            let stored = octahedral_normal(captures[0].normal_code(index));
            // Half a step of the map's codes and of the normal's.
            assert!(stored.dot(expected) > 0.9995, "{stored} instead of {expected} by {scale} at {placed:?}");
        }
    }
}
