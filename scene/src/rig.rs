//! [`Rig`]: an instance that bones alone bend, or move as a whole.

/// Which bones move the vertices of an instance's mesh, and for how long until they do the same again.
#[derive(Debug, Clone, PartialEq)]
pub struct Rig {
    /// The instance, which is its object id.
    pub instance: u32,
    /// How many bones there are.
    pub bones: usize,
    /// Of each vertex of its mesh, before bones move it: place and unit normal, relative to the mesh as places at rest are. Empty where that is the mesh itself.
    pub unbent: Vec<[[f32; 3]; 2]>,
    /// Whether each triangle is shaded as the plane that it is.
    pub is_flat: bool,
    /// Of each vertex of its mesh: up to four bones and their shares, which sum to 1. Empty where the first one moves all: the instance is rigid.
    pub influences: Vec<[(u32, f32); 4]>,
    /// Seconds from time 0 until everything begins again; 0 of what stands still.
    pub period_s: f64,
}
