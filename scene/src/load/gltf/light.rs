//! Lights (`KHR_lights_punctual`) and cameras of nodes.

use glam::{DAffine3, DVec3};

use super::document::{self, Document};
use super::panel::Rectangle;
use crate::load::Warnings;
use crate::model::SceneCamera;
use crate::{LightArea, SceneLight};

/// A light and the node that carries it.
#[derive(Debug)]
pub(super) struct NodeLight {
    pub node: usize,
    kind: Kind,
    colour: [f32; 3],
    range_m: f32,
    area: Option<Area>,
}

/// What a light shines from, in its node's xy plane, in metres: it faces along -z as the light does.
#[derive(Debug, Clone, Copy)]
struct Area {
    half: [f64; 2],
    is_disc: bool,
}

impl Area {
    /// `radius` or `size` of a light's `extras`; `None` where there is neither, or what is there is none.
    fn of(extras: &serde_json::Value) -> Option<Area> {
        let length = |value: &serde_json::Value| value.as_f64().filter(|length| *length >= 0.0 && length.is_finite());
        if let Some(radius) = extras.get("radius") {
            return length(radius).map(|radius| Area { half: [radius; 2], is_disc: true });
        }
        let [width, height] = extras.get("size")?.as_array()?.as_slice() else { return None };
        Some(Area { half: [length(width)? / 2.0, length(height)? / 2.0], is_disc: false })
    }

    /// Turned with its node, not scaled: as distances of lights are.
    fn placed(self, world_from_node: &DAffine3) -> LightArea {
        let along = |axis: DVec3, instead: DVec3| world_from_node.transform_vector3(axis).normalize_or(instead);
        let right = along(DVec3::X, DVec3::X);
        let up = along(DVec3::Y, DVec3::Y).reject_from(right).normalize_or(right.any_orthonormal_vector());
        // Front is where the cross product points: -z.
        LightArea { half_world: [up * self.half[1], right * self.half[0]], is_disc: self.is_disc }
    }
}

#[derive(Debug)]
enum Kind {
    Directional,
    Point,
    Spot {
        inner_rad: f32,
        outer_rad: f32,
    },
    /// A rectangle in its mesh's space that emits `NodeLight::colour` a square metre.
    Panel {
        rectangle: Rectangle,
        node_from_mesh: DAffine3,
        double_sided: bool,
    },
}

impl NodeLight {
    /// The lights of the given nodes.
    pub fn read(document: &Document, visible: &[usize], warnings: &mut Warnings) -> Vec<NodeLight> {
        let mut lights = Vec::new();
        for &node in visible {
            let Some(reference) = &document.nodes[node].extensions.light else { continue };
            let Some(light) = document.lights.get(reference.light) else {
                warnings.add(format!("nodes[{node}]: light {} does not exist", reference.light));
                continue;
            };
            match NodeLight::of(node, light) {
                Some(placed) => {
                    let is_area = ["radius", "size"].iter().any(|name| light.extras.get(name).is_some());
                    if is_area && placed.area.is_none() {
                        warnings
                            .add(format!("nodes[{node}]: radius or size of light {} is no length", reference.light));
                    }
                    lights.push(placed);
                }
                None => {
                    warnings.add(format!("nodes[{node}]: light {} is of no known type or not finite", reference.light));
                }
            }
        }
        lights
    }

    /// A rectangle of a node's mesh that emits light.
    pub fn panel(
        node: usize,
        (rectangle, node_from_mesh): (Rectangle, DAffine3),
        (emissive, double_sided): ([f32; 3], bool),
    ) -> NodeLight {
        let kind = Kind::Panel { rectangle, node_from_mesh, double_sided };
        NodeLight { node, kind, colour: emissive, range_m: f32::INFINITY, area: None }
    }

    /// What it sends at most towards a place, for comparison with others of its kind.
    pub fn strength(&self, worlds: &[DAffine3]) -> f32 {
        let (SceneLight::Point { colour, .. } | SceneLight::Directional { colour, .. }) = self.placed(worlds);
        colour.iter().sum()
    }

    fn of(node: usize, light: &document::Light) -> Option<NodeLight> {
        let outer_rad = light.spot.outer_cone_angle.unwrap_or(std::f32::consts::FRAC_PI_4);
        let kind = match light.kind.as_str() {
            "directional" => Kind::Directional,
            "point" => Kind::Point,
            "spot" => Kind::Spot { inner_rad: light.spot.inner_cone_angle, outer_rad },
            _ => return None,
        };
        let colour = light.color.unwrap_or([1.0; 3]).map(|c| c * light.intensity.unwrap_or(1.0));
        let range_m = light.range.unwrap_or(f32::INFINITY);
        let area = Area::of(&light.extras).filter(|_| !matches!(kind, Kind::Directional));
        let usable = colour.iter().all(|c| c.is_finite() && *c >= 0.0) && range_m > 0.0;
        usable.then_some(NodeLight { node, kind, colour, range_m, area })
    }

    /// In its place; lights shine along -z of their node.
    pub fn placed(&self, worlds: &[DAffine3]) -> SceneLight {
        let world_from_node = &worlds[self.node];
        let direction_world = forward(world_from_node);
        match self.kind {
            Kind::Directional => SceneLight::Directional { direction_world, colour: self.colour },
            Kind::Panel { rectangle, node_from_mesh, double_sided } => {
                let world_from_mesh = *world_from_node * node_from_mesh;
                let half_world = rectangle.half.map(|half| world_from_mesh.transform_vector3(half));
                let across = half_world[0].cross(half_world[1]);
                let mirrored = world_from_mesh.matrix3.determinant() < 0.0;
                let front = across.normalize_or(DVec3::NEG_Y) * if mirrored { -1.0 } else { 1.0 };
                let [u, v] = half_world;
                SceneLight::Point {
                    position_world: world_from_mesh.transform_point3(rectangle.middle),
                    colour: self.colour.map(|radiance| radiance * (4.0 * across.length()) as f32),
                    direction_world: front,
                    spot_angles_rad: (!double_sided).then_some([0.0, std::f32::consts::FRAC_PI_2]),
                    range_m: self.range_m,
                    area: Some(LightArea { half_world: if mirrored { [v, u] } else { [u, v] }, is_disc: false }),
                }
            }
            Kind::Point | Kind::Spot { .. } => SceneLight::Point {
                position_world: world_from_node.translation,
                colour: self.colour,
                direction_world,
                spot_angles_rad: match self.kind {
                    Kind::Spot { inner_rad, outer_rad } => Some([inner_rad, outer_rad]),
                    _ => None,
                },
                range_m: self.range_m,
                area: self.area.map(|area| area.placed(world_from_node)),
            },
        }
    }
}

fn forward(world_from_node: &DAffine3) -> DVec3 {
    world_from_node.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Z)
}

/// The perspective cameras of the given nodes, in the nodes' order, each with the names that it goes by.
pub(super) fn cameras<'a>(
    document: &'a Document,
    visible: &[usize],
    worlds: &[DAffine3],
    warnings: &mut Warnings,
) -> Vec<(Vec<&'a str>, SceneCamera)> {
    let mut cameras = Vec::new();
    for &node in visible {
        let Some(index) = document.nodes[node].camera else { continue };
        let Some(camera) = document.cameras.get(index) else {
            warnings.add(format!("nodes[{node}]: camera {index} does not exist"));
            continue;
        };
        let fov_y_rad = camera.perspective.as_ref().map(|perspective| perspective.yfov);
        match fov_y_rad.filter(|fov| camera.kind == "perspective" && *fov > 0.0 && *fov < std::f64::consts::PI) {
            Some(fov_y_rad) => {
                let names =
                    [&camera.name, &document.nodes[node].name].into_iter().flatten().map(String::as_str).collect();
                let (eye_world, forward_world) = (worlds[node].translation, forward(&worlds[node]));
                cameras.push((names, SceneCamera { eye_world, forward_world, fov_y_rad }));
            }
            None => warnings.add(format!("cameras[{index}]: only perspective cameras are used")),
        }
    }
    cameras
}
