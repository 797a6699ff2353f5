//! The level of detail that each object is drawn at in a view, by the errors of its mesh's levels.

use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

use glam::{DVec2, DVec3};
use parking_lot::RwLock;

use super::{BoundingSphere, ObjectBlock, ObjectTable, RenderView, UsedMeshes};
use crate::bit_set::BitWord;
use crate::command::Version;
use crate::quality::Quality;
use crate::scene::{Assets, LevelOfDetail, Mesh, Projection, SceneRef};

/// Chooses levels of detail in a view by their errors in its picture: see [`Quality::level_of_detail`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LevelSelector {
    eye: DVec3,
    forward: DVec3,
    /// Geometry nearer than this is not drawn. 0 if a clip plane replaces the near plane, because it may be nearer.
    near: f64,
    magnification: Magnification,
    /// In pixels.
    largest_error: f64,
}

/// The pixels by which a point moves in the picture for each metre of a small displacement.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Magnification {
    /// At a depth of 1 m on the view's axis, in pixels per metre, and the largest secant of the angle between the axis
    /// and a ray of the picture.
    Perspective { focal: f64, largest_secant: f64 },
    /// In pixels per metre.
    Orthographic(f64),
    /// At a distance of 1 m, in pixels per metre.
    Paraboloid(f64),
}

/// A level becomes coarser only where this share of the error that is allowed is enough.
const COARSENING_SHARE: f64 = 0.75;

impl LevelSelector {
    pub(crate) fn new(view: &RenderView, quality: &Quality) -> Self {
        let camera = &view.camera;
        let [width, height] = camera.size.map(f64::from);
        let focal = height * 0.5 / camera.projection.half_height();
        let magnification = match camera.projection {
            Projection::Perspective { .. } => {
                let reach = DVec2::new(width, height) * 0.5 * (1.0 + camera.shift.abs().as_dvec2());
                Magnification::Perspective { focal, largest_secant: (reach / focal).length().hypot(1.0) }
            }
            Projection::Orthographic { .. } => Magnification::Orthographic(focal),
            Projection::Paraboloid => Magnification::Paraboloid(width * 0.5),
        };
        let of_kind = view.kind().rules().level_error_scale;
        Self {
            eye: camera.position,
            forward: camera.orientation.as_dquat().normalize() * DVec3::NEG_Z,
            near: if view.has_oblique_near_plane() { 0.0 } else { f64::from(camera.near) },
            magnification,
            largest_error: f64::from(quality.level_of_detail) * f64::from(camera.level_of_detail_scale) * of_kind,
        }
    }

    /// The level of an object within a bounding sphere, whose mesh is enlarged by `scale` at most and has these errors.
    /// `before` is its level in the frame before, or more than any level if it had none.
    ///
    /// It becomes finer as soon as its error exceeds what is allowed, so that no error ever does, and coarser only with
    /// some margin. So an object that moves back and forth keeps its level.
    pub(super) fn level(&self, bounds: BoundingSphere, scale: f32, levels: &LevelErrors, before: u32) -> u32 {
        let largest = self.largest_error / (self.pixels_per_metre(bounds) * f64::from(scale));
        before.clamp(levels.coarsest(largest * COARSENING_SHARE), levels.coarsest(largest))
    }

    /// An upper bound of how many pixels a point within a sphere moves in the picture, for each metre that it moves
    /// within the sphere.
    ///
    /// In perspective, at a depth of z and an angle of φ from the axis, moving by a small length moves a point's image
    /// by at most focal ÷ z × sec φ times as much: the direction that turns the ray away from the axis is the fastest.
    /// A paraboloid enlarges by half of 1 ÷ cos² (φ ÷ 2) in all directions, which is 1 at the rim.
    fn pixels_per_metre(&self, BoundingSphere { center, radius }: BoundingSphere) -> f64 {
        let (offset, radius) = (center - self.eye, f64::from(radius));
        match self.magnification {
            Magnification::Perspective { focal, largest_secant } => {
                // What may be arbitrarily near is enlarged without a bound.
                let depth = (self.forward.dot(offset) - radius).max(self.near);
                focal / depth * ((offset.length() + radius) / depth).min(largest_secant)
            }
            Magnification::Orthographic(pixels) => pixels,
            Magnification::Paraboloid(pixels) => pixels / (offset.length() - radius).max(self.near),
        }
    }
}

/// The errors of the levels of the meshes that objects use, by slot. The meshes themselves are much larger.
#[derive(Debug, Default)]
pub(crate) struct MeshLevels {
    /// The identity and revision of the mesh collection that this was built from, and the revision of the used meshes.
    version: Option<(u64, u64, u64)>,
    /// For each slot, up to the last mesh with levels.
    errors: Vec<LevelErrors>,
}

/// The errors of a mesh's coarser levels, in metres in object space. They ascend.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LevelErrors {
    count: usize,
    errors: [f32; LevelOfDetail::MAX_COUNT],
}

impl LevelErrors {
    /// Those of at most [`LevelOfDetail::MAX_COUNT`] levels, the finest first.
    pub(super) fn of(errors: impl ExactSizeIterator<Item = f32>) -> Self {
        let mut levels = Self { count: errors.len(), ..Self::default() };
        levels.errors.iter_mut().zip(errors).for_each(|(own, error)| *own = error);
        levels
    }

    /// The coarsest level whose error is at most `largest` metres in object space.
    pub(super) fn coarsest(&self, largest: f64) -> u32 {
        let errors = &self.errors[..self.count];
        errors.iter().take_while(|error| f64::from(**error) <= largest).count() as u32
    }
}

impl MeshLevels {
    /// Rebuilds the table if the meshes have changed, or others are used.
    pub(crate) fn update(&mut self, assets: &Assets, used: &UsedMeshes) {
        let version = (assets.meshes.identity(), assets.meshes.revision(), used.revision());
        if self.version == Some(version) {
            return;
        }
        self.version = Some(version);
        self.errors.clear();
        for (handle, mesh) in
            assets.iter::<Mesh>().filter(|(handle, mesh)| !mesh.levels().is_empty() && used.contains(*handle))
        {
            self.errors.resize(handle.index() as usize, LevelErrors::default());
            self.errors.push(LevelErrors::of(mesh.levels().iter().map(LevelOfDetail::error)));
        }
    }

    /// Whether no mesh has levels.
    pub(crate) fn is_empty(&self) -> bool {
        self.errors.is_empty()
    }

    /// Whether the mesh in a slot has levels.
    pub(crate) fn contains(&self, slot: u32) -> bool {
        self.get(slot).is_some()
    }

    /// The errors of the mesh in a slot; `None` if it has no levels.
    pub(super) fn get(&self, slot: u32) -> Option<&LevelErrors> {
        self.errors.get(slot as usize).filter(|levels| levels.count > 0)
    }
}

/// The level of detail of each object that a view sees. It is kept from frame to frame, because a level depends on the
/// one before.
#[derive(Debug, Default)]
pub(crate) struct ObjectLevels {
    /// By the index of an object. An object that the view does not see keeps the level that it had. When an object is
    /// removed, the last object takes its index and its level.
    levels: Vec<AtomicU8>,
    /// Whether a level changed since the latest [`ObjectLevels::complete`].
    has_changed: AtomicBool,
    version: RwLock<Version>,
}

/// Coarser than any level: of an object that has none yet.
const UNCHOSEN: u8 = u8::MAX;

impl ObjectLevels {
    /// Makes room for this number of objects.
    pub(crate) fn resize(&mut self, objects: usize) {
        self.levels.resize_with(objects, || AtomicU8::new(UNCHOSEN));
    }

    /// Chooses the levels of the `visible` objects of a word. Jobs that choose at the same time must have different
    /// words.
    pub(crate) fn choose(
        &self,
        selector: &LevelSelector,
        (scene, table, meshes): (&SceneRef<'_>, &ObjectTable, &MeshLevels),
        visible: BitWord,
    ) {
        if visible.mask == 0 {
            return;
        }
        let block = table.block(visible.index() / ObjectBlock::WORDS);
        for object in visible.indices() {
            let entry = object % ObjectBlock::SIZE;
            // Relaxed, here and below: jobs that read the levels depend on this job.
            let before = self.levels[object].load(Ordering::Relaxed);
            let level = meshes.get(block.draws[entry].mesh).map_or(0, |errors| {
                let scale = scene.scale_column().get(object).abs().max_element();
                selector.level(block.spheres.get(entry), scale, errors, before.into()) as u8
            });
            if level != before {
                self.levels[object].store(level, Ordering::Relaxed);
                self.has_changed.store(true, Ordering::Relaxed);
            }
        }
    }

    /// Call it once, after all levels have been chosen. If they differ from those before, they get `version`, which no
    /// others have.
    pub(crate) fn complete(&self, version: Version) {
        if self.has_changed.swap(false, Ordering::Relaxed) {
            *self.version.write() = version;
        }
    }

    /// The version that the latest different levels got.
    pub(crate) fn version(&self) -> Version {
        *self.version.read()
    }

    /// The level of an object that the view sees.
    #[inline]
    pub(crate) fn get(&self, object: usize) -> u32 {
        self.levels[object].load(Ordering::Relaxed).into()
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, Quat, Vec2, Vec3};
    use proptest::prelude::*;

    use super::*;
    use crate::scene::{Camera, ClipPlane, LevelOfDetail, ViewKind};

    prop_compose! {
        fn any_camera()(
            position in prop::array::uniform3(-50.0..50.0_f64),
            turn in prop::array::uniform3(-3.0..3.0_f32),
            degrees in 2.0..150.0_f32,
            size in prop::array::uniform2(16_u32..3000),
            shift in prop::array::uniform2(-1.0..1.0_f32),
            kind in 0_u32..4,
            clip_plane in prop::option::of((prop::array::uniform3(-0.5..0.5_f32), 0.01..0.5_f64)),
        ) -> Camera {
            let (projection, shift) = match kind {
                0 | 1 => (Projection::Perspective { field_of_view: degrees.to_radians() }, Vec2::from(shift)),
                2 => (Projection::Orthographic { height: degrees }, Vec2::ZERO),
                _ => (Projection::Paraboloid, Vec2::ZERO),
            };
            let is_map = projection == Projection::Paraboloid;
            let (position, orientation) = (DVec3::from(position), Quat::from_scaled_axis(turn.into()));
            // Before the camera, and nearer than the near plane in part.
            let clip_plane = clip_plane.filter(|_| kind == 1).map(|(lean, distance)| ClipPlane {
                point: position + (orientation * Vec3::NEG_Z).as_dvec3() * distance,
                normal: orientation * (Vec3::NEG_Z + Vec3::from(lean)).normalize(),
            });
            Camera {
                position,
                orientation,
                clip_plane,
                projection,
                shift: if kind == 0 { shift } else { Vec2::ZERO },
                size: if is_map { [size[0]; 2] } else { size },
                near: 0.3,
                far: 500.0,
                kind: if is_map { ViewKind::Shadow } else { ViewKind::Main },
                ..Camera::looking_at("any", DVec3::ZERO, DVec3::NEG_Z)
            }
        }
    }

    /// Whether a corner of the picture sees a clip plane, which its camera is behind, beyond the near plane or not at
    /// all.
    fn reaches_beyond_near_plane(camera: &Camera, plane: &ClipPlane) -> bool {
        let Projection::Perspective { field_of_view } = camera.projection else { return false };
        let half = (f64::from(field_of_view) / 2.0).tan();
        let aspect = f64::from(camera.size[0]) / f64::from(camera.size[1]);
        let (near, orientation) = (f64::from(camera.near), camera.orientation.as_dquat().normalize());
        let corners = [-1.0, 1.0].map(|x| [-1.0, 1.0].map(|y| DVec3::new(x * half * aspect, y * half, -1.0) * near));
        // A corner of the near plane is behind the clip plane if its ray meets that farther away.
        corners.as_flattened().iter().any(|corner| plane.distance(camera.position + orientation * *corner) < 0.0)
    }

    /// Where a point is in the picture, in pixels from its upper left corner, by the definition of the projections;
    /// `None` if it is not in the picture, or nearer than the near plane.
    fn pixel(camera: &Camera, point: DVec3) -> Option<DVec2> {
        let local = camera.orientation.as_dquat().normalize().inverse() * (point - camera.position);
        let size = DVec2::from(camera.size.map(f64::from));
        let (clip, depth) = match camera.projection {
            Projection::Perspective { field_of_view } => {
                let half = (f64::from(field_of_view) / 2.0).tan() * -local.z;
                let clip = DVec2::new(local.x / (half * size.x / size.y), local.y / half);
                (clip - camera.shift.as_dvec2(), -local.z)
            }
            Projection::Orthographic { height } => {
                let half = f64::from(height) / 2.0;
                (DVec2::new(local.x / (half * size.x / size.y), local.y / half), -local.z)
            }
            Projection::Paraboloid => {
                let distance = local.length();
                (local.truncate() / (distance - local.z), if local.z < 0.0 { distance } else { 0.0 })
            }
        };
        let is_clipped = match camera.clip_plane.filter(|plane| reaches_beyond_near_plane(camera, plane)) {
            Some(plane) => plane.distance(point) < 0.0 || depth <= 0.0,
            None => depth < f64::from(camera.near),
        };
        let is_drawn = !is_clipped && clip.abs().max_element() <= 1.0;
        is_drawn.then(|| (clip * DVec2::new(0.5, -0.5) + 0.5) * size)
    }

    fn errors(errors: &[f32]) -> LevelErrors {
        LevelErrors::of(errors.iter().copied())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        /// Points move within the object's bounds by as much as the chosen level allows.
        #[test]
        fn no_point_moves_by_more_than_the_largest_error(
            camera in any_camera(),
            (x, y, distance) in (-1.2..1.2_f64, -1.2..1.2_f64, -0.3..2.3_f64),
            radius in 0.01..20.0_f32,
            scale in 0.1..3.0_f32,
            pixels in 0.1..20.0_f32,
            moves in prop::collection::vec((prop::array::uniform3(-1.0..1.0_f64), prop::array::uniform3(-1.0..1.0_f64)), 30),
        ) {
            let view = RenderView::new(&camera);
            let is_oblique = camera.clip_plane.is_some_and(|plane| reaches_beyond_near_plane(&camera, &plane));
            prop_assert_eq!(view.has_oblique_near_plane(), is_oblique);
            let [right, up, forward] = view.precise_picture_axes();
            let distance = 10_f64.powf(distance);
            let center = camera.position + match camera.projection {
                Projection::Orthographic { .. } => right * x + up * y + forward * distance,
                _ => (right * x + up * y + forward) * distance,
            };
            let levels = errors(&[0.001, 0.01, 0.05, 0.2, 0.6, 2.0, 9.0]);
            let quality = Quality { level_of_detail: pixels, ..Quality::balanced() };
            let bounds = BoundingSphere { center, radius };
            let level = LevelSelector::new(&view, &quality).level(bounds, scale, &levels, u32::MAX);
            let allowed = f64::from(pixels) * if camera.kind == ViewKind::Shadow { 2.0 } else { 1.0 };
            if level > 0 {
                let error = f64::from([0.001_f32, 0.01, 0.05, 0.2, 0.6, 2.0, 9.0][level as usize - 1] * scale);
                let inside = |point: DVec3| point.distance(center) <= f64::from(radius);
                for (from, towards) in moves {
                    // Mostly near the point that is nearest to the camera.
                    let nearest = (camera.position - center).normalize_or_zero();
                    let from = center + (nearest + DVec3::from(from) * 0.5).normalize_or_zero() * f64::from(radius) * 0.999;
                    let to = from + DVec3::from(towards).normalize_or_zero() * error;
                    if inside(from) && inside(to) && let (Some(one), Some(other)) = (pixel(&camera, from), pixel(&camera, to)) {
                        let moved = one.distance(other);
                        prop_assert!(moved <= allowed * (1.0 + 1e-9), "{moved} of {allowed} pixels");
                    }
                }
            }
        }

        /// A disc across the view's axis moves by as much as its level says, so the next level would move it by too
        /// much.
        #[test]
        fn the_level_is_the_coarsest_that_is_allowed(
            camera in any_camera(), distance in 1.0..300.0_f64, pixels in 0.1..20.0_f32,
        ) {
            let camera = Camera { shift: Vec2::ZERO, ..camera };
            let (view, values) = (RenderView::new(&camera), [0.001_f32, 0.004, 0.02, 0.1, 0.3, 0.8, 2.0]);
            let forward = camera.orientation.as_dquat().normalize() * DVec3::NEG_Z;
            let center = camera.position + forward * distance;
            let quality = Quality { level_of_detail: pixels, ..Quality::balanced() };
            let bounds = BoundingSphere { center, radius: 1e-4 };
            let level = LevelSelector::new(&view, &quality).level(bounds, 1.0, &errors(&values), u32::MAX);
            // A paraboloid is finer at its rim, by a factor of 2, than on its axis.
            let allowed = f64::from(pixels) * if camera.kind == ViewKind::Shadow { 2.0 } else { 1.0 };
            let finest = if camera.projection == Projection::Paraboloid { 2.0 } else { 1.0 };
            if let Some(&next) = values.get(level as usize) {
                let step = 1e-5;
                let aside = camera.orientation.as_dquat().normalize() * DVec3::Y * step;
                if let (Some(one), Some(other)) = (pixel(&camera, center), pixel(&camera, center + aside)) {
                    let moved = one.distance(other) / step * f64::from(next) * finest;
                    prop_assert!(moved > allowed * 0.999, "{moved} of {allowed} pixels at level {}", level + 1);
                }
            }
        }

        #[test]
        fn a_level_stays_until_it_is_too_coarse_or_finer_than_needed_by_a_margin(
            distances in prop::collection::vec(1.0..60.0_f64, 1..30),
        ) {
            let view = RenderView::new(&Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z));
            let selector = |pixels: f32| LevelSelector::new(&view, &Quality { level_of_detail: pixels, ..Quality::balanced() });
            let levels = errors(&[0.001, 0.004, 0.02, 0.1]);
            let mut level = u32::MAX;
            for distance in distances {
                let bounds = BoundingSphere { center: DVec3::NEG_Z * distance, radius: 0.5 };
                let without_history = |pixels: f32| selector(pixels).level(bounds, 1.0, &levels, u32::MAX);
                let next = selector(1.0).level(bounds, 1.0, &levels, level);
                let (coarsest, finest) = (without_history(1.0), without_history(0.75));
                prop_assert!(finest <= next && next <= coarsest);
                prop_assert!(next == level || (level > coarsest && next == coarsest) || (level < finest && next == finest));
                prop_assert_eq!(selector(1.0).level(bounds, 1.0, &levels, next), next, "nothing moved");
                level = next;
            }
        }
    }

    #[test]
    fn what_a_clip_plane_lets_nearer_than_the_near_plane_is_as_fine_as_with_that_near_plane() {
        let camera = Camera { near: 1.0, ..Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z) };
        // Beyond the near plane at the lower edge of the picture.
        let plane = ClipPlane { point: DVec3::NEG_Z * 0.02, normal: Vec3::new(0.0, 0.9, -0.43).normalize() };
        let bounds = BoundingSphere { center: DVec3::NEG_Z * 0.06, radius: 0.01 };
        let level = |camera: Camera| {
            let selector = LevelSelector::new(&RenderView::new(&camera), &Quality::balanced());
            selector.level(bounds, 1.0, &errors(&[1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3]), u32::MAX)
        };
        let clipped = level(Camera { clip_plane: Some(plane), ..camera.clone() });
        assert_eq!(clipped, level(Camera { near: 0.02, ..camera.clone() }));
        assert!(clipped < level(camera));
    }

    #[test]
    fn an_object_around_the_camera_has_full_detail_and_one_without_size_none() {
        let camera =
            Camera { orientation: DQuat::IDENTITY.as_quat(), ..Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z) };
        let selector = LevelSelector::new(&RenderView::new(&camera), &Quality::fast());
        let levels = errors(&[0.01; LevelOfDetail::MAX_COUNT]);
        let level = |z: f64, scale| {
            selector.level(BoundingSphere { center: DVec3::Z * z, radius: 1.0 }, scale, &levels, u32::MAX)
        };
        assert_eq!([level(0.0, 1.0), level(0.5, 1.0), level(-1e6, 1.0), level(-5.0, 0.0)], [0, 0, 7, 7]);
    }
}
