//! The lights that reach a view, in GPU layout.

use std::ops::Range;

use super::{GpuLight, RenderView};
use crate::scene::{Light, LightKind, ViewKind};

/// The lights that reach one view, grouped by class: each class is one instanced draw.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightTable {
    gpu_lights: Vec<GpuLight>,
    /// The class and the index among the frame's valid lights of each light that reaches the view.
    reaching: Vec<(usize, usize)>,
    /// For each valid light, the index of its shadow map's view.
    shadow_views: Vec<Option<usize>>,
    /// By [`LightClass::index`].
    ranges: [Range<u32>; LightClass::COUNT],
}

/// The lights that one instanced draw covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LightClass {
    /// Their kind.
    pub kind: LightKind,
    /// Whether they have shadow maps.
    pub shadowed: bool,
}

impl LightClass {
    /// The number of classes: every [`LightClass::index`] is below it.
    pub const COUNT: usize = 2 * LightKind::ALL.len();

    /// The class of a light. If `shadows` is false, no light is shadowed.
    pub fn of(light: &Light, shadows: bool) -> Self {
        Self { kind: light.kind(), shadowed: shadows && light.casts_shadow() }
    }

    /// All classes.
    pub fn all() -> impl Iterator<Item = Self> {
        LightKind::ALL.into_iter().flat_map(|kind| [false, true].map(|shadowed| Self { kind, shadowed }))
    }

    /// The class as a number to index by.
    pub fn index(self) -> usize {
        self.kind as usize * 2 + usize::from(self.shadowed)
    }
}

impl LightTable {
    /// Replaces the table by those of `lights`, the frame's valid lights, that may reach what `view` sees. Within a
    /// class, lights keep the order of the scene. If `shadows` is true, lights that cast shadows have classes of their own,
    /// and a shadow map if one of `views` draws it. The table of a shadow map is empty.
    pub fn fill(&mut self, view: &RenderView, lights: &[Light], views: &[RenderView], shadows: bool) {
        self.gpu_lights.clear();
        self.reaching.clear();
        self.ranges = Default::default();
        if view.kind() == ViewKind::Shadow {
            return;
        }
        self.shadow_views.clear();
        self.shadow_views.resize(if shadows { lights.len() } else { 0 }, None);
        for (index, map) in views.iter().enumerate() {
            if let Some(shadow_view) = map.valid_light.and_then(|light| self.shadow_views.get_mut(light)) {
                *shadow_view = Some(index);
            }
        }
        let mut counts = [0; LightClass::COUNT];
        for (index, light) in lights.iter().enumerate() {
            if light.bounding_sphere().is_none_or(|(center, radius)| view.frustum.intersects_sphere(center, radius)) {
                let class = LightClass::of(light, shadows).index();
                counts[class] += 1;
                self.reaching.push((class, index));
            }
        }
        let origin = view.camera.position;
        // Most classes are empty: iterate over all lights only for the others.
        for (class, _) in counts.into_iter().enumerate().filter(|(_, count)| *count > 0) {
            let start = self.gpu_lights.len() as u32;
            let of_class = self.reaching.iter().filter(|(other, _)| *other == class);
            let gpu_light = |&(_, light): &(usize, usize)| {
                let map = self.shadow_views.get(light).copied().flatten();
                GpuLight::new(&lights[light], origin, map.map(|index| &views[index]))
            };
            self.gpu_lights.extend(of_class.map(gpu_light));
            self.ranges[class] = start..self.gpu_lights.len() as u32;
        }
    }

    /// All lights, ordered by class.
    pub fn gpu_lights(&self) -> &[GpuLight] {
        &self.gpu_lights
    }

    /// For each of [`LightTable::gpu_lights`]: its index among the frame's valid lights, and the index of the view that
    /// draws its shadow map, if any.
    pub fn sources(&self) -> impl Iterator<Item = (usize, Option<usize>)> {
        let of_class = |class: usize| self.reaching.iter().filter(move |(other, _)| *other == class);
        let lights = (0..LightClass::COUNT).flat_map(of_class);
        lights.map(|&(_, light)| (light, self.shadow_views.get(light).copied().flatten()))
    }

    /// The range of a class within [`LightTable::gpu_lights`].
    pub fn range(&self, class: LightClass) -> Range<u32> {
        self.ranges[class.index()].clone()
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;
    use crate::scene::Camera;

    fn point(z: f64) -> Light {
        Light::Point { position: DVec3::Z * z, intensity: Vec3::splat(z.abs() as f32), range: 2.0 }
    }

    fn spot(z: f64, casts_shadow: bool) -> Light {
        Light::Spot {
            position: DVec3::Z * z,
            direction: Vec3::NEG_Y,
            intensity: Vec3::ONE,
            range: 1.5,
            inner_angle: 0.2,
            outer_angle: 0.4,
            casts_shadow,
        }
    }

    #[test]
    fn lights_are_grouped_by_class_and_culled() {
        let view = RenderView::new(&Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z));
        let lights = [spot(-3.0, true), point(-4.0), point(9.0), spot(-5.0, false), point(-6.0)];
        let map = RenderView {
            valid_light: Some(0),
            layer: 7,
            ..RenderView::new(&Camera::looking_at("map", DVec3::ZERO, DVec3::Y))
        };
        let mut table = LightTable::default();
        table.fill(&view, &lights, &[view.clone(), map], true);
        let class = |kind, shadowed| table.range(LightClass { kind, shadowed });
        assert_eq!(class(LightKind::Point, false), 0..2);
        assert_eq!(class(LightKind::Spot, false), 2..3);
        assert_eq!(class(LightKind::Spot, true), 3..4);
        assert!(class(LightKind::Directional, false).is_empty() && class(LightKind::Hemispherical, true).is_empty());
        let depths: Vec<_> = table.gpu_lights().iter().map(|light| light.position.z).collect();
        assert_eq!(depths, [-4.0, -6.0, -5.0, -3.0]);
        assert_eq!(table.gpu_lights()[3].shadow_layer, 7);
    }

    #[test]
    fn every_class_has_its_own_index() {
        let indices: Vec<_> = LightClass::all().map(LightClass::index).collect();
        assert_eq!(indices, (0..LightClass::COUNT).collect::<Vec<_>>());
    }
}
