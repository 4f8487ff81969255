//! The part of the command line that is about publishing.

use clap::Args;

use crate::broker::{Broker, BrokerAddress};

/// See the module.
#[derive(Debug, Clone, Args)]
pub struct PublishOptions {
    /// Publish what presenters are sent, for relays (vantage-server relay) to pass on: nats://HOST or nats://HOST:PORT, with USER:PASSWORD@ or TOKEN@ before HOST where it asks for that; tls:// over TLS
    #[arg(long, value_name = "BROKER", hide_env_values = true)]
    pub publish: Option<BrokerAddress>,
    /// Tells servers apart that publish at one broker
    #[arg(long, value_name = "NAME", default_value = Broker::CHANNEL)]
    pub channel: String,
}

impl PublishOptions {
    /// Where to, if anywhere.
    pub fn broker(&self) -> Option<Broker> {
        let address = self.publish.clone()?;
        Some(Broker { address, channel: self.channel.clone() })
    }
}
