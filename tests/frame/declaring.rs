//! A process that declares what a function says.

use drawloom::process::{ClearColor, Declare, Draws, Format, FullScreen, RenderProcess};
use drawloom::scene::ViewKind;

/// A process with a name, and a function that declares. It draws a triangle over the whole picture.
pub struct Declaring(&'static str, Box<dyn Fn(&mut Declare) + Send + Sync>);

impl Declaring {
    pub fn new(name: &'static str, declare: impl Fn(&mut Declare) + Send + Sync + 'static) -> Self {
        Self(name, Box::new(declare))
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
        self.0
    }

    fn declare(&self, declare: &mut Declare) {
        (self.1)(declare);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen::default())
    }
}
