//! Lists of objects that need several buffers.

use drawloom::backend::SceneLimits;
use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Changes, Light, ObjectSet, SceneRef, StaticGroup};
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Device, Options, expect_same, expect_scene_issues, renderer, small};

pub const CASES: &[Case] = &[
    ("lists_that_no_single_buffer_holds_lie_in_several", &[Device::Adapter, Device::Noop], several_buffers),
    ("lists_of_all_passes_may_exceed_the_devices_largest_buffer", &[Device::Noop], of_the_device),
];

/// 80 objects take 320 bytes of a list, and a list lies at a multiple of 256 bytes. The views of two cameras and seven
/// shadow maps have more than 10 lists.
fn several_buffers(device: Device) -> Result<(), Failed> {
    let mut scene = small(field(80));
    scene.lights.push(Light::Point {
        position: DVec3::Y * 4.0,
        intensity: Vec3::splat(20.0),
        range: 40.0,
        casts_shadow: true,
    });
    for has_static_groups in [false, true] {
        scene.static_groups =
            if has_static_groups { vec![StaticGroup::new("some", ObjectSet::new(10..60))] } else { Vec::new() };
        for buffer_bytes in [80 * 64, 6 * 1024, 8 * 1024, 1 << 20] {
            let limits = SceneLimits { buffer_bytes, binding_bytes: 80 * 64, ..SceneLimits::NONE };
            let options = Options { shadows: true, limits: Some(limits), ..Options::default() };
            let mut frames = renderer(device, options)?;
            for frame in 0..2 {
                let changes = if frame == 0 { Changes::Unknown } else { Changes::NONE };
                let scene = SceneRef { changes, ..scene.as_scene_ref() };
                let expected = SceneRef { changes: Changes::Unknown, ..scene };
                let scene_issues = expect_same(&mut *frames, device, options, [scene, expected])
                    .map_err(|failed| format!("{buffer_bytes}, frame {frame}: {failed:?}"))?;
                expect_scene_issues(&scene_issues, &[])?;
            }
        }
    }
    Ok(())
}

/// 600,000 objects take 2.4 MB of each list. The passes of two cameras and of 120 shadow maps have 290 MB of lists; a
/// buffer of the device has 268 MB at most.
fn of_the_device(device: Device) -> Result<(), Failed> {
    const OBJECTS: usize = 600_000;
    let mut scene = small(field(1));
    scene.lights = (0..20)
        .map(|number| Light::Point {
            position: DVec3::new(f64::from(number) - 10.0, 4.0, 0.0),
            intensity: Vec3::splat(20.0),
            range: 40.0,
            casts_shadow: true,
        })
        .collect();
    let lent = scene.as_scene_ref();
    // Nothing sees the others.
    let mut positions = vec![DVec3::splat(-1e6); OBJECTS];
    positions[0] = lent.positions[0];
    let scene = SceneRef {
        positions: &positions,
        orientations: &vec![lent.orientations[0]; OBJECTS],
        scales: &vec![lent.scales[0]; OBJECTS],
        bounds: &vec![lent.bounds[0]; OBJECTS],
        meshes: &vec![lent.meshes[0]; OBJECTS],
        materials: &vec![lent.materials[0]; OBJECTS],
        layers: &[],
        ..lent
    };
    let mut frames = renderer(device, Options { shadows: true, ..Options::default() })?;
    expect_scene_issues(&frames.frame(scene)?.scene_issues, &[])
}
