//! A peer without a library: bytes of HTTP and of websockets (RFC 6455) as a test will have them.
#![allow(dead_code, reason = "each test file uses a part")]

use std::net::{Ipv4Addr, SocketAddr};
use std::time::Duration;

use protocol::limits::Limits;
use protocol::message::ServerMessage;
use protocol::wire::{ServerPacket, decode_server};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};

/// The server ends what it ends within this.
pub const SOON: Duration = Duration::from_secs(30);
pub const MASK: [u8; 4] = [0x12, 0x34, 0x56, 0x78];
pub const KEY: &str = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";

pub const CONTINUATION: u8 = 0;
pub const TEXT: u8 = 1;
pub const BINARY: u8 = 2;
pub const CLOSE: u8 = 8;
pub const PING: u8 = 9;
pub const PONG: u8 = 10;

/// How a frame differs from a sound one.
#[derive(Clone, Copy)]
pub struct Frame {
    pub is_last: bool,
    /// Of three bits.
    pub reserved: u8,
    pub is_masked: bool,
    /// What the head says of the length, where that is a lie.
    pub claims: Option<u64>,
}

pub const SOUND: Frame = Frame { is_last: true, reserved: 0, is_masked: true, claims: None };

impl Frame {
    pub fn bytes(self, opcode: u8, payload: &[u8]) -> Vec<u8> {
        let mut bytes = vec![u8::from(self.is_last) << 7 | self.reserved << 4 | opcode];
        let mask = u8::from(self.is_masked) << 7;
        match self.claims.unwrap_or(payload.len() as u64) {
            short @ 0..=125 => bytes.push(mask | short as u8),
            middle @ 126..=0xffff => {
                bytes.push(mask | 126);
                bytes.extend((middle as u16).to_be_bytes());
            }
            long => {
                bytes.push(mask | 127);
                bytes.extend(long.to_be_bytes());
            }
        }
        if self.is_masked {
            bytes.extend(MASK);
        }
        let masked = payload.iter().zip(MASK.iter().cycle()).map(|(byte, mask)| byte ^ mask);
        bytes.extend(masked.zip(payload).map(|(masked, byte)| if self.is_masked { masked } else { *byte }));
        bytes
    }
}

/// Connects from an address of this machine: all of 127/8 is.
pub async fn connect_from(from: [u8; 4], to: SocketAddr) -> std::io::Result<TcpStream> {
    let socket = TcpSocket::new_v4()?;
    socket.bind(SocketAddr::from((Ipv4Addr::from(from), 0)))?;
    socket.connect(to).await
}

/// Everything that comes until the other end closes; what it sent before a reset counts.
pub async fn read_all(stream: &mut TcpStream) -> Vec<u8> {
    let mut answer = Vec::new();
    let reading = async {
        let mut bytes = [0; 4096];
        while let Ok(count @ 1..) = stream.read(&mut bytes).await {
            answer.extend(&bytes[..count]);
        }
    };
    tokio::time::timeout(SOON, reading).await.expect("the server ends the connection");
    answer
}

/// What is answered to a request as it stands.
pub async fn answer(addr: SocketAddr, request: &[u8]) -> Vec<u8> {
    let mut stream = TcpStream::connect(addr).await.expect("connect");
    // It may have had enough before it has read all.
    drop(stream.write_all(request).await);
    read_all(&mut stream).await
}

/// A request for a websocket with further headers.
pub fn upgrade(addr: SocketAddr, headers: &str) -> String {
    format!(
        "GET /ws HTTP/1.1\r\nHost: {addr}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n{KEY}{headers}\r\n"
    )
}

/// A websocket that is open.
pub async fn open(addr: SocketAddr) -> TcpStream {
    open_over(TcpStream::connect(addr).await.expect("connect"), addr, "").await
}

/// The same over a connection that is there.
pub async fn open_over(mut stream: TcpStream, addr: SocketAddr, headers: &str) -> TcpStream {
    stream.write_all(upgrade(addr, headers).as_bytes()).await.expect("write");
    let mut head = Vec::new();
    while !head.ends_with(b"\r\n\r\n") {
        let byte = tokio::time::timeout(SOON, stream.read_u8()).await.expect("in time").expect("an answer");
        head.push(byte);
    }
    assert!(head.starts_with(b"HTTP/1.1 101"), "{}", String::from_utf8_lossy(&head));
    stream
}

/// What a server said over a websocket, all of it: payloads with their opcodes.
pub fn frames(mut bytes: &[u8]) -> Vec<(u8, Vec<u8>)> {
    let mut frames = Vec::new();
    while let [first, second, rest @ ..] = bytes {
        let (length, rest) = match second & 0x7f {
            126 if rest.len() >= 2 => (usize::from(u16::from_be_bytes([rest[0], rest[1]])), &rest[2..]),
            127 if rest.len() >= 8 => (u64::from_be_bytes(rest[..8].try_into().expect("eight")) as usize, &rest[8..]),
            short => (usize::from(short), rest),
        };
        frames.push((first & 0x0f, rest[..length.min(rest.len())].to_vec()));
        bytes = &rest[length.min(rest.len())..];
    }
    frames
}

/// The words of a goodbye among them.
pub fn goodbye(bytes: &[u8]) -> Option<String> {
    let binary = frames(bytes).into_iter().filter(|(opcode, _)| *opcode == BINARY);
    binary.filter_map(|(_, payload)| decode_server(&payload, &Limits::default()).ok()).find_map(|message| match message
        .message
    {
        ServerPacket::Control(ServerMessage::Goodbye { reason, .. }) => Some(reason),
        _ => None,
    })
}
