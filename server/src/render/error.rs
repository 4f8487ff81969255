//! Why a scene cannot be drawn.

/// See the module.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// Ids have 16 bits.
    #[error("the scene has {0} instances; at most 65535 can be told apart")]
    TooManyInstances(usize),
    /// Ids have 32 bits.
    #[error("the scene has {0} triangles with its instances counted; at most 4294967294 can be told apart")]
    TooManyTriangles(u64),
    /// The device's limit.
    #[error("{what} of the scene take {bytes} bytes; this GPU takes {limit}")]
    TooLarge {
        /// What is too large.
        what: &'static str,
        /// How large.
        bytes: u64,
        /// The limit.
        limit: u64,
    },
    /// Triangles that no hierarchy of a few levels holds apart.
    #[error("the scene's triangles need {levels} levels of boxes to be told apart by rays; {limit} can be followed")]
    TooDeep {
        /// How many.
        levels: usize,
        /// The limit.
        limit: usize,
    },
    /// Rays were not asked for when the scene was uploaded.
    #[error("this method follows rays, which the scene was not prepared for")]
    NoRays,
    /// The GPU has no compute shaders.
    #[error("this camera cuts triangles in compute shaders, which this GPU does not have")]
    NoCompute,
    /// A snapshot of another scene.
    #[error("the snapshot has {found} instances, the scene {expected}")]
    OtherScene {
        /// Of the snapshot.
        found: usize,
        /// Of the scene.
        expected: usize,
    },
    /// More images in one set than the redundancy test takes, or none.
    #[error("{images} images in one set; 1 to {most} can be made")]
    ImageCount {
        /// How many were asked for.
        images: usize,
        /// The limit.
        most: usize,
    },
    /// A camera that is not valid, or larger than the GPU's textures.
    #[error("a camera of {width_px}x{height_px} pixels cannot be drawn")]
    Camera {
        /// Its width.
        width_px: u32,
        /// Its height.
        height_px: u32,
    },
    /// A mistake in the program's shaders.
    #[error(transparent)]
    Shader(#[from] shaders::ShaderError),
    /// Bytes did not come back.
    #[error(transparent)]
    Readback(#[from] gpu::ReadbackError),
    /// The device went away.
    #[error(transparent)]
    Gpu(#[from] gpu::GpuError),
}
