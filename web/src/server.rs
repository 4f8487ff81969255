//! Which server the page talks to, and by which token.
//!
//! A token comes in the page's address, after `#token=` (which no browser sends anywhere) or `?token=`. It is taken out of the address at once, so that no
//! history, no bookmark and no picture of the screen has it, and is kept for this tab alone, so that a reload works.

use client::receive::address::{SCENE_KEYS, with_value, without_token};
use protocol::message::{SUBPROTOCOL, TOKEN_SUBPROTOCOL};
use wasm_bindgen::JsCast;
use wasm_bindgen::prelude::*;
use web_sys::{Location, UrlSearchParams};

/// Where the tab keeps its token for a server, whose address follows.
const TOKEN_KEY: &str = "vantage-token ";

/// A server's websocket.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Address {
    /// Without a token.
    pub url: String,
    token: Option<String>,
}

impl Address {
    /// For a person: the host and the path.
    pub fn shown(&self) -> String {
        let (address, _) = self.url.split_once('?').unwrap_or((&self.url, ""));
        address.split_once("://").map_or(address, |(_, rest)| rest).trim_end_matches("/ws").to_owned()
    }

    /// What the server must be told, where it was given.
    pub fn token(&self) -> Option<&str> {
        self.token.as_deref()
    }

    /// The websocket protocols to offer: one of them is the token, in hexadecimal.
    pub fn protocols(&self) -> Vec<String> {
        let hex = |token: &String| token.bytes().map(|byte| format!("{byte:02x}")).collect::<String>();
        let token = self.token.as_ref().map(|token| TOKEN_SUBPROTOCOL.to_owned() + &hex(token));
        std::iter::once(SUBPROTOCOL.to_owned()).chain(token).collect()
    }
}

/// Of a page's address: the server that the page came from, wherever a proxy puts it, or the one that `?server=` names; and the one of its scenes that
/// `?scene=` names, with what is chosen within its file.
pub fn address(location: &Location, query: &UrlSearchParams) -> Result<Address, String> {
    let part = |part: Result<String, JsValue>| part.map_err(|_| "the page has no address".to_owned());
    let scheme = if part(location.protocol())? == "https:" { "wss" } else { "ws" };
    let url = match query.get("server") {
        Some(server) if server.contains("://") => server,
        Some(server) => format!("{scheme}://{server}/ws"),
        None => {
            let path = part(location.pathname())?;
            let folder = path.rsplit_once('/').map_or("", |(folder, _)| folder);
            format!("{scheme}://{}{folder}/ws", part(location.host())?)
        }
    };
    let (url, in_url) = without_token(&url);
    let token = token(location, query, &url).or(in_url);
    let asked = SCENE_KEYS.into_iter().filter_map(|key| Some((key, query.get(key)?)));
    let url = asked.fold(url, |url, (key, value)| with_value(&url, key, &value));
    Ok(Address { url, token })
}

/// The token for a server that the page was opened with, now or before. Another server is never told it.
fn token(location: &Location, query: &UrlSearchParams, url: &str) -> Option<String> {
    let window = web_sys::window()?;
    let in_hash =
        location.hash().ok().and_then(|hash| UrlSearchParams::new_with_str(hash.trim_start_matches('#')).ok());
    let given = in_hash.as_ref().and_then(|hash| hash.get("token")).or_else(|| query.get("token"));
    // Pages may be denied any store of their own.
    let store = window.session_storage().ok().flatten();
    let key = TOKEN_KEY.to_owned() + url;
    let Some(given) = given else { return store?.get_item(&key).ok().flatten() };
    if let Some(store) = store {
        drop(store.set_item(&key, &given));
    }
    query.delete("token");
    if let Some(hash) = &in_hash {
        hash.delete("token");
    }
    let marked = |mark: &str, params: String| if params.is_empty() { params } else { mark.to_owned() + &params };
    let rest = in_hash.map_or_else(String::new, |hash| marked("#", String::from(hash.to_string())));
    let path = location.pathname().unwrap_or_default();
    let clean = path + &marked("?", String::from(query.to_string())) + &rest;
    if let Ok(history) = window.history() {
        drop(history.replace_state_with_url(&JsValue::NULL, "", Some(&clean)));
    }
    Some(given)
}

/// Who puts a token into the address of a page that is open means it for now: another part after the `#` would load nothing anew.
pub fn reload_for_tokens() {
    let Some(window) = web_sys::window() else { return };
    let changed = Closure::<dyn FnMut()>::new(|| {
        let location = web_sys::window().map(|window| window.location());
        if let Some(location) = location.filter(|location| location.hash().is_ok_and(|hash| hash.contains("token="))) {
            drop(location.reload());
        }
    });
    window.set_onhashchange(Some(changed.as_ref().unchecked_ref()));
    // The window outlives it.
    changed.forget();
}
