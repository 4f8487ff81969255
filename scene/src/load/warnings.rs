//! What was dropped or mended, for the log.

/// More of them say nothing new; the rest is counted.
const MAX_WARNINGS: usize = 200;

/// Collects messages; keeps the first [`MAX_WARNINGS`] and counts the rest, so that a broken file cannot fill memory.
#[derive(Debug, Default)]
pub(super) struct Warnings {
    messages: Vec<String>,
    left_out: usize,
}

impl Warnings {
    /// Adds one, unless it was said before.
    pub fn add(&mut self, message: impl Into<String>) {
        let message = message.into();
        if self.messages.contains(&message) {
            return;
        }
        if self.messages.len() < MAX_WARNINGS {
            self.messages.push(message);
        } else {
            self.left_out += 1;
        }
    }

    /// Adds those of a task that ran beside.
    pub fn extend(&mut self, other: Warnings) {
        for message in other.messages {
            self.add(message);
        }
        self.left_out += other.left_out;
    }

    /// All of them, in order.
    pub fn into_messages(mut self) -> Vec<String> {
        if self.left_out > 0 {
            self.messages.push(format!("{} more warnings are left out", self.left_out));
        }
        self.messages
    }

    /// One line for an error that they explain.
    pub fn summary(&self) -> String {
        const SHOWN: usize = 5;
        let mut line = self.messages.iter().take(SHOWN).cloned().collect::<Vec<_>>().join("; ");
        if self.messages.len() > SHOWN {
            line.push_str("; …");
        }
        line
    }
}
