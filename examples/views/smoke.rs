//! Smoke that is drawn with a quarter of the pixels, and upsampled by depth.

use drawloom::command::Selection;
use drawloom::glam::{DVec3, Vec3};
use drawloom::handle::Handle;
use drawloom::process::{
    BlendEquation, ClearColor, CommandDraws, CpuShader, Declare, Draws, Format, FullScreen, FullScreenCpuShader,
    FullScreenPixel, InjectionPoint, ObjectCpuShader, ObjectPixel, PassInputs, RenderProcess, ShaderObject, ShaderView,
    Target, TargetSize, VARYINGS, VertexInput, VertexOutput, targets,
};
use drawloom::raster::{Real, Vector, Vector2, Vector4};
use drawloom::scene::{Blend, Material, MaterialType, Mesh, RenderObject, Scene, SceneError, ViewKind};

use crate::surface::Surface;

/// The smaller target.
pub const TARGET: Target = Target::new("smoke");

const SMOKE: MaterialType<u32> = MaterialType::new("smoke");

/// Adds a column of puffs.
///
/// # Errors
/// If the scene has no room for them.
pub fn add_smoke(scene: &mut Scene, ball: Handle<Mesh>) -> Result<(), SceneError> {
    let material = scene.add(Material { values: Some(SMOKE.values(0)), blend: Blend::Alpha, ..Material::default() })?;
    for index in 0..22_u16 {
        let height = 0.13 * f64::from(index);
        let turn = f64::from(index) * 2.4;
        let offset = DVec3::new(turn.cos() * (0.1 + 0.12 * height), height, turn.sin() * (0.1 + 0.12 * height));
        let mut object = RenderObject::new(ball, material, DVec3::new(-2.0, 0.9, 3.4) + offset);
        object.scale = Vec3::splat(0.3 + 0.12 * height as f32);
        object.layers = Surface::WORLD;
        scene.add_object(object)?;
    }
    Ok(())
}

/// Draws the puffs into a target that is smaller than the picture.
#[derive(Clone)]
pub struct Smoke {
    divisor: u32,
    shader: String,
}

impl Smoke {
    /// In a target of a `divisor`-th of the picture's width and height.
    pub fn new(divisor: u32) -> Self {
        Self { divisor, shader: shader(divisor, include_str!("smoke.wgsl")) }
    }
}

/// How many pixels of the picture a pixel of the smoke is wide.
pub const DIVISOR: u32 = 2;

fn shader(divisor: u32, end: &str) -> String {
    format!("const DIVISOR: i32 = {divisor};\n{}\n{end}", include_str!("smoke_distance.wgsl"))
}

impl RenderProcess for Smoke {
    fn name(&self) -> &str {
        "smoke"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.also_views(ViewKind::Reflection);
        declare.at(InjectionPoint::AfterTransparency);
        declare.samples(targets::DEPTH);
        declare.clears_color(TARGET, Format::Rgba16Float, ClearColor::Value([0.0; 4]));
        declare.size(TARGET, TargetSize::Divided(self.divisor));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws {
            shader: &self.shader,
            selection: Selection::BLENDED.of_material_type(SMOKE),
            blend_equations: vec![BlendEquation::PREMULTIPLIED_ALPHA],
            ..CommandDraws::default()
        })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(self.clone()))
    }
}

/// Blends the smaller target over the picture.
#[derive(Clone)]
pub struct UpsampledSmoke {
    divisor: u32,
    shader: String,
}

impl UpsampledSmoke {
    /// From what [`Smoke`] with the same divisor draws.
    pub fn new(divisor: u32) -> Self {
        Self { divisor, shader: shader(divisor, include_str!("smoke_upsampled.wgsl")) }
    }
}

impl RenderProcess for UpsampledSmoke {
    fn name(&self) -> &str {
        "upsampled smoke"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.also_views(ViewKind::Reflection);
        declare.at(InjectionPoint::AfterTransparency);
        declare.samples(TARGET);
        declare.samples(targets::DEPTH);
        declare.draws_over(targets::RADIANCE);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen {
            shader: &self.shader,
            blend_equations: vec![BlendEquation::PREMULTIPLIED_ALPHA],
            ..FullScreen::default()
        })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(self.clone()))
    }
}

/// `distance_of` of the pixel of the picture with these coordinates.
fn distance_of<R: Real>(view: &ShaderView<R>, [x, y]: [usize; 2], depth: R) -> R {
    let share = |pixel: usize, size: usize| (R::of(pixel as f64) + R::of(0.5)) / R::of(size as f64) * R::of(2.0);
    let clip: Vector2<R> = Vector([share(x, view.size[0]) - R::one(), R::one() - share(y, view.size[1])]);
    view.position_from_depth(clip, depth.max(R::of(1e-9))).length().min(R::of(1000.0))
}

impl<R: Real> ObjectCpuShader<R> for Smoke {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        let relative = object.relative_position(vertex.position);
        let mut varyings = [R::zero(); VARYINGS];
        varyings[..3].copy_from_slice(&relative.0);
        varyings[3..6].copy_from_slice(&object.world_normal(vertex.normal).0);
        VertexOutput { clip: pass.view.clip_position(relative), varyings }
    }

    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let [rx, ry, rz, nx, ny, nz, ..] = pixel.varyings;
        let (relative, normal) = (Vector([rx, ry, rz]), Vector([nx, ny, nz]).normalized());
        let coordinates = pixel.coordinates.map(|coordinate| self.divisor as usize * coordinate);
        let behind = distance_of(pass.view, coordinates, pass.sampled[0].load(coordinates, 0)[0]) - relative.length();
        let facing = pass.view.direction_to_eye(relative).dot(normal).max(R::zero());
        let alpha = R::of(0.4) * facing * facing * (behind / R::of(0.3)).max(R::zero()).min(R::one());
        let up = R::of(0.5) + R::of(0.5) * normal[1];
        let color = |dark: f64, bright: f64| (R::of(dark) + R::of(bright - dark) * up) * alpha;
        targets[0] = Vector([color(0.25, 0.75), color(0.24, 0.72), color(0.3, 0.7), alpha]);
        true
    }
}

impl<R: Real> FullScreenCpuShader<R> for UpsampledSmoke {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let [smoke, depth] = [pass.sampled[0], pass.sampled[1]];
        let distance = |coordinates: [usize; 2]| distance_of(pass.view, coordinates, depth.load(coordinates, 0)[0]);
        let own = distance(pixel.coordinates);
        let position = pixel.coordinates.map(|pixel| (pixel as f64 + 0.5) / f64::from(self.divisor) - 0.5);
        let (mut sum, mut weights) = (Vector::zero(), R::zero());
        for offset in [[0, 0], [1, 0], [0, 1], [1, 1]] {
            let mut near = 1.0;
            let mut at = [0; 2];
            for axis in 0..2 {
                let first = position[axis].floor();
                let share = position[axis] - first;
                near *= if offset[axis] == 1 { share } else { 1.0 - share };
                at[axis] = ((first as i64 + offset[axis]).max(0) as usize).min(smoke.size()[axis] - 1);
            }
            let difference = (distance(at.map(|coordinate| self.divisor as usize * coordinate)) - own).abs();
            let weight = R::of(near) / (R::of(0.02) + difference) + R::of(1e-6);
            sum = sum + smoke.load(at, 0) * weight;
            weights += weight;
        }
        targets[0] = sum * (R::one() / weights);
        true
    }
}
