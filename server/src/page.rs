//! The web client: out of a folder, or as it was built into this program.
//!
//! What is built in is answered as it lies there: by Brotli or gzip where the client takes that and it was built in too, with a tag of its content, so that
//! a browser that has it already is told so in a few bytes. No file has a name of its content, so every use asks (`no-cache`).

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use axum::Router;
use axum::body::Bytes;
use axum::http::{HeaderMap, Method, StatusCode, Uri, header};
use axum::response::{Html, IntoResponse, Response};
use tower_http::compression::CompressionLayer;
use tower_http::services::ServeDir;

/// Files by their paths below the page's root.
type Files = &'static [(&'static str, &'static [u8])];

/// What was built in: nothing, unless `build.rs` was given a folder.
static BUILT_IN: Files = include!(concat!(env!("OUT_DIR"), "/page.rs"));
/// How a file may lie there beside itself, best first, as [`header::ACCEPT_ENCODING`] names it, and what its name then ends in.
const ENCODINGS: [(&str, &str); 2] = [("br", ".br"), ("gzip", ".gz")];

/// Whether a page was built in.
pub fn is_built_in() -> bool {
    !BUILT_IN.is_empty()
}

/// Answers with files of a folder; without one, with what was built in.
pub(crate) fn router<S: Clone + Send + Sync + 'static>(folder: Option<&Path>) -> Router<S> {
    match folder {
        None => built_in(BUILT_IN),
        Some(folder) => {
            let files = ServeDir::new(folder).precompressed_br().precompressed_gzip().fallback(missing(folder));
            Router::new().fallback_service(files).layer(CompressionLayer::new())
        }
    }
}

/// What is shown for a path without a file: how to build the client where it is not built, else nothing.
fn missing(folder: &Path) -> Router {
    let index = folder.join("index.html");
    Router::new().fallback(move |uri: Uri| async move { if index.is_file() { not_found() } else { not_built(&uri) } })
}

fn not_found() -> Response {
    (StatusCode::NOT_FOUND, "not found\n").into_response()
}

fn not_built(uri: &Uri) -> Response {
    if uri.path() == "/" { Html(NOT_BUILT).into_response() } else { not_found() }
}

const NOT_BUILT: &str = "<!doctype html><meta charset=\"utf-8\"><title>Vantage</title>\
    <h1>Vantage is running</h1>\
    <p>The web client is not built. <code>cargo xtask serve</code> builds it and starts the server, <code>cargo xtask package</code> puts it \
    into one; a server that runs already finds the client in the folder that <code>--web</code> names.</p>\
    <p>The native client works now: <code>vantage-view</code>.</p>\n";

/// A file that was built in.
struct BuiltIn {
    bytes: &'static [u8],
    /// Of its content, quoted.
    tag: String,
}

fn built_in<S: Clone + Send + Sync + 'static>(files: Files) -> Router<S> {
    let files = Arc::new(tagged(files));
    Router::new().fallback(move |method: Method, uri: Uri, headers: HeaderMap| async move {
        if files.is_empty() {
            not_built(&uri)
        } else if method == Method::GET || method == Method::HEAD {
            answer(&files, uri.path(), &headers)
        } else {
            (StatusCode::METHOD_NOT_ALLOWED, [(header::ALLOW, "GET, HEAD")]).into_response()
        }
    })
}

fn tagged(files: Files) -> BTreeMap<&'static str, BuiltIn> {
    let tagged = |&(path, bytes): &(&'static str, &'static [u8])| {
        let digest = ring::digest::digest(&ring::digest::SHA256, bytes);
        let tag = digest.as_ref().iter().take(8).map(|byte| format!("{byte:02x}")).collect::<String>();
        (path, BuiltIn { bytes, tag: format!("\"{tag}\"") })
    };
    files.iter().map(tagged).collect()
}

fn answer(files: &BTreeMap<&'static str, BuiltIn>, path: &str, headers: &HeaderMap) -> Response {
    let path = path.trim_start_matches('/');
    let name = if path.is_empty() { "index.html" } else { path };
    let Some(plain) = files.get(name) else { return not_found() };
    let encoded = ENCODINGS.iter().filter(|(encoding, _)| takes(headers, encoding)).find_map(|(encoding, end)| {
        let file = files.get(format!("{name}{end}").as_str())?;
        Some((file, *encoding))
    });
    let file = encoded.map_or(plain, |(file, _)| file);
    let has_it = headers.get(header::IF_NONE_MATCH).and_then(|tags| tags.to_str().ok()).is_some_and(|tags| {
        tags.split(',').map(str::trim).any(|tag| tag == "*" || tag.trim_start_matches("W/") == file.tag)
    });
    let mut response = if has_it {
        StatusCode::NOT_MODIFIED.into_response()
    } else {
        let kind = mime_guess::from_path(name).first_or_octet_stream();
        ([(header::CONTENT_TYPE, kind.as_ref())], Bytes::from_static(file.bytes)).into_response()
    };
    let about = response.headers_mut();
    about.insert(header::VARY, header::HeaderValue::from_static("accept-encoding"));
    about.extend(file.tag.parse().map(|tag| (header::ETAG, tag)));
    if let Some((_, encoding)) = encoded.filter(|_| !has_it) {
        about.insert(header::CONTENT_ENCODING, header::HeaderValue::from_static(encoding));
    }
    response
}

/// Whether a client takes an encoding: it names it, and not as its last resort of weight 0.
fn takes(headers: &HeaderMap, encoding: &str) -> bool {
    let named = headers.get_all(header::ACCEPT_ENCODING).into_iter().filter_map(|value| value.to_str().ok());
    named.flat_map(|value| value.split(',')).any(|one| {
        let mut parts = one.split(';').map(str::trim);
        let is_it = parts.next().is_some_and(|name| name.eq_ignore_ascii_case(encoding));
        let weight = parts.find_map(|part| part.strip_prefix("q=")).map_or(Ok(1.0), str::parse::<f32>);
        is_it && weight.is_ok_and(|weight| weight > 0.0)
    })
}

#[cfg(test)]
mod tests {
    use axum::body::to_bytes;
    use axum::http::HeaderValue;

    use super::*;

    const FILES: Files = &[
        ("index.html", b"<p>page"),
        ("vantage_web_bg.wasm", b"wasm"),
        ("vantage_web_bg.wasm.br", b"br"),
        ("vantage_web_bg.wasm.gz", b"gz"),
    ];

    /// Status, headers and body.
    async fn asked(path: &str, about: &[(header::HeaderName, &str)]) -> (StatusCode, HeaderMap, Vec<u8>) {
        let value = |value: &str| HeaderValue::from_str(value).expect("a value");
        let headers = about.iter().map(|(name, text)| (name.clone(), value(text))).collect();
        let (head, body) = answer(&tagged(FILES), path, &headers).into_parts();
        (head.status, head.headers, to_bytes(body, 1 << 20).await.expect("a body").to_vec())
    }

    #[tokio::test]
    async fn files_are_answered_as_the_client_takes_them() {
        for (takes, body, encoding) in [
            ("gzip, deflate, br", "br", Some("br")),
            ("gzip, deflate", "gz", Some("gzip")),
            ("br;q=0, gzip;q=0.5", "gz", Some("gzip")),
            ("identity", "wasm", None),
        ] {
            let (status, about, found) = asked("/vantage_web_bg.wasm", &[(header::ACCEPT_ENCODING, takes)]).await;
            assert_eq!((status, found.as_slice()), (StatusCode::OK, body.as_bytes()), "{takes}");
            assert_eq!(
                about.get(header::CONTENT_ENCODING).map(HeaderValue::as_bytes),
                encoding.map(str::as_bytes),
                "{takes}"
            );
            assert_eq!(about[header::CONTENT_TYPE], "application/wasm");
            assert_eq!(about[header::VARY], "accept-encoding");
        }
        let (status, about, found) = asked("/", &[]).await;
        assert_eq!((status, found.as_slice()), (StatusCode::OK, b"<p>page".as_slice()));
        assert_eq!(about[header::CONTENT_TYPE], "text/html");
        assert_eq!(asked("/../index.html", &[]).await.0, StatusCode::NOT_FOUND);
    }

    #[tokio::test]
    async fn who_has_it_already_is_told_so() {
        let (_, about, _) = asked("/", &[]).await;
        let about_tag = about[header::ETAG].clone();
        let tag = about_tag.to_str().expect("a tag");
        let (status, about, found) = asked("/", &[(header::IF_NONE_MATCH, tag)]).await;
        assert_eq!((status, found.len(), &about[header::ETAG]), (StatusCode::NOT_MODIFIED, 0, &about_tag));
        let (status, ..) = asked("/vantage_web_bg.wasm", &[(header::IF_NONE_MATCH, tag)]).await;
        assert_eq!(status, StatusCode::OK, "another file's tag");
    }

    #[tokio::test]
    async fn without_a_page_it_says_how_to_build_one() {
        let (head, body) = not_built(&Uri::from_static("/")).into_parts();
        let body = to_bytes(body, 1 << 20).await.expect("a body");
        assert!(head.status == StatusCode::OK && String::from_utf8_lossy(&body).contains("cargo xtask package"));
        assert_eq!(not_built(&Uri::from_static("/index.html")).status(), StatusCode::NOT_FOUND);
    }
}
