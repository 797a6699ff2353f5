//! Vectors of any [`Real`], because glam's vectors are not generic.
//!
//! CPU shaders spend much of their time here. Where crates are built in several units and without link-time
//! optimisation, as in a debug build with optimisations, only functions that are marked are inlined across units. Those
//! of the standard library that map arrays are not, so `map` and `with` loop.

use std::ops::{Add, Index, IndexMut, Mul, Neg, Sub};

use glam::{DQuat, DVec3, Vec3};

use super::Real;

/// A vector of `N` numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vector<R, const N: usize>(pub [R; N]);

/// A position in a picture or a texture.
pub type Vector2<R> = Vector<R, 2>;
/// A position, a direction or a colour.
pub type Vector3<R> = Vector<R, 3>;
/// A clip-space position, or a colour with opacity.
pub type Vector4<R> = Vector<R, 4>;

impl<R: Real, const N: usize> Vector<R, N> {
    /// The zero vector.
    #[inline]
    pub fn zero() -> Self {
        Self::splat(R::zero())
    }

    /// A vector whose components all equal `value`.
    #[inline]
    pub fn splat(value: R) -> Self {
        Self([value; N])
    }

    /// Applies a function to each component.
    #[inline]
    pub fn map(mut self, mut change: impl FnMut(R) -> R) -> Self {
        for number in &mut self.0 {
            *number = change(*number);
        }
        self
    }

    /// Combines two vectors component by component.
    #[inline]
    pub fn with(mut self, other: Self, mut join: impl FnMut(R, R) -> R) -> Self {
        for axis in 0..N {
            self.0[axis] = join(self.0[axis], other.0[axis]);
        }
        self
    }

    /// The dot product.
    #[inline]
    pub fn dot(self, other: Self) -> R {
        (0..N).fold(R::zero(), |sum, axis| sum + self.0[axis] * other.0[axis])
    }

    /// The length.
    #[inline]
    pub fn length(self) -> R {
        self.dot(self).sqrt()
    }

    /// The vector scaled to unit length; NaN for the zero vector.
    #[inline]
    pub fn normalized(self) -> Self {
        self * (R::one() / self.length())
    }
}

impl<R: Real> Vector3<R> {
    /// Creates a vector from its components.
    #[inline]
    pub fn new(x: R, y: R, z: R) -> Self {
        Self([x, y, z])
    }

    /// The cross product.
    #[inline]
    pub fn cross(self, other: Self) -> Self {
        let [a, b, c] = self.0;
        let [x, y, z] = other.0;
        Self([b * z - c * y, c * x - a * z, a * y - b * x])
    }

    /// Rounds a vector of f64.
    #[inline]
    pub fn of(vector: DVec3) -> Self {
        Self(vector.to_array().map(R::of))
    }

    /// Converts a vector of f32.
    #[inline]
    pub fn of_single(vector: Vec3) -> Self {
        Self::of(vector.as_dvec3())
    }
}

impl<R: Real, const N: usize> Default for Vector<R, N> {
    #[inline]
    fn default() -> Self {
        Self::zero()
    }
}

impl<R: Real, const N: usize> Add for Vector<R, N> {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        self.with(other, |one, other| one + other)
    }
}

impl<R: Real, const N: usize> Sub for Vector<R, N> {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        self.with(other, |one, other| one - other)
    }
}

impl<R: Real, const N: usize> Mul for Vector<R, N> {
    type Output = Self;

    #[inline]
    fn mul(self, other: Self) -> Self {
        self.with(other, |one, other| one * other)
    }
}

impl<R: Real, const N: usize> Mul<R> for Vector<R, N> {
    type Output = Self;

    #[inline]
    fn mul(self, factor: R) -> Self {
        self.map(|value| value * factor)
    }
}

impl<R: Real, const N: usize> Neg for Vector<R, N> {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        self.map(|value| -value)
    }
}

impl<R, const N: usize> Index<usize> for Vector<R, N> {
    type Output = R;

    #[inline]
    fn index(&self, axis: usize) -> &R {
        &self.0[axis]
    }
}

impl<R, const N: usize> IndexMut<usize> for Vector<R, N> {
    #[inline]
    fn index_mut(&mut self, axis: usize) -> &mut R {
        &mut self.0[axis]
    }
}

/// A rotation as a quaternion: x, y, z, w.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quaternion<R>(pub [R; 4]);

impl<R: Real> Quaternion<R> {
    /// Rounds a quaternion of f64.
    #[inline]
    pub fn of(rotation: DQuat) -> Self {
        Self(rotation.to_array().map(R::of))
    }

    /// The inverse of a unit quaternion.
    #[inline]
    pub fn inverse(self) -> Self {
        let [x, y, z, w] = self.0;
        Self([-x, -y, -z, w])
    }

    /// Rotates a vector; the quaternion must have unit length.
    #[inline]
    pub fn rotate(self, vector: Vector3<R>) -> Vector3<R> {
        let [x, y, z, w] = self.0;
        let axis = Vector3::new(x, y, z);
        let twice = axis.cross(vector) * R::of(2.0);
        vector + twice * w + axis.cross(twice)
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn results_in_f64_equal_those_of_glam(one in prop::array::uniform3(-9.0..9.0_f64), other in prop::array::uniform3(-9.0..9.0_f64)) {
            let (a, b) = (DVec3::from(one), DVec3::from(other));
            let (ours_a, ours_b) = (Vector3::<f64>::of(a), Vector3::<f64>::of(b));
            prop_assert_eq!(ours_a.cross(ours_b), Vector3::of(a.cross(b)));
            prop_assert!((ours_a.dot(ours_b) - a.dot(b)).abs() < 1e-12);
            if a.length() > 1e-3 {
                prop_assert!((ours_a.normalized() - Vector3::of(a.normalize())).length() < 1e-12);
            }
            let rotation = DQuat::from_scaled_axis(a);
            let turned = Quaternion::<f64>::of(rotation).rotate(ours_b);
            prop_assert!((turned - Vector3::of(rotation * b)).length() < 1e-12);
            let back = Quaternion::<f64>::of(rotation).inverse().rotate(turned);
            prop_assert!((back - ours_b).length() < 1e-12);
        }
    }
}
