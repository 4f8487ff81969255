//! Cameras of every model at random, and what rounding can do to them.
#![allow(dead_code, reason = "each test file uses its part")]

use std::fmt::Debug;

use glam::{DMat3, DQuat, DVec2, DVec3};
use proptest::prelude::*;
use vantage_camera::{
    Camera, CorridorMap, FaceDescription, FrustumDescription, FrustumId, GraphCamera, GraphDescription, GraphError,
    HalfSpace, Heading, ImagePoint, Pinhole, Rigid, RootDescription, Spoc,
};

/// What the laws ask of a camera.
pub trait Model: Debug {
    /// An image point that the camera has a world point for: where in the image, and how deep, both 0 to 1.
    fn point(&self, at: DVec2, depth: f64) -> ImagePoint;
    fn world(&self, point: ImagePoint) -> DVec3;
    fn image(&self, p_world: DVec3) -> Option<ImagePoint>;
    /// How far rounding can move a world point on its way into the image and back.
    fn rounding_m(&self, point: ImagePoint, world: DVec3) -> f64;
}

/// From a desk to a scene 10,000 km from the origin.
pub fn place() -> impl Strategy<Value = DVec3> {
    let coordinate = || prop_oneof![-10.0..10.0, -1e7..1e7];
    (coordinate(), coordinate(), coordinate()).prop_map(DVec3::from)
}

pub fn rotation() -> impl Strategy<Value = DQuat> {
    let part = || -1.0..1.0_f64;
    (part(), part(), part(), part())
        .prop_map(|(x, y, z, w)| DQuat::from_xyzw(x, y, z, w))
        .prop_filter("a direction", |q| q.length() > 0.1)
        .prop_map(DQuat::normalize)
}

pub fn pose() -> impl Strategy<Value = Rigid> {
    (place(), rotation()).prop_map(|(translation, rotation)| Rigid { rotation, translation })
}

/// A place in the unit square.
pub fn at() -> impl Strategy<Value = DVec2> {
    (0.0..1.0_f64, 0.0..1.0_f64).prop_map(DVec2::from)
}

/// From half a degree to 120 degrees, with the axis off the middle by up to a quarter of the image.
pub fn pinhole() -> impl Strategy<Value = Pinhole> {
    let size_px = (1_u32..4096, 1_u32..4096);
    let axis = (-0.25..0.25_f64, -0.25..0.25_f64);
    (pose(), size_px, 0.01..2.1_f64, axis, 1e-4..1.0_f64).prop_map(|(pose, size_px, fov_y_rad, axis, near_m)| {
        let symmetric = Pinhole::symmetric(pose, size_px, fov_y_rad, near_m);
        let size_px = DVec2::new(size_px.0.into(), size_px.1.into());
        Pinhole { centre_px: symmetric.centre_px + DVec2::from(axis) * size_px, ..symmetric }
    })
}

/// The pole in the image or beside it; no push or one of up to 1,000 images, over a millionth of its depth or a thousand times
/// it; a ramp from a thousandth of a pixel to 10,000.
pub fn spoc() -> impl Strategy<Value = Spoc> {
    let pole = (-0.5..1.5_f64, -0.5..1.5_f64);
    let push_max_px = prop_oneof![Just(0.0), 0.0..1e3_f64, 1e3..1e6_f64];
    (pinhole(), pole, -1.0..6.0_f64, -6.0..3.0_f64, push_max_px, -3.0..4.0_f64).prop_map(
        |(pinhole, pole, from, longer, push_max_px, ramp)| {
            let push_from_m = pinhole.near_m * 10_f64.powf(from);
            Spoc {
                pole_px: DVec2::from(pole) * DVec2::new(pinhole.width_px.into(), pinhole.height_px.into()),
                push_from_m,
                push_to_m: push_from_m * (1.0 + 10_f64.powf(longer)),
                push_max_px,
                ramp_px: 10_f64.powf(ramp),
                pinhole,
            }
        },
    )
}

/// A point of a pinhole's image up to seven decades beyond the near plane.
fn pinhole_point(pinhole: &Pinhole, at: DVec2, depth: f64) -> ImagePoint {
    // A hair behind the near plane, where rounding of the place cannot push it before it.
    let near_m = pinhole.near_m + 16.0 * f64::EPSILON * pinhole.world_from_eye.translation.length();
    ImagePoint {
        u: at.x * f64::from(pinhole.width_px),
        v: at.y * f64::from(pinhole.height_px),
        w: 1.0 / (near_m * 10_f64.powf(7.0 * depth) * (1.0 + 1e-9)),
    }
}

impl Model for Camera {
    fn point(&self, at: DVec2, depth: f64) -> ImagePoint {
        pinhole_point(self.root(), at, depth)
    }

    fn world(&self, point: ImagePoint) -> DVec3 {
        self.world_from_image(point)
    }

    fn image(&self, p_world: DVec3) -> Option<ImagePoint> {
        self.image_from_world(p_world)
    }

    /// A few roundings of the largest coordinate on the way, through the rotation (three products each, there and back) and
    /// the translation.
    fn rounding_m(&self, _: ImagePoint, world: DVec3) -> f64 {
        16.0 * f64::EPSILON * (self.eye_world().abs().max_element() + world.abs().max_element())
    }
}

/// How far rounding moves an image point of a pole camera on its way there and back: eight roundings each of numbers as
/// large as the point, the pole, the axis and the pinhole's own image of it.
pub fn rounding_px(camera: &Spoc, point: ImagePoint) -> f64 {
    let sizes = [DVec2::new(point.u, point.v), camera.pole_px, camera.pinhole.centre_px].map(DVec2::length);
    16.0 * f64::EPSILON * (sizes.iter().sum::<f64>() + camera.push_px(point.w))
}

impl Model for Spoc {
    fn point(&self, at: DVec2, depth: f64) -> ImagePoint {
        pinhole_point(&self.pinhole, at, depth)
    }

    fn world(&self, point: ImagePoint) -> DVec3 {
        self.world_from_image(point)
    }

    fn image(&self, p_world: DVec3) -> Option<ImagePoint> {
        self.image_from_world(p_world)
    }

    /// The pinhole's, and what a rounded pixel spans at that depth; the push itself is the same both ways, as `w` is.
    fn rounding_m(&self, point: ImagePoint, world: DVec3) -> f64 {
        Camera::Pinhole(self.pinhole).rounding_m(point, world)
            + rounding_px(self, point) / self.pinhole.focal_px / point.w
    }
}

/// A camera of 1 to 64 frusta of random sizes and centres, in slabs of space one behind the other that split it ever finer:
/// disjoint by construction. The numbers are drawn from `random`, which comes round again.
fn slabs(pose: Rigid, count: usize, splits: bool, random: &[f64]) -> GraphDescription {
    let mut random = random.iter().copied().cycle();
    let mut between = move |low: f64, high: f64| low + (high - low) * random.next().expect("it comes round");
    // Faces must be told from the rounding of their place: further out, everything is larger.
    let size_m = 1.0 + 1e-4 * pose.translation.abs().max_element();
    let pinhole = Pinhole::symmetric(pose, (1280, 960), between(0.2, 2.0), size_m * between(0.1, 1.0));
    let world = |p: DVec3| pose.transform_point(p);
    let half_space =
        |point: DVec3, outward: DVec3| HalfSpace { point: world(point), outward: pose.transform_vector(outward) };
    let mut frusta: Vec<FrustumDescription> = Vec::new();
    let end_m = pinhole.near_m * between(1.5, 10.0);
    let corner = |u: f64, v: f64| pinhole.ray_eye_from_image(u, v).truncate() * end_m;
    // A frustum's name, its cross-section where it ends, the depth of that, and what it and all behind it must stay inside of.
    let section = (corner(0.0, 0.0), corner(1280.0, 960.0));
    let mut ends = std::collections::VecDeque::from([("0".to_owned(), section, end_m, Vec::new())]);
    while let Some((parent, (low, high), z, walls)) = ends.pop_front() {
        let parts = if splits && between(0.0, 1.0) < 0.5 { 2 } else { 1 };
        let axis = if between(0.0, 1.0) < 0.5 { DVec2::X } else { DVec2::Y };
        for part in 0..parts {
            if frusta.len() + 1 >= count {
                break;
            }
            let (mut low, mut high, mut walls) = (low, high, walls.clone());
            if parts == 2 {
                let middle = low.midpoint(high);
                let side = if part == 0 { 1.0 } else { -1.0 };
                walls.push((middle, axis * side));
                (low, high) =
                    if part == 0 { (low, high + (middle - high) * axis) } else { (low + (middle - low) * axis, high) };
            }
            let size = high - low;
            let is_whole = between(0.0, 1.0) < 0.3;
            if !is_whole {
                low += size * DVec2::new(between(0.0, 0.1), between(0.0, 0.1));
                high -= size * DVec2::new(between(0.0, 0.1), between(0.0, 0.1));
            }
            let setback_m = size.max_element() * between(0.5, 20.0);
            let length_m = size.max_element() * between(0.2, 1.0);
            let jitter = DVec2::new(between(-0.4, 0.4), between(-0.4, 0.4));
            let centre = low.midpoint(high) + (high - low) * jitter;
            let name = (frusta.len() + 1).to_string();
            let mut limits = vec![half_space(DVec3::Z * (z + length_m), DVec3::Z)];
            limits.extend(walls.iter().map(|(point, outward)| half_space(point.extend(z), outward.extend(0.0))));
            let face = [low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)];
            frusta.push(FrustumDescription {
                name: name.clone(),
                centre: world(centre.extend(z - setback_m)),
                faces: vec![FaceDescription {
                    parent: parent.clone(),
                    corners: face.map(|corner| world(corner.extend(z))).to_vec(),
                }],
                limits,
            });
            // What the pyramid widens to, within the walls.
            let widened = |p: DVec2| centre + (p - centre) * ((setback_m + length_m) / setback_m);
            let (mut low, mut high) = (widened(low), widened(high));
            for (point, outward) in &walls {
                if outward.max_element() > 0.5 {
                    high = high.min(*point * *outward + high * (DVec2::ONE - *outward));
                } else {
                    low = low.max(*point * -*outward + low * (DVec2::ONE + *outward));
                }
            }
            ends.push_back((name, (low, high), z + length_m, walls));
        }
    }
    GraphDescription {
        root: RootDescription { name: "0".to_owned(), pinhole, limits: vec![half_space(DVec3::Z * end_m, DVec3::Z)] },
        frusta,
        min_face_px: 0.01,
    }
}

/// A view round both sides of a pillar: a split, a merge behind the pillar, and a frustum behind that, across the seam.
pub fn pillar(pose: Rigid) -> GraphDescription {
    let world = |x: f64, y: f64, z: f64| pose.transform_point(DVec3::new(x, y, z));
    let limit = |point: DVec3, x: f64, z: f64| HalfSpace {
        point: pose.transform_point(point),
        outward: pose.transform_vector(DVec3::new(x, 0.0, z)),
    };
    let face = |parent: &str, low: f64, high: f64, z: f64| FaceDescription {
        parent: parent.to_owned(),
        corners: vec![world(low, -1.0, z), world(high, -1.0, z), world(high, 1.0, z), world(low, 1.0, z)],
    };
    let end = |z: f64| limit(DVec3::Z * z, 0.0, 1.0);
    let frustum = |name: &str, centre: (f64, f64), faces, limits| FrustumDescription {
        name: name.to_owned(),
        centre: world(centre.0, 0.0, centre.1),
        faces,
        limits,
    };
    GraphDescription {
        root: RootDescription {
            name: "front".to_owned(),
            pinhole: Pinhole::symmetric(pose, (640, 480), 1.0, 0.5),
            limits: vec![end(4.0)],
        },
        frusta: vec![
            frustum("behind", (0.0, 7.5), vec![face("back", -0.6, 0.5, 9.0)], vec![end(10.0)]),
            frustum(
                "back",
                (0.0, 3.0),
                vec![face("left", -1.0, 0.0, 6.0), face("right", 0.0, 1.0, 6.0)],
                vec![end(9.0)],
            ),
            frustum(
                "left",
                (-2.5, 2.0),
                vec![face("front", -2.0, -1.0, 4.0)],
                vec![end(6.0), limit(DVec3::ZERO, 1.0, 0.0)],
            ),
            frustum(
                "right",
                (2.5, 2.0),
                vec![face("front", 1.0, 2.0, 4.0)],
                vec![end(6.0), limit(DVec3::ZERO, -1.0, 0.0)],
            ),
        ],
        min_face_px: 0.0,
    }
}

pub fn corridors() -> impl Strategy<Value = (CorridorMap, GraphDescription)> {
    let free = prop::collection::vec(prop::bool::weighted(0.75), 64);
    (free, 1_usize..9, place(), 0.2..20.0_f64, 0.3..3.0_f64, 0.5..4.0_f64).prop_map(
        |(mut free, columns, origin_world, cell_m, height, setback)| {
            free.truncate(64 / columns * columns);
            free[0] = true;
            let map = CorridorMap { columns, free, origin_world, cell_m, height_m: cell_m * height };
            let view = map.describe((0, 0), Heading::PlusZ, setback * cell_m, (1600, 900), 0.01);
            (map, view.expect("the first cell is free"))
        },
    )
}

/// Chains, trees, mazes and merges, of 1 to 64 frusta.
pub fn graph_description() -> impl Strategy<Value = GraphDescription> {
    let random = prop::collection::vec(0.0..1.0_f64, 97);
    prop_oneof![
        4 => (pose(), 1_usize..=64, any::<bool>(), random)
            .prop_map(|(pose, count, splits, random)| slabs(pose, count, splits, &random)),
        2 => corridors().prop_map(|(_, description)| description),
        1 => pose().prop_map(pillar),
    ]
}

pub fn graph() -> impl Strategy<Value = GraphCamera> {
    // Seldom the thinnest siblings, on both sides of a wall, overlap by the rounding of its place.
    graph_description().prop_filter_map("siblings are apart", |description| {
        match GraphCamera::from_description(&description) {
            Ok(camera) => Some(camera),
            Err(GraphError::Overlap { .. }) => None,
            Err(error) => panic!("{error}"),
        }
    })
}

/// How far rounding can move a point of a frustum on its way into the image and back, in metres.
///
/// `H_k = H_0 F_1 ... F_k` with one factor `F = I + d n^T/delta` a bend, and its inverse `G_k ... G_1 H_0^-1`. Multiplying by the factor
/// `F_j` errs by a few roundings of `|H_(j-1)| |F_j|` (Higham, *Accuracy and Stability of Numerical Algorithms*, section
/// 3.5): 16 for making the factor, three products and two sums, and as many times more as `parent's distance = child's + n.d`
/// cancels. That error meets the rest of the product, `x_j = F_(j+1) ... F_k x`, and is taken to the world by `H_k^-1`; so the
/// errors of the bends add up, and do not multiply. The same holds for the inverse. The last products, and the places of the
/// point and the centre, are rounded once more.
pub fn graph_rounding_m(camera: &GraphCamera, id: FrustumId, world: DVec3) -> f64 {
    let root = camera.root();
    let (focal_px, rotation) = (root.focal_px, DMat3::from_quat(root.world_from_eye.rotation));
    let image_from_eye = DMat3::from_cols(DVec3::X * focal_px, DVec3::Y * focal_px, root.centre_px.extend(1.0));
    let abs = |matrix: DMat3| DMat3::from_cols(matrix.x_axis.abs(), matrix.y_axis.abs(), matrix.z_axis.abs());
    let ancestors = std::iter::successors(camera.frustum(id), |child| child.parent().and_then(|id| camera.frustum(id)));
    let mut path: Vec<_> = ancestors.collect();
    path.reverse();
    // Per bend: the matrix and its inverse before it, the factor and its inverse, and how many roundings it takes.
    let mut bends = Vec::new();
    let (mut forth, mut back) = (image_from_eye * rotation.transpose(), rotation * image_from_eye.inverse());
    for pair in path.windows(2) {
        let face = pair[1].half_spaces_world()[0].opposite();
        let (shift, normal) = (pair[1].centre_world() - pair[0].centre_world(), face.outward);
        let outer = DMat3::from_cols(shift * normal.x, shift * normal.y, shift * normal.z);
        let [parent_m, child_m] = [0, 1].map(|end| face.depth_m(pair[end].centre_world()));
        let roundings = 16.0 * (1.0 + (child_m + normal.abs().dot(shift.abs())) / parent_m);
        let factors = (DMat3::IDENTITY + outer * (1.0 / child_m), DMat3::IDENTITY - outer * (1.0 / parent_m));
        bends.push((forth, back, factors, roundings));
        (forth, back) = (forth * factors.0, factors.1 * back);
    }
    let offset = world - path[path.len() - 1].centre_world();
    let image = forth * offset;
    let mut sum = 32.0 * (abs(back) * (abs(forth) * offset.abs() + image.abs()));
    for (forth_before, back_before, factors, roundings) in bends {
        let through = factors.1 * (back_before * image);
        let forth_error = abs(forth_before) * (abs(factors.0) * through.abs());
        let back_error = abs(factors.1) * (abs(back_before) * image.abs());
        let rest = back * (forth_before * factors.0);
        sum += roundings * (abs(back) * forth_error + abs(rest) * back_error);
    }
    let places_m = world.abs().max_element() + path[path.len() - 1].centre_world().abs().max_element();
    f64::EPSILON * (2.0 * places_m + sum.length())
}

impl Model for GraphCamera {
    /// On the ray of a point off the image's edge, within the piece that `depth` comes to, off its ends.
    fn point(&self, at: DVec2, depth: f64) -> ImagePoint {
        let size_px = DVec2::new(self.size_px().0.into(), self.size_px().1.into());
        let uv = size_px * (0.5 + (at - 0.5) * 0.998);
        let pieces = Some(self.ray(uv.x, uv.y)).filter(|pieces| !pieces.is_empty());
        let (uv, pieces) =
            pieces.map_or_else(|| (size_px / 2.0, self.ray(size_px.x / 2.0, size_px.y / 2.0)), |p| (uv, p));
        let place = depth * pieces.len() as f64;
        let piece = &pieces[(place as usize).min(pieces.len() - 1)];
        let share = 0.01 + 0.98 * place.fract();
        let z = 1.0 / piece.w_from + (1.0 / piece.w_to - 1.0 / piece.w_from) * share;
        ImagePoint { u: uv.x, v: uv.y, w: 1.0 / z }
    }

    fn world(&self, point: ImagePoint) -> DVec3 {
        let frustum = self.frustum_at(point).expect("a ray");
        self.world_from_image(point, frustum).expect("a point on a ray")
    }

    fn image(&self, p_world: DVec3) -> Option<ImagePoint> {
        self.image_from_world(p_world).map(|(point, _)| point)
    }

    fn rounding_m(&self, point: ImagePoint, world: DVec3) -> f64 {
        graph_rounding_m(self, self.frustum_at(point).expect("a ray"), world)
    }
}

pub fn model() -> impl Strategy<Value = Box<dyn Model>> {
    prop_oneof![
        pinhole().prop_map(|camera| Box::new(Camera::Pinhole(camera)) as Box<dyn Model>),
        spoc().prop_map(|camera| Box::new(camera) as Box<dyn Model>),
        graph().prop_map(|camera| Box::new(camera) as Box<dyn Model>),
    ]
}
