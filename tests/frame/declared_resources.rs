//! Raw passes get what their processes declare, and nothing else. What is declared and not used is warned of.

use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use drawloom::backend::{BackendError, WgpuBackend};
use drawloom::process::{
    AccessError, ClearColor, Declare, Deferred, Draws, Format, FullScreen, Fxaa, RawPass, RawPassResources,
    RenderProcess, StorageBuffer, previous_name, targets,
};
use drawloom::quality::Quality;
use drawloom::scene::{Material, MaterialType, ObjectColumn, Scene, SceneRef, ViewKind};
use drawloom::task::Scheduler;
use drawloom::{FrameError, Renderer, RendererBuilder, Submitter, wgpu};
use drawloom_testing::adapter::noop_device;
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::field;

use crate::reported;

const TINT: ObjectColumn<[f32; 4]> = ObjectColumn::new("tint");
const METAL: MaterialType<[f32; 4]> = MaterialType::new("metal");
const COUNTS: StorageBuffer<u32> = StorageBuffer::new("counts", 4);

type Ask = fn(&RawPassResources<'_>) -> Result<(), AccessError>;
type Encode = dyn Fn(usize, &RawPassResources<'_>) -> Result<(), Box<dyn Error + Send + Sync>> + Send + Sync;

/// A raw pass that asks for things.
struct Asking {
    name: &'static str,
    declare: fn(&mut Declare),
    /// What it asks for in the frame of this number: no other frame is in flight.
    ask: Box<Encode>,
    frame: Arc<AtomicUsize>,
}

impl Asking {
    /// Asks in every frame.
    fn always(name: &'static str, declare: fn(&mut Declare), ask: Ask) -> Self {
        Self { name, declare, ask: Box::new(move |_, resources| Ok(ask(resources)?)), frame: Arc::default() }
    }
}

impl RenderProcess for Asking {
    fn name(&self) -> &str {
        self.name
    }

    fn declare(&self, declare: &mut Declare) {
        (self.declare)(declare);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        self.frame.fetch_add(1, Ordering::Relaxed);
        Draws::Raw(self)
    }
}

impl RawPass for Asking {
    fn encode(
        &self,
        _: &mut wgpu::CommandEncoder,
        resources: &RawPassResources<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        (self.ask)(self.frame.load(Ordering::Relaxed), resources)
    }
}

/// Clears a target of its own.
struct Clears(&'static str);

impl RenderProcess for Clears {
    fn name(&self) -> &str {
        self.0
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color(self.0, Format::Rgba8Unorm, ClearColor::Background);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "@fragment fn fragment() -> @location(0) vec4<f32> { return vec4(1.0); }";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

fn with(
    add: impl FnOnce(RendererBuilder<WgpuBackend>) -> RendererBuilder<WgpuBackend>,
) -> (Renderer<WgpuBackend>, Submitter<WgpuBackend>) {
    let (device, queue) = noop_device().unwrap();
    let builder = Renderer::builder(WgpuBackend::new(device, queue).unwrap());
    add(builder).build(Arc::new(Scheduler::new(2).unwrap())).unwrap()
}

/// Two views of objects, and a material with values.
fn scene() -> Scene {
    let mut scene = field(3);
    scene.add(Material { values: Some(METAL.values([1.0; 4])), ..Material::default() }).unwrap();
    scene
}

fn draw(
    renderer: &mut Renderer<WgpuBackend>,
    submitter: &Submitter<WgpuBackend>,
    scene: &Scene,
) -> Result<(), FrameError> {
    let tints = vec![[1.0; 4]; scene.object_count()];
    let columns = [TINT.values(&tints)];
    let recorded = renderer.record(SceneRef { columns: &columns, ..scene.as_scene_ref() })?;
    submitter.submit(recorded).unwrap();
    Ok(())
}

/// The error that failed a stage, and the text of all causes.
fn access_error(error: &FrameError) -> (AccessError, String) {
    let FrameError::Failed { stage, source } = error else { panic!("{error}") };
    match source.downcast_ref() {
        Some(BackendError::Access(access)) => (access.clone(), format!("{stage}: {source}")),
        _ => panic!("{error}"),
    }
}

#[test]
fn a_raw_pass_has_the_whole_texture_of_a_small_target() {
    let asking = Asking::always(
        "asking",
        |declare| declare.reads("own"),
        |resources| {
            assert_eq!(resources.target("own")?.depth_or_array_layers(), 1);
            Ok(())
        },
    );
    let (device, queue) = noop_device().unwrap();
    // Small targets share textures beside transient ones, and outputs are not transient.
    let backend = WgpuBackend::new(device, queue).unwrap().transient_targets();
    let builder = Renderer::builder(backend).process(Clears("own")).process(asking).output("own");
    let (mut renderer, submitter) = builder.build(Arc::new(Scheduler::new(2).unwrap())).unwrap();
    let mut scene = scene();
    scene.cameras.iter_mut().for_each(|camera| camera.size = [16, 16]);
    assert_eq!(scene.cameras.len(), 2);
    draw(&mut renderer, &submitter, &scene).unwrap();
}

#[test]
fn what_a_raw_pass_asks_for_without_declaring_it_fails_the_frame() {
    let process = || "asking".to_owned();
    let undeclared = |target: &str| AccessError::UndeclaredTarget {
        process: process(),
        target: target.to_owned(),
        declared: "\"own\"".to_owned(),
    };
    let cases: [(Ask, AccessError, &str); 8] = [
        (|resources| resources.target("other").map(drop), undeclared("other"), "\"other\""),
        (
            // The history of a target that it declares.
            |resources| resources.target(previous_name("own")).map(drop),
            undeclared(&previous_name("own")),
            "\"own of the frame before\"",
        ),
        (|resources| resources.target("of no process").map(drop), undeclared("of no process"), "\"of no process\""),
        (
            |resources| resources.layered_target(ViewKind::Shadow, targets::SHADOW_MAP).map(drop),
            AccessError::UndeclaredLayeredTarget {
                process: process(),
                views: ViewKind::Shadow,
                target: targets::SHADOW_MAP.to_string(),
                declared: "none".to_owned(),
            },
            "\"shadow map\" of all shadow views",
        ),
        (
            |resources| resources.layered_target(ViewKind::Main, "own").map(drop),
            AccessError::NotLayered { process: process(), views: ViewKind::Main, target: "own".into() },
            "\"own\" of all main views",
        ),
        (
            |resources| resources.column(TINT).map(drop),
            AccessError::UndeclaredColumn { process: process(), column: "tint", stride: 16 },
            "the column \"tint\"",
        ),
        (
            |resources| resources.materials(METAL).map(drop),
            AccessError::UndeclaredMaterialType { process: process(), material_type: "metal", stride: 16 },
            "the material type \"metal\"",
        ),
        (
            |resources| resources.buffer(COUNTS).map(drop),
            AccessError::UndeclaredBuffer { process: process(), buffer: "counts", bytes: 16 },
            "the buffer \"counts\" of 16 bytes",
        ),
    ];
    let scene = scene();
    for (ask, expected, named) in cases {
        let asking = Asking {
            name: "asking",
            declare: |declare| declare.writes("own", Format::Rgba8Unorm),
            frame: Arc::default(),
            ask: Box::new(move |frame, resources| match frame {
                1 => Ok(ask(resources)?),
                // It goes on as if nothing had happened, or with errors that only follow.
                3 => {
                    _ = ask(resources);
                    Ok(())
                }
                5 => {
                    _ = ask(resources);
                    resources.target("another")?;
                    Err("it lacks something".into())
                }
                _ => {
                    resources.target("own")?;
                    Ok(())
                }
            }),
        };
        // Other processes declare all of it.
        let all = Asking::always(
            "all",
            |declare| {
                declare.reads("other");
                declare.samples_previous("own");
                declare.samples_layers(ViewKind::Shadow, targets::SHADOW_MAP);
                declare.reads_column(TINT);
                declare.reads_materials(METAL);
                declare.changes_buffer(COUNTS);
            },
            |_| Ok(()),
        );
        let deferred = Deferred::to_picture();
        let (mut renderer, submitter) =
            with(|builder| builder.pipeline(deferred).process(asking).process(all).process(Clears("other")));
        for frame in 1..=6 {
            let drawn = draw(&mut renderer, &submitter, &scene);
            if frame % 2 == 0 {
                drawn.unwrap();
                continue;
            }
            let (found, text) = access_error(&drawn.unwrap_err());
            assert_eq!(found, expected, "frame {frame}");
            assert!(text.contains("process \"asking\" asks for") && text.contains(named), "{text}");
        }
    }
}

#[test]
fn a_raw_pass_gets_what_its_process_declares() {
    let written = Asking::always(
        "writing",
        |declare| {
            declare.writes("written", Format::Rgba8Unorm);
            declare.changes_buffer(COUNTS);
        },
        |resources| resources.target("written").and(resources.buffer(COUNTS)).map(drop),
    );
    let everything = Asking::always(
        "everything",
        |declare| {
            declare.reads("written");
            declare.changes("cleared");
            declare.samples_previous("cleared");
            declare.samples_layers(ViewKind::Shadow, targets::SHADOW_MAP);
            declare.reads_column(TINT);
            declare.reads_materials(METAL);
            declare.reads_arguments(COUNTS);
        },
        |resources| {
            let before = resources.target(previous_name("cleared"))?;
            for target in ["written", "cleared"] {
                assert_eq!(resources.target(target)?.size(), before.size());
            }
            assert!(resources.layered_target(ViewKind::Shadow, targets::SHADOW_MAP)?.depth_or_array_layers() > 0);
            assert!(resources.column(TINT)?.buffer.size() >= 48);
            assert!(resources.materials(METAL)?.buffer.size() >= 16);
            assert_eq!(resources.buffer(COUNTS)?.size(), 16);
            Ok(())
        },
    );
    // In its own views, a raw pass finds an array under both names.
    let shadows = Asking::always(
        "shadows",
        |declare| {
            declare.views(ViewKind::Shadow);
            declare.reads(targets::SHADOW_MAP);
        },
        |resources| {
            let shared = resources.layered_target(ViewKind::Shadow, targets::SHADOW_MAP)?;
            assert_eq!(resources.target(targets::SHADOW_MAP)?, shared);
            Ok(())
        },
    );
    let (mut renderer, submitter) = with(|builder| {
        let builder = builder.pipeline(Deferred::to_picture()).process(Clears("cleared"));
        builder.process(everything).process(written).process(shadows)
    });
    let mut scene = scene();
    draw(&mut renderer, &submitter, &scene).unwrap();
    // Without lights there are no shadow maps, but an empty one.
    scene.lights.clear();
    draw(&mut renderer, &submitter, &scene).unwrap();
}

#[test]
fn what_a_raw_pass_never_asks_for_is_warned_of_once() {
    let frame = Arc::new(AtomicUsize::new(0));
    let idle = Asking {
        name: "idle",
        declare: |declare| {
            for target in ["used", "unused", "used late", "used too late"] {
                declare.reads(target);
            }
            // It asks for one of the two.
            declare.changes("used twice");
            declare.samples_previous("used twice");
            declare.reads_column(TINT);
            declare.reads_materials(METAL);
            declare.changes_buffer(COUNTS);
        },
        frame: Arc::clone(&frame),
        ask: Box::new(|frame, resources| {
            resources.target("used")?;
            resources.target("used twice")?;
            match frame {
                60 if resources.view == 1 => _ = resources.target("used late")?,
                61.. => _ = resources.target("used too late")?,
                _ => {}
            }
            Ok(())
        }),
    };
    // No view of its kind is drawn, so it does not know what it would ask for.
    let absent = Asking::always(
        "absent",
        |declare| {
            declare.views(ViewKind::Reflection);
            declare.writes("absent", Format::Rgba8Unorm);
        },
        |_| Ok(()),
    );
    let (mut renderer, submitter) = with(|builder| {
        let targets = ["used", "unused", "used late", "used too late", "used twice"];
        let builder = targets.into_iter().fold(builder, |builder, target| builder.process(Clears(target)));
        builder.pipeline(Deferred::to_picture()).process(idle).process(absent)
    });
    let mut scene = scene();
    for (frames, expected) in [(59, false), (1, true), (70, false)] {
        let text = reported(|| (0..frames).for_each(|_| draw(&mut renderer, &submitter, &scene).unwrap()));
        let expected: &[&str] = match expected {
            false => &[],
            true => &[
                "target \"unused\"",
                "target \"used too late\"",
                "target \"used twice of the frame before\"",
                "the column \"tint\"",
                "the material type \"metal\"",
                "the buffer \"counts\"",
            ],
        };
        let warnings: Vec<_> = text.lines().filter(|line| line.contains("not asked for")).collect();
        assert_eq!(warnings.len(), expected.len(), "{text}");
        for (warning, resource) in warnings.into_iter().zip(expected) {
            assert!(warning.contains("WARN") && warning.contains("process=idle"), "{text}");
            assert!(warning.contains(&format!("declares {resource},")), "{text}");
        }
    }
    // Neither another plan nor another pipeline warns again.
    let text = reported(|| {
        scene.lights.clear();
        let plans = renderer.plan_count();
        (0..70).for_each(|_| draw(&mut renderer, &submitter, &scene).unwrap());
        assert_eq!(renderer.plan_count(), plans + 1);
        renderer.set_quality(Quality::fast()).unwrap();
        (0..70).for_each(|_| draw(&mut renderer, &submitter, &scene).unwrap());
    });
    assert!(!text.contains("not asked for"), "{text}");
}

#[test]
fn what_a_shader_has_no_variable_for_is_warned_of() {
    struct Sampling;
    impl RenderProcess for Sampling {
        fn name(&self) -> &str {
            "sampling"
        }
        fn declare(&self, declare: &mut Declare) {
            declare.samples("depth");
            declare.samples("diffuse");
            declare.clears_color("sampled", Format::Rgba8Unorm, ClearColor::Background);
            declare.keep();
        }
        fn draws(&self) -> Draws<'_> {
            let shader = "
                @group(2) @binding(2) var diffuse: texture_2d<f32>;
                @fragment fn fragment() -> @location(0) vec4<f32> { return textureLoad(diffuse, vec2(0), 0); }
            ";
            Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
        }
    }
    let scene = everything();
    let deferred = || Deferred::to_picture().post(Fxaa::default());
    let text = reported(|| {
        let (mut renderer, submitter) = with(|builder| builder.pipeline(deferred()).process(Sampling));
        (0..2).for_each(|_| draw(&mut renderer, &submitter, &scene).unwrap());
    });
    let warnings: Vec<_> = text.lines().filter(|line| line.contains("no variable")).collect();
    // None is about a process that is shipped.
    let [warning] = warnings[..] else { panic!("{text}") };
    assert!(warning.contains("process=sampling") && warning.contains("target \"depth\""), "{text}");
    assert!(warning.contains("@group(2) @binding(1)"), "{text}");
}
