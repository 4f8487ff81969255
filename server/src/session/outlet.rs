//! The writing half of a socket, as a task of its own: the session hears its client even while a write is stuck.

use std::fmt::Display;
use std::time::Duration;

use axum::extract::ws::Message;
use bytes::Bytes;
use futures_util::{Sink, SinkExt};
use tokio::sync::mpsc;
use tokio::task::JoinHandle;

/// Messages handed over and not yet being written. One: what is not handed over can still be replaced by something newer.
const QUEUE: usize = 1;

/// Why nothing more is written.
#[derive(Debug)]
pub enum WriteEnd {
    /// The socket took nothing for too long.
    TooSlow,
    /// The connection broke.
    Failed(String),
}

/// Where messages leave.
pub struct Outlet {
    queue: mpsc::Sender<Message>,
    task: JoinHandle<Result<(), WriteEnd>>,
}

impl Outlet {
    /// Starts the task; a message that does not leave within `patience` ends it.
    pub fn start<E: Display + 'static>(
        sink: impl Sink<Message, Error = E> + Unpin + Send + 'static,
        patience: Duration,
    ) -> Outlet {
        let (queue, messages) = mpsc::channel(QUEUE);
        Outlet { queue, task: tokio::spawn(write(sink, messages, patience)) }
    }

    /// Waits until a message can be handed over, and hands it over: `bytes` are taken only then.
    pub async fn send(&mut self, bytes: &mut Option<Bytes>) -> Result<(), WriteEnd> {
        if let Ok(place) = self.queue.reserve().await {
            if let Some(bytes) = bytes.take() {
                place.send(Message::Binary(bytes));
            }
            return Ok(());
        }
        Err(self.ended().await)
    }

    /// Waits until the task ends by itself, which it does only when writing failed.
    pub async fn ended(&mut self) -> WriteEnd {
        match (&mut self.task).await {
            Ok(Err(end)) => end,
            Ok(Ok(())) => WriteEnd::Failed("closed".to_owned()),
            Err(error) => WriteEnd::Failed(error.to_string()),
        }
    }

    /// Writes one last message if the socket takes it within `patience`, then closes.
    pub async fn close(mut self, last: Option<Bytes>, patience: Duration) {
        let goodbye = async {
            if let Some(bytes) = last {
                // Where this fails there is nobody to tell.
                drop(self.queue.send(Message::Binary(bytes)).await);
            }
            drop(self.queue);
            // Where writing failed it has ended, and been asked why.
            if !self.task.is_finished() {
                drop((&mut self.task).await);
            }
        };
        let written = tokio::time::timeout(patience, goodbye).await.is_ok();
        if written {
            // What came in and was not read makes the system reset the connection; let the goodbye arrive first.
            tokio::time::sleep(patience).await;
        }
        self.task.abort();
    }
}

async fn write<E: Display>(
    mut sink: impl Sink<Message, Error = E> + Unpin,
    mut messages: mpsc::Receiver<Message>,
    patience: Duration,
) -> Result<(), WriteEnd> {
    while let Some(message) = messages.recv().await {
        match tokio::time::timeout(patience, sink.send(message)).await {
            Ok(Ok(())) => {}
            Ok(Err(error)) => return Err(WriteEnd::Failed(error.to_string())),
            Err(_) => return Err(WriteEnd::TooSlow),
        }
    }
    // The other end may be gone already.
    drop(sink.close().await);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_connection_that_broke_is_closed_all_the_same() {
        let broken = futures_util::sink::unfold((), |(), _: Message| async { Err::<(), _>("broken") });
        let patience = Duration::from_millis(1);
        let mut outlet = Outlet::start(Box::pin(broken), patience);
        let mut ended = None;
        // The first ones wait in the queue.
        while ended.is_none() {
            ended = outlet.send(&mut Some(Bytes::from_static(b"hello"))).await.err();
        }
        assert!(matches!(&ended, Some(WriteEnd::Failed(why)) if why == "broken"), "{ended:?}");
        outlet.close(Some(Bytes::from_static(b"goodbye")), patience).await;
    }
}
