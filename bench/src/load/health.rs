//! Where a server is, and what it says of itself.

use std::time::Duration;

use anyhow::Context;
use serde_json::Value;

/// The address of the websocket: `/ws` where no path is given.
pub(super) fn websocket_url(server: &str) -> String {
    let after_scheme = server.find("://").map_or(0, |at| at + 3);
    let (address, query) = match server.find('?') {
        Some(at) => server.split_at(at),
        None => (server, ""),
    };
    let bare = !address[after_scheme.min(address.len())..].trim_end_matches('/').contains('/');
    if bare { format!("{}/ws{query}", address.trim_end_matches('/')) } else { server.to_owned() }
}

/// A text without the values of tokens in it: what is written is passed on.
pub fn without_token(text: &str) -> String {
    const NAME: &str = "token=";
    let mut parts = text.split(NAME);
    let mut told = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let rest = part.trim_start_matches(|c: char| !matches!(c, '&' | '#' | '\'' | '"') && !c.is_whitespace());
        told += &format!("{NAME}...{rest}");
    }
    told
}

/// What the server says of itself; null where it does not.
pub(super) async fn health(server: &str) -> Value {
    tokio::time::timeout(Duration::from_secs(5), ask(server)).await.ok().and_then(Result::ok).unwrap_or_default()
}

/// One request over plain HTTP, which needs no client library. A server behind TLS is not asked.
async fn ask(server: &str) -> anyhow::Result<Value> {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    const MAX_ANSWER_BYTES: u64 = 64 * 1024;
    let address = server.strip_prefix("ws://").context("not plain")?;
    let authority = address.split(['/', '?']).next().unwrap_or(address);
    let target = if authority.contains(':') { authority.to_owned() } else { format!("{authority}:80") };
    let mut stream = tokio::net::TcpStream::connect(target).await?;
    let request = format!("GET /healthz HTTP/1.0\r\nHost: {authority}\r\n\r\n");
    stream.write_all(request.as_bytes()).await?;
    let mut answer = Vec::new();
    stream.take(MAX_ANSWER_BYTES).read_to_end(&mut answer).await?;
    let answer = String::from_utf8_lossy(&answer);
    let (_, body) = answer.split_once("\r\n\r\n").context("no body")?;
    Ok(serde_json::from_str(body)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_are_not_told() {
        assert_eq!(without_token("ws://host/ws?token=secret&a=1"), "ws://host/ws?token=...&a=1");
        assert_eq!(
            without_token("--server 'ws://host?token=se=cret' --clients 2"),
            "--server 'ws://host?token=...' --clients 2"
        );
        assert_eq!(without_token("ws://host?a=1&token="), "ws://host?a=1&token=...");
        assert_eq!(without_token("ws://host"), "ws://host");
    }

    #[test]
    fn the_websocket_is_found_at_its_usual_place() {
        assert_eq!(websocket_url("ws://127.0.0.1:8080"), "ws://127.0.0.1:8080/ws");
        assert_eq!(websocket_url("ws://host/"), "ws://host/ws");
        assert_eq!(websocket_url("ws://host?token=a"), "ws://host/ws?token=a");
        assert_eq!(websocket_url("ws://host/other?token=a"), "ws://host/other?token=a");
    }
}
