// Triangles cut into so many pieces that the image of none bows by more than a quarter of a pixel; the rules and the
// bound are derived in the server's `impostors::spoc`.
#import "server/pull.wgsl"
#import "camera/spoc.wgsl"

struct Split {
    push: Push,
    item_count: u32,
    run_count: u32,
    // The most pieces of an edge.
    level_cap: u32,
    padding: u32,
}

// A triangle of an instance.
struct Item {
    instance: u32,
    // The place of its first corner in the index buffer.
    first_corner: u32,
    // Pieces along its edges, a byte each, from the lowest: from the first corner to the second, to the third, and
    // back. The last byte is for the inside: no less than any edge; 0 where nothing of it is seen.
    levels: u32,
}

@group(3) @binding(0) var<uniform> split: Split;

fn level_inside(levels: u32) -> u32 {
    return levels >> 24u;
}

// How many pieces a triangle has.
fn piece_count(item: Item) -> u32 {
    let level = level_inside(item.levels);
    return level * level;
}
