// What a level of the fill pyramid makes of four texels. What a hole shows is most likely what the nearer surface beside it hid: the
// farther one, if it goes on there.

// Surfaces within this factor of the farthest count as the farther surface.
const SAME_SURFACE: f32 = 1.25;

struct Level {
    // sRGB-encoded colour of the farther surface (zero where nothing is covered), and the share that is covered.
    @location(0) colour: vec4f,
    // Of the farther surface: 1/z, and how much more of its border to what is not covered goes on than ends (`client/pull_first.wgsl`).
    @location(1) w_open: vec2f,
}

fn level_of(colours: array<vec4f, 4>, w_open: array<vec2f, 4>) -> Level {
    var farthest = 3.4e38;
    var share = 0.0;
    for (var i = 0; i < 4; i++) {
        share += 0.25 * colours[i].a;
        if colours[i].a > 0.0 {
            farthest = min(farthest, w_open[i].x);
        }
    }
    var sum = vec4f(0.0);
    var w = 0.0;
    var open = 0.0;
    for (var i = 0; i < 4; i++) {
        if colours[i].a > 0.0 && w_open[i].x <= SAME_SURFACE * farthest {
            sum += vec4f(colours[i].rgb, 1.0) * colours[i].a;
            w += w_open[i].x * colours[i].a;
            open += 0.25 * w_open[i].y;
        }
    }
    if sum.a == 0.0 {
        return Level(vec4f(0.0), vec2f(0.0));
    }
    return Level(vec4f(sum.rgb / sum.a, share), vec2f(w / sum.a, open));
}
