//! Progress on the terminal; where there is none, a line for each thing that is said.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar that goes away when done.
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// A bar of `steps`, with what is being done before it.
    pub fn new(what: impl Into<String>, steps: u64) -> Progress {
        let template = "{msg:40} [{bar:40}] {pos}/{len} {elapsed} (about {eta} left)";
        let style = ProgressStyle::with_template(template).expect("the template is valid").progress_chars("=> ");
        let bar = ProgressBar::new(steps).with_style(style).with_message(what.into());
        Progress { bar }
    }

    /// One step is done.
    pub fn step(&self) {
        self.bar.inc(1);
    }

    /// Says what comes next.
    pub fn say(&self, what: impl Into<String>) {
        let what = what.into();
        if self.bar.is_hidden() {
            eprintln!("{what}");
        }
        self.bar.set_message(what);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
