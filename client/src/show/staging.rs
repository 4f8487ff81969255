//! How a scene is put before a viewer, as addresses of the browser client write it: `time=1.5`, `rate=0.5`, `hide=3,7` or `only=4`, and `cut=0,1,0,2.5`.

use glam::DVec3;
use protocol::staging::{Excerpt, Parts, Playback, Section, Staging};

/// Names of the parts of an address that say it.
pub const NAMES: [&str; 5] = ["time", "rate", "hide", "only", "cut"];

/// What parts of an address ask for, each by its name.
///
/// # Errors
/// What is no number, no object or no plane, by its name.
pub fn staging(part: impl Fn(&str) -> Option<String>) -> Result<Staging, String> {
    let playback = match (part("time"), part("rate")) {
        (None, None) => Playback::default(),
        (Some(_), Some(_)) => return Err("?time= stops the scene, and ?rate= lets it go: one of them".to_owned()),
        (Some(time), None) => Playback { scene_time_s: number("time", &time)?, rate: 0.0, from_s: 0.0 },
        (None, Some(rate)) => Playback { rate: number("rate", &rate)?, ..Playback::default() },
    };
    if !playback.is_valid() {
        return Err(format!("?rate= is 0 or goes from 0.001 to {}, and ?time= is in seconds", Playback::FASTEST));
    }
    let parts = match (part("hide"), part("only")) {
        (None, None) => Parts::All,
        (Some(_), Some(_)) => return Err("?hide= and ?only=: one of them".to_owned()),
        (Some(hidden), None) => Parts::But(objects("hide", &hidden)?),
        (None, Some(shown)) => Parts::Only(objects("only", &shown)?),
    };
    let section = part("cut").map(|cut| section(&cut)).transpose()?;
    Ok(Staging { playback, excerpt: Excerpt { parts, section } })
}

/// The same the other way round, at a time of the scene, in seconds.
pub fn parts(staging: &Staging, scene_time_s: Option<f64>) -> Vec<String> {
    let Staging { playback, excerpt: Excerpt { parts, section } } = staging;
    let joined = |objects: &[u16]| objects.iter().map(u16::to_string).collect::<Vec<_>>().join(",");
    let time = match scene_time_s.filter(|_| playback.is_paused()) {
        Some(time_s) => Some(format!("time={}", short(time_s))),
        None => (playback.rate != 1.0).then(|| format!("rate={}", short(playback.rate))),
    };
    let parts = match parts {
        Parts::All => None,
        Parts::But(hidden) => Some(format!("hide={}", joined(hidden))),
        Parts::Only(shown) => Some(format!("only={}", joined(shown))),
    };
    let section = section.map(|Section { normal_world: DVec3 { x, y, z }, offset_m }| {
        format!("cut={},{},{},{}", short(x), short(y), short(z), offset_m)
    });
    [time, parts, section].into_iter().flatten().collect()
}

/// A plane by its normal, of any length, and how far it lies from the origin along that, in metres.
///
/// # Errors
/// A normal without a direction, and an offset that is no number.
pub fn plane(normal: DVec3, offset_m: f64) -> Result<Section, String> {
    let normal_world = normal.try_normalize().ok_or("a plane's normal points somewhere")?;
    if offset_m.is_finite() { Ok(Section { normal_world, offset_m }) } else { Err("a plane lies somewhere".to_owned()) }
}

fn section(text: &str) -> Result<Section, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(str::parse).collect();
    let plane = match numbers.as_deref() {
        Ok(&[x, y, z, offset_m]) => plane(DVec3::new(x, y, z), offset_m),
        _ => Err("use four numbers with commas between them, a normal and how far along it, in metres".to_owned()),
    };
    plane.map_err(|why| format!("?cut={text}: {why}"))
}

fn objects(name: &str, text: &str) -> Result<Vec<u16>, String> {
    let objects: Result<Vec<u16>, _> = text.split(',').filter(|object| !object.is_empty()).map(str::parse).collect();
    let mut objects =
        objects.map_err(|_| format!("?{name}={text}: use numbers of objects with commas between them"))?;
    objects.sort_unstable();
    objects.dedup();
    if objects.len() <= Parts::MOST { Ok(objects) } else { Err(format!("?{name}=: {} at most", Parts::MOST)) }
}

fn number(name: &str, text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| format!("?{name}={text}: use a number"))
}

/// To a millionth, without zeros behind.
fn short(value: f64) -> String {
    let text = format!("{value:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(address: &str) -> Result<Staging, String> {
        let part = |name: &str| {
            let mut parts = address.split('&').filter_map(|part| part.split_once('='));
            parts.find(|(found, _)| *found == name).map(|(_, value)| value.to_owned())
        };
        staging(part)
    }

    #[test]
    fn an_address_leads_back_to_what_it_says() {
        for address in ["time=1.25&hide=3,7&cut=0,1,0,2.5", "rate=0.5&only=4", "only=", ""] {
            let staging = asked(address).expect("a sound address");
            assert_eq!(parts(&staging, Some(staging.playback.scene_time_s(9.0))).join("&"), address);
        }
        let cut = asked("cut=0,0,-4,0.125").expect("a plane").excerpt.section.expect("one");
        assert_eq!((cut.normal_world, cut.offset_m), (DVec3::NEG_Z, 0.125));
        assert_eq!(asked("hide=9,3,9").expect("objects").excerpt.parts, Parts::But(vec![3, 9]));
    }

    #[test]
    fn nonsense_is_named() {
        for (address, word) in [
            ("time=now", "?time=now"),
            ("time=1&rate=2", "one of them"),
            ("rate=-1", "?rate="),
            ("rate=NaN", "?rate="),
            ("hide=1&only=2", "one of them"),
            ("hide=wall", "?hide=wall"),
            ("only=70000", "?only=70000"),
            ("cut=0,0,0,1", "?cut=0,0,0,1"),
            ("cut=0,1,0", "four numbers"),
            ("cut=0,1,0,inf", "lies somewhere"),
        ] {
            let said = asked(address).unwrap_err();
            assert!(said.contains(word), "{address}: {said}");
        }
    }
}
