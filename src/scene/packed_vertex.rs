//! Vertices in 20 bytes instead of 32.

use glam::{DVec2, DVec3, Vec2, Vec3};
use half::f16;

use super::{Mesh, Vertex};

/// A vertex as it lies in the vertex buffer where vertices are [packed](crate::quality::VertexFormat::Packed): what a device
/// fetches costs bandwidth, so it is to be small (S 9.6). The device turns it into floats as it fetches it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct PackedVertex {
    /// In object space, in metres: just those of the [`Vertex`], so what is drawn covers the same pixels.
    pub position: [f32; 3],
    /// In object space, 127 for 1, of unit length before rounding; the fourth is 0. A normal of 0 stays 0.
    pub normal: [i8; 4],
    /// Half floats' bits: texture coordinates, less whole numbers that are the same for all of the mesh.
    pub uv: [u16; 2],
}

impl PackedVertex {
    /// Packs a vertex of a mesh whose texture coordinates are counted from `uv_origin`, whole numbers. What is more than 65,504
    /// from there, where half floats end, stands there.
    pub fn new(vertex: &Vertex, uv_origin: DVec2) -> Self {
        let normal = Vec3::from(vertex.normal).as_dvec3().normalize_or_zero();
        let [x, y, z] = (normal * STEPS).round().to_array().map(|steps| steps as i8);
        let uv = Vec2::from(vertex.uv).as_dvec2() - uv_origin;
        Self { position: vertex.position, normal: [x, y, z, 0], uv: uv.to_array().map(half) }
    }

    /// The vertex as shaders see it. Its normal is of unit length but for rounding, or 0.
    pub fn unpacked(&self) -> Vertex {
        let [x, y, z, _] = self.normal.map(f64::from);
        let normal = DVec3::new(x, y, z) / STEPS;
        Vertex {
            position: self.position,
            normal: normal.as_vec3().to_array(),
            uv: self.uv.map(|bits| f16::from_bits(bits).to_f32()),
        }
    }
}

impl Mesh {
    /// The vertices, packed. Textures repeat, so texture coordinates are counted from the whole number that is nearest the middle
    /// of the mesh's: half floats are finest near 0. How far off that leaves them is
    /// [`VertexFormat::max_uv_error`](crate::quality::VertexFormat::max_uv_error).
    pub fn packed_vertices(&self) -> Vec<PackedVertex> {
        let places = || self.vertices().iter().map(|vertex| Vec2::from(vertex.uv).as_dvec2());
        let low = places().fold(DVec2::MAX, DVec2::min);
        let high = places().fold(DVec2::MIN, DVec2::max);
        let origin = (low * 0.5 + high * 0.5).round();
        self.vertices().iter().map(|vertex| PackedVertex::new(vertex, origin)).collect()
    }

    /// The mesh as a device has it whose vertices are packed.
    pub(crate) fn as_packed(&self) -> Self {
        let vertices = self.packed_vertices().iter().map(PackedVertex::unpacked).collect();
        Self::measured(self.name().to_owned(), self.topology(), vertices, self.indices().to_vec())
    }
}

/// Of a packed normal, from 0 to 1.
const STEPS: f64 = 127.0;

/// The bits of the nearest half float; what is beyond the largest becomes that.
fn half(value: f64) -> u16 {
    let largest = f16::MAX.to_f64();
    f16::from_f64(value.clamp(-largest, largest)).to_bits()
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::quality::VertexFormat;
    use crate::scene::Topology;

    #[test]
    fn what_is_past_the_end_stands_there() {
        for value in [65_504.1, 65_520.0, 1e9, f64::MAX, f64::INFINITY] {
            assert_eq!((half(value), half(-value)), (0x7bff, 0xfbff), "{value}");
        }
    }

    fn mesh(uvs: &[[f32; 2]]) -> Mesh {
        let vertices = uvs.iter().map(|&uv| Vertex { uv, ..Vertex::default() }).collect();
        Mesh::new("leaf", Topology::TriangleList, vertices, vec![0, 1, 2]).unwrap()
    }

    fn whole(value: f64) -> f64 {
        value - value.round()
    }

    /// A coordinate of any magnitude up to where half floats end.
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
            let off = Vec3::from(unpacked.normal).as_dvec3().angle_between(normal.as_dvec3());
            prop_assert!(off.to_degrees() <= VertexFormat::Packed.max_normal_error_degrees(), "{}", off.to_degrees());
        }

        #[test]
        fn texture_coordinates_are_within_their_bound_but_for_whole_numbers(
            near in prop::array::uniform3(prop::array::uniform2(coordinate())),
            place in prop::array::uniform2(-9000..9000_i16),
        ) {
            let place = place.map(f32::from);
            let uvs = near.map(|uv| [uv[0] + place[0], uv[1] + place[1]]);
            let packed = mesh(&uvs).packed_vertices();
            for axis in 0..2 {
                let all = uvs.map(|uv| f64::from(uv[axis]));
                let repeats = all.into_iter().fold(f64::MIN, f64::max) - all.into_iter().fold(f64::MAX, f64::min);
                let bound = VertexFormat::Packed.max_uv_error(repeats);
                let shifts = packed.iter().zip(all).map(|(packed, uv)| f64::from(packed.unpacked().uv[axis]) - uv);
                let shifts: Vec<_> = shifts.collect();
                for shift in &shifts {
                    prop_assert!((shift - shifts[0]).abs() <= 2.0 * bound, "torn apart: {shifts:?}, {bound}");
                    prop_assert!(bound > 0.5 || whole(*shift).abs() <= bound, "{shifts:?}, {bound}");
                }
            }
        }
    }

    #[test]
    fn a_texture_that_is_shown_once_is_off_by_half_a_pixel_of_1024_at_most() {
        for step in 0..=100_000_u32 {
            let u = step as f32 / 100_000.0;
            let packed = mesh(&[[u, 7.0 + u], [0.0, 7.0], [1.0, 8.0]]).packed_vertices()[0].unpacked();
            for (found, meant) in packed.uv.into_iter().zip([u, 7.0 + u]) {
                let off = whole(f64::from(found) - f64::from(meant)).abs();
                assert!(off <= 0.5 / 1024.0 && off <= VertexFormat::Packed.max_uv_error(1.0), "{u}: {off}");
            }
        }
    }

    #[test]
    fn the_extremes_stay_finite_and_positions_as_they_are() {
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
