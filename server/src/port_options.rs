//! What the command lines of a server and of a relay have in common: their port, who may connect, the log, and the file that says the same.

use std::net::IpAddr;
use std::path::PathBuf;

use clap::Args;

use crate::access::Access;
use crate::config::Config;
use crate::limits::PeerLimits;
use crate::tls::{Tls, TlsError};

/// See the module.
#[derive(Debug, Clone, Args)]
pub struct PortOptions {
    /// How the log is written
    #[arg(long, value_enum, default_value_t)]
    pub log_format: LogFormat,
    /// Address to listen on; anything but loopback needs --token
    #[arg(long, default_value = "127.0.0.1")]
    pub bind: IpAddr,
    /// Port to listen on; 0 picks a free one
    #[arg(long, default_value_t = 8080)]
    pub port: u16,
    /// What clients must know to connect: #token=... in the page's address, --token of the viewer, or a bearer token
    #[arg(long, hide_env_values = true)]
    pub token: Option<String>,
    /// A page of another origin (https://HOST or https://HOST:PORT) that may connect, and show the page in a frame; may be given several times
    #[arg(long, value_name = "ORIGIN", value_parser = origin)]
    pub allow_origin: Vec<String>,
    /// Serve https and wss by this certificate, a PEM file that also holds the chain of those that vouch for it; a new one is taken up while
    /// serving
    #[arg(long, value_name = "FILE", requires = "tls_key")]
    pub tls_cert: Option<PathBuf>,
    /// The private key of --tls-cert, a PEM file
    #[arg(long, value_name = "FILE", requires = "tls_cert")]
    pub tls_key: Option<PathBuf>,
    /// Serve https and wss by a certificate that is made at start and that nobody vouches for; the log tells its fingerprint
    #[arg(long, conflicts_with_all = ["tls_cert", "tls_key"])]
    pub tls_self_signed: bool,
    /// Sessions at one time at most
    #[arg(long, default_value_t = 256)]
    pub max_clients: usize,
    /// Connections at one time at most of one address, or of one network of 64 bits of IPv6; 0 for as many as come. Loopback is not counted
    #[arg(long, value_name = "N", default_value_t = PeerLimits::default().connections)]
    pub max_per_address: usize,
    /// The address of a reverse proxy, which is believed to say in X-Forwarded-For whom it asks for; may be given several times
    #[arg(long, value_name = "ADDR")]
    pub trusted_proxy: Vec<IpAddr>,
    /// Folder of the built web client, in place of the one that is built into this program
    #[arg(long, value_name = "FOLDER")]
    pub web: Option<PathBuf>,
    /// A file of settings: TOML, whose keys are the names of these options. What the command line or the environment says is stronger
    #[arg(long = "config", value_name = "FILE", env = "VANTAGE_CONFIG")]
    pub config_file: Option<PathBuf>,
    /// Show all settings as such a file, with where each is from, and exit
    #[arg(long)]
    pub print_config: bool,
}

/// `--log-format`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum LogFormat {
    /// Lines for people.
    #[default]
    Text,
    /// An object a line, for machines.
    Json,
}

impl PortOptions {
    /// As plain values; `Err` names options that do not go together.
    pub fn config(&self) -> Result<Config, String> {
        let defaults = Config::default();
        if !self.bind.is_loopback() && self.token.is_none() {
            return Err(format!("--bind {} is reachable from other machines: give a --token", self.bind));
        }
        if self.token.as_deref() == Some("") {
            return Err("--token must not be empty".to_owned());
        }
        let mut limits = defaults.limits;
        limits.clients = self.max_clients;
        limits.peers.connections = self.max_per_address;
        Ok(Config {
            bind: self.bind,
            port: self.port,
            web: self.web.clone(),
            access: Access {
                token: self.token.clone(),
                origins: self.allow_origin.clone(),
                proxies: self.trusted_proxy.iter().map(IpAddr::to_canonical).collect(),
            },
            limits,
            ..defaults
        })
    }

    /// The certificate, read or made; `None` where none is asked for.
    pub fn tls(&self) -> Result<Option<Tls>, TlsError> {
        match (&self.tls_cert, &self.tls_key) {
            (Some(certificate), Some(key)) => Tls::of_files(certificate, key).map(Some),
            _ if self.tls_self_signed => Tls::self_signed(self.bind).map(Some),
            _ => Ok(None),
        }
    }
}

/// As browsers write it: no path after the host.
fn origin(text: &str) -> Result<String, String> {
    let authority =
        text.strip_prefix("https://").or_else(|| text.strip_prefix("http://")).map(|rest| rest.trim_end_matches('/'));
    match authority {
        Some(authority) if !authority.is_empty() && !authority.contains(['/', '*', ' ']) => {
            Ok(text.trim_end_matches('/').to_owned())
        }
        _ => Err("an origin is needed, as https://HOST or https://HOST:PORT".to_owned()),
    }
}
