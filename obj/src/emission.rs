//! Lights that stand for emissive meshes.

use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::Light;

use crate::geometry::GeometryPart;

/// A mesh counts as planar if the length of its mean normal is at least this.
const MIN_PLANAR_NORMAL: f64 = 0.9;

/// The light for a mesh that emits `radiance`, in a scene of diameter `scene_diameter`. `None` if the mesh has
/// no area, or emits nothing.
///
/// A planar mesh becomes a hemispherical light with the intensity radiance × area on its axis. Any other mesh becomes a
/// point light with a quarter of that: the mean projected area of a convex body is a quarter of its surface.
pub(crate) fn light(geometry: &GeometryPart, radiance: Vec3, scene_diameter: f64) -> Option<Light> {
    let (mut area, mut facing, mut centroid) = (0.0, DVec3::ZERO, DVec3::ZERO);
    for corners in geometry.indices.as_chunks::<3>().0 {
        let corners = corners.map(|index| geometry.vertices[index as usize]);
        let [a, b, c] = corners.map(|corner| Vec3::from(corner.position).as_dvec3());
        let normal = corners.iter().map(|corner| Vec3::from(corner.normal).as_dvec3()).sum::<DVec3>();
        let product = (b - a).cross(c - a) / 2.0;
        area += product.length();
        centroid += product.length() * (a + b + c) / 3.0;
        // OBJ guarantees no winding, but normals.
        facing += if product.dot(normal) < 0.0 { -product } else { product };
    }
    if !(area > 0.0 && radiance.max_element() > 0.0) {
        return None;
    }
    let center = geometry.center + centroid / area;
    let direction = facing / area;
    // Finite for any surface that 32-bit coordinates can represent.
    let intensity = |area: f64| (radiance.as_dvec3() * area).min(DVec3::splat(1e30)).as_vec3();
    // A range much larger than the scene makes no difference.
    let range = |intensity: Vec3| Light::range_for(intensity).min((4.0 * scene_diameter) as f32).max(f32::MIN_POSITIVE);
    Some(if direction.length() >= MIN_PLANAR_NORMAL {
        let direction = direction.normalize();
        let intensity = intensity(area);
        Light::Hemispherical {
            // In front of the surface, so that the surface casts no shadow on itself.
            position: center + direction * (1e-3 * area.sqrt()),
            direction: direction.as_vec3().normalize(),
            intensity,
            range: range(intensity),
            casts_shadow: true,
        }
    } else {
        let intensity = intensity(area / 4.0);
        Light::Point { position: center, intensity, range: range(intensity), casts_shadow: false }
    })
}
