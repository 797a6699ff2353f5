//! The loader: from a file to a world.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use drawloom::glam::DAffine3;
use drawloom::task::Scheduler;

use crate::accessors::Accessors;
use crate::animations::{pose_at, target_counts, warn_of_unknown};
use crate::document::{Source, folder_of};
use crate::element::{Element, Kind};
use crate::error::{LoadError, Problem};
use crate::files::read_file;
use crate::images::Decoding;
use crate::json::Json;
use crate::limits::{GltfLimits, Limit};
use crate::materials::{ReadMaterial, read_material};
use crate::nodes::Nodes;
use crate::parts::{Parts, PrimitivesOfMeshes};
use crate::primitives::{Primitive, read_primitive};
use crate::progress::{Progress, StepCounter};
use crate::skins::Skin;
use crate::warnings::Warnings;
use crate::world::World;
use crate::world_builder::WorldBuilder;

/// The parts of a file that are drawn.
#[derive(Clone, Debug)]
pub struct LoadOptions {
    /// The time in seconds at which the animation is; `None` for nodes where the file has them.
    pub time: Option<f64>,
    /// The index of the animation.
    pub animation: usize,
    /// The index of the camera among those of the scene; `None` for the first, or one that frames the scene if there is
    /// none.
    pub camera: Option<usize>,
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
    /// What the file may take.
    pub limits: GltfLimits,
}

impl Default for LoadOptions {
    /// All as the file has it, for a picture of 960 by 540 pixels.
    fn default() -> Self {
        Self { time: None, animation: 0, camera: None, size: [960, 540], limits: GltfLimits::default() }
    }
}

/// Loads a `.gltf` or `.glb`. Images are decoded by background jobs of the scheduler; `progress` is
/// called on this thread whenever another one is done.
///
/// What is wrong with an element of the file loses that element, and is one of the [warnings](World::warnings).
///
/// # Errors
/// If the file is not glTF 2.0, requires an extension that the loader does not know, exceeds a [limit](GltfLimits), or
/// all that its scene has to draw is lost. The error names the element.
pub fn load(
    path: &Path,
    options: &LoadOptions,
    scheduler: &Scheduler,
    progress: &mut dyn FnMut(Progress),
) -> Result<World, LoadError> {
    let scene_bytes = Limit::new("scene_bytes", options.limits.scene_bytes);
    match read_file(path, &scene_bytes) {
        Ok(bytes) => load_bytes(path, bytes, options, scheduler, progress),
        Err(problem) => Err(LoadError::new(path, problem, Vec::new(), 0)),
    }
}

/// Loads the bytes of a `.gltf` or `.glb`. Messages call it as `path`, and its URIs are relative to the folder of that.
///
/// # Errors
/// As [`load`].
pub fn load_bytes(
    path: &Path,
    bytes: Vec<u8>,
    options: &LoadOptions,
    scheduler: &Scheduler,
    progress: &mut dyn FnMut(Progress),
) -> Result<World, LoadError> {
    let mut warnings = Warnings::new(options.limits.warnings);
    let read = Source::parse(folder_of(path), bytes, &options.limits, &mut warnings)
        .and_then(|source| read(&source, options, scheduler, progress, &mut warnings));
    let unlisted_warnings = warnings.unlisted;
    let warnings = warnings.take();
    match read {
        Ok(world) => Ok(World { warnings, unlisted_warnings, ..world }),
        Err(problem) => Err(LoadError::new(path, problem, warnings, unlisted_warnings)),
    }
}

fn read(
    source: &Source,
    options: &LoadOptions,
    scheduler: &Scheduler,
    progress: &mut dyn FnMut(Progress),
    warnings: &mut Warnings,
) -> Result<World, Problem> {
    warn_of_unknown(source, warnings)?;
    let mut nodes = Nodes::new(source, warnings)?;
    let of_scene = nodes.of_scene(source, source.scene(warnings), warnings)?;
    let target_counts = target_counts(source);
    let weights = animate(source, options, &mut nodes, &target_counts, warnings)?;
    let world = nodes.world_transforms(source, warnings)?;
    let placed = |&node: &usize| Some((source.get(Kind::Node, node)?, world[node]?));
    let nodes: Vec<_> = of_scene.iter().filter_map(placed).collect();

    let meshes = meshes_of(source, &nodes, warnings)?;
    let materials = materials_of(source, &meshes, warnings)?;
    // What follows may be a problem of the file: the images are not decoded for that.
    let (primitives, morphs) = primitives_of(source, &meshes, warnings)?;
    warn_of_bumps(&primitives, &materials, warnings);
    let skins = skins_of(source, &nodes, warnings)?;
    let used: BTreeSet<_> =
        materials.values().flat_map(|material| material.textures).flatten().map(|used| used.image).collect();
    let decoding = Decoding::start(source, used, scheduler, warnings);
    let mut steps = StepCounter::new(decoding.count(), progress);
    let images = decoding.wait(&mut steps, warnings);
    let parts = Parts { source, nodes, world, weights, target_counts, primitives, skins, materials };
    let mut builder = WorldBuilder::new(&parts, morphs, (&images, &options.limits), warnings)?;
    builder.add_objects()?;
    builder.add_lights()?;
    builder.add_camera(options.camera, options.size)?;
    Ok(builder.finish())
}

fn animate(
    source: &Source,
    options: &LoadOptions,
    nodes: &mut Nodes,
    target_counts: &[usize],
    warnings: &mut Warnings,
) -> Result<BTreeMap<usize, Vec<f32>>, Problem> {
    let Some(time) = options.time else { return Ok(BTreeMap::new()) };
    let Some(animation) = source.get(Kind::Animation, options.animation) else {
        let count = source.count(Kind::Animation);
        warnings.add(format!("there is no animation {}: the file has {count}, and nothing moves", options.animation));
        return Ok(BTreeMap::new());
    };
    let motion = pose_at(source, &animation, time, nodes, target_counts, warnings)?;
    if let Some(end) = motion.end.filter(|&end| time > end) {
        warnings.add(format!("{animation} ends at {end} s, and stays there"));
    }
    Ok(motion.weights)
}

/// The meshes of the scene, each once.
fn meshes_of<'a>(
    source: &'a Source,
    nodes: &[(Element<'a>, DAffine3)],
    warnings: &mut Warnings,
) -> Result<BTreeMap<usize, Element<'a>>, Problem> {
    let mut meshes = BTreeMap::new();
    for (node, _) in nodes {
        let mesh = source.member(node, "mesh", Kind::Mesh);
        let mesh = warnings.keep_shape(mesh, format_args!("{node} has no mesh"))?.flatten();
        meshes.extend(mesh.map(|mesh| (mesh.index, mesh)));
    }
    Ok(meshes)
}

/// The materials of all meshes of the scene.
fn materials_of(
    source: &Source,
    meshes: &BTreeMap<usize, Element<'_>>,
    warnings: &mut Warnings,
) -> Result<BTreeMap<Option<usize>, ReadMaterial>, Problem> {
    let nothing = Json::Object(Box::default());
    let mut materials = BTreeMap::new();
    let name = "the default material".to_owned();
    materials.insert(None, read_material(source, &Element::new(&nothing, Kind::Material, 0), name, warnings)?);
    for mesh in meshes.values() {
        for json in mesh.list("primitives").unwrap_or_default() {
            let index = json.get("material").and_then(Json::as_index);
            let Some(material) = index.and_then(|index| source.get(Kind::Material, index)) else { continue };
            if let Entry::Vacant(entry) = materials.entry(index) {
                entry.insert(read_material(source, &material, material.to_string(), warnings)?);
            }
        }
    }
    Ok(materials)
}

/// The primitives of all meshes of the scene, and the numbers of their morph targets.
fn primitives_of(
    source: &Source,
    meshes: &BTreeMap<usize, Element<'_>>,
    warnings: &mut Warnings,
) -> Result<(PrimitivesOfMeshes, Vec<f32>), Problem> {
    let (mut of_meshes, mut morphs) = (BTreeMap::new(), Vec::new());
    for (&index, mesh) in meshes {
        let mut primitives = Vec::new();
        let list = warnings.keep_shape(mesh.list("primitives"), format_args!("{mesh} is not drawn"))?;
        for (number, json) in list.unwrap_or_default().iter().enumerate() {
            let primitive = mesh.part(json, "primitive", number);
            let accessors = Accessors::of_geometry(source);
            primitives.extend(read_primitive(accessors, &primitive, &mut morphs, warnings)?);
        }
        of_meshes.insert(index, primitives);
    }
    Ok((of_meshes, morphs))
}

/// The skins of the nodes of the scene.
fn skins_of(
    source: &Source,
    nodes: &[(Element<'_>, DAffine3)],
    warnings: &mut Warnings,
) -> Result<BTreeMap<usize, Skin>, Problem> {
    let mut skins = BTreeMap::new();
    for (node, _) in nodes.iter().filter(|(node, _)| node.json.get("mesh").is_some()) {
        let lost = format_args!("{node} is drawn without its skin");
        let Some(skin) = warnings.keep(source.member(node, "skin", Kind::Skin), lost)?.flatten() else { continue };
        if let Entry::Vacant(entry) = skins.entry(skin.index) {
            let read = Skin::read(Accessors::of_geometry(source), &skin);
            entry.insert(warnings.keep(read, format_args!("meshes are drawn without {skin}"))?);
        }
    }
    Ok(skins.into_iter().filter_map(|(index, skin)| Some((index, skin?))).collect())
}

/// Tangents that a file leaves out are those of MikkTSpace, by the specification; here the shader derives them.
fn warn_of_bumps(
    primitives: &PrimitivesOfMeshes,
    materials: &BTreeMap<Option<usize>, ReadMaterial>,
    warnings: &mut Warnings,
) {
    let has_bumps = |primitive: &&Primitive| materials.get(&primitive.material).is_some_and(ReadMaterial::has_bumps);
    let mut with_bumps = primitives.values().flatten().filter(has_bumps);
    if let Some(primitive) = with_bumps.find(|primitive| !primitive.has_tangents) {
        let reason = "has no tangents for its texture of normals: they are derived from the picture, not by MikkTSpace";
        warnings.add(format!("{} {reason}", primitive.mesh.name()));
    }
}
