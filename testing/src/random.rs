//! Random numbers that are the same on every machine.

use std::f64::consts::TAU;

use drawloom::glam::{DVec3, Vec3};

/// A mixed Weyl sequence.
pub struct Random(u64);

impl Default for Random {
    fn default() -> Self {
        Self::new()
    }
}

impl Random {
    pub fn new() -> Self {
        Self::stream(0)
    }

    /// One of many sequences, for parallel work: results do not depend on which worker uses which.
    pub fn stream(number: u64) -> Self {
        Self(0x5eed_d1a3_0000_0001_u64.wrapping_add(number.wrapping_mul(0xd134_2543_de82_ef95)))
    }

    /// A number from `low` to `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A number below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }

    /// A vector with coordinates from `low` to `high`.
    pub fn vector(&mut self, low: f64, high: f64) -> Vec3 {
        DVec3::from_array([(); 3].map(|()| self.between(low, high))).as_vec3()
    }

    /// A vector of unit length.
    pub fn direction(&mut self) -> DVec3 {
        let (height, turn) = (self.between(-1.0, 1.0), self.between(0.0, TAU));
        let across = (1.0 - height * height).sqrt();
        DVec3::new(across * turn.cos(), height, across * turn.sin())
    }

    /// The numbers below `count` in random order.
    pub fn order(&mut self, count: usize) -> Vec<usize> {
        let mut order: Vec<_> = (0..count).collect();
        for index in (1..count).rev() {
            order.swap(index, self.below(index + 1));
        }
        order
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 32)).wrapping_mul(0xd6e8_feb8_6659_fd93);
        mixed ^ (mixed >> 29)
    }
}
