//! The light that a glowing mesh gives.

use glam::{DVec3, Vec3};

use super::geometry::ModelGeometry;
use crate::scene::Light;

/// A mesh whose mean normal is at least this long is planar.
const PLANAR: f64 = 0.9;

/// The light that stands for a mesh at `position` that gives off `radiance`, in a scene of diameter `size`. None if there
/// is nothing to see of it.
///
/// A planar mesh shines from its front with the intensity radiance × area on its axis. Any other one shines everywhere,
/// with a quarter of that, which is what a convex body shows of its surface on average.
pub(super) fn light(geometry: &ModelGeometry, position: DVec3, radiance: Vec3, size: f64) -> Option<Light> {
    let (mut area, mut facing, mut centroid) = (0.0, DVec3::ZERO, DVec3::ZERO);
    for corners in geometry.indices.as_chunks::<3>().0 {
        let corners = corners.map(|index| geometry.vertices[index as usize]);
        let [a, b, c] = corners.map(|corner| Vec3::from(corner.position).as_dvec3());
        let normal = corners.iter().map(|corner| Vec3::from(corner.normal).as_dvec3()).sum::<DVec3>();
        let product = (b - a).cross(c - a) / 2.0;
        area += product.length();
        centroid += product.length() * (a + b + c) / 3.0;
        // Winding is no promise in an OBJ file, normals are.
        facing += if product.dot(normal) < 0.0 { -product } else { product };
    }
    if !(area > 0.0 && radiance.max_element() > 0.0) {
        return None;
    }
    let center = position + centroid / area;
    let direction = facing / area;
    // Finite even for a surface as large as 32-bit coordinates allow.
    let intensity = |area: f64| (radiance.as_dvec3() * area).min(DVec3::splat(1e30)).as_vec3();
    // A light that reaches much farther than the scene is as good as one that never ends.
    let range = |intensity: Vec3| Light::range_for(intensity).min((4.0 * size) as f32).max(f32::MIN_POSITIVE);
    Some(if direction.length() >= PLANAR {
        let direction = direction.normalize();
        let intensity = intensity(area);
        Light::Hemispherical {
            // Off the surface, lest it light itself.
            position: center + direction * (1e-3 * area.sqrt()),
            direction: direction.as_vec3().normalize(),
            intensity,
            range: range(intensity),
            casts_shadow: true,
        }
    } else {
        let intensity = intensity(area / 4.0);
        Light::Point { position: center, intensity, range: range(intensity) }
    })
}
