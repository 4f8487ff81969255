//! Why sessions end, and what is said about it.

use std::time::Duration;

use protocol::session::SessionError;

use super::kept::GiveWay;
use super::outlet::WriteEnd;
use crate::worker::NotServed;

/// Why all sessions of a scene end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Over {
    /// The server was asked to stop.
    Stops,
    /// Another scene is shown in its place.
    Replaced,
}

/// Why a session ended.
#[derive(Debug)]
pub(crate) enum End {
    /// The client closed the connection, and said that it will not come back.
    Left,
    /// The client closed the connection, and may come back.
    Closed,
    /// Another connection goes on with the session.
    Resumed(GiveWay),
    /// As many clients as are let in are here.
    Full {
        /// So many.
        clients: usize,
    },
    /// The connection broke: the client vanished, or the network did.
    Lost(String),
    /// The client broke the rules of websockets: a message of more than the allowed size, or no websocket message at all.
    Malformed(String),
    /// The client broke the rules of the protocol, or was silent or stuck for too long.
    Session(SessionError),
    /// The socket took nothing for too long.
    NotReading,
    /// What a presenter was sent cannot be passed on to this follower.
    CannotFollow(String),
    /// At a relay it can only follow, and it did not ask for that.
    OnlyRelayed {
        /// Who presents.
        presenters: Vec<String>,
    },
    /// The server is done with what was shown.
    Over(Over),
    /// There are no more images.
    NoWorker,
    /// A mistake in the program. What it is stands in the log, as it may tell of others.
    Fault,
}

impl End {
    /// For the client and the log; `None` where there is nobody to tell. `patience`: how long a client need not read.
    pub(crate) fn words(&self, patience: Duration) -> Option<String> {
        match self {
            End::Left | End::Closed | End::Resumed(_) => None,
            End::Full { clients } => Some(format!("{clients} clients are here already, and no more are let in")),
            End::Lost(error) => Some(format!("the connection failed: {error}")),
            End::Malformed(error) => Some(format!("malformed: {error}")),
            End::Session(error) => Some(error.to_string()),
            End::NotReading => Some(format!("nothing was read for {} s", patience.as_secs_f64())),
            End::CannotFollow(error) => Some(format!("what is presented cannot be sent: {error}")),
            End::OnlyRelayed { presenters } => Some(only_relayed(presenters)),
            End::Over(Over::Stops) => Some("the server stops".to_owned()),
            End::Over(Over::Replaced) => Some("the scene was loaded anew".to_owned()),
            End::NoWorker => Some("the server can make no more images".to_owned()),
            End::Fault => Some("a fault of the server ended this session".to_owned()),
        }
    }

    /// Whether it may be otherwise for a client that comes again just as it did.
    pub(crate) fn may_change(&self) -> bool {
        match self {
            End::Session(error) => error.may_come_again(),
            End::OnlyRelayed { .. } => false,
            _ => true,
        }
    }

    /// Whether the client may be one that was cut off.
    pub(crate) fn may_come_back(&self) -> bool {
        matches!(
            self,
            // Who came back to a full server holds what he held.
            End::Full { .. }
                | End::Closed
                | End::Lost(_)
                | End::NotReading
                | End::Session(SessionError::Silent { .. } | SessionError::Stalled { .. })
        )
    }

    pub(crate) fn of_socket_error(error: axum::Error) -> End {
        use tokio_tungstenite::tungstenite::Error;
        use tokio_tungstenite::tungstenite::error::ProtocolError::ResetWithoutClosingHandshake;
        let text = error.to_string();
        match error.into_inner().downcast_ref() {
            Some(Error::Protocol(ResetWithoutClosingHandshake) | Error::Io(_)) => End::Lost(text),
            Some(Error::ConnectionClosed | Error::AlreadyClosed) => End::Closed,
            Some(_) => End::Malformed(text),
            None => End::Lost(text),
        }
    }
}

/// What to do at a relay.
fn only_relayed(presenters: &[String]) -> String {
    let begin = "this is a relay, where one only follows";
    match presenters {
        [] => format!("{begin}, and nobody presents now"),
        [name] => format!("{begin}: add ?follow={name} to the page's address, or give the viewer --follow {name}"),
        names => format!("{begin}, by ?follow=NAME in the page's address or --follow NAME: {}", names.join(", ")),
    }
}

impl From<SessionError> for End {
    fn from(error: SessionError) -> End {
        End::Session(error)
    }
}

impl From<Over> for End {
    fn from(over: Over) -> End {
        End::Over(over)
    }
}

impl From<NotServed> for End {
    fn from(why: NotServed) -> End {
        match why {
            NotServed::Gone => End::NoWorker,
            NotServed::Fault(_) => End::Fault,
        }
    }
}

impl From<WriteEnd> for End {
    fn from(end: WriteEnd) -> End {
        match end {
            WriteEnd::TooSlow => End::NotReading,
            WriteEnd::Failed(error) => End::Lost(error),
        }
    }
}
