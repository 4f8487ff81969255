// Shows a picture as it looks from another eye: its surfaces as a net of cells, each corner at the depth that the picture has there. The twin of
// `ReprojectUniform` and of the net of `client/src/draw/steady/reproject.rs`.

struct Reproject {
    // Rows of the affine map from the picture's eye to the output's.
    eye_from_picture: array<vec4f, 3>,
    // Of the picture.
    centre_px: vec2f,
    size_px: vec2f,
    focal_px: f32,
    // Metres.
    near_m: f32,
    // Pixels of the picture along a cell's side.
    cell_px: f32,
    // Corners in a row of the net.
    columns: u32,
    // Of the output: clip.xy = scale * eye.xy + shift * eye.z.
    clip_scale: vec2f,
    clip_shift: vec2f,
    // Of the net. Those behind are the same ones, infinitely far away: the picture is seen so where the eye has passed all that it shows.
    corners: u32,
    padding_0: u32,
    padding_1: u32,
    padding_2: u32,
}

@group(0) @binding(0) var<uniform> view: Reproject;
// As shown.
@group(0) @binding(1) var picture: texture_2d<f32>;
// Its inverse depth in 1/m, 0 where there is no surface; it may have more samples a pixel.
@group(0) @binding(2) var picture_w: texture_2d<f32>;
@group(0) @binding(3) var picture_sampler: sampler;

struct Corner {
    @builtin(position) clip: vec4f,
    // In the picture, pixels.
    @location(0) image: vec2f,
}

// Where inverse depths at three places in a row lie off a line by more than this share of the middle one, a surface ends between them.
const ENDS: f32 = 0.1;

fn w_at(image: vec2f) -> f32 {
    let texels = vec2f(textureDimensions(picture_w));
    return textureLoad(picture_w, clamp(vec2i(image / view.size_px * texels), vec2i(0), vec2i(texels) - 1), 0).x;
}

// At a corner of the net: where a surface ends in a cell around it, of the nearest one there. So outlines move with what they are of, as a whole, and the net is stretched
// beside them.
fn w_of_corner(image: vec2f) -> f32 {
    let own = w_at(image);
    let half = 0.5 * view.cell_px;
    var nearest = own;
    var ends = false;
    for (var i = 0u; i < 12u; i++) {
        // Half of the 24 places around it, half a cell apart; the other half lies opposite.
        let place = vec2f(f32(i % 5u) - 2.0, f32(i / 5u) - 2.0) * half;
        let one = w_at(image + place);
        let opposite = w_at(image - place);
        nearest = max(nearest, max(one, opposite));
        ends = ends || abs(one + opposite - 2.0 * own) > ENDS * own;
    }
    return select(own, nearest, ends);
}

// The outermost corners lie one picture further out, so that what the picture does not hold is as its border.
@vertex
fn vertex(@builtin(vertex_index) vertex: u32) -> Corner {
    let index = vertex % view.corners;
    let step = vec2f(f32(index % view.columns), f32(index / view.columns));
    let inner = clamp((step - 1.0) * view.cell_px, vec2f(0.0), view.size_px);
    let beyond = select(vec2f(0.0), vec2f(-1.0), step < vec2f(0.5)) + select(vec2f(0.0), vec2f(1.0), (step - 2.0) * view.cell_px >= view.size_px);
    let image = inner + beyond * view.size_px;
    var w = 0.0;
    if vertex < view.corners {
        w = w_of_corner(inner);
    }
    // Scaled by w: see `surface/quads.wgsl`. What is interpolated is linear in the picture.
    let point = vec4f((image - view.centre_px) / view.focal_px, 1.0, w);
    let p = vec3f(dot(view.eye_from_picture[0], point), dot(view.eye_from_picture[1], point), dot(view.eye_from_picture[2], point));
    return Corner(vec4f(view.clip_scale * p.xy + view.clip_shift * p.z, view.near_m * w, p.z), image);
}

@fragment
fn fragment(in: Corner) -> @location(0) vec4f {
    return vec4f(textureSample(picture, picture_sampler, in.image / view.size_px).rgb, 1.0);
}
