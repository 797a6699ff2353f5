//! Demonstration content, behind the feature `demo`: a scene, and a camera and lights for scenes that come without.
//!
//! Drawloom's own examples, tests and benchmarks draw it. An engine has content of its own and leaves the feature off.

mod bounds;
mod bvh;
mod camera;
mod colonnade;
mod lights;
mod outliers;
mod up_axis;
mod viewpoint;

pub use camera::{camera, camera_upright};
pub use colonnade::colonnade;
pub use lights::{AMBIENT, BACKGROUND, add_camera_and_lights, add_camera_and_lights_upright, lights};
pub use up_axis::UpAxis;
