//! The lights that reach a view, as shaders read them.

use std::ops::Range;

use super::{GpuLight, RenderView};
use crate::scene::{Light, LightKind, ViewKind};

/// The lights that reach one view, those of one class beside each other: so that all of a class are one instanced draw.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightTable {
    records: Vec<GpuLight>,
    /// The class and the index of each light that reaches the view, on the way to its record.
    reaching: Vec<(usize, usize)>,
    /// For each light, its shadow map's view.
    maps: Vec<Option<usize>>,
    /// By [`LightClass::index`].
    ranges: [Range<u32>; LightClass::COUNT],
}

/// What lights are drawn together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LightClass {
    /// What kind they are.
    pub kind: LightKind,
    /// Whether objects keep them from what is behind.
    pub shadowed: bool,
}

impl LightClass {
    /// How many classes there can be: every [`LightClass::index`] is below it.
    pub const COUNT: usize = 2 * LightKind::ALL.len();

    /// The class of a light. Without `shadows`, lights that cast some are as those that do not.
    pub fn of(light: &Light, shadows: bool) -> Self {
        Self { kind: light.kind(), shadowed: shadows && light.casts_shadow() }
    }

    /// All of them.
    pub fn all() -> impl Iterator<Item = Self> {
        LightKind::ALL.into_iter().flat_map(|kind| [false, true].map(|shadowed| Self { kind, shadowed }))
    }

    /// The class as a number to index by.
    pub fn index(self) -> usize {
        self.kind as usize * 2 + usize::from(self.shadowed)
    }
}

impl LightTable {
    /// Fills in the lights that `view` may see the light of, in the order of the scene within each class. With `shadows`,
    /// those that cast some are classes of their own, and have their map if one of `views` is it. A shadow map itself is lit
    /// by nothing.
    pub fn fill(&mut self, view: &RenderView, lights: &[Light], views: &[RenderView], shadows: bool) {
        self.records.clear();
        self.reaching.clear();
        self.ranges = Default::default();
        if view.kind() == ViewKind::Shadow {
            return;
        }
        self.maps.clear();
        self.maps.resize(if shadows { lights.len() } else { 0 }, None);
        for (index, map) in views.iter().enumerate() {
            if let Some(place) = map.valid_light.and_then(|light| self.maps.get_mut(light)) {
                *place = Some(index);
            }
        }
        let mut counts = [0; LightClass::COUNT];
        for (index, light) in lights.iter().enumerate() {
            if light.reach().is_none_or(|(center, radius)| view.frustum.intersects_sphere(center, radius)) {
                let class = LightClass::of(light, shadows).index();
                counts[class] += 1;
                self.reaching.push((class, index));
            }
        }
        let origin = view.camera.position;
        // Scenes have lights of few classes, and the others are not worth a look at every light.
        for (class, _) in counts.into_iter().enumerate().filter(|(_, count)| *count > 0) {
            let start = self.records.len() as u32;
            let of_class = self.reaching.iter().filter(|(other, _)| *other == class);
            let record = |&(_, light): &(usize, usize)| {
                let map = self.maps.get(light).copied().flatten();
                GpuLight::new(&lights[light], origin, map.map(|index| &views[index]))
            };
            self.records.extend(of_class.map(record));
            self.ranges[class] = start..self.records.len() as u32;
        }
    }

    /// All of them.
    pub fn records(&self) -> &[GpuLight] {
        &self.records
    }

    /// Of each record in order: the light's index in the scene, and that of the view that draws its shadow map, if one does.
    pub fn sources(&self) -> impl Iterator<Item = (usize, Option<usize>)> {
        let of_class = |class: usize| self.reaching.iter().filter(move |(other, _)| *other == class);
        let lights = (0..LightClass::COUNT).flat_map(of_class);
        lights.map(|&(_, light)| (light, self.maps.get(light).copied().flatten()))
    }

    /// Where those of a class are among them.
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
    fn lights_are_grouped_by_class_and_those_out_of_sight_left_out() {
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
        let depths: Vec<_> = table.records().iter().map(|record| record.position.z).collect();
        assert_eq!(depths, [-4.0, -6.0, -5.0, -3.0]);
        assert_eq!(table.records()[3].shadow_layer, 7);
    }

    #[test]
    fn every_class_has_an_index_of_its_own() {
        let indices: Vec<_> = LightClass::all().map(LightClass::index).collect();
        assert_eq!(indices, (0..LightClass::COUNT).collect::<Vec<_>>());
    }
}
