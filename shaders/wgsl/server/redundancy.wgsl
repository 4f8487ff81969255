// Whether earlier images of a set hold a sample: the tests of Xie, Wang, Popescu 2016, §3, and ours. The twin on the CPU is
// `redundancy::Earlier` of the server, whose documentation says what each test asks.
#import "server/view.wgsl"
#import "server/rays.wgsl"
#import "common/octahedral.wgsl"

const MAX_EARLIER: u32 = 15u;

struct EarlierImage {
    // Rows of the rigid map from this image's eye to the earlier one's.
    eye_from_this_x: vec4f,
    eye_from_this_y: vec4f,
    eye_from_this_z: vec4f,
    // Of the earlier image, relative to the anchor, world axes.
    eye_anchor: vec3f,
    near_m: f32,
    centre_px: vec2f,
    size_px: vec2f,
    focal_px: f32,
    padding_0: f32,
    padding_1: f32,
    padding_2: f32,
}

struct EarlierImages {
    count: u32,
    padding_0: u32,
    padding_1: u32,
    padding_2: u32,
    images: array<EarlierImage, MAX_EARLIER>,
}

@group(3) @binding(0) var<uniform> earlier: EarlierImages;
// Layer j holds the ids of image j, as `ImageTargets` has them; 0 where it has no sample.
@group(3) @binding(1) var earlier_ids: texture_2d_array<u32>;
// Layer j holds `near * w`.
@group(3) @binding(2) var earlier_depth: texture_2d_array<f32>;

// Values of `redundancy_test`, as `RedundancyTest::code` gives them; 0 looks for the triangle.
const SURFACE: u32 = 1u;
const VISIBILITY: u32 = 2u;
const VISIBILITY_PLAIN: u32 = 3u;
override redundancy_test: u32 = 0u;
// Values of `asked_pixels`, as `RedundancyTest::asked` gives them; 0 asks the pixel that the sample lies in.
const ANY_OF_NINE: u32 = 1u;
const ALL_OF_FOUR: u32 = 2u;
override asked_pixels: u32 = 0u;
// A sample that is more than this many times as dense as in an earlier image is not held by it; 0: density does not count.
override density_factor: f32 = 0.0;

// Of one surface, normals differ by less than 45 degrees.
const LEAST_COSINE: f32 = 0.7;
// Hits that are looked past along one sample's rays; beyond them it counts as hidden, so it is kept.
const MOST_HITS: u32 = 256u;

// A sample that is tested.
struct Sample {
    // In this image's eye space.
    p_eye: vec3f,
    // Unit length, world axes.
    normal_world: vec3f,
    triangle: u32,
    object: u32,
}

fn eye_of_earlier(image: EarlierImage, p_eye: vec3f) -> vec3f {
    let p = vec4f(p_eye, 1.0);
    return vec3f(dot(image.eye_from_this_x, p), dot(image.eye_from_this_y, p), dot(image.eye_from_this_z, p));
}

// Where a point lies in an earlier image, in pixels; outside where it lies before the near plane.
fn place_in_earlier(image: EarlierImage, q: vec3f) -> vec2f {
    return select(vec2f(-1.0), image.centre_px + image.focal_px / q.z * q.xy, q.z >= image.near_m);
}

fn is_inside(image: EarlierImage, place: vec2f) -> bool {
    return all(place >= vec2f(0.0)) && all(place < image.size_px);
}

fn anchor_from_eye(p_eye: vec3f) -> vec3f {
    return p_eye * camera.eye_from_world + camera.eye_anchor;
}

// Whether the sample is no denser here than in an earlier image, but for the factor. Samples a square metre: f^2 |n.p| w^3.
fn is_dense_enough(image: EarlierImage, sample: Sample, q: vec3f) -> bool {
    if density_factor <= 0.0 {
        return true;
    }
    let p_anchor = anchor_from_eye(sample.p_eye);
    let facing = abs(dot(sample.normal_world, p_anchor - camera.eye_anchor));
    let facing_earlier = abs(dot(sample.normal_world, p_anchor - image.eye_anchor));
    let ratio = camera.focal_px / image.focal_px;
    let nearer = q.z / sample.p_eye.z;
    return ratio * ratio * facing * nearer * nearer * nearer <= density_factor * facing_earlier;
}

fn holds_texel(index: u32, texel: vec2i, sample: Sample, q: vec3f) -> bool {
    let ids = textureLoad(earlier_ids, texel, i32(index), 0).xy;
    if ids.x == sample.triangle {
        return true;
    }
    if redundancy_test != SURFACE || ids.x == 0u || (ids.y & 0xffffu) != sample.object {
        return false;
    }
    let image = earlier.images[index];
    let normal = octahedral_normal(ids.y >> 16u);
    if dot(normal, sample.normal_world) < LEAST_COSINE {
        return false;
    }
    // Whether the point lies on the held sample's plane within a footprint: both rotated into this eye's space.
    let w = textureLoad(earlier_depth, texel, i32(index), 0).x / image.near_m;
    let held = vec3f((vec2f(texel) + 0.5 - image.centre_px) / image.focal_px, 1.0) / w;
    let away = q - held;
    let away_this = away.x * image.eye_from_this_x.xyz + away.y * image.eye_from_this_y.xyz
        + away.z * image.eye_from_this_z.xyz;
    return abs(dot(camera.eye_from_world * normal, away_this)) <= held.z / image.focal_px;
}

// Whether an earlier image holds the sample at its pixel.
fn holds_pixel(index: u32, sample: Sample) -> bool {
    let image = earlier.images[index];
    let q = eye_of_earlier(image, sample.p_eye);
    let place = place_in_earlier(image, q);
    if !is_inside(image, place) || !is_dense_enough(image, sample, q) {
        return false;
    }
    let last = vec2i(image.size_px) - 1;
    if asked_pixels == ALL_OF_FOUR {
        // The four pixels whose centres are around it.
        let first = vec2i(floor(place - 0.5));
        for (var corner = 0; corner < 4; corner++) {
            let texel = clamp(first + vec2i(corner & 1, corner >> 1u), vec2i(0), last);
            if !holds_texel(index, texel, sample, q) {
                return false;
            }
        }
        return true;
    }
    let texel = vec2i(place);
    let radius = select(0, 1, asked_pixels == ANY_OF_NINE);
    for (var y = max(texel.y - radius, 0); y <= min(texel.y + radius, last.y); y++) {
        for (var x = max(texel.x - radius, 0); x <= min(texel.x + radius, last.x); x++) {
            if holds_texel(index, vec2i(x, y), sample, q) {
                return true;
            }
        }
    }
    return false;
}

// How much of a ray's length positions are unsure by: eight roundings of the coordinates at its ends. Each is 2^-23 of them at most, what one f32 is from
// the next; 2^-20 is eight times that. 1e-30 keeps a ray without length from dividing by 0, and any number does that is shorter than every ray.
fn unsure(origin: vec3f, direction: vec3f) -> f32 {
    let sizes = abs(origin) + abs(origin + direction);
    return exp2(-20.0) * max(max(sizes.x, sizes.y), sizes.z) / max(length(direction), 1e-30);
}

// One question of the walk below: whether images before `limit` hold a point.
struct Question {
    p_anchor: vec3f,
    triangle: u32,
    limit: u32,
    // The image that is asked now, and how far its ray has come.
    image: u32,
    t: f32,
}

// Whether images before `limit` hold a point of a triangle, by rays: an image holds what its eye reaches, and, unless the test is the
// plain one, what it reaches through hits that images before it hold. That would be a recursion; here it is a stack, no
// deeper than there are images, as each question asks fewer of them.
fn holds_by_rays(p_anchor: vec3f, triangle: u32, limit: u32) -> bool {
    var asked: array<Question, 16>;
    var depth = 0u;
    var hits = 0u;
    asked[0] = Question(p_anchor, triangle, limit, 0u, 0.0);
    loop {
        let question = asked[depth];
        if question.image >= question.limit {
            // No image holds it: what asked was hidden by it.
            if depth == 0u {
                return false;
            }
            depth--;
            asked[depth].image++;
            asked[depth].t = 0.0;
            continue;
        }
        let image = earlier.images[question.image];
        let p_eye = camera.eye_from_world * (question.p_anchor - camera.eye_anchor);
        var reaches = false;
        var through = RayHit(0.0, 0u);
        let q = eye_of_earlier(image, p_eye);
        if is_inside(image, place_in_earlier(image, q)) {
            let direction = question.p_anchor - image.eye_anchor;
            let unsure_t = unsure(image.eye_anchor, direction);
            let hit = first_hit(image.eye_anchor, direction, max(question.t, image.near_m / q.z), 1.0 + unsure_t);
            reaches = hit.triangle != 0u && (hit.triangle == question.triangle || hit.t >= 1.0 - unsure_t);
            if !reaches && hit.triangle != 0u {
                through = hit;
            }
            hits++;
        }
        if reaches {
            if depth == 0u {
                return true;
            }
            // It hides nothing: what asked goes on behind it.
            depth--;
        } else if through.triangle != 0u && question.image > 0u && redundancy_test == VISIBILITY && hits < MOST_HITS {
            asked[depth].t = through.t;
            let p = image.eye_anchor + through.t * (question.p_anchor - image.eye_anchor);
            depth++;
            asked[depth] = Question(p, through.triangle, question.image, 0u, 0.0);
        } else {
            asked[depth].image++;
            asked[depth].t = 0.0;
        }
    }
    return false;
}

// Whether any earlier image holds the sample.
fn is_redundant(sample: Sample) -> bool {
    if redundancy_test >= VISIBILITY {
        return holds_by_rays(anchor_from_eye(sample.p_eye), sample.triangle, earlier.count);
    }
    for (var index = 0u; index < earlier.count; index++) {
        if holds_pixel(index, sample) {
            return true;
        }
    }
    return false;
}
