//! Lights of all sizes where none should be, and what of them arrives.
//!
//! A server's own stage sends what lights see, and a client draws shadow maps of it, or soft shadows. The truth are rays to the same points of the light. Compared are
//! the pixels around which the truth hardly changes: edges of shadows are as blurred as samples and texels are wide.

use client::draw::shadow::{self, Shadows};
use glam::DVec3;
use protocol::message;
use protocol::{Area, AreaShape, Lamp};
use scene::SceneLight;

use super::effects::Effect;
use super::stiff::Stiff;
use crate::client_view::ClientView;
use crate::raytrace::{Effects, RayTruth};
use crate::topics::sent_once::walk::Setup;
use crate::topics::stability::build::{Placed, at, ball, floor, lamp, lit, scene};
use crate::topics::stability::case::{Case, PICTURE_PX};
use crate::topics::stability::check::Check;
use crate::topics::stability::lab::Lab;
use crate::topics::stability::served::Served;

use crate::topics::stability::way::Shown;

pub(super) const CASES: &[Stiff] = &[
    Stiff { name: "a point light, hard shadows", judge: |lab| judged(lab, lamp(ABOVE, None), Shadows::Maps) },
    Stiff {
        name: "a point light, where soft shadows are asked for",
        judge: |lab| judged(lab, lamp(ABOVE, None), Shadows::Soft),
    },
    Stiff { name: "a lamp of no size, soft shadows", judge: |lab| judged(lab, lamp(ABOVE, Some(0.0)), Shadows::Soft) },
    Stiff {
        name: "a lamp ten times as large as the scene",
        judge: |lab| judged(lab, lamp(ABOVE, Some(40.0)), Shadows::Soft),
    },
    Stiff { name: "a point light on the floor", judge: |lab| judged(lab, lamp(ON_FLOOR, None), Shadows::Maps) },
    Stiff { name: "a lamp that lies on the floor", judge: |lab| judged(lab, lamp(ON_FLOOR, Some(0.3)), Shadows::Soft) },
    Stiff { name: "a point light inside of a ball", judge: |lab| judged(lab, lamp(IN_BALL, None), Shadows::Maps) },
    Stiff { name: "a lamp inside of a ball", judge: |lab| judged(lab, lamp(IN_BALL, Some(0.1)), Shadows::Soft) },
    Stiff { name: "the sun along the floor", judge: |lab| judged(lab, sun(DVec3::X), Shadows::Maps) },
];

/// What is swept over the decades of a lamp, its size and its distance in metres.
pub(super) const EFFECTS: &[Effect] = &[
    Effect {
        name: "lamp size",
        parameter: "side of the lamp in m",
        values: &[1e-4, 1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3],
        judge: |lab, size_m| judged(lab, lamp(ABOVE, Some(size_m)), Shadows::Soft),
    },
    Effect {
        name: "light distance, hard",
        parameter: "distance of the light in m",
        values: &[1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6],
        judge: |lab, distance_m| judged(lab, lamp(away(distance_m), None), Shadows::Maps),
    },
    Effect {
        name: "light distance, soft",
        parameter: "distance of the lamp in m",
        values: &[1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6],
        judge: |lab, distance_m| judged(lab, lamp(away(distance_m), Some(0.2 * distance_m)), Shadows::Soft),
    },
];

/// Over the middle of the scene.
const ABOVE: DVec3 = DVec3::new(0.4, 2.0, 0.3);
const ON_FLOOR: DVec3 = DVec3::new(0.0, 0.0, 0.8);
const IN_BALL: DVec3 = DVec3::new(-0.4, 0.4, 0.0);
/// Of a lamp, along each side.
const POINTS: u32 = 8;
/// What arrives may be off by less than this: between nothing and all lies every error that is no blur.
const WRONG: f64 = 0.25;
/// What changes by less around a pixel, of all that arrives, is no edge.
const STEADY: f64 = 0.125;
/// How far from edges of shadows it is compared, in pixels: two samples of what the light sees, each as wide as two pixels of the picture.
const MARGIN_PX: usize = 4;
/// Light that grazes more is left out, and of lamps the share of the points whose light does: with the plane of a surface a shadow map's bias grows with the tangent of the angle, here up to ten texels.
const GRAZING_COS: f64 = 0.1;

fn away(distance_m: f64) -> DVec3 {
    DVec3::new(0.2, 1.0, 0.15).normalize() * distance_m * 2.0
}

fn sun(direction_world: DVec3) -> SceneLight {
    SceneLight::Directional { direction_world, colour: [1.0; 3] }
}

/// Two balls on and over a floor.
fn case(light: SceneLight) -> Case {
    let ball = |place: DVec3, size, colour| Placed { mesh: ball(48), world_from_mesh: at(place, size), colour };
    let parts = vec![
        floor(DVec3::ZERO, 2.0),
        ball(IN_BALL, 0.4, [0.7, 0.3, 0.2]),
        ball(DVec3::new(0.6, 0.6, 0.2), 0.25, [0.2, 0.4, 0.7]),
    ];
    Case::look(lit(scene("lit", parts), vec![light]), DVec3::new(0.3, 2.2, 3.0), DVec3::new(0.0, 0.2, 0.0), 0.01)
}

fn judged(lab: &Lab, light: SceneLight, shadows: Shadows) -> anyhow::Result<Vec<Check>> {
    let asked = if shadows == Shadows::Soft { message::Shadows::Soft } else { message::Shadows::Hard };
    let mut served = Served::new(lab, case(light), &Setup { shadows: asked, ..Served::usual() })?;
    let mut view = ClientView::new(&lab.gpu, (PICTURE_PX, PICTURE_PX))?;
    view.set_shadows(shadow::Settings { shadows, ..shadow::Settings::default() });
    served.tick(0.0)?;
    let shown = served.shown(&lab.gpu, &mut view, &Effects::PLAIN)?;
    let arriving = view.light_shares(&shown.camera)?;
    let points = points(&light, shadows);
    let seen = seen(&served.truth(), &shown, &points);
    let mut wrong = 0;
    let settled: Vec<usize> = settled(&seen).filter(|&pixel| shown.drawn.w[pixel] > 0.0).collect();
    for &pixel in &settled {
        let Some(light) = seen[pixel] else { continue };
        let arrives = arriving.as_ref().map_or(1.0, |shares| f64::from(shares[pixel][0]) / 255.0);
        wrong += usize::from((arrives - light.share).abs() > WRONG + light.grazing);
    }
    let share = (!settled.is_empty()).then(|| wrong as f64 / settled.len() as f64);
    let from = "four pixels from the edges of shadows, two samples of what the light sees, a quarter more or less, and as much as grazes, is no blur; a thousandth is left to contacts, under \
                which light leaks by half a texel";
    Ok(vec![
        Check::unfit(Some(shown.unfit.values as f64)),
        Check::new("light that is wrong beside the edges of shadows", (0.001, share), "share", from),
    ])
}

/// What rays go to: the points of a lamp that a client draws, or the light's own place.
fn points(light: &SceneLight, shadows: Shadows) -> Vec<DVec3> {
    /// So far away the sun is taken to be: over the scene its direction changes by a millionth.
    const AFAR_M: f64 = 1e6;
    match *light {
        SceneLight::Directional { direction_world, .. } => vec![-direction_world * AFAR_M],
        SceneLight::Point { position_world, area: Some(area), .. } if shadows == Shadows::Soft => {
            let half_world = area.half_world.map(|half| half.to_array());
            let lamp = Lamp { middle_world: position_world, area: Area { half_world, shape: AreaShape::Rectangle } };
            lamp.area.points_world(lamp.middle_world, POINTS).collect()
        }
        SceneLight::Point { position_world, .. } => vec![position_world],
    }
}

/// What a surface sees of a light.
#[derive(Debug, Clone, Copy)]
struct Seen {
    /// Of its points.
    share: f64,
    /// The share of the points whose light grazes the surface.
    grazing: f64,
}

/// What each pixel's surface sees of the light; `None` where it sees nothing or light grazes it.
fn seen(truth: &RayTruth, shown: &Shown, points: &[DVec3]) -> Vec<Option<Seen>> {
    let hidden = truth.hidden_points(&shown.camera, points);
    let share = |(words, first): (&Option<Vec<u64>>, &Option<crate::raytrace::SurfacePoint>)| {
        let (words, first) = (words.as_ref()?, first.as_ref()?);
        let cosine = |point: DVec3| (point - first.p_world).normalize_or_zero().dot(first.normal_world);
        let middle = points.iter().sum::<DVec3>() / points.len() as f64;
        let faces = cosine(middle) > GRAZING_COS && points.iter().all(|point| cosine(*point) > 0.0);
        let hidden: u32 = words.iter().map(|word| word.count_ones()).sum();
        let share_of = |count: usize| count as f64 / points.len() as f64;
        let grazing = points.iter().filter(|point| cosine(**point) < GRAZING_COS).count();
        faces.then(|| Seen { share: 1.0 - share_of(hidden as usize), grazing: share_of(grazing) })
    };
    hidden.iter().zip(&shown.truth.first).map(share).collect()
}

/// The pixels around which as much arrives.
fn settled(seen: &[Option<Seen>]) -> impl Iterator<Item = usize> + '_ {
    let side = PICTURE_PX as usize;
    let inner = MARGIN_PX..side - MARGIN_PX;
    let pixels = inner.clone().flat_map(move |y| inner.clone().map(move |x| y * side + x));
    pixels.filter(move |pixel| {
        let reach = 0..=2 * MARGIN_PX;
        let first = pixel - MARGIN_PX * side - MARGIN_PX;
        let mut around = reach.clone().flat_map(|y| reach.clone().map(move |x| first + y * side + x));
        let is_like =
            |beside: usize| seen[beside].zip(seen[*pixel]).is_some_and(|(a, b)| (a.share - b.share).abs() <= STEADY);
        around.all(is_like)
    })
}
