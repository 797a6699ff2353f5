//! A process that declares what a function says.

use drawloom::process::{ClearColor, Declare, Draws, Format, FullScreen, RenderProcess};
use drawloom::scene::ViewKind;

/// A process with a name, and a function that declares. It draws a triangle over the whole picture.
pub struct Declaring {
    name: &'static str,
    declare: Box<dyn Fn(&mut Declare) + Send + Sync>,
    shader: String,
}

impl Declaring {
    pub fn new(name: &'static str, declare: impl Fn(&mut Declare) + Send + Sync + 'static) -> Self {
        Self { name, declare: Box::new(declare), shader: String::new() }
    }

    /// Draws with a fragment shader of this text.
    #[cfg(feature = "wgpu")]
    pub fn with_shader(self, shader: String) -> Self {
        Self { shader, ..self }
    }

    /// Draws a multisampled target, in reflections too.
    pub fn multisampled() -> Self {
        Self::new("multisampled", |declare| {
            declare.also_views(ViewKind::Reflection);
            declare.clears_color("multisampled", Format::Rgba16Float, ClearColor::Value([0.0; 4]));
            declare.multisampled("multisampled");
            declare.keep();
        })
    }
}

impl RenderProcess for Declaring {
    fn name(&self) -> &str {
        self.name
    }

    fn declare(&self, declare: &mut Declare) {
        (self.declare)(declare);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen { shader: &self.shader, ..FullScreen::default() })
    }
}
