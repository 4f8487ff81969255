//! The web worker that decodes updates and builds their surfaces, so that a large one never holds up a frame. `static/worker.js` is its other end.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use client::receive::viewer::{DecodeWorker, Decoder};
use js_sys::{Array, Uint8Array};
use protocol::Limits;
use surface::FarBytes;
use wasm_bindgen::JsCast;
use wasm_bindgen::prelude::*;
use web_sys::{ErrorEvent, Event, MessageEvent, Worker, WorkerOptions, WorkerType};

use crate::socket::js_words;

/// Beside the page.
const SCRIPT: &str = "./worker.js";

/// A decoder by a web worker, or one on the page's own thread where the browser gives none; the console then says why.
pub fn decoder() -> Decoder {
    let limits = Limits::default();
    match WebWorker::start() {
        Ok(worker) => Decoder::elsewhere(limits, Box::new(worker)),
        Err(why) => {
            warn(&why);
            Decoder::inline(limits)
        }
    }
}

/// A worker that is starting, running or dead. Dropping it ends it.
#[derive(Debug)]
struct WebWorker {
    worker: Worker,
    heard: Rc<RefCell<VecDeque<Heard>>>,
    // They live as long as the worker may call them.
    _message: Closure<dyn FnMut(MessageEvent)>,
    _error: Closure<dyn FnMut(Event)>,
}

/// The parts of an answer, or what the worker died of.
type Heard = Result<Array, String>;

/// A part of an answer, outside of the page's WebAssembly.
#[derive(Debug)]
struct Part(Uint8Array);

impl FarBytes for Part {
    fn count(&self) -> usize {
        self.0.length() as usize
    }

    fn read(&self, at: usize, to: &mut [u8]) {
        self.0.subarray(at as u32, (at + to.len()) as u32).copy_to(to);
    }
}

impl WebWorker {
    /// Begins to start one, with the page's own WebAssembly, so that nothing is loaded or compiled twice.
    fn start() -> Result<WebWorker, String> {
        let options = WorkerOptions::new();
        options.set_type(WorkerType::Module);
        let worker = Worker::new_with_options(SCRIPT, &options).map_err(|error| js_words(&error))?;
        let heard: Rc<RefCell<VecDeque<Heard>>> = Rc::default();
        let message = {
            let heard = Rc::clone(&heard);
            Closure::<dyn FnMut(MessageEvent)>::new(move |event: MessageEvent| {
                // What is no answer says in words why there are none.
                let answer = event.data().dyn_into::<Array>();
                heard.borrow_mut().push_back(answer.map_err(|words| words.as_string().unwrap_or_default()));
            })
        };
        let error = {
            let heard = Rc::clone(&heard);
            Closure::<dyn FnMut(Event)>::new(move |event: Event| {
                let words = event.dyn_ref::<ErrorEvent>().map(ErrorEvent::message).filter(|words| !words.is_empty());
                heard.borrow_mut().push_back(Err(words.unwrap_or_else(|| format!("{SCRIPT} cannot be loaded"))));
            })
        };
        worker.set_onmessage(Some(message.as_ref().unchecked_ref()));
        worker.set_onmessageerror(Some(error.as_ref().unchecked_ref()));
        worker.set_onerror(Some(error.as_ref().unchecked_ref()));
        let worker = WebWorker { worker, heard, _message: message, _error: error };
        worker.worker.post_message(&wasm_bindgen::module()).map_err(|error| js_words(&error))?;
        Ok(worker)
    }
}

impl DecodeWorker for WebWorker {
    fn send(&mut self, bytes: &[u8], build: u8) {
        let bytes = Uint8Array::from(bytes).buffer();
        let question = Array::of2(&bytes, &build.into());
        let sent = self.worker.post_message_with_transfer(&question, &Array::of1(&bytes));
        if let Err(error) = sent {
            self.heard.borrow_mut().push_back(Err(js_words(&error)));
        }
    }

    fn receive(&mut self) -> Result<Option<Vec<Box<dyn FarBytes>>>, String> {
        let heard = self.heard.borrow_mut().pop_front().transpose()?;
        let part = |part| -> Box<dyn FarBytes> { Box::new(Part(Uint8Array::new(&part))) };
        Ok(heard.map(|answer| answer.iter().map(part).collect()))
    }

    fn give_up(&mut self, why: &str) {
        self.worker.terminate();
        warn(why);
    }
}

impl Drop for WebWorker {
    fn drop(&mut self) {
        self.worker.set_onmessage(None);
        self.worker.set_onmessageerror(None);
        self.worker.set_onerror(None);
        self.worker.terminate();
    }
}

fn warn(why: &str) {
    web_sys::console::warn_1(
        &format!("updates are decoded on the page's own thread, as there is no worker: {why}").into(),
    );
}
