//! Where a viewer is asked to begin, as an address of the browser client writes it: `eye=0,1.6,3&target=0,1,0&fov=40`.

use camera::Rigid;
use glam::DVec3;
use protocol::message::Role;

/// Vertical fields of view that pictures keep their shapes in, in degrees.
const FOV_DEG: std::ops::RangeInclusive<f64> = 1.0..=150.0;

/// Exposures that leave something to be seen: from a picture in which white is black to one in which a thousandth is white.
const STOPS: std::ops::RangeInclusive<f32> = -10.0..=10.0;

/// `world_from_eye` of an eye at the point `eye` that looks at the point `target`; `None` without both.
pub fn pose(eye: Option<&str>, target: Option<&str>) -> Result<Option<Rigid>, String> {
    let (eye, target) = match (eye, target) {
        (None, None) => return Ok(None),
        (Some(eye), Some(target)) => (point("eye", eye)?, point("target", target)?),
        _ => return Err("?eye= and ?target= go together".to_owned()),
    };
    if eye == target {
        return Err("?eye= and ?target= are one point".to_owned());
    }
    Ok(Some(Rigid::look_at(eye, target)))
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
        let pose = pose(Some("0,1.5,4"), Some("0,1.5,-2e1")).unwrap().unwrap();
        assert_eq!(pose.translation, DVec3::new(0.0, 1.5, 4.0));
        assert!(pose.transform_vector(DVec3::Z).abs_diff_eq(DVec3::NEG_Z, 1e-12));
        assert!((fov_y_rad("90").unwrap() - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
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
        assert_eq!(pose(None, None), Ok(None));
        for (eye, target, word) in [
            (Some("1,2,3"), None, "together"),
            (Some("1,2"), Some("0,0,0"), "?eye=1,2:"),
            (Some("1,2,3"), Some("0,NaN,0"), "?target=0,NaN,0:"),
            (Some("1,2,3"), Some("1,2,3"), "one point"),
        ] {
            let said = pose(eye, target).unwrap_err();
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
