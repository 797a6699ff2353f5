//! A process that reads a column whose elements are larger than an object's 64 bytes.

use drawloom::command::Selection;
use drawloom::process::{
    CommandDraws, CpuShader, Declare, Draws, ObjectCpuShader, ObjectPixel, PassInputs, RenderProcess, ShaderObject,
    VARYINGS, VertexInput, VertexOutput,
};
use drawloom::raster::{Real, Vector, Vector4};
use drawloom::scene::ObjectColumn;

/// The colour of each object is the last of ten.
pub const TINTS: ObjectColumn<[[f32; 4]; 10]> = ObjectColumn::new("wide tint");

/// The bytes of an object in the column.
pub const STRIDE: usize = 160;

/// Draws blended objects in their tints, in the place of the pipeline's transparency. The plan has it only while an
/// object is blended.
#[derive(Clone, Copy)]
pub struct WideTransparency;

impl RenderProcess for WideTransparency {
    fn name(&self) -> &str {
        "transparency"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.draws_over("radiance");
        declare.tests_depth("depth");
        declare.reads_column(TINTS);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(3) @binding(0) var<storage, read> tints: array<array<vec4<f32>, 10>>;

            struct Corner {
                @builtin(position) position: vec4<f32>,
                @location(0) @interpolate(flat) object: u32,
            }

            @vertex
            fn vertex(in: VertexInput) -> Corner {
                let object = drawn_object(in.instance);
                return Corner(clip_position(relative_position(object, in.position)), object.index);
            }

            @fragment
            fn fragment(in: Corner) -> @location(0) vec4<f32> {
                return tints[in.object][9];
            }
        ";
        let selection = Selection::BLENDED;
        Draws::Commands(CommandDraws { shader, selection, writes_depth: false, ..CommandDraws::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(*self))
    }
}

impl<R: Real> ObjectCpuShader<R> for WideTransparency {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        let clip = pass.view.clip_position(object.relative_position(vertex.position));
        VertexOutput { clip, varyings: [R::zero(); VARYINGS] }
    }

    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let [.., last] = pass.column(TINTS, pixel.object);
        targets[0] = Vector(last.map(|channel| R::of(f64::from(channel))));
        true
    }
}
