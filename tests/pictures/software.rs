//! wgpu's pictures against those of the software backend, in f32 and in f64.

use std::sync::Arc;

use drawloom::backend::{Picture, SoftwareBackend};
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::scene::{Camera, ClipPlane, LayerMask, Projection, RenderObject, Scene};
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom_testing::demo;
use drawloom_testing::obj_files::{hall, interior};
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::field;
use drawloom_testing::slow_cases;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::draw_on_processor;
use crate::image_distance::assert_different;
use crate::rays::{Panel, PanelScene};
use crate::references::{generated, shared};
use crate::shadows::{fixture_with, sun};

pub const CASES: &[Case] = &[
    // With small shadow maps, which take a quarter of a minute less.
    ("software_draws_the_demo_scene_as_wgpu_does", || {
        compare_with(demo::colonnade()?, ShadowMaps { side: 256, ..ShadowMaps::default() })
    }),
    ("software_draws_everything_as_wgpu_does", || compare(everything())),
    ("software_draws_cascades_as_wgpu_does", cascades),
    ("software_has_the_shadow_bias_of_wgpu_behind_a_clip_plane", behind_a_clip_plane),
    ("software_draws_a_field_of_boxes_as_wgpu_does", || compare(field(400))),
    ("software_draws_an_interior_as_wgpu_does", || compare(generated(&interior())?)),
    ("software_draws_a_hall_as_wgpu_does", || compare(generated(&hall())?)),
];

pub const CASES_OF_SHARED_SCENES: &[Case] = &[
    ("software_draws_cornell_as_wgpu_does", || compare(shared("cornell/CornellBox-Original.obj")?)),
    ("software_draws_sponza_as_wgpu_does", || compare(shared("sponza/sponza_part.obj")?)),
];

/// With a camera over the boxes, so that all cascades are in the picture.
fn cascades() -> Result<(), Failed> {
    let mut scene = everything();
    scene.cameras[0] = Camera::looking_at("main", DVec3::new(0.5, 1.5, 4.0), DVec3::new(0.0, 0.3, 0.0));
    compare_with(scene, ShadowMaps { side: 256, cascades: 4, max_distance: 12.0, ..ShadowMaps::default() })
}

/// The shadow of a ramp begins where the ramp is higher than the bias, which a clip plane near the camera and across
/// its view makes larger.
fn behind_a_clip_plane() -> Result<(), Failed> {
    let projection = Projection::Perspective { field_of_view: 2.0 * 0.5_f32.atan() };
    // Its corners are on corners of pixels, or in their centres, where neither backend moves them.
    let floor = Panel::facing(DVec3::ZERO, DVec3::Y, 3.0);
    let ramp = Panel::new(DVec3::Y * 0.125, DVec3::new(2.5, 0.125, 0.0), DVec3::Z * 2.0).double_sided();
    let maps = ShadowMaps { side: 1024, filter: 0, max_distance: 12.0, ..ShadowMaps::default() };
    let lights = vec![sun(DVec3::new(0.0, -1.0, 1.0).normalize())];
    let mut scene = PanelScene { panels: vec![floor, ramp], lights, maps }.scene(&[])?;
    // The ramp is seen by the sun alone.
    let [floor, ramp] = scene.objects().collect::<Vec<_>>()[..] else { return Err("there are two objects".into()) };
    for (object, layer) in [(floor, 0), (ramp, 1)] {
        scene.replace_object(object, RenderObject { layers: LayerMask::layer(layer), ..scene.object(object)? })?;
    }
    // Rounding decides which pixels of the shadow's edge are lit. Ambient light makes their difference small.
    scene.ambient = Vec3::splat(0.5);
    let looking = Camera::looking_at("main", DVec3::Y * 6.0, DVec3::ZERO);
    let camera = Camera { projection, layers: LayerMask::layer(0), ..looking };
    let [right, forward] = [Vec3::X, Vec3::NEG_Z].map(|axis| camera.orientation * axis);
    let point = camera.position + forward.as_dvec3() * 0.02;
    let clip_plane = Some(ClipPlane { point, normal: (right * 0.85 + forward * 0.5).normalize() });
    scene.cameras = vec![camera.clone()];
    let plain = fixture_with(maps)?.draw(&scene)?;
    scene.cameras = vec![Camera { clip_plane, ..camera }];
    assert_different(&plain, &fixture_with(maps)?.draw(&scene)?)?;
    compare_with(scene, maps)
}

fn compare(scene: Scene) -> Result<(), Failed> {
    compare_with(scene, ShadowMaps::default())
}

/// Compares wgpu's picture with those of the software backend in f32 and in f64.
fn compare_with(mut scene: Scene, maps: ShadowMaps) -> Result<(), Failed> {
    let size = if slow_cases::are_enabled() { [320, 180] } else { [240, 135] };
    scene.cameras.iter_mut().for_each(|camera| camera.size = size);
    let by_wgpu = fixture_with(maps)?.draw(&scene)?;
    let scheduler = Arc::new(Scheduler::new(2)?);
    let deferred = Deferred::to_picture().shadow_maps(Some(maps));
    let single = SoftwareBackend::new(Arc::clone(&scheduler));
    let single = draw_on_processor((single, scheduler), deferred.clone(), &scene, "picture")?;
    let reference = (SoftwareBackend::reference(), Arc::new(Scheduler::new(2)?));
    let double = draw_on_processor(reference, deferred, &scene, "picture")?;
    let differences = [("f32", &single), ("the reference", &double)]
        .map(|(name, picture)| (name, Difference::new(&by_wgpu, picture)));
    println!("{differences:?}");
    if differences.iter().all(|(_, difference)| difference.is_within_bound()) {
        return Ok(());
    }
    Err(format!("wgpu's picture and the CPU's differ: {differences:?}").into())
}

/// The difference between two pictures.
#[derive(Debug)]
struct Difference {
    /// The root mean square over all pixels and colours, 0 to 255.
    root_mean_square: f64,
    /// The fraction of pixels whose colours all differ by at most 3 of 255.
    near: f64,
}

impl Difference {
    fn new(one: &Picture, other: &Picture) -> Self {
        let pixels = one.bytes.chunks_exact(4).zip(other.bytes.chunks_exact(4));
        let (mut squares, mut near, mut count) = (0.0, 0.0, 0.0);
        for (one, other) in pixels {
            let distances = [0, 1, 2].map(|channel| one[channel].abs_diff(other[channel]));
            squares += distances.iter().map(|distance| f64::from(*distance).powi(2)).sum::<f64>() / 3.0;
            near += f64::from(u8::from(distances.iter().all(|distance| *distance <= 3)));
            count += 1.0;
        }
        Self { root_mean_square: (squares / count).sqrt(), near: near / count }
    }

    /// Whether the difference is acceptable. Where rounding decides which surface a pixel on an edge shows, or whether
    /// a pixel on a shadow's edge is lit, the whole pixel differs.
    fn is_within_bound(&self) -> bool {
        self.root_mean_square <= 2.0 && self.near >= 0.99
    }
}
