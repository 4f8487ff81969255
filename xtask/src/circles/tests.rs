//! Small crates.

use super::*;

/// The circles of a crate in these files, one in words.
fn circles_of(files: &[(&str, &str)]) -> Vec<String> {
    let sources: Sources = files.iter().map(|(file, source)| (format!("a/src/{file}"), (*source).to_owned())).collect();
    circles(&Modules::of(&sources, "a/src/lib.rs").uses())
}

const NONE: [&str; 0] = [];

#[test]
fn a_circle_is_refused_with_the_names_that_tie_it() {
    let found = circles_of(&[
        ("lib.rs", "mod frame; mod light; mod lit;"),
        ("frame.rs", "use crate::light::{LightPass, Shares}; pub struct Shown;"),
        ("light/mod.rs", "mod sky; pub struct LightPass; pub struct Shares;"),
        ("light/sky.rs", "use crate::lit; fn sky() { lit::lit() }"),
        ("lit.rs", "use super::frame::Shown as Seen; pub fn lit() { crate::light::sky::sky() }"),
    ]);
    assert_eq!(
        found,
        [
            "  2 files:\n    a/src/light/sky.rs uses of a/src/lit.rs: lit\n    a/src/lit.rs uses of a/src/light/sky.rs: sky"
        ]
    );
    let longer = circles_of(&[
        ("lib.rs", "mod a; mod b; mod c;"),
        ("a.rs", "pub struct A; fn f() -> crate::b::B {}"),
        ("b.rs", "pub struct B; use super::c::*;"),
        ("c.rs", "pub struct C(self::inner::D); mod inner { use super::super::a::A; pub struct D; }"),
    ]);
    let lines = ["  3 files:", "    a/src/a.rs uses of a/src/b.rs: B", "    a/src/b.rs uses of a/src/c.rs: *"];
    assert_eq!(longer, [[&lines[..], &["    a/src/c.rs uses of a/src/a.rs: A"]].concat().join("\n")]);
}

#[test]
fn parent_and_child_are_a_circle_where_each_uses_the_other() {
    let with = |parent: &str, child: &str| circles_of(&[("lib.rs", parent), ("child.rs", child)]).len();
    let child = "use super::Below; pub struct Pass;";
    assert_eq!(with("mod child; use child::Pass; struct Below;", child), 1);
    assert_eq!(with("mod child; fn f() { child::Pass } struct Below;", child), 1);
    assert_eq!(with("mod child; pub use child::Pass; struct Below(Pass);", child), 1);
    assert_eq!(with("mod child; struct Below;", child), 0, "declaring is no use");
    assert_eq!(with("mod child; pub use child::Pass; struct Below;", child), 0, "nor is passing on");
    assert_eq!(
        with("mod child; use child::Pass; struct Below;", "#[cfg(test)] mod tests { use super::super::Below; }"),
        0
    );
    assert_eq!(with("mod child; use child::Pass;", "use child::Other; // crate::Below\n pub struct Pass;"), 0);
}

#[test]
fn what_a_parent_passes_on_is_its_definers() {
    let with = |user: &str| {
        circles_of(&[
            ("lib.rs", "mod a; mod b;"),
            (
                "a/mod.rs",
                "mod plain; mod pass; pub use plain::{Plain as Value, Other}; pub use pass::*; fn own() { crate::b::B }",
            ),
            ("a/plain.rs", "pub struct Plain; pub struct Other;"),
            ("a/pass.rs", "pub struct Pass; fn f(b: crate::b::B) {}"),
            ("b.rs", user),
        ])
    };
    assert_eq!(with("use crate::a::{Value, Other}; pub struct B;"), NONE);
    assert_eq!(with("use crate::a; pub struct B(a::Value);"), NONE, "a module alone is nothing");
    assert!(with("use crate::a::Pass; pub struct B;")[0].contains("b.rs uses of a/src/a/pass.rs: Pass"));
    assert!(with("use crate::a; pub struct B; fn f() { a::own() }")[0].contains("b.rs uses of a/src/a/mod.rs: own"));
}

#[test]
fn aliases_that_go_round_end() {
    let round = [
        ("lib.rs", "mod a; mod b;"),
        ("a.rs", "pub use crate::b::X;"),
        ("b.rs", "pub use crate::a::X; pub use super::b::*;"),
    ];
    assert_eq!(circles_of(&round), NONE);
}

#[test]
fn crates_and_their_roots_are_found() {
    assert_eq!(members("[workspace]\nmembers = [\n  \"a\", \"b/c\",\n]\nx = [\"d\"]"), ["a", "b/c"]);
    let files = ["a/src/lib.rs", "a/src/main.rs", "a/src/bin/x.rs", "a/src/bin/y/main.rs"];
    assert!(files.iter().all(|file| is_root("a", file)));
    assert!(
        !["a/src/x.rs", "a/src/x/lib.rs", "a/src/x/main.rs", "a/src/bin/y/z.rs"].iter().any(|file| is_root("a", file))
    );
}
