//! Which of an object's triangles a view can show.

use std::ops::Range;

use glam::{DMat4, DVec4, Vec3};

use super::RenderView;
use crate::raster::{CulledTriangles, Vector, Winding, cull_triangles};
use crate::scene::{Projection, SceneRef, Vertex, ViewKind};

impl RenderView {
    /// Looks at each triangle of an object, and appends the indices of those that a device could draw a pixel of to `remaining`: frames
    /// do so for meshes that [ask for it](crate::scene::Mesh::with_triangles_culled). What is left out faces away, lies outside of the
    /// picture, covers no pixel's middle or is no triangle, "up to 70%" of them (S 9.6). It pays where a device has more to do for a
    /// vertex than the 20 to 40 ns that this takes a triangle. Nothing is left out where
    /// [a matrix alone does not say](RenderView::can_cull_triangles) what is seen, nor where f32 does not say to a 256th of a pixel where a
    /// corner is: of a mesh that is far larger than it is far away, say. Places are those of camera-relative transforms.
    ///
    /// An object that cannot be drawn has no triangle.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn cull_triangles(&self, scene: &SceneRef<'_>, object: usize, remaining: &mut Vec<u32>) -> CulledTriangles {
        let mesh = scene.assets.get(scene.meshes[object]);
        mesh.map_or_else(
            |_| CulledTriangles::default(),
            |mesh| self.cull_some_triangles(scene, object, 0..mesh.triangle_count(), remaining),
        )
    }

    /// Whether what it sees of a triangle follows from a matrix: not so in a paraboloid's view, nor in a shadow's in which what is too near
    /// is drawn.
    pub fn can_cull_triangles(&self) -> bool {
        match self.camera.projection {
            Projection::Perspective { .. } => true,
            Projection::Orthographic { .. } => self.kind() != ViewKind::Shadow,
            Projection::Paraboloid => false,
        }
    }

    /// The same of some of the mesh's triangles, by their number.
    ///
    /// # Panics
    /// If there is no such object, or there are not as many triangles.
    pub(crate) fn cull_some_triangles(
        &self,
        scene: &SceneRef<'_>,
        object: usize,
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
        let corners = || mesh.triangles_in(triangles.clone());
        if !self.can_cull_triangles() {
            remaining.extend(corners().flatten());
            return CulledTriangles { triangles: count, ..CulledTriangles::default() };
        }
        let clip_from_relative = self.precise_clip_from_relative();
        let (scale, orientation) = (scene.scales[object].as_dvec3(), scene.orientations[object].as_dquat().normalize());
        let origin = scene.positions[object] - self.camera.position;
        let clip_of = |vertex: &Vertex| {
            let local = Vec3::from(vertex.position).as_dvec3() * scale;
            let clip = clip_from_relative * (origin + orientation * local).extend(1.0);
            let slack = (origin.length() + local.length()) * SINGLE + STEP;
            let is_known = device_is_near(clip, slack, &clip_from_relative, self.camera.size);
            // What is no number is kept with all its triangles.
            if is_known { Vector(clip.to_array()) } else { Vector([f64::NAN; 4]) }
        };
        let is_mirrored = scene.scales[object].is_negative_bitmask().count_ones() % 2 == 1;
        let culled = match (material.double_sided, is_mirrored) {
            (true, _) => None,
            (false, false) => Some(Winding::Clockwise),
            (false, true) => Some(Winding::CounterClockwise),
        };
        let size = self.camera.size.map(|side| side as usize);
        let start = remaining.len();
        // Triangles that follow one another share most of their vertices, which then lie close together.
        let first = corners().flatten().min().unwrap_or(0);
        let end = corners().flatten().max().map_or(0, |last| last + 1);
        if (end - first) as usize <= count * 3 {
            let clip: Vec<_> = mesh.vertices()[first as usize..end as usize].iter().map(clip_of).collect();
            let moved = corners().map(|triangle| triangle.map(|corner| corner - first));
            let counts = cull_triangles(&clip, moved, size, culled, remaining);
            remaining[start..].iter_mut().for_each(|corner| *corner += first);
            counts
        } else {
            let all: Vec<_> = corners().flatten().collect();
            let clip: Vec<_> = all.iter().map(|&corner| clip_of(&mesh.vertices()[corner as usize])).collect();
            let numbered = (0..count as u32).map(|triangle| [0, 1, 2].map(|corner| triangle * 3 + corner));
            let counts = cull_triangles(&clip, numbered, size, culled, remaining);
            remaining[start..].iter_mut().for_each(|corner| *corner = all[*corner as usize]);
            counts
        }
    }
}

/// How far from its place a device may draw a vertex, as a share of its object's distance and of its own from the object's origin: 16
/// unit roundoffs of f32, of which scaling and turning take 6, the differences and sums 4, and the matrix the rest.
const SINGLE: f64 = 1.0 / 1_048_576.0;

/// Twice a step of a [`FixedPosition`](super::FixedPosition), in metres.
const STEP: f64 = 2.0 / 1_073_741_824.0;

/// Whether a vertex that a device may draw `slack` metres away is within half of a 256th of a pixel of where it belongs, so that it is
/// snapped to a neighbour at most. A place moves by as much as its distance from the picture's middle is in x and y, and by its w.
fn device_is_near(clip: DVec4, slack: f64, clip_from_relative: &DMat4, size: [u32; 2]) -> bool {
    let rows = clip_from_relative.transpose();
    let reach = |row: DVec4| row.truncate().length() * slack;
    let in_w = reach(rows.w_axis);
    let moved = |row: DVec4, place: f64, side: u32| {
        (reach(row) + (place / clip.w).abs() * in_w) / (clip.w - in_w) * 0.5 * f64::from(side) * 256.0
    };
    clip.w > in_w && moved(rows.x_axis, clip.x, size[0]) < 0.5 && moved(rows.y_axis, clip.y, size[1]) < 0.5
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use glam::{DVec3, Mat4, Vec4};
    use proptest::prelude::*;

    use super::*;
    use crate::scene::{Camera, Mesh, Topology, sample};

    proptest! {
        /// As a device has it: everything in f32, from the difference of the places on.
        #[test]
        fn a_device_is_where_it_is_said_to_be(
            origin in prop::array::uniform3(-1.0..1.0_f64), distance in -1.0..4.0_f64,
            local in prop::array::uniform3(-1.0..1.0_f64), size in -2.0..4.0_f64,
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
            let slack = (origin.length() + f64::from(local.length())) * SINGLE + STEP;
            if !device_is_near(clip, slack, &exact_matrix, camera.size) {
                return Ok(());
            }
            let by_device: Vec4 = matrix * (origin.as_vec3() + spin * local).extend(1.0);
            let by_device = by_device.as_dvec4();
            for (axis, side) in [(0, 1920.0), (1, 1080.0)] {
                let off = (by_device[axis] / by_device.w - clip[axis] / clip.w).abs() * side * 0.5 * 256.0;
                prop_assert!(off < 0.5, "{off}");
            }
        }
    }

    #[test]
    fn most_triangles_of_a_scene_are_left_out_and_the_rest_kept() {
        let scene = sample::colonnade().unwrap();
        let view = RenderView::new(&scene.cameras[0]);
        let scene = scene.as_scene_ref();
        let mut total = CulledTriangles::default();
        for object in 0..scene.object_count() {
            let mut kept = Vec::new();
            let culled = view.cull_triangles(&scene, object, &mut kept);
            assert_eq!(kept.len() / 3 + culled.culled(), culled.triangles);
            total += culled;
        }
        assert!(
            total.share() > 0.7 && total.back_facing > 0 && total.off_screen > 0 && total.zero_size > 0,
            "{total:?}"
        );
    }

    #[test]
    fn parts_are_the_whole_wherever_vertices_lie() {
        let mut scene = sample::colonnade().unwrap();
        let meshes: Vec<_> = scene.assets().iter::<Mesh>().map(|(handle, mesh)| (handle, mesh.clone())).collect();
        for scattered in [false, true] {
            for (handle, mesh) in &meshes {
                // Half of its triangles have their corners at the far end of a large array.
                let count = mesh.vertices().len() as u32;
                let vertices = mesh.vertices().repeat(if scattered { 40 } else { 1 });
                let far = |place: usize| if scattered && place % 2 == 1 { count * 39 } else { 0 };
                let indices = mesh.triangles().flatten().enumerate().map(|(place, corner)| corner + far(place));
                let mesh = Mesh::new("parts", Topology::TriangleList, vertices, indices.collect()).unwrap();
                scene.replace(*handle, mesh).unwrap();
            }
            let view = RenderView::new(&scene.cameras[0]);
            let scene = scene.as_scene_ref();
            for object in 0..scene.object_count() {
                let (mut whole, mut in_parts) = (Vec::new(), Vec::new());
                let expected = view.cull_triangles(&scene, object, &mut whole);
                let mut found = CulledTriangles::default();
                let mut start = 0;
                for length in (1..).map(|part| part * 7 % 50 + 1) {
                    let end = expected.triangles.min(start + length);
                    found += view.cull_some_triangles(&scene, object, start..end, &mut in_parts);
                    start = end;
                    if start == expected.triangles {
                        break;
                    }
                }
                assert_eq!((found, &in_parts), (expected, &whole));
                let triangles: Vec<_> = scene.assets.get(scene.meshes[object]).unwrap().triangles().collect();
                assert!(whole.as_chunks().0.iter().all(|triangle| triangles.contains(triangle)));
            }
        }
    }

    #[test]
    fn what_faces_away_is_left_out_in_either_projection() {
        let scene = sample::colonnade().unwrap();
        let scene = scene.as_scene_ref();
        let center = scene.positions[0];
        let camera = Camera::looking_at("near", center + DVec3::new(3.0, 40.0, 5.0), center);
        for projection in [camera.projection, Projection::Orthographic { height: 60.0 }, Projection::Paraboloid] {
            let kind = if projection == Projection::Paraboloid { ViewKind::Shadow } else { ViewKind::Main };
            let view = RenderView::new(&Camera { projection, kind, far: 1000.0, ..camera.clone() });
            let mut kept = Vec::new();
            let culled: usize =
                (0..scene.object_count()).map(|object| view.cull_triangles(&scene, object, &mut kept).culled()).sum();
            assert_eq!(culled > 0, projection != Projection::Paraboloid, "{projection:?}");
        }
    }
}
