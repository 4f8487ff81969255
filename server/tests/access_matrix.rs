//! Who is let in: every way to ask, over real sockets, beside a rule that was written without looking at the code.
//!
//! | axis | values |
//! |---|---|
//! | over | plain, TLS |
//! | server | without a token, with one; one foreign origin is allowed |
//! | asked at | loopback, the machine's own address, a name that somebody pointed here |
//! | token | none; right or wrong, by header, sub-protocol, address |
//! | origin | none, loopback, the server's own, allowed, foreign, `null` |
//! | for | `/`, `/healthz`, `/metrics`, `/offer`, `/plan`, `/scenes`, `/thumbnail`, `/ws` |
//!
//! And the token stands in no line of the log, no answer, and no header that sends a browser elsewhere.

mod log;
mod net;
mod raw;

use std::net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::Arc;
use std::time::Duration;

use log::LOG;
use net::{config, room, start};
use rustls::crypto::ring::default_provider;
use rustls::pki_types::{CertificateDer, ServerName};
use rustls::{ClientConfig, RootCertStore};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio_rustls::TlsConnector;
use vantage_server::access::Access;
use vantage_server::tls::Tls;
use vantage_server::{Config, Running};

const TOKEN: &str = "correct-horse-battery-staple";
const WRONG: &str = "wrong-horse-battery-staple";
const ALLOWED: &str = "https://allowed.example";
const FOREIGN_NAME: &str = "rebound.example";
const PATHS: [&str; 8] = ["/", "/healthz", "/metrics", "/offer", "/plan", "/scenes", "/thumbnail", "/ws"];
/// Requests at one time.
const AT_ONCE: usize = 64;

#[derive(Debug, Clone, Copy, PartialEq)]
enum At {
    Loopback,
    Own,
    /// A name of somebody else that leads to this machine.
    Rebound,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Given {
    None,
    Header(bool),
    Protocol(bool),
    Address(bool),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Origin {
    None,
    Loopback,
    Own,
    Allowed,
    Foreign,
    Null,
}

#[derive(Debug, Clone, Copy)]
struct Case {
    is_over_tls: bool,
    needs_token: bool,
    at: At,
    given: Given,
    origin: Origin,
    path: &'static str,
}

/// The rule. Files and whether a server is well are for everybody. All else is for who knows the token, where there is one; for no page of another site, unless it is allowed. Without a
/// token there is no telling a page of the server's own from one of a name that was pointed here: then only loopback is trusted.
fn is_let_in(case: &Case) -> bool {
    if matches!(case.path, "/" | "/healthz") {
        return true;
    }
    let knows = matches!(case.given, Given::Header(true) | Given::Protocol(true) | Given::Address(true));
    let page = match case.origin {
        Origin::None | Origin::Loopback | Origin::Allowed => true,
        // Of a page that was read at loopback, its own origin is loopback.
        Origin::Own => case.needs_token || case.at == At::Loopback,
        Origin::Foreign | Origin::Null => false,
    };
    let reads_here = case.path == "/ws" || case.needs_token || case.at == At::Loopback;
    (knows || !case.needs_token) && page && reads_here
}

fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    let given = [false, true]
        .into_iter()
        .flat_map(|is_right| [Given::Header(is_right), Given::Protocol(is_right), Given::Address(is_right)]);
    let given: Vec<Given> = std::iter::once(Given::None).chain(given).collect();
    for is_over_tls in [false, true] {
        for needs_token in [false, true] {
            for at in [At::Loopback, At::Own, At::Rebound] {
                for &given in &given {
                    for origin in
                        [Origin::None, Origin::Loopback, Origin::Own, Origin::Allowed, Origin::Foreign, Origin::Null]
                    {
                        cases.extend(PATHS.map(|path| Case { is_over_tls, needs_token, at, given, origin, path }));
                    }
                }
            }
        }
    }
    cases
}

/// A server, where it is asked, and who trusts it.
struct Asked {
    running: Running,
    own: IpAddr,
    trusting: Option<TlsConnector>,
}

/// The address by which this machine would leave it, or loopback where it has none.
fn own_address() -> IpAddr {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).expect("a socket");
    let found = socket.connect("192.0.2.1:9").and_then(|()| socket.local_addr());
    found.map_or(Ipv4Addr::LOCALHOST.into(), |addr| addr.ip())
}

async fn served(is_over_tls: bool, needs_token: bool, own: IpAddr) -> Asked {
    let token = needs_token.then(|| TOKEN.to_owned());
    let access = Access { token, origins: vec![ALLOWED.to_owned()], ..Access::default() };
    let tls = is_over_tls.then(|| Tls::self_signed(own).expect("a certificate"));
    let trusting = tls.as_ref().map(|tls| {
        let mut roots = RootCertStore::empty();
        roots.add(CertificateDer::from(tls.certificate_der().to_vec())).expect("a certificate");
        let config = ClientConfig::builder_with_provider(Arc::new(default_provider()));
        let config = config.with_safe_default_protocol_versions().expect("the versions");
        TlsConnector::from(Arc::new(config.with_root_certificates(roots).with_no_client_auth()))
    });
    let mut limits = config().limits;
    limits.peers.connections = 0;
    let config = Config { bind: Ipv4Addr::UNSPECIFIED.into(), access, tls, limits, ..config() };
    Asked { running: start(config, room(false), Duration::ZERO).await, own, trusting }
}

impl Asked {
    /// The request, and what came back.
    async fn ask(&self, case: Case) -> (String, Vec<u8>) {
        let port = self.running.addr.port();
        let ip = if case.at == At::Own { self.own } else { Ipv4Addr::LOCALHOST.into() };
        let host = if case.at == At::Rebound {
            format!("{FOREIGN_NAME}:{port}")
        } else {
            SocketAddr::new(ip, port).to_string()
        };
        let scheme = if case.is_over_tls { "https" } else { "http" };
        let origin = match case.origin {
            Origin::None => String::new(),
            Origin::Loopback => "Origin: http://localhost:1234\r\n".to_owned(),
            Origin::Own => format!("Origin: {scheme}://{host}\r\n"),
            Origin::Allowed => format!("Origin: {ALLOWED}\r\n"),
            Origin::Foreign => "Origin: https://evil.example\r\n".to_owned(),
            Origin::Null => "Origin: null\r\n".to_owned(),
        };
        let token = |is_right| if is_right { TOKEN } else { WRONG };
        let hex = |is_right| token(is_right).bytes().map(|byte| format!("{byte:02x}")).collect::<String>();
        let (query, given) = match case.given {
            Given::None => (String::new(), String::new()),
            Given::Header(is_right) => (String::new(), format!("Authorization: Bearer {}\r\n", token(is_right))),
            Given::Protocol(is_right) => {
                (String::new(), format!("Sec-WebSocket-Protocol: vantage, vantage.token.{}\r\n", hex(is_right)))
            }
            Given::Address(is_right) => (format!("?token={}", token(is_right)), String::new()),
        };
        let upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n";
        let kind =
            if case.path == "/ws" { format!("{upgrade}{}", raw::KEY) } else { "Connection: close\r\n".to_owned() };
        let request = format!("GET {}{query} HTTP/1.1\r\nHost: {host}\r\n{origin}{given}{kind}\r\n", case.path);
        let tcp = TcpStream::connect(SocketAddr::new(ip, port)).await.expect("connect");
        let heard = match &self.trusting {
            None => told(tcp, &request, case.path).await,
            Some(trusting) => {
                let name = ServerName::from(ip);
                told(trusting.connect(name, tcp).await.expect("a handshake"), &request, case.path).await
            }
        };
        (request, heard)
    }
}

/// What is answered: all of it, or of a websocket that stays open its head alone.
async fn told(mut stream: impl AsyncRead + AsyncWrite + Unpin, request: &str, path: &str) -> Vec<u8> {
    stream.write_all(request.as_bytes()).await.expect("write");
    // TLS keeps what the socket did not take at once, and many who ask share one task's turns at sockets.
    stream.flush().await.expect("write");
    let mut heard = Vec::new();
    let mut bytes = [0; 4096];
    // A server that lets somebody in waits for his hello for longer than this.
    let patience = if path == "/ws" { Duration::from_millis(1500) } else { raw::SOON };
    while let Ok(Ok(count @ 1..)) = tokio::time::timeout(patience, stream.read(&mut bytes)).await {
        heard.extend(&bytes[..count]);
    }
    heard
}

/// Whether somebody was let in, by what was heard.
fn was_let_in(path: &str, heard: &[u8]) -> bool {
    if path != "/ws" {
        // No thumbnail was made here, which only who is let in is told.
        return heard.starts_with(b"HTTP/1.1 200") || path == "/thumbnail" && heard.starts_with(b"HTTP/1.1 404");
    }
    assert!(
        heard.starts_with(b"HTTP/1.1 101"),
        "it is opened in any case, to say why: {}",
        String::from_utf8_lossy(heard)
    );
    let body = heard.windows(4).position(|window| window == b"\r\n\r\n").map_or(&[][..], |at| &heard[at + 4..]);
    raw::goodbye(body).is_none()
}

#[tokio::test(flavor = "multi_thread")]
async fn who_asks_in_any_way_gets_what_the_rule_says() {
    LOG.text();
    let own = own_address();
    if own.is_loopback() {
        println!("this machine has no other address than loopback: what is asked there is asked at loopback");
    }
    let hex: String = TOKEN.bytes().map(|byte| format!("{byte:02x}")).collect();
    let (mut wrong, mut count) = (Vec::new(), 0);
    for (is_over_tls, needs_token) in [(false, false), (false, true), (true, false), (true, true)] {
        let asked = served(is_over_tls, needs_token, own).await;
        let of_this = |case: &Case| case.is_over_tls == is_over_tls && case.needs_token == needs_token;
        let cases: Vec<Case> =
            cases().into_iter().filter(of_this).filter(|case| case.at != At::Own || !own.is_loopback()).collect();
        for some in cases.chunks(AT_ONCE) {
            let all = futures_util::future::join_all(some.iter().map(|case| asked.ask(*case))).await;
            for (case, (request, heard)) in some.iter().zip(all) {
                count += 1;
                let text = String::from_utf8_lossy(&heard).to_lowercase();
                if was_let_in(case.path, &heard) != is_let_in(case) {
                    wrong.push(format!("{case:?}\n{request}{text}"));
                }
                assert!(!text.contains(TOKEN) && !text.contains(&hex), "the token comes back: {text}");
                assert!(!text.contains("\r\nlocation:") && text.contains("referrer-policy: no-referrer"), "{text}");
                assert!(
                    !text.contains("strict-transport-security"),
                    "nobody is bound to a certificate made at start: {text}"
                );
            }
        }
        asked.running.stop().await;
    }
    assert!(wrong.is_empty(), "{} of {count}:\n{}", wrong.len(), wrong[0]);
    assert!(count > 1500, "{count}");
    let log = LOG.text();
    assert!(log.contains("session ended") && log.contains("refused"), "there is a log");
    assert!(!log.contains(TOKEN) && !log.contains(&hex), "the token is in the log");
}
