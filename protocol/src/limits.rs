//! Caps on everything that comes from the other end. Decoders take them first; nothing is allocated because a header claims it.

/// What a decoder accepts at most. The defaults suit a client; a server's own limits on messages are the same.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// One message from a client. Poses stay under 200 bytes; the largest is a `Hello` that names as many parts as it may.
    pub client_message_bytes: usize,
    /// One message from a server: a fragment of [`crate::wire::FRAGMENT_BYTES`] with its header, or a welcome.
    pub server_message_bytes: usize,
    /// One update, reassembled from its fragments.
    pub update_bytes: usize,
    /// Edits of one update.
    pub update_edits: usize,
    /// Width and height of one image.
    pub image_side_px: u32,
    /// Pixels of all images of one update: bounds the masks, which cost a bit a pixel.
    pub update_pixels: usize,
    /// Samples of all patches of one update, also addresses of deletes and trims.
    pub update_samples: usize,
    /// Ways of objects of one update ([`crate::Edit::Shift`]), all together.
    pub update_shifts: usize,
    /// Samples of the whole held copy; one costs ten bytes, one more in images with reflectors, two where surfaces end, and one when trimmed.
    pub held_samples: usize,
    /// Pixels of all masks of the held copy.
    pub held_pixels: usize,
    /// Patches of the held copy.
    pub held_patches: usize,
    /// Vertices of all bodies of one update, and of all that are held.
    pub body_vertices: usize,
    /// Indices of the same.
    pub body_indices: usize,
    /// Numbers of what bones do, of the same.
    pub body_clip_numbers: usize,
    /// Entries of the material table; samples name them by one byte.
    pub materials: usize,
}

impl Default for Limits {
    /// An update of one 4096x4096 image, and a held copy of four of them.
    fn default() -> Self {
        Limits {
            client_message_bytes: 1024,
            server_message_bytes: 48 * 1024,
            update_bytes: 64 << 20,
            update_edits: 1 << 17,
            image_side_px: 8192,
            update_pixels: 1 << 26,
            update_samples: 1 << 24,
            // One for each id.
            update_shifts: 1 << 16,
            held_samples: 1 << 26,
            held_pixels: 1 << 31,
            held_patches: 1 << 17,
            body_vertices: 1 << 20,
            body_indices: 3 << 20,
            body_clip_numbers: 1 << 22,
            materials: 256,
        }
    }
}
