//! A process that draws every object in a colour of the engine's own.

use drawloom::command::Selection;
use drawloom::process::{
    ClearColor, CommandDraws, CpuShader, Declare, Draws, Format, ObjectCpuShader, ObjectPixel, PassInputs,
    RenderProcess, ShaderObject, VARYINGS, VertexInput, VertexOutput,
};
use drawloom::raster::{Real, Vector, Vector4};
use drawloom::scene::ObjectColumn;

/// The colour of each object: red, green, blue and opacity, linear.
pub const TINT: ObjectColumn<[f32; 4]> = ObjectColumn::new("tint");

/// Draws every object in its [`TINT`] into the target `tinted`.
#[derive(Clone, Copy, Debug)]
pub struct Tinted;

impl RenderProcess for Tinted {
    fn name(&self) -> &str {
        "tinted"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("tinted", Format::Rgba8Unorm, ClearColor::Value([0.0, 0.0, 0.0, 1.0]));
        declare.clears_depth("depth of tinted", Format::Depth32Float);
        declare.reads_column(TINT);
    }

    fn draws(&self) -> Draws<'_> {
        let (shader, selection) = (include_str!("tinted.wgsl"), Selection::ALL);
        Draws::Commands(CommandDraws { shader, selection, ..CommandDraws::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(*self))
    }
}

impl<R: Real> ObjectCpuShader<R> for Tinted {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        let clip = pass.view.clip_position(object.relative_position(vertex.position));
        let tint = pass.column(TINT, object.index);
        let mut varyings = [R::zero(); VARYINGS];
        for (varying, channel) in varyings.iter_mut().zip(tint) {
            *varying = R::of(f64::from(channel));
        }
        VertexOutput { clip, varyings }
    }

    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let [_, _, _, opacity] = pass.column(TINT, pixel.object);
        let [red, green, blue, ..] = pixel.varyings;
        targets[0] = Vector([red, green, blue, R::of(f64::from(opacity))]);
        true
    }
}
