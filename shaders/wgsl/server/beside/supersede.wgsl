// Held samples whose place finer ones have taken: the twin of `server::account::superseded`, by slot.
#import "server/beside/view.wgsl"

// The twins of the constants there.
const FINER: f32 = 2.0;
const MARGIN_PX: i32 = 1;
const LEAST_VIEW_DENSITY: f32 = 0.5;
const MOST_EXTENT_PX: i32 = 32;
const FAR_OFF_PX: f32 = 1e6;

// A sample as the view sees it.
struct Flat {
    point: Point,
    // Its plane: `w = plane . r` for a ray `r` in the axes of the world.
    plane: vec3f,
    // What its pixel spans at its depth, in metres.
    footprint_m: f32,
}

// Whether the hit of a pixel lies on the sample's plane, and faces the same way.
fn lies_on(p: vec2i, flat_sample: Flat) -> bool {
    let hit = truth_at(p);
    if !hit.is_there || hit.object != flat_sample.point.object || !is_same_way(hit, flat_sample.point) {
        return false;
    }
    let apart = abs(hit.w - dot(flat_sample.plane, ray(p)));
    return apart <= tolerance(hit, flat_sample.point, p) + hit.w * hit.w * flat_sample.footprint_m;
}

fn world_from_eye(v: vec3f) -> vec3f {
    return beside.right * v.x + beside.down * v.y + beside.forward * v.z;
}

// A direction of a patch's eye in world axes.
fn world_from_patch(place: u32, v: vec3f) -> vec3f {
    let rows = patches[place].eye_from_patch;
    return world_from_eye(vec3f(dot(rows[0].xyz, v), dot(rows[1].xyz, v), dot(rows[2].xyz, v)));
}

fn patch_ray(place: u32, image: vec2f) -> vec3f {
    return world_from_patch(place, vec3f((image - patches[place].centre_px) / patches[place].focal_px, 1.0));
}

@compute @workgroup_size(64)
fn supersede(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let slot = id.x + id.y * groups.x * 64u;
    if slot >= beside.slots {
        return;
    }
    let place = patch_of_slot(slot);
    if place == beside.patches {
        return;
    }
    let sample = samples[slot];
    let image = pixel_centre(sample.pixel);
    let eye = eye_times_w(place, 0u, image, sample.w);
    if !(eye.z > beside.near_m * sample.w) {
        return;
    }
    let centre = vec2i(floor(clamp(beside.centre_px + beside.focal_px / eye.z * eye.xy, vec2f(-1.0), vec2f(beside.size_px))));
    // Most end here: they are out of sight, or as fine as what shows.
    if !is_inside(centre) || pixels[at(centre)].shown < FINER * sample.density {
        return;
    }
    if !is_held(place, sample.pixel) || is_carried(place, sample.mover) {
        return;
    }
    if (atomicLoad(&marks[COUNTERS + slot]) & TOLD) != 0u {
        return;
    }
    let normal = octahedral_normal(sample.normal_object & 0xffffu);
    let facing = dot(normal, patch_ray(place, image));
    var low = vec2i(0x7fffffff);
    var high = vec2i(-0x7fffffff);
    for (var corner = 0u; corner < 4u; corner++) {
        let at_corner = image + vec2f(f32(corner & 1u), f32(corner >> 1u)) - 0.5;
        let tilt = clamp(dot(normal, patch_ray(place, at_corner)) / facing, 0.5, 2.0);
        let w = sample.w * tilt;
        let corner_eye = eye_times_w(place, 0u, at_corner, w);
        if !(corner_eye.z > beside.near_m * w) {
            return;
        }
        let shown = beside.centre_px + beside.focal_px / corner_eye.z * corner_eye.xy;
        let corner_p = vec2i(floor(clamp(shown, vec2f(-FAR_OFF_PX), vec2f(FAR_OFF_PX))));
        low = min(low, corner_p);
        high = max(high, corner_p);
    }
    low -= MARGIN_PX;
    high += MARGIN_PX;
    let point = Point(sample.w, normal, sample.normal_object >> 16u, sample.triangle, patches[place].w_step, sample.density, true);
    let plane = normal * sample.w / dot(normal, world_from_eye(eye));
    let flat_sample = Flat(point, plane, 1.0 / (patches[place].focal_px * sample.w));
    // Numbers, as the twin asks: an f32 goes up to 3.4e38.
    if !all(abs(plane) < vec3f(3e38)) || any(high - low >= vec2i(MOST_EXTENT_PX)) {
        return;
    }
    if view_density(centre) < LEAST_VIEW_DENSITY * sample.density || !lies_on(centre, flat_sample) {
        return;
    }
    let first = max(low, vec2i(0));
    let last = min(high, vec2i(beside.size_px) - 1);
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            let p = vec2i(x, y);
            if pixels[at(p)].shown < FINER * sample.density && lies_on(p, flat_sample) {
                return;
            }
        }
    }
    tell(patches[place].id, sample.pixel, SUPERSEDED);
}
