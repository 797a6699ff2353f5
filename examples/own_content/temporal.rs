//! Temporal anti-aliasing: motion vectors from where each object was in the frame before, and the filtered picture of
//! that frame.

use drawloom::command::Selection;
use drawloom::glam::Mat4;
use drawloom::process::{
    ClearColor, CommandDraws, Declare, Draws, Format, FullScreen, InjectionPoint, RenderProcess, Target, targets,
};
use drawloom::scene::{Camera, PREVIOUS_OBJECTS};
use drawloom::view::RenderView;
use parking_lot::Mutex;

use crate::metal;

const MOTION: Target = Target::new("motion");

/// Draws how far each pixel's surface has moved since the last frame, in fractions of the picture.
#[derive(Default)]
pub struct Motion {
    frame: Mutex<Frame>,
}

/// The camera of the frame before, as the shader reads it, and the camera of this frame.
#[derive(Default)]
struct Frame {
    previous: PreviousCamera,
    camera: Option<Camera>,
}

#[derive(Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct PreviousCamera {
    clip_from_relative: Mat4,
    /// From the previous camera to this one.
    camera_moved: [f32; 4],
}

impl Motion {
    /// Takes note of the camera of the next frame.
    pub fn begin_frame(&self, camera: &Camera) {
        let mut frame = self.frame.lock();
        let previous = frame.camera.replace(camera.clone()).unwrap_or_else(|| camera.clone());
        frame.previous = PreviousCamera {
            clip_from_relative: RenderView::new(&previous).clip_from_relative(),
            camera_moved: (camera.position - previous.position).as_vec3().extend(0.0).to_array(),
        };
    }
}

impl RenderProcess for Motion {
    fn name(&self) -> &str {
        MOTION.name()
    }

    fn declare(&self, declare: &mut Declare) {
        // When all opaque objects are in the depth target.
        declare.at(InjectionPoint::AfterLighting);
        declare.after(metal::NAME);
        declare.clears_color(MOTION, Format::Rg16Float, ClearColor::Value([0.0; 4]));
        declare.matches_depth(targets::DEPTH);
        declare.reads_column(PREVIOUS_OBJECTS);
    }

    fn draws(&self) -> Draws<'_> {
        let parameters = bytemuck::bytes_of(&self.frame.lock().previous).to_vec().into();
        let (shader, selection) = (include_str!("motion.wgsl"), Selection::OPAQUE);
        Draws::Commands(CommandDraws { shader, selection, parameters, ..CommandDraws::default() })
    }
}

/// A step of post-processing: mixes the picture with its own of the frame before, where that was the same surface.
pub struct TemporalFilter {
    source: String,
    target: String,
}

impl TemporalFilter {
    pub fn new(source: &str, target: &str) -> Self {
        Self { source: source.to_owned(), target: target.to_owned() }
    }
}

impl RenderProcess for TemporalFilter {
    fn name(&self) -> &str {
        "temporal filter"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples(&self.source);
        declare.samples(MOTION);
        declare.samples_previous(&self.target);
        declare.clears_color(&self.target, Format::Rgba16Float, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen { shader: include_str!("temporal.wgsl"), ..FullScreen::default() })
    }
}
