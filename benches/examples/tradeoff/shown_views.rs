//! The processes that show another view's picture in the scene.

use drawloom::command::Selection;
use drawloom::process::{
    CommandDraws, CpuShader, Declare, Draws, InjectionPoint, ObjectCpuShader, ObjectPixel, PassInputs, RenderProcess,
    ShaderObject, VARYINGS, VertexInput, VertexOutput, targets,
};
use drawloom::raster::{Real, Vector, Vector4};
use drawloom::scene::{LayerMask, ViewKind};

use crate::subject::{IMPOSTOR, MIRRORS, SQUARE_TYPE};

/// Draws a mirror's surface with the picture of its view.
#[derive(Clone, Copy)]
pub struct Mirror {
    pub view: &'static str,
    /// The layer of the surface.
    pub surface: LayerMask,
    /// The name of the mirror before it: mirrors change the same target, in any order.
    pub after: Option<&'static str>,
}

impl RenderProcess for Mirror {
    fn name(&self) -> &str {
        self.view
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterLighting);
        declare.samples_view(ViewKind::Reflection, self.view, targets::RADIANCE);
        declare.draws_over(targets::RADIANCE);
        // The pipeline has drawn the surface as a black object.
        declare.matches_depth(targets::DEPTH);
        self.after.into_iter().for_each(|before| declare.after(before));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var mirrored: texture_2d<f32>;

            @vertex
            fn vertex(in: VertexInput) -> @invariant @builtin(position) vec4<f32> {
                return clip_position(relative_position(drawn_object(in.instance), in.position));
            }

            @fragment
            fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
                let share = position.xy / vec2<f32>(view.width, view.height);
                // A mirrored camera sees left and right swapped.
                let uv = vec2<f32>(1.0 - share.x, share.y);
                return vec4<f32>(textureSampleLevel(mirrored, target_sampler, uv, 0.0).rgb, 1.0);
            }
        ";
        let selection = Selection::ALL.in_layers(self.surface);
        Draws::Commands(CommandDraws { shader, selection, ..CommandDraws::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(*self))
    }
}

impl<R: Real> ObjectCpuShader<R> for Mirror {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        let relative = object.relative_position(vertex.position);
        VertexOutput { clip: pass.view.clip_position(relative), varyings: [R::zero(); VARYINGS] }
    }

    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let share = |axis: usize| R::of((pixel.coordinates[axis] as f64 + 0.5) / pass.view.size[axis] as f64);
        let [r, g, b, _] = pass.sampled[0].sample_level(Vector([R::one() - share(0), share(1)]), 0, R::zero()).0;
        targets[0] = Vector([r, g, b, R::one()]);
        true
    }
}

/// Draws the impostor's square with its picture, where that shows the original.
#[derive(Clone, Copy)]
pub struct Impostor;

impl RenderProcess for Impostor {
    fn name(&self) -> &str {
        IMPOSTOR
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterLighting);
        declare.samples_view(ViewKind::Reflection, IMPOSTOR, targets::RADIANCE);
        declare.samples_view(ViewKind::Reflection, IMPOSTOR, targets::DEPTH);
        declare.draws_over(targets::RADIANCE);
        declare.tests_depth(targets::DEPTH);
        // It writes no depth, so mirrors behind it are drawn first.
        MIRRORS.iter().for_each(|(mirror, _)| declare.after(mirror));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var radiance: texture_2d<f32>;
            @group(2) @binding(2) var depth: texture_depth_2d;

            struct Corner {
                @invariant @builtin(position) position: vec4<f32>,
                @location(0) uv: vec2<f32>,
            }

            @vertex
            fn vertex(in: VertexInput) -> Corner {
                let relative = relative_position(drawn_object(in.instance), in.position);
                return Corner(clip_position(relative), in.uv);
            }

            @fragment
            fn fragment(in: Corner) -> @location(0) vec4<f32> {
                let size = vec2<f32>(textureDimensions(depth));
                let pixel = min(vec2<i32>(in.uv * size), vec2<i32>(size) - 1);
                // The background is infinitely far away.
                if textureLoad(depth, pixel, 0) <= 0.0 {
                    discard;
                }
                return vec4<f32>(textureLoad(radiance, pixel, 0).rgb, 1.0);
            }
        ";
        let selection = Selection::OPAQUE.of_material_type(SQUARE_TYPE);
        Draws::Commands(CommandDraws { shader, selection, discards: true, ..CommandDraws::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(*self))
    }
}

impl<R: Real> ObjectCpuShader<R> for Impostor {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        let relative = object.relative_position(vertex.position);
        let mut varyings = [R::zero(); VARYINGS];
        varyings[..2].copy_from_slice(&vertex.uv.0);
        VertexOutput { clip: pass.view.clip_position(relative), varyings }
    }

    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let [u, v, ..] = pixel.varyings;
        let size = pass.sampled[0].size();
        let nearest =
            |share: R, axis: usize| ((share.as_f64().max(0.0) * size[axis] as f64) as usize).min(size[axis] - 1);
        let coordinates = [nearest(u, 0), nearest(v, 1)];
        targets[0] = pass.sampled[0].load(coordinates, 0);
        pass.sampled[1].load(coordinates, 0)[0] > R::zero()
    }
}
