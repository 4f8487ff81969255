//! The modules of a crate, and which file each of their names is from.

use std::collections::BTreeMap;

use super::scan::{Path, Scanned, scan};
use super::tokens::tokens;

/// By path; whoever reads them has read them all.
pub type Sources = BTreeMap<String, String>;

/// From a file that uses to one that defines, the names that it uses; `*` is all of them.
pub type Uses<'a> = BTreeMap<(&'a str, &'a str), Vec<&'a str>>;

/// Imports that stand for imports are followed this far.
const MOST_ALIASES: usize = 16;

/// A crate's modules, its root first.
#[derive(Debug)]
pub struct Modules<'a> {
    all: Vec<Module<'a>>,
}

#[derive(Debug)]
struct Module<'a> {
    file: &'a str,
    parent: usize,
    children: BTreeMap<&'a str, usize>,
    says: Scanned<'a>,
}

/// What a path names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Named<'a> {
    Module(usize),
    /// An item, and the module that defines it.
    Item(usize, &'a str),
    Elsewhere,
}

impl<'a> Modules<'a> {
    /// Of a crate with its root in this file.
    pub fn of(sources: &'a Sources, root: &'a str) -> Modules<'a> {
        let mut modules = Modules { all: Vec::new() };
        let folder = root.rsplit_once('/').map_or("", |(folder, _)| folder).to_owned();
        if let Some(source) = sources.get(root) {
            modules.add(sources, (root, &folder), 0, scan(&tokens(source)));
        }
        modules
    }

    /// Adds a module, and those within; their files lie in `folder`.
    fn add(
        &mut self,
        sources: &'a Sources,
        (file, folder): (&'a str, &str),
        parent: usize,
        says: Scanned<'a>,
    ) -> usize {
        let number = self.all.len();
        let (declared, mut says) = (says.declared.clone(), says);
        let inline = std::mem::take(&mut says.inline);
        self.all.push(Module { file, parent, children: BTreeMap::new(), says });
        for name in declared {
            let files = [format!("{folder}/{name}.rs"), format!("{folder}/{name}/mod.rs")];
            let Some((file, source)) = files.iter().find_map(|file| sources.get_key_value(file)) else { continue };
            let child = self.add(sources, (file, &format!("{folder}/{name}")), number, scan(&tokens(source)));
            self.all[number].children.insert(name, child);
        }
        for (name, says) in inline {
            let child = self.add(sources, (file, &format!("{folder}/{name}")), number, says);
            self.all[number].children.insert(name, child);
        }
        number
    }

    /// Which files use which. Declaring a module is no use, nor is passing a name on by `pub use` without using it.
    pub fn uses(&self) -> Uses<'a> {
        let mut uses = Uses::new();
        for (number, module) in self.all.iter().enumerate() {
            let says = &module.says;
            let is_used = |name: &str| says.words.contains(name);
            let imports = says.imports.iter().filter(|import| !import.is_public || is_used(import.name));
            let imported = imports.filter_map(|import| match (self.find(number, &import.path, 0), import.name) {
                (Named::Item(of, name), _) => Some((of, name)),
                (Named::Module(of), "*") => Some((of, "*")),
                // What is used of it is seen where it is used.
                (Named::Module(_) | Named::Elsewhere, _) => None,
            });
            let named = says.paths.iter().filter_map(|path| match self.find(number, path, 0) {
                Named::Item(of, name) => Some((of, name)),
                Named::Module(_) | Named::Elsewhere => None,
            });
            for (of, name) in imported.chain(named) {
                let of = self.all[of].file;
                if of != module.file {
                    uses.entry((module.file, of)).or_default().push(name);
                }
            }
        }
        for names in uses.values_mut() {
            names.sort_unstable();
            names.dedup();
        }
        uses
    }

    /// What a path in a module names.
    fn find(&self, from: usize, path: &Path<'a>, aliases: usize) -> Named<'a> {
        let Some((&first, rest)) = path.split_first() else { return Named::Elsewhere };
        let begin = match first {
            "crate" => Named::Module(0),
            "self" => Named::Module(from),
            "super" => Named::Module(self.all[from].parent),
            // A crate's name, an item's of this file, or one that every file knows.
            _ => self.member(from, first, aliases).unwrap_or(Named::Elsewhere),
        };
        rest.iter().fold(begin, |at, &name| match (at, name) {
            (Named::Module(at), "super") => Named::Module(self.all[at].parent),
            // What is not found a macro has made.
            (Named::Module(at), _) => self.member(at, name, aliases).unwrap_or(Named::Item(at, name)),
            (found, _) => found,
        })
    }

    /// A module's own name, or one that it passes on.
    fn member(&self, of: usize, name: &'a str, aliases: usize) -> Option<Named<'a>> {
        let module = &self.all[of];
        if let Some(&child) = module.children.get(name) {
            return Some(Named::Module(child));
        }
        if module.says.defined.contains(name) {
            return Some(Named::Item(of, name));
        }
        if aliases == MOST_ALIASES {
            return None;
        }
        let imports = &module.says.imports;
        if let Some(import) = imports.iter().find(|import| import.name == name && import.path != [name]) {
            return Some(self.find(of, &import.path, aliases + 1));
        }
        let all_of = imports.iter().filter(|import| import.name == "*");
        all_of.into_iter().find_map(|import| match self.find(of, &import.path, aliases + 1) {
            Named::Module(passed_on) => self.member(passed_on, name, aliases + 1),
            _ => None,
        })
    }
}
