//! The twin of `shadow_map.wgsl`.

use super::{Corner, ObjectPixel, ObjectTwin, ObjectValues, PassValues, VARYINGS, VertexValues, ViewValues};
use crate::raster::{Real, Vector4};
use crate::scene::Projection;

/// Draws the depth of what casts shadows.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShadowMapTwin {
    /// Whether there are hemispherical lights, whose maps must not show what is behind the light.
    pub(super) hemispheres: bool,
}

/// Who filters a map at the disc's rim looks a few pixels past it.
const PAST_THE_RIM: f64 = 0.05;

impl<R: Real> ObjectTwin<R> for ShadowMapTwin {
    fn vertex(&self, view: &ViewValues<R>, object: &ObjectValues<R>, vertex: &VertexValues<R>) -> Corner<R> {
        let relative = object.relative_position(vertex.position);
        let mut varyings = [R::zero(); VARYINGS];
        varyings[0] = match view.projection {
            Projection::Paraboloid => view.forward.dot(relative) / relative.length().max(R::of(1e-30)),
            _ => R::one(),
        };
        Corner { clip: view.clip_position(relative), varyings }
    }

    fn draws_pixels(&self) -> bool {
        self.hemispheres
    }

    /// A triangle behind a paraboloid whose corners lie all around its axis is drawn right across the picture, where it must
    /// not be.
    fn fragment(&self, _pass: &PassValues<'_, R>, pixel: &ObjectPixel<R>, _targets: &mut [Vector4<R>]) -> bool {
        let is_behind = pixel.varyings[0] < R::of(-PAST_THE_RIM);
        !is_behind
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;
    use crate::process::twin_samples::{material, paraboloid, pass, view_values, views};
    use crate::raster::{Quaternion, Vector, Vector3};
    use crate::scene::Blend;
    use crate::view::RenderView;

    fn is_drawn(view: &RenderView, place: impl Fn(&ViewValues<f64>) -> Vector3<f64>) -> bool {
        let view = view_values::<f64>(view);
        let object = ObjectValues {
            camera: Vector3::zero(),
            origin: place(&view),
            orientation: Quaternion([0.0, 0.0, 0.0, 1.0]),
            scale: Vector::splat(1.0),
            material: 0,
        };
        let vertex = VertexValues { position: Vector::zero(), normal: Vector::zero(), uv: Vector::zero() };
        let twin = ShadowMapTwin { hemispheres: true };
        let Corner { varyings, .. } = twin.vertex(&view, &object, &vertex);
        let pixel =
            ObjectPixel { place: [0, 0], varyings, across: [0.0; VARYINGS], down: [0.0; VARYINGS], material: 0 };
        twin.fragment(&pass(&view, &material(Blend::None), &[]), &pixel, &mut [])
    }

    #[test]
    fn what_is_behind_a_paraboloid_is_not_drawn() {
        let map = RenderView::new(&paraboloid());
        assert!(is_drawn(&map, |view| view.forward * 2.0));
        assert!(is_drawn(&map, |view| view.right * 2.0 - view.forward * 0.09), "just past the rim");
        assert!(!is_drawn(&map, |view| view.right * 2.0 - view.forward * 0.11));
        assert!(!is_drawn(&map, |view| view.forward * -2.0));
        assert!(is_drawn(&map, |_| Vector::zero()));
        assert!(is_drawn(&views()[1], |view| view.forward * -2.0), "other maps have nothing to leave out here");
    }

    #[test]
    fn only_hemispheres_cost_a_look_at_each_pixel() {
        for hemispheres in [false, true] {
            assert_eq!(ObjectTwin::<f32>::draws_pixels(&ShadowMapTwin { hemispheres }), hemispheres);
        }
    }
}
