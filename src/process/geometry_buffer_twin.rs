//! The twin of `geometry_buffer.wgsl`.

use super::built_in::{rgb, with_alpha};
use super::surface_twin::{seen_diffuse, seen_normal, surface_corner};
use super::{Corner, GeometryFormats, ObjectPixel, ObjectTwin, ObjectValues, PassValues, VertexValues, ViewValues};
use crate::raster::{Real, Vector3, Vector4};

/// Fills in normal, diffuse and radiance.
#[derive(Clone, Copy, Debug)]
pub(super) struct GeometryBufferTwin {
    /// Of its targets.
    pub(super) formats: GeometryFormats,
}

/// Past this a half float would be infinite.
pub(super) const BRIGHTEST_STORED: f64 = 60_000.0;

impl<R: Real> ObjectTwin<R> for GeometryBufferTwin {
    fn vertex(&self, view: &ViewValues<R>, object: &ObjectValues<R>, vertex: &VertexValues<R>) -> Corner<R> {
        surface_corner(view, object, vertex)
    }

    fn fragment(&self, pass: &PassValues<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let material = pass.materials.get(pixel.material);
        let normal = seen_normal(pass.view, pixel, &material);
        let diffuse = rgb(seen_diffuse(pass, pixel, &material));
        let radiance = material.emission + diffuse * pass.view.ambient;
        let storable = |color: Vector3<R>| color.map(|value| value.min(R::of(BRIGHTEST_STORED)));
        let outputs = [
            self.formats.stored_normal(normal),
            with_alpha(storable(diffuse), R::one()),
            with_alpha(storable(radiance), R::one()),
        ];
        for (target, output) in targets.iter_mut().zip(outputs) {
            *target = output;
        }
        true
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;
    use crate::process::twin::TwinShader;
    use crate::process::twin_samples::{material, pass, view_values, views};
    use crate::process::{Format, GeometryBuffer, RenderProcess, VARYINGS};
    use crate::raster::Vector;
    use crate::scene::Blend;

    #[test]
    fn it_stores_what_lighting_needs_in_the_order_declared() {
        let view = view_values::<f64>(&views()[0]);
        let mut material = material::<f64>(Blend::None);
        material.0.emission = Vector([0.0, 0.5, 1e9]);
        let normal = Vector([0.48, 0.6, 0.64]);
        let pixel = ObjectPixel {
            place: [0, 0],
            varyings: [0.0, 0.0, -4.0, normal[0], normal[1], normal[2], 0.5, 1.0, 0.0],
            across: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.25, 0.0, 0.0],
            down: [0.0; VARYINGS],
            material: 0,
        };
        for (format, bound) in [(Format::Rg16Float, 1e-15), (Format::Rgba8Unorm, 1e-4), (Format::Rg8Unorm, 0.02)] {
            let formats = GeometryFormats { normal: format, ..GeometryFormats::default() };
            let twin = GeometryBuffer::new(formats).twin().unwrap();
            let TwinShader::Objects(twin) = twin.double else { panic!("it draws objects") };
            let mut targets = [Vector::zero(); 3];
            assert!(twin.draws_pixels() && twin.fragment(&pass(&view, &material, &[]), &pixel, &mut targets));
            assert!((formats.normal_of_stored(targets[0]) - normal).length() < bound);
            assert_eq!(targets[1], Vector([0.25, 0.25, 0.25, 1.0]));
            assert_eq!(targets[2], Vector([0.25 * view.ambient[0], 0.5 + 0.25 * view.ambient[1], 60_000.0, 1.0]));
        }
    }
}
