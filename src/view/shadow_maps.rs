//! Shadow maps: a light's view is a view like any other (M 10.4, L 4.2.2).

use glam::{DQuat, DVec3, Quat, Vec2, Vec3};

use super::FixedPosition;
use super::cascades::{cascade_slice, visible_sphere};
use super::map_owners::MapOwners;
use crate::scene::{Camera, LayerMask, Light, LightFields, Projection, Redraw, ShadowProjection, ViewFilter, ViewKind};

/// How shadow maps are drawn and read. The maps of all lights have the same size, and are the layers of one texture.
///
/// So a frame has at most as many maps as the device's textures have layers: 256, unless the device was requested with
/// a higher limit. That is 42 point lights whose range a camera sees. Lights beyond that are drawn without a shadow,
/// and counted as [`IssueReason::ShadowMapLimit`](super::IssueReason::ShadowMapLimit): main cameras take maps
/// one after the other in the scene's order, each for the lights that reach what it sees in the scene's order, if all
/// maps of the light fit. So what one camera shows does not depend on the cameras after it.
///
/// # Several main cameras
///
/// A directional light has maps of its own for each main camera, so that none sees coarser shadows because of where
/// another one is. Main cameras that need the same maps share them: tiles, and the jittered cameras of one picture. A
/// view that is no main camera's has the maps of the one that it is [named](Camera::child_name) after, as `main/mirror`
/// is after `main`, or else those of the scene's first main camera. Maps of other lights are the same for all views.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowMaps {
    /// The width and height of a map in pixels. At a distance of d metres, a pixel is about 4·d/side metres wide for a
    /// hemispherical light, 2·d·tan(angle)/side for a spot light, and 2·d/(side − 2·`filter` − 2) for a point light,
    /// where d is along the axis of the cube's face. For a directional light it is as wide as the diameter of the
    /// sphere around what the main camera sees of the map's slice, divided by `side`: at 60° and 16:9 and with one
    /// cascade some 2.4·`max_distance`/side.
    pub side: u32,
    /// The distance from a main camera, in metres, up to which a directional light's maps cover its view; at most
    /// 1,000 km. Beyond it, and where only a reflection or a portal looks, nothing is in shadow.
    ///
    /// Towards the light, a map reaches sixteen times the radius of the sphere around what it covers. Whatever is
    /// beyond that casts its shadow all the same.
    pub max_distance: f32,
    /// The number of maps of a directional light for a main camera, from 1 to [`ShadowMaps::MAX_CASCADES`]. Each covers
    /// a slice of what the camera sees, between two distances, and a point is looked up in the finest map that contains
    /// it. A shadow's edge is as sharp as the slice's sphere is small. Each map is a view.
    pub cascades: u32,
    /// Where the slices end, from 0, equal depths, to 1, equal ratios of the distances: the λ of the practical split
    /// scheme (Zhang et al. 2006).
    pub split_lambda: f32,
    /// The depth bias, as a multiple of what a pixel's width and the surface's slope require. Below 1, lit surfaces
    /// shadow themselves in stripes (shadow acne); above, light leaks through under objects (peter-panning).
    pub bias: f32,
    /// The radius of percentage-closer filtering: shadows fade over 2·`filter` + 1 pixels of the map; 0 is bilinear
    /// filtering. At most [`ShadowMaps::MAX_FILTER`].
    pub filter: u32,
    /// Only objects that belong to one of these layers cast shadows: an object casts none if it is in others only. The
    /// [filters](Camera::filter) of the views that the maps light make no difference.
    pub layers: LayerMask,
}

impl ShadowMaps {
    /// The largest [`ShadowMaps::filter`]: it reads 100 pixels of the map for each pixel of the picture.
    pub const MAX_FILTER: u32 = 4;
    /// The largest [`ShadowMaps::cascades`].
    pub const MAX_CASCADES: u32 = 4;

    /// Describes the first invalid setting, if any.
    pub(crate) fn problem(&self) -> Option<&'static str> {
        if self.side == 0 {
            Some("a side of 0 pixels")
        } else if !(self.max_distance > 0.0 && self.max_distance <= 1e6) {
            Some("a max_distance that is not a positive distance of at most 1,000 km")
        } else if !(1..=Self::MAX_CASCADES).contains(&self.cascades) {
            Some("a number of cascades that is not from 1 to ShadowMaps::MAX_CASCADES")
        } else if !(0.0..=1.0).contains(&self.split_lambda) {
            Some("a split_lambda that is not from 0 to 1")
        } else if !(self.bias >= 0.0 && self.bias.is_finite()) {
            Some("a bias that is negative or not finite")
        } else if self.filter > Self::MAX_FILTER {
            Some("a filter above ShadowMaps::MAX_FILTER")
        } else {
            None
        }
    }

    /// The cameras of a light's shadow maps, the layers of which follow each other in this order: a perspective camera
    /// for a spot light, a paraboloid for a hemispherical light, six perspective cameras for a point light, and for a
    /// directional light an orthographic camera for each cascade, from the finest to the coarsest, around what a main
    /// camera sees: those of the first main camera among `cameras`, then those of each further one that does not share
    /// them. A light has all its maps or none: none if it casts no shadow, and a directional light for a main camera if
    /// no finite sphere is around what that sees, or if a map's camera would be beyond
    /// [`FixedPosition::MAX_COORDINATE`]. No light has maps if a setting is invalid: a renderer with such maps is
    /// [`PlanError::ShadowMaps`](crate::process::PlanError::ShadowMaps).
    ///
    /// The only map of a light is called `name`, the faces of a cube `name, +X` and so on, and cascades `name, cascade
    /// 1` and so on. Those of a further main camera `second` are called `name for second` and so on.
    ///
    /// # The error of a point light's maps
    ///
    /// A perspective map keeps straight edges straight, so a shadow's edge in a map is off by what rasterization
    /// rounds: corners are snapped to 1/256 of a pixel, and a pixel is in shadow as a whole, by its centre, at most
    /// half a pixel from the edge along each axis. The filter turns that into a fade. A position whose distance from
    /// the edge is more than `filter` + 1 pixels along each axis of the face reads no pixel beyond the edge, and is
    /// exact. Across the edge of the cube nothing is added: each face is wider than 90° by the `filter` + 1 pixels that
    /// are read, so no filter leaves its map, and at the edge of the cube the pixels of both faces have the same width.
    /// This holds for maps of at least 8/3 · (`filter` + 1) pixels: a smaller one has no room for the pixels beyond the
    /// edge.
    pub fn cameras(&self, name: &str, light: &Light, cameras: &[Camera]) -> Vec<Camera> {
        if !light.casts_shadow() || self.problem().is_some() {
            return Vec::new();
        }
        let LightFields { position, direction, range, cone, .. } = light.fields();
        let position = position.copied().unwrap_or_default();
        let direction = direction.copied().unwrap_or(Vec3::NEG_Z);
        let range = range.copied().unwrap_or_default();
        let camera = |name: String, direction, projection| Camera {
            projection,
            ..self.camera(name, position, direction, range)
        };
        match light.kind().rules().maps {
            ShadowProjection::Cube => {
                let field_of_view = 2.0 * self.cube_face_extent().atan() as f32;
                let face = |(axis, axis_name): &(Vec3, &str)| {
                    camera(format!("{name}, {axis_name}"), *axis, Projection::Perspective { field_of_view })
                };
                CUBE_FACES.iter().map(face).collect()
            }
            ShadowProjection::Perspective => {
                let field_of_view = cone.map_or(f32::INFINITY, |[_, outer]| 2.0 * outer).min(MAX_SPOT_FIELD_OF_VIEW);
                vec![camera(name.to_owned(), direction, Projection::Perspective { field_of_view })]
            }
            ShadowProjection::Paraboloid => vec![camera(name.to_owned(), direction, Projection::Paraboloid)],
            ShadowProjection::Cascades => {
                let owners = self.map_owners(cameras);
                let maps_of = |owner: usize| {
                    let (name, owner) = (owners.map_name(name, owner, cameras), &cameras[owner]);
                    self.cascade_cameras(&name, direction, owner).unwrap_or_default()
                };
                owners.owners().iter().flat_map(|owner| maps_of(*owner)).collect()
            }
        }
    }

    /// Which main cameras have maps of directional lights of their own, and whose maps light what the others show.
    pub(crate) fn map_owners(&self, cameras: &[Camera]) -> MapOwners {
        MapOwners::new(cameras, |camera| self.cascade_spheres(camera))
    }

    /// How many maps a light has; a directional one for a main camera.
    pub(crate) fn map_count(&self, light: &Light) -> usize {
        match light.kind().rules().maps {
            ShadowProjection::Cascades => self.cascades as usize,
            ShadowProjection::Cube => CUBE_FACES.len(),
            ShadowProjection::Perspective | ShadowProjection::Paraboloid => 1,
        }
    }

    /// A camera of a light at `position` that looks along `direction` as far as `range`.
    fn camera(&self, name: String, position: DVec3, direction: Vec3, range: f32) -> Camera {
        Camera {
            name,
            position,
            orientation: looking_along(direction),
            projection: Projection::Paraboloid,
            shift: Vec2::ZERO,
            whole: None,
            clip_plane: None,
            near: (range * NEAR_PLANE_SHARE).max(f32::MIN_POSITIVE),
            far: range.max(f32::MIN_POSITIVE * 2.0),
            size: [self.side; 2],
            level_of_detail_scale: 1.0,
            layers: self.layers,
            filter: ViewFilter::ALL,
            samples_views: true,
            kind: ViewKind::Shadow,
            redraw: Redraw::EveryFrame,
        }
    }

    /// Half the width of the map of a cube's face, at a distance of 1: more than 1 by the pixels that the filter reads
    /// beyond the edge of the face.
    fn cube_face_extent(&self) -> f64 {
        self.extent_with_margin(1.0, self.filter + 1)
    }

    /// Half the width of a map whose outermost pixels, this many on each side, lie beyond `half`. In a map that has
    /// hardly more pixels than these, they take three quarters of it.
    fn extent_with_margin(&self, half: f64, pixels: u32) -> f64 {
        half / (1.0 - 2.0 * f64::from(pixels) / f64::from(self.side)).max(0.25)
    }

    /// What the maps of directional lights cover for a main camera: a sphere for each cascade. `None` if one would be
    /// invalid.
    fn cascade_spheres(&self, main: &Camera) -> Option<Vec<(DVec3, f64)>> {
        let far = self.max_distance.min(main.far);
        let spheres = (0..self.cascades).map(|cascade| {
            let slice = cascade_slice([main.near, far], self.split_lambda, cascade, self.cascades);
            let (center, radius) = visible_sphere(main, slice)?;
            // Snapping moves the map by less than a pixel, so it is a pixel larger on every side. With several cascades
            // it is also larger by what the filter reads, so that no point of the slice falls through to the coarser
            // map.
            let radius = match self.cascades {
                1 => radius * (1.0 + 4.0 / f64::from(self.side)),
                _ => self.extent_with_margin(radius, self.filter + 2),
            };
            Some((center, radius))
        });
        spheres.collect()
    }

    /// The cameras of a directional light's maps for a main camera; `None` if one would be out of reach.
    fn cascade_cameras(&self, name: &str, direction: Vec3, main: &Camera) -> Option<Vec<Camera>> {
        let spheres = self.cascade_spheres(main)?;
        let (_, largest) = *spheres.last()?;
        let orientation = looking_along(direction);
        let camera = |(cascade, (center, radius)): (usize, (DVec3, f64))| {
            let center = self.snapped_to_texels(center, radius, orientation.as_dquat().normalize());
            let casters = (CASTER_DISTANCE * largest).clamp(CASTER_DISTANCE * radius, MAX_CASTER_DISTANCE * radius);
            let height = casters + 2.0 * radius;
            let position = center - (orientation * Vec3::NEG_Z).as_dvec3() * height;
            FixedPosition::new(position)?;
            let name = match self.cascades {
                1 => name.to_owned(),
                _ => format!("{name}, cascade {}", cascade + 1),
            };
            let (radius, height) = (radius as f32, height as f32);
            Some(Camera {
                projection: Projection::Orthographic { height: 2.0 * radius },
                near: radius.max(f32::MIN_POSITIVE),
                far: (height + radius).max(f32::MIN_POSITIVE * 2.0),
                ..self.camera(name, position, direction, 0.0)
            })
        };
        spheres.into_iter().enumerate().map(camera).collect()
    }

    /// Moves a map's centre by less than a pixel, so that its pixels keep their positions in the world from frame to
    /// frame and shadows do not crawl when the camera moves. They do where the radius changes: when the field of view
    /// does, or the shift of a camera that is off centre, other than by [`Camera::jittered`].
    fn snapped_to_texels(&self, center: DVec3, radius: f64, orientation: DQuat) -> DVec3 {
        let pixel = 2.0 * radius / f64::from(self.side);
        let local = orientation.inverse() * center;
        let snap = |value: f64| (value / pixel).floor() * pixel;
        orientation * DVec3::new(snap(local.x), snap(local.y), local.z)
    }
}

impl Default for ShadowMaps {
    fn default() -> Self {
        Self {
            side: 1024,
            max_distance: 60.0,
            cascades: 1,
            split_lambda: 0.5,
            bias: 1.0,
            filter: 1,
            layers: LayerMask::ALL,
        }
    }
}

/// The directions and names of a cube's faces. Shaders know their order.
const CUBE_FACES: [(Vec3, &str); 6] =
    [(Vec3::X, "+X"), (Vec3::NEG_X, "-X"), (Vec3::Y, "+Y"), (Vec3::NEG_Y, "-Y"), (Vec3::Z, "+Z"), (Vec3::NEG_Z, "-Z")];

/// The near plane of a light's map, as a share of its range.
const NEAR_PLANE_SHARE: f32 = 1e-5;

/// How far a directional light's map extends towards the light beyond the visible sphere, in its radii. The larger the
/// distance, the more f32 rounds: here to within a hundredth of a pixel of 1024.
const CASTER_DISTANCE: f64 = 16.0;

/// A finer cascade extends as far as the coarsest, up to this many of its own radii: there f32 rounds to within a
/// tenth of a pixel.
const MAX_CASTER_DISTANCE: f64 = 128.0;

/// In radians. Towards 180°, the centre of a perspective picture shrinks to nothing.
const MAX_SPOT_FIELD_OF_VIEW: f32 = 2.967;

/// The orientation of a camera that looks along `direction`.
fn looking_along(direction: Vec3) -> Quat {
    Camera::looking_at("", DVec3::ZERO, direction.as_dvec3()).orientation
}

#[cfg(test)]
mod tests {
    use glam::Vec2;
    use proptest::prelude::*;

    use super::*;
    use crate::view::RenderView;

    fn sun() -> Light {
        let direction = Vec3::new(0.3, -0.8, -0.5).normalize();
        Light::Directional { direction, illuminance: Vec3::ONE, casts_shadow: true }
    }

    proptest! {
        /// All that a main camera sees within the maximum distance is in the map of its cascade that the sun has for
        /// that camera, before its far plane, and so far inside that the filter reads no pixel outside. So is what the
        /// camera sees that draws a tile or is jittered.
        #[test]
        fn a_cascade_covers_what_main_cameras_see_of_its_slice(
            placements in prop::collection::vec((prop::array::uniform3(-1e4..1e4_f64), 1.0..160_f32), 1..3),
            tile in prop_oneof![Just(None), prop::array::uniform2(0..3_u32).prop_map(Some)],
            jitter in prop_oneof![Just(None), prop::array::uniform2(-0.5..0.5_f32).prop_map(Some)],
            pixel in prop::array::uniform2(prop_oneof![-1.0..1.0_f32, Just(-1.0), Just(1.0)]),
            share in 0.0..1.0_f32,
            is_at_an_end in any::<bool>(),
            cascades in 1..=ShadowMaps::MAX_CASCADES,
            split_lambda in 0.0..=1.0_f32,
            filter in 0..=ShadowMaps::MAX_FILTER,
            side in 24..200_u32,
        ) {
            let maps = ShadowMaps { cascades, split_lambda, filter, side, ..ShadowMaps::default() };
            let cameras: Vec<_> = placements
                .into_iter()
                .map(|(position, degrees)| Camera {
                    projection: Projection::Perspective { field_of_view: degrees.to_radians() },
                    ..Camera::looking_at("main", DVec3::from(position), DVec3::ZERO)
                })
                .map(|camera| tile.map_or(camera.clone(), |tile| camera.tile(tile, 3)))
                .map(|camera| jitter.map_or(camera.clone(), |offset| camera.jittered(offset.into())))
                .collect();
            let of_sun = maps.cameras("sun", &sun(), &cameras);
            prop_assert_eq!(of_sun.len(), cascades as usize * cameras.len());
            let [near, far] = [cameras[0].near.max(maps.max_distance * 1e-3), maps.max_distance].map(f64::from);
            let end = |cascade: u32| {
                let share = f64::from(cascade) / f64::from(cascades);
                let [equal_ratio, equal_depth] = [near * (far / near).powf(share), near + (far - near) * share];
                equal_depth + (equal_ratio - equal_depth) * f64::from(split_lambda)
            };
            let slice = (share * cascades as f32) as u32;
            let [begin, end] = [if slice == 0 { 0.0 } else { end(slice) }, end(slice + 1)];
            let distance = if is_at_an_end { end } else { begin + (end - begin) * f64::from(share) } as f32;
            let outside = if cascades == 1 { 0.0 } else { (2.0 * filter as f32 + 1.0) / side as f32 };
            // The part of a pixel that a jitter shows beyond the edge of the picture.
            let beyond = if jitter.is_some() { 1.0 / cameras[0].size[1] as f32 } else { 0.0 };
            for (camera, of_camera) in cameras.iter().zip(of_sun.chunks(cascades as usize)) {
                let map = RenderView::new(&of_camera[slice as usize]);
                let [right, up, forward] = RenderView::new(camera).picture_axes();
                let seen = (right * pixel[0] + up * pixel[1] + forward) * distance;
                let point = camera.position + seen.as_dvec3() - map.camera.position;
                let clip = map.clip_from_relative() * point.as_vec3().extend(1.0);
                prop_assert!(clip.truncate().truncate().abs().max_element() <= 1.0 - outside + beyond + 1e-4, "{clip}");
                prop_assert!((-1e-4..=1.0 + 1e-4).contains(&clip.z), "{clip}");
            }
        }

        /// What draws a part of a picture, or a jittered one, has the maps of the whole picture.
        #[test]
        fn tiles_and_jittered_cameras_have_the_same_maps(
            position in prop::array::uniform3(-1e6..1e6_f64),
            towards in prop::array::uniform3(-1.0..1.0_f64),
            is_orthographic in any::<bool>(),
            shift in prop_oneof![Just([0.0; 2]), prop::array::uniform2(-2.0..2.0_f32)],
            jitters in prop::array::uniform3(prop::array::uniform2(-0.5..0.5_f32)),
            count in 1..5_u32,
            cascades in 1..=ShadowMaps::MAX_CASCADES,
        ) {
            let position = DVec3::from(position);
            let camera = Camera { far: 100.0, ..Camera::looking_at("main", position, position + DVec3::from(towards)) };
            let camera = match is_orthographic {
                true => Camera { projection: Projection::Orthographic { height: 7.0 }, ..camera },
                false => Camera { shift: shift.into(), ..camera },
            };
            let maps = ShadowMaps { cascades, ..ShadowMaps::default() };
            let tiles = (0..count * count).map(|tile| camera.tile([tile % count, tile / count], count));
            let jittered = jitters.map(|jitter| camera.jittered(jitter.into()));
            let of_tile = jitters.map(|jitter| camera.tile([0, 0], count).jittered(jitter.into()));
            let cameras: Vec<_> = tiles.chain(jittered).chain(of_tile).collect();
            prop_assert_eq!(maps.cameras("sun", &sun(), &cameras).len(), cascades as usize);
            let of_whole = maps.cameras("sun", &sun(), &[camera.jittered(Vec2::ZERO)]);
            prop_assert_eq!(maps.cameras("sun", &sun(), &cameras), of_whole);
            // Without a shift, they are those of the camera itself.
            if is_orthographic || shift == [0.0; 2] {
                prop_assert_eq!(maps.cameras("sun", &sun(), &[camera]), maps.cameras("sun", &sun(), &cameras));
            }
        }
    }

    #[test]
    fn a_map_reaches_from_the_casters_to_the_end_of_its_slice() {
        let main = Camera { near: 1e-5, ..Camera::looking_at("main", DVec3::Y, DVec3::ZERO) };
        let is_near = |found: f32, expected: f64| (f64::from(found) / expected - 1.0).abs() < 1e-6;
        let mut limited = 0;
        for (cascades, split_lambda) in (1..=ShadowMaps::MAX_CASCADES).flat_map(|count| [(count, 0.5), (count, 1.0)]) {
            let maps = ShadowMaps {
                cascades,
                split_lambda,
                filter: 3,
                side: 100,
                max_distance: 0.01,
                ..ShadowMaps::default()
            };
            // A pixel on each side with one cascade, and with more of them 5 of 50 from the centre.
            let margin = if cascades == 1 { 1.04 } else { 1.0 / 0.9 };
            let radius = |cascade| {
                let slice = cascade_slice([1e-5, 0.01], split_lambda, cascade, cascades);
                visible_sphere(&main, slice).unwrap().1 * margin
            };
            let of_sun = maps.cameras("sun", &sun(), std::slice::from_ref(&main));
            for (cascade, map) in (0..).zip(&of_sun) {
                let (radius, largest) = (radius(cascade), radius(cascades - 1));
                let Projection::Orthographic { height } = map.projection else { panic!("it has perspective") };
                assert!(is_near(height, 2.0 * radius) && is_near(map.near, radius), "{map:?}");
                let casters = (16.0 * largest).min(128.0 * radius);
                assert!(is_near(map.far, casters + 3.0 * radius), "{} {casters} {radius}", map.far);
                limited += usize::from(16.0 * largest > 128.0 * radius);
            }
        }
        assert!((1..10).contains(&limited), "{limited} maps reach 128 of their radii");
        let (position, direction, intensity) = (DVec3::ZERO, Vec3::X, Vec3::ONE);
        let lamp = Light::Hemispherical { position, direction, intensity, range: 0.5, casts_shadow: true };
        assert_eq!(ShadowMaps::default().cameras("lamp", &lamp, &[])[0].far, 0.5);
    }

    #[test]
    fn directional_maps_move_by_whole_pixels() {
        let maps = ShadowMaps { side: 64, cascades: 3, ..ShadowMaps::default() };
        let pixels_of_origin = |x: f64| {
            let camera = Camera::looking_at("main", DVec3::new(x, 1.0, 2.0), DVec3::new(x, 1.0, -9.0));
            let pixel = |map: &Camera| {
                let map = RenderView::new(map);
                let clip = map.clip_from_relative() * (-map.camera.position).as_vec3().extend(1.0);
                Vec2::new(clip.x, clip.y) * 32.0
            };
            maps.cameras("sun", &sun(), &[camera]).iter().map(pixel).collect::<Vec<_>>()
        };
        let first = pixels_of_origin(0.0);
        for step in 1..20 {
            for (now, first) in pixels_of_origin(f64::from(step) * 0.37).into_iter().zip(&first) {
                let moved = now - first;
                assert!((moved - moved.round()).abs().max_element() < 1e-3, "{moved}");
            }
        }
    }

    #[test]
    fn a_main_camera_that_is_invalid_or_too_far_away_has_no_map_of_the_sun_and_others_have_theirs() {
        let main = || Camera::looking_at("main", DVec3::Z, DVec3::ZERO);
        let invalid = [
            Camera { size: [0, 0], ..main() },
            Camera { projection: Projection::Perspective { field_of_view: f32::NAN }, ..main() },
            Camera { far: 0.0, ..main() },
            Camera { far: -1.0, ..main() },
            Camera { position: DVec3::X * 1e200, ..main() },
            Camera { position: DVec3::X * 1e11, ..main() },
        ];
        for cascades in 1..=ShadowMaps::MAX_CASCADES {
            let maps = ShadowMaps { cascades, ..ShadowMaps::default() };
            let of_sun = |cameras: &[Camera]| maps.cameras("sun", &sun(), cameras);
            let alone = of_sun(&[main()]);
            assert_eq!(alone.len(), cascades as usize);
            for (case, camera) in invalid.iter().cloned().enumerate() {
                assert!(of_sun(std::slice::from_ref(&camera)).is_empty(), "case {case} with {cascades} cascades");
                assert_eq!(of_sun(&[main(), camera]), alone, "case {case} with {cascades} cascades");
            }
        }
    }

    #[test]
    fn maps_are_named_after_their_light_and_what_they_show() {
        let main = Camera::looking_at("main", DVec3::Z, DVec3::ZERO);
        let names = |cascades: u32, light: Light| -> Vec<String> {
            let maps = ShadowMaps { cascades, ..ShadowMaps::default() };
            maps.cameras("light", &light, std::slice::from_ref(&main)).into_iter().map(|map| map.name).collect()
        };
        let lamp = Light::Point { position: DVec3::ZERO, intensity: Vec3::ONE, range: 1.0, casts_shadow: true };
        assert_eq!(names(1, sun()), ["light"]);
        assert_eq!(names(3, sun()), ["light, cascade 1", "light, cascade 2", "light, cascade 3"]);
        let faces = ["light, +X", "light, -X", "light, +Y", "light, -Y", "light, +Z", "light, -Z"];
        assert_eq!(names(3, lamp), faces);
        let second = Camera { name: "second".to_owned(), position: DVec3::X, ..main.clone() };
        let maps = ShadowMaps { cascades: 2, ..ShadowMaps::default() };
        let names: Vec<_> = maps.cameras("sun", &sun(), &[main, second]).into_iter().map(|map| map.name).collect();
        let expected = ["sun, cascade 1", "sun, cascade 2", "sun for second, cascade 1", "sun for second, cascade 2"];
        assert_eq!(names, expected);
    }

    #[test]
    fn a_light_has_all_its_maps_or_none() {
        let maps = ShadowMaps { cascades: 4, max_distance: 1e6, ..ShadowMaps::default() };
        let of_sun = |x: f64| {
            let main = Camera { far: 1e7, ..Camera::looking_at("main", DVec3::X * x, DVec3::ZERO) };
            maps.cameras("sun", &sun(), &[main]).len()
        };
        assert_eq!([of_sun(1.0), of_sun(-FixedPosition::MAX_COORDINATE * 0.9999)], [4, 0]);
    }

    #[test]
    fn invalid_maps_have_no_cameras() {
        let good = ShadowMaps { cascades: 2, ..ShadowMaps::default() };
        let main = [Camera::looking_at("main", DVec3::Z, DVec3::ZERO)];
        let lamp = Light::Point { position: DVec3::ZERO, intensity: Vec3::ONE, range: 1.0, casts_shadow: true };
        let counts = |maps: ShadowMaps| [sun(), lamp].map(|light| maps.cameras("light", &light, &main).len());
        assert_eq!(counts(good), [2, 6]);
        for maps in [
            ShadowMaps { side: 0, ..good },
            ShadowMaps { max_distance: -1.0, ..good },
            ShadowMaps { max_distance: f32::NAN, ..good },
            ShadowMaps { cascades: 0, ..good },
            ShadowMaps { cascades: u32::MAX, ..good },
            ShadowMaps { split_lambda: f32::NAN, ..good },
            ShadowMaps { bias: -1.0, ..good },
            ShadowMaps { filter: u32::MAX, ..good },
        ] {
            assert_eq!(counts(maps), [0, 0], "{maps:?}");
        }
    }

    #[test]
    fn a_light_that_casts_no_shadow_has_no_map() {
        let maps = ShadowMaps::default();
        let main = Camera::looking_at("main", DVec3::Z, DVec3::ZERO);
        let map = |light: Light, cameras: &[Camera]| maps.cameras("map", &light, cameras);
        let point = Light::Point { position: DVec3::ZERO, intensity: Vec3::ONE, range: 1.0, casts_shadow: false };
        assert_eq!(map(point, std::slice::from_ref(&main)), []);
        assert_eq!(map(sun(), &[]), []);
        let Light::Directional { direction, illuminance, .. } = sun() else { unreachable!() };
        let moon = Light::Directional { direction, illuminance, casts_shadow: false };
        assert_eq!(map(moon, &[main]), []);
    }

    /// A camera that sees something else than the picture that it drew a part of has maps of what it sees.
    #[test]
    fn a_changed_tile_has_maps_of_its_own() {
        let maps = ShadowMaps::default();
        let of_sun = |camera: &Camera| maps.cameras("sun", &sun(), std::slice::from_ref(camera));
        let perspective = Camera::looking_at("main", DVec3::Z, DVec3::ZERO);
        let projection = Projection::Orthographic { height: 7.0 };
        let plan = Camera { projection, far: 30.0, ..Camera::looking_at("plan", DVec3::Y * 9.0, DVec3::ZERO) };
        let wide = Projection::Perspective { field_of_view: 2.0 };
        let tile = |camera: &Camera| camera.tile([0, 0], 3);
        let changed = [
            Camera { projection: wide, ..tile(&perspective) },
            Camera { projection, ..tile(&perspective) },
            Camera { position: DVec3::X * 40.0, ..tile(&plan) },
            Camera { position: plan.position + DVec3::Y * 4.0, ..tile(&plan) },
            Camera { projection: Projection::Orthographic { height: 8.0 }, ..tile(&plan) },
        ];
        for camera in changed {
            let camera = Camera { far: 30.0, shift: Vec2::ZERO, ..camera };
            assert_eq!(of_sun(&camera), of_sun(&Camera { whole: None, ..camera.clone() }), "{camera:?}");
        }
        assert_ne!(of_sun(&tile(&plan)), of_sun(&Camera { whole: None, ..tile(&plan) }));
    }
}
