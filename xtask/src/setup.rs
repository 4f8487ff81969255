//! Installs what is missing, and says what it does. Everything that is there already is skipped.

use std::path::Path;

use anyhow::bail;

use crate::run::{Tool, step};

/// Something a command needs from the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// A Vulkan loader and a driver: that of the GPU, or Mesa's software one.
    Vulkan,
    /// The standard library for wasm32.
    WasmTarget,
    /// Compiles zstd's C for the browser.
    Clang,
    /// Runs the browser tests.
    Chromium,
    /// Runs the script that drives the browser.
    Node,
    /// Between a server and its relays, for tests and a report.
    Nats,
    /// Codes the video that a report compares with.
    Ffmpeg,
}

impl Need {
    /// What building, serving and testing need.
    pub const USUAL: &[Need] = &[Need::Vulkan, Need::WasmTarget, Need::Clang, Need::Chromium, Need::Node, Need::Nats];

    fn is_met(self) -> bool {
        match self {
            Need::Vulkan => has_vulkan(),
            Need::WasmTarget => wasm_toolchain().is_some(),
            Need::Clang => on_path("clang") && on_path("llvm-ar"),
            Need::Chromium => on_path("chromium") && has_fonts(),
            Need::Node => on_path("node") && on_path("npm"),
            Need::Nats => on_path("nats-server"),
            Need::Ffmpeg => on_path("ffmpeg"),
        }
    }

    fn debian_packages(self) -> &'static [&'static str] {
        match self {
            Need::Vulkan => &["libvulkan1", "mesa-vulkan-drivers"],
            Need::WasmTarget => &[],
            Need::Clang => &["clang", "llvm"],
            Need::Chromium => &["chromium", "fonts-dejavu-core"],
            Need::Node => &["nodejs", "npm"],
            Need::Nats => &["nats-server"],
            Need::Ffmpeg => &["ffmpeg"],
        }
    }

    fn purpose(self) -> &'static str {
        match self {
            Need::Vulkan => "a Vulkan driver (a software one where there is no GPU driver)",
            Need::WasmTarget => "Rust's standard library for wasm32",
            Need::Clang => "clang, for the C part of the web client",
            Need::Chromium => "Chromium, for the browser tests",
            Need::Node => "node and npm, for the browser tests",
            Need::Nats => "nats-server, the broker between a server and its relays, for tests",
            Need::Ffmpeg => "ffmpeg, for the video that a report compares with",
        }
    }
}

/// Installs those of `needs` that are missing; an error names exactly what to install by hand.
pub fn install(needs: &[Need]) -> anyhow::Result<()> {
    let missing: Vec<Need> = needs.iter().copied().filter(|need| !need.is_met()).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let packages: Vec<&str> = missing.iter().flat_map(|need| need.debian_packages()).copied().collect();
    if !packages.is_empty() {
        for need in missing.iter().filter(|need| !need.debian_packages().is_empty()) {
            step(&format!("Installing {}", need.purpose()));
        }
        apt_install(&packages)?;
    }
    if missing.contains(&Need::WasmTarget) {
        install_wasm_target()?;
    }
    for need in missing {
        if !need.is_met() {
            bail!("{} is still missing after the installation", need.purpose());
        }
    }
    Ok(())
}

fn apt_install(packages: &[&str]) -> anyhow::Result<()> {
    let by_hand = format!("install these packages and run this again: {}", packages.join(" "));
    if !on_path("apt-get") {
        bail!("this system has no apt-get; {by_hand} (Debian's names)");
    }
    let prefix: &[&str] = if is_root() {
        &[]
    } else if Tool::new("sudo").args(["-n", "true"]).succeeds() {
        &["sudo", "-n"]
    } else {
        bail!("neither root nor sudo without a password: {by_hand}\n  sudo apt-get install {}", packages.join(" "));
    };
    let apt = |arguments: &[&str]| {
        let line: Vec<&str> = [prefix, &["env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-q"], arguments].concat();
        Tool::new(line[0]).args(&line[1..]).check()
    };
    // An old package list is tried first: refreshing it takes longer than most installations.
    let install = [&["install", "-y", "--no-install-recommends"], packages].concat();
    if apt(&install).is_err() {
        apt(&["update"])?;
        apt(&install)?;
    }
    Ok(())
}

/// How to build for wasm32 on this machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WasmToolchain {
    /// The running toolchain has the target.
    Rustup,
    /// Debian's toolchain, which builds the standard library from its source.
    Debian,
}

/// The toolchain that can build for wasm32, if there is one.
pub fn wasm_toolchain() -> Option<WasmToolchain> {
    let sysroot = Tool::new("rustc").args(["--print", "sysroot"]).output().unwrap_or_default();
    if Path::new(sysroot.trim()).join("lib/rustlib/wasm32-unknown-unknown/lib").is_dir() {
        return Some(WasmToolchain::Rustup);
    }
    let toolchains = Tool::new("rustup").args(["toolchain", "list"]).output().unwrap_or_default();
    toolchains.lines().any(|line| line.starts_with("debian-web")).then_some(WasmToolchain::Debian)
}

fn install_wasm_target() -> anyhow::Result<()> {
    step(&format!("Installing {}", Need::WasmTarget.purpose()));
    if Tool::new("rustup").args(["target", "add", "wasm32-unknown-unknown"]).check().is_ok() {
        return Ok(());
    }
    step("rustup cannot download it: using Debian's toolchain, which builds it from source");
    apt_install(&["rustc-web", "cargo-web", "rust-web-src", "rust-web-llvm", "lld-22"])?;
    Tool::new("rustup").args(["toolchain", "link", "debian-web", "/usr"]).check()
}

fn has_vulkan() -> bool {
    let driver = std::env::var_os("VK_DRIVER_FILES").is_some()
        || ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d", "/usr/local/share/vulkan/icd.d"]
            .iter()
            .any(|dir| has_entry(Path::new(dir), |name| name.ends_with(".json")));
    let library_dirs =
        ["/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu", "/usr/lib64", "/usr/lib", "/usr/local/lib"];
    let loader = library_dirs.iter().any(|dir| has_entry(Path::new(dir), |name| name.starts_with("libvulkan.so.1")));
    cfg!(target_os = "macos") || (driver && loader)
}

/// Without fonts a headless Chromium shows pages without text.
fn has_fonts() -> bool {
    has_entry(Path::new("/usr/share/fonts"), |_| true)
}

fn has_entry(dir: &Path, accept: impl Fn(&str) -> bool) -> bool {
    std::fs::read_dir(dir)
        .is_ok_and(|entries| entries.flatten().any(|entry| accept(&entry.file_name().to_string_lossy())))
}

/// Whether a program is there.
pub fn on_path(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|dir| dir.join(program).is_file())
}

fn is_root() -> bool {
    Tool::new("id").args(["-u"]).output().is_some_and(|id| id.trim() == "0")
}
