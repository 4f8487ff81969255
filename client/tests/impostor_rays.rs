//! Rays against impostors, in a fragment shader and on the CPU: both walk the same way, one in f32 and one in f64.

extern crate impostor as vantage_impostor;

#[path = "../../impostor/tests/support/mod.rs"]
mod support;

use camera::{Bounds, Camera};
use glam::DVec3;
use gpu::{Gpu, PinholeUniform, Readback};
use impostor::{FRUSTUM_TEXELS, Hit, Impostor, Method, Ray, Steps};
use support::{Image, scenes};
use wgpu::util::DeviceExt;
use wgpu::{BindingResource, TextureFormat};

/// Rays a side of the square that holds them.
const SIDE: u32 = 64;
const FINE_PX: f64 = 0.5;

const BINDINGS: &str = "
@group(0) @binding(0) var<uniform> image: Impostor;
@group(0) @binding(1) var texels: texture_2d<f32>;
@group(0) @binding(2) var ranges: texture_2d<f32>;
@group(0) @binding(3) var origins: texture_2d<f32>;
@group(0) @binding(4) var directions: texture_2d<f32>;

fn ray_of(position: vec4f) -> ImpostorRay {
    let pixel = vec2i(position.xy);
    return ImpostorRay(textureLoad(origins, pixel, 0).xyz, 0.0, textureLoad(directions, pixel, 0).xyz, 3e38);
}

@vertex
fn fullscreen(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(vec2f(f32(index & 1u), f32(index >> 1u)) * 4.0 - 1.0, 0.0, 1.0);
}
";

const OF_PINHOLE: &str = "
@group(0) @binding(5) var<uniform> camera: Pinhole;

@fragment
fn hits(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let hit = impostor_hit_of_pinhole(image, camera, texels, ranges, ray_of(position));
    return vec4f(hit.t, f32(hit.side), vec2f(hit.pixel));
}
";

const OF_GRAPH: &str = "
@group(0) @binding(5) var frusta: texture_2d<f32>;

@fragment
fn hits(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let hit = impostor_hit_of_graph(image, frusta, texels, ranges, ray_of(position));
    return vec4f(hit.t, f32(hit.side), vec2f(hit.pixel));
}
";

fn texture(gpu: &Gpu, (width, height): (u32, u32), format: TextureFormat, texels: &[u8]) -> wgpu::TextureView {
    let descriptor = wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    let texture =
        gpu.device.create_texture_with_data(&gpu.queue, &descriptor, wgpu::util::TextureDataOrder::LayerMajor, texels);
    texture.create_view(&Default::default())
}

fn buffer(gpu: &Gpu, contents: &[u8]) -> wgpu::Buffer {
    let usage = wgpu::BufferUsages::UNIFORM;
    gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
}

/// (t, side, column, row) of each ray, by the shader; relative to `anchor`, where the impostor's camera is.
fn by_shader(gpu: &Gpu, impostor: &Impostor, anchor: DVec3, rays: &[Ray]) -> Vec<[f32; 4]> {
    let size = impostor.camera().size_px();
    let uniform = impostor.uniform(anchor, FINE_PX).expect("samples");
    let uniform = buffer(gpu, bytemuck::bytes_of(&uniform));
    let planes = texture(gpu, size, TextureFormat::Rgba32Float, bytemuck::cast_slice(&impostor.plane_texels()));
    let ranges = impostor.range_texels();
    let ranges_size = (ranges.width, ranges.height);
    let ranges = texture(gpu, ranges_size, TextureFormat::Rg32Float, bytemuck::cast_slice(&ranges.ranges));
    let of_rays = |value: &dyn Fn(&Ray) -> DVec3| {
        let texels: Vec<[f32; 4]> = rays.iter().map(|ray| value(ray).extend(0.0).as_vec4().to_array()).collect();
        texture(gpu, (SIDE, SIDE), TextureFormat::Rgba32Float, bytemuck::cast_slice(&texels))
    };
    let origins = of_rays(&|ray| ray.origin_world - anchor);
    let directions = of_rays(&|ray| ray.direction_world);
    let pinhole = match impostor.camera() {
        Camera::Pinhole(camera) => Some(*camera),
        Camera::Spoc(camera) => Some(camera.pinhole),
        Camera::Graph(_) => None,
    };
    let pinhole = pinhole.map(|camera| buffer(gpu, bytemuck::bytes_of(&PinholeUniform::new(&camera, anchor))));
    let frusta = impostor.frustum_texels(anchor).map(|texels| {
        let size = (FRUSTUM_TEXELS as u32, (texels.len() / FRUSTUM_TEXELS) as u32);
        texture(gpu, size, TextureFormat::Rgba32Float, bytemuck::cast_slice(&texels))
    });
    let (path, entry, camera) = match (&pinhole, &frusta) {
        (Some(pinhole), _) => ("impostor/pinhole.wgsl", OF_PINHOLE, pinhole.as_entire_binding()),
        (None, Some(frusta)) => ("impostor/graph.wgsl", OF_GRAPH, BindingResource::TextureView(frusta)),
        (None, None) => panic!("a camera of either kind"),
    };
    let shader = shaders::source(path).expect("it is there") + BINDINGS + entry;
    let views = [&planes, &ranges, &origins, &directions].map(BindingResource::TextureView);
    let inputs: Vec<_> = [uniform.as_entire_binding()].into_iter().chain(views).chain([camera]).collect();
    draw(gpu, &shader, &inputs)
}

fn draw(gpu: &Gpu, shader: &str, inputs: &[BindingResource<'_>]) -> Vec<[f32; 4]> {
    let device = &gpu.device;
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(shader.into()),
    });
    let format = TextureFormat::Rgba32Float;
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("fullscreen"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("hits"),
            compilation_options: Default::default(),
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    let entries: Vec<_> = inputs
        .iter()
        .zip(0..)
        .map(|(resource, binding)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
        .collect();
    let layout = pipeline.get_bind_group_layout(0);
    let group =
        device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &entries });
    let target = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = target.create_view(&Default::default());
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations::default(),
        })],
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.draw(0..3, 0..1);
    drop(pass);
    let mut readback = Readback::default();
    let slot = readback.texture(&target, 0, (SIDE, SIDE));
    let encoded = readback.encode(gpu, &mut encoder);
    gpu.queue.submit([encoder.finish()]);
    encoded.map().wait(gpu).expect("a readback").values(slot)
}

/// Halton's sequence: even, and the same everywhere.
fn halton(index: u32, base: u32) -> f64 {
    let (mut rest, mut share, mut sum) = (index, 1.0, 0.0);
    while rest > 0 {
        share /= f64::from(base);
        sum += share * f64::from(rest % base);
        rest /= base;
    }
    sum
}

/// Rays from a box to points of another one.
fn rays(from: &Bounds, to: &Bounds) -> Vec<Ray> {
    let place = |bounds: &Bounds, index: u32, bases: [u32; 3]| {
        let share = DVec3::from(bases.map(|base| halton(index, base)));
        bounds.min + (bounds.max - bounds.min) * share
    };
    let ray = |index: u32| {
        let origin = place(from, index, [2, 3, 5]);
        Ray::endless(origin, (place(to, index, [7, 11, 13]) - origin).normalize())
    };
    (1..=SIDE * SIDE).map(ray).collect()
}

/// How far a pixel is wide where a ray meets the impostor.
fn footprint_m(image: &Image, hit: &Hit) -> f64 {
    image.at(hit.pixel.0.into(), hit.pixel.1.into()).expect("a hit is on a sample").footprint_m
}

/// At least 99 of 100 rays: the rest passes so near to an edge that rounding decides.
fn agree(name: &str, image: &Image, anchor: DVec3, rays: &[Ray]) {
    let gpu = Gpu::block_on(Gpu::new_headless()).expect("an adapter");
    let found = by_shader(&gpu, &image.impostor, anchor, rays);
    let steps = Steps { method: Method::Hierarchy, fine_px: FINE_PX };
    let (mut agreeing, mut hits) = (0, 0);
    for (ray, [t, side, ..]) in rays.iter().zip(found) {
        let hit = image.impostor.hit(ray, steps).hit;
        hits += u32::from(hit.is_some());
        agreeing += u32::from(match hit {
            None => side == 0.0,
            Some(hit) => side != 0.0 && (f64::from(t) - hit.t).abs() <= footprint_m(image, &hit),
        });
    }
    println!("{name}: {agreeing} of {} agree, {hits} hit", rays.len());
    assert!(hits * 4 > SIDE * SIDE, "{name}: {hits} hits are too few to say anything");
    assert!(agreeing * 100 >= SIDE * SIDE * 99, "{name}: {agreeing} of {} agree", rays.len());
}

/// Around the pot, as what it is reflected in would be.
const BEFORE_POT: Bounds = Bounds { min: DVec3::new(-3.0, -1.0, 1.0), max: DVec3::new(3.0, 2.0, 3.0) };

#[test]
fn a_pinhole_s_impostor_is_met_where_the_cpu_says() {
    let rays = rays(&BEFORE_POT, &scenes::POT_BOUNDS);
    agree("pinhole", &scenes::pot_by_pinhole(128), scenes::POT_EYE, &rays);
}

#[test]
fn a_single_pole_camera_s_impostor_is_met_where_the_cpu_says() {
    let rays = rays(&BEFORE_POT, &scenes::POT_BOUNDS);
    agree("single pole", &scenes::pot_by_spoc(128), scenes::POT_EYE, &rays);
}

#[test]
fn a_graph_camera_s_impostor_is_met_where_the_cpu_says() {
    let image = scenes::maze_by_graph((480, 360));
    let bounds = image.impostor.bounds_world().expect("samples");
    // As if they left the walls: where rays begin within them, at the end of a frustum, rounding decides what is met.
    let shown: Vec<_> = image.shown.iter().flatten().collect();
    let from_wall = |(index, ray): (usize, Ray)| {
        let point = shown[index * 37 % shown.len()];
        let away = ray.direction_world * point.normal.dot(ray.direction_world).signum();
        Ray::endless(point.p_world + point.normal * 0.3, away)
    };
    let rays: Vec<Ray> = rays(&bounds, &bounds).into_iter().enumerate().map(from_wall).collect();
    agree("graph", &image, bounds.middle(), &rays);
}
