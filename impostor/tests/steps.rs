//! How many steps a ray takes, beside the papers' numbers (Rosen and others, section 7.2): what is reflected in a ball, of an
//! object before it in an image of 512x512 pixels by a single-pole camera, and of a maze in one of 1,920 pixels width by a graph
//! camera. `cargo test -p vantage-impostor --test steps -- --nocapture` prints them.

mod support;

use camera::{Pinhole, Rigid};
use glam::DVec3;
use support::{Image, Scene, Solid, scenes};
use vantage_impostor::{Method, Ray, Steps};

/// The rays that a mirror ball reflects of those of a view.
fn reflected(view: &Pinhole, centre: DVec3, radius: f64) -> Vec<Ray> {
    let mirror = Scene(vec![Solid::Ball { centre, radius }]);
    let eye = view.world_from_eye.translation;
    let pixels = (0..view.height_px).flat_map(|y| (0..view.width_px).map(move |x| (x, y)));
    let reflect = |(x, y): (u32, u32)| {
        let ray = view.ray_eye_from_image(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let direction = view.world_from_eye.transform_vector(ray);
        let met = mirror.points(eye, direction, 0.0, 1e3).into_iter().next()?;
        Some(Ray::endless(met.p_world, direction - met.normal * 2.0 * direction.dot(met.normal)))
    };
    pixels.filter_map(reflect).collect()
}

/// The mean steps of a way of walking over rays, those that meet something, and all hits.
fn mean_steps(image: &Image, rays: &[Ray], steps: Steps) -> (f64, usize) {
    let found: Vec<_> = rays.iter().map(|ray| image.impostor.hit(ray, steps)).collect();
    let sum: u32 = found.iter().map(|search| search.count.steps()).sum();
    (f64::from(sum) / rays.len() as f64, found.iter().filter(|search| search.hit.is_some()).count())
}

fn table(name: &str, image: &Image, rays: &[Ray]) -> impl Fn(Method, f64) -> f64 {
    println!("{name}, {} rays: steps at 1/4, 1/2, 1 pixel (hits)", rays.len());
    let methods = [Method::Points, Method::Fine, Method::Coarse { coarse_px: 6.0 }, Method::Hierarchy];
    let mut rows = Vec::new();
    for method in methods {
        let row = [0.25, 0.5, 1.0].map(|fine_px| mean_steps(image, rays, Steps { method, fine_px }));
        let text = row.map(|(steps, hits)| format!("{steps:6.1} ({hits})")).join("  ");
        println!("  {:28} {text}", format!("{method:?}"));
        rows.extend(row.iter().zip([0.25, 0.5, 1.0]).map(|(row, fine_px)| (method, fine_px, row.0)));
    }
    move |method, fine_px| {
        let row = rows.iter().find(|row| row.0 == method && row.1 == fine_px);
        row.map(|row| row.2).expect("a row")
    }
}

#[test]
fn rays_off_a_ball_find_an_object_in_few_steps() {
    let image = scenes::pot_by_spoc(512);
    let pose = Rigid::look_at(DVec3::new(-2.5, 1.5, -0.5), DVec3::new(0.0, 0.0, 2.2));
    let view = Pinhole::symmetric(pose, (160, 120), 0.9, 0.1);
    let bounds = Scene(vec![Solid::Block { min: scenes::POT_BOUNDS.min, max: scenes::POT_BOUNDS.max }]);
    let reaches = |ray: &Ray| !bounds.points(ray.origin_world, ray.direction_world, 0.0, 1e3).is_empty();
    let rays: Vec<Ray> = reflected(&view, DVec3::new(0.0, 0.0, 2.2), 1.2).into_iter().filter(reaches).collect();
    let steps = table("an object, 512 x 512", &image, &rays);
    // A third and less of the papers' 48, 31 and 22.
    for (fine_px, papers) in [(0.25, 48.0), (0.5, 31.0), (1.0, 22.0)] {
        assert!(steps(Method::Hierarchy, fine_px) < papers);
        assert!(steps(Method::Hierarchy, fine_px) < steps(Method::Coarse { coarse_px: 6.0 }, fine_px));
    }
}

#[test]
fn rays_off_a_ball_find_a_maze_in_few_steps() {
    let image = scenes::maze_by_graph((1920, 1440));
    let centre = DVec3::new(0.0, 1.4, 5.5);
    let view = Pinhole::symmetric(Rigid::look_at(DVec3::new(0.5, 1.7, 2.0), centre), (64, 48), 0.6, 0.1);
    let rays = reflected(&view, centre, 0.8);
    let steps = table("a maze, 1,920 x 1,440", &image, &rays);
    // The papers' coarse steps leave a sixth of the fine ones, 27 of 155.
    assert!(steps(Method::Coarse { coarse_px: 6.0 }, 1.0) < steps(Method::Fine, 1.0) * 27.0 / 155.0 * 1.2);
    assert!(steps(Method::Hierarchy, 1.0) < steps(Method::Coarse { coarse_px: 6.0 }, 1.0) / 3.0);
}
