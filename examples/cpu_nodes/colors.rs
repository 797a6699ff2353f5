//! Colours and light, for the materials of objects and for rays.

use drawloom::glam::Vec3;

pub const LAND: Vec3 = Vec3::new(0.32, 0.42, 0.18);
pub const CREATURE: Vec3 = Vec3::new(0.75, 0.25, 0.3);
pub const WALKER: Vec3 = Vec3::new(0.25, 0.4, 0.75);
pub const FRAME: Vec3 = Vec3::new(0.35, 0.25, 0.15);
pub const SKY: Vec3 = Vec3::new(0.45, 0.6, 0.85);
pub const AMBIENT: Vec3 = Vec3::new(0.2, 0.24, 0.3);

/// The illuminance of the sun, and the direction of its rays, of unit length.
pub const SUN: Vec3 = Vec3::new(2.6, 2.4, 2.0);
pub const SUN_DIRECTION: Vec3 = Vec3::new(-0.394, -0.788, -0.473);

/// Width, height and depth of a walker, in metres.
pub const WALKER_SIZE: Vec3 = Vec3::new(0.5, 0.9, 0.3);
