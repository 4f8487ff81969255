// What a view lacks, and what covers falsely there: the twin of `server::account::compare::Comparison`. Each entry point is a step that reads what the
// one before has written.
#import "server/beside/view.wgsl"

// The first step: which sample each pixel shows. Where the viewer sees the view, it counts as seen.
@compute @workgroup_size(8, 8)
fn begin(@builtin(global_invocation_id) id: vec3u) {
    let p = vec2i(id.xy);
    if !is_inside(p) {
        return;
    }
    let texel = textureLoad(addresses, p, 0);
    var slot = NO_SLOT;
    if texel.x != 0u {
        slot = slot_of(patch_of(texel.x), texel.y);
    }
    if slot != NO_SLOT && has(FLAG_SEEN) {
        seen[slot] = beside.look;
    }
    pixels[at(p)] = Pixel(slot, LEAVE, 0u, 0u, 0.0, 0u);
    if textureLoad(ids, p, 0).x != 0u {
        atomicAdd(&marks[HITS_COUNT], 1u);
    }
}

// By slot: which samples are held from this very camera, where anything is.
@compute @workgroup_size(64)
fn sent(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let slot = id.x + id.y * groups.x * 64u;
    if slot >= beside.slots {
        return;
    }
    let place = patch_of_slot(slot);
    if place == beside.patches || (patches[place].flags & PATCH_CUT) == 0u {
        return;
    }
    let sample = samples[slot];
    if !is_held(place, sample.pixel) || is_carried(place, sample.mover) {
        return;
    }
    let p = vec2i(patches[place].cut_px + vec2u(sample.pixel & 0xffffu, sample.pixel >> 16u));
    if is_inside(p) {
        pixels[at(p)].sent = sample.triangle;
    }
}

fn is_held_around(p: vec2i) -> bool {
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            if is_held_at(p, p + vec2i(x, y)) {
                return true;
            }
        }
    }
    return false;
}

// Whether the scene is discontinuous at a pixel.
fn is_outline(p: vec2i, hit: Point) -> bool {
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let beside_p = p + vec2i(x, y);
            if !is_inside(beside_p) {
                continue;
            }
            let other = truth_at(beside_p);
            if !other.is_there {
                return true;
            }
            if !is_one_surface(hit, other, p, beside_p) || dot(hit.normal, other.normal) < beside.normal_cos {
                return true;
            }
        }
    }
    return false;
}

fn ends_in_nothing(p: vec2i) -> bool {
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let beside_p = p + vec2i(x, y);
            if is_inside(beside_p) && textureLoad(ids, beside_p, 0).x == 0u {
                return true;
            }
        }
    }
    return false;
}

fn is_peer(p: vec2i) -> bool {
    let place = patch_of(textureLoad(addresses, p, 0).x);
    return place < beside.patches && (patches[place].flags & PATCH_PEER) != 0u;
}

fn is_coarse(p: vec2i, hit: Point, held: Point) -> bool {
    if !has(FLAG_REFINES) || is_peer(p) {
        return false;
    }
    return view_density(p) > beside.density_factor * held.density
        && !(has(FLAG_OUTLINES_STAND_IN) && is_outline(p, hit));
}

fn verdict_of(p: vec2i) -> u32 {
    let hit = truth_at(p);
    if !hit.is_there {
        return LEAVE;
    }
    let was_sent = pixels[at(p)].sent == hit.triangle;
    let held = held_at(p);
    if !held.is_there {
        let stands_in = has(FLAG_OUTLINES_STAND_IN) && ends_in_nothing(p) && is_held_around(p);
        return select(MISSING, LEAVE, stands_in || was_sent);
    }
    if is_in_place(hit, held, p, p) {
        if is_same_way(hit, held) {
            return select(LEAVE, COARSE, is_coarse(p, hit, held));
        }
        let on_edge = has(FLAG_OUTLINES_STAND_IN) && is_outline(p, hit);
        return select(TURNED, LEAVE, on_edge || is_held_around(p) || (is_peer(p) && was_sent));
    }
    if held.w > hit.w || was_sent {
        return LEAVE;
    }
    let stands_in = has(FLAG_OUTLINES_STAND_IN) && is_outline(p, hit) && is_held_around(p);
    return select(MISSING, LEAVE, stands_in);
}

fn covers_falsely(p: vec2i) -> bool {
    let held = held_at(p);
    if !held.is_there {
        return false;
    }
    let point = stands_at(p);
    if point.is_there && held.w <= point.w + tolerance(point, held, p) {
        return false;
    }
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let beside_p = p + vec2i(x, y);
            let other = truth_at(beside_p);
            if other.is_there && is_in_place(other, held, beside_p, p) {
                return false;
            }
        }
    }
    return true;
}

// Whether the hit of the pixel that a held sample's centre falls on lies on the sample.
fn shows_centre(p: vec2i) -> bool {
    var held = held_at(p);
    let slot = pixels[at(p)].slot;
    let place = patch_of(textureLoad(addresses, p, 0).x);
    if slot == NO_SLOT || place == beside.patches {
        return false;
    }
    let sample = samples[slot];
    let eye = eye_times_w(place, sample.mover, pixel_centre(sample.pixel), sample.w);
    if !(eye.z > beside.near_m * sample.w) {
        return false;
    }
    let centre = vec2i(floor(beside.centre_px + beside.focal_px / eye.z * eye.xy));
    held.w = sample.w / eye.z;
    let hit = truth_at(centre);
    return hit.is_there && is_in_place(hit, held, centre, centre);
}

// What becomes of each pixel by itself, and which held samples may be replaced.
@compute @workgroup_size(8, 8)
fn judge(@builtin(global_invocation_id) id: vec3u) {
    let p = vec2i(id.xy);
    if !is_inside(p) {
        return;
    }
    let verdict = verdict_of(p);
    pixels[at(p)].verdict = verdict;
    let slot = pixels[at(p)].slot;
    if (verdict == COARSE || verdict == TURNED) && shows_centre(p) {
        atomicOr(&marks[COUNTERS + slot], select(TURNS, GOES, verdict == COARSE));
    }
    if has(FLAG_TRIMS) && covers_falsely(p) {
        let texel = textureLoad(addresses, p, 0);
        tell(texel.x, texel.y, FALSE_COVER);
    }
}

// What is too coarse goes where this view sees its centre, and then all of its pixels are sent. What is turned and shows where nothing is sent stays.
@compute @workgroup_size(8, 8)
fn settle(@builtin(global_invocation_id) id: vec3u) {
    let p = vec2i(id.xy);
    if !is_inside(p) {
        return;
    }
    let slot = pixels[at(p)].slot;
    if slot == NO_SLOT {
        return;
    }
    let mark = atomicLoad(&marks[COUNTERS + slot]);
    var verdict = pixels[at(p)].verdict;
    if verdict == COARSE && (mark & GOES) == 0u {
        verdict = LEAVE;
    } else if verdict == LEAVE && (mark & GOES) != 0u && is_held_at(p, p) {
        verdict = COARSE;
    }
    pixels[at(p)].verdict = verdict;
    if verdict == LEAVE && (mark & TURNS) != 0u {
        atomicOr(&marks[COUNTERS + slot], STAYS);
    }
}

// Whether a slot's sample, turned, is replaced.
fn is_turned(mark: u32, is_of_peer: bool) -> bool {
    return (mark & (TURNS | STAYS)) == TURNS && !is_of_peer;
}

// The last of the verdicts, and which samples are replaced.
@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
    let p = vec2i(id.xy);
    if !is_inside(p) {
        return;
    }
    let slot = pixels[at(p)].slot;
    if slot != NO_SLOT {
        let mark = atomicLoad(&marks[COUNTERS + slot]);
        let is_of_peer = is_peer(p);
        let turns = is_turned(mark, is_of_peer);
        if pixels[at(p)].verdict == TURNED && !turns && !is_of_peer {
            pixels[at(p)].verdict = LEAVE;
        }
        if ((mark & GOES) != 0u || turns) && (atomicOr(&marks[COUNTERS + slot], TOLD) & TOLD) == 0u {
            let texel = textureLoad(addresses, p, 0);
            tell(texel.x, texel.y, REPLACED);
        }
    }
    if pixels[at(p)].verdict != LEAVE {
        atomicAdd(&marks[MISSING_COUNT], 1u);
    }
}

// What is sent: what lacks, with a border of its own surface.
@compute @workgroup_size(8, 8)
fn send(@builtin(global_invocation_id) id: vec3u) {
    let p = vec2i(id.xy);
    if !is_inside(p) {
        return;
    }
    let own = truth_at(p);
    var is_sent = false;
    if own.is_there && f32(atomicLoad(&marks[MISSING_COUNT])) > beside.least_px {
        let border = i32(beside.border_px);
        for (var y = -border; y <= border; y++) {
            for (var x = -border; x <= border; x++) {
                let lacking_p = p + vec2i(x, y);
                if !is_sent && is_inside(lacking_p) && pixels[at(lacking_p)].verdict != LEAVE {
                    is_sent = is_one_surface(truth_at(lacking_p), own, lacking_p, p);
                }
            }
        }
    }
    pixels[at(p)].send = select(0u, 1u, is_sent);
    var shown = 0.0;
    if is_sent {
        shown = view_density(p);
    } else if has(FLAG_SUPERSEDES) && is_held_at(p, p) {
        shown = held_at(p).density;
    }
    pixels[at(p)].shown = shown;
}

// The samples that are sent.
@compute @workgroup_size(8, 8)
fn emit(@builtin(global_invocation_id) id: vec3u) {
    let p = vec2i(id.xy);
    if !is_inside(p) || pixels[at(p)].send == 0u {
        return;
    }
    let number = atomicAdd(&marks[SAMPLES_COUNT], 1u);
    if number >= beside.most_samples {
        return;
    }
    let texel = textureLoad(ids, p, 0).xy;
    let rest = textureLoad(rests, p, 0).xy;
    samples_out[6u * number] = at(p);
    samples_out[6u * number + 1u] = texel.x;
    samples_out[6u * number + 2u] = texel.y;
    samples_out[6u * number + 3u] = pack4x8unorm(textureLoad(colour, p, 0));
    samples_out[6u * number + 4u] = rest.x | (rest.y << 8u) | (pixels[at(p)].ends << 16u);
    samples_out[6u * number + 5u] = bitcast<u32>(textureLoad(depth, p, 0));
}
