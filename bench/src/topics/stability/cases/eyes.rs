//! Eyes where walls, surfaces and corners are, and rays along edges.

use glam::{DVec3, Vec3};
use scene::Mesh;

use super::stiff::{Stiff, bent, flat};
use crate::topics::stability::build::{Placed, at, ball, cuboid, floor, mesh, scene, square};
use crate::topics::stability::case::{Case, FOV_Y_RAD, PICTURE_PX};

pub(super) const CASES: &[Stiff] = &[
    Stiff { name: "an eye in a wall's plane", judge: |lab| flat(lab, &in_a_plane()) },
    Stiff { name: "an eye on a floor", judge: |lab| flat(lab, &on_a_floor()) },
    Stiff { name: "an eye inside of a ball", judge: |lab| bent(lab, &inside()) },
    Stiff { name: "an eye at a vertex of a ball", judge: |lab| bent(lab, &at_a_vertex()) },
    Stiff { name: "rays along edges, through vertices", judge: |lab| flat(lab, &along_edges(0.0)) },
    Stiff { name: "rays a millionth of a pixel beside edges", judge: |lab| flat(lab, &along_edges(1e-6)) },
];

/// Facets turn by 1.9 degrees from one to the next, so their planes are off by as much as coded normals.
const RINGS: u32 = 96;

fn back(place: DVec3) -> Placed {
    Placed { mesh: square(), world_from_mesh: at(place, 2.0), colour: [0.5, 0.4, 0.3] }
}

/// A box whose left side lies in the plane x = 0, as the eye does, before a wall.
fn in_a_plane() -> Case {
    let boxed = Placed { mesh: cuboid(), world_from_mesh: at(DVec3::new(0.3, 0.0, 0.0), 0.3), colour: [0.2, 0.4, 0.6] };
    let scene = scene("wall", vec![boxed, back(DVec3::new(0.0, 0.0, -1.5))]);
    Case::look(scene, DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO, 0.01)
}

/// An eye exactly in the plane of a floor, which it sees nothing of, and above which its region's rim lies.
fn on_a_floor() -> Case {
    let scene = scene("floor", vec![floor(DVec3::ZERO, 2.0), back(DVec3::new(0.0, 2.0, -2.0))]);
    Case::look(scene, DVec3::new(0.0, 0.0, 0.5), DVec3::new(0.0, 0.0, -2.0), 0.01)
}

/// A ball of two metres around the eye, and one in it.
fn inside() -> Case {
    let ball = |place: DVec3, size, colour| Placed { mesh: ball(RINGS), world_from_mesh: at(place, size), colour };
    let parts = vec![ball(DVec3::ZERO, 2.0, [0.5, 0.4, 0.6]), ball(DVec3::new(0.3, 0.0, -1.0), 0.3, [0.7, 0.3, 0.2])];
    Case::look(scene("inside", parts), DVec3::new(0.1, 0.0, 0.3), DVec3::new(0.1, 0.0, -1.0), 0.01)
}

/// An eye at the pole of a ball, in which all of its triangles there meet, that looks along the ball's tangent plane at a wall.
fn at_a_vertex() -> Case {
    let ball = Placed { mesh: ball(RINGS), world_from_mesh: at(DVec3::ZERO, 0.5), colour: [0.7, 0.3, 0.2] };
    let scene = scene("pole", vec![ball, back(DVec3::new(0.0, 0.5, -2.0))]);
    Case::look(scene, DVec3::new(0.0, 0.5, 0.0), DVec3::new(0.0, 0.3, -2.0), 0.01)
}

/// A board of cells of two pixels whose corners lie on the rays through the middles of pixels, or that far beside, in pixels.
fn along_edges(beside_px: f64) -> Case {
    let distance_m = 2.0;
    let pixel_m = 2.0 * distance_m * (FOV_Y_RAD / 2.0).tan() / f64::from(PICTURE_PX);
    // The middle of the picture lies between four pixels.
    let offset_m = (0.5 + beside_px) * pixel_m;
    let placed = Placed {
        mesh: grid(48),
        world_from_mesh: at(DVec3::new(offset_m, offset_m, 0.0), 2.0 * pixel_m),
        colour: [0.4, 0.5, 0.6],
    };
    Case::look(scene("edges", vec![placed]), DVec3::new(0.0, 0.0, distance_m), DVec3::ZERO, 0.01)
}

/// Square cells of side 1, an even number along each side, around the origin in the plane z = 0.
fn grid(cells: u32) -> Mesh {
    let corners = cells + 1;
    let step = |index: u32| index as f32 - (cells / 2) as f32;
    let corner = |index: u32| (Vec3::new(step(index % corners), step(index / corners), 0.0), Vec3::Z);
    let cell = |index: u32| {
        let a = index / cells * corners + index % cells;
        let b = a + corners;
        [a, a + 1, b + 1, a, b + 1, b]
    };
    mesh((0..corners * corners).map(corner), (0..cells * cells).flat_map(cell).collect())
}
