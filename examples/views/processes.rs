//! The processes that draw the gallery.

use drawloom::RendererBuilder;
use drawloom::backend::Backend;
use drawloom::process::{Deferred, ToneMapping};
use drawloom::view::ShadowMaps;

use crate::contact_sheet::{self, ContactSheetRow};
use crate::impostor::Impostor;
use crate::mirror_ball::MirrorBall;
use crate::smoke::{self, Smoke, UpsampledSmoke};
use crate::surface::Surface;

/// Adds them to a renderer.
pub fn add_to<B: Backend>(builder: RendererBuilder<B>) -> RendererBuilder<B> {
    let shadow_maps = ShadowMaps { side: 512, max_distance: 30.0, cascades: 3, ..ShadowMaps::default() };
    let deferred = Deferred::new().shadow_maps(Some(shadow_maps)).post(ToneMapping::default());
    let builder = builder.pipeline(deferred);
    let builder = Surface::all().into_iter().fold(builder, RendererBuilder::process);
    let builder = builder.process(Impostor).process(MirrorBall);
    let builder = builder.process(Smoke::new(smoke::DIVISOR)).process(UpsampledSmoke::new(smoke::DIVISOR));
    ContactSheetRow::all().fold(builder, RendererBuilder::process).output(contact_sheet::TARGET)
}
