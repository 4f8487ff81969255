use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// What a path between two ends does to bytes, the same in both directions.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Link {
    /// There and back; half of it each way.
    pub rtt_s: f64,
    /// Each way's delay varies evenly by up to half of this to either side, so the round trip by up to all of it. Order is
    /// kept, and no delay is below zero.
    pub jitter_s: f64,
    /// Megabits (1e6) a second each way; `None` for no limit.
    pub mbit: Option<f64>,
    /// Pauses; `None` for a path without.
    pub stall: Option<Stall>,
    /// Share of packets that get lost, 0 to below 1. TCP sends them again: what it carries stays whole and in order, and comes later.
    pub loss: f64,
    /// How long what waits for the bandwidth may be, in seconds; `None` for a home router's. It takes a [`crate::Proxy`].
    pub queue_s: Option<f64>,
    /// A time without any network; `None` for a path without.
    pub blackout: Option<Blackout>,
    /// How the bandwidth changes; `None` for one that stays. It takes `mbit`.
    pub fading: Option<Fading>,
}

/// A bandwidth that changes as that of a moving radio does: its logarithm wanders about that of [`Link::mbit`], which is the median.
///
/// Eight recordings of American mobile networks (Winstein, Sivaraman, Balakrishnan, *Stochastic forecasts achieve high throughput and low delay over cellular networks*,
/// NSDI 2013; published with Mahimahi, Netravali and others, ATC 2015), taken by half seconds: LTE while driving has medians of 3.7 to 9.6 Mbit/s, a spread of 1.1 to 1.3 and
/// forgets in 2 to 12 s; 3G (UMTS) 1.9 Mbit/s, 1.3 and 6 s.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Fading {
    /// Standard deviation of the natural logarithm of the bandwidth.
    pub spread: f64,
    /// After so many seconds it resembles what it was by 1/e.
    pub forgets_s: f64,
}

/// A time in which everything that is sent gets lost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Blackout {
    /// Seconds of it.
    pub length_s: f64,
    /// When it begins, in seconds after the path does.
    pub begin_s: f64,
}

impl Blackout {
    /// When it is over.
    pub fn end_s(&self) -> f64 {
        self.begin_s + self.length_s
    }
}

/// A pause that comes again and again: nothing arrives in the first `length_s` of every period but the first.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Stall {
    /// Seconds of a pause; shorter than the period.
    pub length_s: f64,
    /// Seconds from the beginning of one pause to that of the next.
    pub period_s: f64,
}

/// Why a link's text was refused.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum LinkError {
    /// Not of the form `name=value`.
    #[error("'{0}' is not of the form name=value, as in rtt=40,jitter=20,mbit=20,stall=300@5000")]
    Form(String),
    /// A name that does not exist.
    #[error("'{0}' is not one of rtt, jitter, mbit, stall, loss, queue, blackout, fading")]
    Name(String),
    /// Given twice.
    #[error("'{0}' is given twice")]
    Twice(String),
    /// One that another one needs is missing.
    #[error("{0} needs {1}")]
    Needs(&'static str, &'static str),
    /// Not a number, or out of range.
    #[error("{name}={value}: {why}")]
    Value {
        /// Which.
        name: &'static str,
        /// As given.
        value: String,
        /// What it has to be.
        why: &'static str,
    },
}

/// A day: more is a slip of the finger, and keeps every sum of times finite.
const MAX_MS: f64 = 86_400_000.0;

impl FromStr for Link {
    type Err = LinkError;

    /// Reads `rtt=MS,jitter=MS,mbit=MBIT_PER_S,stall=MS@PERIOD_MS,loss=PERCENT,queue=MS,blackout=MS@BEGIN_MS,fading=SPREAD@MS`; each may be left out, in any order.
    /// Empty text is a path that does nothing.
    fn from_str(text: &str) -> Result<Link, LinkError> {
        let mut link = Link::default();
        let mut seen = Vec::new();
        for part in text.split(',').map(str::trim).filter(|part| !part.is_empty()) {
            let (name, value) = part.split_once('=').ok_or_else(|| LinkError::Form(part.into()))?;
            if seen.contains(&name) {
                return Err(LinkError::Twice(name.into()));
            }
            seen.push(name);
            match name {
                "rtt" => link.rtt_s = milliseconds("rtt", value)?,
                "jitter" => link.jitter_s = milliseconds("jitter", value)?,
                "mbit" => link.mbit = Some(mbit(value)?),
                "stall" => link.stall = Some(stall(value)?),
                "loss" => link.loss = loss(value)?,
                "queue" => link.queue_s = Some(milliseconds("queue", value)?),
                "blackout" => link.blackout = Some(blackout(value)?),
                "fading" => link.fading = Some(fading(value)?),
                _ => return Err(LinkError::Name(name.into())),
            }
        }
        if link.fading.is_some() && link.mbit.is_none() {
            return Err(LinkError::Needs("fading", "mbit"));
        }
        Ok(link)
    }
}

fn milliseconds(name: &'static str, value: &str) -> Result<f64, LinkError> {
    match value.parse::<f64>() {
        Ok(ms) if (0.0..=MAX_MS).contains(&ms) => Ok(ms / 1000.0),
        _ => Err(LinkError::Value { name, value: value.into(), why: "milliseconds from 0 to a day" }),
    }
}

fn mbit(value: &str) -> Result<f64, LinkError> {
    match value.parse::<f64>() {
        Ok(mbit) if (0.001..=1e6).contains(&mbit) => Ok(mbit),
        _ => Err(LinkError::Value { name: "mbit", value: value.into(), why: "megabits a second from 0.001 to 1e6" }),
    }
}

fn stall(value: &str) -> Result<Stall, LinkError> {
    let wrong = || LinkError::Value { name: "stall", value: value.into(), why: "MS@PERIOD_MS with MS below PERIOD_MS" };
    let (length, period) = value.split_once('@').ok_or_else(wrong)?;
    let stall = Stall { length_s: milliseconds("stall", length)?, period_s: milliseconds("stall", period)? };
    if stall.length_s < stall.period_s { Ok(stall) } else { Err(wrong()) }
}

fn loss(value: &str) -> Result<f64, LinkError> {
    match value.parse::<f64>() {
        Ok(percent) if (0.0..=50.0).contains(&percent) => Ok(percent / 100.0),
        _ => Err(LinkError::Value { name: "loss", value: value.into(), why: "percent from 0 to 50" }),
    }
}

fn blackout(value: &str) -> Result<Blackout, LinkError> {
    let wrong = || LinkError::Value { name: "blackout", value: value.into(), why: "MS@BEGIN_MS" };
    let (length, begin) = value.split_once('@').ok_or_else(wrong)?;
    Ok(Blackout { length_s: milliseconds("blackout", length)?, begin_s: milliseconds("blackout", begin)? })
}

fn fading(value: &str) -> Result<Fading, LinkError> {
    let wrong = || LinkError::Value { name: "fading", value: value.into(), why: "SPREAD@MS with SPREAD from 0 to 3" };
    let (spread, forgets) = value.split_once('@').ok_or_else(wrong)?;
    let spread = spread.parse().ok().filter(|spread| (0.0..=3.0).contains(spread)).ok_or_else(wrong)?;
    let forgets_s = milliseconds("fading", forgets)?;
    if forgets_s > 0.0 { Ok(Fading { spread, forgets_s }) } else { Err(wrong()) }
}

impl fmt::Display for Link {
    /// As it is read; 1e-3 ms and finer is rounded away.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ms = |time_s: f64| (time_s * 1e6).round() / 1e3;
        write!(f, "rtt={},jitter={}", ms(self.rtt_s), ms(self.jitter_s))?;
        if let Some(mbit) = self.mbit {
            write!(f, ",mbit={mbit}")?;
        }
        if let Some(stall) = self.stall {
            write!(f, ",stall={}@{}", ms(stall.length_s), ms(stall.period_s))?;
        }
        if self.loss > 0.0 {
            write!(f, ",loss={}", (self.loss * 1e6).round() / 1e4)?;
        }
        if let Some(queue_s) = self.queue_s {
            write!(f, ",queue={}", ms(queue_s))?;
        }
        if let Some(blackout) = self.blackout {
            write!(f, ",blackout={}@{}", ms(blackout.length_s), ms(blackout.begin_s))?;
        }
        if let Some(fading) = self.fading {
            write!(f, ",fading={}@{}", fading.spread, ms(fading.forgets_s))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_what_people_type() {
        let link: Link = "rtt=40,jitter=20,mbit=20".parse().unwrap();
        assert_eq!(link, Link { rtt_s: 0.04, jitter_s: 0.02, mbit: Some(20.0), ..Link::default() });
        let link: Link = " stall=300@5000 , rtt=500".parse().unwrap();
        assert_eq!(link.stall, Some(Stall { length_s: 0.3, period_s: 5.0 }));
        assert_eq!("".parse::<Link>().unwrap(), Link::default());
    }

    #[test]
    fn prints_what_it_reads() {
        for text in [
            "rtt=0,jitter=0",
            "rtt=40,jitter=20,mbit=20",
            "rtt=0.5,jitter=0,mbit=0.25,stall=300@5000",
            "rtt=0,jitter=0,loss=1.5,queue=1000,blackout=30000@5000",
            "rtt=0,jitter=0,mbit=6,fading=1.2@5000",
        ] {
            assert_eq!(text.parse::<Link>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn names_what_is_wrong() {
        assert_eq!("rtt".parse::<Link>(), Err(LinkError::Form("rtt".into())));
        assert_eq!("lost=1".parse::<Link>(), Err(LinkError::Name("lost".into())));
        assert_eq!("rtt=1,rtt=2".parse::<Link>(), Err(LinkError::Twice("rtt".into())));
        assert_eq!("fading=1@1000".parse::<Link>(), Err(LinkError::Needs("fading", "mbit")));
        for bad in [
            "rtt=-1",
            "rtt=nan",
            "rtt=inf",
            "rtt=1e99",
            "jitter=x",
            "mbit=0",
            "mbit=nan",
            "stall=5",
            "stall=5@5",
            "loss=51",
            "queue=-1",
            "blackout=5",
            "fading=1",
            "fading=4@1000",
            "fading=nan@1000",
            "fading=1@0",
        ] {
            assert!(matches!(bad.parse::<Link>(), Err(LinkError::Value { .. })), "{bad}");
        }
    }
}
