// Shadow maps of several of a lamp's points at once, drawn by scattering parallelograms: see `client::soft::warp`.
#import "surface/parallelogram.wgsl"
#import "client/compute/warp_points.wgsl"

@group(0) @binding(0) var<uniform> points: WarpPoints;
@group(0) @binding(1) var<storage, read> list: array<Parallelogram>;
// Bits of inverse depths, a map after the other; 0 where nothing casts.
@group(0) @binding(2) var<storage, read_write> maps: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read> kept: Kept;

// See `client/compute/reach.wgsl`.
struct Kept {
    small_count: u32,
    large_count: u32,
    small_groups: array<u32, 3>,
    large_groups: array<u32, 3>,
    places: array<u32>,
}

// A parallelogram that would cover more texels than this in a row or a column is cut.
const MOST_TEXELS: i32 = 24;

// Of parallelograms that no point sees larger than two texels: four are asked.
@compute @workgroup_size(64)
fn warp_small(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * points.row + id.x;
    if index >= kept.small_count {
        return;
    }
    let shape = list[kept.places[index]];
    let w = shape.middle.z;
    for (var point = 0u; point < points.point_count; point++) {
        let place = points.places[point];
        // An eye that stands aside sees everything shifted by its inverse depth.
        let middle = shape.middle.xy - place.xy * w + place.zw;
        let right = shape.right.xy - place.xy * shape.right.z;
        let down = shape.down.xy - place.xy * shape.down.z;
        let determinant = right.x * down.y - right.y * down.x;
        let scale = 1.0 / determinant;
        let first = vec2i(ceil(middle - abs(right) - abs(down) - 0.5));
        // At the first texel's centre; both lie in [-1, 1] inside.
        let way = vec2f(first) + 0.5 - middle;
        let st = vec2f(way.x * down.y - way.y * down.x, way.y * right.x - way.x * right.y) * scale;
        let by_x = vec2f(down.y, -right.y) * scale;
        let by_y = vec2f(-down.x, right.x) * scale;
        let rate = vec2f(shape.right.z, shape.down.z);
        let cast_w = w + shape.middle.w;
        // Writes cost the most: first which of the four texels are inside, a bit each, then those alone.
        var inside = 0u;
        for (var corner = 0u; corner < 4u; corner++) {
            let step = vec2u(corner & 1u, corner >> 1u);
            let at = st + f32(step.x) * by_x + f32(step.y) * by_y;
            // Texels below zero wrap to great ones.
            let is_inside = all(abs(at) <= vec2f(1.0)) && all(vec2u(first) + step < points.size_px);
            inside |= u32(is_inside) << corner;
        }
        while inside != 0u {
            let corner = firstTrailingBit(inside);
            inside &= inside - 1u;
            let step = vec2u(corner & 1u, corner >> 1u);
            let at = st + f32(step.x) * by_x + f32(step.y) * by_y;
            let texel = vec2u(first) + step;
            // Bits of floats above zero are in the order of the floats.
            let value = bitcast<u32>(max(cast_w + dot(at, rate), 0.0));
            atomicMax(&maps[(point * points.size_px.y + texel.y) * points.pitch + texel.x], value);
        }
    }
}

@compute @workgroup_size(64)
fn warp_large(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * points.row + id.x;
    if index >= kept.large_count {
        return;
    }
    let shape = list[kept.places[arrayLength(&kept.places) - 1u - index]];
    let w = shape.middle.z;
    for (var point = 0u; point < points.point_count; point++) {
        let place = points.places[point];
        let middle = shape.middle.xy - place.xy * w + place.zw;
        let right = shape.right.xy - place.xy * shape.right.z;
        let down = shape.down.xy - place.xy * shape.down.z;
        let determinant = right.x * down.y - right.y * down.x;
        let high = abs(right.y) + abs(down.y);
        let first_row = max(i32(ceil(middle.y - high - 0.5)), 0);
        let last_row = min(i32(floor(middle.y + high - 0.5)), min(i32(points.size_px.y) - 1, first_row + MOST_TEXELS));
        if first_row > last_row || determinant == 0.0 {
            continue;
        }
        // At a texel's centre, `way` from the middle, s = (way.x * down.y - way.y * down.x) / determinant, and t likewise; both lie in [-1, 1]
        // inside. Along a row each is between two places that lie evenly around one.
        let width = abs(vec2f(1.0 / down.y, 1.0 / right.y) * determinant);
        let lean = vec2f(down.x / down.y, right.x / right.y);
        let rate_w = vec2f(
            shape.right.z * down.y - shape.down.z * right.y,
            shape.down.z * right.x - shape.right.z * down.x,
        ) / determinant;
        let middle_w = w + shape.middle.w;
        // One loop over all texels: what has few rows does not wait for each row of what has many.
        var row = first_row - 1;
        var x = 0;
        var end = 0;
        var up = 0.0;
        loop {
            if x >= end {
                row++;
                if row > last_row {
                    break;
                }
                up = f32(row) + 0.5 - middle.y;
                // A side that lies along the rows bounds none of them: 1e9 is farther than any image is wide, and with that on top an i32 still holds it.
                let of_right = select(vec2f(-1e9, 1e9), up * lean.x + vec2f(-width.x, width.x), down.y != 0.0);
                let of_down = select(vec2f(-1e9, 1e9), up * lean.y + vec2f(-width.y, width.y), right.y != 0.0);
                let left = middle.x - 0.5 + max(of_right.x, of_down.x);
                let right_end = middle.x - 0.5 + min(of_right.y, of_down.y);
                x = max(i32(ceil(left)), 0);
                end = min(i32(floor(right_end)), min(i32(points.size_px.x) - 1, x + MOST_TEXELS)) + 1;
            }
            if x < end {
                let cast_w = middle_w + dot(rate_w, vec2f(f32(x) + 0.5 - middle.x, up));
                let texel = (point * points.size_px.y + u32(row)) * points.pitch + u32(x);
                atomicMax(&maps[texel], bitcast<u32>(max(cast_w, 0.0)));
                x++;
            }
        }
    }
}
