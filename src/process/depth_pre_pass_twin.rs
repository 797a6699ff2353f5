//! The twin of `depth_pre_pass.wgsl`.

use super::{Corner, ObjectPixel, ObjectTwin, ObjectValues, PassValues, VARYINGS, VertexValues, ViewValues};
use crate::raster::{Real, Vector4};

/// Draws depth alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct DepthPrePassTwin;

impl<R: Real> ObjectTwin<R> for DepthPrePassTwin {
    fn vertex(&self, view: &ViewValues<R>, object: &ObjectValues<R>, vertex: &VertexValues<R>) -> Corner<R> {
        Corner { clip: view.clip_position(object.relative_position(vertex.position)), varyings: [R::zero(); VARYINGS] }
    }

    fn draws_pixels(&self) -> bool {
        false
    }

    fn fragment(&self, _pass: &PassValues<'_, R>, _pixel: &ObjectPixel<R>, _targets: &mut [Vector4<R>]) -> bool {
        true
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use glam::{DQuat, DVec3};
    use proptest::prelude::*;

    use super::*;
    use crate::process::GeometryFormats;
    use crate::process::geometry_buffer_twin::GeometryBufferTwin;
    use crate::process::twin_samples::{view_values, views};
    use crate::raster::{Quaternion, Vector, Vector3};

    proptest! {
           /// What the geometry buffer draws after it has to have just this depth.
           #[test]
           fn its_corners_are_those_of_the_geometry_buffer_to_the_bit(
               position in prop::array::uniform3(-9.0..9.0_f64),
               origin in prop::array::uniform3(-99.0..99.0_f64),
               turn in prop::array::uniform3(-3.0..3.0_f64),
           ) {
               let object = ObjectValues {
    camera: Vector3::zero(),
                   origin: Vector3::<f32>::of(origin.into()),
                   orientation: Quaternion::of(DQuat::from_scaled_axis(turn.into())),
                   scale: Vector3::of(DVec3::new(0.3, -7.0, 1.0)),
                   material: 0,
               };
               let vertex = VertexValues { position: Vector3::of(position.into()), normal: Vector::zero(), uv: Vector::zero() };
               for view in views() {
                   let view = view_values(&view);
                   let [pre_pass, buffer]: [Corner<f32>; 2] = [
                       DepthPrePassTwin.vertex(&view, &object, &vertex),
                       GeometryBufferTwin { formats: GeometryFormats::default() }.vertex(&view, &object, &vertex),
                   ];
                   prop_assert_eq!(pre_pass.clip.0.map(f32::to_bits), buffer.clip.0.map(f32::to_bits));
               }
           }
       }

    #[test]
    fn it_draws_no_pixels() {
        assert!(!ObjectTwin::<f32>::draws_pixels(&DepthPrePassTwin));
    }
}
