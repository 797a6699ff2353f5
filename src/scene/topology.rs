//! How indices form triangles.

/// How indices form triangles (M listing 10.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Topology {
    /// Every three indices form a triangle.
    #[default]
    TriangleList = 0,
    /// Every index from the third on forms a triangle with the two before it, with alternating winding.
    TriangleStrip = 1,
}
