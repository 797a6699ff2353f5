//! Bounding spheres of objects as a structure of arrays, for SIMD culling.

use glam::DVec3;

use super::packet_columns::{LANES, Lanes};

/// A bounding sphere in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingSphere {
    /// The centre in metres.
    pub center: DVec3,
    /// The radius in metres.
    pub radius: f32,
}

impl BoundingSphere {
    /// The sphere that no frustum intersects.
    pub const EMPTY: Self = Self { center: DVec3::ZERO, radius: f32::NEG_INFINITY };
}

/// The bounding spheres of [`BoundingSpheres::COUNT`] objects, one array for each coordinate: a test loads only the
/// coordinates that it needs, and tests several spheres with one instruction.
#[derive(Clone, Debug)]
pub struct BoundingSpheres {
    /// World-space x, y and z in metres.
    centers: [[f64; Self::COUNT]; 3],
    /// In metres.
    radii: [f32; Self::COUNT],
}

impl BoundingSpheres {
    /// The number of spheres.
    pub const COUNT: usize = 256;

    /// Returns the sphere at `entry`.
    ///
    /// # Panics
    /// If `entry` is not below [`BoundingSpheres::COUNT`].
    #[inline]
    pub fn get(&self, entry: usize) -> BoundingSphere {
        let [x, y, z] = &self.centers;
        BoundingSphere { center: DVec3::new(x[entry], y[entry], z[entry]), radius: self.radii[entry] }
    }

    /// Replaces the sphere at `entry`.
    ///
    /// # Panics
    /// If `entry` is not below [`BoundingSpheres::COUNT`].
    #[inline]
    pub fn set(&mut self, entry: usize, bounds: BoundingSphere) {
        for (coordinates, coordinate) in self.centers.iter_mut().zip(bounds.center.to_array()) {
            coordinates[entry] = coordinate;
        }
        self.radii[entry] = bounds.radius;
    }

    /// Replaces the eight spheres from `entry` on.
    #[inline(always)]
    pub(super) fn set_packet(&mut self, entry: usize, centers: &[Lanes<f64>; 3], radii: &Lanes<f32>) {
        for (coordinates, new) in self.centers.iter_mut().zip(centers) {
            coordinates[entry..entry + LANES].copy_from_slice(new);
        }
        self.radii[entry..entry + LANES].copy_from_slice(radii);
    }

    /// The centres' world-space x, y and z in metres.
    pub fn coordinates(&self) -> &[[f64; Self::COUNT]; 3] {
        &self.centers
    }

    /// The radii in metres.
    pub fn radii(&self) -> &[f32; Self::COUNT] {
        &self.radii
    }
}

impl Default for BoundingSpheres {
    /// All spheres are [`BoundingSphere::EMPTY`].
    fn default() -> Self {
        Self { centers: [[0.0; Self::COUNT]; 3], radii: [BoundingSphere::EMPTY.radius; Self::COUNT] }
    }
}
