//! Vertices in 20 bytes instead of 32.

use glam::{DVec2, DVec3, Vec2, Vec3};
use half::f16;

use super::{Mesh, Vertex};

/// A vertex in the vertex buffer when vertices are [packed](crate::quality::VertexFormat::Packed). Vertex fetch costs
/// bandwidth, so vertices should be small (S 9.6). The device converts them to floats as it fetches them.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct PackedVertex {
    /// In object space, in metres: the same bits as in the [`Vertex`], so triangles cover the same pixels.
    pub position: [f32; 3],
    /// In object space, normalised, 127 for 1.0; the fourth is 0. A normal of 0 stays 0.
    pub normal: [i8; 4],
    /// Texture coordinates as bits of half floats, minus an integer offset that is the same for the whole mesh.
    pub uv: [u16; 2],
}

impl PackedVertex {
    /// Packs a vertex with texture coordinates relative to `uv_origin`, which are integers. Coordinates are clamped to
    /// the range of half floats, ±65,504.
    pub fn new(vertex: &Vertex, uv_origin: DVec2) -> Self {
        let normal = Vec3::from(vertex.normal).as_dvec3().normalize_or_zero();
        let [x, y, z] = (normal * NORMAL_SCALE).round().to_array().map(|component| component as i8);
        let uv = Vec2::from(vertex.uv).as_dvec2() - uv_origin;
        Self { position: vertex.position, normal: [x, y, z, 0], uv: uv.to_array().map(to_half_bits) }
    }

    /// The vertex as a shader sees it. The length of its normal is 1, but for rounding, or 0.
    pub fn unpacked(&self) -> Vertex {
        let [x, y, z, _] = self.normal.map(f64::from);
        let normal = DVec3::new(x, y, z) / NORMAL_SCALE;
        Vertex {
            position: self.position,
            normal: normal.as_vec3().to_array(),
            uv: self.uv.map(|bits| f16::from_bits(bits).to_f32()),
        }
    }
}

impl Mesh {
    /// The packed vertices. Textures repeat and half floats are most precise near 0, so texture coordinates are
    /// relative to the integers nearest to the middle of their range.
    /// [`VertexFormat::max_uv_error`](crate::quality::VertexFormat::max_uv_error) bounds the error.
    pub fn packed_vertices(&self) -> Vec<PackedVertex> {
        let uvs = || self.vertices().iter().map(|vertex| Vec2::from(vertex.uv).as_dvec2());
        let low = uvs().fold(DVec2::MAX, DVec2::min);
        let high = uvs().fold(DVec2::MIN, DVec2::max);
        let origin = (low * 0.5 + high * 0.5).round();
        self.vertices().iter().map(|vertex| PackedVertex::new(vertex, origin)).collect()
    }

    /// The mesh with vertices as a shader sees them after packing.
    #[cfg(feature = "software")]
    pub(crate) fn as_packed(&self) -> Self {
        let vertices = self.packed_vertices().iter().map(PackedVertex::unpacked).collect();
        Self::from_valid_parts(self.name().to_owned(), self.topology(), vertices, self.indices().to_vec())
            .with_attributes_of(self, &[])
            .with_levels_of(self)
    }
}

/// The packed value of 1.0 in a normal.
const NORMAL_SCALE: f64 = 127.0;

/// The bits of the nearest half float. Values beyond its range are clamped.
fn to_half_bits(value: f64) -> u16 {
    let largest = f16::MAX.to_f64();
    f16::from_f64(value.clamp(-largest, largest)).to_bits()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::quality::VertexFormat;
    use crate::scene::Topology;

    #[test]
    fn values_beyond_the_range_of_half_floats_are_clamped() {
        for value in [65_504.1, 65_520.0, 1e9, f64::MAX, f64::INFINITY] {
            assert_eq!((to_half_bits(value), to_half_bits(-value)), (0x7bff, 0xfbff), "{value}");
        }
    }

    fn mesh(uvs: &[[f32; 2]]) -> Mesh {
        let vertices = uvs.iter().map(|&uv| Vertex { uv, ..Vertex::default() }).collect();
        Mesh::new("leaf", Topology::TriangleList, vertices, vec![0, 1, 2]).unwrap()
    }

    fn fraction(value: f64) -> f64 {
        value - value.round()
    }

    /// A coordinate of any magnitude in the range of half floats.
    fn coordinate() -> impl Strategy<Value = f32> {
        (-20.0..15.9_f32, prop::bool::ANY)
            .prop_map(|(power, negative)| power.exp2() * if negative { -1.0 } else { 1.0 })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn normals_are_within_their_bound(direction in prop::array::uniform3(-1.0..1.0_f32), power in -100..100_i32) {
            let normal = Vec3::from(direction) * 2_f32.powi(power);
            prop_assume!(normal != Vec3::ZERO);
            let vertex = Vertex { normal: normal.to_array(), ..Vertex::default() };
            let unpacked = PackedVertex::new(&vertex, DVec2::ZERO).unpacked();
            let error = Vec3::from(unpacked.normal).as_dvec3().angle_between(normal.as_dvec3());
            prop_assert!(error.to_degrees() <= VertexFormat::Packed.max_normal_error_degrees(), "{}", error.to_degrees());
        }

        #[test]
        fn texture_coordinates_are_within_their_bound_up_to_integers(
            near in prop::array::uniform3(prop::array::uniform2(coordinate())),
            offset in prop::array::uniform2(-9000..9000_i16),
        ) {
            let offset = offset.map(f32::from);
            let uvs = near.map(|uv| [uv[0] + offset[0], uv[1] + offset[1]]);
            let packed = mesh(&uvs).packed_vertices();
            for axis in 0..2 {
                let all = uvs.map(|uv| f64::from(uv[axis]));
                let repeats = all.into_iter().fold(f64::MIN, f64::max) - all.into_iter().fold(f64::MAX, f64::min);
                let bound = VertexFormat::Packed.max_uv_error(repeats);
                let shifts = packed.iter().zip(all).map(|(packed, uv)| f64::from(packed.unpacked().uv[axis]) - uv);
                let shifts: Vec<_> = shifts.collect();
                for shift in &shifts {
                    prop_assert!((shift - shifts[0]).abs() <= 2.0 * bound, "torn apart: {shifts:?}, {bound}");
                    prop_assert!(bound > 0.5 || fraction(*shift).abs() <= bound, "{shifts:?}, {bound}");
                }
            }
        }
    }

    #[test]
    fn an_unrepeated_texture_of_1024_texels_has_an_error_of_half_a_texel_at_most() {
        for step in 0..=100_000_u32 {
            let u = step as f32 / 100_000.0;
            let packed = mesh(&[[u, 7.0 + u], [0.0, 7.0], [1.0, 8.0]]).packed_vertices()[0].unpacked();
            for (actual, expected) in packed.uv.into_iter().zip([u, 7.0 + u]) {
                let error = fraction(f64::from(actual) - f64::from(expected)).abs();
                assert!(error <= 0.5 / 1024.0 && error <= VertexFormat::Packed.max_uv_error(1.0), "{u}: {error}");
            }
        }
    }

    #[test]
    fn extreme_vertices_stay_finite_and_keep_their_positions() {
        let ends = [f32::MAX, f32::MIN, f32::MIN_POSITIVE, 1e-45, -0.0, 65_504.0, 1e9, 1.0];
        for (one, other) in ends.into_iter().flat_map(|one| ends.map(|other| (one, other))) {
            for packed in mesh(&[[one, other], [other, one], [0.5, 0.5]]).packed_vertices() {
                assert!(packed.unpacked().uv.iter().all(|value| value.is_finite()), "{one} {other}");
            }
            let vertex = Vertex { position: [one, other, 0.1], normal: [one, other, 0.0], uv: [0.0; 2] };
            let packed = PackedVertex::new(&vertex, DVec2::ZERO);
            assert_eq!(packed.position, vertex.position);
            let length = Vec3::from(packed.unpacked().normal).length();
            assert!((length - 1.0).abs() < 0.01 || vertex.normal == [0.0; 3] && length == 0.0, "{vertex:?}: {length}");
        }
    }

    #[test]
    fn axes_and_corners_are_exact() {
        for normal in [Vec3::ZERO, Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
            for uv in [[0.0, 0.0], [0.0, 1.0], [1.0, 0.5], [0.25, -1.0]] {
                let vertex = Vertex { position: [0.1, 0.2, 0.3], normal: normal.to_array(), uv };
                assert_eq!(PackedVertex::new(&vertex, DVec2::ZERO).unpacked(), vertex);
            }
        }
        assert_eq!(size_of::<PackedVertex>(), 20);
    }
}
