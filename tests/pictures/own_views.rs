//! Kinds of views of an engine's own: drawn by the processes that declare them, in formats of their own, and sampled by
//! others.

use drawloom::command::Selection;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{
    ClearColor, CommandDraws, Declare, Deferred, Draws, Format, FullScreen, InjectionPoint, RenderProcess,
};
use drawloom::scene::{Camera, Material, Projection, RenderObject, Scene, Topology, ViewKind};
use drawloom_testing::scenes::{sized, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, pixel};

pub const CASES: &[Case] = &[
    ("a_kind_of_view_of_the_engines_own_is_drawn_by_its_processes", map),
    ("views_of_a_kind_that_comes_and_goes_are_drawn", comes_and_goes),
    ("a_view_of_a_kind_that_no_process_draws_is_an_error", nobody),
];

const MAP: ViewKind = ViewKind::Own2;
const SIZE: [u32; 2] = [16, 16];

/// Draws all objects green on blue, as a map. The main view has another target of this name, in another format.
struct MapProcess;

impl RenderProcess for MapProcess {
    fn name(&self) -> &str {
        "map"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.views(MAP);
        declare.clears_color("map", Format::Rgba16Float, ClearColor::Value([0.0, 0.0, 1.0, 1.0]));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws {
            shader: "
                @vertex
                fn vertex(in: VertexInput) -> @builtin(position) vec4<f32> {
                    return clip_position(relative_position(drawn_object(in.instance), in.position));
                }

                @fragment
                fn fragment() -> @location(0) vec4<f32> {
                    return vec4<f32>(0.0, 1.0, 0.0, 1.0);
                }
            ",
            selection: Selection::ALL,
            ..CommandDraws::default()
        })
    }
}

/// Shows the map in the main view, or red where there is none.
struct Overlay;

impl RenderProcess for Overlay {
    fn name(&self) -> &str {
        "overlay"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterLighting);
        declare.samples_view(MAP, "minimap", "map");
        declare.clears_color("overlay", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen {
            shader: "
                @group(2) @binding(1) var map: texture_2d<f32>;

                @fragment
                fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                    if all(textureDimensions(map) == vec2(1u)) {
                        return vec4<f32>(1.0, 0.0, 0.0, 1.0);
                    }
                    return textureLoad(map, vec2<i32>(in.position.xy), 0);
                }
            ",
            ..FullScreen::default()
        })
    }
}

/// A ground in the middle, seen from above by the map, and from the side by the main camera.
fn scene() -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    let mesh = scene.add(square(Topology::TriangleList))?;
    let material = scene.add(Material { double_sided: true, ..Material::default() })?;
    scene.add_object(RenderObject { scale: Vec3::splat(2.0), ..RenderObject::new(mesh, material, DVec3::ZERO) })?;
    let map = Camera {
        kind: MAP,
        projection: Projection::Orthographic { height: 8.0 },
        far: 100.0,
        ..sized(Camera::looking_at("minimap", DVec3::Z * 10.0, DVec3::ZERO), SIZE)
    };
    let main = sized(Camera::looking_at("main", DVec3::X * 30.0, DVec3::ZERO), SIZE);
    scene.cameras = vec![map, main];
    Ok(scene)
}

fn fixture() -> Result<Fixture, Failed> {
    Fixture::with(2, |builder| {
        builder.pipeline(Deferred::to_picture()).process(MapProcess).process(Overlay).output("overlay")
    })
}

const GROUND: [u8; 3] = [0, 255, 0];
const AROUND: [u8; 3] = [0, 0, 255];

/// Pixels in the middle and in a corner of what the main view shows of the map.
fn shown(fixture: &mut Fixture, scene: &Scene) -> Result<[[u8; 3]; 2], Failed> {
    let recorded = fixture.record(scene)?;
    let main = recorded.views().iter().position(|view| view.kind() == ViewKind::Main).ok_or("there is a main view")?;
    let picture = fixture.submit(recorded)?.read(main, "overlay")?;
    Ok([pixel(&picture, 8, 8), pixel(&picture, 1, 1)])
}

fn map() -> Result<(), Failed> {
    let (mut fixture, scene) = (fixture()?, scene()?);
    assert_eq!(shown(&mut fixture, &scene)?, [GROUND, AROUND]);
    let recorded = fixture.record(&scene)?;
    let statistics = recorded.statistics();
    let kinds: Vec<_> = statistics.views.iter().map(|view| (view.name.as_str(), view.kind)).collect();
    assert_eq!(kinds, [("minimap", MAP), ("main", ViewKind::Main)]);
    assert_eq!(MAP.name(), "own 2");
    Ok(())
}

fn comes_and_goes() -> Result<(), Failed> {
    let (mut fixture, mut scene) = (fixture()?, scene()?);
    let map = scene.cameras.remove(0);
    for _ in 0..2 {
        assert_eq!(shown(&mut fixture, &scene)?, [[255, 0, 0]; 2], "without a map");
        scene.cameras.push(map.clone());
        assert_eq!(shown(&mut fixture, &scene)?, [GROUND, AROUND]);
        scene.cameras.pop();
    }
    Ok(())
}

fn nobody() -> Result<(), Failed> {
    let (mut fixture, mut scene) = (fixture()?, scene()?);
    scene.cameras[0].kind = ViewKind::Own1;
    let error = fixture.record(&scene).err().ok_or("it is drawn")?;
    let message = error.message().unwrap_or_default();
    assert!(message.contains("minimap") && message.contains("Own1"), "{message}");
    Ok(())
}
