//! A ball that mirrors everything around it, by a cube map.

use drawloom::command::Selection;
use drawloom::glam::DVec3;
use drawloom::process::{
    CommandDraws, CpuShader, Declare, Draws, InjectionPoint, ObjectCpuShader, ObjectPixel, PassInputs, RenderProcess,
    ShaderObject, VARYINGS, VertexInput, VertexOutput, targets,
};
use drawloom::raster::{Real, Vector, Vector4};
use drawloom::scene::{Camera, LayerMask, ViewKind};

use crate::impostor;
use crate::surface::Surface;

/// What the names of the faces' views begin with.
pub const PROBE: &str = "probe";

/// In metres.
pub const POSITION: DVec3 = DVec3::new(1.7, 0.75, 7.4);
pub const RADIUS: f32 = 0.55;

pub const LAYER: LayerMask = LayerMask::layer(5);

/// The cameras of the six faces.
pub fn cameras() -> [Camera; 6] {
    Camera::cube_faces(PROBE, POSITION, 128, 0.1)
        .map(|camera| Camera { layers: Surface::WORLD | impostor::TREE_LAYER, ..camera })
}

/// Draws the ball with the cube map.
#[derive(Clone, Copy)]
pub struct MirrorBall;

impl RenderProcess for MirrorBall {
    fn name(&self) -> &str {
        "mirror ball"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.also_views(ViewKind::Reflection);
        declare.at(InjectionPoint::AfterLighting);
        declare.after(Surface::screen().name());
        declare.samples_view_cube(ViewKind::Reflection, PROBE, targets::RADIANCE);
        declare.draws_over(targets::RADIANCE);
        // The pipeline has drawn the ball as a black object.
        declare.matches_depth(targets::DEPTH);
    }

    fn draws(&self) -> Draws<'_> {
        let (shader, selection) = (include_str!("mirror_ball.wgsl"), Selection::ALL.in_layers(LAYER));
        Draws::Commands(CommandDraws { shader, selection, ..CommandDraws::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(*self))
    }
}

impl<R: Real> ObjectCpuShader<R> for MirrorBall {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        let relative = object.relative_position(vertex.position);
        let mut varyings = [R::zero(); VARYINGS];
        varyings[..3].copy_from_slice(&relative.0);
        varyings[3..6].copy_from_slice(&object.world_normal(vertex.normal).0);
        VertexOutput { clip: pass.view.clip_position(relative), varyings }
    }

    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let [rx, ry, rz, nx, ny, nz, ..] = pixel.varyings;
        let normal = Vector([nx, ny, nz]).normalized();
        let to_eye = pass.view.direction_to_eye(Vector([rx, ry, rz]));
        let reflected = normal * (normal.dot(to_eye) * R::of(2.0)) - to_eye;
        let [red, green, blue, _] = pass.sampled[0].load_cube(reflected).0;
        targets[0] = Vector([red * R::of(TINT[0]), green * R::of(TINT[1]), blue * R::of(TINT[2]), R::one()]);
        true
    }
}

/// What the ball reflects of red, green and blue: the numbers in `mirror_ball.wgsl`.
const TINT: [f64; 3] = [0.9, 0.85, 0.75];
