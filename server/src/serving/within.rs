//! What is chosen within a scene's file: a scene of it, a variant of its materials.

use std::path::PathBuf;

use scene::load::Offer;

/// Between a scene's name and what is chosen within its file: names of a folder's files have no two slashes in a row.
const MARK: &str = "//";
/// Names that a refusal lists, and their characters.
const MOST_TOLD: usize = 12;
const LONGEST_TOLD: usize = 60;

/// By names, or by numbers where there are none. `None`: as the file has it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Within {
    /// A scene of the file.
    pub scene: Option<String>,
    /// A variant of its materials.
    pub variant: Option<String>,
}

/// A scene's file, and what is shown of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneFile {
    /// Where it is.
    pub path: PathBuf,
    /// What is shown.
    pub within: Within,
}

impl Within {
    /// Whether the file is shown as it is.
    pub fn is_nothing(&self) -> bool {
        *self == Within::default()
    }

    /// What the scene is called that this is chosen of, where the file's is called `name`. No two choices have one name.
    pub fn name(&self, name: &str) -> String {
        let of = |what: &str, chosen: &Option<String>| match chosen {
            Some(chosen) => format!("{MARK}{what}={chosen:?}"),
            None => String::new(),
        };
        format!("{name}{}{}", of("scene", &self.scene), of("variant", &self.variant))
    }

    /// The same, where it says nothing, as another has it.
    pub fn or(self, other: &Within) -> Within {
        Within {
            scene: self.scene.or_else(|| other.scene.clone()),
            variant: self.variant.or_else(|| other.variant.clone()),
        }
    }

    /// By the names that the file has, or why it has none such.
    pub fn resolved(&self, offer: &Offer) -> Result<Within, String> {
        let of = |what: &str, chosen: &Option<String>, there: &[String]| match chosen {
            None => Ok(None),
            Some(chosen) => find(chosen, there).map(Some).ok_or_else(|| refusal(what, chosen, there)),
        };
        Ok(Within {
            scene: of("scene", &self.scene, &offer.scenes)?,
            variant: of("variant", &self.variant, &offer.variants)?,
        })
    }
}

/// By its name, or by its number.
fn find(chosen: &str, there: &[String]) -> Option<String> {
    let by_number = || chosen.parse::<usize>().ok().and_then(|number| there.get(number));
    there.iter().find(|name| *name == chosen).or_else(by_number).cloned()
}

/// Names are of files that anybody may have made.
fn refusal(what: &str, chosen: &str, there: &[String]) -> String {
    let short = |name: &str| format!("{:?}", name.chars().take(LONGEST_TOLD).collect::<String>());
    let mut listed: Vec<String> = there.iter().take(MOST_TOLD).map(|name| short(name)).collect();
    if there.len() > MOST_TOLD {
        listed.push(format!("{} more", there.len() - MOST_TOLD));
    }
    let listed = if listed.is_empty() { "none".to_owned() } else { listed.join(", ") };
    format!("there is no {what} {} in this file; there are: {listed}", short(chosen))
}

/// The name of the scene as its file has it, of the name of any choice within that.
pub fn file_of(name: &str) -> &str {
    name.split_once(MARK).map_or(name, |(file, _)| file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_choice_has_a_name_of_its_own_that_says_whose_it_is() {
        let chosen = |scene: Option<&str>, variant: Option<&str>| Within {
            scene: scene.map(str::to_owned),
            variant: variant.map(str::to_owned),
        };
        let names = [
            chosen(None, None),
            chosen(None, Some("a")),
            chosen(Some("a"), None),
            chosen(Some("a"), Some("b")),
            chosen(Some("a//variant=\"b\""), None),
            chosen(None, Some("")),
            chosen(None, Some("a\n")),
        ]
        .map(|within| within.name("cars/toy"));
        assert_eq!(names[0], "cars/toy");
        assert!(names.iter().all(|name| file_of(name) == "cars/toy" && !name.contains('\n')), "{names:?}");
        assert!(names.iter().enumerate().all(|(index, name)| !names[..index].contains(name)), "{names:?}");
    }

    #[test]
    fn what_is_not_there_is_refused_by_its_name() {
        let offer = Offer { variants: vec!["red".to_owned(), "1".to_owned()], ..Offer::default() };
        let within = |variant: &str| Within { scene: None, variant: Some(variant.to_owned()) };
        for chosen in ["red", "0", "00", "+0"] {
            assert_eq!(within(chosen).resolved(&offer), Ok(within("red")), "one choice has one name");
        }
        assert_eq!(within("1").resolved(&offer), Ok(within("1")), "a name before a number");
        let why = within("blue").resolved(&offer).unwrap_err();
        assert!(why.contains("\"blue\" in this file; there are: \"red\", \"1\""), "{why}");
        assert!(Within { scene: Some("0".to_owned()), variant: None }.resolved(&offer).unwrap_err().ends_with("none"));
        let many = Offer { variants: vec!["x".repeat(10_000); 1000], ..Offer::default() };
        assert!(within(&"y".repeat(10_000)).resolved(&many).unwrap_err().len() < 2000);
    }
}
