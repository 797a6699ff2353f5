//! Small scenes of any numbers, of which most are usual, and renderers on the software backend.

use std::f32::consts::PI;
use std::sync::Arc;

use arbitrary::{Arbitrary, Unstructured};
use drawloom::backend::{Picture, SoftwareBackend, SoftwareSubmission};
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::process::Deferred;
use drawloom::quality::{CullingVolume, Quality, ShadowQuality};
use drawloom::scene::{
    Blend, Bounds, Camera, Changes, ClipPlane, LayerMask, Light, Material, Mesh, StaticGroup, Projection, Scene, SceneRef,
    Texture, Topology, Vertex,
};
use drawloom::task::Scheduler;
use drawloom::{FrameError, Granularity, Renderer, RendererBuilder, Submitter};
use drawloom_testing::scenes::leveled::halved;
use drawloom_testing::scenes::{as_list, cube, culled, square};

/// The most objects of a world.
pub const MAX_OBJECTS: usize = 16;
const MAX_LIGHTS: usize = 4;
const MAX_CAMERAS: usize = 2;
const MAX_ASSETS: usize = 8;

/// A number that is mostly from −4 to 4.
#[derive(Clone, Copy, Debug)]
pub struct Number(pub f64);

const SPECIAL: [f64; 12] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    f32::MAX as f64,
    f32::MIN_POSITIVE as f64,
    1e-45,
    -0.0,
    1.0,
    4_294_967_296.0,
    1e9,
    1e-9,
];

impl<'a> Arbitrary<'a> for Number {
    fn arbitrary(input: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        let byte = i8::arbitrary(input)?;
        Ok(Self(match byte {
            -128 => f64::arbitrary(input)?,
            -127 => f32::arbitrary(input)?.into(),
            -126..-114 => SPECIAL[(i32::from(byte) + 126) as usize],
            _ => f64::from(byte) / 28.0,
        }))
    }
}

/// Three of them.
#[derive(Arbitrary, Clone, Copy, Debug)]
pub struct Vector([Number; 3]);

impl Vector {
    fn double(self) -> DVec3 {
        DVec3::from_array(self.0.map(|number| number.0))
    }

    fn single(self) -> Vec3 {
        self.double().as_vec3()
    }

    /// A direction, except where a number is special.
    fn direction(self) -> Vec3 {
        let vector = self.single();
        if vector == Vec3::ZERO { Vec3::NEG_Y } else { vector / vector.length() }
    }

    /// A colour, which has a negative channel now and then.
    fn color(self) -> Vec3 {
        let vector = self.single();
        if vector.min_element() < -3.5 { vector } else { vector.abs() }
    }
}

/// A rotation, and sometimes a quaternion that is none.
#[derive(Arbitrary, Clone, Copy, Debug)]
pub enum AnyTurn {
    Identity,
    Angles([Number; 2]),
    Quaternion([Number; 4]),
}

impl AnyTurn {
    fn build(self) -> Quat {
        match self {
            Self::Identity => Quat::IDENTITY,
            Self::Angles([yaw, pitch]) => Quat::from_rotation_y(yaw.0 as f32) * Quat::from_rotation_x(pitch.0 as f32),
            Self::Quaternion(numbers) => {
                let any = Quat::from_array(numbers.map(|number| number.0 as f32));
                if any.length_squared() > 0.1 { any / any.length() } else { any }
            }
        }
    }
}

/// A mesh. `Triangles` may be invalid.
#[derive(Arbitrary, Clone, Debug)]
pub enum AnyMesh {
    Cube,
    Square(bool),
    /// With triangle culling.
    Culled,
    /// With levels of detail.
    Leveled,
    Triangles {
        corners: Vec<[Vector; 2]>,
        is_strip: bool,
        is_culled: bool,
    },
}

impl AnyMesh {
    fn build(&self) -> Option<Mesh> {
        let topology = |is_strip| if is_strip { Topology::TriangleStrip } else { Topology::TriangleList };
        Some(match self {
            Self::Cube => cube(),
            Self::Square(is_strip) => square(topology(*is_strip)),
            Self::Culled => culled(&as_list(&cube())),
            Self::Leveled => halved(&cube()),
            Self::Triangles { corners, is_strip, is_culled } => {
                let vertex = |[position, other]: &[Vector; 2]| Vertex {
                    position: position.single().into(),
                    normal: other.direction().into(),
                    uv: [other.0[0].0 as f32, other.0[1].0 as f32],
                };
                let mut vertices: Vec<_> = corners.iter().take(12).map(vertex).collect();
                if !is_strip {
                    vertices.truncate(vertices.len() / 3 * 3);
                }
                let mesh = Mesh::new("any", topology(*is_strip), vertices, Vec::new()).ok()?;
                mesh.with_triangle_culling(*is_culled && !is_strip)
            }
        })
    }
}

/// A picture of up to 3 × 3 pixels.
#[derive(Arbitrary, Clone, Debug)]
pub struct AnyTexture {
    size: [u8; 2],
    pixel: [u8; 4],
    other: [u8; 4],
}

impl AnyTexture {
    fn build(&self) -> Texture {
        let [width, height] = self.size.map(|side| u32::from(side) % 3 + 1);
        let pixels =
            (0..width * height).flat_map(|index| if index % 2 == 0 { self.pixel } else { self.other }).collect();
        Texture::new("any", width, height, pixels).unwrap()
    }
}

#[derive(Arbitrary, Clone, Debug)]
pub struct AnyMaterial {
    diffuse: Vector,
    emission: Option<Vector>,
    opacity: Number,
    blend: u8,
    texture: Option<u8>,
    double_sided: bool,
}

#[derive(Arbitrary, Clone, Debug)]
pub struct AnyObject {
    position: Vector,
    turn: AnyTurn,
    scale: Option<Vector>,
    mesh: u8,
    material: u8,
    layers: Option<u8>,
    bounds: Option<(Vector, Number)>,
}

impl AnyObject {
    /// A cube in the middle.
    const CUBE: Self = Self {
        position: Vector([Number(0.0); 3]),
        turn: AnyTurn::Angles([Number(0.4), Number(0.3)]),
        scale: None,
        mesh: 0,
        material: 0,
        layers: None,
        bounds: None,
    };
}

#[derive(Arbitrary, Clone, Debug)]
pub struct AnyLight {
    kind: u8,
    position: Vector,
    direction: Vector,
    color: Vector,
    range: Number,
    angles: [Number; 2],
    casts_shadow: bool,
}

impl AnyLight {
    fn build(&self) -> Light {
        let Self { casts_shadow, .. } = *self;
        let (position, direction) = (self.position.double(), self.direction.direction());
        let (intensity, range) = (self.color.color(), self.range.0.abs() as f32 * 4.0);
        match self.kind % 4 {
            0 => Light::Directional { direction, illuminance: intensity, casts_shadow },
            1 => Light::Point { position, intensity, range, casts_shadow },
            2 => {
                let [inner_angle, outer_angle] = self.angles.map(|angle| angle.0.abs() as f32 * 0.4);
                let outer_angle = if outer_angle < inner_angle { inner_angle } else { outer_angle };
                Light::Spot { position, direction, intensity, range, inner_angle, outer_angle, casts_shadow }
            }
            _ => Light::Hemispherical { position, direction, intensity, range, casts_shadow },
        }
    }
}

#[derive(Arbitrary, Clone, Debug)]
pub struct AnyCamera {
    /// Relative to a point some metres in front of the world's origin.
    position: Vector,
    turn: AnyTurn,
    projection: AnyProjection,
    near: Option<Number>,
    far: Option<Number>,
    size: [u8; 2],
    layers: Option<u8>,
    clip_plane: Option<(Vector, Vector)>,
}

#[derive(Arbitrary, Clone, Debug)]
enum AnyProjection {
    Usual,
    Perspective(Number),
    Orthographic(Number),
}

impl AnyCamera {
    fn build(&self, index: usize) -> Camera {
        let position = DVec3::Z * 6.0 + self.position.double();
        let usual = Camera::looking_at(format!("camera {index}"), position, DVec3::ZERO);
        let near = self.near.map_or(0.05, |near| near.0.abs() as f32 * 0.25);
        let projection = match self.projection {
            AnyProjection::Usual => usual.projection,
            AnyProjection::Perspective(angle) => {
                Projection::Perspective { field_of_view: angle.0.abs() as f32 / 4.0 * PI }
            }
            AnyProjection::Orthographic(height) => Projection::Orthographic { height: height.0.abs() as f32 * 2.0 },
        };
        let is_perspective = matches!(projection, Projection::Perspective { .. });
        let far = if is_perspective { f32::INFINITY } else { 100.0 };
        let size = self.size.map(|side| u32::from(side) % 32);
        Camera {
            orientation: match self.turn {
                AnyTurn::Identity => usual.orientation,
                turn => turn.build(),
            },
            projection,
            near,
            far: self.far.map_or(far, |far| far.0.abs() as f32 * 10.0),
            size: if size.contains(&0) && size != [0, 0] { [19, 13] } else { size },
            layers: self.layers.map_or(LayerMask::ALL, |layers| LayerMask(layers.into())),
            clip_plane: self
                .clip_plane
                .filter(|_| is_perspective)
                .map(|(point, normal)| ClipPlane { point: point.double(), normal: normal.direction() }),
            ..usual
        }
    }
}

/// A scene as plain data.
#[derive(Arbitrary, Clone, Debug)]
pub struct AnyScene {
    meshes: Vec<AnyMesh>,
    textures: Vec<AnyTexture>,
    materials: Vec<AnyMaterial>,
    objects: Vec<AnyObject>,
    lights: Vec<AnyLight>,
    camera: AnyCamera,
    cameras: Vec<AnyCamera>,
    colors: Option<[Vector; 2]>,
}

/// What changes between two frames.
#[derive(Arbitrary, Clone, Debug)]
pub enum Change {
    Move(u8, Vector),
    Turn(u8, AnyTurn),
    Scale(u8, Vector),
    SetMesh(u8, u8),
    SetMaterial(u8, u8),
    SetLayers(u8, u8),
    AddObject(AnyObject),
    RemoveObject(u8),
    Truncate(u8),
    AddMesh(AnyMesh),
    ReplaceMesh(u8, AnyMesh),
    RemoveMesh(u8),
    ReplaceMaterial(u8, AnyMaterial),
    AddMaterial(AnyMaterial),
    RemoveMaterial(u8),
    ReplaceTexture(u8, AnyTexture),
    RemoveTexture(u8),
    AddLight(AnyLight),
    SetLight(u8, AnyLight),
    RemoveLight(u8),
    SetCamera(u8, AnyCamera),
    AddCamera(AnyCamera),
    RemoveCamera(u8),
    SetColors([Vector; 2]),
    SetStaticGroups(Vec<(u8, u8)>),
}

/// An engine's own storage of a scene.
pub struct World {
    scene: Scene,
    positions: Vec<DVec3>,
    orientations: Vec<Quat>,
    scales: Vec<Vec3>,
    bounds: Vec<Bounds>,
    object_meshes: Vec<Handle<Mesh>>,
    object_materials: Vec<Handle<Material>>,
    layers: Vec<LayerMask>,
    static_groups: Vec<StaticGroup>,
    /// Handles that objects may have; some may be stale.
    meshes: Vec<Handle<Mesh>>,
    textures: Vec<Handle<Texture>>,
    materials: Vec<Handle<Material>>,
    /// The indices of the objects that changed.
    changed: Vec<u32>,
    count_before: usize,
}

impl World {
    pub fn new(spec: &AnyScene) -> Self {
        let mut scene = Scene::new();
        let meshes = vec![scene.add(cube()).unwrap(), scene.add(square(Topology::TriangleStrip)).unwrap()];
        let pane = Material { blend: Blend::Alpha, opacity: 0.5, double_sided: true, ..Material::default() };
        let checks = (0..16).map(|byte| byte * 17).collect();
        let textures = vec![scene.add(Texture::new("checks", 2, 2, checks).unwrap()).unwrap()];
        let checked = Material { texture: Some(textures[0]), ..Material::default() };
        let materials = [checked, pane, Material::default()].map(|material| scene.add(material).unwrap()).into();
        let mut world = Self {
            scene,
            positions: Vec::new(),
            orientations: Vec::new(),
            scales: Vec::new(),
            bounds: Vec::new(),
            object_meshes: Vec::new(),
            object_materials: Vec::new(),
            layers: Vec::new(),
            static_groups: Vec::new(),
            meshes,
            textures,
            materials,
            changed: Vec::new(),
            count_before: 0,
        };
        // So that there is something to see and to change.
        world.add_object(&AnyObject::CUBE);
        spec.meshes.iter().for_each(|mesh| world.add_mesh(mesh));
        spec.textures.iter().for_each(|texture| world.add_texture(texture));
        spec.materials.iter().for_each(|material| world.add_material(material));
        spec.objects.iter().for_each(|object| world.add_object(object));
        world.add_camera(&spec.camera);
        spec.cameras.iter().for_each(|camera| world.add_camera(camera));
        spec.lights.iter().for_each(|light| world.add_light(light));
        (world.scene.ambient, world.scene.background) = (Vec3::splat(0.25), Vec3::new(0.1, 0.2, 0.3));
        if let Some(colors) = spec.colors {
            world.set_colors(colors);
        }
        world
    }

    /// The scene, of which any object may have changed.
    pub fn as_scene_ref(&self) -> SceneRef<'_> {
        SceneRef {
            positions: &self.positions,
            orientations: &self.orientations,
            scales: &self.scales,
            bounds: &self.bounds,
            meshes: &self.object_meshes,
            materials: &self.object_materials,
            layers: &self.layers,
            columns: &[],
            changes: Changes::Unknown,
            static_groups: &self.static_groups,
            ..self.scene.as_scene_ref()
        }
    }

    /// Forgets what changed.
    pub fn begin_changes(&mut self) {
        self.changed.clear();
        self.count_before = self.positions.len();
    }

    /// The objects that changed, by index.
    pub fn changed(&self) -> &[u32] {
        &self.changed
    }

    pub fn apply(&mut self, change: &Change) {
        match change {
            Change::Move(object, position) => {
                self.change_object(*object, |world, object| world.positions[object] = position.double());
            }
            Change::Turn(object, turn) => {
                self.change_object(*object, |world, object| world.orientations[object] = turn.build());
            }
            Change::Scale(object, scale) => {
                self.change_object(*object, |world, object| world.scales[object] = scale.single());
            }
            Change::SetMesh(object, mesh) => self.change_object(*object, |world, object| {
                world.object_meshes[object] = *pick(&world.meshes, *mesh);
            }),
            Change::SetMaterial(object, material) => self.change_object(*object, |world, object| {
                world.object_materials[object] = *pick(&world.materials, *material);
            }),
            Change::SetLayers(object, layers) => {
                self.change_object(*object, |world, object| world.layers[object] = LayerMask((*layers).into()));
            }
            Change::AddObject(object) => self.add_object(object),
            Change::RemoveObject(object) => self.change_object(*object, Self::remove_object),
            Change::Truncate(count) => {
                while self.positions.len() > usize::from(*count) {
                    self.remove_object(self.positions.len() - 1);
                }
            }
            Change::AddMesh(mesh) => self.add_mesh(mesh),
            Change::ReplaceMesh(index, mesh) => {
                if let Some(mesh) = mesh.build() {
                    // A stale handle replaces nothing.
                    let _ = self.scene.replace(*pick(&self.meshes, *index), mesh);
                }
            }
            Change::RemoveMesh(index) => drop(self.scene.remove(*pick(&self.meshes, *index))),
            Change::AddMaterial(material) => self.add_material(material),
            Change::ReplaceMaterial(index, material) => {
                let material = self.material(material);
                // Neither a stale handle nor an invalid material replaces anything.
                let _ = self.scene.replace(*pick(&self.materials, *index), material);
            }
            Change::RemoveMaterial(index) => drop(self.scene.remove(*pick(&self.materials, *index))),
            Change::ReplaceTexture(index, texture) => {
                if !self.textures.is_empty() {
                    let _ = self.scene.replace(*pick(&self.textures, *index), texture.build());
                }
            }
            Change::RemoveTexture(index) => {
                if !self.textures.is_empty() {
                    drop(self.scene.remove(*pick(&self.textures, *index)));
                }
            }
            Change::AddLight(light) => self.add_light(light),
            Change::SetLight(index, light) => {
                if !self.scene.lights.is_empty() {
                    let index = usize::from(*index) % self.scene.lights.len();
                    self.scene.lights[index] = light.build();
                }
            }
            Change::RemoveLight(index) => {
                if !self.scene.lights.is_empty() {
                    self.scene.lights.remove(usize::from(*index) % self.scene.lights.len());
                }
            }
            Change::SetCamera(index, camera) => {
                let index = usize::from(*index) % self.scene.cameras.len();
                self.scene.cameras[index] = camera.build(index);
            }
            Change::AddCamera(camera) => self.add_camera(camera),
            Change::RemoveCamera(index) => {
                if self.scene.cameras.len() > 1 {
                    self.scene.cameras.remove(usize::from(*index) % self.scene.cameras.len());
                }
            }
            Change::SetColors(colors) => self.set_colors(*colors),
            Change::SetStaticGroups(ranges) => self.set_static_groups(ranges),
        }
    }

    fn change_object(&mut self, object: u8, change: impl FnOnce(&mut Self, usize)) {
        if !self.positions.is_empty() {
            let object = usize::from(object) % self.positions.len();
            self.changed.push(object as u32);
            change(self, object);
        }
    }

    /// Whether the bounds of every object contain its mesh. Culling may remove others although they are in sight.
    pub fn has_true_bounds(&self) -> bool {
        self.bounds.iter().zip(&self.object_meshes).all(|(bounds, mesh)| {
            let corners = self.scene.assets().get(*mesh).map_or(&[][..], Mesh::vertices).iter();
            let (center, radius) = (bounds.center.as_dvec3(), f64::from(bounds.radius));
            corners.map(|vertex| Vec3::from(vertex.position).as_dvec3()).all(|corner| corner.distance(center) <= radius)
        })
    }

    /// Adds an object, and reports it only if one with its index was removed in the same frame.
    fn add_object(&mut self, object: &AnyObject) {
        let index = self.positions.len();
        if index == MAX_OBJECTS {
            return;
        }
        if index < self.count_before {
            self.changed.push(index as u32);
        }
        let mesh = *pick(&self.meshes, object.mesh);
        self.positions.push(object.position.double());
        self.orientations.push(object.turn.build());
        self.scales.push(object.scale.map_or(Vec3::ONE, Vector::single));
        let own = self.scene.assets().get(mesh).map_or(Bounds::default(), Mesh::bounds);
        self.bounds.push(
            object.bounds.map_or(own, |(center, radius)| Bounds { center: center.single(), radius: radius.0 as f32 }),
        );
        self.object_meshes.push(mesh);
        self.object_materials.push(*pick(&self.materials, object.material));
        self.layers.push(object.layers.map_or(LayerMask::ALL, |layers| LayerMask(layers.into())));
    }

    /// Removes an object; the last one takes its place.
    fn remove_object(&mut self, object: usize) {
        self.positions.swap_remove(object);
        self.orientations.swap_remove(object);
        self.scales.swap_remove(object);
        self.bounds.swap_remove(object);
        self.object_meshes.swap_remove(object);
        self.object_materials.swap_remove(object);
        self.layers.swap_remove(object);
    }

    fn add_mesh(&mut self, mesh: &AnyMesh) {
        if self.meshes.len() < MAX_ASSETS
            && let Some(mesh) = mesh.build()
        {
            self.meshes.push(self.scene.add(mesh).unwrap());
        }
    }

    fn add_texture(&mut self, texture: &AnyTexture) {
        if self.textures.len() < MAX_ASSETS {
            self.textures.push(self.scene.add(texture.build()).unwrap());
        }
    }

    fn add_material(&mut self, material: &AnyMaterial) {
        let material = self.material(material);
        if self.materials.len() < MAX_ASSETS
            && let Ok(material) = self.scene.add(material)
        {
            self.materials.push(material);
        }
    }

    fn material(&self, spec: &AnyMaterial) -> Material {
        let blends = [Blend::None, Blend::Alpha, Blend::Additive, Blend::Subtractive];
        let textures = &self.textures;
        Material {
            name: "any".into(),
            diffuse: spec.diffuse.color(),
            texture: spec.texture.filter(|_| !textures.is_empty()).map(|texture| *pick(textures, texture)),
            textures: Vec::new(),
            emission: spec.emission.map_or(Vec3::ZERO, Vector::color),
            opacity: (spec.opacity.0.abs() / 4.0) as f32,
            blend: *pick(&blends, spec.blend),
            // The first blend, which is none, of every second turn through them.
            alpha_cutoff: (spec.blend % 8 == 4).then_some(0.5),
            double_sided: spec.double_sided,
            values: None,
        }
    }

    fn add_light(&mut self, light: &AnyLight) {
        if self.scene.lights.len() < MAX_LIGHTS {
            self.scene.lights.push(light.build());
        }
    }

    fn add_camera(&mut self, camera: &AnyCamera) {
        let cameras = &mut self.scene.cameras;
        if cameras.len() < MAX_CAMERAS {
            // Names may repeat after one was removed.
            cameras.push(camera.build(cameras.len()));
        }
    }

    fn set_colors(&mut self, colors: [Vector; 2]) {
        [self.scene.ambient, self.scene.background] = colors.map(Vector::color);
    }

    /// Makes static groups of ranges that do not overlap.
    fn set_static_groups(&mut self, ranges: &[(u8, u8)]) {
        self.static_groups.clear();
        let mut first = 0;
        for (gap, count) in ranges.iter().take(4) {
            let start = first + u32::from(*gap) % 4;
            first = start + u32::from(*count) % 12;
            self.static_groups.push(StaticGroup::new(format!("from {start}"), (start..first).collect()));
            first += 1;
        }
    }
}

fn pick<T>(items: &[T], index: u8) -> &T {
    &items[usize::from(index) % items.len()]
}

/// One of the presets, or another combination of settings, with small shadow maps that are drawn in each frame, and
/// edges in maps of paraboloids that are divided into few.
pub fn quality(choice: u8) -> Quality {
    let preset = [Quality::balanced, Quality::exact, Quality::fast][usize::from(choice) % 3]();
    let shadows = ShadowQuality { side: 16, interval: 1, widest_edge: 30.0, ..preset.shadows };
    let culling = if choice & 0x80 == 0 { preset.culling } else { CullingVolume::OrientedBox };
    let depth_pre_pass = choice & 0x40 != 0;
    Quality { shadows, culling, depth_pre_pass, occlusion: None, ..preset }
}

/// A renderer on the software backend.
pub struct Drawer {
    pub renderer: Renderer<SoftwareBackend>,
    submitter: Submitter<SoftwareBackend>,
}

impl Drawer {
    pub fn new(
        scheduler: &Arc<Scheduler>,
        build: impl FnOnce(RendererBuilder<SoftwareBackend>) -> RendererBuilder<SoftwareBackend>,
    ) -> Self {
        let backend = SoftwareBackend::new(Arc::clone(scheduler));
        let builder = build(Renderer::builder(backend).pipeline(Deferred::to_picture()));
        let (renderer, submitter) = builder.build(Arc::clone(scheduler)).unwrap();
        Self { renderer, submitter }
    }

    pub fn with_quality(scheduler: &Arc<Scheduler>, quality: Quality) -> Self {
        Self::new(scheduler, |builder| builder.quality(quality).granularity(Granularity::Adaptive))
    }

    /// Draws a frame, or returns why it cannot be drawn unchanged.
    ///
    /// # Panics
    /// If the error is no property of the scene.
    pub fn draw(&mut self, scene: SceneRef<'_>) -> Result<Frame, String> {
        let recorded = self.renderer.record(scene).map_err(|error| check_error(&error))?;
        let views = scene.cameras.len();
        // Views that no process draws have no picture.
        Ok(Frame { submission: self.submitter.submit(recorded).unwrap().submission, views })
    }
}

/// Checks that an error is one that a scene may have, and names what it is about.
///
/// # Panics
/// If it is not.
pub fn check_error(error: &FrameError) -> String {
    let message = error.to_string();
    match error {
        FrameError::Scene(_) => {
            let names = ["camera `camera ", "ambient", "background", "static group"];
            assert!(names.iter().any(|name| message.contains(name)), "{message}");
        }
        FrameError::EmptyTarget { .. } | FrameError::Backend(_) => assert!(message.contains("\"camera "), "{message}"),
        _ => panic!("{message}"),
    }
    message
}

/// A frame that was drawn.
pub struct Frame {
    submission: SoftwareSubmission,
    views: usize,
}

impl Frame {
    /// The pictures of all cameras.
    pub fn pictures(&self) -> Vec<Picture> {
        (0..self.views).map(|view| self.submission.read(view, "picture").unwrap()).collect()
    }

    /// Checks that radiance is a number everywhere. It is infinite where lights exceed the range of half floats.
    pub fn check_radiance(&self) {
        for view in 0..self.views {
            let is_radiance = |channel: &f64| !channel.is_nan() && *channel > f64::NEG_INFINITY;
            for (pixel, radiance) in self.submission.numbers(view, "radiance").unwrap().iter().enumerate() {
                assert!(radiance[..3].iter().all(is_radiance), "{radiance:?} at pixel {pixel} of view {view}");
            }
        }
    }
}
