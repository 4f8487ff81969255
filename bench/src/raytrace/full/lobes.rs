//! Lobes of glTF's materials in the local space of a surface, whose normal is z; and the shares of even light that they send back.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

/// Squares of roughness count from here on: smoother ones are mirrors to this many digits.
const LEAST_ALPHA: f64 = 1e-4;

/// Where light comes from and goes to, by the cosines that lobes depend on.
pub(super) struct Pair {
    pub n_l: f64,
    pub n_v: f64,
    pub n_h: f64,
    pub l_h: f64,
}

impl Pair {
    /// Of unit vectors.
    pub fn new(eye: DVec3, light: DVec3) -> Pair {
        let half_way = (eye + light).normalize_or(DVec3::Z);
        Pair { n_l: light.z, n_v: eye.z, n_h: half_way.z.clamp(0.0, 1.0), l_h: light.dot(half_way).clamp(0.0, 1.0) }
    }
}

fn alpha(roughness: f64) -> f64 {
    (roughness * roughness).max(LEAST_ALPHA)
}

/// The roots of Smith's masking for GGX (Walter and others, *Microfacet models for refraction through rough surfaces*, 2007).
fn lambda(alpha: f64, cosine: f64) -> f64 {
    let squared = cosine * cosine;
    0.5 * ((1.0 + alpha * alpha * (1.0 - squared) / squared).sqrt() - 1.0)
}

/// The GGX lobe with height-correlated masking (Heitz, *Understanding the masking-shadowing function*, 2014), times the light's cosine.
pub(super) fn ggx(roughness: f64, pair: &Pair) -> f64 {
    let alpha = alpha(roughness);
    let narrow = pair.n_h * pair.n_h * (alpha * alpha - 1.0) + 1.0;
    let spread = alpha * alpha / (PI * narrow * narrow);
    spread / (1.0 + lambda(alpha, pair.n_v) + lambda(alpha, pair.n_l)) / (4.0 * pair.n_v)
}

/// A direction of light in proportion to what the GGX lobe shows an eye of it, and what it counts for: facets are drawn among those that the eye sees
/// (Heitz, *Sampling the GGX distribution of visible normals*, 2018). `None` below the surface.
pub(super) fn facet_direction(roughness: f64, eye: DVec3, point: DVec2) -> Option<(DVec3, f64)> {
    let alpha = alpha(roughness);
    let stretched = DVec3::new(alpha * eye.x, alpha * eye.y, eye.z).normalize();
    let across = DVec3::Z.cross(stretched).try_normalize().unwrap_or(DVec3::X);
    let up = stretched.cross(across);
    let (radius, turn) = (point.x.sqrt(), TAU * point.y);
    let x = radius * turn.cos();
    let share = 0.5 * (1.0 + stretched.z);
    let y = (1.0 - share) * (1.0 - x * x).sqrt() + share * radius * turn.sin();
    let facet = across * x + up * y + stretched * (1.0 - x * x - y * y).max(0.0).sqrt();
    let half_way = DVec3::new(alpha * facet.x, alpha * facet.y, facet.z.max(0.0)).normalize();
    let light = half_way * (2.0 * eye.dot(half_way)) - eye;
    if light.z <= 0.0 {
        return None;
    }
    let (of_eye, of_light) = (lambda(alpha, eye.z), lambda(alpha, light.z));
    Some((light, (1.0 + of_eye) / (1.0 + of_eye + of_light)))
}

/// Of so many points that are strewn evenly over the unit square.
pub(super) fn hammersley(index: u32, count: u32) -> DVec2 {
    DVec2::new((f64::from(index) + 0.5) / f64::from(count), f64::from(index.reverse_bits()) / 2f64.powi(32))
}

/// A direction in proportion to its cosine.
pub(super) fn cosine_direction(point: DVec2) -> DVec3 {
    let (radius, turn) = (point.x.sqrt(), TAU * point.y);
    DVec3::new(radius * turn.cos(), radius * turn.sin(), (1.0 - point.x).sqrt())
}

/// What fibres scatter, a unit of solid angle (`KHR_materials_sheen`): the spread of Estevez and Kulla, 2017, with the masking of Neubelt and Pettineo, 2013.
pub(super) fn fibres(roughness: f64, pair: &Pair) -> f64 {
    let inverse = 1.0 / (roughness * roughness);
    let sine = (1.0 - pair.n_h * pair.n_h).max(0.0).sqrt();
    let spread = (2.0 + inverse) * sine.powf(inverse) / TAU;
    spread / (4.0 * (pair.n_l + pair.n_v - pair.n_l * pair.n_v))
}

/// Shares of even light that lobes send back, by roughness and the eye's cosine, summed once.
pub(super) struct Albedo {
    facets: Table,
    fibres: Table,
    /// By roughness: the mean over all eyes, by their cosine.
    facets_mean: Vec<f64>,
}

/// Steps of roughness and of cosines.
const STEPS: usize = 32;
/// Directions that a share is summed over.
const SUMMED: u32 = 1024;

/// By roughness, then by cosine; both at the middles of their steps.
struct Table(Vec<[f64; STEPS]>);

fn step(index: usize) -> f64 {
    (index as f64 + 0.5) / STEPS as f64
}

impl Table {
    fn of(share: impl Fn(f64, DVec3) -> f64) -> Table {
        let eye = |cosine: f64| DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
        let row = |roughness: usize| std::array::from_fn(|cosine| share(step(roughness), eye(step(cosine))));
        Table((0..STEPS).map(row).collect())
    }

    fn at(&self, roughness: f64, cosine: f64) -> f64 {
        let place = |x: f64| {
            let x = (x * STEPS as f64 - 0.5).clamp(0.0, (STEPS - 1) as f64);
            ((x as usize).min(STEPS - 2), x - (x as usize).min(STEPS - 2) as f64)
        };
        let ((r, r_share), (c, c_share)) = (place(roughness), place(cosine));
        let row = |r: usize| self.0[r][c] + (self.0[r][c + 1] - self.0[r][c]) * c_share;
        row(r) + (row(r + 1) - row(r)) * r_share
    }
}

impl Albedo {
    pub fn new() -> Albedo {
        let points: Vec<DVec2> = (0..SUMMED).map(|index| hammersley(index, SUMMED)).collect();
        let count = points.len() as f64;
        let facets = Table::of(|roughness, eye| {
            let weight = |&point: &DVec2| facet_direction(roughness, eye, point).map_or(0.0, |(_, weight)| weight);
            points.iter().map(weight).sum::<f64>() / count
        });
        let by_fibres = Table::of(|roughness, eye| {
            let scattered = |&point: &DVec2| fibres(roughness, &Pair::new(eye, cosine_direction(point))) * PI;
            points.iter().map(scattered).sum::<f64>() / count
        });
        let mean = |row: &[f64; STEPS]| {
            let weighted = row.iter().enumerate().map(|(index, share)| 2.0 * step(index) * share);
            weighted.sum::<f64>() / STEPS as f64
        };
        Albedo { facets_mean: facets.0.iter().map(mean).collect(), facets, fibres: by_fibres }
    }

    pub fn facets(&self, roughness: f64, cosine: f64) -> f64 {
        self.facets.at(roughness, cosine)
    }

    pub fn facets_mean(&self, roughness: f64) -> f64 {
        let index = (roughness * STEPS as f64 - 0.5).clamp(0.0, (STEPS - 1) as f64);
        let lower = (index as usize).min(STEPS - 2);
        let share = index - lower as f64;
        self.facets_mean[lower] * (1.0 - share) + self.facets_mean[lower + 1] * share
    }

    pub fn fibres(&self, roughness: f64, cosine: f64) -> f64 {
        self.fibres.at(roughness, cosine)
    }
}
