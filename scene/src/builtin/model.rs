//! A model in the place of the thing that reflects.

use glam::{DVec3, Vec3};

use super::{Scene, load, reflecting};
use crate::{Bounds, Mesh, Vertex};

/// The scene `name` of [`reflecting()`] in which `model`, all of it at its time 0, reflects in the place of what does: as large as fits
/// into the box of that, standing where that stands, of the same material. Its name is both names with a plus between. `None` for other
/// names, and where the model has no extent.
pub fn load_with(name: &str, model: &Scene) -> Option<Scene> {
    let mut scene = load(name).filter(|_| reflecting().any(|reflecting| reflecting == name))?;
    let is_reflector = |name: &str| name.contains("mirror") || name.contains("glass");
    let reflector = scene.instances.iter().find(|instance| is_reflector(&instance.name))?.mesh as usize;
    scene.meshes[reflector] = in_place_of(&scene.meshes[reflector], model)?;
    scene.name = format!("{name}+{}", model.name);
    Some(scene)
}

/// All triangles of a model, scaled into the box of a mesh, with its material.
fn in_place_of(mesh: &Mesh, model: &Scene) -> Option<Mesh> {
    let (vertices, indices) = joined(model);
    let mut from = Bounds::EMPTY;
    vertices.iter().for_each(|(position, _)| from.include(*position));
    let [low, high] = mesh.bounds.map(|corner| Vec3::from(corner).as_dvec3());
    let scale = ((high - low) / (from.max - from.min)).min_element();
    if from.is_empty() || !(scale > 0.0 && scale.is_finite()) {
        return None;
    }
    let (foot, foot_of_model) = (low.midpoint(high).with_y(low.y), from.centre().with_y(from.min.y));
    let placed = |(position, vertex): &(DVec3, Vertex)| {
        let position = (foot + (position - foot_of_model) * scale).as_vec3();
        Vertex { position: position.into(), colour: [255; 4], ..*vertex }
    };
    let vertices: Vec<Vertex> = vertices.iter().map(placed).collect();
    let positions = || vertices.iter().map(|vertex| Vec3::from(vertex.position));
    let bounds = [positions().reduce(Vec3::min)?.into(), positions().reduce(Vec3::max)?.into()];
    Some(Mesh { vertices, indices, material: mesh.material, bounds, ..Mesh::default() })
}

/// The vertices of all instances, in world space at time 0, each with its normal turned, and the triangles of them.
fn joined(model: &Scene) -> (Vec<(DVec3, Vertex)>, Vec<u32>) {
    let snapshot = model.at(0.0);
    let (mut vertices, mut indices) = (Vec::new(), Vec::new());
    for (id, (instance, place)) in model.instances.iter().zip(&snapshot.world_from_mesh).enumerate() {
        let mesh = &model.meshes[instance.mesh as usize];
        let deformed = snapshot.deformed.iter().find(|deformed| deformed.instance as usize == id);
        let normal_from_mesh = place.matrix3.inverse().transpose();
        let first = vertices.len() as u32;
        vertices.extend(deformed.map_or(&mesh.vertices, |deformed| &deformed.vertices).iter().map(|vertex| {
            let normal = (normal_from_mesh * Vec3::from(vertex.normal).as_dvec3()).normalize_or(DVec3::Y);
            let position = place.transform_point3(Vec3::from(vertex.position).as_dvec3());
            (position, Vertex { normal: normal.as_vec3().into(), ..*vertex })
        }));
        indices.extend(mesh.indices.iter().map(|index| first + index));
    }
    (vertices, indices)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_reflects_in_the_place_of_the_pot_at_its_size() {
        let model = load("cars").expect("it is built in");
        let (before, after) = (load("mirror-teapots"), load_with("mirror-teapots", &model));
        let (before, after) = (before.expect("it is built in"), after.expect("a model"));
        assert_eq!(after.name, "mirror-teapots+cars");
        let mirror = |scene: &Scene| {
            let found = scene.instances.iter().position(|instance| instance.name == "mirror teapot");
            found.expect("it is there")
        };
        let object = mirror(&after);
        let [pot, cars] = [&before, &after].map(|scene| &scene.meshes[scene.instances[object].mesh as usize]);
        assert_eq!((mirror(&before), pot.material), (object, cars.material));
        assert_eq!(cars.indices.len() as u64 / 3, model.triangle_count());
        let [pot, cars] = [pot, cars].map(|mesh| mesh.bounds.map(|corner| Vec3::from(corner).as_dvec3()));
        let (sides, sides_of_pot, of_model) = (cars[1] - cars[0], pot[1] - pot[0], model.bounds.max - model.bounds.min);
        let shares = sides / sides_of_pot;
        assert!((shares.max_element() - 1.0).abs() < 1e-5, "it fills the box: {shares}");
        let scales = sides / of_model;
        assert!(scales.max_element() / scales.min_element() < 1.0 + 1e-5, "in its own proportions: {scales}");
        assert!((cars[0].y - pot[0].y).abs() < 1e-6, "on the table");
        assert!(load_with("teapots", &model).is_none() && load_with("no such scene", &model).is_none());
        let nothing = Scene { instances: Vec::new(), ..model };
        assert!(load_with("mirror-teapots", &nothing).is_none());
    }
}
