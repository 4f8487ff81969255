//! Pictures for a file, of any size: the view as it is now, drawn anew with all that it may show, in tiles as large as what a screen shows.

use camera::{Pinhole, Rigid};
use client::draw::antialiasing::Antialias;
use client::draw::effects::InTime;
use client::draw::occlusion;
use client::draw::picture::{Picture, PictureOptions};
use client::draw::shadow;
use client::draw::steady::FrameRate;
use client::receive::moment::Moment;
use client::show::tiles::{PIXEL_BYTES, tiles};
use gpu::{Gpu, Readback};
use protocol::Held;
use protocol::message::{Draws, Shadows};
use wasm_bindgen::JsValue;
use wasm_bindgen_futures::JsFuture;

/// A side of a picture: 8K.
const LARGEST_PX: u32 = 7680;
/// Soft shadows get no further with as many draws of a tile.
const MOST_DRAWS: usize = 512;

/// What is photographed.
pub struct View {
    pub gpu: Gpu,
    pub options: PictureOptions,
    /// What the screen draws now.
    pub draws: Draws,
    pub moment: Moment,
    pub world_from_eye: Rigid,
    pub fov_y_rad: f64,
    pub near_m: f64,
    /// Whether depths are rounded as WebGL2 does.
    pub begins_far: bool,
}

/// Rows from the top, of sRGB with alpha, which is 255.
pub struct Photo {
    pub size_px: (u32, u32),
    pub rgba: Vec<u8>,
}

/// Draws what is held, and waits for it without holding up the page. Fails with words for a person.
pub async fn take(view: View, held: Held, size_px: (u32, u32)) -> Result<Photo, String> {
    let (width_px, height_px) = size_px;
    if !(1..=LARGEST_PX).contains(&width_px) || !(1..=LARGEST_PX).contains(&height_px) {
        return Err(format!("a picture has 1 to {LARGEST_PX} pixels a side"));
    }
    let made = Picture::new(&view.gpu, wgpu::TextureFormat::Rgba8Unorm, options(&view));
    let mut picture = made.map_err(|error| error.to_string())?;
    picture.rebuild(&held);
    picture.show_moment(&view.moment);
    let whole = Pinhole::symmetric(view.world_from_eye, size_px, view.fov_y_rad, view.near_m);
    let mut rgba = vec![0; width_px as usize * height_px as usize * PIXEL_BYTES];
    for tile in tiles(size_px) {
        let drawn = draw_tile(&view, &mut picture, &held, &tile.camera(&whole)).await?;
        tile.put(&drawn, &mut rgba, width_px);
    }
    rgba.chunks_exact_mut(PIXEL_BYTES).for_each(|pixel| pixel[3] = 255);
    Ok(Photo { size_px, rgba })
}

/// All that the screen draws now, whatever time that takes.
fn options(view: &View) -> PictureOptions {
    let mut options = PictureOptions { in_time: InTime::default(), frame_rate: FrameRate::Free, ..view.options };
    if options.frame.antialias == Antialias::Measured {
        options.frame.antialias = Antialias::On;
    }
    if view.draws.shadows == Shadows::None {
        options.shadow = shadow::Settings::default();
    }
    if view.options.in_time.occlusion && view.draws.occlusion_reach_m == 0.0 {
        options.occlusion = occlusion::Settings::default();
    }
    options
}

async fn draw_tile(view: &View, picture: &mut Picture, held: &Held, camera: &Pinhole) -> Result<Vec<u8>, String> {
    let size_px = (camera.width_px, camera.height_px);
    let texture = view.gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("photo"),
        size: wgpu::Extent3d { width: size_px.0, height: size_px.1, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let output = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let camera = if view.begins_far { picture.begun_far(held, camera) } else { *camera };
    for _ in 0..MOST_DRAWS {
        picture.draw(held, &camera, &output);
        view.gpu.check().map_err(|error| error.to_string())?;
        if !picture.goes_on() {
            break;
        }
        a_moment().await;
    }
    let mut readback = Readback::default();
    let slot = readback.texture(&texture, 0, size_px);
    let mut encoder = view.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let encoded = readback.encode(&view.gpu, &mut encoder);
    view.gpu.queue.submit([encoder.finish()]);
    let pending = encoded.map();
    while !pending.is_ready() {
        view.gpu.check().map_err(|error| error.to_string())?;
        view.gpu.poll();
        a_moment().await;
    }
    Ok(pending.take().map_err(|error| error.to_string())?.bytes(slot))
}

/// Lets the page go on.
async fn a_moment() {
    let mut promise = |resolve: js_sys::Function, _: js_sys::Function| {
        let window = web_sys::window().expect("the viewer runs in a page");
        // Without a timer it goes on at once.
        if window.set_timeout_with_callback_and_timeout_and_arguments_0(&resolve, 0).is_err() {
            drop(resolve.call0(&JsValue::NULL));
        }
    };
    // It is never rejected.
    drop(JsFuture::from(js_sys::Promise::new(&mut promise)).await);
}
