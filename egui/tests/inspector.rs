//! The inspector, used as a person does: what it shows, and what a click changes.

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::quality::{CullingVolume, Quality};
use drawloom::scene::{Camera, Light, Material, Mesh, RenderObject, Scene, Topology, Vertex};
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter};
use drawloom_egui::Inspector;
use egui::Shape;
use egui::accesskit::Role;
use egui_kittest::kittest::Queryable;
use egui_kittest::{Harness, Node};

/// An engine that draws a frame and the inspector over it.
struct Engine {
    scene: Scene,
    renderer: Renderer<NullBackend>,
    submitter: Submitter<NullBackend>,
    inspector: Inspector,
}

impl Engine {
    fn new() -> Self {
        Self::with_quality(Some(Quality::balanced()))
    }

    fn with_quality(quality: Option<Quality>) -> Self {
        let mut scene = Scene::new();
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let vertices = corners.map(|position| Vertex { position, normal: [0.0, 0.0, 1.0], uv: [0.0; 2] });
        let mesh = Mesh::new("triangle", Topology::TriangleList, vertices.into(), vec![0, 1, 2]).unwrap();
        let (mesh, material) = (scene.add(mesh).unwrap(), scene.add(Material::default()).unwrap());
        for index in 0..5 {
            let position = DVec3::new(f64::from(index), 0.0, -9.0);
            scene.add_object(RenderObject::new(mesh, material, position)).unwrap();
        }
        scene.cameras.push(Camera::looking_at("left eye", DVec3::ZERO, DVec3::NEG_Z));
        scene.lights.push(Light::Directional { direction: Vec3::NEG_Y, illuminance: Vec3::ONE, casts_shadow: true });
        let scheduler = Arc::new(Scheduler::new(2).unwrap());
        let builder = Renderer::builder(NullBackend).pipeline(Deferred::new());
        let builder = match quality {
            Some(quality) => builder.quality(quality),
            None => builder,
        };
        let (renderer, submitter) = builder.build(scheduler).unwrap();
        Self { scene, renderer, submitter, inspector: Inspector::default() }
    }

    fn frame(&mut self, ui: &mut egui::Ui) {
        let recorded = self.renderer.record(self.scene.as_scene_ref()).unwrap();
        self.inspector.add_frame(&self.renderer, &recorded);
        self.submitter.submit(recorded).unwrap();
        self.inspector.show(ui.ctx(), &mut self.renderer);
    }
}

fn harness(engine: Engine) -> Harness<'static, Engine> {
    let builder = Harness::builder().with_size([1200.0, 900.0]);
    let mut harness = builder.build_ui_state(|ui, engine: &mut Engine| engine.frame(ui), engine);
    harness.run_steps(8);
    harness
}

fn click(harness: &mut Harness<'_, Engine>, label: &str) {
    harness.get_by_label(label).click();
    harness.run_steps(4);
}

/// All texts of the latest frame, also those that are painted and no widgets.
fn texts(harness: &Harness<'_, Engine>) -> Vec<String> {
    fn collect(shape: &Shape, texts: &mut Vec<String>) {
        match shape {
            Shape::Text(text) => texts.push(text.galley.text().to_owned()),
            Shape::Vec(shapes) => shapes.iter().for_each(|shape| collect(shape, texts)),
            _ => {}
        }
    }
    let mut texts = Vec::new();
    harness.output().shapes.iter().for_each(|clipped| collect(&clipped.shape, &mut texts));
    texts
}

fn assert_shown(harness: &Harness<'_, Engine>, expected: &[&str]) {
    let texts = texts(harness);
    for text in expected {
        assert!(texts.iter().any(|shown| shown == text), "{text:?} is not among {texts:?}");
    }
}

#[test]
fn the_timeline_has_a_lane_for_each_thread_and_worker() {
    let harness = harness(Engine::new());
    let workers = harness.state().renderer.scheduler().workers();
    assert_eq!(workers, 2);
    assert_shown(&harness, &["record", "caller", "drawloom-1"]);
}

#[test]
fn the_graph_has_the_stages_of_each_view() {
    let mut harness = harness(Engine::new());
    click(&mut harness, "Frame graph");
    let texts = texts(&harness);
    let is_shown =
        |first: &str, second: &str| texts.windows(2).any(|pair| pair[0] == first && pair[1].starts_with(second));
    assert!(is_shown("visibility", "left eye, ") && is_shown("visibility", "shadow of light 0, "), "{texts:?}");
}

#[test]
fn views_are_listed_with_what_they_see() {
    let mut harness = harness(Engine::new());
    click(&mut harness, "Views");
    assert_shown(
        &harness,
        &["left eye", "main", "shadow of light 0", "shadow", "5", "objects: 5, lights: 1, bytes uploaded: 0"],
    );
}

#[test]
fn a_preset_changes_the_quality() {
    let mut harness = harness(Engine::new());
    click(&mut harness, "Quality");
    for (name, quality) in [("exact", Quality::exact()), ("fast", Quality::fast())] {
        click(&mut harness, name);
        assert_eq!(*harness.state().renderer.quality(), quality);
    }
}

#[test]
fn a_value_changes_one_setting_and_one_that_does_not_fit_cannot_be_chosen() {
    let mut harness = harness(Engine::new());
    click(&mut harness, "Quality");
    choose(&mut harness, "culling volume", "oriented box");
    choose(&mut harness, "occlusion culling", "8 pixels");
    let expected = Quality { culling: CullingVolume::OrientedBox, occlusion: Some(8), ..Quality::balanced() };
    assert_eq!(*harness.state().renderer.quality(), expected);
    choose(&mut harness, "culling volume", "none");
    assert_eq!(*harness.state().renderer.quality(), expected);
}

#[test]
fn a_pipeline_with_settings_of_its_own_keeps_them_until_one_is_chosen() {
    let mut harness = harness(Engine::with_quality(None));
    click(&mut harness, "Quality");
    assert!(harness.query_by_label("Measure all prices").is_none());
    assert!(!harness.state().renderer.pipeline_has_quality());
    click(&mut harness, "balanced");
    assert!(harness.state().renderer.pipeline_has_quality());
    assert!(harness.query_by_label("Measure all prices").is_some());
}

#[test]
fn a_measurement_goes_on_while_the_window_is_collapsed() {
    let mut harness = harness(Engine::new());
    click(&mut harness, "Quality");
    measure(&mut harness, "depth pre-pass");
    click(&mut harness, "Hide");
    assert!(harness.query_by_label("Stop").is_none(), "it is not collapsed");
    harness.run_steps(400);
    click(&mut harness, "Show");
    let is_price = |text: &String| text.starts_with("on ") && text.ends_with(" ms");
    assert!(texts(&harness).iter().any(is_price));
}

/// Starts a measurement of a setting's values.
fn measure(harness: &mut Harness<'_, Engine>, setting: &str) {
    let height = harness.get_by_label(setting).rect().center().y;
    let is_in_row = |node: &Node<'_>| node.rect().y_range().contains(height);
    harness.get_all_by_label("Measure").find(is_in_row).unwrap().click();
    harness.run_steps(2);
}

/// Chooses a value of a setting.
fn choose(harness: &mut Harness<'_, Engine>, setting: &str, value: &str) {
    let height = harness.get_by_label(setting).rect().center().y;
    let is_in_row = |node: &Node<'_>| node.rect().y_range().contains(height);
    harness.get_all_by_role(Role::ComboBox).find(is_in_row).unwrap().click();
    harness.run_steps(2);
    // The chosen value of another setting may have the same name.
    harness.get_all_by_label(value).last().unwrap().click();
    harness.run_steps(4);
}

#[test]
fn a_measurement_shows_prices_and_leaves_the_quality_as_it_was() {
    let mut harness = harness(Engine::new());
    click(&mut harness, "Quality");
    click(&mut harness, "exact");
    measure(&mut harness, "normals");
    let mut qualities = Vec::new();
    for _ in 0..1000 {
        harness.step();
        let quality = *harness.state().renderer.quality();
        if !qualities.contains(&quality) {
            qualities.push(quality);
        }
    }
    // The chosen value of the fifth setting, and its three others.
    assert_eq!(qualities.len(), 4);
    assert_eq!(*harness.state().renderer.quality(), Quality::exact());
    let texts = texts(&harness);
    let prices = texts.iter().find(|text| text.contains("half floats") && text.contains(" ms")).unwrap();
    assert_eq!(prices.matches(" ms").count(), 3, "{prices}");
    assert!(harness.query_by_label("Stop").is_none());
}

#[test]
fn closing_it_ends_a_measurement_and_the_recording() {
    let mut harness = harness(Engine::new());
    assert!(harness.state().renderer.scheduler().timeline().is_on());
    click(&mut harness, "Quality");
    harness.get_by_label("Measure all prices").click();
    for _ in 0..200 {
        harness.step();
        if *harness.state().renderer.quality() != Quality::balanced() {
            break;
        }
    }
    assert_ne!(*harness.state().renderer.quality(), Quality::balanced());
    click(&mut harness, "Close window");
    assert!(!harness.state().inspector.is_open());
    assert_eq!(*harness.state().renderer.quality(), Quality::balanced());
    assert!(!harness.state().renderer.scheduler().timeline().is_on());
    harness.state_mut().inspector.open();
    harness.run_steps(4);
    assert!(harness.state().renderer.scheduler().timeline().is_on());
}

#[test]
fn a_timeline_that_the_engine_records_goes_on() {
    let engine = Engine::new();
    engine.renderer.scheduler().timeline().start();
    let mut harness = harness(engine);
    click(&mut harness, "Close window");
    assert!(harness.state().renderer.scheduler().timeline().is_on());
}

#[test]
fn what_is_not_drawn_is_a_warning() {
    let mut engine = Engine::new();
    engine.scene.lights.push(Light::Point {
        position: DVec3::ZERO,
        intensity: Vec3::NAN,
        range: 1.0,
        casts_shadow: false,
    });
    let mut harness = harness(engine);
    click(&mut harness, "Warnings (1)");
    assert_shown(&harness, &["index 1", "in the latest frame"]);
    harness.state_mut().scene.lights.pop();
    harness.run_steps(3);
    assert_shown(&harness, &["Warnings (1)", "3 frames ago"]);
    click(&mut harness, "Clear");
    assert_shown(&harness, &["Warnings", "Everything was drawn as requested."]);
}

#[test]
fn a_frame_that_is_selected_stays() {
    let mut harness = harness(Engine::new());
    let shown = |harness: &Harness<'_, Engine>| {
        texts(harness).into_iter().find(|text| text.starts_with("Frame ") && text.ends_with(" ms")).unwrap()
    };
    let before = shown(&harness);
    harness.run_steps(3);
    assert_ne!(shown(&harness), before);
    click(&mut harness, "follow the latest");
    let selected = shown(&harness);
    harness.run_steps(5);
    assert_eq!(shown(&harness), selected);
    click(&mut harness, "Why so long?");
    assert!(texts(&harness).iter().any(|text| text.starts_with("Report on frame ")));
    click(&mut harness, "follow the latest");
    harness.run_steps(3);
    assert_ne!(shown(&harness), selected);
}
