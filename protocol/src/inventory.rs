//! [`Inventory`]: what a client is made, part by part, and what is left out, each with its reason. For people: nothing follows from it.

use serde::{Deserialize, Serialize};

/// See the module.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Inventory {
    /// In the order in which a person reads them.
    pub parts: Vec<Part>,
}

/// Something that may be made for a client.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    /// What.
    pub name: String,
    /// How much of it, in words; `None` of what is left out.
    pub made: Option<String>,
    /// Why it is made so, or left out.
    pub why: String,
}

impl Inventory {
    /// Whether another one makes the same parts for the same reasons, be it more or less of them.
    pub fn is_alike(&self, other: &Inventory) -> bool {
        let alike = |a: &Part, b: &Part| a.name == b.name && a.made.is_some() == b.made.is_some() && a.why == b.why;
        self.parts.len() == other.parts.len() && self.parts.iter().zip(&other.parts).all(|(a, b)| alike(a, b))
    }

    /// A part that is made.
    pub fn makes(&mut self, name: &str, made: impl Into<String>, why: impl Into<String>) {
        self.parts.push(Part { name: name.to_owned(), made: Some(made.into()), why: why.into() });
    }

    /// A part that is left out.
    pub fn leaves_out(&mut self, name: &str, why: impl Into<String>) {
        self.parts.push(Part { name: name.to_owned(), made: None, why: why.into() });
    }
}

impl std::fmt::Display for Inventory {
    /// A line a part.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (index, Part { name, made, why }) in self.parts.iter().enumerate() {
            let end = if index + 1 < self.parts.len() { "\n" } else { "" };
            match made {
                Some(made) => write!(f, "{name}: {made} ({why}){end}")?,
                None => write!(f, "{name}: left out: {why}{end}")?,
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_of_the_same_is_alike() {
        let of = |made: &str, why: &str| {
            let mut inventory = Inventory::default();
            inventory.makes("bodies", made, "less than samples");
            inventory.leaves_out("layers", why);
            inventory
        };
        let one = of("3 shapes", "nothing is blended");
        assert!(one.is_alike(&of("4 shapes", "nothing is blended")) && !one.is_alike(&of("3 shapes", "no time")));
        assert!(!one.is_alike(&Inventory::default()));
        assert_eq!(one.to_string(), "bodies: 3 shapes (less than samples)\nlayers: left out: nothing is blended");
    }
}
