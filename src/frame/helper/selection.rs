//! The results that a frame shows.

use std::sync::Arc;

use parking_lot::Mutex;

use super::view_work::{HelperResult, LayerTextures};
use crate::process::ShaderResource;

/// The selection of the current frame, which the helper changes and its processes read.
#[derive(Clone, Default)]
pub(super) struct SharedSelection(Arc<Mutex<Selection>>);

impl SharedSelection {
    /// Replaces the selection, and returns the one before.
    pub(super) fn replace(&self, selection: Selection) -> Selection {
        std::mem::replace(&mut self.0.lock(), selection)
    }

    pub(super) fn get(&self) -> Selection {
        self.0.lock().clone()
    }

    /// What shaders read in all views; empty if there is nothing on the device yet.
    pub(super) fn resources(&self) -> Vec<ShaderResource<'static>> {
        self.0.lock().resources.clone()
    }
}

/// The results that a frame shows, chosen when it begins.
#[derive(Clone, Default)]
pub(super) struct Selection {
    /// By view.
    pub(super) results: Vec<(String, Arc<HelperResult>)>,
    /// What shaders read in all views; empty if the backend has no textures.
    resources: Vec<ShaderResource<'static>>,
}

impl Selection {
    /// `neutral` are the textures of views without a result.
    pub(super) fn new(results: Vec<(String, Arc<HelperResult>)>, neutral: Option<&LayerTextures>) -> Self {
        let resources = neutral.map_or_else(Vec::new, |neutral| {
            (0..neutral.len()).filter_map(|index| of_views(&results, neutral, index)).collect()
        });
        Self { results, resources }
    }

    /// The result that the frame shows in a view.
    pub(super) fn result(&self, view: &str) -> Option<&Arc<HelperResult>> {
        self.results.iter().find(|(name, _)| name == view).map(|(_, result)| result)
    }
}

/// One of the textures in each view.
#[cfg(feature = "wgpu")]
fn of_views(
    results: &[(String, Arc<HelperResult>)],
    neutral: &LayerTextures,
    index: usize,
) -> Option<ShaderResource<'static>> {
    let texture = |resource: &ShaderResource<'static>| match resource {
        ShaderResource::Texture { view, dimension } => Some((view.clone(), *dimension)),
        _ => None,
    };
    let (other, dimension) = texture(&neutral[index])?;
    let of_result = |(name, result): &(String, Arc<HelperResult>)| {
        let textures = result.textures.as_ref()?;
        Some((name.clone(), texture(&textures[index])?.0))
    };
    Some(ShaderResource::TextureOfView { views: results.iter().filter_map(of_result).collect(), other, dimension })
}

#[cfg(not(feature = "wgpu"))]
fn of_views(_: &[(String, Arc<HelperResult>)], _: &LayerTextures, _: usize) -> Option<ShaderResource<'static>> {
    None
}
