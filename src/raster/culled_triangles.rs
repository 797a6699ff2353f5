//! How many triangles were culled, and why.

use std::ops::AddAssign;

/// The numbers of tested and of culled triangles; a culled triangle counts for the first reason that applies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CulledTriangles {
    /// All tested triangles.
    pub triangles: usize,
    /// Two corners coincide.
    pub degenerate: usize,
    /// All corners are beyond the near plane, the far plane or a side of the picture.
    pub off_screen: usize,
    /// The winding is the culled one.
    pub back_facing: usize,
    /// No pixel centre is covered.
    pub zero_size: usize,
}

impl CulledTriangles {
    /// The number of culled triangles.
    pub fn culled(&self) -> usize {
        self.degenerate + self.off_screen + self.back_facing + self.zero_size
    }

    /// The share of culled triangles, from 0 to 1; 0 if there are no triangles.
    pub fn share(&self) -> f64 {
        self.culled() as f64 / self.triangles.max(1) as f64
    }
}

impl AddAssign for CulledTriangles {
    fn add_assign(&mut self, other: Self) {
        self.triangles += other.triangles;
        self.degenerate += other.degenerate;
        self.off_screen += other.off_screen;
        self.back_facing += other.back_facing;
        self.zero_size += other.zero_size;
    }
}
