//! The lights that reach a view, in GPU layout.

use std::ops::Range;

use glam::DVec3;

use super::{GpuLight, RenderView};
use crate::scene::{Light, LightKind};

/// The lights that reach one view, grouped by class: each class is one instanced draw.
///
/// If a light of the frame has several shadow maps, one more [`GpuLight`] follows for each layer of the maps: the light
/// as that map shows it. So a light with any number of maps is as small as one with a single map.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightTable {
    gpu_lights: Vec<GpuLight>,
    /// For each layer of the shadow maps, if a light has several: the index of the light among the valid ones and of
    /// the view; `None` for a shadow camera of the engine's own.
    layers: Vec<Option<(usize, usize)>>,
    /// The class and the index among the frame's valid lights of each light that reaches the view, ordered by class.
    reaching: Vec<(usize, usize)>,
    /// For each valid light, the index of its first shadow map's view.
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
    /// class, lights keep the order of the scene. If `shadows` is true, lights that cast shadows have classes of their
    /// own, and the shadow maps that `views` draw of them. The table of a shadow map is empty.
    pub fn fill(&mut self, view: &RenderView, lights: &[Light], views: &[RenderView], shadows: bool) {
        self.fill_within(view, (lights, &[]), views, shadows, (usize::MAX, &mut Vec::new()));
    }

    /// The same with at most `capacity` of [`LightTable::gpu_lights`], as long as the layers of shadow maps are not
    /// more. The first lights of the scene have room. Adds the indices of the others that reach the view to `left_out`.
    ///
    /// Lights for which `main_views` has a main view are copies of the last one before them that is none. A copy takes
    /// the place of its light in views that [have](RenderView::main_view) the maps of that main view.
    pub(crate) fn fill_within(
        &mut self,
        view: &RenderView,
        (lights, main_views): (&[Light], &[Option<usize>]),
        views: &[RenderView],
        shadows: bool,
        (capacity, left_out): (usize, &mut Vec<usize>),
    ) {
        self.gpu_lights.clear();
        self.layers.clear();
        self.reaching.clear();
        self.ranges = Default::default();
        if !view.kind().rules().is_lit {
            return;
        }
        self.shadow_views.clear();
        let has_maps = shadows && !lights.is_empty() && views.iter().any(|map| map.valid_light.is_some());
        self.shadow_views.resize(if has_maps { lights.len() } else { 0 }, None);
        let mut has_several = false;
        for (index, map) in views.iter().enumerate().filter(|_| has_maps) {
            if let Some(shadow_view) = map.valid_light.and_then(|light| self.shadow_views.get_mut(light)) {
                has_several |= shadow_view.is_some();
                shadow_view.get_or_insert(index);
            }
        }
        if has_several {
            let maps = views.iter().enumerate().filter(|(_, map)| map.kind().rules().is_shadow_map);
            self.layers.extend(maps.map(|(index, map)| map.valid_light.map(|light| (light, index))));
        }
        let capacity = capacity.saturating_sub(self.layers.len());
        let mut counts = [0_u32; LightClass::COUNT];
        for (index, light) in lights.iter().enumerate() {
            if !is_for_view(main_views, index, view.main_view) {
                continue;
            }
            if light.bounding_sphere().is_none_or(|(center, radius)| view.frustum.intersects_sphere(center, radius)) {
                if self.reaching.len() >= capacity {
                    left_out.push(index);
                    continue;
                }
                let class = LightClass::of(light, shadows).index();
                counts[class] += 1;
                self.reaching.push((class, index));
            }
        }
        self.reaching.sort_unstable();
        let mut start = 0;
        for (class, count) in counts.into_iter().enumerate().filter(|(_, count)| *count > 0) {
            self.ranges[class] = start..start + count;
            start += count;
        }
        self.set_origin(view.camera.position, lights, views);
    }

    /// Makes the lights relative to a camera at `origin`. `lights` and `views` are those that the table is filled with.
    fn set_origin(&mut self, origin: DVec3, lights: &[Light], views: &[RenderView]) {
        let Self { gpu_lights, reaching, shadow_views, layers, .. } = self;
        gpu_lights.clear();
        gpu_lights.extend(reaching.iter().map(|&(_, light)| {
            let map = shadow_views.get(light).copied().flatten();
            GpuLight::new(&lights[light], origin, map.map(|index| &views[index]))
        }));
        gpu_lights.extend(layers.iter().map(|layer| {
            let map = |(light, map): (usize, usize)| GpuLight::new(&lights[light], origin, Some(&views[map]));
            layer.map_or_else(bytemuck::Zeroable::zeroed, map)
        }));
    }

    /// What shaders read: all lights, ordered by class, and then those by layer.
    pub fn gpu_lights(&self) -> &[GpuLight] {
        &self.gpu_lights
    }

    /// The number of lights: as many of [`LightTable::gpu_lights`] come before those by layer.
    pub fn light_count(&self) -> usize {
        self.reaching.len()
    }

    /// For each light: its index among the frame's valid lights, and the index of the view that draws its first shadow
    /// map, if any.
    pub fn sources(&self) -> impl Iterator<Item = (usize, Option<usize>)> {
        self.reaching.iter().map(|&(_, light)| (light, self.shadow_views.get(light).copied().flatten()))
    }

    /// For each of [`LightTable::gpu_lights`] by layer: the light's index among the frame's valid lights and that of
    /// the view that draws the layer; `None` for a shadow camera of the engine's own.
    pub fn layer_sources(&self) -> &[Option<(usize, usize)>] {
        &self.layers
    }

    /// For each class, by [`LightClass::index`]: where its lights end within [`LightTable::gpu_lights`]. They begin
    /// where those of the class before end.
    pub fn class_ends(&self) -> [u32; LightClass::COUNT] {
        let mut end = 0;
        self.ranges.each_ref().map(|range| {
            end = end.max(range.end);
            end
        })
    }

    /// The range of a class within [`LightTable::gpu_lights`].
    pub fn range(&self, class: LightClass) -> Range<u32> {
        self.ranges[class.index()].clone()
    }
}

/// Whether a view with the maps of this main view is lit by a light or, of its copies, by this one.
fn is_for_view(main_views: &[Option<usize>], light: usize, main_view: Option<usize>) -> bool {
    match main_views.get(light) {
        Some(Some(copy)) => main_view == Some(*copy),
        Some(None) => !main_views[light + 1..].iter().map_while(|copy| *copy).any(|copy| main_view == Some(copy)),
        None => true,
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::scene::{Camera, ViewKind};

    fn point(z: f64) -> Light {
        Light::Point { position: DVec3::Z * z, intensity: Vec3::splat(z.abs() as f32), range: 2.0, casts_shadow: false }
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
        for class in LightClass::all().filter(|class| !table.range(*class).is_empty()) {
            let index = class.index();
            let begin = if index == 0 { 0 } else { table.class_ends()[index - 1] };
            assert_eq!(table.range(class), begin..table.class_ends()[index]);
        }
        assert_eq!(table.class_ends()[LightClass::COUNT - 1], 4);
        let depths: Vec<_> = table.gpu_lights().iter().map(|light| light.position.z).collect();
        assert_eq!(depths, [-4.0, -6.0, -5.0, -3.0]);
        assert_eq!(table.gpu_lights()[3].shadow_layer, 7);
    }

    #[test]
    fn a_light_with_several_maps_is_listed_for_each_layer_too() {
        let main = RenderView::new(&Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z));
        let lamp = Light::Point { position: DVec3::Z * -4.0, intensity: Vec3::ONE, range: 2.0, casts_shadow: true };
        let lights = [spot(-3.0, true), lamp];
        let map = |valid_light, layer: u32| {
            let towards = DVec3::new(0.0, 1.0, f64::from(layer));
            let camera = Camera { kind: ViewKind::Shadow, ..Camera::looking_at("map", DVec3::ZERO, towards) };
            RenderView { valid_light, layer, ..RenderView::new(&camera) }
        };
        // The first is a camera of the engine's own.
        let views = [main.clone(), map(None, 0), map(Some(0), 1), map(Some(1), 2), map(Some(1), 3)];
        let mut table = LightTable::default();
        table.fill(&main, &lights, &views, true);
        assert_eq!((table.light_count(), table.gpu_lights().len()), (2, 6));
        assert_eq!(table.sources().collect::<Vec<_>>(), [(1, Some(3)), (0, Some(2))]);
        assert_eq!(table.layer_sources(), [None, Some((0, 2)), Some((1, 3)), Some((1, 4))]);
        for (layer, light) in [(1, &lights[0]), (2, &lamp), (3, &lamp)] {
            let expected = GpuLight::new(light, DVec3::ZERO, Some(&views[layer + 1]));
            assert_eq!((table.gpu_lights()[2 + layer], expected.shadow_layer), (expected, layer as u32));
        }
        // With a map for each light at most, there are only the lights.
        table.fill(&main, &lights, &views[..4], true);
        assert_eq!((table.gpu_lights().len(), table.layer_sources()), (2, [].as_slice()));
    }

    #[test]
    fn a_copy_of_a_light_takes_its_place_in_the_views_of_its_main_view() {
        let lights = [point(-4.0), spot(-3.0, true), spot(-3.0, true), spot(-3.0, true), point(-6.0)];
        let main_views = [None, None, Some(3), Some(7), None];
        for (main_view, expected) in [(None, 1), (Some(3), 2), (Some(7), 3), (Some(4), 1)] {
            let main = RenderView::new(&Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z));
            let view = RenderView { main_view, ..main };
            let mut table = LightTable::default();
            table.fill_within(
                &view,
                (&lights, &main_views),
                std::slice::from_ref(&view),
                true,
                (usize::MAX, &mut Vec::new()),
            );
            let found: Vec<_> = table.sources().map(|(light, _)| light).collect();
            assert_eq!(found, [0, 4, expected], "{main_view:?}");
        }
    }

    #[test]
    fn every_class_has_its_own_index() {
        let indices: Vec<_> = LightClass::all().map(LightClass::index).collect();
        assert_eq!(indices, (0..LightClass::COUNT).collect::<Vec<_>>());
    }
}
