//! The triangles of a scene for rays: a hierarchy of boxes in f32 to find candidates, intersections in f64.
//!
//! Space: metres relative to the anchor, the middle of the scene at its time, with the world's axes.

use glam::{DMat3, DVec2, DVec3, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::ray::RayHit;
use rayon::prelude::*;
use scene::{Bounds, Scene, Snapshot, Vertex};

/// From where and along what; the direction may have any length but zero, and distances are counted in its lengths.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    pub origin: DVec3,
    pub direction: DVec3,
}

impl Ray {
    /// The point at a distance.
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }

    /// The distance of a point on the ray.
    pub fn t_of(&self, p: DVec3) -> f64 {
        (p - self.origin).dot(self.direction) / self.direction.length_squared()
    }
}

/// Which triangles a ray may hit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Among {
    /// What a camera would be shown: single-sided triangles from their front only.
    Shown,
    /// Every triangle from both sides.
    Solid,
    /// The triangles of one object, from both sides.
    Object(u16),
}

/// What is asked of a ray.
#[derive(Debug, Clone, Copy)]
pub(super) struct Query {
    pub among: Among,
    /// An object that is not there.
    pub without: Option<u16>,
    /// A triangle that is not there: the one that the ray leaves.
    pub leaves: Option<u32>,
    /// Hits count beyond the first and up to the second.
    pub t_range: [f64; 2],
}

/// Where a ray meets a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hit {
    /// In lengths of the direction.
    pub t: f64,
    /// Place in [`Geometry::facets`].
    pub facet: u32,
    /// Weights of the second and the third corner.
    pub weights: DVec2,
}

/// A triangle as rays need it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Facet {
    corner: DVec3,
    edge_1: DVec3,
    edge_2: DVec3,
    pub object: u16,
    pub double_sided: bool,
    /// Whether alpha decides what is hit.
    cut_out: bool,
}

/// What is interpolated over a triangle, at its three corners.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corners {
    /// Of the length that the instance's transform gives them.
    pub normals_world: [DVec3; 3],
    /// The first set of texture coordinates, then the second.
    pub uvs: [[DVec2; 3]; 2],
    /// Linear RGBA.
    pub colours: [[f64; 4]; 3],
    pub material: u32,
}

/// All triangles of a snapshot.
pub(super) struct Geometry {
    pub anchor_world: DVec3,
    /// How near to its start a ray hits nothing, in metres: 2^-40 of the scene's extent. Points computed in f64 are
    /// exact to 2^-53 of it for each rounding; the rest allows some hundred roundings and grazing rays, which make them
    /// count for more.
    pub skip_m: f64,
    /// The radius of a ball around the anchor that holds all triangles.
    extent_m: f64,
    facets: Vec<Facet>,
    corners: Vec<Corners>,
    bvh: Bvh2,
}

impl Geometry {
    pub fn new(scene: &Scene, snapshot: &Snapshot) -> Geometry {
        let (mut facets, mut corners) = (Vec::new(), Vec::new());
        let mut bounds = Bounds::EMPTY;
        for object in 0..scene.instances.len() {
            for (facet, corner) in placed(scene, snapshot, object) {
                facet.corners().iter().for_each(|&p| bounds.include(p));
                facets.push(facet);
                corners.push(corner);
            }
        }
        let anchor_world = if bounds.is_empty() { DVec3::ZERO } else { bounds.centre() };
        facets.iter_mut().for_each(|facet| facet.corner -= anchor_world);
        let extent_m = bounds.radius_m();
        let bvh = hierarchy(&facets, extent_m);
        Geometry { anchor_world, skip_m: extent_m * 2f64.powi(-40), extent_m, facets, corners, bvh }
    }

    pub fn facet(&self, hit: &Hit) -> (&Facet, &Corners) {
        (&self.facets[hit.facet as usize], &self.corners[hit.facet as usize])
    }

    /// The nearest hit. `is_cut` is asked about hits of materials with an alpha cut-off; those that it names are
    /// passed.
    pub fn first_hit(&self, ray: &Ray, query: &Query, is_cut: impl Fn(&Hit) -> bool) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let lead = self.lead(ray);
        let until = rounded_up(query.t_range[1] - lead);
        let near = obvhs::ray::Ray::new(ray.at(lead).as_vec3a(), ray.direction.as_vec3a(), 0.0, until);
        self.bvh.ray_traverse(near, &mut RayHit::none(), |_, place| {
            let index = self.bvh.primitive_indices[place];
            let facet = &self.facets[index as usize];
            if query.leaves == Some(index) || !facet.may_be_hit(query, ray.direction) {
                return f32::INFINITY;
            }
            let farthest = best.map_or(query.t_range[1], |hit| hit.t);
            let Some((t, weights)) = facet.intersect(ray) else { return f32::INFINITY };
            let hit = Hit { t, facet: index, weights };
            if t <= query.t_range[0] || t >= farthest || (facet.cut_out && is_cut(&hit)) {
                return f32::INFINITY;
            }
            best = Some(hit);
            rounded_up(t - lead)
        });
        best
    }

    /// How far a ray from far outside of the scene goes before it can hit anything: up to two extents from the middle.
    /// A ray that hits has at most three extents left from there, which f32 holds as exactly as the boxes.
    fn lead(&self, ray: &Ray) -> f64 {
        ((ray.origin.length() - 2.0 * self.extent_m) / ray.direction.length()).max(0.0)
    }
}

/// The next f32 above, so that boxes are not passed over that a hit just before `t` may lie in.
fn rounded_up(t: f64) -> f32 {
    (t as f32).next_up()
}

/// The triangles of one object in world space.
fn placed(scene: &Scene, snapshot: &Snapshot, object: usize) -> Vec<(Facet, Corners)> {
    let instance = &scene.instances[object];
    let mesh = &scene.meshes[instance.mesh as usize];
    let tint = [instance.tint[0], instance.tint[1], instance.tint[2], 255].map(|code| f64::from(code) / 255.0);
    let material = &scene.materials[mesh.material as usize];
    let deformed = snapshot.deformed.iter().find(|deformed| deformed.instance as usize == object);
    let vertices = deformed.map_or(&mesh.vertices, |deformed| &deformed.vertices);
    let world_from_mesh = snapshot.world_from_mesh[object];
    let normal_from_mesh: DMat3 = world_from_mesh.matrix3.inverse().transpose();
    // A map that turns left to right turns the winding with it; outwards stays outwards.
    let mirrored = world_from_mesh.matrix3.determinant() < 0.0;
    let facet = |triangle: &[u32]| {
        let index_of =
            if mirrored { [triangle[0], triangle[2], triangle[1]] } else { [triangle[0], triangle[1], triangle[2]] };
        let of = index_of.map(|index| &vertices[index as usize]);
        let [p, q, r] = of.map(|vertex| world_from_mesh.transform_point3(Vec3::from(vertex.position).as_dvec3()));
        let facet = Facet {
            corner: p,
            edge_1: q - p,
            edge_2: r - p,
            object: object as u16,
            double_sided: material.double_sided,
            cut_out: material.alpha_cutoff.is_some() || material.is_pane(),
        };
        let corners = Corners {
            normals_world: of.map(|vertex| normal_from_mesh * Vec3::from(vertex.normal).as_dvec3()),
            uvs: [
                of.map(|vertex| DVec2::new(vertex.uv[0].into(), vertex.uv[1].into())),
                index_of.map(|index| {
                    mesh.second_uvs.get(index as usize).map_or(DVec2::ZERO, |&[u, v]| DVec2::new(u.into(), v.into()))
                }),
            ],
            colours: of.map(|vertex: &Vertex| [0, 1, 2, 3].map(|k| f64::from(vertex.colour[k]) / 255.0 * tint[k])),
            material: mesh.material,
        };
        (facet, corners)
    };
    mesh.indices.par_chunks_exact(3).map(facet).collect()
}

/// Boxes are widened by 2^-20 of the scene's extent: within four extents, rounding a ray's start and a box to f32 moves
/// them by up to 2^-22 and 2^-24 of it, and the box test rounds as often again.
fn hierarchy(facets: &[Facet], extent_m: f64) -> Bvh2 {
    if facets.is_empty() {
        return Bvh2::default();
    }
    let margin = Vec3A::splat((extent_m * 2f64.powi(-20)) as f32);
    let of = |facet: &Facet| {
        let corners = facet.corners().map(|corner| corner.as_vec3a());
        let aabb = Aabb::from_points(&corners);
        Aabb::new(aabb.min - margin, aabb.max + margin)
    };
    let boxes: Vec<Aabb> = facets.par_iter().map(of).collect();
    build_bvh2(&boxes, BvhBuildParams::fast_build(), &mut std::time::Duration::default())
}

impl Facet {
    fn corners(&self) -> [DVec3; 3] {
        [self.corner, self.corner + self.edge_1, self.corner + self.edge_2]
    }

    /// Towards the side from which its corners run counter-clockwise; not of unit length.
    pub fn outward(&self) -> DVec3 {
        self.edge_1.cross(self.edge_2)
    }

    /// How its place changes with texture coordinates that lie so at its corners; `None` where these lie on a line.
    pub fn along(&self, [a, b, c]: [DVec2; 3]) -> Option<[DVec3; 2]> {
        let (one, two) = (b - a, c - a);
        let turn = one.perp_dot(two);
        let along_u = (self.edge_1 * two.y - self.edge_2 * one.y) / turn;
        let along_v = (self.edge_2 * one.x - self.edge_1 * two.x) / turn;
        (turn != 0.0 && along_u.is_finite() && along_v.is_finite()).then_some([along_u, along_v])
    }

    fn may_be_hit(&self, query: &Query, direction: DVec3) -> bool {
        if query.without == Some(self.object) {
            return false;
        }
        match query.among {
            Among::Shown => self.double_sided || self.outward().dot(direction) < 0.0,
            Among::Solid => true,
            Among::Object(object) => self.object == object,
        }
    }

    /// Moeller, Trumbore: Fast, Minimum Storage Ray/Triangle Intersection, 1997. Weights are allowed 2^-40 outside of
    /// the triangle, far more than their rounding, so that no ray passes between two triangles that share an edge.
    fn intersect(&self, ray: &Ray) -> Option<(f64, DVec2)> {
        const SLACK: f64 = 1.0 / (1u64 << 40) as f64;
        let p = ray.direction.cross(self.edge_2);
        let determinant = self.edge_1.dot(p);
        if determinant == 0.0 {
            return None;
        }
        let s = ray.origin - self.corner;
        let q = s.cross(self.edge_1);
        let weights = DVec2::new(s.dot(p), ray.direction.dot(q)) / determinant;
        let is_inside = weights.x >= -SLACK && weights.y >= -SLACK && weights.x + weights.y <= 1.0 + SLACK;
        is_inside.then(|| (self.edge_2.dot(q) / determinant, weights))
    }
}

impl Corners {
    /// A value at a hit, from those at the corners.
    pub fn mix<T>(values: &[T; 3], weights: DVec2) -> T
    where
        T: Copy + std::ops::Mul<f64, Output = T> + std::ops::Add<Output = T>,
    {
        values[0] * (1.0 - weights.x - weights.y) + values[1] * weights.x + values[2] * weights.y
    }
}
