//! Hostile bytes: what a fuzzer calls, and what a test replays.
//!
//! A [`Target`] is a function that takes any bytes. It panics where the code under test breaks a promise: a decoder that does not give back what was
//! encoded, two copies that part, a number that is not finite. The engine (`cargo xtask fuzz`) looks for such bytes by what code they reach; what it
//! finds lies in `corpus/` and is replayed by `tests/replay.rs`, without the engine.
//!
//! Caps of decoders and loaders are lowered ([`caps`]), so that a run needs little memory and a claim that is believed shows.

pub mod caps;
mod codec;
mod files;
mod make;
mod scratch;
pub mod seeds;
mod session;
mod text;
mod updates;
mod wire;

/// What a fuzzer calls.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// Names it, and the folder of its inputs in `corpus/`.
    pub name: &'static str,
    /// Takes any bytes, and says whether they mean anything; a panic is a finding.
    pub run: fn(&[u8]) -> bool,
}

/// All of them.
pub const TARGETS: &[Target] = &[
    Target { name: "gltf", run: files::gltf },
    Target { name: "mesh_files", run: files::mesh_files },
    Target { name: "wire", run: wire::wire },
    Target { name: "codec", run: codec::codec },
    Target { name: "session", run: session::session },
    Target { name: "traces", run: text::traces },
];

/// The target of a name.
pub fn target(name: &str) -> Option<&'static Target> {
    TARGETS.iter().find(|target| target.name == name)
}
