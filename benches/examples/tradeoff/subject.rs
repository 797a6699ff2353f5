//! What is drawn: a scene, and the mirrors and the impostor that some scenes have.

use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Camera, ClipPlane, LayerMask, MaterialType, ObjectHandle, Redraw, Scene, SceneError, SceneRef};

use crate::configuration::Configuration;

/// A scene under test.
pub struct Subject {
    pub scene: Scene,
    /// The planes of the [`MIRRORS`], in their order; empty if the scene has none.
    pub mirrors: Vec<ClipPlane>,
    pub impostor: Option<ImpostorSquare>,
}

/// The mirrors, by the names of their views. The objects that show them are in layers of their own.
pub const MIRRORS: [(&str, LayerMask); 2] = [("mirror", LayerMask::layer(1)), ("pool", LayerMask::layer(2))];

/// The name of the impostor's view.
pub const IMPOSTOR: &str = "impostor";

/// The layer of what the impostor stands for.
pub const ORIGINAL: LayerMask = LayerMask::layer(3);

/// The layer of the impostor's square.
pub const SQUARE: LayerMask = LayerMask::layer(4);

/// The layer of what is lit and casts no shadow: wide ground would fill the maps.
pub const NO_CASTER: LayerMask = LayerMask::layer(5);

/// The material type of the impostor's square, so that the pipeline does not draw it.
pub const SQUARE_TYPE: MaterialType<u32> = MaterialType::new("impostor");

/// Width and height of the impostor's picture, in pixels.
const IMPOSTOR_SIDE: u32 = 256;

/// A square that shows the picture of what is within a sphere.
pub struct ImpostorSquare {
    pub center: DVec3,
    pub radius: f64,
    pub square: ObjectHandle,
}

impl ImpostorSquare {
    /// The camera of its picture for what `viewer` sees, which is that of the frame before while its error is within
    /// the limit, in degrees. `None` if the viewer is inside of the sphere.
    pub fn camera(&self, viewer: &Camera, before: Option<&Camera>, degrees: f64) -> Option<Camera> {
        let sphere = (self.center, self.radius);
        let camera = viewer.impostor(IMPOSTOR, sphere, IMPOSTOR_SIDE, before, degrees.to_radians())?;
        Some(Camera { layers: ORIGINAL, redraw: Redraw::OnCameraChange, ..camera })
    }
}

impl Subject {
    /// A scene without mirrors and impostors.
    pub fn of_scene(scene: Scene) -> Self {
        Self { scene, mirrors: Vec::new(), impostor: None }
    }

    /// The cameras of a mirror's picture, for what a camera sees.
    pub fn mirror_cameras(&self, camera: &Camera) -> Vec<Camera> {
        let surfaces = MIRRORS.iter().fold(SQUARE.0, |layers, (_, surface)| layers | surface.0);
        let reflected = |(plane, (name, _)): (&ClipPlane, &(&str, LayerMask))| {
            let reflected = camera.reflected(name, *plane);
            Camera { layers: LayerMask(camera.layers.0 & !surfaces), ..reflected }
        };
        self.mirrors.iter().zip(&MIRRORS).map(reflected).collect()
    }

    /// The cameras of a frame, and the impostor's among them. Turns the impostor's square towards that. `before` is the
    /// impostor's camera in the frame before.
    ///
    /// # Errors
    /// If the scene lacks the impostor's square.
    pub fn cameras(
        &mut self,
        camera: &Camera,
        configuration: &Configuration,
        before: Option<&Camera>,
    ) -> Result<(Vec<Camera>, Option<Camera>), SceneError> {
        let picture = match (&self.impostor, configuration.impostor) {
            (Some(impostor), Some(degrees)) => impostor.camera(camera, before, degrees),
            _ => None,
        };
        let hidden = if picture.is_some() { ORIGINAL } else { SQUARE };
        let layers = if self.impostor.is_some() { LayerMask(camera.layers.0 & !hidden.0) } else { camera.layers };
        let mut cameras = vec![Camera { layers, ..camera.clone() }];
        cameras.extend(configuration.level().cameras(&self.mirror_cameras(camera)));
        if let Some((impostor, picture)) = self.impostor.as_ref().zip(picture.as_ref()) {
            let mut square = self.scene.object(impostor.square)?;
            square.orientation = picture.orientation;
            let half_width = picture.impostor_half_width(impostor.center) as f32;
            square.scale = Vec3::new(half_width, half_width, 1.0);
            self.scene.replace_object(impostor.square, square)?;
            cameras.push(picture.clone());
        }
        Ok((cameras, picture))
    }

    /// The scene with these cameras alone.
    pub fn with_cameras<'a>(&'a self, cameras: &'a [Camera]) -> SceneRef<'a> {
        SceneRef { cameras, ..self.scene.as_scene_ref() }
    }
}
