//! Views that show what each other, and themselves, held in the frame before, and an oracle of what they show.

use std::collections::HashMap;

use drawloom::backend::Backend;
use drawloom::process::{
    ClearColor, CpuShader, Declare, Draws, Format, FullScreen, FullScreenCpuShader, FullScreenPixel, PassInputs,
    RenderProcess,
};
use drawloom::raster::{Real, Vector, Vector4};
use drawloom::scene::{Camera, Redraw, Scene, ViewKind};
use drawloom::{RendererBuilder, glam::DVec3};

/// Draws a gradient, half of what the view `left` held in the frame before, and a quarter of what the view `right`
/// held, into `light`.
#[derive(Clone, Copy, Debug)]
pub struct Feedback;

impl RenderProcess for Feedback {
    fn name(&self) -> &str {
        "feedback"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.also_views(ViewKind::Reflection);
        declare.samples_view_previous(ViewKind::Reflection, "left", "light");
        declare.samples_view_previous(ViewKind::Reflection, "right", "light");
        declare.clears_color("light", Format::R32Float, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen { shader: include_str!("feedback.wgsl"), ..FullScreen::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(*self))
    }
}

impl<R: Real> FullScreenCpuShader<R> for Feedback {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let [x, y] = pixel.coordinates;
        let held = |index: usize| {
            let [width, height] = pass.sampled[index].size();
            pass.sampled[index].load([x.min(width - 1), y.min(height - 1)], 0)[0]
        };
        let own = R::of(gradient(pass.view.size[0], [x, y]));
        let red = own + held(0) * R::of(0.5) + held(1) * R::of(0.25);
        targets[0] = Vector([red, R::zero(), R::zero(), R::one()]);
        true
    }
}

/// Copies `light` to `shown`.
#[derive(Clone, Copy, Debug)]
pub struct Shown;

impl RenderProcess for Shown {
    fn name(&self) -> &str {
        "shown"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples("light");
        declare.clears_color("shown", Format::R32Float, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var light: texture_2d<f32>;

            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                return textureLoad(light, vec2<u32>(in.position.xy), 0);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(*self))
    }
}

impl<R: Real> FullScreenCpuShader<R> for Shown {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        targets[0] = pass.sampled[0].load(pixel.coordinates, 0);
        true
    }
}

/// A renderer of both processes, with the output `shown` of main views.
pub fn with_feedback<B: Backend>(builder: RendererBuilder<B>) -> RendererBuilder<B> {
    builder.process(Feedback).process(Shown).output("shown")
}

/// Frames in which views come, go, change their size and their order, and are drawn now and then.
pub fn frames() -> Vec<Scene> {
    let camera = |name: &str, kind: ViewKind, size: [u32; 2]| Camera {
        kind,
        size,
        ..Camera::looking_at(name, DVec3::Z, DVec3::ZERO)
    };
    let mut cameras = vec![
        camera("main", ViewKind::Main, [40, 30]),
        camera("left", ViewKind::Reflection, [24, 36]),
        camera("right", ViewKind::Reflection, [33, 17]),
    ];
    let index_of = |cameras: &[Camera], name: &str| cameras.iter().position(|camera| camera.name == name).unwrap();
    let mut frames = Vec::new();
    for frame in 0..14 {
        match frame {
            3 => cameras.reverse(),
            // A child of the main view takes the place of the view that all share, and sees that one and itself.
            4 => cameras.insert(1, camera("main/left", ViewKind::Reflection, [24, 36])),
            5 => {
                let right = index_of(&cameras, "right");
                cameras[right].size = [20, 18];
            }
            6 => drop(cameras.remove(index_of(&cameras, "left"))),
            // It takes the textures of a view that is gone, but not what that held.
            7 => {
                cameras.remove(index_of(&cameras, "main/left"));
                cameras.push(camera("left", ViewKind::Reflection, [24, 36]));
            }
            9 => {
                let right = index_of(&cameras, "right");
                cameras[right].redraw = Redraw::Interval(3);
            }
            // Its picture orders nothing, so it is sampled all the same.
            10 => cameras.iter_mut().for_each(|camera| camera.samples_views = false),
            _ => {}
        }
        let mut scene = Scene::new();
        scene.cameras = cameras.clone();
        frames.push(scene);
    }
    frames
}

fn gradient(width: usize, [x, y]: [usize; 2]) -> f64 {
    width as f64 / 256.0 + (x + 3 * y) as f64 / 1024.0
}

/// What a view's `light` held.
#[derive(Clone, Debug)]
struct Held {
    size: [usize; 2],
    values: Vec<f64>,
}

impl Held {
    fn zeros(size: [usize; 2]) -> Self {
        Self { size, values: vec![0.0; size[0] * size[1]] }
    }

    fn at(&self, [x, y]: [usize; 2]) -> f64 {
        self.values[y.min(self.size[1] - 1) * self.size[0] + x.min(self.size[0] - 1)]
    }
}

/// What a backend drew in a view.
#[derive(Clone, Debug)]
pub struct DrawnView {
    /// Whether the frame drew it; otherwise its targets hold what an earlier frame drew.
    pub is_drawn: bool,
    /// The values that it shows; `None` if they are not known.
    pub values: Option<Vec<f64>>,
}

/// Draws all [`frames`] with `draw`, which returns the views of each, and compares them with the oracle.
///
/// # Errors
/// If a frame cannot be drawn, or differs.
pub fn check<E: ToString>(mut draw: impl FnMut(usize, &Scene) -> Result<Vec<DrawnView>, E>) -> Result<(), String> {
    // By the names of reflections, which are unique.
    let (mut held, mut compared): (HashMap<String, Held>, usize) = (HashMap::new(), 0);
    for (frame, scene) in frames().iter().enumerate() {
        let drawn = draw(frame, scene).map_err(|error| format!("frame {frame}: {}", error.to_string()))?;
        let size_of = |camera: &Camera| camera.size.map(|pixels| pixels as usize);
        let previous = |reader: &str, name: &str| {
            let reflections = || scene.cameras.iter().filter(|camera| camera.kind == ViewKind::Reflection);
            let child = format!("{reader}/{name}");
            let found = reflections().find(|camera| camera.name == child);
            let Some(found) = found.or_else(|| reflections().find(|camera| camera.name == name)) else {
                return Held::zeros([1, 1]);
            };
            let known = held.get(&found.name).filter(|known| known.size == size_of(found));
            known.cloned().unwrap_or_else(|| Held::zeros(size_of(found)))
        };
        let mut next = HashMap::new();
        for (camera, drawn) in scene.cameras.iter().zip(&drawn) {
            let (size, [left, right]) = (size_of(camera), ["left", "right"].map(|name| previous(&camera.name, name)));
            let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
            let value = |pixel| gradient(size[0], pixel) + left.at(pixel) / 2.0 + right.at(pixel) / 4.0;
            let expected = match held.get(&camera.name).filter(|_| !drawn.is_drawn) {
                Some(held) => held.clone(),
                None => Held { size, values: pixels.map(value).collect() },
            };
            if let Some(found) = &drawn.values {
                let differs = |(found, expected): (&f64, &f64)| (found - expected).abs() > 1e-5;
                let different = found.iter().zip(&expected.values).filter(|pair| differs(*pair)).count();
                if found.len() != expected.values.len() || different > 0 {
                    return Err(format!("frame {frame}: {different} pixels of view {:?} differ", camera.name));
                }
                compared += found.len();
            }
            next.insert(camera.name.clone(), expected);
        }
        held = next;
    }
    if compared > 5_000 { Ok(()) } else { Err(format!("only {compared} pixels are compared")) }
}
