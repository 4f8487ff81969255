//! Scene files of every format, and environments.

use std::path::Path;

use scene::load::load;
use scene::{Environment, Scene};

use crate::{caps, scratch};

/// Times at which a scene is looked at: animations repeat, at any finite time.
const TIMES_S: [f64; 4] = [0.0, 0.3, -1.7, 1e9];

/// A `.glb` by its signature, else a `.gltf`, which may name two files beside it.
pub fn gltf(bytes: &[u8]) -> bool {
    let name = if bytes.starts_with(b"glTF") { "scene.glb" } else { "scene.gltf" };
    scratch::write("buffer.bin", &[0x3e; 64]);
    scratch::write("image.webp", include_bytes!("../../scene/src/load/tests/data/quadrants.webp"));
    look(&scratch::write(name, bytes))
}

/// The first byte says of which format the rest is. An OBJ file ends at the first byte 0; its materials follow.
pub fn mesh_files(bytes: &[u8]) -> bool {
    let Some((&format, bytes)) = bytes.split_first() else { return false };
    match format % 5 {
        0 => {
            let (obj, mtl) = bytes.split_at(bytes.iter().position(|&byte| byte == 0).unwrap_or(bytes.len()));
            scratch::write("scene.mtl", mtl.get(1..).unwrap_or_default());
            look(&scratch::write("scene.obj", obj))
        }
        1 => look(&scratch::write("scene.ply", bytes)),
        2 => look(&scratch::write("scene.stl", bytes)),
        3 => environment(bytes),
        // By its signature alone.
        _ => look(&scratch::write("scene", bytes)),
    }
}

fn look(path: &Path) -> bool {
    let loaded = load(path, &caps::LOAD, &|_| {});
    match &loaded {
        Ok(scene) => check(scene),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
    loaded.is_ok()
}

/// Checks what [`Scene`] and [`scene::Snapshot`] promise.
fn check(scene: &Scene) {
    let sum = |of: fn(&scene::Mesh) -> usize| scene.meshes.iter().map(of).sum::<usize>() as u64;
    assert!(sum(|mesh| mesh.vertices.len()) <= caps::LOAD.vertices.max(6 * caps::LOAD.points), "vertices");
    assert!(sum(|mesh| mesh.indices.len()) / 3 <= caps::LOAD.triangles.max(8 * caps::LOAD.points), "triangles");
    assert!(scene.instances.len() as u64 <= caps::LOAD.instances, "instances");
    for mesh in &scene.meshes {
        assert!(mesh.indices.len().is_multiple_of(3) && (mesh.material as usize) < scene.materials.len());
        assert!(mesh.indices.iter().all(|&index| (index as usize) < mesh.vertices.len()), "an index out of range");
        assert!(mesh.second_uvs.is_empty() || mesh.second_uvs.len() == mesh.vertices.len());
        mesh.vertices.iter().for_each(check_vertex);
        assert!(mesh.bounds.as_flattened().iter().all(|number| number.is_finite()), "bounds");
    }
    for material in &scene.materials {
        assert!(material.texture.is_none_or(|texture| (texture as usize) < scene.textures.len()));
        let shares = [material.metallic, material.roughness, material.transmission, material.clearcoat];
        assert!(shares.iter().all(|share| (0.0..=1.0).contains(share)), "{material:?}");
        let numbers = material.base_colour.iter().chain(&material.emissive).chain([&material.ior]);
        assert!(numbers.chain(&material.sheen).all(|number| number.is_finite()), "{material:?}");
    }
    for texture in &scene.textures {
        assert_eq!(texture.rgba.len(), texture.width_px as usize * texture.height_px as usize * 4);
    }
    assert!(scene.instances.iter().all(|instance| (instance.mesh as usize) < scene.meshes.len()));
    assert!(scene.bounds.min.is_finite() && scene.bounds.max.is_finite(), "{:?}", scene.bounds);
    TIMES_S.iter().for_each(|&time_s| check_at(scene, time_s));
}

fn check_at(scene: &Scene, time_s: f64) {
    let snapshot = scene.at(time_s);
    assert_eq!(snapshot.world_from_mesh.len(), scene.instances.len());
    for (place, instance) in snapshot.world_from_mesh.iter().zip(&scene.instances) {
        assert!(place.is_finite() && place.matrix3.determinant() != 0.0, "{} at {time_s}: {place:?}", instance.name);
    }
    for deformed in &snapshot.deformed {
        let mesh = &scene.meshes[scene.instances[deformed.instance as usize].mesh as usize];
        assert_eq!(deformed.vertices.len(), mesh.vertices.len());
        deformed.vertices.iter().for_each(check_vertex);
    }
}

fn check_vertex(vertex: &scene::Vertex) {
    let numbers = vertex.position.iter().chain(&vertex.normal).chain(&vertex.uv);
    assert!(numbers.clone().all(|number| number.is_finite()), "{vertex:?}");
}

fn environment(bytes: &[u8]) -> bool {
    let Ok(environment) = Environment::decode(bytes, Path::new("fuzzed")) else { return false };
    let (width, height) = (environment.width_px as usize, environment.height_px as usize);
    assert!(width > 0 && height > 0 && environment.radiance.len() == width * height);
    let in_range = |number: &f32| (0.0..=Environment::MAX_RADIANCE).contains(number);
    assert!(environment.radiance.as_flattened().iter().all(in_range));
    true
}
