//! Shadows of masks equal those of geometry of the mask's shape, on wgpu and in software.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::{SoftwareBackend, WgpuBackend};
use drawloom::command::Selection;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::process::{CommandDraws, Declare, Deferred, Draws, RenderProcess, targets};
use drawloom::quality::{Quality, ShadowQuality};
use drawloom::scene::{
    Blend, LayerMask, Light, LightKind, Material, MaterialType, RenderObject, Scene, Topology, ViewKind,
};
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom_testing::adapter;
use drawloom_testing::scenes::square;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, half_floats};
use crate::masks::{CELLS, mask_material};
use crate::rays::{Counts, Panel, PanelScene};
use crate::shadows::{MAPS, camera, fixture_with, hemisphere, lamp, spot, sun, with_context};

pub const CASES: &[Case] = &[
    ("masks_cast_shadows_of_their_shape", shape),
    ("software_draws_shadows_of_masks", on_software),
    ("masks_across_the_near_plane_of_a_suns_map_cast_shadows_of_their_shape", across_the_near_plane),
    ("masks_of_the_engines_own_materials_cast_shadows_of_their_shape", of_material_types),
    ("a_process_of_the_engine_draws_holes_into_shadow_maps", by_own_process),
];

fn lights() -> [Light; 4] {
    let down = DVec3::new(0.2, -0.9, -0.3).normalize();
    let position = DVec3::new(-0.4, 3.0, 0.9);
    [sun(down), spot(position, down, 45.0), hemisphere(position, down), lamp(position)]
}

fn pipeline() -> Deferred {
    Deferred::to_picture().shadow_maps(Some(MAPS))
}

/// With edges so short that what the map of a hemispherical light bends is less than a twentieth of its pixels off.
fn quality() -> Quality {
    let ShadowMaps { side, bias, filter, .. } = MAPS;
    let shadows = ShadowQuality { side, bias, filter, widest_edge: 2.0, ..ShadowQuality::default() };
    Quality { shadows, ..Quality::balanced() }
}

/// How the masked square lies above the floor.
#[derive(Clone, Copy, Debug)]
struct Lying {
    topology: Topology,
    is_mirrored: bool,
    double_sided: bool,
    /// Whether its front faces down.
    is_turned: bool,
}

const UPRIGHT: Lying =
    Lying { topology: Topology::TriangleList, is_mirrored: false, double_sided: true, is_turned: false };

/// Half the width of the square.
const HALF: f64 = 0.8;

impl Lying {
    fn object(self, scene: &mut Scene, material: Material) -> Result<RenderObject, Failed> {
        let mesh = scene.add(square(self.topology))?;
        let material = scene.add(Material { double_sided: self.double_sided, ..material })?;
        let turn = if self.is_turned { 90.0_f32 } else { -90.0 };
        Ok(RenderObject {
            orientation: Quat::from_rotation_x(turn.to_radians()),
            scale: Vec3::new(if self.is_mirrored { -1.0 } else { 1.0 }, 1.0, 1.0) * HALF as f32,
            ..RenderObject::new(mesh, material, DVec3::Y)
        })
    }

    /// A panel for each solid cell.
    fn panels(self) -> Vec<Panel> {
        // The texture's axes in the world.
        let right = if self.is_mirrored { DVec3::NEG_X } else { DVec3::X };
        let down = if self.is_turned { DVec3::NEG_Z } else { DVec3::Z };
        let cells = (0..4).flat_map(|row| (0..4).map(move |column| (row, column)));
        let solid = cells.filter(|(row, column)| CELLS[*row][*column]);
        let panel = |(row, column): (usize, usize)| {
            let offset = |cell: usize| (cell as f64 * 2.0 - 3.0) / 4.0 * HALF;
            let center = DVec3::Y + right * offset(column) + down * offset(row);
            // Seen from above, unless the square faces down.
            let up = if self.is_turned { DVec3::Y } else { DVec3::NEG_Y };
            let across = DVec3::X * (HALF / 4.0);
            let along = up.cross(DVec3::X) * (HALF / 4.0);
            Panel { double_sided: self.double_sided, ..Panel::new(center, across, -along) }
        };
        solid.map(panel).collect()
    }
}

/// A floor in one light, and what it looks like with some panels above it.
fn floor(light: Light, panels: Vec<Panel>) -> Result<(PanelScene, Scene), Failed> {
    let views = [
        camera(DVec3::new(1.0, 4.5, 3.0), DVec3::new(0.3, 0.2, -0.2), 45.0),
        camera(DVec3::new(1.2, 0.6, 1.8), DVec3::new(0.2, 0.0, -0.2), 80.0),
    ];
    let floor = PanelScene { panels: vec![Panel::facing(DVec3::ZERO, DVec3::Y, 6.0)], lights: vec![light], maps: MAPS };
    let scene = floor.scene(&views)?;
    let panels = [floor.panels.clone(), panels].concat();
    Ok((PanelScene { panels, ..floor }, scene))
}

fn expect_enough(counts: Counts) -> Result<(), Failed> {
    // The holes let light through, and the shadow has cells as large as several pixels.
    if counts.dark >= 60 && counts.lit >= 3000 { Ok(()) } else { Err(format!("too few pixels: {counts:?}").into()) }
}

fn shape() -> Result<(), Failed> {
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(pipeline()).quality(quality()))?;
    for light in lights() {
        for lying in [
            UPRIGHT,
            Lying { topology: Topology::TriangleStrip, is_mirrored: true, ..UPRIGHT },
            Lying { double_sided: false, ..UPRIGHT },
            Lying { is_turned: true, ..UPRIGHT },
        ] {
            let (expected, mut scene) = floor(light, lying.panels())?;
            let material = mask_material(&mut scene)?;
            let object = lying.object(&mut scene, material)?;
            scene.add_object(object)?;
            let counts = expected.expect_of(&mut fixture, &scene);
            counts.and_then(expect_enough).map_err(|failed| with_context(failed, format!("{lying:?} {light:?}")))?;
        }
    }
    Ok(())
}

fn on_software() -> Result<(), Failed> {
    for light in lights() {
        let (expected, mut scene) = floor(light, UPRIGHT.panels())?;
        let material = mask_material(&mut scene)?;
        let object = UPRIGHT.object(&mut scene, material)?;
        scene.add_object(object)?;
        scene.cameras.truncate(1);
        let scheduler = Arc::new(Scheduler::new(2)?);
        let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler)));
        let (mut renderer, submitter) = builder.pipeline(pipeline()).quality(quality()).build(scheduler)?;
        let submission = submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission;
        let found = half_floats(&submission.read(0, "radiance")?);
        let counts = expected.expect_radiance(&scene.cameras, |_| Ok(found.clone()));
        counts.and_then(expect_enough).map_err(|failed| with_context(failed, format!("{light:?}")))?;
    }
    Ok(())
}

/// The map reaches some 150 m towards the sun. The triangles of the mask extend from below the floor to far beyond
/// that, and the edge of a hole is on the floor. Devices without depth clip control have an entry point of their own
/// for this.
fn across_the_near_plane() -> Result<(), Failed> {
    for missing in [wgpu::Features::empty(), WgpuBackend::DEPTH_CLIP_FEATURES] {
        let device = adapter::device_without(missing)?;
        let mut fixture = Fixture::on(device, 2, |builder| builder.pipeline(pipeline()).quality(quality()))?;
        for size in [1.0, 400.0, 1600.0] {
            // It stands to the right of what the camera sees, and its picture's right is in the direction of -Z.
            let center = DVec3::new(2.0, size - 1.0, -0.5 - size / 2.0);
            let panel = |(row, column): (usize, usize)| {
                let offset = |cell: usize| (cell as f64 * 2.0 - 3.0) / 4.0 * size;
                let center = center - DVec3::Z * offset(column) - DVec3::Y * offset(row);
                Panel::new(center, DVec3::Z * (size / 4.0), DVec3::Y * (size / 4.0)).double_sided()
            };
            let cells = (0..4).flat_map(|row| (0..4).map(move |column| (row, column)));
            let panels = cells.filter(|(row, column)| CELLS[*row][*column]).map(panel).collect();
            let (expected, mut scene) = floor(sun(DVec3::new(-0.6, -0.8, 0.0)), panels)?;
            let material = mask_material(&mut scene)?;
            let object = UPRIGHT.object(&mut scene, material)?;
            let orientation = Quat::from_rotation_y(90.0_f32.to_radians());
            scene.add_object(RenderObject {
                orientation,
                scale: Vec3::splat(size as f32),
                position: center,
                ..object
            })?;
            let counts = expected.expect_of(&mut fixture, &scene);
            counts
                .and_then(expect_enough)
                .map_err(|failed| with_context(failed, format!("{size} m, no {missing:?}")))?;
        }
    }
    Ok(())
}

/// Its first number is the opacity by which the engine's process finds holes.
const OWN: MaterialType<[f32; 4]> = MaterialType::new("own");

/// What only lights see.
const UNSEEN: LayerMask = LayerMask::layer(1);

/// A floor in a light under a square that only the light sees.
fn under_square(light: Light, change: impl FnOnce(Material) -> Material) -> Result<Scene, Failed> {
    let (_, mut scene) = floor(light, Vec::new())?;
    let material = mask_material(&mut scene)?;
    let object = UPRIGHT.object(&mut scene, change(material))?;
    scene.add_object(RenderObject { layers: UNSEEN, ..object })?;
    for object in scene.objects().take(1).collect::<Vec<_>>() {
        scene.replace_object(object, RenderObject { layers: LayerMask::layer(0), ..scene.object(object)? })?;
    }
    scene.cameras.iter_mut().for_each(|camera| camera.layers = LayerMask::layer(0));
    Ok(scene)
}

fn of_material_types() -> Result<(), Failed> {
    let mut fixture = fixture_with(MAPS)?;
    for light in lights() {
        let mut drawn = |change: fn(Material) -> Material| fixture.draw(&under_square(light, change)?);
        let typed = |material: Material| Material { values: Some(OWN.values([0.0; 4])), ..material };
        let shipped = drawn(|material| material)?;
        let own = drawn(typed)?;
        let solid = drawn(|material| Material { alpha_cutoff: None, ..material })?;
        let cut_away = drawn(|material| Material { opacity: 0.0, ..material })?;
        let without = drawn(|material| Material { blend: Blend::Alpha, ..material })?;
        let is_right = own == shipped && own != solid && own != without && cut_away == without;
        if !is_right
            || drawn(|material| Material { opacity: 0.0, values: Some(OWN.values([0.0; 4])), ..material })? != without
        {
            return Err(format!("a material with a type casts another shadow in {light:?}").into());
        }
    }
    Ok(())
}

/// Draws the objects of the engine's own material type into shadow maps.
struct OwnCasters;

impl RenderProcess for OwnCasters {
    fn name(&self) -> &str {
        "own casters"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.views(ViewKind::Shadow);
        declare.after("shadow casters");
        declare.draws_depth(targets::SHADOW_MAP);
        declare.reads_materials(OWN);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws {
            shader: "
                @group(3) @binding(0) var<storage, read> opacities: array<vec4<f32>>;

                struct Corner {
                    @builtin(position) position: vec4<f32>,
                    @location(0) uv: vec2<f32>,
                    @location(1) @interpolate(flat) material: u32,
                }

                @vertex
                fn vertex(in: VertexInput) -> Corner {
                    let object = drawn_object(in.instance);
                    let clip = clip_position(relative_position(object, in.position));
                    return Corner(clip, bounded_uv(in.uv), object.material);
                }

                @fragment
                fn fragment(in: Corner) {
                    var material = materials[in.material];
                    material.opacity = opacities[in.material].x;
                    if is_cut_out(material, in.uv) {
                        discard;
                    }
                }
            ",
            selection: Selection::OPAQUE.of_material_type(OWN),
            discards: true,
            ..CommandDraws::default()
        })
    }
}

fn by_own_process() -> Result<(), Failed> {
    let mut shipped = fixture_with(MAPS)?;
    let mut own = Fixture::with(2, |builder| builder.pipeline(pipeline()).process(OwnCasters))?;
    // A paraboloid's process discards what is behind it, too.
    for light in lights().into_iter().filter(|light| light.kind() != LightKind::Hemispherical) {
        let expected = shipped.draw(&under_square(light, |material| material)?)?;
        let values = Some(OWN.values([1.0, 0.0, 0.0, 0.0]));
        let found = own.draw(&under_square(light, |material| Material { opacity: 0.0, values, ..material })?)?;
        if found != expected {
            return Err(format!("the engine's process casts another shadow in {light:?}").into());
        }
    }
    Ok(())
}
