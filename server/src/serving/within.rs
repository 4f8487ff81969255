//! What is chosen within a scene's file: a scene of it, a variant of its materials.

use std::path::PathBuf;

use scene::load::Offer;

/// Between a scene's name and what is chosen within its file: names of a folder's files have no two slashes in a row.
const MARK: &str = "//";

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

    /// Why a file has none such, where it is known what it has.
    pub fn check(&self, offer: &Offer) -> Result<(), String> {
        let of = |what: &str, chosen: &Option<String>, there: &[String]| {
            let is_there = |chosen: &String| {
                there.contains(chosen) || chosen.parse().is_ok_and(|number: usize| number < there.len())
            };
            let Some(chosen) = chosen.as_ref().filter(|chosen| !is_there(chosen)) else { return Ok(()) };
            let listed = if there.is_empty() { "none".to_owned() } else { there.join(", ") };
            Err(format!("there is no {what} {chosen:?} in this file; there are: {listed}"))
        };
        of("scene", &self.scene, &offer.scenes)?;
        of("variant", &self.variant, &offer.variants)
    }
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
        assert_eq!(within("red").check(&offer), Ok(()));
        assert_eq!(within("0").check(&offer), Ok(()), "by its number");
        assert!(within("2").check(&offer).is_err());
        assert!(within("blue").check(&offer).unwrap_err().contains("\"blue\" in this file; there are: red, 1"));
        assert!(Within { scene: Some("0".to_owned()), variant: None }.check(&offer).is_err());
    }
}
