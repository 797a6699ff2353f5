//! Which views have targets that are the layers of one texture.

use std::collections::{HashMap, HashSet};

use super::FramePlan;
use super::sampled_views::layer_name;
use crate::process::{Access, SampledShape};
use crate::scene::ViewKind;
use crate::view::RenderView;

/// A target of several views that are the layers of one texture, because a process
/// [samples](crate::process::Declare::samples_view_layers) them so.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ViewArray {
    /// The target's index among the [plan's](FramePlan::targets).
    pub(crate) target_index: usize,
    /// What the names of the views begin with.
    pub(crate) name: String,
    /// What shaders see of it.
    pub(crate) shapes: Vec<SampledShape>,
    /// For each layer the index of its view; `None` for a view that the frame does not have.
    pub(crate) view_indices: Vec<Option<usize>>,
}

impl ViewArray {
    /// Whether it can have the texture of an array of the same target in the frame before, with what the layers hold:
    /// both have the same name and shapes, and no view that had a layer is gone, because the layer would still hold its
    /// picture. Otherwise its texture is a new one, and all its views must be drawn.
    pub(crate) fn keeps_texture_of(&self, before: &Self) -> bool {
        let is_gone = |(before, now): (&Option<usize>, &Option<usize>)| before.is_some() && now.is_none();
        let is_alike = (&self.name, &self.shapes) == (&before.name, &before.shapes);
        let has_same_layers = self.view_indices.len() == before.view_indices.len();
        is_alike && has_same_layers && !before.view_indices.iter().zip(&self.view_indices).any(is_gone)
    }
}

impl FramePlan {
    /// The arrays of a frame with these views, those that have at least one of them.
    pub(crate) fn view_arrays(&self, views: &[RenderView]) -> Vec<ViewArray> {
        let mut arrays: Vec<ViewArray> = Vec::new();
        for planned in self.processes() {
            for &(target_index, access) in &planned.targets.accesses {
                let Access::SampleView(kind, index) = access else { continue };
                let sampled = &planned.declaration.sampled_views[index];
                // Of another kind if no process draws the views that it samples.
                if sampled.shape == SampledShape::Picture || self.targets()[target_index].views != kind {
                    continue;
                }
                let layer_count = sampled.shape.view_count();
                for (name, view_indices) in numbered_views(views, kind, &sampled.name, layer_count) {
                    let known =
                        arrays.iter_mut().find(|array| (array.target_index, &array.name) == (target_index, &name));
                    let Some(array) = known else {
                        arrays.push(ViewArray { target_index, name, shapes: vec![sampled.shape], view_indices });
                        continue;
                    };
                    if !array.shapes.contains(&sampled.shape) {
                        array.shapes.push(sampled.shape);
                    }
                    if array.view_indices.len() < view_indices.len() {
                        array.view_indices = view_indices;
                    }
                }
            }
        }
        arrays
    }
}

/// The arrays that views of this kind form under the name `sampled`: the shared one, and one for each parent view. Each
/// has its full name and, by layer, the index of a view.
fn numbered_views(
    views: &[RenderView],
    kind: ViewKind,
    sampled: &str,
    layer_count: u32,
) -> Vec<(String, Vec<Option<usize>>)> {
    let layers: HashMap<String, u32> = (0..layer_count).map(|layer| (layer_name(sampled, layer), layer)).collect();
    let mut found: Vec<(String, Vec<Option<usize>>)> = Vec::new();
    let mut known = HashSet::new();
    for (index, view) in views.iter().enumerate().filter(|(_, view)| view.kind() == kind) {
        let Some((name, number)) = view.name().rsplit_once('/') else { continue };
        let Some(parent) = name.strip_suffix(sampled).filter(|parent| parent.is_empty() || parent.ends_with('/'))
        else {
            continue;
        };
        let layer = layers.get(&view.name()[parent.len()..]).copied();
        // Of views with the same name the first is sampled.
        let Some(layer) = layer.filter(|_| known.insert((name, number))) else { continue };
        let array = match found.iter().position(|(other, _)| other == name) {
            Some(array) => array,
            None => {
                found.push((name.to_owned(), vec![None; layer_count as usize]));
                found.len() - 1
            }
        };
        found[array].1[layer as usize] = Some(index);
    }
    found
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::Camera;

    #[test]
    fn an_array_keeps_the_texture_of_one_with_the_same_shapes_and_all_of_its_views() {
        let array = |layers: &[u32], views: &[Option<usize>]| {
            let shapes = layers.iter().map(|layers| SampledShape::Layers(*layers)).collect();
            ViewArray { target_index: 1, name: "probe".to_owned(), shapes, view_indices: views.to_vec() }
        };
        let before = array(&[2], &[Some(3), None]);
        assert!(before.keeps_texture_of(&before));
        // The view of a layer may come, and have another index.
        assert!(array(&[2], &[Some(0), Some(3)]).keeps_texture_of(&before));
        assert!(!array(&[2], &[None, Some(3)]).keeps_texture_of(&before));
        // A view of a layer that only a larger array has.
        let larger = array(&[2, 4], &[Some(3), None, None, Some(4)]);
        assert!(!larger.keeps_texture_of(&before) && !before.keeps_texture_of(&larger));
        assert!(!array(&[4], &[Some(3), None, None, None]).keeps_texture_of(&larger));
        assert!(!ViewArray { name: "other".to_owned(), ..before.clone() }.keeps_texture_of(&before));
    }

    #[test]
    fn numbered_views_are_layers_by_what_their_names_begin_with() {
        let view = |name: &&str| {
            let kind = if *name == "main/probe/1" { ViewKind::Main } else { ViewKind::Reflection };
            RenderView::new(&Camera { kind, ..Camera::looking_at(*name, DVec3::Z, DVec3::ZERO) })
        };
        let names =
            ["probe/2", "a/probe/0", "probe/0", "probe/0", "probe/3", "probe/01", "probe", "aprobe/0", "main/probe/1"];
        let views: Vec<_> = names.iter().map(view).collect();
        let found = numbered_views(&views, ViewKind::Reflection, "probe", 3);
        let expected = [("probe", vec![Some(2), None, Some(0)]), ("a/probe", vec![Some(1), None, None])];
        assert_eq!(found, expected.map(|(name, views)| (name.to_owned(), views)));
    }
}
