//! The subjects of a channel.

use percent_encoding::{NON_ALPHANUMERIC, utf8_percent_encode};

/// See the module.
#[derive(Debug, Clone)]
pub(crate) struct Subjects {
    channel: String,
}

/// What is said of a presenter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// An update.
    Updates,
    /// A whole copy.
    Whole,
    /// Where his eye is.
    Eye,
}

impl Kind {
    const ALL: [Kind; 3] = [Kind::Updates, Kind::Whole, Kind::Eye];

    fn word(self) -> &'static str {
        match self {
            Kind::Updates => "updates",
            Kind::Whole => "whole",
            Kind::Eye => "eye",
        }
    }

    /// By the last word of a subject.
    pub fn of(subject: &str) -> Option<Kind> {
        let word = subject.rsplit('.').next()?;
        Kind::ALL.into_iter().find(|kind| kind.word() == word)
    }
}

/// One word of a subject: no dot, wildcard or space is left of what people write.
fn word(text: &str) -> impl std::fmt::Display + '_ {
    utf8_percent_encode(text, NON_ALPHANUMERIC)
}

impl Subjects {
    /// Of a channel, however it is written.
    pub fn new(channel: &str) -> Subjects {
        Subjects { channel: format!("vantage.{}", word(channel)) }
    }

    /// What relays ask for.
    pub fn asks(&self) -> String {
        format!("{}.asks", self.channel)
    }

    /// What the server says of itself.
    pub fn server(&self) -> String {
        format!("{}.server", self.channel)
    }

    /// What is said of a presenter.
    pub fn of(&self, presenter: &str, kind: Kind) -> String {
        format!("{}.by.{}.{}", self.channel, word(presenter), kind.word())
    }

    /// All that is said of a presenter.
    pub fn all_of(&self, presenter: &str) -> String {
        format!("{}.by.{}.*", self.channel, word(presenter))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_one_word_each_and_none_is_anothers() {
        let subjects = Subjects::new("a channel");
        assert_eq!(subjects.asks(), "vantage.a%20channel.asks");
        let names = ["Ada", "ada", "*", ">", "a.b", "a b", "a\tb", "a\r\nPUB x 0", "%2A", "Żółw", "a%20b"];
        for name in names {
            let subject = subjects.of(name, Kind::Whole);
            assert_eq!(subject.split('.').count(), 5, "{subject}");
            assert!(
                subject.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'%' || byte == b'.'),
                "{subject}"
            );
            assert_eq!(Kind::of(&subject), Some(Kind::Whole));
            assert!(names.iter().filter(|other| subjects.of(other, Kind::Whole) == subject).count() == 1, "{subject}");
        }
        assert_eq!(Kind::of("vantage.x.by.Ada.other"), None);
    }
}
