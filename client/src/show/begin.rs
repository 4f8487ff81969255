//! Where a viewer is asked to begin, as an address of the browser client writes it: `eye=0,1.6,3&target=0,1,0&fov=40`.

use camera::Rigid;
use glam::DVec3;
use protocol::message::Role;

use crate::show::controls::Mode;

/// Vertical fields of view that pictures keep their shapes in, in degrees.
const FOV_DEG: std::ops::RangeInclusive<f64> = 1.0..=150.0;

/// Exposures that leave something to be seen: from a picture in which white is black to one in which a thousandth is white.
const STOPS: std::ops::RangeInclusive<f32> = -10.0..=10.0;

/// Places are written down to this share of the distance to what is looked at: a thousandth of a pixel.
const DIGITS: f64 = 1e-6;

/// Where to begin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// The eye.
    pub world_from_eye: Rigid,
    /// How far before it that is which it looks at, and turns about.
    pub distance_m: f64,
}

/// An eye at the point `eye` that looks at the point `target`; `None` without both.
pub fn start(eye: Option<&str>, target: Option<&str>) -> Result<Option<Start>, String> {
    let (eye, target) = match (eye, target) {
        (None, None) => return Ok(None),
        (Some(eye), Some(target)) => (point("eye", eye)?, point("target", target)?),
        _ => return Err("?eye= and ?target= go together".to_owned()),
    };
    view(eye, target).map(Some).map_err(|why| format!("?eye= and ?target=: {why}"))
}

/// An eye that looks at a point.
pub fn view(eye: DVec3, target: DVec3) -> Result<Start, String> {
    let distance_m = eye.distance(target);
    if distance_m.is_finite() && distance_m > 0.0 {
        Ok(Start { world_from_eye: Rigid::look_at(eye, target), distance_m })
    } else {
        Err("an eye looks at another point, so many metres away".to_owned())
    }
}

/// The same the other way round, as parts of an address. Roll is left out.
pub fn parts(world_from_eye: Rigid, distance_m: f64) -> String {
    let eye = world_from_eye.translation;
    let target = eye + world_from_eye.transform_vector(DVec3::Z) * distance_m;
    let decimals = (-(distance_m * DIGITS).log10()).ceil().clamp(0.0, 12.0) as usize;
    let number = |value: f64| {
        let text = format!("{value:.decimals$}");
        let short = if decimals > 0 { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        if short == "-0" { "0".to_owned() } else { short.to_owned() }
    };
    let point = |at: DVec3| at.to_array().map(number).join(",");
    format!("eye={}&target={}", point(eye), point(target))
}

/// How the eye moves, as addresses name it.
pub fn mode(name: &str) -> Result<Mode, String> {
    let modes = [Mode::Walk, Mode::Orbit];
    modes.into_iter().find(|&mode| mode_name(mode) == name).ok_or_else(|| format!("?mode={name}: use walk or turn"))
}

/// Its name.
pub fn mode_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Walk => "walk",
        Mode::Orbit => "turn",
    }
}

/// What a viewer is there for, who may have been asked for a camera, or to present or follow, by a name.
pub fn role(camera: Option<String>, present: Option<String>, follow: Option<String>) -> Result<Role, String> {
    let roles = [camera.map(Role::Camera), present.map(Role::Presenter), follow.map(Role::Follower)];
    let mut roles = roles.into_iter().flatten();
    let role = roles.next().unwrap_or_default();
    if roles.next().is_some() {
        return Err("a viewer shows one camera, presents or follows: one of them".to_owned());
    }
    match &role {
        Role::Presenter(name) | Role::Follower(name) if name.is_empty() || name.len() > Role::MAX_NAME_BYTES => {
            Err(format!("{name:?} is no name of a presenter: use 1 to {} bytes", Role::MAX_NAME_BYTES))
        }
        _ => Ok(role),
    }
}

/// A vertical field of view in degrees, as radians.
pub fn fov_y_rad(degrees: &str) -> Result<f64, String> {
    let number = degrees.parse().ok().filter(|number| FOV_DEG.contains(number));
    let (least, most) = (FOV_DEG.start(), FOV_DEG.end());
    number.map(f64::to_radians).ok_or_else(|| format!("?fov={degrees}: use {least} to {most} degrees"))
}

/// A number of stops of exposure.
pub fn stops(text: &str) -> Result<f32, String> {
    let number = text.parse().ok().filter(|stops| STOPS.contains(stops));
    let (least, most) = (STOPS.start(), STOPS.end());
    number.ok_or_else(|| format!("{text} is no exposure: use {least} to {most} stops"))
}

fn point(name: &str, text: &str) -> Result<DVec3, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(str::parse).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z]) if x.is_finite() && y.is_finite() && z.is_finite() => Ok(DVec3::new(x, y, z)),
        _ => Err(format!("?{name}={text}: use three numbers, in metres, with commas between them")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_eye_looks_at_its_target() {
        let start = start(Some("0,1.5,4"), Some("0,1.5,-2e1")).unwrap().unwrap();
        let pose = start.world_from_eye;
        assert_eq!(start.distance_m, 24.0);
        assert_eq!(pose.translation, DVec3::new(0.0, 1.5, 4.0));
        assert!(pose.transform_vector(DVec3::Z).abs_diff_eq(DVec3::NEG_Z, 1e-12));
        assert!((fov_y_rad("90").unwrap() - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    }

    #[test]
    fn an_address_leads_back_to_a_view() {
        for (eye, target) in [
            (DVec3::new(0.1, 1.7, -3.0), DVec3::new(4.0, 0.0, 1.0 / 3.0)),
            (DVec3::new(6_378_137.25, -0.4, 1e5), DVec3::new(6_378_100.0, 3.0, 1e5)),
            (DVec3::new(1e-5, 2e-5, 3e-5), DVec3::ZERO),
            (DVec3::new(-2e4, 8e3, 0.0), DVec3::new(0.0, 1.0, 9e7)),
        ] {
            let distance_m = eye.distance(target);
            let text = parts(Rigid::look_at(eye, target), distance_m);
            let (first, second) = text.split_once('&').expect("two parts");
            let strip = |part: &str, name: &str| part.strip_prefix(name).expect("a name").to_owned();
            let (first, second) = (strip(first, "eye="), strip(second, "target="));
            let back = start(Some(&first), Some(&second)).unwrap().unwrap();
            // A place in f64 has 52 bits of where it is.
            let most = 2.0 * DIGITS * distance_m + 1e-15 * eye.length();
            assert!(back.world_from_eye.translation.distance(eye) < most, "{text}");
            let forward = back.world_from_eye.transform_vector(DVec3::Z);
            assert!(forward.distance((target - eye).normalize()) < 4.0 * DIGITS, "{text}");
        }
        assert_eq!(parts(Rigid::look_at(DVec3::Z * 4.0, DVec3::ZERO), 4.0), "eye=0,0,4&target=0,0,0");
        assert_eq!((mode("walk"), mode("turn")), (Ok(Mode::Walk), Ok(Mode::Orbit)));
        assert!(mode("fly").unwrap_err().starts_with("?mode=fly:"));
    }

    #[test]
    fn a_viewer_has_one_role() {
        let named = |name: &str| Some(name.to_owned());
        assert_eq!(role(None, None, None), Ok(Role::Viewer));
        assert_eq!(role(None, None, named("Ada")), Ok(Role::Follower("Ada".to_owned())));
        assert!(role(named("top"), named("Ada"), None).unwrap_err().contains("one of them"));
        for wrong in ["", &"a".repeat(65)] {
            assert!(role(None, named(wrong), None).unwrap_err().contains("no name"), "{wrong}");
        }
    }

    #[test]
    fn nonsense_is_named() {
        assert_eq!(start(None, None), Ok(None));
        for (eye, target, word) in [
            (Some("1,2,3"), None, "together"),
            (Some("1,2"), Some("0,0,0"), "?eye=1,2:"),
            (Some("1,2,3"), Some("0,NaN,0"), "?target=0,NaN,0:"),
            (Some("1,2,3"), Some("1,2,3"), "another point"),
        ] {
            let said = start(eye, target).unwrap_err();
            assert!(said.contains(word), "{said}");
        }
        assert_eq!(stops("-1.5"), Ok(-1.5));
        for wrong in ["11", "NaN", "bright", ""] {
            assert!(stops(wrong).unwrap_err().contains("stops"), "{wrong}");
        }
        for degrees in ["0", "180", "wide"] {
            assert!(fov_y_rad(degrees).unwrap_err().starts_with(&format!("?fov={degrees}:")));
        }
    }
}
