//! `cargo xtask fuzz`: LLVM's libFuzzer around one target of the fuzz crate, on the stable compiler.
//!
//! The compiler counts edges and tells comparisons by LLVM's own pass (`sancov-module`), which stable reaches by `-C passes`; the engine comes with the
//! crate `libfuzzer-sys`. No sanitizer: nearly all of the code is without unsafe blocks.

use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::{Context, bail};
use clap::Args;

use crate::run::{Tool, cargo, step, target_dir};

/// Memory of the process, in MB: the caps of the fuzz crate allow a run about 60 (`fuzz/src/caps.rs`), an environment's picture 400, and the engine keeps
/// its inputs and tables.
const MEMORY_MB: u32 = 768;
/// A run that takes longer hangs, in seconds of the wall clock: the slowest honest ones take a fifth of a second, and one took twelve beside
/// builds that have all of the machine.
const HANGS_AFTER_S: u32 = 30;
/// An input of more bytes reaches no other code, and takes longer.
const MOST_BYTES: u32 = 16 * 1024;
const CORPUS: &str = "fuzz/corpus";

/// What `cargo xtask fuzz` takes.
#[derive(Args)]
pub struct FuzzArgs {
    /// Which target, see --list.
    #[arg(required_unless_present = "list")]
    target: Option<String>,
    /// How long, without building.
    #[arg(long, default_value_t = 60)]
    seconds: u32,
    /// Names the targets.
    #[arg(long)]
    list: bool,
    /// Instead: the fewest inputs that reach as many edges as all of them, into target/fuzz/TARGET/merged.
    #[arg(long)]
    merge: bool,
}

/// What the engine says at its end.
#[derive(Debug, Default, PartialEq, Eq)]
struct Figures {
    seconds: u64,
    executions: u64,
    edges: u64,
    features: u64,
    peak_mb: u64,
    inputs: u64,
}

/// Runs a target, or lists them.
pub fn fuzz(arguments: &FuzzArgs) -> anyhow::Result<()> {
    let targets = targets()?;
    if arguments.list {
        println!("{}", targets.join("\n"));
        return Ok(());
    }
    let target = arguments.target.as_deref().unwrap_or_default();
    if !targets.iter().any(|known| known == target) {
        bail!("there is no target {target:?}; there are: {}", targets.join(", "));
    }
    let engine = build()?;
    let folder = Folder::new(target)?;
    if arguments.merge { folder.merge(&engine) } else { folder.run(&engine, arguments.seconds) }
}

/// They have the names of the folders of their inputs; a test of the fuzz crate holds it so.
fn targets() -> anyhow::Result<Vec<String>> {
    let entries = std::fs::read_dir(CORPUS).with_context(|| format!("reading {CORPUS}"))?;
    let mut names: Vec<String> =
        entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort_unstable();
    Ok(names)
}

/// Builds the fuzzer for the host by its name, so that flags reach neither build scripts nor macros; gives its path.
fn build() -> anyhow::Result<PathBuf> {
    const FLAGS: &str = "-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
        -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
        -Cllvm-args=-sanitizer-coverage-trace-compares --cfg fuzzing";
    step("Building the fuzzer");
    let versions = Tool::new("rustc").args(["-vV"]).output().context("asking rustc for its host")?;
    let host = versions.lines().find_map(|line| line.strip_prefix("host: ")).context("rustc names its host")?;
    let folder = target_dir().join("fuzz/build");
    cargo()
        .args(["build", "--package", "vantage-fuzz", "--features", "engine", "--profile", "fuzz", "--target", host])
        .env("RUSTFLAGS", FLAGS)
        .env("CARGO_TARGET_DIR", &folder)
        .check()?;
    Ok(folder.join(host).join("fuzz/vantage-fuzz"))
}

/// Where a target's inputs lie, and what it found.
struct Folder {
    target: String,
    path: PathBuf,
}

impl Folder {
    fn new(target: &str) -> anyhow::Result<Folder> {
        let path = target_dir().join("fuzz").join(target);
        for name in ["seeds", "inputs", "found", "merged"] {
            let part = path.join(name);
            std::fs::create_dir_all(&part).with_context(|| format!("making {}", part.display()))?;
        }
        Ok(Folder { target: target.to_owned(), path })
    }

    fn engine(&self, engine: &Path, scratch: &Scratch) -> Tool {
        Tool::new(engine)
            .env("VANTAGE_FUZZ_TARGET", &self.target)
            .env("VANTAGE_FUZZ_SEEDS", self.path.join("seeds"))
            // One thread, or the same input reaches other code at other times.
            .env("RAYON_NUM_THREADS", "1")
            .env("TMPDIR", &scratch.0)
    }

    /// The engine's folders: new inputs go to the first one.
    fn inputs(&self) -> [PathBuf; 3] {
        [self.path.join("inputs"), self.path.join("seeds"), Path::new(CORPUS).join(&self.target)]
    }

    fn run(&self, engine: &Path, seconds: u32) -> anyhow::Result<()> {
        step(&format!("Fuzzing {} for {seconds} s", self.target));
        let found = self.path.join("found");
        let (before, mut figures) = (files(&found), Figures::default());
        let scratch = Scratch::new()?;
        let tool = self
            .engine(engine, &scratch)
            .args([
                format!("-max_total_time={seconds}"),
                format!("-rss_limit_mb={MEMORY_MB}"),
                format!("-timeout={HANGS_AFTER_S}"),
                format!("-max_len={MOST_BYTES}"),
                format!("-artifact_prefix={}/", found.display()),
                "-print_final_stats=1".to_owned(),
            ])
            .args(self.inputs());
        let succeeded = tool.watch(|line| figures.read(line))?;
        let record = figures.json(&self.target, succeeded);
        let path = self.path.join("figures.jsonl");
        append(&path, &record)?;
        println!("{}: {figures}", self.target);
        println!("{}: {}", self.target, path.display());
        let new: Vec<String> = files(&found).into_iter().filter(|file| !before.contains(file)).collect();
        if !succeeded {
            bail!(
                "found {} in {}: mend it, and keep the input in {CORPUS}/{}",
                new.join(", "),
                found.display(),
                self.target
            );
        }
        Ok(())
    }

    fn merge(&self, engine: &Path) -> anyhow::Result<()> {
        step(&format!("Merging the inputs of {}", self.target));
        let merged = self.path.join("merged");
        std::fs::remove_dir_all(&merged)?;
        std::fs::create_dir_all(&merged)?;
        self.engine(engine, &Scratch::new()?)
            .args([
                "-set_cover_merge=1",
                "-use_counters=0",
                &format!("-max_len={MOST_BYTES}"),
                &merged.display().to_string(),
            ])
            .args(self.inputs())
            .check()
    }
}

/// A folder for what loaders read, in memory where the system has such. The engine ends without tidying up.
struct Scratch(PathBuf);

impl Scratch {
    fn new() -> anyhow::Result<Scratch> {
        let memory = PathBuf::from("/dev/shm");
        let parent = if memory.is_dir() { memory } else { std::env::temp_dir() };
        let path = parent.join(format!("vantage-fuzzer-{}", std::process::id()));
        std::fs::create_dir_all(&path).with_context(|| format!("making {}", path.display()))?;
        Ok(Scratch(path))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect()
}

fn append(path: &Path, line: &str) -> anyhow::Result<()> {
    use std::io::Write;
    let mut file = std::fs::OpenOptions::new().create(true).append(true).open(path)?;
    writeln!(file, "{line}").with_context(|| format!("writing {}", path.display()))
}

impl Figures {
    /// Takes from a line of the engine what it says.
    fn read(&mut self, line: &str) {
        let after = |name: &str| line.split_once(name)?.1.split([' ', '/']).find(|word| !word.is_empty())?.parse().ok();
        if let (Some(edges), Some(features)) = (after(" cov: "), after(" ft: ")) {
            (self.edges, self.features) = (edges, features);
            self.inputs = after(" corp: ").unwrap_or(self.inputs);
        }
        let set = |value: &mut u64, found: Option<u64>| *value = found.unwrap_or(*value);
        set(&mut self.seconds, after(" runs in "));
        set(&mut self.executions, after("stat::number_of_executed_units: "));
        set(&mut self.peak_mb, after("stat::peak_rss_mb: "));
    }

    fn json(&self, target: &str, succeeded: bool) -> String {
        let Figures { seconds, executions, edges, features, peak_mb, inputs } = self;
        let at_s = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
        format!(
            r#"{{"target":"{target}","at_s":{at_s},"seconds":{seconds},"executions":{executions},"edges":{edges},"features":{features},"inputs":{inputs},"peak_mb":{peak_mb},"found":{}}}"#,
            !succeeded
        )
    }
}

impl std::fmt::Display for Figures {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Figures { seconds, executions, edges, features, peak_mb, inputs } = self;
        write!(
            f,
            "{seconds} s, {executions} executions, {edges} edges, {features} features, {inputs} inputs, {peak_mb} MB at most"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_those_of_the_last_lines() {
        let mut figures = Figures::default();
        for line in [
            "#2\tINITED cov: 7 ft: 8 corp: 1/1b exec/s: 0 rss: 30Mb",
            "#4194304\tpulse  cov: 16 ft: 20 corp: 5/31b lim: 4096 exec/s: 699050 rss: 412Mb",
            "Done 4194999 runs in 61 second(s)",
            "stat::number_of_executed_units: 4194999",
            "stat::peak_rss_mb:              413",
        ] {
            figures.read(line);
        }
        let expected = Figures { seconds: 61, executions: 4_194_999, edges: 16, features: 20, peak_mb: 413, inputs: 5 };
        assert_eq!(figures, expected);
    }
}
