//! The loop between a native socket and a [`Viewer`].

use std::sync::Arc;
use std::time::{Duration, Instant};

use protocol::Limits;

use crate::receive::socket::{Socket, Sockets};
use crate::receive::traffic::Traffic;
use crate::receive::viewer::{SocketCommand, SocketEvent, Viewer};

/// Room for a frame's own header beside the largest message.
const MESSAGE_SLACK_BYTES: usize = 1024;

/// The largest message that a client takes off a socket.
pub fn max_message_bytes() -> usize {
    Limits::default().server_message_bytes + MESSAGE_SLACK_BYTES
}

/// A socket that opens and closes as its viewer says.
pub struct Pump<'a> {
    sockets: &'a Sockets,
    url: String,
    socket: Option<Socket>,
    traffic: Traffic,
    begin: Instant,
    wake: Arc<dyn Fn() + Send + Sync>,
}

impl<'a> Pump<'a> {
    /// Not connected yet. `wake` is called whenever something came.
    pub fn new(sockets: &'a Sockets, url: &str, wake: Arc<dyn Fn() + Send + Sync>) -> Pump<'a> {
        Pump { sockets, url: url.to_owned(), socket: None, traffic: Traffic::default(), begin: Instant::now(), wake }
    }

    /// Real seconds since the start.
    pub fn now_s(&self) -> f64 {
        self.begin.elapsed().as_secs_f64()
    }

    /// What has crossed the socket so far.
    pub fn traffic(&self) -> &Traffic {
        &self.traffic
    }

    /// Takes in what is there and sends what is to be sent.
    pub fn turn(&mut self, viewer: &mut Viewer) {
        while let Some(event) = self.socket.as_mut().and_then(Socket::try_event) {
            self.handle(viewer, event);
        }
        self.send(viewer);
    }

    /// As [`Pump::turn`] until `until_s`.
    pub fn turn_until(&mut self, viewer: &mut Viewer, until_s: f64) {
        loop {
            self.turn(viewer);
            let left_s = until_s - self.now_s();
            if left_s <= 0.0 {
                return;
            }
            // Deadlines of the session and of the connection are coarse; this looks at them often enough.
            let wait = Duration::from_secs_f64(left_s.min(0.05));
            match &mut self.socket {
                Some(socket) => {
                    if let Some(event) = socket.event_within(wait) {
                        self.handle(viewer, event);
                    }
                }
                None => std::thread::sleep(wait),
            }
        }
    }

    /// The next event, waiting for it.
    pub fn event_within(&mut self, wait_s: f64) -> Option<SocketEvent> {
        let event = self.socket.as_mut()?.event_within(Duration::from_secs_f64(wait_s))?;
        self.count(&event);
        Some(event)
    }

    fn count(&mut self, event: &SocketEvent) {
        if let SocketEvent::Message(bytes) = event {
            self.traffic.receive(bytes);
        }
    }

    fn handle(&mut self, viewer: &mut Viewer, event: SocketEvent) {
        self.count(&event);
        if matches!(event, SocketEvent::Closed(_)) {
            self.socket = None;
        }
        viewer.handle(event, self.now_s());
    }

    fn send(&mut self, viewer: &mut Viewer) {
        while let Some(command) = viewer.poll_socket(self.now_s()) {
            self.obey(command);
        }
    }

    /// Does what a viewer asks for.
    pub fn obey(&mut self, command: SocketCommand) {
        match command {
            SocketCommand::Open => {
                self.socket = Some(self.sockets.open(self.url.clone(), max_message_bytes(), Arc::clone(&self.wake)));
            }
            SocketCommand::Close => self.socket = None,
            SocketCommand::Send(bytes) => {
                if let Some(socket) = &self.socket {
                    self.traffic.send(&bytes);
                    socket.send(bytes);
                }
            }
        }
    }
}
