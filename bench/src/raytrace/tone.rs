//! From light to the linear colours of a picture and back, by the words of [`protocol::Tone`], in f64.

use glam::DVec3;
use protocol::Tone;

use super::srgb::linear_from_srgb;

/// The Khronos PBR neutral tone mapper (2024): where it begins to compress, and how fast it takes colour away.
const NEUTRAL: (f64, f64) = (0.8 - 0.04, 0.15);

/// The linear colour on the screen, 0 to 1, of exposed light.
pub(super) fn shown(tone: Tone, light: DVec3) -> DVec3 {
    let linear = match tone {
        Tone::Exponential => DVec3::ONE - (-light).exp(),
        Tone::Neutral => neutral(light),
        Tone::Aces => (light * (light * 2.51 + 0.03)) / (light * (light * 2.43 + 0.59) + 0.14),
        Tone::Cut => light,
    };
    linear.clamp(DVec3::ZERO, DVec3::ONE)
}

/// The light that is shown as a linear colour. No light is shown as full white by most tones, so the colour counts up to what lies amid those
/// that are shown as the code 255, which begin at 254.5.
pub(super) fn light_shown_as(tone: Tone, linear: DVec3) -> DVec3 {
    let most = linear_from_srgb(254.75 / 255.0);
    let linear = linear.clamp(DVec3::ZERO, DVec3::splat(most));
    match tone {
        Tone::Exponential => linear.to_array().map(|channel| -(1.0 - channel).ln()).into(),
        Tone::Neutral => light_of_neutral(linear),
        Tone::Aces => linear.to_array().map(light_of_aces).into(),
        Tone::Cut => linear,
    }
}

fn neutral(light: DVec3) -> DVec3 {
    let (start, fading) = NEUTRAL;
    let least = light.min_element();
    let colour = light - if least < 0.08 { least - 6.25 * least * least } else { 0.04 };
    let peak = colour.max_element();
    if peak < start {
        return colour;
    }
    let room = 1.0 - start;
    let compressed = 1.0 - room * room / (peak + room - start);
    let white = 1.0 - 1.0 / (fading * (peak - compressed) + 1.0);
    (colour * (compressed / peak)).lerp(DVec3::splat(compressed), white)
}

fn light_of_neutral(shown: DVec3) -> DVec3 {
    let (start, fading) = NEUTRAL;
    let room = 1.0 - start;
    let compressed = shown.max_element();
    let mut colour = shown;
    if compressed >= start {
        let peak = room * room / (1.0 - compressed) - room + start;
        let white = 1.0 - 1.0 / (fading * (peak - compressed) + 1.0);
        colour = (shown - DVec3::splat(compressed * white)) / (1.0 - white) * (peak / compressed);
    }
    // Below 0.08 of the least channel x, 6.25 x^2 is left of it; above, all but 0.04.
    let least = colour.min_element();
    colour + if least < 0.04 { (least.max(0.0) / 6.25).sqrt() - least } else { 0.04 }
}

fn light_of_aces(shown: f64) -> f64 {
    let (a, b, c) = (2.43 * shown - 2.51, 0.59 * shown - 0.03, 0.14 * shown);
    // The root that is not negative; `a` is below 0 for what is shown at all.
    (-b - (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tone_is_turned_back() {
        for tone in [Tone::Exponential, Tone::Neutral, Tone::Aces, Tone::Cut] {
            for rgb in [[0.0, 0.0, 0.0], [0.02, 0.5, 0.1], [0.3, 0.3, 0.3], [0.85, 0.95, 0.8], [0.97, 0.9, 0.93]] {
                let wanted = DVec3::from(rgb);
                let found = shown(tone, light_shown_as(tone, wanted));
                assert!(found.distance(wanted) < 1e-9, "{tone:?} shows {found} instead of {wanted}");
            }
        }
    }
}
