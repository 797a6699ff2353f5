//! `surface.wgsl` in Rust: what CPU shaders that draw objects share.

use crate::process::cpu_shader::built_in::{inverse_square_root, rgb, sign, with_alpha};
use crate::process::{
    ObjectPixel, PassInputs, ShaderMaterial, ShaderObject, ShaderView, VARYINGS, VertexInput, VertexOutput, bounded_uv,
};
use crate::raster::{Real, Vector, Vector2, Vector3, Vector4};

/// The entry point `vertex`.
pub(in crate::process::deferred) fn surface_vertex<R: Real>(
    view: &ShaderView<R>,
    object: &ShaderObject<R>,
    vertex: &VertexInput<R>,
) -> VertexOutput<R> {
    let relative = object.relative_position(vertex.position);
    let normal = object.world_normal(vertex.normal);
    let mut varyings = uv_varyings(vertex);
    varyings[RELATIVE..RELATIVE + 3].copy_from_slice(&relative.0);
    varyings[NORMAL..NORMAL + 3].copy_from_slice(&normal.0);
    varyings[COLOR..COLOR + 3].copy_from_slice(&vertex.color.0);
    VertexOutput { clip: view.clip_position(relative), varyings }
}

/// The texture coordinates alone: what [`is_hole`] reads.
pub(in crate::process::deferred) fn uv_varyings<R: Real>(vertex: &VertexInput<R>) -> [R; VARYINGS] {
    let mut varyings = [R::zero(); VARYINGS];
    varyings[UV..UV + 2].copy_from_slice(&bounded_uv(vertex.uv).0);
    varyings
}

/// A pixel's position relative to the camera, along the world's axes.
pub(in crate::process::deferred) fn relative_of<R: Real>(pixel: &ObjectPixel<R>) -> Vector3<R> {
    three(&pixel.varyings, RELATIVE)
}

/// The normal of the visible side.
pub(in crate::process::deferred) fn shading_normal<R: Real>(
    view: &ShaderView<R>,
    pixel: &ObjectPixel<R>,
    material: &ShaderMaterial<R>,
) -> Vector3<R> {
    // The triangle's geometric normal, of either sign.
    let geometric = three(&pixel.dpdx, RELATIVE).cross(three(&pixel.dpdy, RELATIVE));
    // The visible side faces the camera, whatever the triangle's winding.
    let to_eye = view.direction_to_eye(relative_of(pixel));
    let facing = normalize_or(geometric * sign(geometric.dot(to_eye)), to_eye);
    let normal = normalize_or(three(&pixel.varyings, NORMAL), facing);
    if material.double_sided && normal.dot(facing) < R::zero() { -normal } else { normal }
}

/// The surface's diffuse colour and opacity. `has_colors` says whether vertices have colours.
pub(in crate::process::deferred) fn surface_diffuse<R: Real>(
    pass: &PassInputs<'_, R>,
    pixel: &ObjectPixel<R>,
    material: &ShaderMaterial<R>,
    has_colors: bool,
) -> Vector4<R> {
    let [uv, dpdx, dpdy] = [&pixel.varyings, &pixel.dpdx, &pixel.dpdy].map(uv_of);
    let diffuse = pass.diffuse_at(pixel.material, material, uv, dpdx, dpdy);
    if has_colors { with_alpha(rgb(diffuse) * three(&pixel.varyings, COLOR), diffuse[3]) } else { diffuse }
}

/// Whether a pixel is in a hole of its material's mask.
pub(in crate::process::deferred) fn is_hole<R: Real>(
    pass: &PassInputs<'_, R>,
    pixel: &ObjectPixel<R>,
    material: &ShaderMaterial<R>,
) -> bool {
    pass.is_cut_out(pixel.material, material, uv_of(&pixel.varyings))
}

// The index of each varying.
const RELATIVE: usize = 0;
const NORMAL: usize = 3;
const UV: usize = 6;
const COLOR: usize = 8;

fn three<R: Real>(varyings: &[R; VARYINGS], first: usize) -> Vector3<R> {
    Vector([varyings[first], varyings[first + 1], varyings[first + 2]])
}

fn uv_of<R: Real>(varyings: &[R; VARYINGS]) -> Vector2<R> {
    Vector([varyings[UV], varyings[UV + 1]])
}

/// A vector scaled to unit length, or another if it has no direction.
fn normalize_or<R: Real>(vector: Vector3<R>, other: Vector3<R>) -> Vector3<R> {
    let length_squared = vector.dot(vector);
    let has_direction = length_squared > R::zero() && length_squared < R::of(1e38);
    if has_direction { vector * inverse_square_root(length_squared) } else { other }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::process::MAX_ATTRIBUTES;
    use crate::process::cpu_shader::test_inputs::{material, pass, view_values, views};
    use crate::raster::Quaternion;
    use crate::scene::Blend;

    /// A pixel of a wall in front of the camera, whose texture repeats every metre.
    fn pixel(normal: [f64; 3]) -> ObjectPixel<f64> {
        let [x, y, z] = normal;
        ObjectPixel {
            coordinates: [0, 0],
            varyings: [0.5, 0.25, -4.0, x, y, z, 0.5, 0.25, 0.5, 1.0, 0.25],
            dpdx: [0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.0],
            dpdy: [0.0, -0.01, 0.0, 0.0, 0.0, 0.0, 0.0, -0.03, 0.0, 0.0, 0.0],
            material: 0,
            object: 0,
        }
    }

    #[test]
    fn varyings_carry_position_normal_texture_coordinates_and_colors() {
        let view = view_values::<f32>(&views()[0]);
        let object = ShaderObject {
            camera: Vector3::zero(),
            origin: Vector([0.0, 1.0, -5.0]),
            orientation: Quaternion([0.0, 0.0, 0.0, 1.0]),
            scale: Vector([2.0, 1.0, 1.0]),
            material: 3,
            index: 0,
        };
        let vertex = VertexInput {
            position: Vector([1.0, 1.0, 1.0]),
            normal: Vector([0.0, 0.0, 1.0]),
            uv: Vector([0.75, 0.5]),
            color: Vector([0.5, 0.25, 1.0]),
            attributes: [Vector::zero(); MAX_ATTRIBUTES],
        };
        let output = surface_vertex(&view, &object, &vertex);
        assert_eq!(output.clip, view.clip_position(Vector([2.0, 2.0, -4.0])));
        let pixel = ObjectPixel {
            coordinates: [0, 0],
            varyings: output.varyings,
            dpdx: [0.0; VARYINGS],
            dpdy: [0.0; VARYINGS],
            material: 3,
            object: 0,
        };
        assert_eq!(relative_of(&pixel), Vector([2.0, 2.0, -4.0]));
        let material = material(Blend::None);
        assert_eq!(shading_normal(&view, &pixel, &material.0), vertex.normal);
        let diffuse = |has_colors| surface_diffuse(&pass(&view, &material, &[]), &pixel, &material.0, has_colors);
        assert_eq!(diffuse(false), Vector([0.5 * 0.75, 0.25 * 0.5, 0.0, 0.5]));
        assert_eq!(diffuse(true), Vector([0.5 * 0.75 * 0.5, 0.25 * 0.5 * 0.25, 0.0, 0.5]));
    }

    #[test]
    fn normals_of_double_sided_materials_face_the_camera() {
        let view = view_values::<f64>(&views()[0]);
        let mut material = material::<f64>(Blend::None).0;
        let slanted = [0.6, 0.0, -0.8];
        assert!((shading_normal(&view, &pixel(slanted), &material) - Vector(slanted)).length() < 1e-15);
        material.double_sided = true;
        assert!((shading_normal(&view, &pixel(slanted), &material) + Vector(slanted)).length() < 1e-15);
        let facing = [0.6, 0.0, 0.8];
        assert!((shading_normal(&view, &pixel(facing), &material) - Vector(facing)).length() < 1e-15);
    }

    #[test]
    fn a_missing_normal_is_replaced_by_the_geometric_one_or_the_direction_to_the_eye() {
        let view = view_values::<f64>(&views()[0]);
        let material = material(Blend::None).0;
        let mut bare = pixel([0.0; 3]);
        assert_eq!(shading_normal(&view, &bare, &material), Vector([0.0, 0.0, 1.0]));
        (bare.dpdx, bare.dpdy) = (bare.dpdy, bare.dpdx);
        assert_eq!(shading_normal(&view, &bare, &material), Vector([0.0, 0.0, 1.0]), "wound the other way");
        bare.dpdx = [0.0; VARYINGS];
        let to_eye = view.direction_to_eye(relative_of(&bare));
        assert_eq!(shading_normal(&view, &bare, &material), to_eye);
        bare.varyings[NORMAL] = f64::NAN;
        assert_eq!(shading_normal(&view, &bare, &material), to_eye);
    }

    #[test]
    fn texture_sampling_uses_the_derivatives() {
        let view = view_values::<f64>(&views()[0]);
        let material = material(Blend::None);
        let diffuse = surface_diffuse(&pass(&view, &material, &[]), &pixel([0.0, 0.0, 1.0]), &material.0, false);
        assert_eq!(diffuse, Vector([0.5 * 0.5, 0.25 * 0.25, 0.01 - 0.03, 0.5]));
    }
}
