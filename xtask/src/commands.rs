//! The commands of README and the book, run as they stand there, in a folder with the files that they name. Each is in [`RULES`]: what is not run says why.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, bail, ensure};

use crate::pages;
use crate::run::{DEV, Tool, step, target_dir};

/// How a command is tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum How {
    /// It serves, until it is told to end.
    Serves,
    /// It ends by itself.
    Ends,
    /// It ends by itself, beside a server of all scenes of a folder.
    Asks,
    /// It is not run, as it needs this.
    Needs(&'static str),
}

/// What commands begin with, and how those are tried: the first that fits holds.
const RULES: &[(&str, How)] = &[
    ("cargo xtask serve", How::Serves),
    ("cargo xtask test", How::Needs("that is what runs this")),
    (
        "cargo run --release --package vantage-client --example",
        How::Needs("a release; end-to-end tests run it as tests are built"),
    ),
    ("cargo test", How::Needs("the tests of cargo, which it is one of")),
    ("cd tests/browser && node beside", How::Needs("pictures of `cargo xtask beside`")),
    ("cargo xtask package", How::Needs("a quarter of an hour; `cargo xtask test packaging` tries what it made")),
    ("cargo xtask view --headless", How::Asks),
    ("cargo xtask view", How::Needs("a display")),
    ("vantage-view", How::Needs("a display")),
    ("vantage-server --list", How::Ends),
    ("vantage-server --config vantage-server.toml --print-config", How::Ends),
    ("vantage-server --config vantage-server.toml --publish", How::Needs("a broker; tests of relays start one")),
    ("vantage-server relay", How::Needs("a broker; tests of relays start one")),
    ("vantage-server", How::Serves),
    ("vantage-load", How::Asks),
    ("(printf", How::Asks),
    ("curl", How::Asks),
    ("http://127.0.0.1", How::Needs("a browser; its tests open such addresses")),
    ("https://HOST", How::Needs("another machine")),
    (
        "pip install target/package/python",
        How::Needs("a package, of a quarter of an hour; `cargo xtask test packaging` runs its notebook"),
    ),
    ("ssh", How::Needs("another machine")),
    ("apt-get", How::Needs("root on a host")),
    ("install", How::Needs("root on a host")),
    ("echo", How::Needs("root on a host")),
    ("systemctl", How::Needs("root on a host")),
    ("journalctl", How::Needs("root on a host")),
    ("ufw", How::Needs("root on a host")),
    ("podman", How::Needs("a container engine")),
    ("kubectl", How::Needs("a cluster")),
];
/// What is no command: settings of the server, of its proxies, of Prometheus, and lines of pages and programs.
const OTHERS: &[&str] = &[
    "tls-",
    "location",
    "proxy_",
    "}",
    "viewer.example",
    "redir",
    "handle_path",
    "reverse_proxy",
    "scrape_configs",
    "- ",
    "scheme:",
    "authorization:",
    "credentials_file",
    "static_configs",
    "<",
    "const ",
    "view",
    "from vantage_view",
    "import ",
    "{ \"",
    "\"",
    "corner.json",
];
/// Names that stand for something, and what they stand for here.
const STANDS_FOR: &[(&str, &str)] = &[("SCENE", "pillars"), ("HOST", "127.0.0.1")];
/// Where commands serve, and are asked.
const ADDRESS: &str = "127.0.0.1:8080";
/// A server that is not there after so long does not come, and one that is told to end has ended.
const PATIENCE: Duration = Duration::from_secs(120);

/// How many passed, and which failed; `None` where something else serves at their address.
pub fn run_all() -> anyhow::Result<Option<(u64, Vec<String>)>> {
    if TcpListener::bind(ADDRESS).is_err() {
        return Ok(None);
    }
    let folder = prepared()?;
    let (mut passed, mut failed) = (0, Vec::new());
    for (page, command) in commands()? {
        match how(&command).with_context(|| format!("{page}: {command}"))? {
            How::Needs(what) => println!("{page}: {command}\n    not run: {what}"),
            how => {
                step(&format!("{page}: {command}"));
                let began = Instant::now();
                match tried(how, &command, &folder) {
                    Ok(()) => passed += 1,
                    Err(error) => {
                        println!("FAILED {page}: {command}: {error:#}");
                        failed.push(command);
                    }
                }
                println!("    {:.1} s", began.elapsed().as_secs_f64());
            }
        }
    }
    Ok(Some((passed, failed)))
}

/// Commands with their pages, each once.
fn commands() -> anyhow::Result<Vec<(String, String)>> {
    let mut pages = vec![PathBuf::from("README.md")];
    pages.extend(pages::of_book()?);
    let mut found: Vec<(String, String)> = Vec::new();
    for page in pages {
        let text = std::fs::read_to_string(&page).with_context(|| page.display().to_string())?;
        for command in pages::code(&text) {
            let is_new = found.iter().all(|(_, other)| *other != command);
            if is_new && !OTHERS.iter().any(|other| command.starts_with(other)) {
                found.push((page.display().to_string(), command));
            }
        }
    }
    Ok(found)
}

fn how(command: &str) -> anyhow::Result<How> {
    let rule = RULES.iter().find(|(begin, _)| command.starts_with(begin));
    rule.map(|&(_, how)| how)
        .context("nobody says how this command is tried: put it into RULES of xtask/src/commands.rs")
}

/// A folder with the files that commands name.
fn prepared() -> anyhow::Result<PathBuf> {
    let folder = std::path::absolute(target_dir().join("commands"))?;
    let scenes = folder.join("FOLDER");
    std::fs::create_dir_all(&scenes)?;
    for model in ["model.glb", "engine.glb", "FOLDER/engine.glb", "FOLDER/bunny.glb"] {
        std::fs::write(folder.join(model), triangle())?;
    }
    // Some name files of the repository, as seen from its root.
    let docs = folder.join("docs");
    if !docs.exists() {
        std::os::unix::fs::symlink(std::path::absolute("docs")?, docs)?;
    }
    // What a server refuses has failed.
    std::fs::write(folder.join(".curlrc"), "fail\n")?;
    std::fs::write(folder.join("walk.txt"), "0 1.6 3 0 0 0 0\n0 1.6 2.9 0 0 0 100\n")?;
    std::fs::copy("packaging/vantage-server.toml", folder.join("vantage-server.toml"))?;
    let certificate = [
        "req",
        "-x509",
        "-newkey",
        "rsa:2048",
        "-nodes",
        "-keyout",
        "key.pem",
        "-out",
        "cert.pem",
        "-subj",
        "/CN=localhost",
    ];
    ensure!(Tool::new("openssl").args(certificate).dir(&folder).succeeds(), "openssl makes no certificate");
    Ok(folder)
}

/// A binary glTF file of one triangle, a metre wide.
fn triangle() -> Vec<u8> {
    let corners = [[-0.5_f32, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let bytes: Vec<u8> = corners.iter().flatten().flat_map(|number| number.to_le_bytes()).collect();
    let mut json = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"byteLength":36}],"bufferViews":[{"buffer":0,"byteLength":36}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[-0.5,0,0],"max":[0.5,1,0]}]}"#.to_owned();
    json += &" ".repeat((4 - json.len() % 4) % 4);
    let chunk = |kind: &[u8; 4], bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes(), &kind[..], bytes].concat();
    let body = [chunk(b"JSON", json.as_bytes()), chunk(b"BIN\0", &bytes)].concat();
    [b"glTF", &2_u32.to_le_bytes()[..], &(12 + body.len() as u32).to_le_bytes(), &body].concat()
}

fn tried(how: How, command: &str, folder: &Path) -> anyhow::Result<()> {
    match how {
        How::Serves => Served::start(command, folder)?.end(),
        How::Ends => ended(command, folder),
        How::Asks => {
            let server = Served::start("vantage-server --scenes FOLDER --allow-uploads", folder)?;
            let asked = ended(command, folder);
            server.end()?;
            asked
        }
        How::Needs(_) => Ok(()),
    }
}

fn ended(command: &str, folder: &Path) -> anyhow::Result<()> {
    let status = shell(command, folder)?.status()?;
    ensure!(status.success(), "{status}");
    Ok(())
}

/// A command as a shell reads it, in the folder, with what was built for tests on its path.
fn shell(command: &str, folder: &Path) -> anyhow::Result<Command> {
    let command =
        STANDS_FOR.iter().fold(command.to_owned(), |command, (name, stands_for)| command.replace(name, stands_for));
    let built = std::path::absolute(target_dir().join("debug"))?;
    let path = std::env::var("PATH").unwrap_or_default();
    let mut shell = Command::new("sh");
    shell.args(["-c", &format!("exec {command}")]).current_dir(folder);
    if command.starts_with('(') {
        shell = Command::new("sh");
        shell.args(["-c", &command]).current_dir(folder);
    }
    shell
        .env("PATH", format!("{}:{path}", built.display()))
        .env(DEV, "1")
        .env("VANTAGE_TOKEN", "")
        .env("CURL_HOME", folder);
    Ok(shell)
}

/// A command that serves.
struct Served(Child);

impl Served {
    /// Starts it, and waits until it answers.
    fn start(command: &str, folder: &Path) -> anyhow::Result<Served> {
        let mut served = Served(shell(command, folder)?.env_remove("VANTAGE_TOKEN").stdout(Stdio::null()).spawn()?);
        let began = Instant::now();
        let is_plain = !command.contains("--tls-cert");
        while !is_ready(is_plain) {
            if let Some(status) = served.0.try_wait()? {
                bail!("it ended before it served: {status}");
            }
            ensure!(began.elapsed() < PATIENCE, "nothing answers at {ADDRESS}");
            std::thread::sleep(Duration::from_millis(100));
        }
        Ok(served)
    }

    /// Tells it to end, and waits for that.
    fn end(mut self) -> anyhow::Result<()> {
        ensure!(Tool::new("kill").args(["-TERM", &self.0.id().to_string()]).succeeds(), "it is gone");
        let began = Instant::now();
        loop {
            if let Some(status) = self.0.try_wait()? {
                ensure!(status.success(), "told to end, it ends with {status}");
                return Ok(());
            }
            ensure!(began.elapsed() < PATIENCE, "it does not end");
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        // It has ended, or is to.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Whether something at the address says that it serves. With TLS it listens once it does not say that it loads; what it says then is not for who speaks plainly.
fn is_ready(is_plain: bool) -> bool {
    let asked = || -> std::io::Result<String> {
        let mut stream = TcpStream::connect(ADDRESS)?;
        stream.set_read_timeout(Some(Duration::from_secs(5)))?;
        write!(stream, "GET /readyz HTTP/1.1\r\nHost: {ADDRESS}\r\nConnection: close\r\n\r\n")?;
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer)?;
        Ok(String::from_utf8_lossy(&answer).into_owned())
    };
    asked().is_ok_and(|answer| answer.starts_with("HTTP/1.1 200") || !is_plain && !answer.starts_with("HTTP/1.1 503"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_of_the_pages_has_a_rule() {
        std::env::set_current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("..")).expect("the repository");
        let all = commands().expect("pages");
        assert!(all.len() > 20, "{all:?}");
        let unruled: Vec<_> = all.iter().filter(|(_, command)| how(command).is_err()).collect();
        assert!(unruled.is_empty(), "{unruled:#?}");
    }
}
