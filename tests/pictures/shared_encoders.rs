//! Small passes that share a command encoder draw what they draw in encoders of their own, and what the device refuses
//! is still named.

use std::sync::Arc;

use drawloom::backend::{EncodingStrategy, Picture, RecordingStrategy, WgpuPassStatistics};
use drawloom::process::{ClearColor, Declare, Deferred, Draws, Format, FullScreen, RenderProcess};
use drawloom::scene::{Camera, Scene};
use drawloom::task::Scheduler;
use drawloom::{FrameError, Renderer};
use drawloom_testing::scenes::everything::everything;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, backend};
use crate::strategies::{Head, Ouroboros, expect, fixture_with, many_batches, pictures};

pub const CASES: &[Case] = &[
    ("passes_that_share_an_encoder_draw_the_same_bytes", same_bytes),
    ("many_small_views_share_encoders", many_views),
    ("a_small_pass_that_grows_gets_encoders_of_its_own", growing),
    ("an_error_in_a_shared_encoder_names_its_pass", refused),
];

fn frame(fixture: &mut Fixture, scene: &Scene) -> Result<(Vec<Picture>, Vec<WgpuPassStatistics>), Failed> {
    let recorded = fixture.record(scene)?;
    let pictures = pictures(fixture, recorded, scene)?;
    Ok((pictures, fixture.renderer.backend().pass_statistics()))
}

/// Drawn with an encoder for each pass.
fn expected(scene: &Scene) -> Result<Vec<Picture>, Failed> {
    let mut fixture = fixture_with(RecordingStrategy::Direct, EncodingStrategy::OnSubmit)?;
    frame(&mut fixture, scene)?;
    let (pictures, passes) = frame(&mut fixture, scene)?;
    expect(passes.iter().all(|pass| pass.encoders == 1), || format!("shared: {passes:?}"))?;
    Ok(pictures)
}

fn same_bytes() -> Result<(), Failed> {
    let mut scene = everything();
    scene.cameras[0].size = [60, 40];
    let expected = expected(&scene)?;
    for recording in [RecordingStrategy::Direct, RecordingStrategy::Bundles, RecordingStrategy::CachedBundles] {
        let mut fixture = fixture_with(recording, EncodingStrategy::PerPass)?;
        for number in 0..3 {
            let (pictures, passes) = frame(&mut fixture, &scene)?;
            expect(pictures == expected, || format!("{recording:?}: frame {number} differs"))?;
            // How many batches a pass has is known from its second frame on.
            if number > 0 {
                let encoders_of =
                    |view: usize| passes.iter().filter(move |pass| pass.view == view && pass.encoders > 0);
                let share = passes.iter().all(|pass| encoders_of(pass.view).count() == 1);
                expect(share, || format!("frame {number}: {passes:?}"))?;
            }
        }
    }
    Ok(())
}

fn many_views() -> Result<(), Failed> {
    let mut scene = everything();
    let camera = Camera { size: [16, 12], ..scene.cameras[0].clone() };
    scene.cameras = (0..40)
        .map(|index| {
            let mut camera = Camera { name: format!("view {index}"), ..camera.clone() };
            camera.position.x += 0.05 * f64::from(index);
            camera
        })
        .collect();
    let expected = expected(&scene)?;
    let mut fixture = fixture_with(RecordingStrategy::Direct, EncodingStrategy::PerPass)?;
    for number in 0..3 {
        let (pictures, passes) = frame(&mut fixture, &scene)?;
        expect(pictures == expected, || format!("frame {number} differs"))?;
        if number > 0 {
            let encoders: usize = passes.iter().map(|pass| pass.encoders).sum();
            expect((16..40).contains(&encoders), || format!("{encoders} encoders: {passes:?}"))?;
        }
    }
    Ok(())
}

fn growing() -> Result<(), Failed> {
    let (mut scene, mut empty) = (many_batches(), many_batches());
    for scene in [&mut scene, &mut empty] {
        (scene.cameras[0].size, scene.cameras[1].size) = ([24, 18], [20, 20]);
    }
    empty.cameras.iter_mut().for_each(|camera| camera.position.y += 1e5);
    let [nothing, many] = [expected(&empty)?, expected(&scene)?];
    expect(nothing != many, || "the cameras see the same".to_owned())?;
    for recording in [RecordingStrategy::Direct, RecordingStrategy::Bundles] {
        let mut fixture = fixture_with(recording, EncodingStrategy::Split)?;
        for _ in 0..2 {
            frame(&mut fixture, &empty)?;
            let (pictures, passes) = frame(&mut fixture, &empty)?;
            expect(pictures == nothing && passes.iter().any(|pass| pass.encoders == 0), || format!("{passes:?}"))?;
            let (pictures, passes) = frame(&mut fixture, &scene)?;
            expect(pictures == many, || format!("{recording:?}: the grown pass differs"))?;
            expect(passes.iter().any(|pass| pass.encoders > 1), || format!("{passes:?}"))?;
        }
    }
    Ok(())
}

/// Samples what [`Ouroboros`] draws.
struct Foot;

impl RenderProcess for Foot {
    fn name(&self) -> &str {
        "foot"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples("tail");
        declare.clears_color("foot", Format::Rgba8Unorm, ClearColor::Background);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var tail: texture_2d<f32>;
            @fragment fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                return textureLoad(tail, vec2<i32>(0, 0), 0);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

fn refused() -> Result<(), Failed> {
    let backend = backend()?.encoding_strategy(EncodingStrategy::PerPass);
    let builder =
        Renderer::builder(backend).pipeline(Deferred::to_picture()).process(Head).process(Ouroboros).process(Foot);
    let (mut renderer, _submitter) = builder.output("foot").build(Arc::new(Scheduler::new(1)?))?;
    let scene = everything();
    // One worker finishes both in the job of the pass after them.
    for _ in 0..2 {
        match renderer.record(scene.as_scene_ref()).err() {
            Some(FrameError::Failed { stage, source }) => {
                expect(stage == "ouroboros, view 0 \"main\", finish", || stage.clone())?;
                expect(source.to_string().contains("\"ouroboros\" in view \"main\""), || source.to_string())?;
            }
            other => return Err(format!("{other:?}").into()),
        }
    }
    Ok(())
}
