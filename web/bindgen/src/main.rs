//! `vantage-bindgen IN.wasm OUT_DIR`: writes `vantage_web.js` and `vantage_web_bg.wasm` for a browser.
//!
//! wasm-bindgen's command line must match the library to the patch version; used as a library, the lock file sees to that.

use std::path::PathBuf;

use anyhow::{Context, bail};

fn main() -> anyhow::Result<()> {
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [wasm, out_dir] = arguments.as_slice() else { bail!("usage: vantage-bindgen IN.wasm OUT_DIR") };
    wasm_bindgen_cli_support::Bindgen::new()
        .input_path(wasm)
        .out_name("vantage_web")
        .web(true)?
        .typescript(false)
        .generate(out_dir)
        .with_context(|| format!("binding {}", wasm.display()))
}
