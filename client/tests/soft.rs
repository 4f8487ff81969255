//! Soft shadows of small held copies against the closed form, by every method.

mod common;

use common::{Block, FLOOR, OnFloor, Stage, World, camera, entry, lit_by, on_floor};
use glam::DVec3;
use protocol::{Area, AreaShape, Held, Light};
use vantage_client::draw::shadow::{Settings, Shadows, SoftProgress};
use vantage_client::draw::soft::{self, Choice, Method, Pace};

const MAP_PX: u32 = 192;
const HELD_PX: u32 = 192;
const HERE: World = World { origin: DVec3::ZERO, scale: 1.0, side_px: HELD_PX };
/// Thin, so that one of its sides alone makes the shadow.
const PLATE: Block = (DVec3::new(-0.6, 1.0, -0.6), DVec3::new(0.6, 1.02, 0.6));
const HEIGHT: f64 = 3.0;
/// Points along a side of the lamp.
const POINTS: u32 = 8;

const METHODS: [Method; 3] = [Method::Maps, Method::Warp, Method::March];

/// None sees the plate's rim at a right angle to it.
const EYES: [DVec3; 5] = [
    DVec3::new(0.0, 5.0, 7.0),
    DVec3::new(7.0, 5.0, 0.0),
    DVec3::new(0.0, 5.0, -7.0),
    DVec3::new(-7.0, 5.0, 0.0),
    DVec3::new(0.0, 9.0, 0.0),
];

/// A lamp above the middle that faces down, `half` as wide, in the boxes' units.
fn lamp(world: &World, place: DVec3, half: f64, shape: AreaShape) -> Light {
    let half_m = half * world.scale;
    Light::Point {
        position_world: world.point(place).to_array(),
        intensity: [30.0; 3],
        direction_world: [0.0, -1.0, 0.0],
        spot_cos: [-1.0, -2.0],
        range_m: f32::INFINITY,
        area: Some(Area { half_world: [[half_m, 0.0, 0.0], [0.0, 0.0, half_m]], shape }),
    }
}

/// How much of a held copy's only lamp arrives at each pixel, 0 to 255.
fn shares(stage: &mut Stage, world: &World, held: &Held, (method, points): (Method, u32)) -> Vec<u8> {
    let soft = soft::Settings { choice: Choice::Always(method), points, map_px: MAP_PX, ..soft::Settings::default() };
    stage.frames.set_shadows(Settings { shadows: Shadows::Soft, soft, ..Settings::default() });
    stage.shoot(held, &camera(world));
    let shares: Vec<[u8; 4]> = stage.read(stage.frames.light_shares().expect("a lamp casts"));
    shares.iter().map(|share| share[0]).collect()
}

fn held(world: &World, blocks: &[Block], light: Light) -> Held {
    world.held_from(&EYES, blocks, lit_by(vec![light]))
}

#[test]
fn umbra_and_penumbra_of_a_square_are_as_wide_as_they_should_be() {
    let half = 0.4;
    let blocks = [FLOOR, PLATE];
    let held = held(&HERE, &blocks, lamp(&HERE, DVec3::Y * HEIGHT, half, AreaShape::Rectangle));
    let mut stage = Stage::new(&held);
    // Of the plate's upper rim, by similar triangles.
    let grows = PLATE.1.y / (HEIGHT - PLATE.1.y);
    let (umbra, penumbra) = (PLATE.1.x + (PLATE.1.x - half) * grows, PLATE.1.x + (PLATE.1.x + half) * grows);
    for method in METHODS {
        let shares = shares(&mut stage, &HERE, &held, (method, POINTS));
        let (mut dark, mut between, mut lit) = (0, 0, 0);
        for OnFloor { pixel, p, footprint } in on_floor(&stage, &HERE, &camera(&HERE), &blocks) {
            // A pixel, a texel of the map and a held sample, each by its shadow on the floor.
            let texel = 2.0 * 5.0 / f64::from(MAP_PX);
            let sample = 9.0 * 0.55 / f64::from(HELD_PX / 2);
            let near = footprint + (texel + sample) * (1.0 + grows);
            let side = p.abs().with_y(0.0).max_element();
            // The lower rim hides nothing more; the floor ends.
            if p.abs().max_element() > FLOOR.1.x - near {
                continue;
            }
            let share = f64::from(shares[pixel]) / 255.0;
            if side < umbra - near {
                assert_eq!(share, 0.0, "{method:?}: dark at {p}");
                dark += 1;
            } else if side > penumbra + near {
                assert_eq!(share, 1.0, "{method:?}: lit at {p}");
                lit += 1;
            } else if p.x.abs().min(p.z.abs()) < umbra - near {
                // One side's penumbra alone: it grows evenly, by a row of points at a time.
                let expected = ((side - umbra) / (penumbra - umbra)).clamp(0.0, 1.0);
                let slack = near / (penumbra - umbra) + 1.0 / f64::from(POINTS);
                assert!((share - expected).abs() <= slack, "{method:?}: {share} of {expected} at {p}");
                between += 1;
            }
        }
        assert!(dark > 40 && between > 150 && lit > 1000, "{method:?}: {dark} {between} {lit}");
    }
}

#[test]
fn methods_agree_with_rays_to_every_point() {
    let blocks = [FLOOR, PLATE, (DVec3::new(-1.6, 0.0, 0.4), DVec3::new(-1.0, 0.8, 1.2))];
    let place = DVec3::new(0.5, HEIGHT, -0.3);
    for shape in [AreaShape::Rectangle, AreaShape::Disc] {
        let light = lamp(&HERE, place, 0.7, shape);
        let Light::Point { area: Some(area), .. } = light else { unreachable!() };
        let points: Vec<DVec3> = area.points_world(place, POINTS).collect();
        let held = held(&HERE, &blocks, light);
        let mut stage = Stage::new(&held);
        for method in METHODS {
            let shares = shares(&mut stage, &HERE, &held, (method, POINTS));
            let (mut off, mut count) = (0.0, 0.0);
            for OnFloor { pixel, p, .. } in on_floor(&stage, &HERE, &camera(&HERE), &blocks) {
                if p.abs().max_element() > FLOOR.1.x - 0.2 {
                    continue;
                }
                let sees = |point: &&DVec3| blocks[1..].iter().all(|block| entry(*block, p, **point - p).is_none());
                let share = points.iter().filter(sees).count() as f64 / points.len() as f64;
                off += (share - f64::from(shares[pixel]) / 255.0).abs();
                count += 1.0;
            }
            assert!(count > 2000.0 && off / count < 0.01, "{method:?}, {shape:?}: {} of {count}", off / count);
        }
    }
}

#[test]
fn points_add_up_over_frames_to_what_one_frame_draws() {
    let blocks = [FLOOR, PLATE];
    let held = held(&HERE, &blocks, lamp(&HERE, DVec3::Y * HEIGHT, 0.4, AreaShape::Rectangle));
    let mut stage = Stage::new(&held);
    for method in METHODS {
        let all = shares(&mut stage, &HERE, &held, (method, POINTS));
        let soft = soft::Settings {
            choice: Choice::Always(method),
            points: POINTS,
            map_px: MAP_PX,
            pace: Pace::Points(5),
            ..soft::Settings::default()
        };
        stage.frames.set_shadows(Settings { shadows: Shadows::Soft, soft, ..Settings::default() });
        let frame = |stage: &mut Stage| {
            stage.shoot(&held, &camera(&HERE));
            let shares: Vec<[u8; 4]> = stage.read(stage.frames.light_shares().expect("a lamp casts"));
            (shares.into_iter().map(|share| share[0]).collect::<Vec<u8>>(), stage.frames.soft_progress())
        };
        let (first, progress) = frame(&mut stage);
        assert_eq!(progress, Some(SoftProgress { points: 5, of: 64, method: Some(method) }), "{method:?}");
        // As bright on the whole as five points can tell.
        let mean = |shares: &[u8]| shares.iter().map(|share| f64::from(*share)).sum::<f64>() / shares.len() as f64;
        assert!(first != all && (mean(&first) - mean(&all)).abs() < 2.0, "{method:?}: {} {}", mean(&first), mean(&all));
        for _ in 1..13 {
            assert!(stage.frames.soft_progress().is_some_and(SoftProgress::goes_on));
            frame(&mut stage);
        }
        for _ in 0..2 {
            let (last, progress) = frame(&mut stage);
            assert!(progress.is_some_and(|progress| !progress.goes_on()));
            assert_eq!(last, all, "{method:?}");
        }
    }
}

#[test]
fn what_moves_casts_from_where_it_is_now() {
    let moved = (PLATE.0 + DVec3::X, PLATE.1 + DVec3::X);
    let copy = |lamp_x: f64, plate: Block| {
        held(&HERE, &[FLOOR, plate], lamp(&HERE, DVec3::new(lamp_x, HEIGHT, 0.0), 0.4, AreaShape::Rectangle))
    };
    // The lamp alone moves, then the plate alone.
    let copies = [copy(0.0, PLATE), copy(1.0, PLATE), copy(1.0, moved)];
    for method in METHODS {
        let mut stage = Stage::new(&copies[0]);
        shares(&mut stage, &HERE, &copies[0], (method, 2));
        let follows = [1, 2].map(|now| {
            if now == 2 {
                stage.surfaces.rebuild(&copies[now]);
            }
            stage.shoot(&copies[now], &camera(&HERE));
            let follows: Vec<[u8; 4]> = stage.read(stage.frames.light_shares().expect("a lamp casts"));
            follows.iter().map(|share| share[0]).collect::<Vec<u8>>()
        });
        let anew = [1, 2].map(|now| shares(&mut Stage::new(&copies[now]), &HERE, &copies[now], (method, 2)));
        assert!(follows == anew && anew[0] != anew[1], "{method:?}");
    }
}

#[test]
fn few_points_are_evened_out_along_a_surface_and_not_over_outlines() {
    let blocks = [FLOOR, PLATE];
    let place = DVec3::Y * HEIGHT;
    // Askew: of a lamp along the plate every eighth point tells as much about one of its sides as all.
    let (sin, cos) = 0.5_f64.sin_cos();
    let askew = Area { half_world: [[cos, 0.0, sin], [-sin, 0.0, cos]], shape: AreaShape::Rectangle };
    let mut light = lamp(&HERE, place, 1.0, AreaShape::Rectangle);
    let Light::Point { area, .. } = &mut light else { unreachable!() };
    *area = Some(askew);
    let points: Vec<DVec3> = askew.points_world(place, POINTS).collect();
    let held = held(&HERE, &blocks, light);
    let mut stage = Stage::new(&held);
    let all = shares(&mut stage, &HERE, &held, (Method::Warp, POINTS));
    let few = soft::Settings { points: POINTS, map_px: MAP_PX, pace: Pace::Points(4), ..soft::Settings::default() };
    let drawn = soft::SoftShadows::new(&stage.gpu, few).numbers(0..4);
    stage.frames.set_shadows(Settings { shadows: Shadows::Soft, soft: few, ..Settings::default() });
    stage.shoot(&held, &camera(&HERE));
    let shown: Vec<[u8; 4]> = stage.read(stage.frames.light_shares().expect("a lamp casts"));
    let (mut off, mut in_steps, mut plain) = (0.0, 0.0, 0);
    for OnFloor { pixel, p, .. } in on_floor(&stage, &HERE, &camera(&HERE), &blocks) {
        let sees = |point: &DVec3| f64::from(u8::from(entry(PLATE, p, *point - p).is_none()));
        let by_drawn = drawn.iter().map(|point| sees(&points[*point])).sum::<f64>() / drawn.len() as f64;
        let by_all = points.iter().map(sees).sum::<f64>() / points.len() as f64;
        let (shown, all) = (f64::from(shown[pixel][0]), f64::from(all[pixel]));
        off += (shown - all).abs();
        in_steps += 255.0 * (by_drawn - by_all).abs();
        plain += usize::from(shown == all && [0.0, 255.0].contains(&all));
    }
    assert!(off < 0.95 * in_steps, "{off} of {in_steps}");
    // Where all points agree, and all around, nothing comes from beside.
    assert!(plain > 5000, "{plain}");
}

#[test]
fn a_lamp_without_extent_casts_hard_shadows() {
    let blocks = [FLOOR, PLATE];
    let held = held(&HERE, &blocks, lamp(&HERE, DVec3::Y * HEIGHT, 0.0, AreaShape::Rectangle));
    let mut stage = Stage::new(&held);
    for method in METHODS {
        let shares = shares(&mut stage, &HERE, &held, (method, POINTS));
        assert!(shares.iter().all(|share| [0, 255].contains(share)), "{method:?}");
        assert!(shares.iter().filter(|share| **share == 0).count() > 100, "{method:?}");
    }
}

#[test]
fn extreme_lamps_and_scales_neither_leak_nor_speckle() {
    let blocks = [FLOOR, PLATE];
    let here = World { side_px: 96, ..HERE };
    let worlds =
        [here, World { scale: 1e-4, ..here }, World { scale: 1e5, origin: DVec3::new(1e6, 0.0, -1e6), ..here }];
    // Far above; grazing; on the plate; within it; between plate and floor; below everything; larger than the floor.
    let lamps = [
        (DVec3::new(0.0, 40.0, 0.0), 1.0),
        (DVec3::new(30.0, 0.8, 0.0), 0.3),
        (DVec3::new(0.0, 1.02, 0.0), 0.3),
        (DVec3::new(0.0, 1.01, 0.0), 0.3),
        (DVec3::new(0.0, 0.5, 0.0), 0.3),
        (DVec3::new(0.0, -9.0, 0.0), 0.3),
        (DVec3::new(0.0, 8.0, 0.0), 20.0),
    ];
    for world in worlds {
        for (place, half) in lamps {
            let held = held(&world, &blocks, lamp(&world, place, half, AreaShape::Rectangle));
            let mut stage = Stage::new(&held);
            for method in METHODS {
                let shares = shares(&mut stage, &world, &held, (method, 3));
                for OnFloor { pixel, p, .. } in on_floor(&stage, &world, &camera(&world), &blocks) {
                    let is_far = p.with_y(0.0).length() > 2.5 && p.abs().max_element() < 3.6;
                    // What every point of a lamp above sees, and none of a lamp below the floor.
                    let expected = match place.y {
                        y if y < -1.0 => Some(0),
                        y if y > 2.0 && half < 2.0 && is_far => Some(255),
                        y if y < 1.0 && y > 0.0 && half < 2.0 && place.x == 0.0 && is_far => Some(255),
                        _ => None,
                    };
                    if let Some(expected) = expected {
                        let world = world.scale;
                        assert_eq!(shares[pixel], expected, "{method:?}: {p}, a lamp at {place}, scale {world}");
                    }
                }
            }
        }
    }
}
