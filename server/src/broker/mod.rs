//! A broker between a server that publishes what its presenters are sent and relays that pass it on: NATS core, which gives a message to all who listen at
//! that time, once or not at all.
//!
//! - [`Broker`]: where it is, and by which channel servers that share it are told apart; `subjects`: what is said where.
//! - `notes`: what both ends say in words, as JSON; `pieces`: what followers are to be sent, byte by byte.
//!
//! | subject | from | what |
//! |---|---|---|
//! | `vantage.CHANNEL.asks` | relays | whom they follow, twice a second; whether they need a whole copy |
//! | `vantage.CHANNEL.server` | the server, while somebody asks | what clients are welcomed with, who presents and how far each is |
//! | `vantage.CHANNEL.by.NAME.updates` | the server, while somebody asks for NAME | every update, in its fragments |
//! | `vantage.CHANNEL.by.NAME.whole` | the server, when asked for | the whole copy of the moment, in its fragments |
//! | `vantage.CHANNEL.by.NAME.eye` | the server, ten times a second | where the presenter's eye is |

mod address;
pub(crate) mod notes;
pub(crate) mod pieces;
mod subjects;

use std::time::Duration;

use async_nats::{Client, ConnectOptions, Event};

pub use address::{AddressError, BrokerAddress};
pub(crate) use subjects::{Kind, Subjects};

/// Between two asks of a relay, in real time: who comes late waits half of it on average, and a broker has little to do with a hundred relays.
pub(crate) const ASK_EVERY: Duration = Duration::from_millis(500);
/// Messages to the broker that wait while it is away or slow: two megabytes of fragments. What does not fit waits in the audience's log, or is dropped there.
const WAITING_TO_LEAVE: usize = 64;
/// Messages of one subscription that wait to be taken: the fragments of the largest update, and as many behind them.
const WAITING_TO_BE_TAKEN: usize = 4096;
/// A broker that says nothing for two of these is given up, and looked for again.
const PING_EVERY: Duration = Duration::from_secs(5);
/// Between two tries to connect at most.
const TRY_EVERY: Duration = Duration::from_secs(1);

/// See the module.
#[derive(Debug, Clone)]
pub struct Broker {
    /// Where it is, and who one is to it.
    pub address: BrokerAddress,
    /// Tells servers apart that share it.
    pub channel: String,
}

impl Broker {
    /// The channel where none is named.
    pub const CHANNEL: &'static str = "main";

    pub(crate) fn subjects(&self) -> Subjects {
        Subjects::new(&self.channel)
    }

    /// A connection that is tried for until it comes about, and made again whenever it breaks. `name`: for who looks at the broker.
    pub(crate) async fn connect(&self, name: &str) -> Result<Client, async_nats::ConnectError> {
        let shown = self.address.to_string();
        let said = move |event: Event| {
            let shown = shown.clone();
            async move {
                match event {
                    Event::Connected => tracing::info!(broker = shown, "connected to the broker"),
                    Event::Disconnected => tracing::warn!(broker = shown, "the broker is away"),
                    Event::SlowConsumer(_) => tracing::debug!(broker = shown, "messages of the broker were dropped"),
                    event => tracing::info!(broker = shown, "the broker: {event}"),
                }
            }
        };
        let options = ConnectOptions::new()
            .name(name)
            .retry_on_initial_connect()
            .ping_interval(PING_EVERY)
            .client_capacity(WAITING_TO_LEAVE)
            .subscription_capacity(WAITING_TO_BE_TAKEN)
            .reconnect_delay_callback(|tries| if tries < 2 { Duration::from_millis(50) } else { TRY_EVERY })
            .ignore_discovered_servers()
            .event_callback(said);
        self.address.log_in(options).connect(self.address.server()).await
    }
}
