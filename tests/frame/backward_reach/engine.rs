//! From plain data to a renderer and its scenes.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::NullBackend;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{ClearColor, Declare, Deferred, Draws, Format, FullScreen, Fxaa, RenderProcess};
use drawloom::scene::{Blend, Camera, Light, Material, MaterialType, RenderObject, Scene, ViewKind};
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom_testing::scenes::{cube, sized};

use super::spec::{CameraSpec, LightKindSpec, LightSpec, Object, OwnProcess, Pipeline, World};

const GLOW: MaterialType<[f32; 4]> = MaterialType::new("glow");

/// A process of the engine's own, and those that come before and after it.
struct Own {
    name: String,
    process: OwnProcess,
    after: Vec<String>,
    before: Vec<String>,
}

impl RenderProcess for Own {
    fn name(&self) -> &str {
        &self.name
    }

    fn declare(&self, declare: &mut Declare) {
        let OwnProcess { in_main, in_reflections, place, samples_shadow_maps, keep, .. } = self.process;
        declare.views(if in_main { ViewKind::Main } else { ViewKind::Reflection });
        if in_main && in_reflections {
            declare.also_views(ViewKind::Reflection);
        }
        declare.clears_color(self.process.target(), Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        self.process.samples.iter().for_each(|target| declare.samples(target));
        self.process.draws_over.iter().for_each(|target| declare.draws_over(target));
        self.process.histories.iter().for_each(|target| declare.samples_previous(target));
        for target in &self.process.of_mirror {
            declare.samples_view(ViewKind::Reflection, "mirror", target);
        }
        if samples_shadow_maps {
            declare.samples_layers(ViewKind::Shadow, "shadow map");
        }
        if keep {
            declare.keep();
        }
        declare.at(place);
        self.after.iter().for_each(|other| declare.after(other));
        self.before.iter().for_each(|other| declare.before(other));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen::default())
    }
}

/// A picture of diffuse colours, in the place of tone mapping.
struct ShowDiffuse(&'static str);

impl RenderProcess for ShowDiffuse {
    fn name(&self) -> &str {
        "tone mapping"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples("diffuse");
        declare.clears_color(self.0, Format::Rgba8Srgb, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen::default())
    }
}

/// The processes in the order of their indices, as far as they draw in the same views. A frame without reflections does
/// not know the names of processes that draw in these alone, so a process that does names the others.
fn ordered(own: &[OwnProcess]) -> Vec<Own> {
    let mut ordered: Vec<Own> = own
        .iter()
        .map(|process| Own { name: process.name(), process: process.clone(), after: Vec::new(), before: Vec::new() })
        .collect();
    for later in 0..own.len() {
        for earlier in 0..later {
            let [one, two] = [&own[earlier], &own[later]];
            let share_views = one.in_main && two.in_main || one.in_reflections && two.in_reflections;
            match share_views && one.place == two.place {
                true if one.in_main => ordered[later].after.push(one.name()),
                true => ordered[earlier].before.push(two.name()),
                false => {}
            }
        }
    }
    ordered
}

pub fn new_renderer(pipeline: &Pipeline) -> Renderer<NullBackend> {
    let maps = ShadowMaps { side: 16, max_distance: 60.0, ..ShadowMaps::default() };
    let mut deferred = Deferred::to_picture()
        .depth_pre_pass(pipeline.depth_pre_pass)
        .geometry_shares(pipeline.geometry_shares)
        .shadow_maps(Some(maps));
    if pipeline.anti_aliasing {
        deferred = deferred.post(Fxaa::default());
    }
    if pipeline.shows_diffuse {
        let target = if pipeline.anti_aliasing { "post-processed 1" } else { "picture" };
        deferred = deferred.replace("tone mapping", ShowDiffuse(target));
    }
    deferred = pipeline.left_out.iter().copied().fold(deferred, Deferred::leave_out);
    deferred = pipeline.kept.iter().copied().fold(deferred, Deferred::keep);
    let mut builder = Renderer::builder(NullBackend).pipeline(deferred);
    for own in ordered(&pipeline.own) {
        if own.process.is_output {
            builder = builder.output(own.process.target());
        }
        builder = builder.process(own);
    }
    builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap().0
}

pub fn scene(world: &World) -> Scene {
    let mut scene = Scene::new();
    let mesh = scene.add(cube()).unwrap();
    scene.add(cube()).unwrap();
    let material = |Object { blended, has_type }: Object| Material {
        blend: if blended { Blend::Alpha } else { Blend::None },
        values: has_type.then(|| GLOW.values([1.0; 4])),
        ..Material::default()
    };
    for unused in &world.unused {
        scene.add(material(*unused)).unwrap();
    }
    for (object, x) in world.objects.iter().zip(0..) {
        let material = scene.add(material(*object)).unwrap();
        scene.add_object(RenderObject::new(mesh, material, DVec3::new(f64::from(x), 0.0, 0.0))).unwrap();
    }
    scene.lights = world.lights.iter().map(light).collect();
    scene.cameras = world.cameras.iter().map(camera).collect();
    scene
}

fn light(light: &LightSpec) -> Light {
    let LightSpec { kind, casts_shadow, is_on, range, position } = *light;
    let (position, direction) = (DVec3::from_array(position), Vec3::NEG_Y);
    let intensity = if is_on { Vec3::ONE } else { Vec3::ZERO };
    match kind {
        LightKindSpec::Directional => Light::Directional { direction, illuminance: intensity, casts_shadow },
        LightKindSpec::Point => Light::Point { position, intensity, range, casts_shadow },
        LightKindSpec::Spot => {
            Light::Spot { position, direction, intensity, range, inner_angle: 0.3, outer_angle: 0.5, casts_shadow }
        }
        LightKindSpec::Hemispherical => Light::Hemispherical { position, direction, intensity, range, casts_shadow },
    }
}

fn camera(camera: &CameraSpec) -> Camera {
    let position = DVec3::new(0.0, 0.0, camera.z);
    let ahead = if camera.looks_down { DVec3::NEG_Z } else { DVec3::Z };
    let kind = if camera.is_reflection { ViewKind::Reflection } else { ViewKind::Main };
    Camera { kind, ..sized(Camera::looking_at(camera.name, position, position + ahead), [32, 32]) }
}
