//! Which graphics device the page draws with, and which after one was lost.

use client::draw::picture::PictureOptions;

use crate::page;
use crate::screen::{self, Renderer, Screen};

/// Devices lost after which another interface is tried, and after which nothing more is.
const LOSSES_BEFORE_CHANGE: u32 = 3;
const LOSSES_BEFORE_GIVING_UP: u32 = 6;

/// What is known of the devices so far.
#[derive(Clone, Copy)]
pub struct Devices {
    wished: Option<Renderer>,
    pub losses: u32,
}

impl Devices {
    /// Before one was opened. `wished`: by which interface, if that matters.
    pub fn new(wished: Option<Renderer>) -> Devices {
        Devices { wished, losses: 0 }
    }

    /// Opens the wished interface, or the best that there is. Fails with words for a person.
    pub async fn open(self, picture: PictureOptions) -> Result<Screen, String> {
        if self.losses > LOSSES_BEFORE_GIVING_UP {
            return Err("so were those in its place".to_owned());
        }
        let mut refused = Vec::new();
        for &renderer in self.candidates().await {
            // A canvas that had a device, or was refused one, gives no other.
            let is_fresh = self.losses == 0 && refused.is_empty();
            let canvas = if is_fresh { page::canvas()? } else { page::fresh_canvas()? };
            match Screen::open(canvas, renderer, picture).await {
                Ok(screen) => return Ok(screen),
                Err(why) => refused.push(format!("{}: {why}", renderer.name())),
            }
        }
        Err(format!("this browser gives no graphics device ({})", refused.join("; ")))
    }

    async fn candidates(self) -> &'static [Renderer] {
        let wished = if self.losses > LOSSES_BEFORE_CHANGE { Some(Renderer::WebGl2) } else { self.wished };
        match wished {
            Some(Renderer::WebGpu) => &[Renderer::WebGpu],
            Some(Renderer::WebGl2) => &[Renderer::WebGl2],
            None => match screen::webgpu_is_software().await {
                Some(false) => &[Renderer::WebGpu, Renderer::WebGl2],
                // To show a picture of 960 x 600 takes 65 ms of processor time by WebGPU there, and 12 by WebGL2, whatever it shows.
                Some(true) => &[Renderer::WebGl2, Renderer::WebGpu],
                None => &[Renderer::WebGl2],
            },
        }
    }
}
