//! Builds the web client: cargo for wasm32, then wasm-bindgen as a library, then the static files.

use std::path::{Path, PathBuf};

use anyhow::Context;

use crate::run::{self, Tool, cargo, step, target_dir};
use crate::setup::{WasmToolchain, wasm_toolchain};

/// Which web client to build.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// Small and optimized: what is shipped.
    Release,
    /// Built with the server that is to serve it on this machine, at half the time.
    Serve,
    /// Built in seconds: what is tested.
    Fast,
}

impl Profile {
    /// This one, or that of the tests where commands are tried by them.
    fn unless_dev(self) -> Profile {
        if run::Profile::Serve.unless_dev() == run::Profile::Dev { Profile::Fast } else { self }
    }

    /// As cargo calls it.
    fn name(self) -> &'static str {
        match self {
            Profile::Release => "web",
            Profile::Serve => "serve",
            Profile::Fast => "web-dev",
        }
    }
}

/// Builds the web client and returns the folder that a server can serve.
pub fn build(profile: Profile) -> anyhow::Result<PathBuf> {
    let profile = profile.unless_dev();
    step(&format!("Building the web client (profile {})", profile.name()));
    compile(profile).check()?;
    bind(profile, &run::built(run::Profile::Dev, "vantage-bindgen", "vantage-bindgen")?)
}

/// Builds a server and its web client; where they are. One after the other: on two cores both at once take longer, and what runs in both compilers is built twice.
pub fn build_with_server() -> anyhow::Result<(PathBuf, PathBuf)> {
    let profile = Profile::Serve.unless_dev();
    let [server, bindgen] = run::built_to_serve()?;
    step(&format!("Building the web client (profile {})", profile.name()));
    compile(profile).check()?;
    Ok((server, bind(profile, &bindgen)?))
}

fn compile(profile: Profile) -> Tool {
    wasm_cargo("build").args(["--package", "vantage-web", "--lib", "--profile", profile.name()])
}

/// Makes of what was compiled what a browser loads, with the static files.
fn bind(profile: Profile, bindgen: &Path) -> anyhow::Result<PathBuf> {
    let out_dir = target_dir().join("web").join(profile.name());
    std::fs::create_dir_all(&out_dir).with_context(|| format!("making {}", out_dir.display()))?;
    let wasm = target_dir().join("wasm32-unknown-unknown").join(profile.name()).join("vantage_web.wasm");
    step("Binding it for the browser");
    Tool::new(bindgen).args([&wasm, &out_dir]).check()?;
    copy_files(Path::new("web/static"), &out_dir)?;
    let size = std::fs::metadata(out_dir.join("vantage_web_bg.wasm"))?.len();
    println!("    {}: {} KiB of wasm", out_dir.display(), size / 1024);
    Ok(out_dir)
}

/// The small client, with every file by Brotli and gzip beside itself: a folder that a server can be built with.
pub fn pack() -> anyhow::Result<PathBuf> {
    let built = build(Profile::Release)?;
    step("Packing it");
    cargo().args(["build", "--workspace", "--bin", "vantage-pack"]).check()?;
    let out_dir = target_dir().join("web").join("packed");
    Tool::new(target_dir().join("debug/vantage-pack")).args([&built, &out_dir]).check()?;
    Ok(out_dir)
}

/// `cargo SUBCOMMAND` for wasm32, by whichever toolchain has it.
pub fn wasm_cargo(subcommand: &str) -> Tool {
    let target = ["--target", "wasm32-unknown-unknown"];
    let tool = match wasm_toolchain() {
        Some(WasmToolchain::Debian) => Tool::new("cargo")
            .args(["+debian-web", subcommand, "-Zbuild-std=std,panic_abort"])
            .env("RUSTC_BOOTSTRAP", "1"),
        Some(WasmToolchain::Rustup) | None => cargo().args([subcommand]),
    };
    tool.args(target).env("CC_wasm32_unknown_unknown", "clang").env("AR_wasm32_unknown_unknown", "llvm-ar")
}

/// All that lies in a folder.
pub fn copy_files(from: &Path, to: &Path) -> anyhow::Result<()> {
    for entry in std::fs::read_dir(from).with_context(|| format!("reading {}", from.display()))? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            std::fs::create_dir_all(&target)?;
            copy_files(&entry.path(), &target)?;
        } else {
            std::fs::copy(entry.path(), &target).with_context(|| format!("copying {}", entry.path().display()))?;
        }
    }
    Ok(())
}
