//! Caps on what a file can make the loader do, and how it tells how far it is.

/// Caps on sizes that a file claims. Each is checked before memory is taken for it.
///
/// Together they bound the memory of a load: at most `3 * file_bytes` for the file, what it refers to and what is
/// decompressed from it, 64 bytes a JSON value, 300 bytes a vertex, 150 bytes a triangle, 12 bytes a texture pixel,
/// 3,000 bytes a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LoadLimits {
    /// Bytes of the scene file, of all files that it refers to, and of all buffers after decompression: each of the three.
    pub file_bytes: u64,
    /// Values in a JSON text: numbers, strings, arrays, objects.
    pub json_values: u64,
    /// Nodes of a hierarchy.
    pub nodes: u64,
    /// Nodes from a root to a leaf.
    pub depth: u64,
    /// Vertices stored: each morph target of a vertex counts as one more. As many again of parts that are put together.
    pub vertices: u64,
    /// Triangles stored (instances do not count). As many again of parts that are put together.
    pub triangles: u64,
    /// Points and lines drawn, each as a solid of six vertices; where there are more, every n-th is drawn.
    pub points: u64,
    /// Pixels of all textures.
    pub texture_pixels: u64,
    /// Numbers in all keyframes of an animation.
    pub keyframe_values: u64,
    /// Parts of a file that are drawn.
    pub instances: u64,
    /// Objects of a scene, whose ids have 16 bits: where a file has more parts, some of them are put together.
    pub objects: u64,
}

impl Default for LoadLimits {
    fn default() -> Self {
        LoadLimits {
            file_bytes: 1 << 30,
            json_values: 1 << 23,
            nodes: 1 << 20,
            depth: 1 << 10,
            vertices: 1 << 25,
            triangles: 1 << 25,
            points: 1 << 20,
            texture_pixels: 1 << 28,
            keyframe_values: 1 << 26,
            instances: 1 << 20,
            objects: 65_535,
        }
    }
}

/// What the loader is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Reading files.
    Read,
    /// Decoding images.
    Textures,
    /// Building meshes.
    Meshes,
    /// Measuring the scene.
    Finish,
}

/// How far the loader is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// What is being done.
    pub stage: Stage,
    /// Of the stage, 0 to 1.
    pub share: f64,
}
