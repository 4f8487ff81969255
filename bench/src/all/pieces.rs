//! The runs of `report all`, under the names that docs/papers.md gives them, and the pieces they fall into.

use std::collections::HashSet;
use std::path::Path;

use anyhow::Context;

use crate::topic::scene_label;

/// A command, once for each last word.
struct NamedRun {
    /// The name in docs/papers.md, with hyphens for spaces.
    name: &'static str,
    /// What is typed after `cargo xtask report`.
    command: &'static str,
    /// The last word of each piece; none: the command as it stands is the only piece.
    each: &'static [&'static str],
}

const fn run(name: &'static str, command: &'static str, each: &'static [&'static str]) -> NamedRun {
    NamedRun { name, command, each }
}

/// Everything, topic by topic. docs/papers.md lists the same commands, and a test compares them.
#[rustfmt::skip]
const RUNS: &[NamedRun] = &[
    run("sampling", "sampling --frames 48 --no-convergence --scene", &["birdnest", "grass", "urban", "tree", "mural"]),
    run("convergence", "sampling --scene", &["birdnest", "grass", "urban", "tree", "mural"]),

    run("reconstruction", "reconstruction --eyes 64 --only-bars --scene", &["birdnest", "urban", "pillars"]),
    run("ways-of-drawing", "reconstruction --quick --eyes 4 --scene", &["tree", "urban"]),

    run("images", "shadows --method warp --no-growth --image-size", &["512", "1024", "1536"]),
    run("lamps", "shadows --method warp --no-growth --image-size 1024 --lamp", &["0.25", "0.5", "2", "4"]),
    run("places", "shadows --method warp --no-growth --image-size 1024 --set placed-1 --set placed-2 --set placed-4 --set placed-8 --scene",
        &["tree", "grass"]),
    run("speed", "shadows --image-size 512 --set covered --scene grass --scene urban --no-growth", &[]),
    run("growth", "shadows --scene grass --image-size 1024 --method warp", &[]),
    run("bias", "shadows --image-size 512 --set covered --scene grass --scene urban --no-growth --method warp \
                 --method \"warp, no bias\" --method \"warp, eight times the bias\"", &[]),

    run("lights", "light-images --scene", &["urban", "cars", "barrels"]),

    run("one-ray", "impostors --poses 60 --size 256x256 --only-errors --one-ray --scene", &["mirror-teapots", "glass-teapots"]),
    run("one-ray", "impostors --poses 12 --size 256x256 --only-errors --one-ray --scene",
        &["mirror-teapots+$VANTAGE_ASSETS/scenes/obj/stanford-bunny/stanford-bunny.obj"]),
    run("rough", "impostors --poses 6 --size 192x108 --only-errors --scene rough-teapots", &[]),
    run("nine-rays", "impostors --poses 60 --size 256x256 --only-errors --scene", &["mirror-teapots", "glass-teapots"]),
    run("maze", "impostors --poses 12 --size 256x256 --only-errors --scene mirror-maze-moving", &[]),
    run("choice", "impostors --only-errors --poses 6 --size 320x180 --scene",
        &["mirror-maze-moving", "mirror-teapots", "glass-teapots", "mirror-pair", "chrome-car", "lake"]),
    run("reflections", "impostors --only-errors --few-methods --poses 60 --size 640x360 --scene",
        &["lake", "glass-teapots", "mirror-teapots", "mirror-pair", "chrome-car", "mirror-maze-moving"]),
    run("tables", "impostors --poses 2 --scene", &["mirror-teapots", "glass-teapots"]),
    run("tables", "impostors --poses 1 --scene", &["mirror-maze-moving"]),
    run("ways-to-walk", "impostors --walks --poses 1 --scene", &["mirror-teapots", "mirror-maze-moving"]),
    run("occlusion", "impostors --only-errors --scene", &["barrels"]),
    run("occlusion", "impostors --only-errors --poses 12 --size 256x256 --scene", &["$VANTAGE_ASSETS/scenes/ply/dragon-23k.ply"]),

    run("occlusion-in-a-session", "occlusion --scene", &["barrels", "urban"]),

    run("relief-walk", "sent-once --quick --relief --size 256x256 --scene barrels", &[]),
    run("walk", "sent-once --size 256x256 --scene", &["urban", "pillars", "tree"]),
    run("settings", "sent-once --settings --size 256x256 --scene", &["urban", "pillars", "tree"]),

    run("stability", "stability", &[]),

    run("left-out", "left-out", &[]),

    run("serving", "serving", &[]),

    run("relay", "relay", &[]),

    run("network", "network", &[]),

    run("others", "others", &[]),

    run("soak", "soak --minutes 30", &[]),

    run("frame-rate", "frame-rate", &[]),

    run("timing", "timing --quick", &[]),
    run("all-stages", "timing", &[]),

    run("codec", "codec", &[]),
    run("materials", "materials", &[]),
    run("materials", "materials --scene", &[
        "$VANTAGE_ASSETS/scenes/gltf/FlightHelmet/FlightHelmet.gltf",
        "$VANTAGE_ASSETS/scenes/gltf/ToyCar/ToyCar.gltf",
        "$VANTAGE_ASSETS/scenes/gltf/ClearCoatTest.glb",
        "$VANTAGE_ASSETS/scenes/gltf/chess-board-draco.glb",
    ]),

    run("layers", "layers", &[]),

    run("peers", "novel-views --protocol quasar-2025 --no-sweeps --no-video --anticipation off --scene",
        &["pillars", "interior", "city"]),
    run("curves", "novel-views --scene", &["pillars", "urban", "urban-moving"]),
    run("motions", "novel-views --motion all --no-video --scene", &["pillars", "birdnest", "grass", "urban", "tree"]),
];

/// What says how much is measured, each with a value; `--quick` has smaller ones of its own.
const SIZES: &[&str] = &["--frames", "--poses", "--eyes", "--size", "--image-size", "--minutes"];

/// The folder of files that are not in the repository, as a shell writes it.
const ASSETS: &str = "$VANTAGE_ASSETS";

/// One command with a folder of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// The name of its folder.
    pub name: String,
    /// What is typed after `cargo xtask report`.
    pub command: String,
}

/// Every piece. `quick`: at the quick setting of each topic; pieces that become equal by it are one.
pub fn pieces(quick: bool) -> Vec<Piece> {
    let mut pieces: Vec<Piece> = RUNS.iter().flat_map(NamedRun::pieces).collect();
    if quick {
        for piece in &mut pieces {
            piece.command = quickly(&piece.command);
        }
        let mut seen = HashSet::new();
        pieces.retain(|piece| seen.insert(piece.command.clone()));
    }
    pieces
}

impl NamedRun {
    fn pieces(&self) -> Vec<Piece> {
        let piece = |word: &&str| {
            let label = if word.contains('/') { scene_label(word) } else { (*word).to_owned() };
            Piece { name: format!("{}-{label}", self.name), command: format!("{} {word}", self.command) }
        };
        match self.each {
            [] => vec![Piece { name: self.name.to_owned(), command: self.command.to_owned() }],
            each => each.iter().map(piece).collect(),
        }
    }
}

/// The same command at the quick setting.
fn quickly(command: &str) -> String {
    let mut words = command.split(' ').filter(|word| *word != "--quick");
    let mut kept = Vec::new();
    while let Some(word) = words.next() {
        if SIZES.contains(&word) {
            words.next();
        } else {
            kept.push(word);
        }
    }
    kept.join(" ") + " --quick"
}

impl Piece {
    /// The topic's name.
    pub fn topic(&self) -> &str {
        self.command.split(' ').next().unwrap_or_default()
    }

    /// Whether it reads files that are not in the repository.
    pub fn needs_assets(&self) -> bool {
        self.command.contains(ASSETS) || self.command.contains("--protocol")
    }

    /// The words of the command, as a shell that knows the folder of assets would pass them on.
    pub fn arguments(&self, assets: &Path) -> anyhow::Result<Vec<String>> {
        let words = shlex::split(&self.command).with_context(|| format!("an open quote: {}", self.command))?;
        let assets = assets.to_string_lossy();
        Ok(words.iter().map(|word| word.replace(ASSETS, &assets)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_pieces_apart() {
        for quick in [false, true] {
            let names: Vec<String> = pieces(quick).into_iter().map(|piece| piece.name).collect();
            assert_eq!(names.iter().collect::<HashSet<_>>().len(), names.len(), "{names:?}");
        }
    }

    #[test]
    fn quick_pieces_keep_what_is_asked_and_lose_its_size() {
        assert_eq!(
            quickly("impostors --poses 60 --size 256x256 --only-errors --scene lake"),
            "impostors --only-errors --scene lake --quick"
        );
        assert_eq!(quickly("timing --quick"), "timing --quick");
        let images = pieces(true).into_iter().filter(|piece| piece.name.starts_with("images")).count();
        assert_eq!(images, 1, "without their sizes they are equal");
    }

    #[test]
    fn quotes_and_the_folder_of_assets_are_read_as_by_a_shell() {
        let piece = |command: &str| Piece { name: "p".to_owned(), command: command.to_owned() };
        let read = |command: &str| piece(command).arguments(Path::new("/a b")).unwrap();
        assert_eq!(read("shadows --method \"warp, no bias\""), ["shadows", "--method", "warp, no bias"]);
        assert_eq!(read("impostors --scene m+$VANTAGE_ASSETS/x.obj"), ["impostors", "--scene", "m+/a b/x.obj"]);
    }
}
