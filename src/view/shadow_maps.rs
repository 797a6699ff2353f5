//! Shadow maps: a light's view is a view like any other (M 10.4, L 4.2.2).

use glam::{DQuat, DVec2, DVec3, Quat, Vec2, Vec3};

use super::FixedPosition;
use crate::scene::{Camera, LayerMask, Light, Projection, ViewKind};

/// How shadow maps are drawn and read. The maps of all lights have the same size, and are the layers of one texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowMaps {
    /// The width and height of a map in pixels. At a distance of d metres, a pixel is about 4·d/side metres wide for a
    /// hemispherical light, and 2·d·tan(angle)/side for a spot light. For a directional light it is as wide as the
    /// diameter of the sphere around what main cameras see, divided by `side`: at 60° and 16:9 some
    /// 2.3·`max_distance`/side.
    pub side: u32,
    /// The distance from the main cameras, in metres, up to which a directional light's map covers their views; at most
    /// 1,000 km. Beyond it, and where only a reflection or a portal looks, nothing is in shadow. There is one map for all main cameras: the farther they are apart,
    /// the coarser it is.
    pub max_distance: f32,
    /// The depth bias, as a multiple of what a pixel's width and the surface's slope require. Below 1, lit surfaces
    /// shadow themselves in stripes (shadow acne); above, light leaks through under objects (peter-panning).
    pub bias: f32,
    /// The radius of percentage-closer filtering: shadows fade over 2·`filter` + 1 pixels of the map; 0 is bilinear
    /// filtering. At most [`ShadowMaps::MAX_FILTER`].
    pub filter: u32,
    /// Only objects that belong to one of these layers cast shadows.
    pub layers: LayerMask,
}

impl ShadowMaps {
    /// The largest [`ShadowMaps::filter`]: it reads 100 pixels of the map for each pixel of the picture.
    pub const MAX_FILTER: u32 = 4;

    /// Describes the first invalid setting, if any.
    pub(crate) fn problem(&self) -> Option<&'static str> {
        if self.side == 0 {
            Some("a side of 0 pixels")
        } else if !(self.max_distance > 0.0 && self.max_distance <= 1e6) {
            Some("a max_distance that is not a positive distance of at most 1,000 km")
        } else if !(self.bias >= 0.0 && self.bias.is_finite()) {
            Some("a bias that is negative or not finite")
        } else if self.filter > Self::MAX_FILTER {
            Some("a filter above ShadowMaps::MAX_FILTER")
        } else {
            None
        }
    }

    /// The camera of a light's shadow map: a perspective camera for a spot light, a paraboloid for a hemispherical
    /// light, and for a directional light an orthographic camera around what the main cameras among `cameras` see.
    /// `None` for a light that casts no shadow, and for a directional light if there is no main camera or if the map's
    /// camera would be beyond [`FixedPosition::MAX_COORDINATE`].
    pub fn camera(&self, name: String, light: &Light, cameras: &[Camera]) -> Option<Camera> {
        if !light.casts_shadow() {
            return None;
        }
        let (position, direction, projection, [near, far]) = match *light {
            Light::Point { .. } => return None,
            Light::Spot { position, direction, range, outer_angle, .. } => {
                let field_of_view = (2.0 * outer_angle).min(MAX_SPOT_FIELD_OF_VIEW);
                (position, direction, Projection::Perspective { field_of_view }, [range * NEAR_PLANE_SHARE, range])
            }
            Light::Hemispherical { position, direction, range, .. } => {
                (position, direction, Projection::Paraboloid, [range * NEAR_PLANE_SHARE, range])
            }
            Light::Directional { direction, .. } => {
                let (center, radius) = self.visible_sphere(cameras)?;
                // Snapping moves the map by less than a pixel, so it is a pixel larger on every side.
                let radius = radius * (1.0 + 4.0 / f64::from(self.side));
                let orientation = looking_along(direction);
                let center = self.snapped_to_texels(center, radius, orientation.as_dquat().normalize());
                let height = radius * (CASTER_DISTANCE + 2.0);
                let position = center - (orientation * Vec3::NEG_Z).as_dvec3() * height;
                FixedPosition::new(position)?;
                let (radius, height) = (radius as f32, height as f32);
                (position, direction, Projection::Orthographic { height: 2.0 * radius }, [radius, height + radius])
            }
        };
        Some(Camera {
            name,
            position,
            orientation: looking_along(direction),
            projection,
            shift: Vec2::ZERO,
            clip_plane: None,
            near: near.max(f32::MIN_POSITIVE),
            far: far.max(f32::MIN_POSITIVE * 2.0),
            size: [self.side; 2],
            layers: self.layers,
            kind: ViewKind::Shadow,
        })
    }

    /// A sphere around all that main cameras see within the maximum distance. Its size does not change when a camera
    /// turns.
    fn visible_sphere(&self, cameras: &[Camera]) -> Option<(DVec3, f64)> {
        let main = cameras.iter().filter(|camera| camera.kind == ViewKind::Main);
        main.map(|camera| {
            let far = f64::from(self.max_distance.min(camera.far));
            let forward = camera.orientation.normalize().as_dquat() * DVec3::NEG_Z;
            let aspect = f64::from(camera.aspect());
            match camera.projection {
                Projection::Perspective { field_of_view } => {
                    let up = (f64::from(field_of_view) * 0.5).tan();
                    // The sphere through the camera and the far corners, or around the far corners if it is larger.
                    // Less a pixel, so that a jitter of less moves no shadow.
                    let pixel = 2.0 / DVec2::from(camera.size.map(f64::from));
                    let shift = (camera.shift.abs().as_dvec2() - pixel).max(DVec2::ZERO);
                    let corner = DVec2::new(up * aspect, up) * (1.0 + shift);
                    let spread = corner.length_squared();
                    let along = if spread < 1.0 { far * (1.0 + spread) * 0.5 } else { far };
                    let radius = if spread < 1.0 { along } else { far * spread.sqrt() };
                    (camera.position + forward * along, radius)
                }
                Projection::Orthographic { height } => {
                    let half = f64::from(height) * 0.5;
                    let radius = (half * half * (1.0 + aspect * aspect) + far * far * 0.25).sqrt();
                    (camera.position + forward * (far * 0.5), radius)
                }
                Projection::Paraboloid => (camera.position, far),
            }
        })
        .reduce(enclosing_sphere)
    }

    /// Moves a map's centre by less than a pixel, so that its pixels keep their positions in the world from frame to
    /// frame and shadows do not crawl when the camera moves.
    fn snapped_to_texels(&self, center: DVec3, radius: f64, orientation: DQuat) -> DVec3 {
        let pixel = 2.0 * radius / f64::from(self.side);
        let local = orientation.inverse() * center;
        let snap = |value: f64| (value / pixel).floor() * pixel;
        orientation * DVec3::new(snap(local.x), snap(local.y), local.z)
    }
}

impl Default for ShadowMaps {
    fn default() -> Self {
        Self { side: 1024, max_distance: 60.0, bias: 1.0, filter: 1, layers: LayerMask::ALL }
    }
}

/// The near plane of a light's map, as a share of its range.
const NEAR_PLANE_SHARE: f32 = 1e-5;

/// How far a directional light's map extends towards the light beyond the visible sphere, in its radii. A triangle that
/// crosses the near plane is drawn with a wrong slope, since depth is clamped there. The larger the distance, the more
/// f32 rounds: here to within a hundredth of a pixel of 1024.
const CASTER_DISTANCE: f64 = 16.0;

/// In radians. Towards 180°, the centre of a perspective picture shrinks to nothing.
const MAX_SPOT_FIELD_OF_VIEW: f32 = 2.967;

/// The orientation of a camera that looks along `direction`.
fn looking_along(direction: Vec3) -> Quat {
    Camera::looking_at("", DVec3::ZERO, direction.as_dvec3()).orientation
}

/// The smallest sphere around two spheres.
fn enclosing_sphere((one, one_radius): (DVec3, f64), (other, other_radius): (DVec3, f64)) -> (DVec3, f64) {
    let distance = one.distance(other);
    if distance + other_radius <= one_radius {
        (one, one_radius)
    } else if distance + one_radius <= other_radius {
        (other, other_radius)
    } else {
        let radius = (distance + one_radius + other_radius) * 0.5;
        (one.lerp(other, (radius - one_radius) / distance), radius)
    }
}

#[cfg(all(test, not(drawloom_loom)))]
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
        /// All that a main camera sees within the maximum distance is in the sun's map, and before its far plane.
        #[test]
        fn a_directional_map_covers_what_main_cameras_see(
            placements in prop::collection::vec((prop::array::uniform3(-1e4..1e4_f64), 1.0..160_f32), 1..3),
            pixel in prop::array::uniform2(-1.0..1.0_f32),
            share in 0.0..1.0_f32,
        ) {
            let maps = ShadowMaps::default();
            let cameras: Vec<_> = placements
                .into_iter()
                .map(|(position, degrees)| Camera {
                    projection: Projection::Perspective { field_of_view: degrees.to_radians() },
                    ..Camera::looking_at("main", DVec3::from(position), DVec3::ZERO)
                })
                .collect();
            let map = RenderView::new(&maps.camera("sun".into(), &sun(), &cameras).unwrap());
            for camera in &cameras {
                let [right, up, forward] = RenderView::new(camera).picture_axes();
                let seen = (right * pixel[0] + up * pixel[1] + forward) * (share * maps.max_distance);
                let point = camera.position + seen.as_dvec3() - map.camera.position;
                let clip = map.clip_from_relative() * point.as_vec3().extend(1.0);
                prop_assert!(clip.truncate().truncate().abs().max_element() <= 1.0 + 1e-4, "{clip}");
                prop_assert!((-1e-4..=1.0 + 1e-4).contains(&clip.z), "{clip}");
            }
        }
    }

    #[test]
    fn a_directional_map_moves_by_whole_pixels() {
        let maps = ShadowMaps { side: 64, ..ShadowMaps::default() };
        let pixel_of_origin = |x: f64| {
            let camera = Camera::looking_at("main", DVec3::new(x, 1.0, 2.0), DVec3::new(x, 1.0, -9.0));
            let map = RenderView::new(&maps.camera("sun".into(), &sun(), &[camera]).unwrap());
            let clip = map.clip_from_relative() * (-map.camera.position).as_vec3().extend(1.0);
            Vec2::new(clip.x, clip.y) * 32.0
        };
        let first = pixel_of_origin(0.0);
        for step in 1..20 {
            let moved = pixel_of_origin(f64::from(step) * 0.37) - first;
            assert!((moved - moved.round()).abs().max_element() < 1e-3, "{moved}");
        }
    }

    #[test]
    fn a_light_that_casts_no_shadow_has_no_map() {
        let maps = ShadowMaps::default();
        let main = Camera::looking_at("main", DVec3::Z, DVec3::ZERO);
        let map = |light: Light, cameras: &[Camera]| maps.camera("map".into(), &light, cameras);
        let point = Light::Point { position: DVec3::ZERO, intensity: Vec3::ONE, range: 1.0 };
        assert_eq!(map(point, std::slice::from_ref(&main)), None);
        assert_eq!(map(sun(), &[]), None);
        let Light::Directional { direction, illuminance, .. } = sun() else { unreachable!() };
        let moon = Light::Directional { direction, illuminance, casts_shadow: false };
        assert_eq!(map(moon, &[main]), None);
    }
}
