//! What every built-in scene keeps.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::*;
use crate::model::{Mesh, Snapshot};

/// Triangles as the papers count them, where they do.
const TRIANGLES: &[(&str, f64)] =
    &[("birdnest", 67e3), ("grass", 56e3), ("maze", 66e3), ("pillars", 38e3), ("tree", 113e3), ("urban", 50e3)];

fn loaded(name: &str) -> Scene {
    load(name).unwrap_or_else(|| panic!("{name} is listed"))
}

fn corners(mesh: &Mesh) -> impl Iterator<Item = [Vec3; 3]> {
    mesh.indices.chunks_exact(3).map(|t| [0, 1, 2].map(|k| Vec3::from(mesh.vertices[t[k] as usize].position)))
}

#[test]
fn triangle_counts_are_near_the_papers() {
    for name in names() {
        let count = loaded(name).triangle_count() as f64;
        let wanted = TRIANGLES.iter().find(|(still, _)| name.strip_suffix("-moving").unwrap_or(name) == *still);
        println!("{name}: {count} triangles");
        if let Some((_, wanted)) = wanted {
            assert!((count / wanted - 1.0).abs() <= 0.1, "{name}: {count} triangles, {wanted} wanted");
        }
    }
}

#[test]
fn scenes_are_well_formed() {
    for name in names().chain(simple()).chain(blended()).chain(reflecting()).chain(rough()) {
        let scene = loaded(name);
        println!("{name}: {} objects, {} meshes, {:?}", scene.instances.len(), scene.meshes.len(), scene.bounds);
        assert!(scene.instances.len() < 2000, "{name}: {} objects", scene.instances.len());
        assert!(!scene.bounds.is_empty() && scene.warnings.is_empty());
        assert!(scene.start.is_some(), "{name} says where to begin");
        for material in &scene.materials {
            assert!(material.texture.is_none_or(|t| (t as usize) < scene.textures.len()));
        }
        for (k, mesh) in scene.meshes.iter().enumerate() {
            assert!((mesh.material as usize) < scene.materials.len());
            assert!(!mesh.indices.is_empty() && mesh.indices.len().is_multiple_of(3), "{name} mesh {k}");
            assert!(mesh.indices.iter().all(|&i| (i as usize) < mesh.vertices.len()), "{name} mesh {k}");
            for vertex in &mesh.vertices {
                assert!(vertex.position.iter().chain(&vertex.uv).all(|x| x.is_finite()), "{name} mesh {k}");
                assert!(
                    (Vec3::from(vertex.normal).length() - 1.0).abs() < 1e-3,
                    "{name} mesh {k}: {:?}",
                    vertex.normal
                );
            }
        }
        assert!(scene.instances.iter().all(|i| (i.mesh as usize) < scene.meshes.len()));
        for texture in &scene.textures {
            assert!(texture.width_px <= 256 && texture.height_px <= 256);
            assert_eq!(texture.rgba.len(), 4 * (texture.width_px * texture.height_px) as usize);
        }
    }
}

/// Single-sided triangles agree with their shading normals, and watertight meshes enclose a positive volume.
#[test]
fn faces_look_outwards() {
    let mut watertight = 0;
    for name in names().filter(|name| !name.ends_with("-moving")) {
        let scene = loaded(name);
        for (k, mesh) in scene.meshes.iter().enumerate() {
            if scene.materials[mesh.material as usize].double_sided {
                continue;
            }
            let mut against = 0;
            for (t, [a, b, c]) in mesh.indices.chunks_exact(3).zip(corners(mesh)) {
                let geometric = (b - a).cross(c - a);
                let shading: Vec3 = t.iter().map(|&i| Vec3::from(mesh.vertices[i as usize].normal)).sum();
                against += usize::from(geometric.dot(shading) <= 0.0);
            }
            assert!(against * 100 <= mesh.indices.len() / 3, "{name} mesh {k}: {against} triangles face inwards");
            if is_watertight(mesh) {
                let volume: f32 = corners(mesh).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum();
                assert!(volume > 0.0, "{name} mesh {k}: volume {volume}");
                watertight += 1;
            }
        }
    }
    assert!(watertight > 100, "{watertight} closed meshes");
}

/// Whether every edge has a partner that runs the other way, by position.
fn is_watertight(mesh: &Mesh) -> bool {
    let mut edges: HashMap<[[i32; 3]; 2], i32> = HashMap::new();
    let key = |p: Vec3| (p * 2e4).round().as_ivec3().to_array();
    for [a, b, c] in corners(mesh) {
        for (from, to) in [(a, b), (b, c), (c, a)].map(|(from, to)| (key(from), key(to))) {
            *edges.entry([from, to]).or_default() += 1;
            *edges.entry([to, from]).or_default() -= 1;
        }
    }
    edges.values().all(|&count| count == 0)
}

#[test]
fn a_meadow_has_as_many_blades_as_its_name_says() {
    let (usual, dense) = (loaded("grass-36-blades"), loaded("grass-144-blades"));
    assert!(usual.meshes == loaded("grass").meshes);
    // Nine triangles a blade, 144 tufts.
    assert_eq!(dense.triangle_count() - usual.triangle_count(), 144 * 108 * 9);
    assert!(load("grass-0-blades").is_none() && load("grass--blades").is_none() && load("grass-2305-blades").is_none());
}

#[test]
fn building_twice_gives_the_same() {
    for name in names() {
        let (a, b) = (loaded(name), loaded(name));
        assert!(a.meshes == b.meshes && a.textures == b.textures && a.instances == b.instances, "{name}");
        assert_eq!(a.at(3.25).world_from_mesh, b.at(3.25).world_from_mesh, "{name}");
    }
}

/// The largest distance any corner of an instance's bounds, or any deformed vertex, moved.
fn moved_m(scene: &Scene, before: &Snapshot, after: &Snapshot) -> f64 {
    let mut most = 0.0f64;
    for (index, instance) in scene.instances.iter().enumerate() {
        let [low, high] = scene.meshes[instance.mesh as usize].bounds;
        let (a, b) = (before.world_from_mesh[index], after.world_from_mesh[index]);
        for k in 0..8 {
            let pick = |axis: usize| f64::from(if k >> axis & 1 == 0 { low[axis] } else { high[axis] });
            let corner = DVec3::new(pick(0), pick(1), pick(2));
            most = most.max(a.transform_point3(corner).distance(b.transform_point3(corner)));
        }
    }
    for (a, b) in before.deformed.iter().zip(&after.deformed) {
        assert_eq!((a.instance, a.vertices.len()), (b.instance, b.vertices.len()));
        for (p, q) in a.vertices.iter().zip(&b.vertices) {
            most = most.max(f64::from(Vec3::from(p.position).distance(Vec3::from(q.position))));
        }
    }
    most
}

#[test]
fn moving_variants_move_smoothly_and_repeat() {
    for name in names().chain(reflecting()).filter(|name| name.ends_with("-moving")) {
        let scene = loaded(name);
        assert!(scene.is_animated());
        let period_s = scene_period_s(name);
        let (start, later) = (scene.at(0.0), scene.at(0.7));
        assert!(moved_m(&scene, &start, &later) > 0.005, "{name} moves");
        let again = moved_m(&scene, &scene.at(0.7), &scene.at(0.7 + period_s));
        assert!(again < 1e-6, "{name} comes around after {period_s} s: {again}");
        // 30 m/s is more than anything here, corners around wheels included.
        for k in 0..40 {
            let t = f64::from(k) / 40.0 * period_s + if k == 0 { -1.0 / 120.0 } else { 0.0 };
            let step = moved_m(&scene, &scene.at(t), &scene.at(t + 1.0 / 60.0));
            assert!(step < 30.0 / 60.0, "{name} jumps {step} m at {t} s");
            assert_eq!(scene.places(t), scene.at(t).world_from_mesh);
        }
        let far = scene.at(-86_400.0 * 365.0);
        assert!(far.world_from_mesh.iter().all(|m| m.is_finite()));
    }
}

#[test]
fn still_scenes_show_the_same_geometry_and_stay() {
    for still in names().chain(reflecting()).filter(|name| !name.ends_with("-moving")) {
        let (a, b) = (loaded(still), loaded(&format!("{still}-moving")));
        assert!(!a.is_animated() && a.meshes == b.meshes && a.textures == b.textures, "{still}");
        let (first, later) = (a.at(0.0), a.at(7.3));
        assert_eq!(first.world_from_mesh, later.world_from_mesh);
        assert!(first.deformed.is_empty() && later.deformed.is_empty());
    }
}

#[test]
fn walkers_have_room() {
    for name in names().chain(reflecting()).filter(|name| !name.ends_with("-moving")) {
        let scene = loaded(name);
        let eyes = walk_eyes(name);
        assert_eq!(scene.walk, !eyes.is_empty(), "{name}");
        if !scene.walk {
            continue;
        }
        assert!(eyes.len() >= 8, "{name}: {} eyes", eyes.len());
        let snapshot = scene.at(0.0);
        for eye in eyes.iter().chain(&scene.start) {
            assert!((eye.forward_world.length() - 1.0).abs() < 1e-9);
            let free_m = clearance_m(&scene, &snapshot, eye.eye_world);
            assert!(free_m > 0.4, "{name}: {free_m} m free around {:?}", eye.eye_world);
        }
    }
}

#[test]
fn paths_past_reflectors_keep_clear_of_everything() {
    for name in reflecting() {
        let scene = loaded(name);
        let path = reflection_path(name).expect("every reflecting scene has one");
        assert_eq!((path.poses.len(), path.poses[59].t_s), (60, 5.9), "{name}");
        for pose in path.poses.iter().step_by(6) {
            let free_m = clearance_m(&scene, &scene.at(pose.t_s), pose.world_from_eye.translation);
            assert!(free_m > 0.15, "{name} at {} s: {free_m} m free", pose.t_s);
        }
    }
    assert!(names().all(|name| reflection_path(name).is_none()));
}

#[test]
fn stiff_scenes_are_what_they_say() {
    for name in stiff() {
        let scene = loaded(name);
        assert!(!names().any(|listed| listed == name));
        let (bounds, eye) = (scene.bounds, scene.start.expect("stiff scenes have a start").eye_world);
        assert!(bounds.radius_m().is_finite() && bounds.radius_m() > 0.0, "{name}: {bounds:?}");
        let reach = (eye - bounds.centre()).length() + bounds.radius_m();
        match name.strip_suffix("-moving").unwrap_or(name) {
            "far" => assert!(bounds.centre().length() > 1e7 && bounds.radius_m() < 2.0),
            "tiny" => assert!(reach < 1e-3),
            "huge" => assert!(reach > 5e5),
            "near-far" => assert!(reach > 1e5),
            _ => {
                assert_eq!(scene.warnings.len(), 1);
                assert!(
                    scene.warnings[0].contains("2 triangles with corners that are not finite"),
                    "{:?}",
                    scene.warnings
                );
                assert!(scene.warnings[0].contains("1 triangles without area"), "{:?}", scene.warnings);
            }
        }
    }
}

/// Distance to the nearest triangle.
fn clearance_m(scene: &Scene, snapshot: &Snapshot, point: DVec3) -> f64 {
    let mut nearest = f64::INFINITY;
    for (instance, world_from_mesh) in scene.instances.iter().zip(&snapshot.world_from_mesh) {
        let mesh = &scene.meshes[instance.mesh as usize];
        let local = world_from_mesh.inverse().transform_point3(point).as_vec3();
        let (low, high) = (Vec3::from(mesh.bounds[0]), Vec3::from(mesh.bounds[1]));
        if local.distance(local.clamp(low, high)) > 1.0 {
            continue;
        }
        for triangle in corners(mesh) {
            nearest = nearest.min(f64::from(distance(local, triangle)));
        }
    }
    nearest
}

/// From a point to a triangle (Ericson 2005, "Real-Time Collision Detection", section 5.1.5, in the form of edges and plane).
fn distance(p: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    let edge = |a: Vec3, b: Vec3| {
        let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        p.distance(a + (b - a) * t)
    };
    let normal = (b - a).cross(c - a);
    let inside = [(a, b), (b, c), (c, a)].iter().all(|&(s, e)| normal.cross(e - s).dot(p - s) >= 0.0);
    let edges = edge(a, b).min(edge(b, c)).min(edge(c, a));
    if inside { edges.min(((p - a).dot(normal) / normal.length()).abs()) } else { edges }
}
