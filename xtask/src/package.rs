//! `cargo xtask package`: a folder to copy to a GPU host, with the server as one file that has the page in it; and a package for npm, with the element that shows it in pages of others.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use anyhow::{Context, ensure};

use crate::run::{Tool, cargo, step, target_dir};
use crate::setup::{self, Need};
use crate::web;

/// What goes beside the server, and where to.
const FILES: &[(&str, &str)] = &[
    ("packaging/vantage-server.service", "vantage-server.service"),
    ("packaging/vantage-server.toml", "vantage-server.toml"),
    ("docs/running-on-a-gpu-host.md", "running-on-a-gpu-host.md"),
    ("LICENSE-APACHE", "LICENSE-APACHE"),
    ("LICENSE-MIT", "LICENSE-MIT"),
];
/// What the package for pages of others is made of, and the element that it is about.
const ELEMENT_PACKAGE: &str = "packaging/npm";
const NOTEBOOK_PACKAGE: &str = "packaging/python";
const ELEMENT: &str = "web/static/vantage-view.js";
/// A server that says nothing for so long does not work.
const PATIENCE: Duration = Duration::from_secs(30);

/// Where the package is.
pub fn folder() -> PathBuf {
    target_dir().join("package")
}

/// Builds the package.
pub fn package() -> anyhow::Result<()> {
    setup::install(&[Need::WasmTarget, Need::Clang])?;
    let page = std::path::absolute(web::pack()?)?;
    step("Building the server with the page in it (release)");
    let build = ["build", "--release", "--package", "vantage-server", "--bin", "vantage-server"];
    cargo().args(build).env("VANTAGE_EMBEDDED_WEB", page).check()?;
    let to = folder();
    std::fs::create_dir_all(&to).with_context(|| to.display().to_string())?;
    let copy = |from: &Path, name: &str| {
        std::fs::copy(from, to.join(name)).map(|_| ()).with_context(|| format!("copying {}", from.display()))
    };
    copy(&target_dir().join("release/vantage-server"), "vantage-server")?;
    FILES.iter().try_for_each(|(from, name)| copy(Path::new(from), name))?;
    manual(&to)?;
    println!("    {}", to.display());
    notebook()?;
    let npm = element()?;
    if setup::on_path("npm") {
        step("Packing the element for pages of others");
        Tool::new("npm").args(["pack", "--pack-destination", ".."]).dir(&npm).check()?;
    }
    Ok(())
}

/// Completions for shells and the manual page, as the packaged server prints them.
fn manual(to: &Path) -> anyhow::Result<()> {
    let server = std::path::absolute(to.join("vantage-server"))?;
    for (arguments, name) in [
        (&["--manual"][..], "vantage-server.1"),
        (&["--completions", "bash"], "vantage-server.bash"),
        (&["--completions", "zsh"], "_vantage-server"),
        (&["--completions", "fish"], "vantage-server.fish"),
    ] {
        let text = Tool::new(&server).args(arguments).output().context("the packaged server prints its manual")?;
        std::fs::write(to.join(name), text).with_context(|| format!("writing {name}"))?;
    }
    Ok(())
}

/// Puts the package for npm together, without packing it: its folder.
pub fn element() -> anyhow::Result<PathBuf> {
    with_element(ELEMENT_PACKAGE, "npm", "")
}

/// The same of the package for notebooks, which pip installs as it lies there.
pub fn notebook() -> anyhow::Result<PathBuf> {
    with_element(NOTEBOOK_PACKAGE, "python", "vantage_view")
}

/// A copy of a folder among the packages, and in one of its folders the element.
fn with_element(from: &str, name: &str, element_in: &str) -> anyhow::Result<PathBuf> {
    let to = folder().join(name);
    std::fs::create_dir_all(&to).with_context(|| to.display().to_string())?;
    web::copy_files(Path::new(from), &to)?;
    let element = Path::new(ELEMENT);
    let copy = to.join(element_in).join(element.file_name().context("a file has a name")?);
    std::fs::copy(element, &copy).with_context(|| format!("copying {ELEMENT}"))?;
    Ok(to)
}

/// Starts the packaged server in another folder and asks for its page. It needs no scene for that.
pub fn check_page() -> anyhow::Result<()> {
    let server = std::path::absolute(folder().join("vantage-server"))?;
    let mut child = Command::new(server)
        .args(["pillars", "--port", "0"])
        .current_dir(std::env::temp_dir())
        .stdout(Stdio::piped())
        .spawn()
        .context("starting the packaged server")?;
    let checked = check_served(&mut child);
    // It has told all that it was asked for.
    let _ = child.kill();
    child.wait()?;
    checked
}

fn check_served(child: &mut Child) -> anyhow::Result<()> {
    let mut url = String::new();
    BufReader::new(child.stdout.take().context("standard output is piped")?).read_line(&mut url)?;
    let host = url.trim().strip_prefix("http://").context("the server says where it listens")?;
    let index = ask(host, "/", "identity")?;
    ensure!(
        index.starts_with("HTTP/1.1 200") && index.contains("text/html") && index.contains("main.js"),
        "/: {index}"
    );
    for encoding in ["br", "gzip"] {
        let wasm = ask(host, "/vantage_web_bg.wasm", encoding)?;
        for part in ["HTTP/1.1 200", "application/wasm", &format!("content-encoding: {encoding}"), "etag: ", "no-cache"]
        {
            ensure!(wasm.contains(part), "the client's wasm by {encoding}: no {part:?}");
        }
    }
    Ok(())
}

/// Head and body of an answer.
fn ask(host: &str, path: &str, encoding: &str) -> anyhow::Result<String> {
    let mut stream = TcpStream::connect(host)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\nAccept-Encoding: {encoding}\r\nConnection: close\r\n\r\n")?;
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer)?;
    Ok(String::from_utf8_lossy(&answer).into_owned())
}
