//! Demonstration content: the project's own scene, and a camera and lights for scenes that come without.

mod bounds;
mod bvh;
mod camera;
mod colonnade;
#[cfg(test)]
mod frame_check;
mod lights;
mod outliers;
mod up_axis;
mod viewpoint;

pub use camera::{camera, camera_upright};
pub use colonnade::colonnade;
pub use lights::{AMBIENT, BACKGROUND, add_camera_and_lights, add_camera_and_lights_upright, lights};
pub use up_axis::UpAxis;
