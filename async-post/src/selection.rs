//! The results that a frame shows.

use std::sync::Arc;

use drawloom::process::ShaderResource;
use parking_lot::Mutex;

use crate::view_work::{LayerTextures, StepResult};

/// The selection of the current frame: each frame replaces it, and the processes read it.
#[derive(Clone, Default)]
pub(crate) struct SharedSelection(Arc<Mutex<Selection>>);

impl SharedSelection {
    /// Replaces the selection, and returns the one before.
    pub(crate) fn replace(&self, selection: Selection) -> Selection {
        std::mem::replace(&mut self.0.lock(), selection)
    }

    pub(crate) fn get(&self) -> Selection {
        self.0.lock().clone()
    }

    /// What shaders read in all views; empty if there is nothing on the device yet.
    pub(crate) fn resources(&self) -> Vec<ShaderResource<'static>> {
        self.0.lock().resources.clone()
    }
}

/// The results that a frame shows, chosen when it begins.
#[derive(Clone, Default)]
pub(crate) struct Selection {
    /// By view.
    pub(crate) results: Vec<(String, Arc<StepResult>)>,
    /// What shaders read in all views; empty if the backend has no textures.
    resources: Vec<ShaderResource<'static>>,
}

impl Selection {
    /// `neutral` are the textures of views without a result.
    pub(crate) fn new(results: Vec<(String, Arc<StepResult>)>, neutral: Option<&LayerTextures>) -> Self {
        let resources = neutral.map_or_else(Vec::new, |neutral| {
            (0..neutral.len()).filter_map(|index| of_views(&results, neutral, index)).collect()
        });
        Self { results, resources }
    }

    /// The result that the frame shows in a view.
    pub(crate) fn result(&self, view: &str) -> Option<&Arc<StepResult>> {
        self.results.iter().find(|(name, _)| name == view).map(|(_, result)| result)
    }
}

/// One of the textures in each view.
#[cfg(feature = "wgpu")]
fn of_views(
    results: &[(String, Arc<StepResult>)],
    neutral: &LayerTextures,
    index: usize,
) -> Option<ShaderResource<'static>> {
    let texture = |resource: &ShaderResource<'static>| match resource {
        ShaderResource::Texture { view, dimension } => Some((view.clone(), *dimension)),
        _ => None,
    };
    let (other, dimension) = texture(&neutral[index])?;
    let of_result = |(name, result): &(String, Arc<StepResult>)| {
        let textures = result.textures.as_ref()?;
        Some((name.clone(), texture(&textures[index])?.0))
    };
    Some(ShaderResource::TextureOfView { views: results.iter().filter_map(of_result).collect(), other, dimension })
}

#[cfg(not(feature = "wgpu"))]
fn of_views(_: &[(String, Arc<StepResult>)], _: &LayerTextures, _: usize) -> Option<ShaderResource<'static>> {
    None
}
