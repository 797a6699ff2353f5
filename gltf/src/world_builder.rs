//! Builds a world of the parts of a file.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use drawloom::glam::{DAffine3, DVec3, Mat4, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Bounds, Material, Mesh, RenderObject, Scene, SceneRef};

use crate::attributes::{DEFORMED, Pose, RIGID};
use crate::cameras::{framing_camera, read_camera};
use crate::element::{Element, Kind};
use crate::error::{Problem, excerpt};
use crate::images::NamedImage;
use crate::json::Json;
use crate::lights::{default_light, leave_out_shadow, read_light};
use crate::limits::GltfLimits;
use crate::materials::ReadMaterial;
use crate::parts::Parts;
use crate::poses::{Posed, Poses, Posing};
use crate::primitives::Primitive;
use crate::surface_kind::SurfaceKind;
use crate::textures::add_textures;
use crate::warnings::Warnings;
use crate::world::World;

/// A world that is being built.
pub(crate) struct WorldBuilder<'a, 'w> {
    parts: &'a Parts<'a>,
    warnings: &'w mut Warnings,
    scene: Scene,
    bounds: Vec<Bounds>,
    of_objects: Vec<Pose>,
    poses: Poses,
    surfaces: BTreeSet<(SurfaceKind, bool)>,
    materials: BTreeMap<Option<usize>, (Handle<Material>, SurfaceKind)>,
    /// The primitives of each mesh: each with its mesh in the scene.
    meshes: BTreeMap<usize, Vec<(&'a Primitive, Handle<Mesh>)>>,
    cameras: usize,
}

impl<'a, 'w> WorldBuilder<'a, 'w> {
    /// Adds meshes, textures within the limits, and materials. `morphs` has the numbers of all morph targets.
    ///
    /// # Errors
    /// If a limit is exceeded.
    pub(crate) fn new(
        parts: &'a Parts<'a>,
        morphs: Vec<f32>,
        (images, limits): (&BTreeMap<usize, Arc<NamedImage>>, &GltfLimits),
        warnings: &'w mut Warnings,
    ) -> Result<Self, Problem> {
        let (mut scene, poses) = (Scene::new(), Poses { morphs, ..Poses::default() });
        let used = parts.materials.values().flat_map(|material| material.textures).flatten();
        let textures = add_textures(&mut scene, used, images, limits, warnings)?;
        let mut materials = BTreeMap::new();
        for (&index, ReadMaterial { name, surface, textures: used }) in &parts.materials {
            let kind = match (surface.is_masked(), surface.is_blended()) {
                (true, _) => SurfaceKind::Masked,
                (false, true) => SurfaceKind::Blended,
                (false, false) => SurfaceKind::Opaque,
            };
            let of_material = used.map(|used| textures.get(&used?).copied());
            let added = scene.add(surface.into_material(name.clone(), of_material)).map_err(Problem::of_scene(name));
            let added = warnings.keep(added, "a material is left out")?;
            materials.extend(added.map(|material| (index, (material, kind))));
        }
        let mut meshes = BTreeMap::new();
        for (&index, primitives) in &parts.primitives {
            let mut of_mesh = Vec::new();
            for primitive in primitives {
                let added = scene.add(primitive.mesh.clone()).map_err(Problem::of_scene(&primitive.mesh.name()));
                let added = warnings.keep_shape(added, "a primitive is left out")?;
                of_mesh.extend(added.map(|mesh| (primitive, mesh)));
            }
            meshes.insert(index, of_mesh);
        }
        let (bounds, of_objects, surfaces) = (Vec::new(), Vec::new(), BTreeSet::new());
        Ok(Self { parts, warnings, scene, bounds, of_objects, poses, surfaces, materials, meshes, cameras: 0 })
    }

    /// Adds an object for each primitive of each node's mesh.
    ///
    /// # Errors
    /// If a limit is exceeded, or all that there is to draw is lost.
    pub(crate) fn add_objects(&mut self) -> Result<(), Problem> {
        let parts = self.parts;
        let mut nodes = Vec::new();
        for (node, world) in &parts.nodes {
            // What is no mesh is named already.
            let mesh = parts.source.member(node, "mesh", Kind::Mesh).ok().flatten();
            let Some(mesh) = mesh.filter(|mesh| self.meshes.contains_key(&mesh.index)) else { continue };
            // All of them before the first: a file that has too many is refused at once.
            parts.source.budget.objects.take(node, self.meshes[&mesh.index].len() as u64, 1)?;
            nodes.push((*node, *world, mesh));
        }
        for (node, world, mesh) in nodes {
            self.add_objects_of(&node, world, &mesh)?;
        }
        if self.bounds.is_empty() {
            if let Some(first) = self.warnings.first_lost_shape() {
                return Err(Problem::NothingToDraw { first: first.to_owned() });
            }
            self.warnings.add("the scene has nothing to draw");
        }
        Ok(())
    }

    /// Adds the objects of a node.
    fn add_objects_of(&mut self, node: &Element<'a>, world: DAffine3, mesh: &Element<'a>) -> Result<(), Problem> {
        let parts = self.parts;
        let weights = self.weights_of(node, mesh)?;
        let skin = parts.source.member(node, "skin", Kind::Skin).ok().flatten();
        let skin = skin.and_then(|skin| Some((skin, parts.skins.get(&skin.index)?)));
        if let Some((_, read)) = skin {
            let limit = &parts.source.budget.poses;
            limit.take(node, read.joints.len() as u64, size_of::<DAffine3>() as u64)?;
        }
        let joints = skin.map(|(skin, read)| {
            let place = |(node, bind): &(usize, DAffine3)| Some(parts.world[*node]? * *bind);
            let origin = read.joints.first().and_then(|(node, _)| parts.world[*node]);
            (skin, read.joints.iter().map(place).collect::<Option<Vec<_>>>().zip(origin))
        });
        for &(primitive, mesh) in &self.meshes[&mesh.index] {
            let posed_by = match &joints {
                Some((skin, joints)) => usable_skin(node, primitive, skin, joints.as_ref(), self.warnings),
                None => None,
            };
            let skin = posed_by.map(|(joints, origin)| (joints.as_slice(), origin.translation));
            let limit = &parts.source.budget.poses;
            let posing = Posing { primitive, node: *node, world, skin, weights: &weights, limit };
            let posed = self.poses.pose(&posing).and_then(|posed| checked(node, posed));
            let lost_name = format_args!("{} of {node} is not drawn", primitive.mesh.name());
            let Some(posed) = self.warnings.keep_shape(posed, lost_name)? else { continue };
            let material = self.materials.get(&primitive.material).or_else(|| self.materials.get(&None));
            let Some(&(material, kind)) = material else { continue };
            let object = RenderObject {
                position: posed.position,
                orientation: posed.orientation,
                scale: posed.scale,
                mesh,
                material,
                layers: if posed.pose.is_some() { DEFORMED } else { RIGID },
            };
            let added = self.scene.add_object(object).map_err(Problem::of_scene(node));
            if self.warnings.keep_shape(added, "an object is left out")?.is_none() {
                continue;
            }
            self.bounds.push(posed.bounds);
            self.of_objects.push(posed.pose.unwrap_or_default());
            self.surfaces.insert((kind, posed.pose.is_some()));
        }
        Ok(())
    }

    /// Adds the lights of the scene's nodes, or one if there are none.
    ///
    /// # Errors
    /// If a limit is exceeded.
    pub(crate) fn add_lights(&mut self) -> Result<(), Problem> {
        let (mut has_lights, greatest) = (false, self.parts.source.limits.lights);
        // Those beyond the limit: the first one, and how many there are.
        let mut left_out: Option<(String, u64)> = None;
        for (node, world) in &self.parts.nodes {
            let Some(extension) = node.extension("KHR_lights_punctual") else { continue };
            has_lights = true;
            let light = extension.needed_index("light");
            let light = light.and_then(|light| self.parts.source.referred(node, Kind::Light, light));
            let Some(light) = self.warnings.keep(light, format_args!("{node} has no light"))? else { continue };
            let read = read_light(&light, world, self.warnings);
            let Some(read) = self.warnings.keep(read, format_args!("{light} does not shine"))?.flatten() else {
                continue;
            };
            if (self.scene.lights.len() as u64) < greatest {
                self.scene.lights.push(read);
            } else {
                left_out.get_or_insert_with(|| (format!("{light} of {node}"), 0)).1 += 1;
            }
        }
        if let Some((first, count)) = left_out {
            let reason = format!("`GltfLimits::lights` is {greatest}");
            self.warnings.add(match count {
                1 => format!("{first} is left out: {reason}"),
                _ => format!("{count} lights are left out, and {first} is the first of them: {reason}"),
            });
        }
        let mut shadows = 0;
        for light in &mut self.scene.lights {
            shadows += usize::from(light.casts_shadow());
            if shadows > MAX_SHADOWS && leave_out_shadow(light) {
                self.warnings.add(format!("only the first {MAX_SHADOWS} directional lights and cones cast shadows"));
            }
        }
        if has_lights {
            self.scene.ambient = Vec3::splat(0.05);
        } else {
            self.scene.lights.push(default_light());
            self.scene.ambient = Vec3::splat(0.35);
        }
        self.scene.background = Vec3::new(0.03, 0.035, 0.045);
        Ok(())
    }

    /// Adds the camera that the picture is drawn with: one that frames the scene, if something is wrong with that of
    /// the file.
    ///
    /// # Errors
    /// If there is no such camera.
    pub(crate) fn add_camera(&mut self, wanted: Option<usize>, size: [u32; 2]) -> Result<(), Problem> {
        let nodes: Vec<_> = self.parts.nodes.iter().filter(|(node, _)| node.json.get("camera").is_some()).collect();
        self.cameras = nodes.len();
        let of_file = match (nodes.get(wanted.unwrap_or(0)), wanted) {
            (Some((node, world)), _) => {
                let camera = self.parts.source.member(node, "camera", Kind::Camera);
                let camera = camera.and_then(|camera| camera.ok_or_else(|| node.lacks("camera")));
                let camera = camera.and_then(|camera| read_camera(&camera, world, size, self.warnings));
                self.warnings.keep(camera, "a camera that frames the scene is drawn with, not the one of the file")?
            }
            (None, Some(index)) => {
                let (element, count) = ("the camera to be drawn with".to_owned(), nodes.len());
                return Err(Problem::IndexOutOfRange { element, index: index as u64, count, what: "cameras" });
            }
            (None, None) => None,
        };
        let camera = of_file.unwrap_or_else(|| {
            let (center, radius) = self.bounding_sphere();
            framing_camera(center, radius, size)
        });
        self.scene.cameras = vec![camera];
        Ok(())
    }

    /// The world, still without warnings.
    pub(crate) fn finish(self) -> World {
        let Poses { mut palette, mut morphs } = self.poses;
        // No buffer is empty.
        palette.push(Mat4::IDENTITY);
        morphs.push(0.0);
        let name = |animation: Element<'_>| {
            let name = animation.json.get("name").and_then(Json::as_text);
            name.map_or_else(|| animation.to_string(), excerpt)
        };
        World {
            scene: self.scene,
            bounds: self.bounds,
            poses: self.of_objects,
            palette: Arc::from(bytemuck::cast_slice(&palette)),
            morphs: Arc::from(bytemuck::cast_slice(&morphs)),
            surfaces: self.surfaces,
            warnings: Vec::new(),
            unlisted_warnings: 0,
            animations: self.parts.source.all(Kind::Animation).map(name).collect(),
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

    /// The weight of each morph target: by the animation, the node or the mesh; 0 if something is wrong with them.
    fn weights_of(&mut self, node: &Element<'_>, mesh: &Element<'_>) -> Result<Vec<f32>, Problem> {
        let count = self.parts.target_counts[mesh.index];
        self.parts.source.budget.poses.take(node, count as u64, size_of::<f32>() as u64)?;
        if let Some(weights) = self.parts.weights.get(&node.index) {
            return Ok(weights.clone());
        }
        let read = |element: &Element<'_>| -> Result<Option<Vec<f32>>, Problem> {
            if element.json.get("weights").is_none() {
                return Ok(None);
            }
            let weight = |json: &Json| json.as_number().map(|weight| weight as f32).filter(|weight| weight.is_finite());
            let Some(weights) = element.list("weights")?.iter().map(weight).collect::<Option<Vec<_>>>() else {
                return Err(Problem::invalid(element, "has `weights` that are not all numbers"));
            };
            if weights.len() != count {
                let (element, what, expected_by) = (element.to_string(), "morph weights", "morph targets".to_owned());
                return Err(Problem::UnequalCounts {
                    element,
                    what,
                    count: weights.len(),
                    expected: count,
                    expected_by,
                });
            }
            Ok(Some(weights))
        };
        let of_node = read(node);
        let of_either = of_node.and_then(|weights| weights.map_or_else(|| read(mesh), |weights| Ok(Some(weights))));
        let weights = self.warnings.keep(of_either, format_args!("{node} has morph weights of 0"))?.flatten();
        Ok(weights.unwrap_or_else(|| vec![0.0; count]))
    }
}

/// The greatest number of lights that cast shadows: each has a shadow map.
const MAX_SHADOWS: usize = 8;

/// The joints that move a primitive of a node, if they can.
fn usable_skin<'j>(
    node: &Element<'_>,
    primitive: &Primitive,
    skin: &Element<'_>,
    joints: Option<&'j (Vec<DAffine3>, DAffine3)>,
    warnings: &mut Warnings,
) -> Option<(&'j Vec<DAffine3>, DAffine3)> {
    let name = primitive.mesh.name();
    let Some(of_vertices) = &primitive.joints else {
        warnings.add(format!("{name} has no joints, and {skin} of {node} is ignored"));
        return None;
    };
    let Some((joints, origin)) = joints else {
        warnings.add(format!("{name} is drawn without {skin} of {node}, one of whose joints is in no place"));
        return None;
    };
    let (greatest, count) = (of_vertices.greatest, joints.len());
    if greatest as usize >= count {
        warnings.add(format!("{name} has the index {greatest} of {count} joints of {skin}, and is drawn without it"));
        return None;
    }
    Some((joints, *origin))
}

/// An object in a pose, if it is within the range of numbers.
fn checked(node: &Element<'_>, posed: Posed) -> Result<Posed, Problem> {
    let reach = (posed.bounds.center.abs().max_element() + posed.bounds.radius) * posed.scale.abs().max_element();
    if reach < 1e30 {
        return Ok(posed);
    }
    let reason = "brings its mesh beyond the range of numbers";
    Err(Problem::Transform { node: node.to_string(), reason })
}
