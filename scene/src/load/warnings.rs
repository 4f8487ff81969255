//! What was dropped or mended, for the log.

use super::LoadError;

/// More of them say nothing new; the rest is counted.
const MAX_WARNINGS: usize = 200;

/// Collects messages; keeps the first [`MAX_WARNINGS`] and counts the rest, so that a broken file cannot fill memory.
#[derive(Debug, Default)]
pub(super) struct Warnings {
    messages: Vec<String>,
    tallies: Vec<Tally>,
    left_out: usize,
}

/// The same thing, many times in many places.
#[derive(Debug)]
struct Tally {
    what: &'static str,
    count: usize,
    places: usize,
    first: String,
}

impl Tally {
    fn message(&self) -> String {
        match self.places {
            1 => format!("{}: {} {}", self.first, self.count, self.what),
            places => format!("{}, and {} more places: {} {}", self.first, places - 1, self.count, self.what),
        }
    }
}

impl Warnings {
    /// Adds one, unless it was said before.
    pub fn add(&mut self, message: impl Into<String>) {
        let message = message.into();
        if self.messages.len() >= MAX_WARNINGS {
            self.left_out += 1;
        } else if !self.messages.contains(&message) {
            self.messages.push(message);
        }
    }

    /// Adds `count` things at a place; those of all places are told together. No message where `count` is 0.
    pub fn tally(&mut self, at: &str, count: usize, what: &'static str) {
        if count > 0 {
            self.merge(Tally { what, count, places: 1, first: at.to_owned() });
        }
    }

    fn merge(&mut self, tally: Tally) {
        match self.tallies.iter_mut().find(|known| known.what == tally.what) {
            Some(known) => {
                known.count += tally.count;
                known.places += tally.places;
            }
            None => self.tallies.push(tally),
        }
    }

    /// A thing of which the file has a faulty one is `None`, with a warning that names it. Other errors stay: a file past a
    /// limit is refused, as what is left of it may be no less.
    pub fn leave_out<T>(&mut self, at: &str, result: Result<T, LoadError>) -> Result<Option<T>, LoadError> {
        match result {
            Err(error @ LoadError::Malformed { .. }) => {
                self.add(format!("{error}; {at} is left out"));
                Ok(None)
            }
            result => result.map(Some),
        }
    }

    /// Adds those of a task that ran beside.
    pub fn extend(&mut self, other: Warnings) {
        for message in other.messages {
            self.add(message);
        }
        for tally in other.tallies {
            self.merge(tally);
        }
        self.left_out += other.left_out;
    }

    /// All of them, in order.
    pub fn into_messages(mut self) -> Vec<String> {
        self.messages.extend(self.tallies.iter().map(Tally::message));
        if self.left_out > 0 {
            self.messages.push(format!("{} more warnings are left out", self.left_out));
        }
        self.messages
    }

    /// One line for an error that they explain: `reason`, then the first of them.
    pub fn explain(&self, reason: &str) -> String {
        const SHOWN: usize = 5;
        let all = self.messages.iter().cloned().chain(self.tallies.iter().map(Tally::message));
        let mut parts = vec![reason.to_owned()];
        parts.extend(all.take(SHOWN));
        if self.messages.len() + self.tallies.len() > SHOWN {
            parts.push("…".into());
        }
        parts.join("; ")
    }
}
