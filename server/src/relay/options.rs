//! The command line of `vantage-server relay`.

use clap::Args;

use crate::broker::{Broker, BrokerAddress};
use crate::port_options::PortOptions;

/// Passes on what a server publishes, to any number of followers: without a scene and without a GPU. Clients follow its presenters by the same page and the
/// same viewer as at the server itself.
#[derive(Debug, Clone, Args)]
pub struct RelayOptions {
    /// Where the server publishes: nats://HOST or nats://HOST:PORT, with USER:PASSWORD@ or TOKEN@ before HOST where it asks for that; tls:// over TLS
    #[arg(long, value_name = "BROKER", hide_env_values = true)]
    pub subscribe: BrokerAddress,
    /// Its --channel
    #[arg(long, value_name = "NAME", default_value = Broker::CHANNEL)]
    pub channel: String,
    /// Its own port.
    #[command(flatten)]
    pub port: PortOptions,
}

impl RelayOptions {
    /// What it listens to.
    pub fn broker(&self) -> Broker {
        Broker { address: self.subscribe.clone(), channel: self.channel.clone() }
    }
}
