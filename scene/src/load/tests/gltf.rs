//! What a glTF file means.

use std::f32::consts::FRAC_1_SQRT_2;

use glam::DVec3;
use serde_json::json;

use super::build::{Builder, TRIANGLE};
use super::{assert_near, first_triangle, load_chosen, load_gltf, refusal};
use crate::Scene;
use crate::load::{Choice, LoadError, LoadLimits, Offer};
use crate::model::{Quantity, UvMap, UvSet};

fn triangle_with(change: impl FnOnce(&mut Builder)) -> Scene {
    let mut builder = Builder::of_positions(&TRIANGLE);
    change(&mut builder);
    load_gltf(&builder.glb()).unwrap()
}

/// Twice the area of the first triangle along its normal, in world space.
fn face(scene: &Scene) -> DVec3 {
    let [a, b, c] = first_triangle(scene, 0.0);
    (b - a).cross(c - a)
}

#[test]
fn vertices_far_from_the_origin_keep_what_the_file_has() {
    let far = 1e7;
    let scene = load_gltf(&Builder::of_positions(&TRIANGLE.map(|x| x + far)).glb()).unwrap();
    assert!(scene.meshes[0].vertices.iter().flat_map(|v| v.position).all(|x| x.abs() <= 1.0));
    assert_eq!(first_triangle(&scene, 0.0)[1], DVec3::new(1e7 + 1.0, 1e7, 1e7));
}

#[test]
fn a_node_far_from_the_origin_keeps_the_precision_of_the_text() {
    let scene = triangle_with(|b| b.json["nodes"][0]["translation"] = json!([10_000_000.123, 0.0, -20_000_000.456]));
    let origin = first_triangle(&scene, 0.0)[0];
    assert!((origin - DVec3::new(10_000_000.123, 0.0, -20_000_000.456)).length() < 1e-7, "{origin}");
}

#[test]
fn a_mirroring_transform_keeps_the_facing_of_the_normal() {
    let scene = triangle_with(|b| b.json["nodes"][0]["scale"] = json!([-2.0, 1.0, 1.0]));
    // The flat normal is +z in mesh space, and +z still after the mirroring of x, which turns the winding round.
    assert!(face(&scene).dot(DVec3::Z) < 0.0);
    assert_eq!(scene.meshes[0].vertices[0].normal, [0.0, 0.0, 1.0]);
    assert_near(first_triangle(&scene, 0.0)[1], [-2.0, 0.0, 0.0]);
}

#[test]
fn a_matrix_may_shear() {
    let scene = triangle_with(|b| {
        b.json["nodes"][0]["matrix"] = json!([1, 0, 0, 0, 0.5, 1, 0, 0, 0, 0, 1, 0, 3, 0, 0, 1]);
    });
    assert_near(first_triangle(&scene, 0.0)[2], [3.5, 1.0, 0.0]);
}

#[test]
fn a_flattening_transform_is_left_out_by_name() {
    let mut builder = Builder::of_positions(&TRIANGLE);
    builder.json["nodes"][0]["scale"] = json!([1.0, 0.0, 1.0]);
    let error = refusal(load_gltf(&builder.glb()));
    assert!(error.contains("nodes[0]") && error.contains("flattens"), "{error}");
}

#[test]
fn keyframes_step_interpolate_and_repeat() {
    let values = [0.0, 0.0, 0.0, 2.0, 0.0, 0.0];
    let x_at = |scene: &Scene, time_s| first_triangle(scene, time_s)[0].x;
    let linear = triangle_with(|b| b.animate("translation", "LINEAR", &[0.0, 2.0], &values, "VEC3"));
    assert!(linear.instances[0].moves && !linear.instances[0].deforms && linear.is_animated());
    for (time_s, x) in [(0.0, 0.0), (0.5, 0.5), (1.5, 1.5), (2.5, 0.5), (-0.5, 1.5), (20_000.5, 0.5)] {
        assert!((x_at(&linear, time_s) - x).abs() < 1e-6, "{} at {time_s}, not {x}", x_at(&linear, time_s));
    }
    let step = triangle_with(|b| b.animate("translation", "STEP", &[0.0, 2.0], &values, "VEC3"));
    assert_eq!(x_at(&step, 1.9), 0.0);
    // In-tangent, value, out-tangent; flat tangents ease in and out, and the middle is still the mean.
    let cubic = [[0.0; 3], [0.0; 3], [0.0; 3], [0.0; 3], [2.0, 0.0, 0.0], [0.0; 3]].concat();
    let cubic = triangle_with(|b| b.animate("translation", "CUBICSPLINE", &[0.0, 2.0], &cubic, "VEC3"));
    assert!((x_at(&cubic, 1.0) - 1.0).abs() < 1e-6);
    assert!((x_at(&cubic, 0.5) - 2.0 * (3.0 / 16.0 - 2.0 / 64.0)).abs() < 1e-6);
    assert!(x_at(&cubic, f64::NAN).is_finite());
}

#[test]
fn rotations_take_the_shorter_arc() {
    let half_turn = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -FRAC_1_SQRT_2, -FRAC_1_SQRT_2];
    let scene = triangle_with(|b| {
        b.animate("rotation", "LINEAR", &[0.0, 1.0, 2.0], &[&half_turn[..], &half_turn[4..]].concat(), "VEC4");
    });
    let cos = std::f64::consts::FRAC_1_SQRT_2;
    assert_near(first_triangle(&scene, 0.5)[1], [cos, cos, 0.0]);
}

#[test]
fn clips_of_different_nodes_play_together_and_of_the_same_only_the_first() {
    let values = [0.0, 0.0, 0.0, 2.0, 0.0, 0.0];
    let scene = triangle_with(|b| {
        b.push("nodes", json!({"mesh": 0}));
        b.json["scenes"][0]["nodes"] = json!([0, 1]);
        b.animate("translation", "LINEAR", &[0.0, 2.0], &values, "VEC3");
        b.animate("translation", "LINEAR", &[0.0, 2.0], &values, "VEC3");
        b.json["animations"][1]["channels"][0]["target"]["node"] = json!(1);
    });
    assert!(scene.instances.iter().all(|instance| instance.moves) && scene.warnings.is_empty());
    let scene = triangle_with(|b| {
        b.animate("translation", "LINEAR", &[0.0, 2.0], &values, "VEC3");
        b.animate("translation", "LINEAR", &[0.0, 2.0], &values.map(|x| 5.0 * x), "VEC3");
    });
    assert_near(first_triangle(&scene, 1.0)[0], [1.0, 0.0, 0.0]);
    assert!(scene.warnings[0].contains("of 2 animations only the first"), "{:?}", scene.warnings);
}

#[test]
fn morph_targets_move_vertices_and_flat_normals_follow() {
    let lift = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    let scene = triangle_with(|b| {
        let target = b.floats(&lift, "VEC3");
        b.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": target}]);
        b.animate("weights", "LINEAR", &[0.0, 1.0], &[0.0, 1.0], "SCALAR");
    });
    assert!(scene.instances[0].deforms && !scene.instances[0].moves);
    assert_near(first_triangle(&scene, 0.5)[2], [0.0, 1.0, 0.5]);
    let normal = scene.at(0.5).deformed[0].vertices[0].normal;
    let expected = DVec3::new(0.0, -0.5, 1.0).normalize();
    assert_near(DVec3::from(normal.map(f64::from)), expected.to_array());
}

#[test]
fn morph_weights_that_stay_are_baked() {
    let scene = triangle_with(|b| {
        let target = b.floats(&[0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0], "VEC3");
        b.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": target}]);
        b.json["meshes"][0]["weights"] = json!([0.25]);
    });
    assert!(!scene.is_animated());
    assert_near(first_triangle(&scene, 0.0)[0], [0.0, 0.0, 0.5]);
}

#[test]
fn joints_carry_vertices_and_the_node_of_a_skinned_mesh_does_not() {
    let scene = triangle_with(|b| {
        b.push("nodes", json!({"translation": [10_000_000.5, 0.0, 0.0]}));
        b.json["scenes"][0]["nodes"] = json!([0, 1]);
        b.json["nodes"][0]["translation"] = json!([7.0, 7.0, 7.0]);
        b.json["nodes"][0]["skin"] = json!(0);
        b.push("skins", json!({"joints": [1]}));
        let joints = b.accessor(&[0; 12], 5121, "VEC4", 3);
        let weights = b.floats(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], "VEC4");
        let attributes = &mut b.json["meshes"][0]["primitives"][0]["attributes"];
        attributes["JOINTS_0"] = json!(joints);
        attributes["WEIGHTS_0"] = json!(weights);
        let quarter_turn = [0.0, 0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2];
        b.animate("rotation", "STEP", &[0.0, 1.0], &[quarter_turn, quarter_turn].concat(), "VEC4");
        b.json["animations"][0]["channels"][0]["target"]["node"] = json!(1);
    });
    assert!(scene.instances[0].deforms);
    let [a, b, c] = first_triangle(&scene, 0.5);
    assert_near(a, [10_000_000.5, 0.0, 0.0]);
    assert_near(b, [10_000_000.5, 1.0, 0.0]);
    assert_near(c, [9_999_999.5, 0.0, 0.0]);
    assert!(scene.at(0.5).deformed[0].vertices.iter().flat_map(|v| v.position).all(|x| x.abs() < 3.0));
}

#[test]
fn strips_and_fans_keep_their_facing() {
    let square = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
    let fan = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];
    for (mode, positions) in [(5, square), (6, fan)] {
        let mut builder = Builder::of_positions(&positions);
        builder.json["meshes"][0]["primitives"][0]["mode"] = json!(mode);
        let scene = load_gltf(&builder.glb()).unwrap();
        assert_eq!(scene.triangle_count(), 2);
        assert!(scene.meshes[0].vertices.iter().all(|v| v.normal == [0.0, 0.0, 1.0]), "mode {mode}");
    }
}

#[test]
fn sparse_and_quantized_accessors() {
    let scene = triangle_with(|b| {
        let indices = b.view(&[2]);
        let values = b.view(bytemuck::cast_slice(&[0.0_f32, 4.0, 0.0]));
        b.json["accessors"][0]["sparse"] = json!({
            "count": 1,
            "indices": {"bufferView": indices, "componentType": 5121},
            "values": {"bufferView": values},
        });
    });
    assert_near(first_triangle(&scene, 0.0)[2], [0.0, 4.0, 0.0]);
    let scene = triangle_with(|b| {
        let shorts: [i16; 12] = [0, 0, 0, 0, i16::MAX, 0, 0, 0, 0, i16::MIN, 0, 0];
        let accessor = b.accessor(bytemuck::cast_slice(&shorts), 5122, "VEC3", 3);
        b.json["accessors"][accessor]["normalized"] = json!(true);
        b.json["bufferViews"][accessor]["byteStride"] = json!(8);
        b.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
        b.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        b.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(accessor);
    });
    // The smallest short is clamped to -1.
    assert_near(first_triangle(&scene, 0.0)[1], [1.0, 0.0, 0.0]);
    assert_near(first_triangle(&scene, 0.0)[2], [0.0, -1.0, 0.0]);
}

#[test]
fn meshopt_views_are_decompressed_and_damage_is_named() {
    let vertices: Vec<[f32; 3]> = TRIANGLE.as_chunks::<3>().0.to_vec();
    let compressed = meshopt::encode_vertex_buffer(&vertices).unwrap();
    let build = |bytes: &[u8]| {
        let mut builder = Builder::of_positions(&TRIANGLE);
        builder.view(bytes);
        let offset = builder.json["bufferViews"][1]["byteOffset"].clone();
        builder.json["bufferViews"][0]["extensions"] = json!({"EXT_meshopt_compression": {
            "buffer": 0, "byteOffset": offset, "byteLength": bytes.len(), "byteStride": 12, "count": 3, "mode": "ATTRIBUTES",
        }});
        builder.json["extensionsUsed"] = json!(["EXT_meshopt_compression"]);
        load_gltf(&builder.glb())
    };
    assert_near(first_triangle(&build(&compressed).unwrap(), 0.0)[1], [1.0, 0.0, 0.0]);
    let error = refusal(build(&compressed[..compressed.len() / 2]));
    assert!(error.contains("EXT_meshopt_compression") && error.contains("damaged"), "{error}");
}

#[test]
fn instancing_makes_objects_up_to_the_limit() {
    let build = |count: usize| {
        let mut builder = Builder::of_positions(&TRIANGLE);
        let places: Vec<f32> = (0..count).flat_map(|i| [i as f32, 0.0, 0.0]).collect();
        let accessor = builder.floats(&places, "VEC3");
        let colours: Vec<f32> = (0..count).flat_map(|i| [1.0, i as f32 * 0.2, 0.0]).collect();
        let colours = builder.floats(&colours, "VEC3");
        builder.json["nodes"][0]["extensions"] =
            json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": accessor, "_COLOR_0": colours}}});
        builder.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
        load_gltf(&builder.glb())
    };
    let scene = build(5).unwrap();
    assert_eq!((scene.instances.len(), scene.meshes.len()), (5, 1));
    assert_eq!(scene.bounds.max.x, 5.0);
    let tints: Vec<[u8; 3]> = scene.instances.iter().map(|instance| instance.tint).collect();
    assert_eq!(tints, [[255, 0, 0], [255, 51, 0], [255, 102, 0], [255, 153, 0], [255, 204, 0]]);
    let error = refusal(build((1 << 20) + 1));
    assert!(error.contains("instances") && error.contains("1048576"), "{error}");
}

#[test]
fn lights_and_cameras_stand_where_their_nodes_are() {
    let scene = triangle_with(|b| {
        b.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
            {"type": "spot", "intensity": 3.0, "color": [1.0, 0.5, 0.0], "spot": {"outerConeAngle": 0.5}}]}});
        b.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
        b.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}));
        let turned = json!({"rotation": [0.0, FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2], "translation": [1, 2, 3], "camera": 0,
            "extensions": {"KHR_lights_punctual": {"light": 0}}});
        b.push("nodes", turned);
        b.json["scenes"][0]["nodes"] = json!([0, 1]);
    });
    let start = scene.start.unwrap();
    assert_near(start.eye_world, [1.0, 2.0, 3.0]);
    assert_near(start.forward_world, [-1.0, 0.0, 0.0]);
    let crate::SceneLight::Point { position_world, colour, direction_world, spot_angles_rad, .. } =
        scene.at(0.0).lights[0]
    else {
        panic!("a spot is a point light with angles");
    };
    assert_near(position_world, [1.0, 2.0, 3.0]);
    assert_near(direction_world, [-1.0, 0.0, 0.0]);
    assert_eq!((colour, spot_angles_rad), ([3.0, 1.5, 0.0], Some([0.0, 0.5])));
}

#[test]
fn cameras_in_extras_are_in_their_nodes_space_and_bad_ones_are_named() {
    let bent = |of: &str| {
        json!({"graph_camera": {"fov_y_deg": 60, "size_px": [64, 36], "depth_m": 10, "operations": [
            {"bend": {"of": of, "at": {"after_m": 4}, "into": {"name": "on", "direction": [1, 0, -1], "depth_m": 5}}}]}})
    };
    let scene = triangle_with(|b| {
        b.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}));
        let turned = |name: &str, extras: serde_json::Value| {
            json!({"name": name, "rotation": [0.0, FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2], "translation": [1, 2, 3],
                "scale": [2, 2, 2], "camera": 0, "extras": extras})
        };
        b.push("nodes", turned("corner", bent("root")));
        b.push("nodes", turned("lost", bent("hall")));
        b.push("nodes", turned("corner", bent("root")));
        b.push("nodes", turned("odd", json!({"graph_camera": 7})));
        b.push("nodes", json!({"name": "eyeless", "extras": bent("root")}));
        let ball =
            json!({"single_pole": {"target": {"centre": [0, 0, -5], "radius_m": 1}, "size_px": [32, 32], "ring_m": 1}});
        b.push("nodes", turned("ball", ball));
        b.json["scenes"][0]["nodes"] = json!([0, 1, 2, 3, 4, 5, 6]);
    });
    let names: Vec<&str> = scene.named_cameras.iter().map(|named| named.name.as_str()).collect();
    assert_eq!(names, ["corner", "ball"]);
    let camera::Camera::Graph(graph) = &scene.named_cameras[0].camera else { panic!("a graph camera") };
    assert_near(graph.root().world_from_eye.translation, [1.0, 2.0, 3.0]);
    // It looks along -x as its node does, and four metres on, not eight, it turns to the right: towards -z.
    let pieces = graph.ray(32.0, 18.0);
    assert_near(pieces[0].to_world, [-3.0, 2.0, 3.0]);
    let on = (pieces[1].to_world - pieces[1].from_world).normalize();
    assert_near(on, [-0.5_f64.sqrt(), 0.0, -0.5_f64.sqrt()]);
    let camera::Camera::Spoc(ball) = &scene.named_cameras[1].camera else { panic!("a single-pole camera") };
    assert_near(ball.pinhole.world_from_eye.transform_vector(DVec3::Z), [-1.0, 0.0, 0.0]);
    for (name, why) in
        [("lost", "\"hall\""), ("corner", "another one"), ("odd", "invalid type"), ("eyeless", "no camera")]
    {
        let named = format!("camera {name:?}");
        let is_told = scene.warnings.iter().any(|warning| warning.contains(&named) && warning.contains(why));
        assert!(is_told, "{name}: {:?}", scene.warnings);
    }
}

#[test]
fn a_light_alone_may_move() {
    let lit = |node: u32| {
        triangle_with(|b| {
            b.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "point"}]}});
            b.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
            b.push("nodes", json!({"extensions": {"KHR_lights_punctual": {"light": 0}}}));
            b.json["scenes"][0]["nodes"] = json!([0, 1]);
            b.animate("translation", "LINEAR", &[0.0, 2.0], &[0.0, 0.0, 0.0, 2.0, 0.0, 0.0], "VEC3");
            b.json["animations"][0]["channels"][0]["target"]["node"] = json!(node);
        })
    };
    let x_at = |scene: &Scene, time_s| match scene.at(time_s).lights[0] {
        crate::SceneLight::Point { position_world, .. } => position_world.x,
        crate::SceneLight::Directional { .. } => f64::NAN,
    };
    let swinging = lit(1);
    assert!(swinging.lights_move && swinging.is_animated() && !swinging.instances[0].moves);
    assert_eq!((x_at(&swinging, 0.0), x_at(&swinging, 1.0)), (0.0, 1.0));
    let standing = lit(0);
    assert!(!standing.lights_move && standing.is_animated() && standing.instances[0].moves);
}

#[test]
fn lights_with_a_size_and_rectangles_that_emit_have_an_area() {
    let lamp = |extras: serde_json::Value| {
        let scene = triangle_with(|b| {
            b.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "point", "extras": extras}]}});
            b.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
            b.push("nodes", json!({"translation": [1, 2, 3], "scale": [9, 9, 9], "extensions": {"KHR_lights_punctual": {"light": 0}}}));
            b.json["scenes"][0]["nodes"] = json!([0, 1]);
        });
        let crate::SceneLight::Point { area, .. } = scene.at(0.0).lights[0] else { panic!("a point light") };
        (area, scene.warnings.join("; "))
    };
    let (disc, _) = lamp(json!({"radius": 0.25}));
    let disc = disc.expect("a disc");
    assert!(disc.is_disc);
    assert_near(disc.half_world[0].cross(disc.half_world[1]), [0.0, 0.0, -0.0625]);
    let (rectangle, _) = lamp(json!({"size": [2.0, 0.5]}));
    let rectangle = rectangle.expect("a rectangle");
    assert!(!rectangle.is_disc);
    assert_near(rectangle.half_world[1], [1.0, 0.0, 0.0]);
    assert_near(rectangle.half_world[0], [0.0, 0.25, 0.0]);
    assert_eq!(lamp(json!({"name": "anything"})).0, None);
    for extras in [json!({"radius": -1.0}), json!({"size": [1.0]}), json!({"size": "large"})] {
        let (area, warnings) = lamp(extras);
        assert!(area.is_none() && warnings.contains("radius or size of light 0 is no length"), "{warnings}");
    }

    let positions = [0., 0., 0., 0., 0., 1., 2., 0., 1., 0., 0., 0., 2., 0., 1., 2., 0., 0.];
    let mut builder = Builder::of_positions(&positions);
    builder.json["materials"] = json!([{"emissiveFactor": [1.0, 0.5, 0.0]}]);
    builder.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    builder.json["nodes"][0]["translation"] = json!([0, 5, 0]);
    let scene = load_gltf(&builder.glb()).unwrap();
    let lights = scene.at(0.0).lights;
    let [crate::SceneLight::Point { position_world, colour, direction_world, area: Some(area), .. }] = lights[..]
    else {
        panic!("a panel");
    };
    assert_near(position_world, [1.0, 5.0, 0.5]);
    assert_near(direction_world, [0.0, 1.0, 0.0]);
    assert_eq!(colour, [2.0, 1.0, 0.0], "two square metres");
    assert_near(area.half_world[0].cross(area.half_world[1]), [0.0, 0.5, 0.0]);
}

#[test]
fn a_room_seen_from_inside_is_walked_in_and_a_box_is_turned() {
    let box_of = |size: f32, inward: bool| {
        let corner = |i: usize| [i & 1, i >> 1 & 1, i >> 2].map(|bit| bit as f32 * size);
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let positions: Vec<f32> = quads
            .iter()
            .flat_map(|&[a, b, c, d]| if inward { [a, c, b, a, d, c] } else { [a, b, c, a, c, d] })
            .flat_map(corner)
            .collect();
        load_gltf(&Builder::of_positions(&positions).glb()).unwrap()
    };
    assert!(box_of(10.0, true).walk);
    assert!(!box_of(10.0, false).walk);
    assert!(!box_of(1.0, true).walk, "too small to walk in");
}

/// A document of one triangle with three sets of texture coordinates and a material; a texture of one grey texel, 51.
fn textured_triangle(material: serde_json::Value) -> Builder {
    let mut builder = Builder::of_positions(&TRIANGLE);
    let uvs = builder.floats(&[1.0, 0.0, 0.0, 1.0, 0.5, 0.5], "VEC2");
    let others = [builder.floats(&[0.0, 0.0, 1.0, 0.0, 1.0, 1.0], "VEC2"), builder.floats(&[0.25; 6], "VEC2")];
    let attributes = &mut builder.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["TEXCOORD_0"] = json!(uvs);
    attributes["TEXCOORD_1"] = json!(others[0]);
    attributes["TEXCOORD_2"] = json!(others[1]);
    builder.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    builder.json["materials"] = json!([material]);
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbaImage::from_pixel(1, 1, image::Rgba([51, 51, 51, 255]))
        .write_to(&mut png, image::ImageFormat::Png)
        .unwrap();
    let view = builder.view(&png.into_inner());
    builder.json["images"] = json!([{"bufferView": view, "mimeType": "image/png"}]);
    builder.json["textures"] = json!([{"source": 0}]);
    builder
}

fn with_material(material: serde_json::Value) -> Scene {
    load_gltf(&textured_triangle(material).glb()).unwrap()
}

#[test]
fn every_texture_of_a_material_lies_where_its_transform_says() {
    let with = |offset: [f32; 2], scale: [f32; 2], rotation: f32| json!({"index": 0, "extensions": {"KHR_texture_transform": {"offset": offset, "scale": scale, "rotation": rotation}}});
    let scene = with_material(json!({
        "pbrMetallicRoughness": {"baseColorTexture": with([0.5, 0.25], [2.0, 4.0], 0.0)},
        "normalTexture": {"index": 0, "scale": 0.5},
        "occlusionTexture": {"index": 0, "strength": 0.75},
        "emissiveTexture": with([0.0, 1.0], [3.0, 1.0], std::f32::consts::FRAC_PI_2),
    }));
    let uvs: Vec<[f32; 2]> = scene.meshes[0].vertices.iter().map(|vertex| vertex.uv).collect();
    assert_eq!(uvs, [[2.5, 0.25], [0.5, 4.25], [1.5, 2.25]]);
    let material = &scene.materials[0];
    let through = |map: UvMap, [u, v]: [f32; 2]| map.map(|[x, y, offset]| x * u + y * v + offset);
    let bumps = material.bumps.expect("a normal map");
    assert_eq!((through(bumps.from_uv, uvs[0]), through(bumps.from_uv, uvs[1])), ([1.0, 0.0], [0.0, 1.0]));
    assert_eq!(bumps.scale, 0.5);
    let [occlusion, emissive] = material.maps[..] else { panic!("two maps: {:?}", material.maps) };
    assert_eq!((occlusion.quantity, occlusion.strength), (Quantity::Occlusion, 0.75));
    assert_eq!(through(occlusion.from_uv, uvs[2]), [0.5, 0.5]);
    // (u, v) scaled to (3 u, v), turned to (v, -3 u), moved to (v, 1 - 3 u).
    let [u, v] = through(emissive.from_uv, uvs[2]);
    assert!((u - 0.5).abs() < 1e-6 && (v + 0.5).abs() < 1e-6, "{u} {v}");
}

#[test]
fn textures_of_what_nothing_shows_are_not_read() {
    let mut builder = textured_triangle(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    let unused = builder.push("images", json!({"uri": "data:image/png;base64,AAAA"}));
    let texture = builder.push("textures", json!({"source": unused}));
    builder.push("materials", json!({"emissiveTexture": {"index": texture}, "emissiveFactor": [1.0, 1.0, 1.0]}));
    let shown = load_gltf(&builder.glb()).unwrap();
    assert_eq!((shown.textures.len(), shown.warnings.len()), (1, 0), "{:?}", shown.warnings);
    let mut builder = textured_triangle(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    builder.json["images"][0] = json!({"uri": "data:image/png;base64,AAAA"});
    assert!(load_gltf(&builder.glb()).unwrap().warnings[0].contains("images[0] is left out"));
}

#[test]
fn a_texture_by_other_coordinates_makes_a_second_set_and_by_third_ones_is_named_and_left_out() {
    let scene = with_material(json!({
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 0, "texCoord": 2}},
        "normalTexture": {"index": 0, "texCoord": 1},
        "occlusionTexture": {"index": 0, "texCoord": 1, "extensions": {"KHR_texture_transform": {"scale": [2.0, 1.0]}}},
        "emissiveTexture": {"index": 0},
    }));
    let (material, mesh) = (&scene.materials[0], &scene.meshes[0]);
    let bumps = material.bumps.expect("a normal map");
    let sets: Vec<(Quantity, UvSet)> = material.maps.iter().map(|map| (map.quantity, map.uv_set)).collect();
    assert!(material.texture.is_some() && material.needs_second_uvs());
    assert_eq!(bumps.uv_set, UvSet::Second);
    // Which comes first has the set: what is left without one is that of metal and roughness or of occlusion.
    assert_eq!(sets, [(Quantity::Occlusion, UvSet::Second), (Quantity::Emissive, UvSet::First)]);
    assert_eq!(material.maps[0].from_uv[0], [2.0, 0.0, 0.0]);
    assert_eq!(mesh.second_uvs, [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]);
    assert_eq!(mesh.vertices[1].uv, [0.0, 1.0]);
    let named = |warning: &String| warning.contains("drawn without its metallic-roughness texture, which has a third");
    assert!(scene.warnings.iter().any(named), "{:?}", scene.warnings);
}

#[test]
fn a_mesh_whose_material_needs_one_set_has_no_second() {
    let scene = with_material(json!({
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 1}},
        "occlusionTexture": {"index": 0, "texCoord": 1},
    }));
    assert!(!scene.materials[0].needs_second_uvs() && scene.meshes[0].second_uvs.is_empty());
    assert_eq!(scene.meshes[0].vertices[1].uv, [1.0, 0.0]);
}

#[test]
fn extensions_of_materials_mean_what_they_say() {
    let scene = with_material(json!({"extensions": {
        "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1.0, 0.5, 0.25]},
        "KHR_materials_clearcoat": {"clearcoatFactor": 0.75, "clearcoatRoughnessFactor": 0.25, "clearcoatTexture": {"index": 0}},
        "KHR_materials_sheen": {"sheenColorFactor": [0.5, 0.25, 0.0], "sheenRoughnessFactor": 0.5},
        "KHR_materials_iridescence": {"iridescenceFactor": 1.0},
    }}));
    let material = &scene.materials[0];
    assert_eq!((material.specular, material.specular_colour), (0.5, [1.0, 0.5, 0.25]));
    assert_eq!((material.clearcoat, material.clearcoat_roughness), (0.75, 0.25));
    assert_eq!((material.sheen, material.sheen_roughness), ([0.5, 0.25, 0.0], 0.5));
    assert_eq!(material.maps.iter().map(|map| map.quantity).collect::<Vec<_>>(), [Quantity::Clearcoat]);
    assert!(scene.warnings.iter().any(|warning| warning.contains("without its iridescence")), "{:?}", scene.warnings);
    assert_eq!(material.smoothest(&scene.textures), 0.25, "of the coat");
    assert!((scene.textures[0].low(1) - 0.2).abs() < 1e-6);
    assert!(
        (scene.textures[0].mean(false)[0] - 0.2).abs() < 1e-6
            && (scene.textures[0].mean(true)[0] - 0.033_105).abs() < 1e-5
    );
}

#[test]
fn glossy_materials_mirror_what_they_say() {
    let scene = with_material(json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": {
        "diffuseFactor": [0.5, 0.25, 0.125, 1.0], "specularFactor": [0.2, 0.4, 0.8], "glossinessFactor": 0.75,
    }}}));
    let material = &scene.materials[0];
    assert_eq!((material.base_colour, material.metallic, material.roughness), ([0.5, 0.25, 0.125, 1.0], 0.0, 0.25));
    assert!(material.specular_colour.iter().zip([5.0, 10.0, 20.0]).all(|(a, b)| (a - b).abs() < 1e-4));
}

fn chosen(bytes: &[u8], choice: &Choice) -> Result<Scene, LoadError> {
    let load = |bytes: &[u8], request: &super::Request<'_>| crate::load::gltf::load(bytes.to_vec(), request);
    load_chosen(load, bytes, (&LoadLimits::default(), choice))
}

/// Two scenes of a triangle each, two cameras, and a material that is another one in the variant "night".
fn of_many() -> Vec<u8> {
    let mut b = Builder::of_positions(&TRIANGLE);
    b.push("nodes", json!({"mesh": 0, "translation": [5, 0, 0], "name": "beside"}));
    b.push("scenes", json!({"nodes": [1], "name": "second"}));
    b.push("cameras", json!({"type": "perspective", "name": "eye", "perspective": {"yfov": 1.0, "znear": 0.1}}));
    b.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}));
    b.push("nodes", json!({"camera": 0, "translation": [0, 0, 9]}));
    b.push("nodes", json!({"camera": 1, "translation": [0, 7, 0], "name": "above"}));
    b.json["scenes"][0]["nodes"] = json!([0, 2, 3]);
    b.push("materials", json!({"name": "day"}));
    b.push("materials", json!({"name": "dark"}));
    b.json["extensions"] = json!({"KHR_materials_variants": {"variants": [{"name": "noon"}, {"name": "night"}]}});
    b.json["extensionsUsed"] = json!(["KHR_materials_variants"]);
    b.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    b.json["meshes"][0]["primitives"][0]["extensions"] =
        json!({"KHR_materials_variants": {"mappings": [{"material": 1, "variants": [1]}]}});
    b.glb()
}

#[test]
fn scenes_variants_and_cameras_are_chosen_by_name_or_number() {
    let bytes = of_many();
    let some = |text: &str| Some(text.to_owned());
    let shown = chosen(&bytes, &Choice::default()).unwrap();
    assert_near(shown.start.unwrap().eye_world, [0.0, 0.0, 9.0]);
    let material = |scene: &Scene| scene.materials[scene.meshes[0].material as usize].name.clone();
    assert_eq!(material(&shown), "day");
    let offer = Offer {
        scenes: vec!["0".to_owned(), "second".to_owned()],
        shown_scene: 0,
        variants: vec!["noon".to_owned(), "night".to_owned()],
        cameras: vec!["eye".to_owned(), "above".to_owned()],
    };
    assert_eq!(shown.offer, offer);
    for night in ["night", "1"] {
        assert_eq!(material(&chosen(&bytes, &Choice { variant: some(night), ..Choice::default() }).unwrap()), "dark");
    }
    // A variant that a primitive does not name leaves it as it is.
    assert_eq!(material(&chosen(&bytes, &Choice { variant: some("noon"), ..Choice::default() }).unwrap()), "day");
    let above = chosen(&bytes, &Choice { camera: some("above"), ..Choice::default() }).unwrap();
    assert_near(above.start.unwrap().eye_world, [0.0, 7.0, 0.0]);
    let second = chosen(&bytes, &Choice { scene: some("second"), ..Choice::default() }).unwrap();
    assert_eq!((second.instances.len(), second.start), (1, None));
    assert_eq!(second.offer, Offer { shown_scene: 1, cameras: Vec::new(), ..offer });
    for (choice, wanted) in [
        (Choice { scene: some("third"), ..Choice::default() }, "there is no scene \"third\"; there are: 0, \"second\""),
        (
            Choice { variant: some("2"), ..Choice::default() },
            "there is no variant \"2\"; there are: \"noon\", \"night\"",
        ),
        (
            Choice { camera: some("eyes"), ..Choice::default() },
            "there is no camera \"eyes\"; there are: \"eye\", \"above\"",
        ),
    ] {
        assert_eq!(chosen(&bytes, &choice).err().map(|error| error.to_string()).as_deref(), Some(wanted));
    }
}
