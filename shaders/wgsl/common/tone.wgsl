// From light to a picture and back: `protocol::Tone`.
#import "common/srgb.wgsl"

const TONE_EXPONENTIAL: u32 = 0u;
const TONE_NEUTRAL: u32 = 1u;
const TONE_ACES: u32 = 2u;
const TONE_CUT: u32 = 3u;

// The Khronos PBR neutral tone mapper, 2024: highlights are compressed above 0.8 - 0.04, and lose their colour by 0.15.
const NEUTRAL_START: f32 = 0.76;
const NEUTRAL_DESATURATION: f32 = 0.15;

// Of the least channel, what reflects off a dielectric of 4 % is taken away.
fn neutral_offset(least: f32) -> f32 {
    return select(0.04, least - 6.25 * least * least, least < 0.08);
}

fn tone_neutral(light: vec3f) -> vec3f {
    let colour = light - neutral_offset(min(light.r, min(light.g, light.b)));
    let peak = max(colour.r, max(colour.g, colour.b));
    if peak < NEUTRAL_START {
        return colour;
    }
    let span = 1.0 - NEUTRAL_START;
    let new_peak = 1.0 - span * span / (peak + span - NEUTRAL_START);
    let share = 1.0 - 1.0 / (NEUTRAL_DESATURATION * (peak - new_peak) + 1.0);
    return mix(colour * (new_peak / peak), vec3f(new_peak), share);
}

fn light_from_neutral(shown: vec3f) -> vec3f {
    var colour = shown;
    let new_peak = max(shown.r, max(shown.g, shown.b));
    if new_peak >= NEUTRAL_START {
        let span = 1.0 - NEUTRAL_START;
        let peak = span * span / (1.0 - new_peak) + NEUTRAL_START - span;
        let share = 1.0 - 1.0 / (NEUTRAL_DESATURATION * (peak - new_peak) + 1.0);
        colour = (shown - share * new_peak) / (1.0 - share) * (peak / new_peak);
    }
    let least = max(min(colour.r, min(colour.g, colour.b)), 0.0);
    // The offset leaves 6.25 x^2 of less than 0.08, so 0.04 there.
    return colour + select(0.04, sqrt(least / 6.25) - least, least < 0.04);
}

// Narkowicz, *ACES filmic tone mapping curve*, 2015.
fn tone_aces(light: vec3f) -> vec3f {
    return light * (2.51 * light + 0.03) / (light * (2.43 * light + 0.59) + 0.14);
}

// The positive root of (2.43 y - 2.51) x^2 + (0.59 y - 0.03) x + 0.14 y = 0.
fn light_from_aces(shown: vec3f) -> vec3f {
    let a = 2.51 - 2.43 * shown;
    let b = 0.59 * shown - 0.03;
    return (b + sqrt(b * b + 0.56 * a * shown)) / (2.0 * a);
}

// The linear colours, 0 to 1, that light is shown by.
fn toned(c: vec3f, tone: u32) -> vec3f {
    var linear = c;
    if tone == TONE_EXPONENTIAL {
        linear = 1.0 - exp(-c);
    } else if tone == TONE_NEUTRAL {
        linear = tone_neutral(c);
    } else if tone == TONE_ACES {
        linear = tone_aces(c);
    }
    return clamp(linear, vec3f(0.0), vec3f(1.0));
}

// The sRGB-encoded picture of light.
fn shown_from_light(c: vec3f, tone: u32) -> vec3f {
    return srgb_from_linear(toned(c, tone));
}

// The light that shows as a linear colour: the inverse of the tone. What is whiter than SHOWN_MAX, which an 8-bit picture does
// not tell from white, counts as that, as no light shows as white itself.
const SHOWN_MAX = 0.9990234375;

fn light_from_shown(linear: vec3f, tone: u32) -> vec3f {
    let shown = min(linear, vec3f(SHOWN_MAX));
    if tone == TONE_EXPONENTIAL {
        return -log(1.0 - shown);
    }
    if tone == TONE_NEUTRAL {
        return light_from_neutral(shown);
    }
    if tone == TONE_ACES {
        return light_from_aces(shown);
    }
    return shown;
}
