//! Running other programs: with their name in every error, and their output passed through.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc;

use anyhow::{Context, bail};

/// A variable that is set where commands are to be tried with what tests have built, and nothing is built for speed.
pub const DEV: &str = "VANTAGE_XTASK_DEV";

/// How a program is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// As tests are.
    Dev,
    /// Soon, and nearly as fast as can be: for this machine.
    Serve,
    /// As fast as can be.
    Release,
}

impl Profile {
    /// This one, or that of the tests where commands are tried by them.
    pub fn unless_dev(self) -> Profile {
        if std::env::var_os(DEV).is_some() { Profile::Dev } else { self }
    }

    /// As cargo calls it, which is also its folder but for [`Profile::Dev`].
    pub fn name(self) -> &'static str {
        match self {
            Profile::Dev => "dev",
            Profile::Serve => "serve",
            Profile::Release => "release",
        }
    }
}

/// Builds a binary; where it is.
pub fn built(profile: Profile, package: &str, binary: &str) -> anyhow::Result<PathBuf> {
    let [built] = built_together(profile, [(package, binary)])?;
    Ok(built)
}

/// Builds the server, and what binds its page for the browser; where they are. Always both: alone, what they share would have other features, and be built twice.
pub fn built_to_serve() -> anyhow::Result<[PathBuf; 2]> {
    built_together(Profile::Serve, [("vantage-server", "vantage-server"), ("vantage-bindgen", "vantage-bindgen")])
}

/// Builds binaries of packages at once, so that no core waits for the end of one before the next begins; where they are.
fn built_together<const N: usize>(profile: Profile, wanted: [(&str, &str); N]) -> anyhow::Result<[PathBuf; N]> {
    let profile = profile.unless_dev();
    let binaries = wanted.map(|(_, binary)| binary);
    step(&format!("Building {} (profile {})", binaries.join(" and "), profile.name()));
    // Tests are built with the features of the whole workspace, so that nothing of theirs is built twice.
    let packages = wanted.iter().flat_map(|(package, _)| ["--package", package]);
    let what: Vec<&str> = if profile == Profile::Dev { vec!["--workspace"] } else { packages.collect() };
    let binaries = wanted.iter().flat_map(|(_, binary)| ["--bin", binary]);
    cargo().args(["build", "--profile", profile.name()]).args(binaries).args(what).check()?;
    let folder = if profile == Profile::Dev { "debug" } else { profile.name() };
    let target = std::path::absolute(target_dir())?;
    Ok(wanted.map(|(_, binary)| target.join(folder).join(binary)))
}

/// Announces what happens next.
pub fn step(what: &str) {
    println!("\n==> {what}");
}

/// A command line under construction.
pub struct Tool {
    command: Command,
    name: String,
}

impl Tool {
    /// A program by name or path.
    pub fn new(program: impl AsRef<OsStr>) -> Tool {
        let name = program.as_ref().to_string_lossy().into_owned();
        Tool { command: Command::new(program), name }
    }

    /// More arguments.
    pub fn args<A: AsRef<OsStr>>(mut self, arguments: impl IntoIterator<Item = A>) -> Tool {
        self.command.args(arguments);
        self
    }

    /// An environment variable.
    pub fn env(mut self, key: &str, value: impl AsRef<OsStr>) -> Tool {
        self.command.env(key, value);
        self
    }

    /// The working directory.
    pub fn dir(mut self, dir: &Path) -> Tool {
        self.command.current_dir(dir);
        self
    }

    /// Runs it with its output on the terminal; an exit code but 0 is an error.
    pub fn check(mut self) -> anyhow::Result<()> {
        let status = self.command.status().with_context(|| format!("starting {}", self.name))?;
        if !status.success() {
            bail!("{} failed ({status})", self.name);
        }
        Ok(())
    }

    /// Runs it silently: whether it could be started and succeeded.
    pub fn succeeds(mut self) -> bool {
        let status = self.command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status();
        status.is_ok_and(|status| status.success())
    }

    /// What it prints on standard output, when it succeeds.
    pub fn output(mut self) -> Option<String> {
        let output = self.command.stdin(Stdio::null()).stderr(Stdio::null()).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
    }

    /// Runs it, shows each line of its standard output and of its errors, and hands it to `see`; whether it succeeded.
    pub fn watch(mut self, mut see: impl FnMut(&str)) -> anyhow::Result<bool> {
        let piped = self.command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = piped.spawn().with_context(|| format!("starting {}", self.name))?;
        let (sender, lines) = mpsc::channel();
        let stdout = child.stdout.take().context("standard output is piped")?;
        let stderr = child.stderr.take().context("errors are piped")?;
        forward(stdout, sender.clone());
        forward(stderr, sender);
        for line in lines {
            println!("{line}");
            see(&line);
        }
        Ok(child.wait()?.success())
    }

    /// Becomes the program, so that signals and its exit code are its own.
    pub fn replace_this_process(mut self) -> anyhow::Result<()> {
        use std::os::unix::process::CommandExt;
        let error = self.command.exec();
        Err(error).with_context(|| format!("starting {}", self.name))
    }
}

/// Sends the lines of a pipe until it is closed.
fn forward(pipe: impl Read + Send + 'static, lines: mpsc::Sender<String>) {
    std::thread::spawn(move || {
        for line in BufReader::new(pipe).split(b'\n').map_while(Result::ok) {
            // Whoever listened is gone only when this program ends.
            let _ = lines.send(String::from_utf8_lossy(&line).into_owned());
        }
    });
}

/// The cargo that runs this.
pub fn cargo() -> Tool {
    Tool::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

/// Where cargo builds into.
pub fn target_dir() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| PathBuf::from("target"), PathBuf::from)
}
