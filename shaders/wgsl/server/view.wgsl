// The camera of the pass: every file that names it imports this one.
#import "camera/pinhole.wgsl"

@group(0) @binding(0) var<uniform> camera: Pinhole;
