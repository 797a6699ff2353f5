//! Spheres around objects, laid out to be tested many at a time.

use glam::DVec3;

/// Where an object is in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingSphere {
    /// The centre of a sphere around it, in metres.
    pub center: DVec3,
    /// The sphere's radius in metres.
    pub radius: f32,
}

impl BoundingSphere {
    /// Seen by nobody.
    pub const NOTHING: Self = Self { center: DVec3::ZERO, radius: f32::NEG_INFINITY };
}

/// The bounds of [`BoundingSpheres::COUNT`] objects, an array for each coordinate: what tests them reads no more than it needs, and
/// several with one instruction.
#[derive(Clone, Debug)]
pub struct BoundingSpheres {
    /// In metres, in the world.
    centers: [[f64; Self::COUNT]; 3],
    /// In metres.
    radii: [f32; Self::COUNT],
}

impl BoundingSpheres {
    /// How many there are.
    pub const COUNT: usize = 256;

    /// One of them.
    ///
    /// # Panics
    /// If there is no such sphere.
    #[inline]
    pub fn get(&self, entry: usize) -> BoundingSphere {
        let [x, y, z] = &self.centers;
        BoundingSphere { center: DVec3::new(x[entry], y[entry], z[entry]), radius: self.radii[entry] }
    }

    /// Changes one of them.
    ///
    /// # Panics
    /// If there is no such sphere.
    #[inline]
    pub fn set(&mut self, entry: usize, bounds: BoundingSphere) {
        for (coordinates, coordinate) in self.centers.iter_mut().zip(bounds.center.to_array()) {
            coordinates[entry] = coordinate;
        }
        self.radii[entry] = bounds.radius;
    }

    /// The centres' x, y and z, in metres in the world.
    pub fn coordinates(&self) -> &[[f64; Self::COUNT]; 3] {
        &self.centers
    }

    /// In metres.
    pub fn radii(&self) -> &[f32; Self::COUNT] {
        &self.radii
    }
}

impl Default for BoundingSpheres {
    /// Those of objects that nobody sees.
    fn default() -> Self {
        Self { centers: [[0.0; Self::COUNT]; 3], radii: [BoundingSphere::NOTHING.radius; Self::COUNT] }
    }
}
