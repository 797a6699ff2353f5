//! What a camera sees of a scene, computed anew for each frame.

use std::error::Error;

use drawloom::scene::{Light, SceneRef};
use drawloom::view::internal::{FixedPosition, GpuLight, GpuObject};
use drawloom::view::{GpuView, RenderView};

#[derive(Default)]
pub struct VisibleScene {
    pub view: Option<GpuView>,
    /// All objects of the scene.
    pub objects: Vec<GpuObject>,
    /// The indices of the visible ones.
    pub drawn: Vec<u32>,
    /// Bounding spheres of the visible ones, relative to the camera.
    pub spheres: Spheres,
    /// The lights that reach the view.
    pub lights: Vec<GpuLight>,
}

/// An array for each coordinate. Each is filled up to whole groups of [`Spheres::GROUP`] with spheres infinitely far
/// away.
#[derive(Default)]
pub struct Spheres {
    pub x: Vec<f32>,
    pub y: Vec<f32>,
    pub z: Vec<f32>,
    pub radii: Vec<f32>,
}

impl VisibleScene {
    /// # Errors
    /// Returns an error if there is no camera, or if something is too far from the world's origin.
    pub fn update(&mut self, scene: &SceneRef<'_>) -> Result<(), Box<dyn Error>> {
        const FAR: &str = "something is too far from the world's origin";
        let view = RenderView::new(scene.cameras.first().ok_or("there is no camera")?);
        let eye = view.camera.position;
        self.objects.clear();
        self.drawn.clear();
        self.spheres.clear();
        for object in 0..scene.object_count() {
            let (position, orientation, scale) =
                (scene.positions[object], scene.orientations[object], scene.scales[object]);
            let (position_low, position_high) = FixedPosition::new(position).ok_or(FAR)?.halves();
            self.objects.push(GpuObject {
                position_low,
                material: scene.materials[object].index(),
                position_high,
                padding: 0,
                orientation: orientation.to_array(),
                scale: scale.to_array(),
                object: object as u32,
            });
            let bounds = scene.bounds[object];
            let center = position + (orientation * (scale * bounds.center)).as_dvec3();
            let radius = bounds.radius * scale.abs().max_element();
            if view.frustum.intersects_sphere(center, radius) {
                self.drawn.push(object as u32);
                self.spheres.push((center - eye).as_vec3().to_array(), radius);
            }
        }
        self.spheres.fill_up();
        self.lights.clear();
        self.lights.extend(lights_in(scene, &view));
        self.view = Some(GpuView::new(&view, scene.ambient, self.lights.len()).ok_or(FAR)?);
        Ok(())
    }
}

/// The lights that reach a view, in the order of the scene.
pub fn lights_in(scene: &SceneRef<'_>, view: &RenderView) -> impl Iterator<Item = GpuLight> {
    let reaches = |light: &&Light| {
        light.bounding_sphere().is_none_or(|(center, radius)| view.frustum.intersects_sphere(center, radius))
    };
    scene.lights.iter().filter(reaches).map(|light| GpuLight::new(light, view.camera.position, None))
}

impl Spheres {
    pub const GROUP: usize = 8;

    fn clear(&mut self) {
        let Self { x, y, z, radii } = self;
        [x, y, z, radii].into_iter().for_each(Vec::clear);
    }

    fn push(&mut self, [x, y, z]: [f32; 3], radius: f32) {
        self.x.push(x);
        self.y.push(y);
        self.z.push(z);
        self.radii.push(radius);
    }

    fn fill_up(&mut self) {
        while !self.x.len().is_multiple_of(Self::GROUP) {
            self.push([f32::INFINITY; 3], 0.0);
        }
    }
}
