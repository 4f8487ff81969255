//! What one server puts up with: sessions, connections, and times.

use std::time::Duration;

/// What one server puts up with.
#[derive(Debug, Clone, Copy)]
pub struct ServerLimits {
    /// Sessions at one time; more are told to come again.
    pub clients: usize,
    /// What a session's copy may be large for at most, in bytes at the client, whatever the client names: the server keeps
    /// and draws one as large.
    pub budget_bytes: u64,
    /// A connected client must say hello within this time.
    pub hello: Duration,
    /// A message must leave for the client, and what was sent must be acknowledged, within this time.
    pub stall: Duration,
    /// A client must be heard within this time; it sends a ping every few seconds.
    pub silence: Duration,
    /// What is kept of sessions that were cut off, for clients that come back.
    pub resume: ResumeLimits,
    /// What is loaded as it is asked for.
    pub scenes: SceneLimits,
    /// What people may bring.
    pub uploads: UploadLimits,
    /// Connections at one time at most that have not said who they are, or are told why they may not stay.
    pub doorsteps: usize,
    /// What all peers of one address may take together.
    pub peers: PeerLimits,
}

/// What scenes of a folder may take that are loaded as they are asked for.
#[derive(Debug, Clone, Copy)]
pub struct SceneLimits {
    /// Open at one time.
    pub open: usize,
    /// Of all open scenes' meshes and images, the first scene's with them, in bytes. The GPU has its own copy beside that.
    pub bytes: u64,
    /// One that nobody has wanted for so long is put away.
    pub idle: Duration,
}

/// What people may bring to be shown, where they may.
#[derive(Debug, Clone, Copy)]
pub struct UploadLimits {
    /// Of what one brings at once, unpacked, in bytes.
    pub bytes: u64,
    /// Of all that is kept and all that is being brought, in bytes.
    pub all_bytes: u64,
    /// Files of what one brings at once.
    pub files: usize,
    /// How many may bring something at one time.
    pub at_once: usize,
    /// Between two pieces of it.
    pub pause: Duration,
    /// From the first piece to the last.
    pub time: Duration,
}

/// What all peers of one address may take together; of IPv6, those of one network of 64 bits.
#[derive(Debug, Clone, Copy)]
pub struct PeerLimits {
    /// Connections at one time; 0 for as many as come, and no other limit of an address.
    pub connections: usize,
    /// Of these, those that have not said who they are.
    pub doorsteps: usize,
    /// Handshakes a second, on average: of TLS, and of websockets.
    pub handshakes_per_s: f64,
    /// Handshakes at once.
    pub handshake_burst: f64,
    /// Whether programs of this machine are counted too.
    pub loopback: bool,
}

/// What a server keeps of sessions that were cut off.
#[derive(Debug, Clone, Copy)]
pub struct ResumeLimits {
    /// Each for so long.
    pub time: Duration,
    /// All together at most, as what their copies are for the server.
    pub bytes: u64,
}

impl Default for ServerLimits {
    fn default() -> Self {
        ServerLimits {
            clients: 256,
            budget_bytes: protocol::session::DEFAULT_BUDGET_BYTES,
            hello: Duration::from_secs(10),
            stall: Duration::from_secs(30),
            silence: Duration::from_secs(60),
            resume: ResumeLimits { time: Duration::from_secs(120), bytes: 1 << 30 },
            scenes: SceneLimits::default(),
            uploads: UploadLimits::default(),
            doorsteps: 1024,
            peers: PeerLimits::default(),
        }
    }
}

impl Default for SceneLimits {
    fn default() -> Self {
        SceneLimits { open: 8, bytes: 4 << 30, idle: Duration::from_secs(300) }
    }
}

impl Default for UploadLimits {
    fn default() -> Self {
        // A scan or a building with its images; over 2 Mbit/s, which takes 18 minutes.
        UploadLimits {
            bytes: 256 << 20,
            all_bytes: 2 << 30,
            files: 4096,
            at_once: 4,
            pause: Duration::from_secs(20),
            time: Duration::from_secs(1800),
        }
    }
}

impl Default for PeerLimits {
    fn default() -> Self {
        // A floor of people behind one address, each with a page that is loaded over a few connections and one session.
        PeerLimits { connections: 64, doorsteps: 32, handshakes_per_s: 16.0, handshake_burst: 128.0, loopback: false }
    }
}
