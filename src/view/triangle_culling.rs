//! Culls an object's triangles for a view.

use std::ops::Range;

use glam::{DMat4, DVec3, DVec4, Vec3};

use super::RenderView;
use crate::raster::{CullVertex, CulledTriangles, Vector, Winding, cull_triangles};
use crate::scene::{Projection, SceneRef, Vertex};

impl RenderView {
    /// Culls the triangles of an object, and appends the indices of those that may cover a pixel to `remaining`. Frames
    /// do so for meshes that [request it](crate::scene::Mesh::with_triangle_culling). Triangles are culled if they are
    /// back-facing, outside the picture, degenerate, or cover no pixel centre: "up to 70%" of them (S 9.6). It is worth
    /// its time if a device spends more on a vertex than the 20 to 40 ns that this takes per triangle.
    ///
    /// Nothing is culled in views where [a matrix alone does not decide](RenderView::can_cull_triangles) what is
    /// visible. A triangle with a corner whose position f32 does not determine to a 256th of a pixel, as of a mesh that
    /// is far larger than its distance, is culled only if all its corners are beyond one side of the picture. Positions
    /// are those of camera-relative transforms.
    ///
    /// An object that cannot be drawn has no triangles, and one whose mesh is [in the engine's own
    /// buffers](crate::scene::Mesh::from_buffers) none that are known here: then `remaining` does not change, although
    /// the object may be visible.
    ///
    /// # Panics
    /// If `object` is not in the scene.
    pub fn cull_triangles(&self, scene: &SceneRef<'_>, object: usize, remaining: &mut Vec<u32>) -> CulledTriangles {
        let mesh = scene.assets.get(scene.meshes[object]);
        mesh.map_or_else(
            |_| CulledTriangles::default(),
            |mesh| self.cull_triangle_range(scene, (object, 0), 0..mesh.triangle_count(), remaining),
        )
    }

    /// Whether a matrix that is known alone decides what is visible of a triangle. That is not so for a paraboloid, nor
    /// for a shadow map whose depth is clamped at the near plane, nor for a camera that may still be replaced.
    pub fn can_cull_triangles(&self) -> bool {
        match self.camera.projection {
            Projection::Perspective { .. } => true,
            Projection::Orthographic { .. } => !self.clamps_depth(),
            Projection::Paraboloid => false,
        }
    }

    /// [`RenderView::cull_triangles`] for a range of the triangles that the mesh has at a level of detail.
    ///
    /// # Panics
    /// If `object` is not in the scene, or the range exceeds the mesh's triangles.
    pub(crate) fn cull_triangle_range(
        &self,
        scene: &SceneRef<'_>,
        (object, level): (usize, u32),
        triangles: Range<usize>,
        remaining: &mut Vec<u32>,
    ) -> CulledTriangles {
        let mesh = scene.assets.get(scene.meshes[object]);
        let (Ok(mesh), Ok(material)) = (mesh, scene.assets.get(scene.materials[object])) else {
            return CulledTriangles::default();
        };
        if !scene.transform_is_valid(object) {
            return CulledTriangles::default();
        }
        let count = triangles.len();
        let corners = || mesh.triangles_in(level, triangles.clone());
        if !self.can_cull_triangles() {
            remaining.extend(corners().flatten());
            return CulledTriangles { triangles: count, ..CulledTriangles::default() };
        }
        let clip_from_relative = self.precise_clip_from_relative();
        let (scale, orientation) = (
            scene.scale_column().get(object).as_dvec3(),
            scene.orientation_column().get(object).as_dquat().normalize(),
        );
        let origin = scene.position_column().get(object) - self.camera.position;
        let transform = |vertex: &Vertex| {
            let local = Vec3::from(vertex.position).as_dvec3() * scale;
            let clip = clip_from_relative * (origin + orientation * local).extend(1.0);
            cull_vertex(position_error(origin, local), clip, &clip_from_relative, self.camera.size)
        };
        let is_mirrored = scene.scale_column().get(object).is_negative_bitmask().count_ones() % 2 == 1;
        let culled = match (material.double_sided, is_mirrored) {
            (true, _) => None,
            (false, false) => Some(Winding::Clockwise),
            (false, true) => Some(Winding::CounterClockwise),
        };
        let size = self.camera.size.map(|side| side as usize);
        let start = remaining.len();
        // Consecutive triangles usually share vertices that are close together: transform the range of vertices once.
        let first = corners().flatten().min().unwrap_or(0);
        let end = corners().flatten().max().map_or(0, |last| last + 1);
        if (end - first) as usize <= count * 3 {
            let window: Vec<_> = mesh.vertices()[first as usize..end as usize].iter().map(transform).collect();
            let rebased = corners().map(|triangle| triangle.map(|corner| corner - first));
            let counts = cull_triangles(&window, rebased, size, culled, remaining);
            remaining[start..].iter_mut().for_each(|corner| *corner += first);
            counts
        } else {
            let all: Vec<_> = corners().flatten().collect();
            let window: Vec<_> = all.iter().map(|&corner| transform(&mesh.vertices()[corner as usize])).collect();
            let numbered = (0..count as u32).map(|triangle| [0, 1, 2].map(|corner| triangle * 3 + corner));
            let counts = cull_triangles(&window, numbered, size, culled, remaining);
            remaining[start..].iter_mut().for_each(|corner| *corner = all[*corner as usize]);
            counts
        }
    }
}

/// A bound of a device's position error of a vertex, in metres. `origin` is its object's position relative to the
/// camera, and `local` its own relative to the object's.
fn position_error(origin: DVec3, local: DVec3) -> f64 {
    origin.length() * ERROR_PER_DISTANCE + local.length() * ERROR_PER_SIZE + FIXED_POINT_ERROR
}

/// A device's position error of a vertex, as a share of its object's distance: 8 unit roundoffs of f32. The difference
/// of the two positions is rounded once, its sum with the vertex once, and the matrix takes five, including those of
/// its own elements.
const ERROR_PER_DISTANCE: f64 = 1.0 / 2_097_152.0;

/// A device's position error of a vertex, as a share of its distance from its object's origin: 16 unit roundoffs, of
/// which scaling and rotating take 8.
const ERROR_PER_SIZE: f64 = 1.0 / 1_048_576.0;

/// Twice a step of a [`FixedPosition`](super::FixedPosition), in metres.
const FIXED_POINT_ERROR: f64 = 2.0 / 1_073_741_824.0;

/// The error that [`CullVertex::clip`] may have, as a share of |x| + |y| + |z| + |w|.
const CLIP_TOLERANCE: f64 = 1.0 / 8192.0;

/// A vertex that a device may draw up to `error` metres away. In the picture it moves by the errors of x and y, and by
/// that of w times its distance from the centre; the viewport's three roundings are proportional to the picture's size.
/// A vertex whose error exceeds the tolerance becomes NaN, so that its triangles are kept.
fn cull_vertex(error: f64, clip: DVec4, clip_from_relative: &DMat4, size: [u32; 2]) -> CullVertex {
    let rows = clip_from_relative.transpose();
    let error_along = |row: DVec4| row.truncate().length() * error;
    let [in_x, in_y, in_z, in_w] = [rows.x_axis, rows.y_axis, rows.z_axis, rows.w_axis].map(error_along);
    let tolerance = CLIP_TOLERANCE * clip.abs().element_sum();
    if [in_x, in_y, in_z, in_w].iter().any(|&error| error > tolerance) {
        return CullVertex { clip: Vector([f64::NAN; 4]), is_accurate: false };
    }
    let moves_less_than_a_step = |coordinate: f64, error: f64, side: u32| {
        let steps = f64::from(side) * 256.0;
        let moved = (error + (coordinate / clip.w).abs() * in_w) / (clip.w - in_w) * 0.5 * steps;
        moved + 3.0 * steps * f64::from(f32::EPSILON) * 0.5 < 1.0
    };
    let is_accurate =
        clip.w > in_w && moves_less_than_a_step(clip.x, in_x, size[0]) && moves_less_than_a_step(clip.y, in_y, size[1]);
    CullVertex { clip: Vector(clip.to_array()), is_accurate }
}

#[cfg(test)]
mod tests {
    use glam::{Mat4, Vec4};
    use proptest::prelude::*;

    use super::*;
    use crate::scene::{Camera, Material, Mesh, RenderObject, Scene, Topology};

    proptest! {
        /// Computed as on a device: the difference of the fixed-point positions, and all from there on in f32.
        #[test]
        fn a_device_draws_within_the_error(
            origin in prop::array::uniform3(-1.0..1.0_f64), distance in -4.0..4.0_f64,
            local in prop::array::uniform3(-1.0..1.0_f64), size in -4.0..4.0_f64,
            degrees in 0.1..170.0_f32, turn in prop::array::uniform3(-3.0..3.0_f32),
        ) {
            let mut camera = Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z);
            camera.projection = Projection::Perspective { field_of_view: degrees.to_radians() };
            camera.orientation = glam::Quat::from_scaled_axis(Vec3::from(turn));
            camera.size = [1920, 1080];
            let view = RenderView::new(&camera);
            let (exact_matrix, matrix): (DMat4, Mat4) = (view.precise_clip_from_relative(), view.clip_from_relative());
            let origin = DVec3::from(origin) * 10_f64.powf(distance);
            let local = (DVec3::from(local) * 10_f64.powf(size)).as_vec3();
            let spin = glam::Quat::from_rotation_y(turn[0]);
            let clip = exact_matrix * (origin + spin.as_dquat() * local.as_dvec3()).extend(1.0);
            let error = position_error(origin, local.as_dvec3());
            // The camera's position is rounded as well.
            let steps = |position: DVec3| (position * 2_f64.powi(30)).round();
            let camera_position = DVec3::new(0.3, 0.7, 0.1) * 2_f64.powi(-30);
            let fixed_point = (steps(origin + camera_position) - steps(camera_position)) * 2_f64.powi(-30);
            let by_device: Vec4 = matrix * (fixed_point.as_vec3() + spin * local).extend(1.0);
            let by_device = by_device.as_dvec4();
            let corner = cull_vertex(error, clip, &exact_matrix, camera.size);
            if corner.clip[0].is_finite() {
                let difference = (by_device - clip).abs().max_element();
                prop_assert!(difference <= CLIP_TOLERANCE * clip.abs().element_sum(), "{difference}");
            }
            for (axis, side) in [(0, 1920.0), (1, 1080.0)] {
                let difference = (by_device[axis] / by_device.w - clip[axis] / clip.w).abs() * side * 0.5 * 256.0;
                let viewport = 3.0 * side * 256.0 * f64::from(f32::EPSILON) * 0.5;
                prop_assert!(!corner.is_accurate || difference < 1.0 - viewport, "{difference}");
            }
        }
    }

    #[test]
    fn triangles_behind_the_camera_are_culled() {
        let mut scene = Scene::new();
        // A floor of 40 m around the camera, in squares of 1 m.
        let position = |index: u32| [(index % 41) as f32 - 20.0, 0.0, (index / 41) as f32 - 20.0];
        let vertices =
            (0..41 * 41).map(|index| Vertex { position: position(index), normal: [0.0, 1.0, 0.0], uv: [0.0; 2] });
        let squares = (0..40 * 40).map(|square| square / 40 * 41 + square % 40);
        let corners = squares.flat_map(|low| [low, low + 41, low + 1, low + 1, low + 41, low + 42]);
        let floor = Mesh::new("floor", Topology::TriangleList, vertices.collect(), corners.collect()).unwrap();
        let (floor, material) = (scene.add(floor).unwrap(), scene.add(Material::default()).unwrap());
        scene.add_object(RenderObject::new(floor, material, DVec3::ZERO)).unwrap();
        let camera = Camera::looking_at("main", DVec3::new(0.5, 1.7, 0.5), DVec3::new(0.5, 1.7, -5.0));
        let culled = RenderView::new(&camera).cull_triangles(&scene.as_scene_ref(), 0, &mut Vec::new());
        assert!(culled.off_screen > culled.triangles / 2, "{culled:?}");
    }

    /// Objects of random small triangles: turned, stretched, mirrored, and some of them outside the picture. If
    /// `scattered`, half of the corners refer to the far end of a large vertex array.
    fn random_objects(scattered: bool) -> Scene {
        let mut random = fastrand::Rng::with_seed(31);
        let mut number = |low: f32, high: f32| low + (high - low) * random.f32();
        let mut vector = |low: f32, high: f32| Vec3::from([0; 3].map(|_| number(low, high)));
        let mut scene = Scene::new();
        let material = scene.add(Material::default()).unwrap();
        for object in 0..60 {
            let count = [1, 2, 8, 50, 51, 400][object % 6];
            // Neighbours share a vertex, as those of a strip.
            let (mut position, mut vertices) = (vector(-1.0, 1.0), Vec::new());
            for _ in 0..count + 2 {
                position = (position + vector(-0.2, 0.2)).clamp(Vec3::NEG_ONE, Vec3::ONE);
                vertices.push(Vertex { position: position.into(), ..Vertex::default() });
            }
            let far = vertices.len() as u32 * 39;
            let corners = (0..count as u32).flat_map(|first| [first, first + 1, first + 2]).enumerate();
            let offset = |index: usize| if scattered && index % 2 == 1 { far } else { 0 };
            let indices = corners.map(|(index, corner)| corner + offset(index)).collect();
            let vertices = vertices.repeat(if scattered { 40 } else { 1 });
            let mesh = scene.add(Mesh::new("random", Topology::TriangleList, vertices, indices).unwrap()).unwrap();
            let scale = vector(0.02, 2.0) * if object % 4 == 3 { Vec3::new(-1.0, 1.0, 1.0) } else { Vec3::ONE };
            let orientation = glam::Quat::from_scaled_axis(vector(-3.0, 3.0));
            let position = (vector(-6.0, 6.0) - Vec3::Z * 4.0).as_dvec3();
            scene
                .add_object(RenderObject { orientation, scale, ..RenderObject::new(mesh, material, position) })
                .unwrap();
        }
        scene
    }

    #[test]
    fn culling_ranges_gives_the_same_result_as_culling_all() {
        let camera = Camera { size: [160, 90], ..Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z) };
        let view = RenderView::new(&camera);
        for scattered in [false, true] {
            let scene = random_objects(scattered);
            let scene = scene.as_scene_ref();
            let mut total = CulledTriangles::default();
            for object in 0..scene.object_count() {
                let (mut whole, mut in_parts) = (Vec::new(), Vec::new());
                let expected = view.cull_triangles(&scene, object, &mut whole);
                let mut found = CulledTriangles::default();
                let mut start = 0;
                for length in (1..).map(|part| part * 7 % 50 + 1) {
                    let end = expected.triangles.min(start + length);
                    found += view.cull_triangle_range(&scene, (object, 0), start..end, &mut in_parts);
                    start = end;
                    if start == expected.triangles {
                        break;
                    }
                }
                assert_eq!((found, &in_parts), (expected, &whole));
                let triangles: Vec<_> = scene.assets.get(scene.meshes[object]).unwrap().triangles().collect();
                assert!(whole.as_chunks().0.iter().all(|triangle| triangles.contains(triangle)));
                total += expected;
            }
            let kept = total.triangles - total.culled();
            let each = [kept, total.off_screen, total.back_facing, total.zero_size];
            assert!(each.into_iter().all(|count| count * 50 > total.triangles), "{total:?}");
        }
    }
}
