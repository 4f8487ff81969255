//! `cargo xtask beside`: models as the web client shows them, beside three.js.
//!
//! A script makes the pictures (`tests/browser/beside/main.mjs`), `vantage-report beside` compares them.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;

use crate::run::{Tool, cargo, step, target_dir};
use crate::setup::{self, Need};
use crate::web;

/// What `cargo xtask beside` takes.
#[derive(Args)]
pub struct BesideArgs {
    /// The light: an equirectangular .hdr or .exr file; without it, a neutral studio.
    #[arg(long, value_name = "FILE")]
    environment: Option<PathBuf>,
    /// Where pictures and report go.
    #[arg(long, value_name = "DIR", default_value = "target/report/beside")]
    out: PathBuf,
    /// Side of the pictures in pixels.
    #[arg(long, value_name = "PX", default_value_t = 512, value_parser = clap::value_parser!(u32).range(64..=2048))]
    size: u32,
    /// glTF and GLB files; without any, a list of sample models below VANTAGE_ASSETS, and models that are made for what these lack.
    files: Vec<PathBuf>,
}

/// Where sample models lie below `VANTAGE_ASSETS`.
const MODELS_DIR: &str = "scenes/gltf";
/// Sample models: materials first, then shapes, figures and interiors.
const MODELS: &[&str] = &[
    "FlightHelmet/FlightHelmet.gltf",
    "ToyCar/ToyCar.gltf",
    "MetalRoughSpheresNoTextures.glb",
    "ClearCoatTest.glb",
    "TransmissionTest.glb",
    "UnlitTest.glb",
    "TextureSettingsTest.glb",
    "TextureTransformTest/TextureTransformTest.gltf",
    "TextureCoordinateTest.glb",
    "VertexColorTest.glb",
    "OrientationTest.glb",
    "GlassVaseFlowers.glb",
    "CesiumMan.glb",
    "Fox.glb",
    "KayKit-Knight.glb",
    "MorphStressTest.glb",
    "2CylinderEngine.glb",
    "retroufo.glb",
    "Duck.glb",
    "pirate-meshopt.glb",
    "SimpleInstancing.glb",
    "terrain-bevy.glb",
    "room-occlusion.glb",
    "city-berlin-tile.glb",
];

/// Sets up what is missing, makes the pictures and compares them.
pub fn beside(arguments: &BesideArgs) -> anyhow::Result<()> {
    setup::install(Need::USUAL)?;
    let files = if arguments.files.is_empty() { samples() } else { arguments.files.clone() };
    let files = files.iter().map(|file| existing(file)).collect::<anyhow::Result<Vec<PathBuf>>>()?;
    let web_dir = std::path::absolute(web::build(web::Profile::Fast)?)?;
    step("Building server and report");
    // With the viewer, as both are built during development: what is built together decides the features of what it shares.
    cargo()
        .args(["build"])
        .args(["vantage-bench", "vantage-client", "vantage-server"].map(|name| format!("--package={name}")))
        .args(["--bin", "vantage-server", "--bin", "vantage-report"])
        .check()?;
    let [server, report] =
        ["vantage-server", "vantage-report"].map(|name| std::path::absolute(target_dir().join("debug").join(name)));
    let (server, report) = (server?, report?);
    let pairs = std::path::absolute(arguments.out.join("pairs"))?;
    std::fs::create_dir_all(&pairs).with_context(|| pairs.display().to_string())?;
    let environment = match &arguments.environment {
        Some(file) => existing(file)?,
        None => {
            let studio = pairs.join("studio.hdr");
            Tool::new(&report).args(["studio".as_ref(), studio.as_os_str()]).check()?;
            studio
        }
    };
    let scripts = Path::new("tests/browser");
    Tool::new("npm").args(["ci", "--no-audit", "--no-fund", "--silent"]).dir(scripts).check()?;
    step("Making pictures");
    let mut pictures = Tool::new("node");
    if arguments.files.is_empty() {
        pictures = pictures.env("VANTAGE_MADE", "1");
    }
    pictures
        .args(["beside/main.mjs".as_ref(), pairs.as_os_str(), environment.as_os_str()])
        .args(files)
        .dir(scripts)
        .env("VANTAGE_SERVER_BIN", server)
        .env("VANTAGE_WEB_DIR", web_dir)
        .env("VANTAGE_SIDE_PX", arguments.size.to_string())
        .check()?;
    step("Comparing");
    Tool::new(report)
        .args(["beside".as_ref(), "--pairs".as_ref(), pairs.as_os_str(), "--out".as_ref(), arguments.out.as_os_str()])
        .check()
}

/// Those of [`MODELS`] that are there; what is missing is said. Without any, models that are made are still compared.
fn samples() -> Vec<PathBuf> {
    let Some(assets) = std::env::var_os("VANTAGE_ASSETS") else {
        println!("sample models left out, as VANTAGE_ASSETS names no folder of assets");
        return Vec::new();
    };
    let folder = Path::new(&assets).join(MODELS_DIR);
    let (there, missing): (Vec<PathBuf>, Vec<PathBuf>) =
        MODELS.iter().map(|model| folder.join(model)).partition(|file| file.is_file());
    for file in missing {
        println!("left out, as it is not there: {}", file.display());
    }
    there
}

/// The file, wherever a script runs.
fn existing(file: &Path) -> anyhow::Result<PathBuf> {
    file.canonicalize().with_context(|| file.display().to_string())
}
