//! Ways to draw samples that ours is compared with: a mesh over the grid of samples, the same with quads where it ends, and points.
//!
//! Xie, Wang, Popescu 2016, §4, describe them: a mesh joins four neighbouring samples by two triangles, unless a depth discontinuity
//! separates them, and so ends half a pixel before each outline and loses samples without neighbours. What counts as one
//! surface is the same for all, so that only the way of drawing differs.

use camera::{ImagePoint, Pinhole};
use protocol::DepthImage;
use surface::corners::{Plane, averaged, planes};
use surface::{CornerRules, PatchMesh, Vertex};

const NONE: u32 = u32::MAX;

/// The mesh over the samples of an image. `borders`: with a quarter of a quad from a sample's centre to each corner of its pixel where the mesh does
/// not reach, on the sample's own plane.
pub fn grid_mesh(image: &DepthImage, camera: &Pinhole, borders: bool) -> PatchMesh {
    let rules = CornerRules::default();
    let (planes, guarded) = planes(image, camera, &rules, None);
    let pixels: Vec<(u32, u32)> = image.mask.occupied().collect();
    let mut grid = vec![NONE; camera.width_px as usize * camera.height_px as usize];
    pixels.iter().zip(0..).for_each(|(&(x, y), sample)| grid[(y * camera.width_px + x) as usize] = sample);
    let at = |x: u32, y: u32| {
        let inside = x < camera.width_px && y < camera.height_px;
        if inside { grid[(y * camera.width_px + x) as usize] } else { NONE }
    };
    // The vertex of a sample is its centre, and has its number.
    let centre = |(sample, &(x, y)): (usize, &(u32, u32))| {
        vertex(image, sample, (x, y), [x as f32 + 0.5, y as f32 + 0.5, planes[sample].w])
    };
    let vertices = pixels.iter().enumerate().map(centre).collect();
    let mut mesh = PatchMesh { vertices, guarded, ..PatchMesh::default() };
    for y in 0..=camera.height_px {
        for x in 0..=camera.width_px {
            let (left, above) = (x.wrapping_sub(1), y.wrapping_sub(1));
            let around = [at(left, above), at(x, above), at(left, y), at(x, y)];
            if around == [NONE; 4] {
                continue;
            }
            let group = averaged(around.map(|sample| planes.get(sample as usize)), &rules).group;
            for own in 0..4 {
                let is_member = |&other: &usize| around[other] != NONE && group[other] == group[own];
                let members: Vec<usize> = (0..4).filter(is_member).collect();
                if around[own] == NONE {
                    continue;
                }
                if usize::from(group[own]) == own {
                    mesh.indices.extend(triangles(&members).iter().map(|&member| around[member]));
                }
                if borders && members.len() < 4 {
                    let sample = around[own] as usize;
                    let (pixel, plane) = (pixels[sample], &planes[sample]);
                    quarter(&mut mesh, (x as f32, y as f32), (image, sample, pixel), plane);
                }
            }
        }
    }
    mesh
}

/// Members of one surface among four samples, by twos and twos in reading order, as triangles.
fn triangles(members: &[usize]) -> &'static [usize] {
    match members {
        [0, 1, 2, 3] => &[0, 3, 1, 0, 2, 3],
        [0, 1, 2] => &[0, 2, 1],
        [0, 1, 3] => &[0, 3, 1],
        [0, 2, 3] => &[0, 2, 3],
        [1, 2, 3] => &[2, 3, 1],
        _ => &[],
    }
}

/// The part of a sample's pixel between its centre and one corner.
fn quarter(
    mesh: &mut PatchMesh,
    corner: (f32, f32),
    (image, sample, pixel): (&DepthImage, usize, (u32, u32)),
    plane: &Plane,
) {
    let centre = (pixel.0 as f32 + 0.5, pixel.1 as f32 + 0.5);
    let (left, right) = (centre.0.min(corner.0), centre.0.max(corner.0));
    let (top, bottom) = (centre.1.min(corner.1), centre.1.max(corner.1));
    let ratio = CornerRules::default().max_ratio;
    let point = |(u, v): (f32, f32)| {
        let w = plane.w + (u - centre.0) * plane.slope[0] + (v - centre.1) * plane.slope[1];
        vertex(image, sample, pixel, [u, v, w.clamp(plane.w / ratio, plane.w * ratio)])
    };
    push_quad(mesh, [(left, top), (right, top), (left, bottom), (right, bottom)].map(point));
}

/// Every sample as one pixel of the output, as points are drawn.
pub fn points(image: &DepthImage, camera: &Pinhole, output: &Pinhole) -> PatchMesh {
    let mut mesh = PatchMesh::default();
    for (sample, (x, y)) in image.mask.occupied().enumerate() {
        let w = f64::from(image.depth_scale.w(image.depth[sample]));
        let p_world = camera.world_from_image(ImagePoint { u: f64::from(x) + 0.5, v: f64::from(y) + 0.5, w });
        let Some(shown) = output.image_from_world(p_world) else { continue };
        let corners = [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)].map(|(right, down)| {
            let p_world = output.world_from_image(ImagePoint { u: shown.u + right, v: shown.v + down, ..shown });
            camera.image_from_world(p_world)
        });
        let [Some(a), Some(b), Some(c), Some(d)] = corners else { continue };
        let corner =
            |point: ImagePoint| vertex(image, sample, (x, y), [point.u as f32, point.v as f32, point.w as f32]);
        push_quad(&mut mesh, [a, b, c, d].map(corner));
    }
    mesh
}

/// Corners in reading order.
fn push_quad(mesh: &mut PatchMesh, corners: [Vertex; 4]) {
    let first = mesh.vertices.len() as u32;
    mesh.vertices.extend(corners);
    mesh.indices.extend(triangles(&[0, 1, 2, 3]).iter().map(|&corner| first + corner as u32));
}

fn vertex(image: &DepthImage, sample: usize, (x, y): (u32, u32), [u_px, v_px, w]: [f32; 3]) -> Vertex {
    let [r, g, b] = image.colour[sample];
    let normal = u32::from(u16::from_le_bytes(image.normal[sample]));
    Vertex {
        u_px,
        v_px,
        w,
        colour_material: u32::from_le_bytes([r, g, b, image.material[sample]]),
        normal_object: normal | u32::from(image.object[sample]) << 16,
        corner_colour_trim: u32::from_le_bytes([r, g, b, 0]),
        corner_normal_mover: normal,
        normal_rests_level_end: u32::from(image.normal_rest.get(sample).copied().unwrap_or(0)) * 0x101,
        pixel: x | y << 16,
    }
}

#[cfg(test)]
mod tests {
    use camera::{Camera, Rigid};
    use protocol::{DepthScale, Mask};

    use super::*;

    /// A wall 2 m away, as large as the image; the lower right sample belongs to another object.
    fn wall(side_px: u32) -> (DepthImage, Pinhole) {
        let camera = Pinhole::symmetric(Rigid::IDENTITY, (side_px, side_px), 1.0, 0.1);
        let mut mask = Mask::empty(side_px, side_px);
        (0..side_px * side_px).for_each(|pixel| mask.set(pixel % side_px, pixel / side_px, true));
        let samples = (side_px * side_px) as usize;
        let mut object = vec![1; samples];
        object[samples - 1] = 2;
        let image = DepthImage {
            camera: Camera::Pinhole(camera),
            depth_scale: DepthScale { w_min: 0.5, w_step: 0.0 },
            mask,
            depth: vec![0; samples],
            normal: vec![protocol::image::octahedral_code(glam::Vec3::NEG_Z); samples],
            normal_rest: Vec::new(),
            colour_rest: Vec::new(),
            share: Vec::new(),
            ends: Vec::new(),
            colour: vec![[9; 3]; samples],
            object,
            material: vec![0; samples],
        };
        (image, camera)
    }

    /// Area of the image that triangles cover, and the least of their turns (negative: as all quads turn).
    fn area_px(mesh: &PatchMesh) -> f32 {
        let doubled = mesh.indices.chunks_exact(3).map(|corners| {
            let [a, b, c] = [0, 1, 2].map(|i| mesh.vertices[corners[i] as usize]);
            let doubled = (b.u_px - a.u_px) * (c.v_px - a.v_px) - (b.v_px - a.v_px) * (c.u_px - a.u_px);
            assert!(doubled < 0.0, "seen from behind: {a:?} {b:?} {c:?}");
            -doubled
        });
        doubled.sum::<f32>() / 2.0
    }

    #[test]
    fn the_mesh_ends_at_centres_and_borders_fill_the_pixels() {
        let (image, camera) = wall(4);
        // 3 x 3 cells between the centres; half of the one with the other object is lost.
        assert_eq!(area_px(&grid_mesh(&image, &camera, false)), 8.5);
        // The rim of half a pixel, and in the broken cell four quarters beside the half that is there.
        assert_eq!(area_px(&grid_mesh(&image, &camera, true)), 8.0 + 0.5 + 7.0 + 1.0);
    }

    #[test]
    fn a_point_is_one_pixel_of_the_output() {
        let (image, camera) = wall(4);
        let nearer = Pinhole::symmetric(Rigid::look_along(glam::DVec3::ZERO, glam::DVec3::Z), (32, 32), 1.0, 0.1);
        let mesh = points(&image, &camera, &nearer);
        let scale = (camera.focal_px / nearer.focal_px) as f32;
        assert_eq!(mesh.indices.len(), 16 * 6);
        assert!((area_px(&mesh) - 16.0 * scale * scale).abs() < 1e-4, "{}", area_px(&mesh));
    }
}
