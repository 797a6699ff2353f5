//! Stencils: what one process marks, another leaves out.

use std::sync::Arc;

use drawloom::backend::{Picture, WgpuBackend};
use drawloom::command::Selection;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{
    ClearColor, CommandDraws, Comparison, Declare, Deferred, Draws, Format, FullScreen, GeometryFormats, RenderProcess,
    SURFACE_SHADER, Stencil, StencilOperation,
};
use drawloom::quality::Quality;
use drawloom::scene::{Camera, LayerMask, Material, RenderObject, Scene, SceneRef, ViewKind};
use drawloom::task::Scheduler;
use drawloom::{Renderer, RendererBuilder};
use drawloom_testing::adapter;
use drawloom_testing::scenes::{cube, field, sized};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, backend};
use crate::rays::{Panel, PanelScene};
use crate::shadows::{MAPS, camera, sun};
use crate::strategies::{expect, strategies};

pub const CASES: &[Case] = &[
    ("a_stencil_alone_marks_all_pixels_of_objects", alone),
    ("a_stencil_beside_depth_marks_visible_pixels", beside_depth),
    ("every_strategy_tests_the_same_stencil", every_strategy),
    ("operations_and_masks_are_those_of_the_device", operations),
    ("hidden_objects_are_marked_where_a_test_fails", hidden_objects),
    ("a_process_that_tests_the_stencil_alone_draws_hidden_objects", through_walls),
    ("objects_that_the_stencil_test_leaves_out_hide_nothing", masked),
    ("a_process_that_tests_a_stencil_or_matches_depth_draws_nothing_beyond_the_far_plane_of_a_suns_map", in_a_map),
    ("a_process_that_has_no_stencil_is_named", without),
];

const MARKED: LayerMask = LayerMask::layer(4);

/// Which target has the stencil, and how the objects are marked.
#[derive(Clone, Copy)]
struct Mark {
    target: &'static str,
    format: Format,
    stencil: Stencil,
}

impl Mark {
    const ALONE: Self = Self { target: "marked", format: Format::Stencil8, stencil: Stencil::mark(3) };
    const BESIDE_DEPTH: Self =
        Self { target: "depth", format: Format::Depth32FloatStencil8, stencil: Stencil::mark(3) };
}

impl RenderProcess for Mark {
    fn name(&self) -> &str {
        "mark"
    }

    fn declare(&self, declare: &mut Declare) {
        if self.format == Format::Stencil8 {
            declare.clears_depth(self.target, self.format);
        } else {
            declare.marks_stencil(self.target);
        }
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws {
            shader: SURFACE_SHADER,
            fragment: None,
            selection: Selection::OPAQUE.in_layers(MARKED),
            stencil: Some(self.stencil),
            ..CommandDraws::default()
        })
    }
}

/// Draws white where a stencil compares like this.
struct White {
    target: &'static str,
    stencil: Option<Stencil>,
}

impl RenderProcess for White {
    fn name(&self) -> &str {
        "white"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("white", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        declare.tests_stencil(self.target);
        declare.after("mark");
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                return vec4<f32>(1.0);
            }
        ";
        Draws::FullScreen(FullScreen { shader, stencil: self.stencil, ..FullScreen::default() })
    }
}

/// Draws the same objects in white, without a stencil.
struct Covered {
    depth: Option<&'static str>,
}

impl RenderProcess for Covered {
    fn name(&self) -> &str {
        "covered"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("covered", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        if let Some(depth) = self.depth {
            declare.matches_depth(depth);
        }
    }

    fn draws(&self) -> Draws<'_> {
        let selection = Selection::OPAQUE.in_layers(MARKED);
        Draws::Commands(CommandDraws { shader: COVERED, selection, writes_depth: false, ..CommandDraws::default() })
    }
}

const COVERED: &str = "
    struct Corner {
        @invariant @builtin(position) clip: vec4<f32>,
    }

    @vertex
    fn vertex(in: VertexInput) -> Corner {
        return Corner(clip_position(relative_position(drawn_object(in.instance), in.position)));
    }

    @fragment
    fn fragment(in: Corner) -> @location(0) vec4<f32> {
        return vec4<f32>(1.0);
    }

    @fragment
    fn before_far_plane(in: Corner) -> @location(0) vec4<f32> {
        if in.clip.z <= 0.0 {
            discard;
        }
        return vec4<f32>(1.0);
    }
";

/// A field of which every third object is to be marked.
fn scene() -> (Scene, Vec<LayerMask>) {
    let mut scene = field(200);
    scene.cameras.truncate(1);
    let layers = (0..200).map(|object| if object % 3 == 0 { MARKED } else { LayerMask::layer(0) }).collect();
    (scene, layers)
}

fn pipeline() -> Deferred {
    Deferred::to_picture()
        .formats(GeometryFormats { depth: Format::Depth32FloatStencil8, ..GeometryFormats::default() })
}

/// Draws what a light sees in white, with a test that leaves out nothing of it.
struct SeenByLight(MapTest);

/// How a process tests the depth or the stencil of a map.
#[derive(Clone, Copy, Debug)]
enum MapTest {
    OwnStencil,
    StencilBesideDepth,
    MarkedStencil,
    MatchedDepth,
}

impl RenderProcess for SeenByLight {
    fn name(&self) -> &str {
        "seen by light"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.views(ViewKind::Shadow);
        declare.clears_color("seen", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        match self.0 {
            MapTest::OwnStencil => declare.clears_depth("stencil", Format::Stencil8),
            MapTest::StencilBesideDepth => declare.tests_stencil("map depth"),
            MapTest::MarkedStencil => declare.marks_stencil("map depth"),
            MapTest::MatchedDepth => declare.matches_depth("map depth"),
        }
    }

    fn draws(&self) -> Draws<'_> {
        let (fragment, stencil) = match self.0 {
            MapTest::OwnStencil | MapTest::StencilBesideDepth => {
                ("fragment", Some(Stencil::test(Comparison::Always, 0)))
            }
            MapTest::MarkedStencil => ("before_far_plane", Some(Stencil::mark(3))),
            MapTest::MatchedDepth => ("before_far_plane", None),
        };
        let fragment = Some(fragment);
        Draws::Commands(CommandDraws {
            shader: COVERED,
            fragment,
            writes_depth: false,
            stencil,
            ..CommandDraws::default()
        })
    }
}

/// Draws the depth of all objects that a light sees.
struct MapDepth;

impl RenderProcess for MapDepth {
    fn name(&self) -> &str {
        "map depth"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.views(ViewKind::Shadow);
        declare.clears_depth("map depth", Format::Depth32FloatStencil8);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws { shader: COVERED, fragment: None, ..CommandDraws::default() })
    }
}

/// Each triangle of the pillar reaches from a sun's map to beyond its far plane, where it would cover further pixels of
/// the map. Devices without depth clip control leave these out by themselves. The tower reaches to in front of the near
/// plane, where all devices draw it.
fn in_a_map() -> Result<(), Failed> {
    let mut panels = Panel::closed_box(DVec3::new(0.5, -200.0, -1.0), DVec3::new(0.2, 201.0, 0.2));
    panels.extend(Panel::closed_box(DVec3::new(-0.6, 100.2, 0.4), DVec3::new(0.2, 100.0, 0.2)));
    panels.push(Panel::facing(DVec3::ZERO, DVec3::Y, 1.0));
    let panel_scene = PanelScene { panels, lights: vec![sun(DVec3::new(0.2, -0.9, -0.3).normalize())], maps: MAPS };
    let scene = panel_scene.scene(&[camera(DVec3::new(1.0, 4.5, 3.0), DVec3::ZERO, 45.0)])?;
    for test in [MapTest::OwnStencil, MapTest::StencilBesideDepth, MapTest::MarkedStencil, MapTest::MatchedDepth] {
        let mut pictures = Vec::new();
        for missing in [wgpu::Features::empty(), WgpuBackend::DEPTH_CLIP_FEATURES] {
            let mut fixture = Fixture::on(adapter::device_without(missing)?, 2, |builder| {
                let deferred = Deferred::to_picture().shadow_maps(Some(MAPS));
                let needs_depth = !matches!(test, MapTest::OwnStencil);
                let builder = if needs_depth { builder.process(MapDepth) } else { builder };
                builder.pipeline(deferred).process(SeenByLight(test)).output("seen")
            })?;
            let recorded = fixture.record(&scene)?;
            let maps = recorded.statistics().views.iter().position(|view| view.kind == ViewKind::Shadow);
            pictures.push(fixture.submit(recorded)?.read(maps.ok_or("a map is drawn")?, "seen")?.bytes);
        }
        let white = pictures[1].iter().filter(|byte| **byte != 0).count();
        if white < 400 || white * 2 > pictures[1].len() {
            return Err(format!("{white} of {} bytes are white", pictures[1].len()).into());
        }
        let differing = pictures[0].iter().zip(&pictures[1]).filter(|(found, expected)| found != expected).count();
        expect(differing == 0, || format!("{test:?}: {differing} bytes differ, {white} are white"))?;
    }
    Ok(())
}

fn draw(fixture: &mut Fixture, target: &str) -> Result<Picture, Failed> {
    let (scene, layers) = scene();
    let recorded = fixture.renderer.record(SceneRef { layers: &layers, ..scene.as_scene_ref() })?;
    Ok(fixture.submit(recorded)?.read(0, target)?)
}

/// What is white where a stencil that was marked compares like this.
fn white(mark: Mark, stencil: Stencil) -> Result<Picture, Failed> {
    let white = White { target: mark.target, stencil: Some(stencil) };
    let mut fixture =
        Fixture::with(2, |builder| builder.pipeline(pipeline()).process(mark).process(white).output("white"))?;
    draw(&mut fixture, "white")
}

/// The objects that are to be marked, in white: all of them, or where they are visible.
fn covered(depth: Option<&'static str>) -> Result<Picture, Failed> {
    let mut fixture =
        Fixture::with(2, |builder| builder.pipeline(pipeline()).process(Covered { depth }).output("covered"))?;
    draw(&mut fixture, "covered")
}

fn inverted(picture: &Picture) -> Vec<u8> {
    picture.bytes.iter().map(|byte| 255 - byte).collect()
}

/// Fails unless a stencil of 3 is where the picture is white, and 0 elsewhere.
fn check(mark: Mark, covered: &Picture) -> Result<(), Failed> {
    if !covered.bytes.contains(&0) || !covered.bytes.contains(&255) {
        return Err("the objects cover all or nothing".into());
    }
    if white(mark, Stencil::test(Comparison::Equal, 3))?.bytes != covered.bytes {
        return Err("what is marked is not what the objects cover".into());
    }
    if white(mark, Stencil::test(Comparison::NotEqual, 3))?.bytes != inverted(covered) {
        return Err("what is not marked is not what the objects leave".into());
    }
    if white(mark, Stencil::test(Comparison::Equal, 0))?.bytes != inverted(covered) {
        return Err("the stencil is not cleared to 0".into());
    }
    Ok(())
}

fn alone() -> Result<(), Failed> {
    check(Mark::ALONE, &covered(None)?)
}

fn beside_depth() -> Result<(), Failed> {
    let (all, visible) = (covered(None)?, covered(Some("depth"))?);
    if all == visible {
        return Err("all marked objects are visible".into());
    }
    check(Mark::BESIDE_DEPTH, &visible)
}

fn every_strategy() -> Result<(), Failed> {
    let expected = covered(Some("depth"))?;
    for (recording, encoding) in strategies() {
        let backend = backend()?.recording_strategy(recording).encoding_strategy(encoding);
        let white = White { target: "depth", stencil: Some(Stencil::test(Comparison::Equal, 3)) };
        let builder = Renderer::builder(backend).pipeline(pipeline()).process(Mark::BESIDE_DEPTH);
        let (renderer, submitter) = builder.process(white).output("white").build(Arc::new(Scheduler::new(2)?))?;
        let mut fixture = Fixture { renderer, submitter };
        for frame in 0..2 {
            if draw(&mut fixture, "white")?.bytes != expected.bytes {
                return Err(format!("frame {frame} of {recording:?} and {encoding:?} differs").into());
            }
        }
    }
    Ok(())
}

fn operations() -> Result<(), Failed> {
    let covered = covered(None)?;
    let with = |stencil| Mark { stencil, ..Mark::ALONE };
    let equal = |value| Stencil::test(Comparison::Equal, value);
    let masked = with(Stencil { write_mask: 2, ..Stencil::mark(3) });
    let failing = with(Stencil {
        comparison: Comparison::Never,
        on_fail: StencilOperation::Replace,
        on_pass: StencilOperation::Zero,
        ..Stencil::mark(5)
    });
    let keeping = with(Stencil { write_mask: 1, on_pass: StencilOperation::Keep, ..Stencil::mark(1) });
    let by = |on_pass| with(Stencil { on_pass, ..Stencil::mark(9) });
    let any = Stencil::test(Comparison::NotEqual, 0);
    for (mark, stencil, is_covered) in [
        (masked, equal(2), true),
        (masked, Stencil { read_mask: 1, ..equal(3) }, false),
        (masked, Stencil { read_mask: 2, ..equal(3) }, true),
        (failing, equal(5), true),
        (keeping, equal(1), false),
        (by(StencilOperation::IncrementClamp), any, true),
        (by(StencilOperation::IncrementWrap), any, true),
        (by(StencilOperation::DecrementWrap), Stencil::test(Comparison::Less, 200), true),
        (by(StencilOperation::DecrementClamp), any, false),
        (by(StencilOperation::Zero), any, false),
    ] {
        let found = white(mark, stencil)?;
        let is_white = found.bytes == covered.bytes;
        if is_white != is_covered || (!is_covered && found.bytes.contains(&255)) {
            return Err(format!("{stencil:?} after {:?}", mark.stencil).into());
        }
    }
    Ok(())
}

/// A cube in the layer [`MARKED`], behind a wall that is in another: occlusion culling removes the cube.
fn cube_behind_wall() -> Result<(Scene, [LayerMask; 2]), Failed> {
    let mut scene = Scene::new();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::new(0.0, 0.0, 12.0), DVec3::ZERO), [160, 90])];
    let (mesh, stone) = (scene.add(cube())?, scene.add(Material::default())?);
    let wall = RenderObject::new(mesh, stone, DVec3::ZERO);
    scene.add_object(RenderObject { scale: Vec3::new(6.0, 4.0, 0.5), ..wall })?;
    scene.add_object(RenderObject::new(mesh, stone, DVec3::new(0.0, 0.0, -6.0)))?;
    Ok((scene, [LayerMask::layer(0), MARKED]))
}

fn hidden_objects() -> Result<(), Failed> {
    let (scene, layers) = cube_behind_wall()?;
    let white_of = |stencil, occlusion| -> Result<Picture, Failed> {
        let white = White { target: "depth", stencil: Some(Stencil::test(Comparison::Equal, 3)) };
        let quality = Quality { occlusion, ..Quality::balanced() };
        let mark = Mark { stencil, ..Mark::BESIDE_DEPTH };
        let mut fixture = Fixture::with(2, |builder| {
            builder.pipeline(pipeline()).process(mark).process(white).output("white").quality(quality)
        })?;
        let recorded = fixture.renderer.record(SceneRef { layers: &layers, ..scene.as_scene_ref() })?;
        Ok(fixture.submit(recorded)?.read(0, "white")?)
    };
    let (keep, replace) = (StencilOperation::Keep, StencilOperation::Replace);
    let where_depth_fails = Stencil { on_depth_fail: replace, on_pass: keep, ..Stencil::mark(3) };
    // The stencil test comes before the depth test.
    let where_stencil_fails =
        Stencil { comparison: Comparison::Never, on_fail: replace, on_pass: keep, ..Stencil::mark(3) };
    for stencil in [where_depth_fails, where_stencil_fails] {
        let expected = white_of(stencil, None)?;
        expect(expected.bytes.contains(&255), || format!("{stencil:?}: nothing is marked"))?;
        expect(white_of(stencil, Some(16))? == expected, || format!("{stencil:?}: occlusion culling changes it"))?;
    }
    Ok(())
}

/// Draws objects in white wherever the stencil is 0, whatever the depth.
struct ThroughWalls;

impl RenderProcess for ThroughWalls {
    fn name(&self) -> &str {
        "through walls"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("white", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        declare.tests_stencil("depth");
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws {
            shader: COVERED,
            selection: Selection::OPAQUE.in_layers(MARKED),
            writes_depth: false,
            stencil: Some(Stencil::test(Comparison::Equal, 0)),
            ..CommandDraws::default()
        })
    }
}

fn through_walls() -> Result<(), Failed> {
    let (scene, layers) = cube_behind_wall()?;
    let draw = |occlusion| -> Result<Picture, Failed> {
        let quality = Quality { occlusion, ..Quality::balanced() };
        let mut fixture = Fixture::with(2, |builder| {
            builder.pipeline(pipeline()).process(ThroughWalls).output("white").quality(quality)
        })?;
        let recorded = fixture.renderer.record(SceneRef { layers: &layers, ..scene.as_scene_ref() })?;
        Ok(fixture.submit(recorded)?.read(0, "white")?)
    };
    let expected = draw(None)?;
    expect(expected.bytes.contains(&255), || "nothing is seen through the wall".into())?;
    expect(draw(Some(16))? == expected, || "occlusion culling removes it".into())
}

/// Draws the depth of objects where the stencil is 3, which is nowhere.
struct Masked;

impl RenderProcess for Masked {
    fn name(&self) -> &str {
        "masked"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("white", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        declare.clears_depth("own depth", Format::Depth32FloatStencil8);
    }

    fn draws(&self) -> Draws<'_> {
        let stencil = Some(Stencil::test(Comparison::Equal, 3));
        Draws::Commands(CommandDraws {
            shader: COVERED,
            selection: Selection::OPAQUE.not_in_layers(MARKED),
            stencil,
            ..CommandDraws::default()
        })
    }
}

/// Draws the marked objects behind them.
struct Behind;

impl RenderProcess for Behind {
    fn name(&self) -> &str {
        "behind"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.draws_over("white");
        declare.draws_depth("own depth");
        declare.after("masked");
    }

    fn draws(&self) -> Draws<'_> {
        let selection = Selection::OPAQUE.in_layers(MARKED);
        Draws::Commands(CommandDraws { shader: COVERED, selection, ..CommandDraws::default() })
    }
}

fn masked() -> Result<(), Failed> {
    let (scene, layers) = cube_behind_wall()?;
    let draw = |occlusion| -> Result<Picture, Failed> {
        let quality = Quality { occlusion, ..Quality::balanced() };
        let mut fixture =
            Fixture::with(2, |builder| builder.process(Masked).process(Behind).output("white").quality(quality))?;
        let recorded = fixture.renderer.record(SceneRef { layers: &layers, ..scene.as_scene_ref() })?;
        Ok(fixture.submit(recorded)?.read(0, "white")?)
    };
    let expected = draw(None)?;
    expect(expected.bytes.contains(&255), || "the cube is not seen".into())?;
    expect(draw(Some(16))? == expected, || "an object that the stencil test leaves out hides it".into())
}

fn without() -> Result<(), Failed> {
    let test = Stencil::test(Comparison::Equal, 3);
    let problem = |white: White| -> Result<String, Failed> {
        let process = |builder: RendererBuilder<WgpuBackend>| {
            builder.pipeline(Deferred::to_picture()).process(Mark::ALONE).process(white).output("white")
        };
        let mut fixture = match Fixture::with(2, process) {
            Ok(fixture) => fixture,
            Err(error) => return Ok(error.message().unwrap_or_default().to_owned()),
        };
        let (scene, _) = scene();
        Ok(fixture.renderer.record(scene.as_scene_ref()).err().ok_or("it is recorded")?.to_string())
    };
    for (target, stencil, part) in [
        ("depth", Some(test), "Depth32Float"),
        ("marked", Some(Stencil::mark(1)), "declares only"),
        ("marked", None, "without a test"),
    ] {
        let found = problem(White { target, stencil })?;
        if !found.contains(part) || !found.contains("\"white\"") {
            return Err(found.into());
        }
    }
    Ok(())
}
