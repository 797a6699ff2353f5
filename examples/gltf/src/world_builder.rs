//! Builds a world of the parts of a file.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use drawloom::glam::{DVec3, Mat4, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Bounds, Material, Mesh, RenderObject, Scene, SceneRef};

use crate::animations::target_count;
use crate::attributes::{DEFORMED, Pose, RIGID};
use crate::cameras::{framing_camera, read_camera};
use crate::error::Problem;
use crate::lights::{default_light, leave_out_shadow, read_light};
use crate::loader::Parts;
use crate::poses::Poses;
use crate::surfaces::SurfaceKind;
use crate::texture_arrays::TextureArrays;
use crate::warnings::Warnings;
use crate::world::World;

/// A world that is being built.
pub(crate) struct WorldBuilder<'a> {
    parts: &'a Parts<'a>,
    warnings: &'a mut Warnings,
    scene: Scene,
    bounds: Vec<Bounds>,
    of_objects: Vec<Pose>,
    poses: Poses,
    surfaces: BTreeSet<(SurfaceKind, bool)>,
    materials: BTreeMap<Option<usize>, (Handle<Material>, SurfaceKind)>,
    /// The mesh of each primitive, and where its morph targets begin.
    meshes: BTreeMap<usize, Vec<(Handle<Mesh>, u32)>>,
    cameras: usize,
}

impl<'a> WorldBuilder<'a> {
    /// Adds meshes and materials.
    pub(crate) fn new(
        parts: &'a Parts<'a>,
        textures: &TextureArrays,
        warnings: &'a mut Warnings,
    ) -> Result<Self, Problem> {
        let (mut scene, mut poses) = (Scene::new(), Poses::default());
        let mut materials = BTreeMap::new();
        for (&index, (name, surface)) in &parts.materials {
            let mut surface = *surface;
            surface.place_textures(|used| textures.place(used));
            let kind = match (surface.is_masked(), surface.is_blended()) {
                (true, _) => SurfaceKind::Masked,
                (false, true) => SurfaceKind::Blended,
                (false, false) => SurfaceKind::Opaque,
            };
            if kind == SurfaceKind::Masked {
                warnings.add(format!("{name}: its holes cast shadows, too"));
            }
            let material = scene.add(surface.into_material(name.clone())).map_err(Problem::of_scene(name))?;
            materials.insert(index, (material, kind));
        }
        let mut meshes = BTreeMap::new();
        for (&index, primitives) in &parts.primitives {
            let mut of_mesh = Vec::new();
            for primitive in primitives {
                let name = primitive.mesh.name();
                let mesh = scene.add(primitive.mesh.clone()).map_err(Problem::of_scene(name))?;
                of_mesh.push((mesh, poses.add_targets(primitive)));
            }
            meshes.insert(index, of_mesh);
        }
        let (bounds, of_objects, surfaces) = (Vec::new(), Vec::new(), BTreeSet::new());
        Ok(Self { parts, warnings, scene, bounds, of_objects, poses, surfaces, materials, meshes, cameras: 0 })
    }

    /// Adds an object for each primitive of each node's mesh.
    pub(crate) fn add_objects(&mut self) -> Result<(), Problem> {
        let parts = self.parts;
        for node in parts.of_scene.iter().filter_map(|&node| parts.document.nodes().nth(node)) {
            let Some(mesh) = node.mesh() else { continue };
            let weights = self.weights_of(&node, &mesh)?;
            let skin = node.skin().map(|skin| &parts.skins[skin.index()]);
            for (number, primitive) in parts.primitives[&mesh.index()].iter().enumerate() {
                if skin.is_some() && primitive.joints.is_none() {
                    let name = primitive.mesh.name();
                    self.warnings
                        .add(format!("{name} has no joints, and the skin of node {} is ignored", node.index()));
                }
                let (mesh, first_target) = self.meshes[&mesh.index()][number];
                let posed = self.poses.pose(primitive, first_target, node.index(), &parts.world, skin, &weights)?;
                let (material, kind) = self.materials[&primitive.material];
                let object = RenderObject {
                    position: posed.position,
                    orientation: posed.orientation,
                    scale: posed.scale,
                    mesh,
                    material,
                    layers: if posed.pose.is_some() { DEFORMED } else { RIGID },
                };
                self.scene.add_object(object).map_err(Problem::of_scene(&format!("node {}", node.index())))?;
                self.bounds.push(posed.bounds);
                self.of_objects.push(posed.pose.unwrap_or_default());
                self.surfaces.insert((kind, posed.pose.is_some()));
                if self.bounds.len() > MAX_OBJECTS {
                    let (element, what) = ("the scene".to_owned(), "objects or more");
                    let (count, limit) = (self.bounds.len() as u64, MAX_OBJECTS as u64);
                    return Err(Problem::TooMany { element, what, count, limit });
                }
            }
        }
        if self.bounds.is_empty() {
            self.warnings.add("the scene has nothing to draw");
        }
        Ok(())
    }

    /// Adds the lights of the scene's nodes, or one if there are none.
    pub(crate) fn add_lights(&mut self) -> Result<(), Problem> {
        for node in self.nodes() {
            if let Some(light) = node.light() {
                let world = &self.parts.world[node.index()];
                self.scene.lights.extend(read_light(node.index(), &light, world, self.warnings)?);
            }
        }
        let mut shadows = 0;
        for light in &mut self.scene.lights {
            shadows += usize::from(light.casts_shadow());
            if shadows > MAX_SHADOWS && leave_out_shadow(light) {
                self.warnings.add(format!("only the first {MAX_SHADOWS} directional lights and cones cast shadows"));
            }
        }
        let has_lights = self.nodes().any(|node| node.light().is_some());
        if has_lights {
            self.scene.ambient = Vec3::splat(0.05);
        } else {
            self.scene.lights.push(default_light());
            self.scene.ambient = Vec3::splat(0.35);
        }
        self.scene.background = Vec3::new(0.03, 0.035, 0.045);
        Ok(())
    }

    /// Adds the camera that the picture is drawn with.
    pub(crate) fn add_camera(&mut self, wanted: Option<usize>, size: [u32; 2]) -> Result<(), Problem> {
        let with_camera: Vec<_> = self.nodes().filter_map(|node| Some((node.index(), node.camera()?))).collect();
        self.cameras = with_camera.len();
        let camera = match (with_camera.get(wanted.unwrap_or(0)), wanted) {
            (Some((node, camera)), _) => read_camera(camera, &self.parts.world[*node], size, self.warnings)?,
            (None, Some(index)) => {
                let (element, count) = ("the camera to be drawn with".to_owned(), with_camera.len());
                return Err(Problem::IndexOutOfRange { element, index: index as u64, count, what: "cameras" });
            }
            (None, None) => {
                let (center, radius) = self.bounding_sphere();
                framing_camera(center, radius, size)
            }
        };
        self.scene.cameras = vec![camera];
        Ok(())
    }

    /// The world, still without warnings.
    pub(crate) fn finish(self, textures: TextureArrays) -> World {
        let Poses { mut palette, mut morphs } = self.poses;
        // No buffer is empty.
        palette.push(Mat4::IDENTITY);
        morphs.push(0.0);
        let name = |animation: gltf::Animation<'_>| {
            animation.name().map_or_else(|| format!("animation {}", animation.index()), str::to_owned)
        };
        World {
            scene: self.scene,
            bounds: self.bounds,
            poses: self.of_objects,
            palette: Arc::from(bytemuck::cast_slice(&palette)),
            morphs: Arc::from(bytemuck::cast_slice(&morphs)),
            textures,
            surfaces: self.surfaces,
            warnings: Vec::new(),
            animations: self.parts.document.animations().map(name).collect(),
            cameras: self.cameras,
        }
    }

    /// Centre and radius of a sphere around all objects.
    fn bounding_sphere(&self) -> (DVec3, f64) {
        let scene = SceneRef { bounds: &self.bounds, ..self.scene.as_scene_ref() };
        let (center, _) = scene.bounding_sphere();
        let reach = |object: usize| {
            let (bounds, scale) = (scene.bounds[object], scene.scales[object]);
            let of_object = scene.positions[object] + (scene.orientations[object] * (bounds.center * scale)).as_dvec3();
            of_object.distance(center) + f64::from(bounds.radius * scale.abs().max_element())
        };
        let radius = (0..scene.object_count()).map(reach).fold(0.0, f64::max);
        (center, if radius > 0.0 { radius } else { 1.0 })
    }

    fn nodes(&self) -> impl Iterator<Item = gltf::Node<'a>> + use<'a> {
        let parts = self.parts;
        parts.of_scene.iter().filter_map(|&node| parts.document.nodes().nth(node))
    }

    /// The weight of each morph target: by the animation, the node or the mesh.
    fn weights_of(&self, node: &gltf::Node<'_>, mesh: &gltf::Mesh<'_>) -> Result<Vec<f32>, Problem> {
        let count = target_count(node);
        let of_animation = self.parts.weights.get(&node.index()).map(Vec::as_slice);
        let Some(weights) = of_animation.or_else(|| node.weights()).or_else(|| mesh.weights()) else {
            return Ok(vec![0.0; count]);
        };
        let element = format!("node {}", node.index());
        if weights.len() != count {
            let (what, expected_by) = ("morph weights".to_owned(), "morph targets".to_owned());
            return Err(Problem::UnequalCounts { element, what, count: weights.len(), expected: count, expected_by });
        }
        match weights.iter().position(|weight| !weight.is_finite()) {
            Some(index) => Err(Problem::NotFinite { element: format!("the morph weights of {element}"), index }),
            None => Ok(weights.to_vec()),
        }
    }
}

/// The greatest number of lights that cast shadows: each has a shadow map.
const MAX_SHADOWS: usize = 8;

/// The greatest number of objects.
const MAX_OBJECTS: usize = 1 << 21;
