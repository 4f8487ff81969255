//! The fuzzer: LLVM's engine around the target that `VANTAGE_FUZZ_TARGET` names. Where `VANTAGE_FUZZ_SEEDS` names a folder, the target's
//! [seeds] are written there first.

#![no_main]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, OnceLock};

use vantage_fuzz::{Target, seeds, target};

static TARGET: OnceLock<&'static Target> = OnceLock::new();
/// What the last panic said.
static SAID: Mutex<String> = Mutex::new(String::new());

fn begin() {
    // The engine's own hook ends the process at every panic. But a decoder of others may panic where that is an error like any other, so only
    // a panic that leaves the target counts.
    std::panic::set_hook(Box::new(|panic| {
        if let Ok(mut said) = SAID.lock() {
            *said = panic.to_string();
        }
    }));
    let name = std::env::var("VANTAGE_FUZZ_TARGET").unwrap_or_default();
    let Some(target) = target(&name) else {
        eprintln!("VANTAGE_FUZZ_TARGET={name:?} names no target");
        std::process::exit(2);
    };
    if let Some(folder) = std::env::var_os("VANTAGE_FUZZ_SEEDS") {
        for (seed, bytes) in seeds::seeds(target.name) {
            let path = std::path::Path::new(&folder).join(seed);
            if let Err(error) = std::fs::write(&path, bytes) {
                eprintln!("{}: {error}", path.display());
                std::process::exit(2);
            }
        }
    }
    TARGET.get_or_init(|| target);
}

libfuzzer_sys::fuzz_target!(init: begin(), |bytes: &[u8]| {
    let target = TARGET.get().expect("the engine begins with it");
    if catch_unwind(AssertUnwindSafe(|| (target.run)(bytes))).is_err() {
        eprintln!("{}", SAID.lock().map(|said| said.clone()).unwrap_or_default());
        std::process::abort();
    }
});
