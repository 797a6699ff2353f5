//! The position of a vertex in a picture: as shaders compute it, from f32 world positions, and exact.

use std::error::Error;

use drawloom::glam::{DQuat, DVec2, DVec3, Mat4, Quat, UVec3, Vec3, Vec4};
use drawloom::scene::{Camera, Projection, ViewKind};
use drawloom::view::internal::GpuObject;
use drawloom::view::{GpuView, RenderView};

/// A vertex of an object in a view.
#[derive(Clone, Debug)]
pub struct Case {
    pub camera: Camera,
    /// World position of the object.
    pub position: DVec3,
    pub orientation: Quat,
    pub scale: Vec3,
    /// Position of the vertex in object space.
    pub vertex: Vec3,
}

impl Case {
    /// The vertex relative to the camera, along the world's axes, in f64. It subtracts the camera's position from the
    /// object's first, which loses nothing relevant; a sum in world space would round to 10⁻⁷ m at 10⁹ m.
    pub fn relative(&self) -> DVec3 {
        let turned = unit(self.orientation) * (self.scale.as_dvec3() * self.vertex.as_dvec3());
        (self.position - self.camera.position) + turned
    }

    /// The exact position in the picture, in pixels from the upper left, in f64 from the camera's definition.
    pub fn truth(&self) -> DVec2 {
        let local = unit(self.camera.orientation).inverse() * self.relative();
        let [width, height] = self.camera.size.map(f64::from);
        let clip = match self.camera.projection {
            Projection::Perspective { field_of_view } => {
                let tangent = (f64::from(field_of_view) * 0.5).tan();
                DVec2::new(local.x / (tangent * width / height), local.y / tangent) / -local.z
            }
            Projection::Orthographic { height: picture } => {
                let half = f64::from(picture) * 0.5;
                DVec2::new(local.x / (half * width / height), local.y / half)
            }
            // Half of the angle from the axis, as the mirror shows it (Brabec et al. 2002).
            _ => {
                let direction = local.normalize();
                DVec2::new(direction.x, direction.y) / (1.0 - direction.z)
            }
        };
        self.pixels(clip)
    }

    /// The position computed from f32 world positions: object to world, world to view and view to clip space, each with
    /// a matrix of its own, as in most engines.
    pub fn absolute(&self, view: &RenderView) -> DVec2 {
        let camera = &self.camera;
        let model = Mat4::from_scale_rotation_translation(self.scale, self.orientation, self.position.as_vec3());
        let world_from_view = Mat4::from_rotation_translation(camera.orientation, camera.position.as_vec3());
        let upright = RenderView::new(&Camera { orientation: Quat::IDENTITY, ..view.camera.clone() });
        let world = times(&model, self.vertex).truncate();
        let local = times(&world_from_view.inverse(), world).truncate();
        self.drawn_at(projected(camera, times(&upright.clip_from_relative(), local)))
    }

    /// The distance of the vertex from the centre of the picture, in pixels.
    pub fn eccentricity(&self) -> f64 {
        let [width, height] = self.camera.size.map(f64::from);
        self.truth().distance(DVec2::new(width, height) * 0.5)
    }

    /// Where a device draws a vertex at this position in clip space, in pixels. It is computed in f64, so that only the
    /// error of the shader is measured.
    pub fn drawn_at(&self, clip: Vec4) -> DVec2 {
        let clip = clip.as_dvec4();
        self.pixels(DVec2::new(clip.x, clip.y) / clip.w)
    }

    fn pixels(&self, clip: DVec2) -> DVec2 {
        let [width, height] = self.camera.size.map(f64::from);
        DVec2::new((clip.x * 0.5 + 0.5) * width, (0.5 - clip.y * 0.5) * height)
    }
}

/// The vertex of a case, and what a shader reads of it.
pub struct ShaderInput<'a> {
    pub case: &'a Case,
    pub object: GpuObject,
    pub view: GpuView,
}

/// Computes the positions of vertices in clip space.
pub trait VertexShader {
    /// One for each input, in that order.
    ///
    /// # Errors
    /// If a device fails.
    fn clip_positions(&mut self, inputs: &[ShaderInput<'_>]) -> Result<Vec<Vec4>, Box<dyn Error>>;
}

/// `relative_position` and `clip_position` of `drawloom.wgsl` in Rust, in f32 and in the same order. It needs no
/// adapter.
pub struct ShaderInRust;

impl VertexShader for ShaderInRust {
    fn clip_positions(&mut self, inputs: &[ShaderInput<'_>]) -> Result<Vec<Vec4>, Box<dyn Error>> {
        let clip = |ShaderInput { case, object, view }: &ShaderInput<'_>| {
            let origin = fixed_difference(object, view);
            let turned = rotate(Quat::from_array(object.orientation), Vec3::from(object.scale) * case.vertex);
            projected(&case.camera, times(&view.clip_from_relative, origin + turned))
        };
        Ok(inputs.iter().map(clip).collect())
    }
}

/// What follows the matrix in `clip_position`.
fn projected(camera: &Camera, clip: Vec4) -> Vec4 {
    if camera.projection != Projection::Paraboloid {
        return clip;
    }
    let position = clip.truncate();
    let distance = position.length();
    let forward = -position.z / distance.max(1e-30);
    let across = distance.max(1e-30) * (1.0 + forward).max(0.1);
    Vec4::new(position.x / across, position.y / across, 0.0, 1.0)
}

/// The maximum number of pixels per radian at this distance from the centre of a perspective picture, which is
/// stretched towards its edges. The focal length f is in pixels; a ray at the angle a from the axis is at f·tan a, with
/// the derivative f(1 + tan² a).
pub fn pixels_per_radian(camera: &Camera, eccentricity: f64) -> f64 {
    match camera.projection {
        Projection::Perspective { field_of_view } => {
            let focal = f64::from(camera.size[1]) * 0.5 / (f64::from(field_of_view) * 0.5).tan();
            focal + eccentricity * eccentricity / focal
        }
        // tan(a / 2) times half the picture. Its derivative is greatest at the rim, half of the picture.
        _ => f64::from(camera.size[1]) * 0.5,
    }
}

/// The view's GPU layout.
///
/// # Panics
/// Panics if the camera is out of range.
pub fn gpu_view_of(view: &RenderView) -> GpuView {
    GpuView::new(view, Vec3::ZERO, 0).expect("the camera is within reach")
}

fn unit(orientation: Quat) -> DQuat {
    orientation.as_dquat().normalize()
}

fn rotate(orientation: Quat, direction: Vec3) -> Vec3 {
    let axis = Vec3::new(orientation.x, orientation.y, orientation.z);
    let twice = 2.0 * axis.cross(direction);
    direction + orientation.w * twice + axis.cross(twice)
}

fn times(matrix: &Mat4, position: Vec3) -> Vec4 {
    matrix.x_axis * position.x + matrix.y_axis * position.y + matrix.z_axis * position.z + matrix.w_axis
}

fn fixed_difference(object: &GpuObject, view: &GpuView) -> Vec3 {
    let (low, from_low) = (UVec3::from(object.position_low), UVec3::from(view.position_low));
    let mut difference = Vec3::ZERO;
    for axis in 0..3 {
        let borrow = i32::from(low[axis] < from_low[axis]);
        let low = low[axis].wrapping_sub(from_low[axis]);
        let high = object.position_high[axis].wrapping_sub(view.position_high[axis]).wrapping_sub(borrow);
        let negative = high < 0;
        let magnitude_low = if negative { (!low).wrapping_add(1) } else { low };
        let magnitude_high = if negative { (!(high as u32)).wrapping_add(u32::from(low == 0)) } else { high as u32 };
        let magnitude = magnitude_high as f32 * 4.0 + magnitude_low as f32 * STEP;
        difference[axis] = if negative { -magnitude } else { magnitude };
    }
    difference
}

/// 2⁻³⁰ m.
const STEP: f32 = 1.0 / (1_u32 << 30) as f32;

/// Whether the vertex is in the picture and behind the near plane.
pub fn is_visible(case: &Case) -> bool {
    let local = unit(case.camera.orientation).inverse() * case.relative();
    let pixel = case.truth();
    let [width, height] = case.camera.size.map(f64::from);
    let distance = if case.camera.projection == Projection::Paraboloid { local.length() } else { -local.z };
    let near = case.camera.kind == ViewKind::Shadow || distance >= f64::from(case.camera.near);
    near && distance > 0.0 && (0.0..=width).contains(&pixel.x) && (0.0..=height).contains(&pixel.y)
}
