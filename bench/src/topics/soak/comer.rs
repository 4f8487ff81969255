//! A client that comes, is cut off, goes on with what it holds, and leaves, over and over.

use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use camera::Motion;
use futures_util::{SinkExt, StreamExt};
use protocol::Held;
use protocol::limits::Limits;
use protocol::message::{Clock, Resume, ViewSize};
use protocol::session::{ClientConfig, ClientEvent, ClientSession};
use protocol::wire::decode_update;
use tokio_tungstenite::connect_async;
use tokio_tungstenite::tungstenite::Message;

use crate::load::Path;

const VIEW: ViewSize = ViewSize { width_px: 320, height_px: 180, fov_y_rad: 1.0 };
/// Each part of a visit, before and after it is cut off.
const STAYS: Duration = Duration::from_secs(15);
/// Between the parts.
const AWAY: Duration = Duration::from_secs(2);
const POSE_EVERY: Duration = Duration::from_millis(50);

/// What came of it.
#[derive(Debug, Default)]
pub(super) struct Comings {
    pub updates: u64,
    /// Visits that went on with an earlier one.
    pub resumed: u64,
    /// Visits that ended as they should.
    pub left: u64,
    pub errors: u64,
}

impl Comings {
    pub fn add(&mut self, other: Comings) {
        self.updates += other.updates;
        self.resumed += other.resumed;
        self.left += other.left;
        self.errors += other.errors;
    }
}

/// Goes on until a moment; `index` says where it walks.
pub(super) async fn comes_and_goes(url: String, index: usize, until: Instant) -> Comings {
    let mut all = Comings::default();
    while Instant::now() < until {
        let mut visitor = Visitor { url: &url, index, until, held: Held::default(), resume: None, all: &mut all };
        if let Err(error) = visitor.twice().await {
            tracing::warn!("a visit failed: {error:#}");
            all.errors += 1;
            tokio::time::sleep(AWAY).await;
        }
    }
    all
}

struct Visitor<'a> {
    url: &'a str,
    index: usize,
    until: Instant,
    held: Held,
    resume: Option<Resume>,
    all: &'a mut Comings,
}

impl Visitor<'_> {
    /// A visit that is cut off, and its second part.
    async fn twice(&mut self) -> anyhow::Result<()> {
        self.visit(false).await?;
        tokio::time::sleep(AWAY).await;
        if Instant::now() < self.until {
            self.visit(true).await?;
        }
        self.all.left += 1;
        Ok(())
    }

    async fn visit(&mut self, says_goodbye: bool) -> anyhow::Result<()> {
        let (mut socket, _) = connect_async(self.url).await.context("cannot connect")?;
        let config = ClientConfig { resume: self.resume.take(), ..ClientConfig::new(Clock::Wall, VIEW) };
        let begun = Instant::now();
        let now_s = || begun.elapsed().as_secs_f64();
        let mut session = ClientSession::new(config, 0.0);
        let (mut path, mut secret) = (None, 0);
        let mut poses = tokio::time::interval(POSE_EVERY);
        while begun.elapsed() < STAYS && Instant::now() < self.until {
            while let Some(bytes) = session.poll_transmit() {
                socket.send(Message::Binary(bytes.into())).await.context("the connection broke")?;
            }
            tokio::select! {
                message = socket.next() => match message {
                    Some(Ok(Message::Binary(bytes))) => session.handle(&bytes, now_s())?,
                    Some(Ok(Message::Close(_))) | None => bail!("the server closed the connection"),
                    Some(Ok(_)) => {}
                    Some(Err(error)) => return Err(error).context("the connection broke"),
                },
                _ = poses.tick() => if let Some(path) = &path {
                    let path: &Path = path;
                    session.set_pose(path.at(now_s()), Motion::along(path.velocity_world(now_s())), now_s());
                },
            }
            session.handle_timeout(now_s())?;
            while let Some(event) = session.poll_event() {
                match event {
                    ClientEvent::Welcome(welcome) => {
                        self.all.resumed += u64::from(welcome.resumed);
                        if !welcome.resumed {
                            self.held = Held::default();
                        }
                        secret = welcome.secret;
                        path = Some(Path::made(&welcome, self.index));
                    }
                    ClientEvent::Update(received) => {
                        self.held.apply(&decode_update(&received.bytes, &Limits::default())?)?;
                        session.applied(received.head.number, self.held.digest(), now_s());
                        self.all.updates += 1;
                    }
                    ClientEvent::Presenter(..)
                    | ClientEvent::Inventory(_)
                    | ClientEvent::Name { .. }
                    | ClientEvent::Advanced { .. } => {}
                }
            }
        }
        self.resume = Some(Resume { secret, number: self.held.number, digest: self.held.digest() });
        if says_goodbye {
            drop(tokio::time::timeout(Duration::from_secs(1), socket.close(None)).await);
        }
        Ok(())
    }
}
