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
mod tests;
