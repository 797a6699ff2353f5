//! Bounding spheres in f32, which the techniques on several threads cull eight at a time.

use drawloom::glam::{Mat4, Vec4};
use multiversion::multiversion;

use crate::objects::Sphere;

/// The number of objects in a group.
pub const LANES: usize = 8;

/// Bounding spheres of [`LANES`] objects, an array for each coordinate. Lanes without an object have a negative radius.
#[derive(Clone, Copy)]
pub struct SphereGroup {
    x: [f32; LANES],
    y: [f32; LANES],
    z: [f32; LANES],
    radius: [f32; LANES],
}

impl SphereGroup {
    pub const EMPTY: Self = Self { x: [0.0; LANES], y: [0.0; LANES], z: [0.0; LANES], radius: [-1.0; LANES] };

    /// Sets the sphere of a lane.
    pub fn set(&mut self, lane: usize, &Sphere { center, radius }: &Sphere) {
        let [x, y, z] = center.as_vec3().to_array();
        (self.x[lane], self.y[lane], self.z[lane], self.radius[lane]) = (x, y, z, radius);
    }

    /// A mask of the spheres that a camera with these planes sees.
    #[allow(clippy::needless_range_loop)] // Such a loop compiles to vector instructions.
    #[inline(always)]
    pub fn visible(&self, planes: &Planes) -> u32 {
        let mut nearest = [f32::INFINITY; LANES];
        for plane in planes {
            for lane in 0..LANES {
                let distance = plane.x * self.x[lane] + plane.y * self.y[lane] + plane.z * self.z[lane] + plane.w;
                nearest[lane] = if distance < nearest[lane] { distance } else { nearest[lane] };
            }
        }
        (0..LANES).fold(0, |mask, lane| {
            let sees = (self.radius[lane] >= 0.0) & (nearest[lane] >= -self.radius[lane]);
            mask | u32::from(sees) << lane
        })
    }
}

/// The planes of a camera that sees to infinity: inward normals of unit length, and distances.
pub type Planes = [Vec4; 5];

/// The planes of a camera (Gribb and Hartmann, 2001).
pub fn planes(clip_from_world: &Mat4) -> Planes {
    let [x, y, z, w] = [0, 1, 2, 3].map(|row| clip_from_world.row(row));
    [w + x, w - x, w + y, w - y, w - z].map(|plane| plane / plane.truncate().length())
}

/// The objects that a camera sees, of groups from the group `first` on, in the order of the scene.
#[inline(always)]
pub fn visible_objects(groups: &[SphereGroup], first: usize, planes: &Planes) -> impl Iterator<Item = usize> {
    groups.iter().enumerate().flat_map(move |(index, group)| {
        let mut mask = group.visible(planes);
        std::iter::from_fn(move || {
            let lane = mask.trailing_zeros() as usize;
            (mask != 0).then(|| {
                mask &= mask - 1;
                (first + index) * LANES + lane
            })
        })
    })
}

/// Appends the objects that a camera sees, of groups from the group `first` on, in their order.
#[multiversion(targets("x86_64+avx2"))]
pub fn append_visible(groups: &[SphereGroup], first: usize, planes: &Planes, visible: &mut Vec<u32>) {
    for (index, group) in groups.iter().enumerate() {
        let mut mask = group.visible(planes);
        while mask != 0 {
            visible.push(((first + index) * LANES) as u32 + mask.trailing_zeros());
            mask &= mask - 1;
        }
    }
}
