//! What clients do: behaviours by name, and scripts that share the clients among them.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;
use thiserror::Error;

/// What one client does.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Behaviour {
    /// Walks, or goes round an object, on a made path or a recorded trace.
    #[default]
    Walk,
    /// Goes round what it looks at, once in 10 s.
    Orbit,
    /// Stands still, each client elsewhere.
    Idle,
    /// Stands where the scene begins, as whoever opens a link does.
    Arrive,
    /// Walks; leaves without a word every 5 s, together with all of its kind, and is back within half a second.
    Reconnect,
    /// Walks, and reads nothing in the last 3 s of every 8 s.
    Stall,
}

/// Between two storms.
const STORM_EVERY_S: f64 = 5.0;
/// A stall begins anew after this long, and takes this much of it.
const STALL_EVERY_S: f64 = 8.0;
const STALL_S: f64 = 3.0;

impl Behaviour {
    /// All there are.
    pub const ALL: [Behaviour; 6] =
        [Behaviour::Walk, Behaviour::Orbit, Behaviour::Idle, Behaviour::Arrive, Behaviour::Reconnect, Behaviour::Stall];

    /// What people type.
    pub fn name(self) -> &'static str {
        match self {
            Behaviour::Walk => "walk",
            Behaviour::Orbit => "orbit",
            Behaviour::Idle => "idle",
            Behaviour::Arrive => "arrive",
            Behaviour::Reconnect => "reconnect",
            Behaviour::Stall => "stall",
        }
    }

    /// Whether it stays where it is.
    pub fn is_still(self) -> bool {
        matches!(self, Behaviour::Idle | Behaviour::Arrive)
    }

    /// Whether it goes by seconds of real time, which a virtual clock has none of.
    pub fn is_of_real_time(self) -> bool {
        matches!(self, Behaviour::Reconnect | Behaviour::Stall)
    }

    /// Whether a storm has come since it connected; both in seconds of the run.
    pub(super) fn leaves(self, connected_at_s: f64, now_s: f64) -> bool {
        self == Behaviour::Reconnect && (now_s / STORM_EVERY_S).floor() > (connected_at_s / STORM_EVERY_S).floor()
    }

    /// Whether it reads at a second of the run.
    pub(super) fn reads(self, now_s: f64) -> bool {
        self != Behaviour::Stall || now_s.rem_euclid(STALL_EVERY_S) < STALL_EVERY_S - STALL_S
    }
}

/// Behaviours with the parts of the clients that they get, as `walk:4,idle:1`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Script(Vec<(Behaviour, u32)>);

impl Script {
    /// All do the same.
    pub fn all(behaviour: Behaviour) -> Script {
        Script(vec![(behaviour, 1)])
    }

    /// What each of so many clients does. Names are mixed, so that a ramp brings all of them; the first client does what stands first.
    pub fn behaviours(&self, clients: usize) -> Vec<Behaviour> {
        let mut given = vec![0_u64; self.0.len()];
        let mut next = || {
            // Whoever has got the least of its part.
            let share = |place: usize| given[place] as f64 / f64::from(self.0[place].1);
            let place = (0..given.len()).min_by(|&a, &b| share(a).total_cmp(&share(b))).expect("a script names one");
            given[place] += 1;
            self.0[place].0
        };
        (0..clients).map(|_| next()).collect()
    }
}

impl fmt::Display for Script {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts: Vec<_> = self.0.iter().map(|(behaviour, part)| format!("{}:{part}", behaviour.name())).collect();
        formatter.write_str(&parts.join(","))
    }
}

/// Why a text is no script.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ScriptError {
    /// No such behaviour.
    #[error("`{0}` is no behaviour: there are {names}", names = Behaviour::ALL.map(Behaviour::name).join(", "))]
    Unknown(String),
    /// The same name again.
    #[error("{0} is named twice")]
    Twice(&'static str),
    /// A part that is no number from 1.
    #[error("`{0}` is no part of the clients: a whole number from 1")]
    Part(String),
}

impl FromStr for Script {
    type Err = ScriptError;

    fn from_str(text: &str) -> Result<Script, ScriptError> {
        let mut parts: Vec<(Behaviour, u32)> = Vec::new();
        for item in text.split(',') {
            let (name, part) = item.split_once(':').unwrap_or((item, "1"));
            let known = Behaviour::ALL.into_iter().find(|behaviour| behaviour.name() == name);
            let behaviour = known.ok_or_else(|| ScriptError::Unknown(name.to_owned()))?;
            let part = part.parse().ok().filter(|part| *part > 0).ok_or_else(|| ScriptError::Part(part.to_owned()))?;
            if parts.iter().any(|(named, _)| *named == behaviour) {
                return Err(ScriptError::Twice(behaviour.name()));
            }
            parts.push((behaviour, part));
        }
        Ok(Script(parts))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn script(text: &str) -> Script {
        text.parse().expect("a script")
    }

    fn error(text: &str) -> ScriptError {
        text.parse::<Script>().expect_err("no script")
    }

    #[test]
    fn scripts_are_read_and_written() {
        assert_eq!(script("idle"), Script::all(Behaviour::Idle));
        assert_eq!(script("walk:40,idle:10").to_string(), "walk:40,idle:10");
        for behaviour in Behaviour::ALL {
            assert_eq!(script(behaviour.name()), Script::all(behaviour));
        }
    }

    #[test]
    fn what_is_no_script_is_named() {
        assert_eq!(error("walk,run:2"), ScriptError::Unknown("run".to_owned()));
        assert!(error("run").to_string().ends_with("walk, orbit, idle, arrive, reconnect, stall"));
        for text in ["", "walk,", " walk"] {
            assert!(matches!(error(text), ScriptError::Unknown(_)), "{text}");
        }
        for part in ["0", "-1", "1.5", "", "x", "99999999999", "1:2"] {
            assert_eq!(error(&format!("walk:{part}")), ScriptError::Part(part.to_owned()));
        }
        assert_eq!(error("walk:2,idle,walk"), ScriptError::Twice("walk"));
    }

    #[test]
    fn clients_are_shared_by_parts_and_mixed() {
        let of = |text: &str, clients: usize| -> Vec<&str> {
            script(text).behaviours(clients).into_iter().map(Behaviour::name).collect()
        };
        assert_eq!(of("walk:2,idle:1", 6), ["walk", "idle", "walk", "walk", "idle", "walk"]);
        // What stands first comes first, however small its part.
        assert_eq!(of("orbit:1,walk:9", 3), ["orbit", "walk", "walk"]);
        let count = |behaviours: &[&str], name: &str| behaviours.iter().filter(|found| **found == name).count();
        let shared = of("walk:40,idle:10", 100);
        assert_eq!((count(&shared, "walk"), count(&shared, "idle")), (80, 20));
        assert!(of("walk", 0).is_empty());
    }

    #[test]
    fn storms_come_for_all_at_once_and_stalls_end() {
        assert!(!Behaviour::Reconnect.leaves(0.2, 4.9) && Behaviour::Reconnect.leaves(0.2, 5.0));
        assert!(!Behaviour::Reconnect.leaves(5.3, 9.9) && Behaviour::Reconnect.leaves(9.9, 10.1));
        assert!(!Behaviour::Walk.leaves(0.0, 60.0));
        let reads = [0.0, 4.9, 5.0, 7.9, 8.0, 13.1].map(|now_s| Behaviour::Stall.reads(now_s));
        assert_eq!(reads, [true, true, false, false, true, false]);
        assert!(Behaviour::Idle.reads(6.0));
    }
}
