//! What one file says: its modules, what it defines, what it imports, and the paths it names.

use std::collections::{BTreeMap, BTreeSet};

/// `a::b::c`; begins with an empty name where it begins with `::`.
pub type Path<'a> = Vec<&'a str>;

/// What a module says, without its tests.
#[derive(Debug, Default)]
pub struct Scanned<'a> {
    /// `mod name;`: modules in files of their own.
    pub declared: BTreeSet<&'a str>,
    /// `mod name { … }`.
    pub inline: BTreeMap<&'a str, Scanned<'a>>,
    /// Names of items.
    pub defined: BTreeSet<&'a str>,
    /// `use`, wherever it stands.
    pub imports: Vec<Import<'a>>,
    /// Paths of several names outside of `use`.
    pub paths: BTreeSet<Path<'a>>,
    /// First names of all paths outside of `use`.
    pub words: BTreeSet<&'a str>,
}

/// One name of a `use`.
#[derive(Debug, PartialEq, Eq)]
pub struct Import<'a> {
    pub path: Path<'a>,
    /// What it is called here; `*` for all that is in the path.
    pub name: &'a str,
    /// Whether others may use it from here.
    pub is_public: bool,
}

/// Words that begin an item, which ends with `;` or with a block.
const ITEMS: [&str; 15] = [
    "fn",
    "mod",
    "impl",
    "use",
    "const",
    "static",
    "struct",
    "enum",
    "trait",
    "type",
    "union",
    "unsafe",
    "extern",
    "async",
    "macro_rules",
];
/// Of them, those that a name follows.
const NAMED: [&str; 8] = ["fn", "const", "static", "struct", "enum", "trait", "type", "union"];

/// Of the tokens of a file.
pub fn scan<'a>(tokens: &[&'a str]) -> Scanned<'a> {
    let mut scanned = Scanned::default();
    let mut rest = tokens;
    scan_block(&mut rest, &mut scanned);
    scanned
}

/// Up to the end of a module.
fn scan_block<'a>(rest: &mut &[&'a str], into: &mut Scanned<'a>) {
    let (mut depth, mut is_public) = (0_usize, false);
    let mut last = "";
    while let Some((&token, after)) = rest.split_first() {
        let before = std::mem::replace(&mut last, token);
        match (token, after) {
            ("#", ["[", ..]) if is_for_tests(rest) => {
                skip_item(rest);
                continue;
            }
            ("}", _) if depth == 0 => {
                *rest = after;
                return;
            }
            ("{", _) => depth += 1,
            ("}", _) => depth -= 1,
            ("pub", _) => {
                is_public = true;
                *rest = after;
                if after.first() == Some(&"(") {
                    skip_group(rest);
                }
                continue;
            }
            ("use", _) => {
                *rest = after;
                scan_use(rest, &[], is_public, into);
            }
            ("mod", [name, ";", ..]) => {
                into.declared.insert(name);
                *rest = &after[1..];
            }
            ("mod", [name, "{", after @ ..]) => {
                *rest = after;
                let mut inner = Scanned::default();
                scan_block(rest, &mut inner);
                into.inline.insert(name, inner);
                is_public = false;
                continue;
            }
            (token, [name, ..]) if depth == 0 && NAMED.contains(&token) && is_name(name) && name != &"fn" => {
                into.defined.insert(name);
                *rest = after;
            }
            (token, _) if begins_path(token, before) => {
                scan_path(rest, into);
                is_public = false;
                continue;
            }
            _ => {}
        }
        is_public = false;
        *rest = rest.get(1..).unwrap_or_default();
    }
}

fn begins_path(token: &str, before: &str) -> bool {
    match token {
        "::" => !is_name(before),
        _ => is_name(token) && !matches!(before, "." | "::" | "$"),
    }
}

fn is_name(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// One tree of a `use`; leaves what ends it.
fn scan_use<'a>(rest: &mut &[&'a str], above: &[&'a str], is_public: bool, into: &mut Scanned<'a>) {
    let mut path = above.to_vec();
    if let (["::", after @ ..], []) = (*rest, above) {
        path.push("");
        *rest = after;
    }
    loop {
        match *rest {
            ["{", after @ ..] => {
                *rest = after;
                while !matches!(*rest, [] | ["}", ..]) {
                    let left = rest.len();
                    scan_use(rest, &path, is_public, into);
                    if let [",", after @ ..] = *rest {
                        *rest = after;
                    } else if rest.len() == left {
                        // No Rust; go on behind it.
                        *rest = &rest[1..];
                    }
                }
                *rest = rest.get(1..).unwrap_or_default();
                return;
            }
            ["*", after @ ..] => {
                *rest = after;
                into.imports.push(Import { path, name: "*", is_public });
                return;
            }
            ["self", after @ ..] if !above.is_empty() && path.len() == above.len() => *rest = after,
            [name, after @ ..] if is_name(name) => {
                path.push(name);
                *rest = after;
            }
            _ => return,
        }
        match *rest {
            ["::", after @ ..] => *rest = after,
            ["as", name, after @ ..] => {
                *rest = after;
                into.imports.push(Import { path, name, is_public });
                return;
            }
            _ => {
                if let Some(&name) = path.last() {
                    into.imports.push(Import { path, name, is_public });
                }
                return;
            }
        }
    }
}

/// A path, or a name alone.
fn scan_path<'a>(rest: &mut &[&'a str], into: &mut Scanned<'a>) {
    let mut path = Vec::new();
    if let ["::", after @ ..] = *rest {
        path.push("");
        *rest = after;
    }
    while let [name, after @ ..] = *rest {
        if !is_name(name) {
            break;
        }
        path.push(*name);
        *rest = after;
        match after {
            ["::", next, ..] if is_name(next) => *rest = &after[1..],
            _ => break,
        }
    }
    into.words.extend(path.first());
    if path.len() > 1 {
        into.paths.insert(path);
    }
}

/// Whether what follows the attribute is for tests only.
fn is_for_tests(rest: &[&str]) -> bool {
    matches!(rest, [_, "[", "cfg", "(", "test", ")", ..] | [_, "[", "cfg", "(", "all", "(", "test", ..])
}

/// From an opening bracket to behind the one that closes it.
fn skip_group(rest: &mut &[&str]) {
    let mut depth = 0_usize;
    while let Some((&token, after)) = rest.split_first() {
        *rest = after;
        match token {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" | "}" => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth == 0 {
            return;
        }
    }
}

/// An item, a field or a variant, with its attributes.
fn skip_item(rest: &mut &[&str]) {
    while let ["#", "[", ..] = *rest {
        *rest = &rest[1..];
        skip_group(rest);
    }
    if let ["pub", after @ ..] = *rest {
        *rest = after;
        if after.first() == Some(&"(") {
            skip_group(rest);
        }
    }
    let first = rest.first().copied().unwrap_or_default();
    let is_item = ITEMS.contains(&first);
    let ends_with_block = is_item && !["use", "static"].contains(&first) && !matches!(*rest, ["const", _, ":", ..]);
    while let Some((&token, after)) = rest.split_first() {
        match token {
            "}" => return,
            "{" if ends_with_block => return skip_group(rest),
            "(" | "[" | "{" => skip_group(rest),
            ";" => {
                *rest = after;
                return;
            }
            "," if !is_item => {
                *rest = after;
                return;
            }
            _ => *rest = after,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tokens::tokens;
    use super::*;

    fn paths(scanned: &Scanned<'_>) -> Vec<String> {
        scanned.paths.iter().map(|path| path.join("::")).collect()
    }

    #[test]
    fn imports_are_trees() {
        let source = "use a::{self, b::C, d::{E as F, *}}; pub(crate) use super::g; use ::h::I;";
        let scanned = scan(&tokens(source));
        let imports: Vec<_> =
            scanned.imports.iter().map(|import| (import.path.join("::"), import.name, import.is_public)).collect();
        let expected = [
            ("a", "a", false),
            ("a::b::C", "C", false),
            ("a::d::E", "F", false),
            ("a::d", "*", false),
            ("super::g", "g", true),
            ("::h::I", "I", false),
        ];
        assert_eq!(imports, expected.map(|(path, name, is_public)| (path.to_owned(), name, is_public)));
    }

    #[test]
    fn paths_and_names_are_found_in_code() {
        let source =
            "fn f(x: crate::a::B) -> c::D<e::F> { x.g::<H>(); super::i(); ::j::k!(); $crate::l(); M { n: 1 } }";
        let scanned = scan(&tokens(source));
        assert_eq!(paths(&scanned), ["::j::k", "c::D", "crate::a::B", "e::F", "super::i"]);
        assert!(scanned.words.contains("M") && !scanned.words.contains("g"));
    }

    #[test]
    fn items_of_the_module_are_found() {
        let source =
            "const fn a() { fn inner() {} } pub const B: u8 = 0; struct C { d: u8 } impl C { fn e() {} } type F = C;";
        assert_eq!(scan(&tokens(source)).defined.into_iter().collect::<Vec<_>>(), ["B", "C", "F", "a"]);
    }

    #[test]
    fn tests_are_left_out_and_other_conditions_are_not() {
        let source =
            "#[cfg(test)] mod tests; #[cfg(test)] mod more { use a::B; } #[cfg(test)] pub(crate) use c::{D, E};
            #[cfg(test)] #[allow(x)] fn f<T, U>() -> [u8; 2] { g::h() } #[cfg(test)] const I: [j::K; 2] = { l::m() };
            struct S { #[cfg(test)] n: o::P<q::R>, s: t::U }
            #[cfg(not(test))] use v::W; #[cfg(unix)] mod x; mod y { mod z; }";
        let scanned = scan(&tokens(source));
        assert_eq!(paths(&scanned), ["t::U"]);
        assert_eq!(scanned.imports.len(), 1);
        assert_eq!(scanned.declared.iter().collect::<Vec<_>>(), [&"x"]);
        assert!(scanned.inline["y"].declared.contains("z"));
    }

    #[test]
    fn nonsense_ends() {
        for source in ["use a::{b", "use {,{", "use ::;", "mod", "#[cfg(test)]", "#[", "}", "pub(", "use a::{1 2}"] {
            scan(&tokens(source));
        }
    }
}
