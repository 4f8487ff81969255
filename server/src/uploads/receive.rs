//! A request's body, as files: a line that lists them, then their bytes.

use std::sync::Arc;
use std::time::Duration;

use axum::body::{Body, BodyDataStream, Bytes};
use futures_util::StreamExt;
use tokio::fs::File;
use tokio::io::AsyncWriteExt;

use super::not_taken::NotTaken;
use super::{Bringing, Uploads, manifest};

/// Takes in what a person brings; the names of its scenes. Dropped, as where the person leaves, nothing of it stays.
pub(crate) async fn receive(uploads: &Arc<Uploads>, body: Body) -> Result<Vec<String>, NotTaken> {
    let mut coming = Coming { stream: body.into_data_stream(), rest: Bytes::new(), pause: uploads.limits.pause };
    let taken = take(uploads, &mut coming).await;
    if taken.is_err() {
        coming.let_go(uploads.limits.bytes).await;
    }
    taken
}

async fn take(uploads: &Arc<Uploads>, coming: &mut Coming) -> Result<Vec<String>, NotTaken> {
    let limits = uploads.limits;
    let files = manifest::read(&coming.line().await?, limits.files)?;
    let bytes = files.iter().fold(0, |sum: u64, file| sum.saturating_add(file.bytes));
    let bringing = uploads.begin(bytes)?;
    for file in files {
        let path = bringing.folder().join(file.path);
        if let Some(parent) = path.parent() {
            tokio::fs::create_dir_all(parent).await?;
        }
        coming.file(&mut File::create_new(path).await?, file.bytes).await?;
    }
    coming.ends().await?;
    settled(bringing).await
}

/// Unpacking may take its time.
async fn settled(bringing: Bringing) -> Result<Vec<String>, NotTaken> {
    let settled = tokio::task::spawn_blocking(move || bringing.settle());
    settled.await.map_err(|fault| NotTaken::Archive(fault.to_string()))?
}

/// What comes.
struct Coming {
    stream: BodyDataStream,
    /// Of the last piece, what is still to be looked at.
    rest: Bytes,
    /// Between two pieces at most.
    pause: Duration,
}

impl Coming {
    /// The next piece; `None` at the end.
    async fn piece(&mut self) -> Result<Option<Bytes>, NotTaken> {
        if !self.rest.is_empty() {
            return Ok(Some(std::mem::take(&mut self.rest)));
        }
        let next = tokio::time::timeout(self.pause, self.stream.next()).await;
        let piece = next.map_err(|_| NotTaken::Slow(self.pause.as_secs()))?.transpose();
        piece.map_err(|_| NotTaken::Length)
    }

    async fn line(&mut self) -> Result<Vec<u8>, NotTaken> {
        let mut line = Vec::new();
        while let Some(mut piece) = self.piece().await? {
            let end = piece.iter().position(|&byte| byte == b'\n');
            line.extend_from_slice(&piece.split_to(end.unwrap_or(piece.len())));
            if line.len() > manifest::MOST_BYTES {
                break;
            }
            if end.is_some() {
                self.rest = piece.split_off(1);
                return Ok(line);
            }
        }
        Err(NotTaken::Manifest(format!("there is none within {} KiB", manifest::MOST_BYTES >> 10)))
    }

    async fn file(&mut self, file: &mut File, bytes: u64) -> Result<(), NotTaken> {
        let mut left = bytes;
        while left > 0 {
            let mut piece = self.piece().await?.ok_or(NotTaken::Length)?;
            let some = piece.split_to(piece.len().min(usize::try_from(left).unwrap_or(usize::MAX)));
            file.write_all(&some).await?;
            left -= some.len() as u64;
            self.rest = piece;
        }
        Ok(file.flush().await?)
    }

    /// Lets go by what still comes, as far as one may send: a browser reads no answer before it has sent all.
    async fn let_go(&mut self, most_bytes: u64) {
        let mut gone = 0;
        while let Ok(Some(piece)) = self.piece().await {
            gone += piece.len() as u64;
            if gone > most_bytes {
                break;
            }
        }
    }

    async fn ends(&mut self) -> Result<(), NotTaken> {
        while let Some(piece) = self.piece().await? {
            if !piece.is_empty() {
                return Err(NotTaken::Length);
            }
        }
        Ok(())
    }
}
