//! The server over TLS: https and wss on its one port, and what goes wrong with certificates and with peers.

mod net;

use std::net::{IpAddr, Ipv4Addr};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use net::{Client, Socket, VIEW, config, room, start};
use protocol::message::Clock;
use protocol::session::ClientConfig;
use rustls::crypto::ring::default_provider;
use rustls::pki_types::{CertificateDer, ServerName};
use rustls::{ClientConfig as TlsClientConfig, RootCertStore};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio_rustls::TlsConnector;
use tokio_rustls::client::TlsStream;
use tokio_tungstenite::{Connector, connect_async_tls_with_config};
use vantage_server::tls::{Tls, TlsError};
use vantage_server::{Config, Running};

const LOCALHOST: IpAddr = IpAddr::V4(Ipv4Addr::LOCALHOST);
/// Far less than a handshake may take: nobody waits for another's.
const AT_ONCE: Duration = Duration::from_secs(5);
/// The server looks at its files every two seconds.
const RELOADED_WITHIN: Duration = Duration::from_secs(10);

/// A server with a certificate of its own, and who trusts just that.
async fn self_signed() -> (Running, Arc<TlsClientConfig>) {
    let tls = Tls::self_signed(LOCALHOST).expect("a certificate");
    let trusting = trusting(&[tls.certificate_der()]);
    (serving(tls).await, trusting)
}

async fn serving(tls: Tls) -> Running {
    start(Config { tls: Some(tls), ..config() }, room(false), Duration::ZERO).await
}

fn trusting(certificates: &[&[u8]]) -> Arc<TlsClientConfig> {
    let mut roots = RootCertStore::empty();
    for der in certificates {
        roots.add(CertificateDer::from(der.to_vec())).expect("a certificate");
    }
    let config = TlsClientConfig::builder_with_provider(Arc::new(default_provider()))
        .with_safe_default_protocol_versions()
        .expect("the versions")
        .with_root_certificates(roots)
        .with_no_client_auth();
    Arc::new(config)
}

async fn handshake(running: &Running, trusting: &Arc<TlsClientConfig>) -> std::io::Result<TlsStream<TcpStream>> {
    let tcp = TcpStream::connect(running.addr).await?;
    let name = ServerName::try_from("localhost").expect("a name");
    TlsConnector::from(trusting.clone()).connect(name, tcp).await
}

async fn websocket(running: &Running, trusting: &Arc<TlsClientConfig>) -> Socket {
    let url = format!("wss://{}/ws", running.addr);
    let connector = Some(Connector::Rustls(trusting.clone()));
    connect_async_tls_with_config(url, None, true, connector).await.expect("websocket").0
}

/// A session over TLS gets its welcome, and soon.
async fn welcomes(running: &Running, trusting: &Arc<TlsClientConfig>) {
    let socket = tokio::time::timeout(AT_ONCE, websocket(running, trusting)).await.expect("at once");
    let mut client = Client::over(socket, ClientConfig::new(Clock::Wall, VIEW));
    client.run(10.0, |client| client.welcome.is_some()).await.expect("a session");
    assert_eq!(client.welcome.expect("welcome").scene_name, "room");
}

/// What is answered over TLS.
async fn page(running: &Running, trusting: &Arc<TlsClientConfig>) -> String {
    let mut stream = handshake(running, trusting).await.expect("a handshake");
    stream.write_all(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").await.expect("write");
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).await.expect("the server says goodbye");
    String::from_utf8_lossy(&answer).into_owned()
}

#[tokio::test]
async fn one_port_serves_pages_and_sessions() {
    let (running, trusting) = self_signed().await;
    assert_eq!(running.url(), format!("https://{}", running.addr));
    let answer = page(&running, &trusting).await;
    assert!(answer.starts_with("HTTP/1.1 200") && answer.contains("\"scene\":\"room\""), "{answer}");
    welcomes(&running, &trusting).await;
    running.stop().await;
}

#[tokio::test]
async fn who_does_not_trust_the_certificate_is_not_connected() {
    let (running, _) = self_signed().await;
    let other = Tls::self_signed(LOCALHOST).expect("a certificate");
    let error = handshake(&running, &trusting(&[other.certificate_der()])).await.expect_err("another's certificate");
    assert!(error.to_string().contains("certificate"), "{error}");
    running.stop().await;
}

#[tokio::test]
async fn a_fingerprint_is_written_as_browsers_show_it() {
    let fingerprint = Tls::self_signed(LOCALHOST).expect("a certificate").fingerprint();
    let bytes: Vec<&str> = fingerprint.split(':').collect();
    assert_eq!(bytes.len(), 32, "{fingerprint}");
    assert!(bytes.iter().all(|byte| byte.len() == 2 && u8::from_str_radix(byte, 16).is_ok()), "{fingerprint}");
}

#[tokio::test]
async fn who_speaks_without_tls_is_hung_up_on() {
    let (running, trusting) = self_signed().await;
    let mut stream = TcpStream::connect(running.addr).await.expect("connect");
    stream.write_all(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n").await.expect("write");
    let mut answer = Vec::new();
    let ended = tokio::time::timeout(AT_ONCE, stream.read_to_end(&mut answer)).await;
    assert!(ended.is_ok() && !answer.starts_with(b"HTTP"), "{answer:?}");
    welcomes(&running, &trusting).await;
    running.stop().await;
}

#[tokio::test]
async fn who_says_nothing_holds_up_nobody() {
    let (running, trusting) = self_signed().await;
    let mut silent = Vec::new();
    for _ in 0..20 {
        silent.push(TcpStream::connect(running.addr).await.expect("connect"));
    }
    welcomes(&running, &trusting).await;
    // In the end the silent are hung up on.
    let mut byte = [0];
    let ended = tokio::time::timeout(Duration::from_secs(15), silent[0].read(&mut byte)).await.expect("given up");
    assert!(matches!(ended, Ok(0) | Err(_)), "{ended:?}");
    running.stop().await;
}

/// A folder for a certificate and its key.
struct Pem {
    folder: PathBuf,
}

impl Pem {
    fn new(name: &str) -> Pem {
        let folder = std::env::temp_dir().join(format!("vantage-tls-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("folder");
        Pem { folder }
    }

    fn certificate(&self) -> PathBuf {
        self.folder.join("certificate.pem")
    }

    fn key(&self) -> PathBuf {
        self.folder.join("key.pem")
    }

    fn tls(&self) -> Result<Tls, TlsError> {
        Tls::of_files(self.certificate(), self.key())
    }

    /// A certificate with its key; gives the certificate.
    fn write_both(&self) -> Vec<u8> {
        let made = rcgen::generate_simple_self_signed(["localhost".to_owned(), "127.0.0.1".to_owned()]).expect("made");
        std::fs::write(self.key(), made.signing_key.serialize_pem()).expect("key");
        std::fs::write(self.certificate(), made.cert.pem()).expect("certificate");
        made.cert.der().to_vec()
    }
}

impl Drop for Pem {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// Sound PEM of what is neither a certificate nor a key.
fn nonsense(kind: &str) -> String {
    format!("-----BEGIN {kind}-----\nAAAA\n-----END {kind}-----\n")
}

/// Whether new connections are served by this certificate before long.
async fn comes_to_show(running: &Running, certificate: &[u8]) -> bool {
    let trusting = trusting(&[certificate]);
    let begun = Instant::now();
    while begun.elapsed() < RELOADED_WITHIN {
        if handshake(running, &trusting).await.is_ok() {
            return true;
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    false
}

#[tokio::test]
async fn new_files_are_taken_up_and_broken_ones_survived() {
    let files = Pem::new("reload");
    let first = files.write_both();
    let running = serving(files.tls().expect("a certificate")).await;
    let socket = websocket(&running, &trusting(&[&first])).await;
    let page = page(&running, &trusting(&[&first])).await;
    assert!(page.contains("\r\nstrict-transport-security: max-age=31536000\r\n"), "{page}");
    let mut old = Client::over(socket, ClientConfig::new(Clock::Wall, VIEW));
    old.run(10.0, |client| client.welcome.is_some()).await.expect("a session");
    let second = files.write_both();
    assert!(comes_to_show(&running, &second).await, "the new certificate is shown");
    assert!(handshake(&running, &trusting(&[&first])).await.is_err(), "and not the old one");
    std::fs::write(files.certificate(), "nonsense").expect("file");
    tokio::time::sleep(Duration::from_secs(3)).await;
    welcomes(&running, &trusting(&[&second])).await;
    let third = files.write_both();
    assert!(comes_to_show(&running, &third).await, "what is whole again is taken up");
    let updates = old.updates.len();
    old.run(10.0, |client| client.updates.len() > updates).await.expect("the old session goes on");
    running.stop().await;
}

#[test]
fn what_is_wrong_with_files_is_said_with_their_names() {
    let (files, others) = (Pem::new("wrong"), Pem::new("others"));
    let said = |what: &str, file: &Path| {
        let error = files.tls().expect_err(what).to_string();
        assert!(error.contains(what) && error.contains(&*file.to_string_lossy()), "{what}: {error}");
    };
    said("cannot read", &files.certificate());
    files.write_both();
    others.write_both();
    assert!(files.tls().is_ok());
    std::fs::copy(others.key(), files.key()).expect("copy");
    said("does not belong to", &files.key());
    said("does not belong to", &files.certificate());
    std::fs::copy(files.certificate(), files.key()).expect("copy");
    said("no private key", &files.key());
    std::fs::write(files.key(), nonsense("PRIVATE KEY")).expect("file");
    said("cannot be used", &files.key());
    std::fs::remove_file(files.key()).expect("remove");
    said("cannot read", &files.key());
    std::fs::copy(others.key(), files.key()).expect("copy");
    std::fs::copy(others.key(), files.certificate()).expect("copy");
    said("no certificate", &files.certificate());
    std::fs::write(files.certificate(), nonsense("CERTIFICATE")).expect("file");
    said("cannot be used", &files.certificate());
    std::fs::write(files.certificate(), "-----BEGIN CERTIFICATE-----\nhalf").expect("file");
    said("not sound PEM", &files.certificate());
}
