//! What rays are followed for.

/// See the module.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effects {
    /// Whether mirrors and glass are more than their base colours.
    pub reflections: bool,
    /// How often a ray is reflected or passes through glass.
    pub max_bounces: u8,
    /// Whether a reflector sees itself.
    pub self_reflection: bool,
    /// Whether surfaces hide lights.
    pub shadows: bool,
    /// Whether what is blended is seen through; else it is cut out where its alpha is below a half. What a mirror shows is never.
    pub blending: bool,
}

impl Effects {
    /// Every surface as its base colour, lit: what a server draws.
    pub const PLAIN: Effects =
        Effects { reflections: false, max_bounces: 0, self_reflection: false, shadows: false, blending: false };
    /// The same, seen through where it is blended.
    pub const BLENDED: Effects = Effects { blending: true, ..Effects::PLAIN };
    /// One bounce, a reflector does not see itself: what impostors can show.
    pub const ONE_BOUNCE: Effects =
        Effects { reflections: true, max_bounces: 1, self_reflection: false, shadows: false, blending: false };
}
