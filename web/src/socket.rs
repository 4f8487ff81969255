//! The browser's websocket.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use crate::server::Address;
use client::receive::viewer::SocketEvent;
use js_sys::{ArrayBuffer, Uint8Array};
use wasm_bindgen::JsCast;
use wasm_bindgen::prelude::*;
use web_sys::{BinaryType, CloseEvent, MessageEvent, WebSocket};

/// A socket that is opening, open or closed. Dropping it closes it, and nothing more is reported.
pub struct Socket {
    socket: WebSocket,
    events: Rc<RefCell<VecDeque<SocketEvent>>>,
    // They live as long as the socket may call them.
    _opened: Closure<dyn FnMut()>,
    _message: Closure<dyn FnMut(MessageEvent)>,
    _closed: Closure<dyn FnMut(CloseEvent)>,
}

impl Socket {
    /// Begins to open; an address that the browser refuses outright is an error.
    pub fn open(server: &Address) -> Result<Socket, String> {
        let protocols =
            server.protocols().iter().map(|protocol| JsValue::from_str(protocol)).collect::<js_sys::Array>();
        let opened = WebSocket::new_with_str_sequence(&server.url, &protocols);
        let socket = opened.map_err(|error| js_words(&error))?;
        socket.set_binary_type(BinaryType::Arraybuffer);
        let events = Rc::new(RefCell::new(VecDeque::new()));
        let opened = {
            let events = Rc::clone(&events);
            Closure::<dyn FnMut()>::new(move || events.borrow_mut().push_back(SocketEvent::Opened))
        };
        let message = {
            let events = Rc::clone(&events);
            Closure::<dyn FnMut(MessageEvent)>::new(move |event: MessageEvent| {
                // Text is not part of the protocol.
                if let Ok(buffer) = event.data().dyn_into::<ArrayBuffer>() {
                    events.borrow_mut().push_back(SocketEvent::Message(Uint8Array::new(&buffer).to_vec()));
                }
            })
        };
        let closed = {
            let events = Rc::clone(&events);
            Closure::<dyn FnMut(CloseEvent)>::new(move |event: CloseEvent| {
                events.borrow_mut().push_back(SocketEvent::Closed(event.reason()));
            })
        };
        socket.set_onopen(Some(opened.as_ref().unchecked_ref()));
        socket.set_onmessage(Some(message.as_ref().unchecked_ref()));
        socket.set_onclose(Some(closed.as_ref().unchecked_ref()));
        Ok(Socket { socket, events, _opened: opened, _message: message, _closed: closed })
    }

    /// The next event, where one is there.
    pub fn try_event(&self) -> Option<SocketEvent> {
        self.events.borrow_mut().pop_front()
    }

    /// Sends a message; one that cannot be sent any more is followed by a closed event.
    pub fn send(&self, bytes: &[u8]) {
        if self.socket.ready_state() == WebSocket::OPEN {
            // An error here means that the socket is closing.
            let _ = self.socket.send_with_u8_array(bytes);
        }
    }
}

impl Drop for Socket {
    fn drop(&mut self) {
        self.socket.set_onopen(None);
        self.socket.set_onmessage(None);
        self.socket.set_onclose(None);
        // Already closed is as good.
        let _ = self.socket.close();
    }
}

/// A JavaScript error's message.
pub fn js_words(error: &JsValue) -> String {
    error.dyn_ref::<js_sys::Error>().map_or_else(|| format!("{error:?}"), |error| String::from(error.message()))
}
