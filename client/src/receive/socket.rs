//! The native websocket: a task that moves messages between the socket and two bounded queues, and nothing else.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use futures_util::{SinkExt, StreamExt};
use network::{Link, Proxy};
use rustls::ClientConfig;
use tokio::runtime::{Handle, Runtime};
use tokio::sync::mpsc;
use tokio::task::AbortHandle;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::handshake::client::Request;
use tokio_tungstenite::tungstenite::http::header::{AUTHORIZATION, HeaderValue};
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{Connector, connect_async_tls_with_config};

use crate::receive::address;
use crate::receive::trust::{self, TrustError};
use crate::receive::viewer::SocketEvent;

/// Messages in either direction that wait at most. Fragments are 32 KiB, so 2 MiB; then the socket's own flow control holds.
const QUEUE_MESSAGES: usize = 64;

/// The thread that the sockets live on.
#[derive(Debug)]
pub struct Sockets {
    runtime: Option<Runtime>,
    tls: Option<Arc<ClientConfig>>,
}

impl Sockets {
    /// Starts the thread.
    pub fn new() -> std::io::Result<Sockets> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .thread_name("network")
            .enable_all()
            .build()?;
        Ok(Sockets { runtime: Some(runtime), tls: None })
    }

    /// Ready for the server of an address that [`address::websocket_url`] made: where that is over TLS, it is believed by
    /// [`trust::trust`] with the certificates of a `further` file.
    pub fn ready_for(mut self, url: &str, further: Option<&Path>) -> Result<Sockets, TrustError> {
        if address::is_over_tls(url) {
            self.tls = Some(trust::trust(further)?);
        }
        Ok(self)
    }

    /// Puts an emulated network before the server of an address that [`address::websocket_url`] made. None over TLS: a server's
    /// certificate is not of the proxy's address.
    pub fn start_proxy(&self, url: &str, link: Link) -> std::io::Result<Proxy> {
        if address::is_over_tls(url) {
            return Err(std::io::Error::other(format!(
                "{}: a network is emulated for ws:// only, not over TLS",
                address::shown(url)
            )));
        }
        let target = address::socket_addr(url)?;
        self.handle().block_on(Proxy::start(([127, 0, 0, 1], 0).into(), target, link))
    }

    fn handle(&self) -> &Handle {
        self.runtime.as_ref().expect("the runtime lives as long as this does").handle()
    }

    /// Opens a socket, over TLS where [`Sockets::ready_for`] made ready for that. Messages longer than `max_message_bytes` end it.
    /// `wake` is called whenever an event is there.
    pub fn open(&self, url: String, max_message_bytes: usize, wake: Arc<dyn Fn() + Send + Sync>) -> Socket {
        let (event_in, events) = mpsc::channel(QUEUE_MESSAGES);
        let (outgoing, outgoing_out) = mpsc::channel(QUEUE_MESSAGES);
        let connector = self.tls.clone().map_or(Connector::Plain, Connector::Rustls);
        let task = async move {
            let closed = run(&url, connector, max_message_bytes, &event_in, outgoing_out, &*wake).await;
            // The other end of the queue is gone only where nobody wants to know any more.
            let _ = event_in.send(SocketEvent::Closed(closed)).await;
            wake();
        };
        Socket { events, outgoing, task: self.handle().spawn(task).abort_handle(), handle: self.handle().clone() }
    }
}

impl Drop for Sockets {
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}

/// A socket that is opening, open or closed. Dropping it closes it.
#[derive(Debug)]
pub struct Socket {
    events: mpsc::Receiver<SocketEvent>,
    outgoing: mpsc::Sender<Vec<u8>>,
    task: AbortHandle,
    handle: Handle,
}

impl Socket {
    /// The next event, where one is there.
    pub fn try_event(&mut self) -> Option<SocketEvent> {
        self.events.try_recv().ok()
    }

    /// The next event, waiting for it at most this long.
    pub fn event_within(&mut self, wait: Duration) -> Option<SocketEvent> {
        let events = &mut self.events;
        self.handle.block_on(async { tokio::time::timeout(wait, events.recv()).await.ok().flatten() })
    }

    /// Queues a message. What a client says is small and rare: where the queue is full the socket has long stalled, and the
    /// session's own silence timeout ends it.
    pub fn send(&self, bytes: Vec<u8>) {
        if self.outgoing.try_send(bytes).is_err() {
            tracing::debug!("a message was dropped: the socket takes nothing");
        }
    }
}

impl Drop for Socket {
    fn drop(&mut self) {
        self.task.abort();
    }
}

/// Runs a socket to its end; returns what is to be said about it.
async fn run(
    url: &str,
    connector: Connector,
    max_message_bytes: usize,
    events: &mpsc::Sender<SocketEvent>,
    mut outgoing: mpsc::Receiver<Vec<u8>>,
    wake: &(dyn Fn() + Send + Sync),
) -> String {
    let config =
        WebSocketConfig::default().max_message_size(Some(max_message_bytes)).max_frame_size(Some(max_message_bytes));
    let request = match request(url) {
        Ok(request) => request,
        Err(error) => return words(&error),
    };
    let (socket, _) = match connect_async_tls_with_config(request, Some(config), true, Some(connector)).await {
        Ok(opened) => opened,
        Err(error) => return words(&error),
    };
    if events.send(SocketEvent::Opened).await.is_err() {
        return String::new();
    }
    wake();
    let (mut sink, mut stream) = socket.split();
    loop {
        tokio::select! {
            received = stream.next() => match received {
                None => return String::new(),
                Some(Err(error)) => return words(&error),
                Some(Ok(Message::Binary(bytes))) => {
                    if events.send(SocketEvent::Message(bytes.into())).await.is_err() {
                        return String::new();
                    }
                    wake();
                }
                Some(Ok(Message::Close(frame))) => {
                    return frame.map_or_else(String::new, |frame| frame.reason.to_string());
                }
                Some(Ok(_)) => {}
            },
            queued = outgoing.recv() => match queued {
                None => {
                    // A courtesy: the other end sees the connection end either way.
                    let _ = sink.close().await;
                    return String::new();
                }
                Some(bytes) => if let Err(error) = sink.send(Message::Binary(bytes.into())).await {
                    return words(&error);
                },
            },
        }
    }
}

/// What asks for the socket. A token goes in a header of its own: addresses are written down on the way.
fn request(url: &str) -> Result<Request, Error> {
    let (url, token) = address::without_token(url);
    let mut request = url.into_client_request()?;
    if let Some(token) = token {
        let mut bearer = HeaderValue::from_bytes(format!("Bearer {token}").as_bytes())
            .map_err(|error| Error::HttpFormat(error.into()))?;
        bearer.set_sensitive(true);
        request.headers_mut().insert(AUTHORIZATION, bearer);
    }
    Ok(request)
}

/// An error for a person; an end without a goodbye is said as nothing.
fn words(error: &Error) -> String {
    match error {
        Error::ConnectionClosed | Error::AlreadyClosed => String::new(),
        Error::Protocol(_) => String::new(),
        Error::Http(response) => {
            let body = response.body().as_deref().map(String::from_utf8_lossy).unwrap_or_default();
            format!("the server answers {}: {}", response.status(), body.trim().chars().take(200).collect::<String>())
        }
        Error::Io(error) => match error.get_ref().and_then(|inner| inner.downcast_ref()) {
            Some(handshake) => trust::words(handshake),
            None => error.to_string(),
        },
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_goes_in_a_header_alone() {
        let request = request("ws://host/ws?token=a%2Fb").expect("a request");
        assert_eq!(request.uri().to_string(), "ws://host/ws");
        assert_eq!(request.headers()[AUTHORIZATION], "Bearer a/b");
        assert!(!format!("{request:?}").contains("a/b"));
    }

    #[test]
    fn no_network_is_emulated_over_tls() {
        let sockets = Sockets::new().expect("a thread");
        let said = sockets.start_proxy("wss://127.0.0.1:1/ws", Link::default()).err().map(|error| error.to_string());
        assert!(said.as_ref().is_some_and(|said| said.contains("ws:// only")), "{said:?}");
        assert!(sockets.start_proxy("ws://127.0.0.1:1/ws", Link::default()).is_ok());
    }
}
