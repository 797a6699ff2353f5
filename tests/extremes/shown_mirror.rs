//! A mirror in a scene, whose surface shows the picture of the camera in it, anywhere in the world.

use std::sync::Arc;

use drawloom::command::Selection;
use drawloom::glam::DVec3;
use drawloom::process::{
    CommandDraws, CpuShader, Declare, Draws, InjectionPoint, ObjectCpuShader, ObjectPixel, PassInputs, RenderProcess,
    ShaderObject, VARYINGS, VertexInput, VertexOutput,
};
use drawloom::quality::Quality;
use drawloom::raster::{Real, Vector4};
use drawloom::scene::{LayerMask, Scene, ViewKind};
use drawloom_testing::scenes::everything::everything_with_mirror;
use libtest_mimic::Failed;

use crate::Case;
use crate::capture::{PRECISION, assert_alike};
use crate::error_table::EXTREMES;
use crate::harness::{Harness, Setup};
use crate::markers::with_context;
use crate::moved_scenes::{scale_scene, shift_scene};

pub const CASES: &[Case] = &[("a_mirror_shows_the_same_anywhere_and_at_any_size", anywhere)];

const SURFACE: LayerMask = LayerMask::layer(7);

/// Draws the mirror with the picture of its camera, which sees left and right swapped.
#[derive(Clone, Copy)]
struct Surface;

impl RenderProcess for Surface {
    fn name(&self) -> &str {
        "mirror surface"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterLighting);
        declare.samples_view(ViewKind::Reflection, "mirror", "radiance");
        declare.draws_over("radiance");
        declare.matches_depth("depth");
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var sampled: texture_2d<f32>;

            @vertex
            fn vertex(in: VertexInput) -> @invariant @builtin(position) vec4<f32> {
                return clip_position(relative_position(drawn_object(in.instance), in.position));
            }

            @fragment
            fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
                let size = vec2<i32>(textureDimensions(sampled));
                let pixel = vec2<i32>(size.x - 1 - i32(position.x), i32(position.y));
                return textureLoad(sampled, clamp(pixel, vec2<i32>(0), size - 1), 0);
            }
        ";
        let selection = Selection::ALL.in_layers(SURFACE);
        Draws::Commands(CommandDraws { shader, selection, ..CommandDraws::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(*self))
    }
}

impl<R: Real> ObjectCpuShader<R> for Surface {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        let clip = pass.view.clip_position(object.relative_position(vertex.position));
        VertexOutput { clip, varyings: [R::zero(); VARYINGS] }
    }

    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let [width, height] = pass.sampled[0].size();
        let [x, y] = pixel.coordinates;
        targets[0] = pass.sampled[0].load([width.saturating_sub(1 + x), y.min(height - 1)], 0);
        true
    }
}

/// Maps of the sun have steps in the world, so no light casts shadows here.
fn scene() -> Scene {
    let mut scene = everything_with_mirror(SURFACE);
    for light in &mut scene.lights {
        *light.casts_shadow_mut() = false;
    }
    scene
}

/// Moves the plane of the mirror's camera with the scene.
fn move_plane(scene: &mut Scene, moved: impl Fn(DVec3) -> DVec3) {
    for camera in &mut scene.cameras {
        if let Some(plane) = &mut camera.clip_plane {
            plane.point = moved(plane.point);
        }
    }
}

fn anywhere(harness: &mut Harness) -> Result<(), Failed> {
    let quality = harness.name().affordable(Quality::balanced());
    let process: Option<Arc<dyn RenderProcess>> = Some(Arc::new(Surface));
    let setup = Setup { process, ..quality.into() };
    let mut harness = harness.with(setup).map_err(|error| Failed::from(error.to_string()))?;
    let here = harness.draw(&scene())?;
    // Without its camera the mirror is black.
    let mut black = scene();
    black.cameras.truncate(1);
    let black = harness.draw(&black)?;
    if let (Some(here), Some(black)) = (&here.capture, &black.capture) {
        let shown = here.differs_from(black).into_iter().filter(|differs| *differs).count();
        if shown < 200 {
            return Err(format!("the mirror shows something in {shown} pixels").into());
        }
    }
    for extreme in EXTREMES {
        let mut scene = scene();
        scale_scene(&mut scene, extreme.scale)?;
        shift_scene(&mut scene, extreme.position)?;
        move_plane(&mut scene, |point| point * extreme.scale + extreme.position);
        let there = harness.draw(&scene).map_err(|failed| with_context(extreme.name, failed))?;
        // Both pictures have vertices in the wrong place, in the mirror and before it. Positions are rounded to steps
        // of 2⁻³⁰ m, half a step each for the camera and the object, and f64 to half of a unit in the last place. The
        // nearest object is 5.5 m away before scaling, and the focal length is 55 pixels.
        let ulp = extreme.position.abs().max_element() * 0.5_f64.powi(52);
        let by_steps = 55.0 * (0.5_f64.powi(30) + 3.0 * ulp) / (5.5 * extreme.scale);
        let shift = 2.0 * (2.0 * PRECISION + by_steps);
        assert_alike(extreme.name, there.capture.as_ref(), here.capture.as_ref(), shift)?;
    }
    Ok(())
}
