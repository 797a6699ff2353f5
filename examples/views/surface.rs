//! Surfaces that show other views: a pool that mirrors, a portal, and a screen.

use drawloom::command::Selection;
use drawloom::process::{
    CommandDraws, CpuShader, Declare, Draws, InjectionPoint, ObjectCpuShader, ObjectPixel, PassInputs, RenderProcess,
    ShaderObject, VARYINGS, VertexInput, VertexOutput, targets,
};
use drawloom::raster::{Real, Vector, Vector3, Vector4};
use drawloom::scene::{LayerMask, ViewKind};

/// What a surface does with the other view's picture.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Show {
    /// Mirrors it, the more the flatter it is looked at.
    Pool,
    /// Shows it at the same pixel.
    Portal,
    /// Stretches it over the surface.
    Screen,
}

/// A process that draws the objects of a layer with the picture of another view.
#[derive(Clone)]
pub struct Surface {
    /// The name of the process and of the view.
    name: &'static str,
    layer: u32,
    show: Show,
    shader: String,
}

impl Surface {
    /// The layer of everything that is no surface.
    pub const WORLD: LayerMask = LayerMask::layer(0);

    pub fn pool() -> Self {
        Self::new("pool", 1, Show::Pool)
    }

    pub fn portal() -> Self {
        Self::new("portal", 2, Show::Portal)
    }

    /// The other end of the portal. No camera looks through it from here.
    pub fn exit() -> Self {
        Self::new("portal's exit", 3, Show::Portal)
    }

    pub fn screen() -> Self {
        Self::new("screen", 4, Show::Screen)
    }

    pub fn all() -> [Self; 4] {
        [Self::pool(), Self::portal(), Self::exit(), Self::screen()]
    }

    pub fn layer(&self) -> LayerMask {
        LayerMask::layer(self.layer)
    }

    fn new(name: &'static str, layer: u32, show: Show) -> Self {
        let shader = format!("const SHOW: u32 = {}u;\n{}", show as u32, include_str!("surface.wgsl"));
        Self { name, layer, show, shader }
    }
}

impl RenderProcess for Surface {
    fn name(&self) -> &str {
        self.name
    }

    fn declare(&self, declare: &mut Declare) {
        declare.also_views(ViewKind::Reflection);
        declare.at(InjectionPoint::AfterLighting);
        declare.samples_view(ViewKind::Reflection, self.name, targets::RADIANCE);
        declare.draws_over(targets::RADIANCE);
        // The pipeline has drawn the surface as a black object.
        declare.matches_depth(targets::DEPTH);
        // Surfaces change the same target, in any order.
        if let Some(before) = Self::all().iter().position(|other| other.name == self.name).filter(|index| *index > 0) {
            declare.after(Self::all()[before - 1].name);
        }
    }

    fn draws(&self) -> Draws<'_> {
        let selection = Selection::ALL.in_layers(self.layer());
        Draws::Commands(CommandDraws { shader: &self.shader, selection, ..CommandDraws::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(self.clone()))
    }
}

impl<R: Real> ObjectCpuShader<R> for Surface {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        let relative = object.relative_position(vertex.position);
        let normal = object.world_normal(vertex.normal);
        let mut varyings = [R::zero(); VARYINGS];
        varyings[..3].copy_from_slice(&relative.0);
        varyings[3..6].copy_from_slice(&normal.0);
        varyings[6..8].copy_from_slice(&vertex.uv.0);
        VertexOutput { clip: pass.view.clip_position(relative), varyings }
    }

    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let [rx, ry, rz, nx, ny, nz, u, v, ..] = pixel.varyings;
        let (other, view) = (pass.sampled[0], pass.view.size);
        let size = other.size();
        // From the share of the picture to the nearest pixel of the other view.
        let nearest = |share: R, axis: usize| ((share.as_f64() * size[axis] as f64) as usize).min(size[axis] - 1);
        let share = |axis: usize| R::of((pixel.coordinates[axis] as f64 + 0.5) / view[axis] as f64);
        let [x, y] = match self.show {
            Show::Pool => [R::one() - share(0), share(1)],
            Show::Portal => [share(0), share(1)],
            Show::Screen => [u, v],
        };
        let shown = other.load([nearest(x, 0), nearest(y, 1)], 0);
        let missing = Vector([0.02, 0.01, 0.05].map(R::of));
        let is_there = shown[3] > R::zero();
        let color: Vector3<R> = if is_there { Vector([shown[0], shown[1], shown[2]]) } else { missing };
        let color = if self.show == Show::Pool {
            let to_eye = pass.view.direction_to_eye(Vector([rx, ry, rz]));
            let facing = to_eye.dot(Vector([nx, ny, nz])).max(R::zero());
            let grazing = R::one() - facing;
            let reflected = R::of(0.25) + R::of(0.75) * grazing * grazing * grazing;
            Vector([0.01, 0.03, 0.035].map(R::of)) * (R::one() - reflected) + color * reflected
        } else {
            color
        };
        targets[0] = Vector([color[0], color[1], color[2], R::one()]);
        true
    }
}
