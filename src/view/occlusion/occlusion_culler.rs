//! The occlusion culler of a view.

use glam::{DVec2, DVec3, Quat, Vec3};
use parking_lot::RwLock;

use super::OccluderMeshes;
use super::occlusion_camera::{CameraFromObject, OcclusionCamera};
use crate::bit_set::set_bits;
use crate::command::Cull;
use crate::raster::{CoarseDepth, ConvexPart, Plane, Silhouettes};
use crate::scene::SceneRef;
use crate::view::{ObjectBlock, ObjectDraw, ObjectTable, RenderView, VisibleSet};

/// Finds the objects that a view's larger objects hide, in three steps: [`OcclusionCuller::select_occluders`] selects
/// those with the largest projections and projects their convex parts, [`OcclusionCuller::draw_occluders`] draws them
/// into a coarse depth buffer, and [`OcclusionCuller::hidden`] tests every object against that.
///
/// It is conservative: an object that it reports as hidden is hidden. An occluder counts only in tiles of the picture
/// that it covers entirely, at its farthest depth there; an object is tested as a rectangle around its box, at the
/// box's nearest corner. Both are moved by the bound of a device's f32 errors, in the direction that hides less. An
/// object that crosses the near plane is never hidden.
///
/// An object is hidden if no sample of the picture would show it, wherever in a pixel samples are, provided that every
/// object is drawn as its mesh is. So only an opaque object whose bounds are those of its mesh is an occluder: if an
/// engine has set other bounds, its shader may move vertices.
#[derive(Debug, Default)]
pub struct OcclusionCuller {
    camera: Option<OcclusionCamera>,
    /// A tile's width in pixels.
    tile_size: u32,
    depth: CoarseDepth,
    occluders: RwLock<Occluders>,
}

/// The selected occluders, and memory reused between frames.
#[derive(Debug, Default)]
struct Occluders {
    candidates: Vec<Candidate>,
    /// A part's points in camera space.
    points: Vec<DVec3>,
    /// The points beyond the clip depth, and the intersections of edges with it.
    clipped: Vec<DVec3>,
    planes: Vec<[f64; 3]>,
    silhouettes: Silhouettes,
}

/// A possible occluder.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    /// Its apparent width in pixels.
    width: f32,
    /// The depth of its centre in metres.
    depth: f32,
    object: u32,
}

impl OcclusionCuller {
    /// The maximum number of occluders: those with the largest projections are selected.
    pub const MAX_OCCLUDERS: usize = 2048;

    /// Prepares for a view. A tile is `tile_size` pixels wide.
    pub fn reset(&mut self, view: &RenderView, tile_size: u32) {
        self.camera = Some(OcclusionCamera::new(&view.camera));
        self.tile_size = tile_size;
        self.depth.reset(view.camera.size, tile_size);
        let occluders = self.occluders.get_mut();
        occluders.candidates.clear();
        occluders.silhouettes.clear();
    }

    /// Selects occluders among the visible objects: the largest of those for which `may_occlude` returns `true` and
    /// that are at least as wide as a tile.
    pub fn select_occluders(
        &self,
        scene: &SceneRef<'_>,
        table: &ObjectTable,
        visible: &VisibleSet,
        meshes: &OccluderMeshes,
        may_occlude: impl Fn(usize, &ObjectDraw) -> bool,
    ) {
        let Some(camera) = &self.camera else { return };
        let occluders = &mut *self.occluders.write();
        for block in 0..table.block_count() {
            let objects = table.block(block);
            for first in (0..ObjectTable::BLOCK_SIZE).step_by(VisibleSet::OBJECTS_PER_WORD) {
                let start = block * ObjectTable::BLOCK_SIZE + first;
                for bit in set_bits(visible.word(start / VisibleSet::OBJECTS_PER_WORD)) {
                    let (entry, object) = (first + bit, start + bit);
                    let bounds = objects.spheres.get(entry);
                    let center = camera.camera_from_world(bounds.center);
                    let width = camera.apparent_width(center, f64::from(bounds.radius));
                    let draw = &objects.draws[entry];
                    if width >= f64::from(self.tile_size)
                        && may_occlude(object, draw)
                        && !meshes.parts(draw.mesh).is_empty()
                    {
                        let (width, depth, object) = (width as f32, center.z as f32, object as u32);
                        occluders.candidates.push(Candidate { width, depth, object });
                    }
                }
            }
        }
        occluders.project_largest(camera, scene, table, meshes);
    }

    /// The number of convex parts to draw.
    pub fn part_count(&self) -> usize {
        self.occluders.read().silhouettes.len()
    }

    /// The number of strips to [draw](OcclusionCuller::draw_occluders).
    pub fn strip_count(&self) -> usize {
        self.depth.strip_count()
    }

    /// Draws the occluders into a strip of the coarse depth buffer. Different strips may be drawn at the same time.
    pub fn draw_occluders(&self, strip: usize) {
        self.depth.draw(strip, &self.occluders.read().silhouettes);
    }

    /// Tests the objects of a word whose bits in `visible` are set; bit 0 is `first`, a multiple of
    /// [`VisibleSet::OBJECTS_PER_WORD`]. Returns a mask of the hidden objects. Call it after all strips have been
    /// drawn.
    pub fn hidden(&self, scene: &SceneRef<'_>, table: &ObjectTable, first: usize, visible: u64) -> u64 {
        let Some(camera) = self.camera.as_ref().filter(|_| visible != 0) else { return 0 };
        let objects = table.block(first / ObjectTable::BLOCK_SIZE);
        let is_hidden = |bit: &usize| self.is_hidden(camera, scene, &objects, first + bit);
        set_bits(visible).filter(is_hidden).fold(0, |hidden, bit| hidden | 1 << bit)
    }

    fn is_hidden(&self, camera: &OcclusionCamera, scene: &SceneRef<'_>, objects: &ObjectBlock, object: usize) -> bool {
        let entry = object % ObjectTable::BLOCK_SIZE;
        let bounds = objects.spheres.get(entry);
        let center = camera.camera_from_world(bounds.center);
        // An object whose centre is visible is not hidden.
        if center.z <= camera.min_depth(0.0) {
            return false;
        }
        let projected = camera.project(center);
        if camera.is_in_picture(projected)
            && f64::from(self.depth.nearness_at(projected.x, projected.y)) <= camera.min_nearness(center.z)
        {
            return false;
        }
        // The bounding sphere of most hidden objects is hidden, and testing it takes less time than testing the box.
        let (radius, position) = (f64::from(bounds.radius), scene.position_column().get(object));
        let slack = camera.slack(center.length() + 2.0 * bounds.center.distance(position) + radius);
        let depth = center.z - radius - slack;
        if depth > camera.min_depth(slack)
            && self.is_covered(camera, camera.sphere_bounds(center, radius), depth, slack)
        {
            return true;
        }
        let Some([low, high]) = exact_mesh_corners(scene, object) else { return false };
        let camera_from_object = camera_from_object(camera, scene, objects, object, [low, high]);
        let slack = camera_from_object.slack;
        let (low, high) = (low.as_dvec3(), high.as_dvec3());
        let half = (high - low) * 0.5;
        let half_axes = [0, 1, 2].map(|axis| camera_from_object.transform_axis(axis, half[axis]));
        let center = camera_from_object.transform_point((low + high) * 0.5);
        let depth = center.z - half_axes.iter().map(|axis| axis.z.abs()).sum::<f64>() - slack;
        depth > camera.min_depth(slack) && self.is_covered(camera, camera.box_bounds(center, half_axes), depth, slack)
    }

    /// Whether occluders hide a rectangle of the picture beyond a depth, given the position error in metres.
    fn is_covered(&self, camera: &OcclusionCamera, [low, high]: [DVec2; 2], depth: f64, slack: f64) -> bool {
        let nearness = camera.max_nearness(depth) as f32;
        // Below that, f32 is less precise than the tolerance assumes.
        if camera.is_perspective() && nearness < f32::MIN_POSITIVE {
            return false;
        }
        let margin = camera.pixel_error(slack, depth);
        self.depth.hides((low - margin).to_array(), (high + margin).to_array(), nearness)
    }
}

impl Occluders {
    /// Drops all candidates but the largest, and projects their parts, nearest first, which keeps the nearness of
    /// merged tiles as great as possible.
    fn project_largest(
        &mut self,
        camera: &OcclusionCamera,
        scene: &SceneRef<'_>,
        table: &ObjectTable,
        meshes: &OccluderMeshes,
    ) {
        if self.candidates.len() > OcclusionCuller::MAX_OCCLUDERS {
            let by_width = |one: &Candidate, other: &Candidate| {
                other.width.total_cmp(&one.width).then(one.object.cmp(&other.object))
            };
            self.candidates.select_nth_unstable_by(OcclusionCuller::MAX_OCCLUDERS, by_width);
            self.candidates.truncate(OcclusionCuller::MAX_OCCLUDERS);
        }
        let by_depth =
            |one: &Candidate, other: &Candidate| one.depth.total_cmp(&other.depth).then(one.object.cmp(&other.object));
        self.candidates.sort_unstable_by(by_depth);
        for index in 0..self.candidates.len() {
            let object = self.candidates[index].object as usize;
            let objects = table.block(object / ObjectTable::BLOCK_SIZE);
            self.project(camera, scene, &objects, object, meshes);
        }
    }

    /// Adds the silhouettes of an occluder.
    fn project(
        &mut self,
        camera: &OcclusionCamera,
        scene: &SceneRef<'_>,
        objects: &ObjectBlock,
        object: usize,
        meshes: &OccluderMeshes,
    ) {
        let Some(corners) = exact_mesh_corners(scene, object) else { return };
        let camera_from_object = camera_from_object(camera, scene, objects, object, corners);
        let draw = &objects.draws[object % ObjectTable::BLOCK_SIZE];
        if !camera_from_object.is_invertible() {
            return;
        }
        for part in meshes.parts(draw.mesh) {
            self.project_part(camera, &camera_from_object, part, draw.state.cull() == Cull::Nothing);
        }
    }

    fn project_part(
        &mut self,
        camera: &OcclusionCamera,
        camera_from_object: &CameraFromObject,
        part: &ConvexPart,
        is_double_sided: bool,
    ) {
        let slack = camera_from_object.slack + part.slack * camera_from_object.max_scale();
        self.points.clear();
        self.points.extend(part.points.iter().map(|&point| camera_from_object.transform_point(point)));
        let is_clipped = self.points.iter().any(|point| point.z < camera.min_depth(2.0 * slack));
        let clip_depth = if is_clipped { camera.clip_depth(camera_from_object, slack) } else { f64::NEG_INFINITY };
        self.clipped.clear();
        self.clipped.extend(self.points.iter().filter(|point| point.z >= clip_depth));
        if is_clipped {
            if self.clipped.is_empty() || !camera.is_perspective() {
                return;
            }
            for [from, to] in part.edges.iter().map(|edge| edge.map(|point| self.points[point as usize])) {
                if (from.z < clip_depth) != (to.z < clip_depth) {
                    let point = from.lerp(to, (clip_depth - from.z) / (to.z - from.z));
                    self.clipped.push(DVec3::new(point.x, point.y, clip_depth));
                }
            }
        }

        let min_depth = self.points.iter().map(|point| point.z).fold(f64::INFINITY, f64::min);
        self.planes.clear();
        for face in &part.faces {
            let face = camera_from_object.transform_face(face);
            let moved_inwards = Plane { offset: face.offset - slack, ..face };
            let back_face = Plane { normal: -face.normal, offset: -face.offset - slack };
            let is_drawn_from_behind = !part.is_closed && is_double_sided;
            let sides = [moved_inwards, back_face].into_iter().take(1 + usize::from(is_drawn_from_behind));
            let Some((face, plane)) =
                sides.filter_map(|face| Some((face, camera.nearness_plane(&face, min_depth)?))).next()
            else {
                continue;
            };
            // Where an almost edge-on face is clipped is uncertain.
            if is_clipped && face.offset > -256.0 * slack {
                return;
            }
            self.planes.push(plane);
        }
        // The part is open at the clip depth. A ray that enters through the opening meets no face before it, so nothing
        // is covered where all planes are nearer than the clip depth. The faces were moved inwards by the slack, which
        // changes their nearness by at most 1 part in 128.
        let opening_nearness =
            if is_clipped { camera.min_nearness(clip_depth) * (127.0 / 128.0) } else { f64::INFINITY };
        let depth = self.clipped.iter().map(|point| point.z).fold(f64::INFINITY, f64::min);
        let corners = self.clipped.iter().map(|&point| camera.project(point));
        let max_nearness = camera.max_nearness(depth);
        self.silhouettes.add(
            corners,
            camera.pixel_error(slack, depth),
            self.planes.iter().copied(),
            [opening_nearness, max_nearness],
        );
    }
}

/// The corners of the box around an object's mesh, if the object's bounds are those of its mesh: then it is drawn as
/// its mesh is.
fn exact_mesh_corners(scene: &SceneRef<'_>, object: usize) -> Option<[Vec3; 2]> {
    let mesh = scene.assets.get(scene.meshes[object]).ok()?;
    (scene.bounds_column().get(object) == mesh.bounds()).then(|| mesh.corners())
}

/// An object's orientation and scale.
fn transform(objects: &ObjectBlock, entry: usize) -> (Quat, Vec3) {
    let object = &objects.gpu_objects[entry];
    (Quat::from_array(object.orientation), Vec3::from(object.scale))
}

/// The transform of an object whose mesh lies between two corners.
fn camera_from_object(
    camera: &OcclusionCamera,
    scene: &SceneRef<'_>,
    objects: &ObjectBlock,
    object: usize,
    [low, high]: [Vec3; 2],
) -> CameraFromObject {
    let (orientation, scale) = transform(objects, object % ObjectTable::BLOCK_SIZE);
    let extent = (low.abs().max(high.abs()).as_dvec3() * scale.as_dvec3()).length();
    camera.camera_from_object(scene.position_column().get(object), orientation, scale, extent)
}
