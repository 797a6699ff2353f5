//! The usual culling test: planes from an f32 clip-from-world matrix (Gribb and Hartmann 2001), and f32 world
//! positions.

use drawloom::glam::{Mat4, Vec3, Vec4, Vec4Swizzles};
use drawloom::scene::{Camera, Projection};
use drawloom::view::RenderView;

pub struct Naive {
    pub(super) planes: [Vec4; 6],
}

impl Naive {
    /// `None` for a projection that is not a matrix.
    pub fn new(camera: &Camera) -> Option<Self> {
        if camera.projection == Projection::Paraboloid {
            return None;
        }
        let translation = Mat4::from_translation(-camera.position.as_vec3());
        let clip = RenderView::new(camera).clip_from_relative() * translation;
        let [x, y, z, w] = [0, 1, 2, 3].map(|row| clip.row(row));
        let far = match camera.projection {
            // The matrix has no far plane, and `w` is the distance along the axis.
            Projection::Perspective { .. } => Vec4::W * camera.far.min(f32::MAX) - w,
            _ => z,
        };
        let planes = [w + x, w - x, w + y, w - y, w - z, far].map(|plane| plane / plane.xyz().length().max(1e-30));
        Some(Self { planes })
    }

    pub fn sees(&self, center: Vec3, radius: f32) -> bool {
        self.planes.iter().all(|plane| plane.dot(center.extend(1.0)) >= -radius)
    }
}
