//! Coarse occlusion: what a view's larger objects hide is left out of it (S 9.6).

use glam::{DVec2, DVec3, Quat, Vec3};
use parking_lot::RwLock;

use super::OccluderMeshes;
use super::occlusion_camera::{OcclusionCamera, Placement};
use crate::command::Cull;
use crate::raster::{CoarseDepth, ConvexPart, Plane, Silhouettes};
use crate::scene::SceneRef;
use crate::view::{ObjectBlock, ObjectDraw, ObjectTable, RenderView, VisibleSet, set_bits};

/// Finds what a view's larger objects hide, in three steps: [`OcclusionCuller::select_occluders`] picks those that look largest and projects
/// their convex parts, [`OcclusionCuller::draw_occluders`] draws them into a [`CoarseDepth`], and [`OcclusionCuller::hidden`] asks that of every object.
///
/// It errs one way only: what is hidden for it is hidden. Occluders count only for squares of the picture that they cover as a
/// whole, at their farthest there; objects by a rectangle around their box, at its nearest corner. Both are moved by what a
/// device's f32 may be off by, in the direction that hides less. What crosses the near plane is never hidden.
///
/// Hidden is what no sample of the picture would show, wherever in a pixel the samples are, if every object were drawn as its
/// mesh stands, opaque ones nearest first. So an opaque object hides something only where it is drawn with the bounds of its
/// mesh: one whose bounds an engine has set is taken for one whose shader moves it.
#[derive(Debug, Default)]
pub struct OcclusionCuller {
    camera: Option<OcclusionCamera>,
    /// A square's width in pixels.
    side: u32,
    depth: CoarseDepth,
    chosen: RwLock<Chosen>,
}

/// The occluders, and memory to find them with.
#[derive(Debug, Default)]
struct Chosen {
    candidates: Vec<Candidate>,
    /// A part's points from the camera.
    points: Vec<DVec3>,
    /// Those of them that are before the camera, and where edges come from behind.
    clipped: Vec<DVec3>,
    planes: Vec<[f64; 3]>,
    silhouettes: Silhouettes,
}

/// An object that may hide others.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    /// In pixels.
    width: f32,
    /// Its centre's, in metres.
    depth: f32,
    object: u32,
}

impl OcclusionCuller {
    /// How many objects are tried for hiding others, at most: those that look largest.
    pub const MAX_OCCLUDERS: usize = 2048;

    /// Starts anew for a view, in squares of so many pixels.
    pub fn reset(&mut self, view: &RenderView, side: u32) {
        self.camera = Some(OcclusionCamera::new(&view.camera));
        self.side = side;
        self.depth.reset(view.camera.size, side);
        let chosen = self.chosen.get_mut();
        chosen.candidates.clear();
        chosen.silhouettes.clear();
    }

    /// Chooses occluders among what the view sees: of those that `may_occlude`, which look as wide as a square at least, the
    /// largest.
    pub fn select_occluders(
        &self,
        scene: &SceneRef<'_>,
        table: &ObjectTable,
        visible: &VisibleSet,
        meshes: &OccluderMeshes,
        may_occlude: impl Fn(&ObjectDraw) -> bool,
    ) {
        let Some(camera) = &self.camera else { return };
        let chosen = &mut *self.chosen.write();
        for block in 0..table.block_count() {
            let objects = table.block(block);
            for first in (0..ObjectTable::BLOCK_SIZE).step_by(VisibleSet::WORD) {
                let start = block * ObjectTable::BLOCK_SIZE + first;
                for place in set_bits(visible.word(start / VisibleSet::WORD)) {
                    let (entry, object) = (first + place, start + place);
                    let bounds = objects.spheres.get(entry);
                    let center = camera.relative(bounds.center);
                    let width = camera.apparent(center, f64::from(bounds.radius));
                    let draw = &objects.draws[entry];
                    if width >= f64::from(self.side) && may_occlude(draw) && !meshes.parts(draw.mesh).is_empty() {
                        let (width, depth, object) = (width as f32, center.z as f32, object as u32);
                        chosen.candidates.push(Candidate { width, depth, object });
                    }
                }
            }
        }
        if chosen.candidates.len() > Self::MAX_OCCLUDERS {
            let by_width = |one: &Candidate, other: &Candidate| {
                other.width.total_cmp(&one.width).then(one.object.cmp(&other.object))
            };
            chosen.candidates.select_nth_unstable_by(Self::MAX_OCCLUDERS, by_width);
            chosen.candidates.truncate(Self::MAX_OCCLUDERS);
        }
        // Nearest first, as the buffer likes it.
        let by_depth =
            |one: &Candidate, other: &Candidate| one.depth.total_cmp(&other.depth).then(one.object.cmp(&other.object));
        chosen.candidates.sort_unstable_by(by_depth);
        for index in 0..chosen.candidates.len() {
            let object = chosen.candidates[index].object as usize;
            let objects = table.block(object / ObjectTable::BLOCK_SIZE);
            chosen.project(camera, scene, &objects, object, meshes);
        }
    }

    /// How many convex parts were found to draw.
    pub fn part_count(&self) -> usize {
        self.chosen.read().silhouettes.len()
    }

    /// How many strips there are to [draw](OcclusionCuller::draw_occluders).
    pub fn strip_count(&self) -> usize {
        self.depth.strip_count()
    }

    /// Draws the occluders into a strip of the coarse depth buffer. Strips may be drawn at the same time.
    pub fn draw_occluders(&self, strip: usize) {
        self.depth.draw(strip, &self.chosen.read().silhouettes);
    }

    /// Which of some objects are hidden: of those from `first` on, a multiple of [`VisibleSet::WORD`], the ones whose bits are
    /// set. To be asked when all strips are drawn.
    pub fn hidden(&self, scene: &SceneRef<'_>, table: &ObjectTable, first: usize, bits: u64) -> u64 {
        let Some(camera) = self.camera.as_ref().filter(|_| bits != 0) else { return 0 };
        let objects = table.block(first / ObjectTable::BLOCK_SIZE);
        let is_hidden = |place: &usize| self.hides(camera, scene, &objects, first + place);
        set_bits(bits).filter(is_hidden).fold(0, |hidden, place| hidden | 1 << place)
    }

    fn hides(&self, camera: &OcclusionCamera, scene: &SceneRef<'_>, objects: &ObjectBlock, object: usize) -> bool {
        let entry = object % ObjectTable::BLOCK_SIZE;
        let bounds = objects.spheres.get(entry);
        let center = camera.relative(bounds.center);
        // What is not hidden at its centre is not hidden as a whole.
        if center.z <= camera.nearest(0.0) {
            return false;
        }
        let middle = camera.picture(center);
        if camera.is_in_picture(middle)
            && f64::from(self.depth.nearness_at(middle.x, middle.y)) <= camera.nearness_at_least(center.z)
        {
            return false;
        }
        // Most of what is hidden is so with all of the ball around it, which is asked sooner than the box.
        let (radius, position) = (f64::from(bounds.radius), scene.positions[object]);
        let slack = camera.slack(center.length() + 2.0 * bounds.center.distance(position) + radius);
        let depth = center.z - radius - slack;
        if depth > camera.nearest(slack) && self.covers(camera, camera.around_ball(center, radius), depth, slack) {
            return true;
        }
        let Some([low, high]) = exact_mesh(scene, object) else { return false };
        let placement = place(camera, scene, objects, object, [low, high]);
        let slack = placement.slack;
        let (low, high) = (low.as_dvec3(), high.as_dvec3());
        let half = (high - low) * 0.5;
        let sides = [0, 1, 2].map(|axis| placement.axis(axis, half[axis]));
        let center = placement.place((low + high) * 0.5);
        let depth = center.z - sides.iter().map(|side| side.z.abs()).sum::<f64>() - slack;
        depth > camera.nearest(slack) && self.covers(camera, camera.around_box(center, sides), depth, slack)
    }

    /// Whether what lies in a rectangle of the picture, beyond a depth, is hidden, where a device may draw it so many metres off.
    fn covers(&self, camera: &OcclusionCamera, [low, high]: [DVec2; 2], depth: f64, slack: f64) -> bool {
        let nearness = camera.nearness_at_most(depth) as f32;
        // Below that, f32 is coarser than what is allowed for it.
        if camera.is_perspective() && nearness < f32::MIN_POSITIVE {
            return false;
        }
        let margin = camera.margin(slack, depth);
        self.depth.hides((low - margin).to_array(), (high + margin).to_array(), nearness)
    }
}

impl Chosen {
    /// Adds the silhouettes of an object.
    fn project(
        &mut self,
        camera: &OcclusionCamera,
        scene: &SceneRef<'_>,
        objects: &ObjectBlock,
        object: usize,
        meshes: &OccluderMeshes,
    ) {
        let Some(corners) = exact_mesh(scene, object) else { return };
        let placement = place(camera, scene, objects, object, corners);
        let draw = &objects.draws[object % ObjectTable::BLOCK_SIZE];
        if !placement.has_volume() {
            return;
        }
        for part in meshes.parts(draw.mesh) {
            self.project_part(camera, &placement, part, draw.state.cull() == Cull::Nothing);
        }
    }

    fn project_part(
        &mut self,
        camera: &OcclusionCamera,
        placement: &Placement,
        part: &ConvexPart,
        is_double_sided: bool,
    ) {
        let slack = placement.slack + part.slack * placement.stretch();
        self.points.clear();
        self.points.extend(part.points.iter().map(|&point| placement.place(point)));
        let is_cut = self.points.iter().any(|point| point.z < camera.nearest(2.0 * slack));
        let cut = if is_cut { camera.cut(placement, slack) } else { f64::NEG_INFINITY };
        self.clipped.clear();
        self.clipped.extend(self.points.iter().filter(|point| point.z >= cut));
        if is_cut {
            if self.clipped.is_empty() || !camera.is_perspective() {
                return;
            }
            for [from, to] in part.edges.iter().map(|edge| edge.map(|point| self.points[point as usize])) {
                if (from.z < cut) != (to.z < cut) {
                    let place = from.lerp(to, (cut - from.z) / (to.z - from.z));
                    self.clipped.push(DVec3::new(place.x, place.y, cut));
                }
            }
        }

        let closest = self.points.iter().map(|point| point.z).fold(f64::INFINITY, f64::min);
        self.planes.clear();
        for face in &part.faces {
            let face = placement.face(face);
            let moved_in = Plane { offset: face.offset - slack, ..face };
            let from_behind = Plane { normal: -face.normal, offset: -face.offset - slack };
            let is_flat_and_double = !part.is_closed && is_double_sided;
            let seen = [moved_in, from_behind].into_iter().take(1 + usize::from(is_flat_and_double));
            let Some((face, plane)) = seen.filter_map(|face| Some((face, camera.plane(&face, closest)?))).next() else {
                continue;
            };
            // Of a face so nearly edge on it is not known where it is cut.
            if is_cut && face.offset > -256.0 * slack {
                return;
            }
            self.planes.push(plane);
        }
        // What is entered through the cut is open there: the face through which it is entered has to be beyond it, and where it is
        // without the slack that it was moved in by, 1 part in 128 at most.
        let nearest = if is_cut { camera.nearness_at_least(cut) * (127.0 / 128.0) } else { f64::INFINITY };
        let depth = self.clipped.iter().map(|point| point.z).fold(f64::INFINITY, f64::min);
        let corners = self.clipped.iter().map(|&point| camera.picture(point));
        let most = camera.nearness_at_most(depth);
        self.silhouettes.add(corners, camera.margin(slack, depth), self.planes.iter().copied(), [nearest, most]);
    }
}

/// The corners of an object's mesh, if the object's bounds are those of the mesh: then it is drawn as it is.
fn exact_mesh(scene: &SceneRef<'_>, object: usize) -> Option<[Vec3; 2]> {
    let mesh = scene.assets.get(scene.meshes[object]).ok()?;
    (scene.bounds[object] == mesh.bounds()).then(|| mesh.corners())
}

fn transform(objects: &ObjectBlock, entry: usize) -> (Quat, Vec3) {
    let record = &objects.gpu_objects[entry];
    (Quat::from_array(record.orientation), Vec3::from(record.scale))
}

/// Where an object is whose mesh lies between two corners.
fn place(
    camera: &OcclusionCamera,
    scene: &SceneRef<'_>,
    objects: &ObjectBlock,
    object: usize,
    [low, high]: [Vec3; 2],
) -> Placement {
    let (orientation, scale) = transform(objects, object % ObjectTable::BLOCK_SIZE);
    let extent = (low.abs().max(high.abs()).as_dvec3() * scale.as_dvec3()).length();
    camera.place(scene.positions[object], orientation, scale, extent)
}
