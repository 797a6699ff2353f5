//! Vectors of any [`Real`]: glam has one type for each number.

use std::array::from_fn;
use std::ops::{Add, Index, IndexMut, Mul, Neg, Sub};

use glam::{DQuat, DVec3, Vec3};

use super::Real;

/// A vector of `N` numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vector<R, const N: usize>(pub [R; N]);

/// A place in a picture, or of a texture.
pub type Vector2<R> = Vector<R, 2>;
/// A place, a direction or a colour.
pub type Vector3<R> = Vector<R, 3>;
/// A place in clip space, or a colour with its opacity.
pub type Vector4<R> = Vector<R, 4>;

impl<R: Real, const N: usize> Vector<R, N> {
    /// All numbers 0.
    pub fn zero() -> Self {
        Self::splat(R::zero())
    }

    /// All numbers the same.
    pub fn splat(value: R) -> Self {
        Self([value; N])
    }

    /// Each number turned into another.
    pub fn map(self, change: impl FnMut(R) -> R) -> Self {
        Self(self.0.map(change))
    }

    /// Each pair of numbers turned into one.
    pub fn with(self, other: Self, mut join: impl FnMut(R, R) -> R) -> Self {
        Self(from_fn(|axis| join(self.0[axis], other.0[axis])))
    }

    /// The sum of the products.
    pub fn dot(self, other: Self) -> R {
        (0..N).fold(R::zero(), |sum, axis| sum + self.0[axis] * other.0[axis])
    }

    /// How long it is.
    pub fn length(self) -> R {
        self.dot(self).sqrt()
    }

    /// The same direction at unit length; not a number where there is no direction.
    pub fn normalized(self) -> Self {
        self * (R::one() / self.length())
    }
}

impl<R: Real> Vector3<R> {
    /// From three numbers.
    pub fn new(x: R, y: R, z: R) -> Self {
        Self([x, y, z])
    }

    /// The vector at right angles to both, as long as the parallelogram between them is large.
    pub fn cross(self, other: Self) -> Self {
        let [a, b, c] = self.0;
        let [x, y, z] = other.0;
        Self([b * z - c * y, c * x - a * z, a * y - b * x])
    }

    /// The nearest to a vector of f64.
    pub fn of(vector: DVec3) -> Self {
        Self(vector.to_array().map(R::of))
    }

    /// The nearest to a vector of f32.
    pub fn of_single(vector: Vec3) -> Self {
        Self::of(vector.as_dvec3())
    }
}

impl<R: Real, const N: usize> Default for Vector<R, N> {
    fn default() -> Self {
        Self::zero()
    }
}

impl<R: Real, const N: usize> Add for Vector<R, N> {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        self.with(other, |one, other| one + other)
    }
}

impl<R: Real, const N: usize> Sub for Vector<R, N> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self.with(other, |one, other| one - other)
    }
}

impl<R: Real, const N: usize> Mul for Vector<R, N> {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        self.with(other, |one, other| one * other)
    }
}

impl<R: Real, const N: usize> Mul<R> for Vector<R, N> {
    type Output = Self;

    fn mul(self, factor: R) -> Self {
        self.map(|value| value * factor)
    }
}

impl<R: Real, const N: usize> Neg for Vector<R, N> {
    type Output = Self;

    fn neg(self) -> Self {
        self.map(|value| -value)
    }
}

impl<R, const N: usize> Index<usize> for Vector<R, N> {
    type Output = R;

    fn index(&self, axis: usize) -> &R {
        &self.0[axis]
    }
}

impl<R, const N: usize> IndexMut<usize> for Vector<R, N> {
    fn index_mut(&mut self, axis: usize) -> &mut R {
        &mut self.0[axis]
    }
}

/// A rotation: x, y, z, w.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quaternion<R>(pub [R; 4]);

impl<R: Real> Quaternion<R> {
    /// The nearest to a rotation in f64.
    pub fn of(rotation: DQuat) -> Self {
        Self(rotation.to_array().map(R::of))
    }

    /// The way back.
    pub fn inverse(self) -> Self {
        let [x, y, z, w] = self.0;
        Self([-x, -y, -z, w])
    }

    /// Turns a vector; the rotation is of unit length.
    pub fn rotate(self, vector: Vector3<R>) -> Vector3<R> {
        let [x, y, z, w] = self.0;
        let axis = Vector3::new(x, y, z);
        let twice = axis.cross(vector) * R::of(2.0);
        vector + twice * w + axis.cross(twice)
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use glam::DQuat;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn it_is_glam_in_f64(one in prop::array::uniform3(-9.0..9.0_f64), other in prop::array::uniform3(-9.0..9.0_f64)) {
            let (a, b) = (DVec3::from(one), DVec3::from(other));
            let (ours_a, ours_b) = (Vector3::<f64>::of(a), Vector3::<f64>::of(b));
            prop_assert_eq!(ours_a.cross(ours_b), Vector3::of(a.cross(b)));
            prop_assert!((ours_a.dot(ours_b) - a.dot(b)).abs() < 1e-12);
            let turn = DQuat::from_scaled_axis(a);
            let turned = Quaternion::<f64>::of(turn).rotate(ours_b);
            prop_assert!((turned - Vector3::of(turn * b)).length() < 1e-12);
            let back = Quaternion::<f64>::of(turn).inverse().rotate(turned);
            prop_assert!((back - ours_b).length() < 1e-12);
        }
    }
}
