//! The viewer without a window: follows a camera trace, one picture a pose, and writes down what happened.
//!
//! On the wall clock poses leave in real time (through `network::Proxy` where a link is asked for), and a picture that takes
//! longer than its slot delays the next, never drops it. On the virtual clock the run is in lock-step with the server: messages
//! carry the times at which the emulated link delivers them, rendering and coding take no time, and the same run gives the
//! same pictures on every machine.
//!
//! Before a first update has arrived there is nothing to draw: such frames are empty and their age is unknown. With
//! [`Options::warm_up`] (the default) frame 0 is held until an update has arrived that was made for the trace's first pose, or
//! until a second after the first update where none comes; the trace's time starts then.

mod error;
mod lockstep;
mod options;
mod output;
mod poses;
mod report;
mod stage;
mod wall;

use gpu::Gpu;
use protocol::message::Clock;

use crate::receive::address;
use crate::receive::socket::Sockets;
pub use error::HeadlessError;
pub use options::{Options, Way};
pub use report::{FrameRow, Header, RowMs, Settings, Summary};
pub use stage::Drawn;
use stage::Stage;

/// Runs on the machine's adapter.
pub fn run(options: &Options) -> Result<Summary, HeadlessError> {
    let gpu = Gpu::block_on(Gpu::new_headless())?;
    run_on(&gpu, options, &mut |_| {})
}

/// Runs on a given device and shows every picture to `on_frame`.
pub fn run_on(gpu: &Gpu, options: &Options, on_frame: &mut dyn FnMut(&Drawn<'_>)) -> Result<Summary, HeadlessError> {
    let url = address::websocket_url(&options.server)?;
    let sockets = Sockets::new().map_err(HeadlessError::Thread)?.ready_for(&url, options.tls_ca.as_deref())?;
    // The virtual clock emulates the network by stamps instead.
    let link = options.link.filter(|_| options.clock == Clock::Wall);
    let proxy = link.map(|link| sockets.start_proxy(&url, link)).transpose().map_err(HeadlessError::Network)?;
    let url = proxy
        .as_ref()
        .map_or_else(|| url.clone(), |proxy| address::with_authority(&url, &proxy.local_addr().to_string()));
    let mut stage = Stage::new(gpu, options)?;
    let rows = match options.clock {
        Clock::Wall => wall::run(options, &sockets, &url, &mut stage, on_frame),
        Clock::Virtual => lockstep::run(options, &sockets, &url, &mut stage, on_frame),
    }?;
    stage.finish(rows)
}
