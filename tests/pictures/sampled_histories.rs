//! Views that show what other views, and they themselves, held in the frame before.

use drawloom::glam::DVec3;
use drawloom::process::{CpuShader, Declare, Deferred, Draws, InjectionPoint, RenderProcess};
use drawloom::scene::{Camera, LayerMask, ViewKind};
use drawloom_testing::feedback::{DrawnView, check, with_feedback};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;
use crate::sampled_views::{MIRROR, PLANE, mirror_scene};
use crate::strategies::expect;

pub const CASES: &[Case] = &[
    ("views_show_what_each_other_held_in_the_frame_before", feedback),
    ("what_a_view_held_is_not_shared_with_other_targets", transient),
    ("a_mirror_may_show_the_frame_before", late_mirror),
];

/// Compares `target` of the views in which `is_read` is true.
fn check_feedback(mut fixture: Fixture, target: &str, is_read: impl Fn(ViewKind) -> bool) -> Result<(), Failed> {
    let checked = check(|frame, scene| {
        let recorded = fixture.record(scene).map_err(|error| format!("{error:?}"))?;
        let ages: Vec<_> = recorded.statistics().views.iter().map(|view| view.age).collect();
        if frame == 2 {
            // A frame that is dropped leaves nothing.
            drop(fixture.record(scene).map_err(|error| format!("{error:?}"))?);
        }
        let submission = fixture.submit(recorded).map_err(|error| format!("{error:?}"))?;
        let view = |(view, age): (usize, u32)| {
            let picture = is_read(scene.cameras[view].kind).then(|| submission.read(view, target));
            let picture = picture.transpose().map_err(|error| error.to_string())?;
            let number = |bytes: &[u8]| f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
            let values = picture.map(|picture| picture.bytes.chunks_exact(4).map(number).collect());
            Ok::<_, String>(DrawnView { is_drawn: age == 0, values })
        };
        ages.into_iter().enumerate().map(view).collect::<Result<Vec<_>, _>>()
    });
    Ok(checked?)
}

fn feedback() -> Result<(), Failed> {
    check_feedback(Fixture::with(2, with_feedback)?, "light", |_| true)
}

fn transient() -> Result<(), Failed> {
    let fixture = Fixture::with_transient_targets(2, with_feedback)?;
    check_feedback(fixture, "shown", |kind| kind == ViewKind::Main)
}

/// Draws what [`MIRROR`] draws, of the frame before.
struct LateMirror;

impl RenderProcess for LateMirror {
    fn name(&self) -> &str {
        "late mirror"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.also_views(ViewKind::Reflection);
        declare.at(InjectionPoint::AfterLighting);
        declare.samples_view_previous(ViewKind::Reflection, "mirror", "radiance");
        declare.draws_over("radiance");
        declare.matches_depth("depth");
    }

    fn draws(&self) -> Draws<'_> {
        MIRROR.draws()
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        MIRROR.cpu_shader()
    }
}

fn late_mirror() -> Result<(), Failed> {
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(Deferred::to_picture()).process(LateMirror))?;
    let mut ordered = Fixture::with(2, |builder| builder.pipeline(Deferred::to_picture()).process(MIRROR))?;
    let mut scene = mirror_scene()?;
    let camera = scene.cameras[0].clone();
    // All objects but the mirror's.
    let mirrored = |camera: &Camera| Camera { layers: LayerMask::layer(0), ..camera.reflected("mirror", PLANE) };
    let (mut before, mut pictures) = (None, Vec::new());
    for frame in 0..4 {
        // The mirrored camera moves, and the one that sees the mirror does not.
        let moved = Camera { position: camera.position + DVec3::X * (0.2 * f64::from(frame)), ..camera.clone() };
        let now = mirrored(&moved);
        scene.cameras = vec![camera.clone(), now.clone()];
        let found = fixture.draw(&scene)?;
        // The same with the mirrored camera of the frame before; without one in the first frame.
        scene.cameras = std::iter::once(camera.clone()).chain(before.replace(now)).collect();
        expect(found == ordered.draw(&scene)?, || format!("frame {frame}"))?;
        expect(!pictures.contains(&found), || format!("frame {frame} shows nothing new"))?;
        pictures.push(found);
    }
    Ok(())
}
