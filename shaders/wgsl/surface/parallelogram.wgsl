// A small piece of surface in the image of a frame: the twin of `surface::parallelograms`.
struct Parallelogram {
    // (u, v, w) of its middle, pixels from the frame's centre; then what is added to w before it is compared. w is 0 where there is none.
    middle: vec4f,
    // From the middle to the middles of two sides, (u, v, w).
    right: vec4f,
    down: vec4f,
}
