//! The loader: from a file to a world.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::Path;

use drawloom::glam::DAffine3;
use drawloom::task::Scheduler;
use gltf::Document;
use indicatif::ProgressBar;

use crate::accessors::Accessors;
use crate::animations::{duration, pose_at};
use crate::document::Source;
use crate::error::{LoadError, Problem};
use crate::images::Decoding;
use crate::materials::{Surface, material_name, read_material};
use crate::nodes::Nodes;
use crate::primitives::{Primitive, read_primitive};
use crate::skins::Skin;
use crate::texture_arrays::{TextureArrays, TextureUses};
use crate::warnings::Warnings;
use crate::world::World;
use crate::world_builder::WorldBuilder;

/// What of a file is drawn.
#[derive(Clone, Debug)]
pub struct LoadOptions {
    /// The time in seconds at which the animation is; `None` for nodes where the file has them.
    pub time: Option<f64>,
    /// The index of the animation.
    pub animation: usize,
    /// The index of the camera among those of the scene; `None` for the first, or one that frames the scene if there is none.
    pub camera: Option<usize>,
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
}

/// Loads a `.gltf` or `.glb`. Images are decoded by background jobs of the scheduler; `progress` counts them.
///
/// # Errors
/// If the file is not glTF 2.0, refers to what is not there, or has numbers that cannot be drawn. The error names the element.
pub fn load(
    path: &Path,
    options: &LoadOptions,
    scheduler: &Scheduler,
    progress: &ProgressBar,
) -> Result<World, LoadError> {
    read(path, options, scheduler, progress)
        .map_err(|problem| LoadError { file: path.to_owned(), problem: problem.into() })
}

/// What is read of a file before the world is built of it.
pub(crate) struct Parts<'a> {
    pub(crate) document: &'a Document,
    /// The nodes of the scene.
    pub(crate) of_scene: Vec<usize>,
    /// From each node to the world.
    pub(crate) world: Vec<DAffine3>,
    /// The morph weights that the animation gives to nodes.
    pub(crate) weights: BTreeMap<usize, Vec<f32>>,
    /// The primitives of each mesh that the scene has.
    pub(crate) primitives: BTreeMap<usize, Vec<Primitive>>,
    pub(crate) skins: Vec<Skin>,
    /// By index; `None` for the default material.
    pub(crate) materials: BTreeMap<Option<usize>, (String, Surface)>,
}

fn read(path: &Path, options: &LoadOptions, scheduler: &Scheduler, progress: &ProgressBar) -> Result<World, Problem> {
    let mut warnings = Warnings::default();
    let source = Source::open(path, &mut warnings)?;
    let accessors = Accessors::new(&source);
    let document = &source.document;

    let mut nodes = Nodes::new(&source)?;
    let of_scene = nodes.of_scene(document.default_scene().or_else(|| document.scenes().next()));
    let mut uses = TextureUses::default();
    let materials = materials_of(document, &of_scene, &mut uses, &mut warnings)?;
    let decoding = Decoding::start(&source, uses.images(), scheduler)?;
    // Each is decoded, and then made a layer of a texture array, perhaps several times.
    progress.set_length((decoding.count() + uses.count()) as u64);

    let weights = animate(&accessors, document, options, &mut nodes, &mut warnings)?;
    let world = nodes.world_transforms()?;
    let primitives = primitives_of(&accessors, document, &of_scene, &mut warnings)?;
    let skins = document.skins().map(|skin| Skin::read(&accessors, &skin)).collect::<Result<_, _>>()?;

    let images = decoding.wait(progress)?;
    let textures = TextureArrays::new(&uses, &images, scheduler, progress)?;
    let parts = Parts { document, of_scene, world, weights, primitives, skins, materials };
    let mut builder = WorldBuilder::new(&parts, &textures, &mut warnings)?;
    builder.add_objects()?;
    builder.add_lights()?;
    builder.add_camera(options.camera, options.size)?;
    let world = builder.finish(textures);
    Ok(World { warnings: warnings.into_inner(), ..world })
}

fn animate(
    accessors: &Accessors<'_>,
    document: &Document,
    options: &LoadOptions,
    nodes: &mut Nodes,
    warnings: &mut Warnings,
) -> Result<BTreeMap<usize, Vec<f32>>, Problem> {
    let Some(time) = options.time else { return Ok(BTreeMap::new()) };
    let Some(animation) = document.animations().nth(options.animation) else {
        let count = document.animations().count();
        warnings.add(format!("there is no animation {}: the file has {count}, and nothing moves", options.animation));
        return Ok(BTreeMap::new());
    };
    let end = duration(accessors, &animation)?;
    if time > end {
        warnings.add(format!("animation {} ends at {end} s, and stays there", options.animation));
    }
    pose_at(accessors, &animation, time, nodes)
}

/// The materials of all meshes of the scene.
fn materials_of(
    document: &Document,
    of_scene: &[usize],
    uses: &mut TextureUses,
    warnings: &mut Warnings,
) -> Result<BTreeMap<Option<usize>, (String, Surface)>, Problem> {
    let mut materials = BTreeMap::new();
    for (_, mesh) in meshes_of(document, of_scene) {
        for material in mesh.primitives().map(|primitive| primitive.material()) {
            if let Entry::Vacant(entry) = materials.entry(material.index()) {
                entry.insert((material_name(&material), read_material(&material, uses, warnings)?));
            }
        }
    }
    Ok(materials)
}

/// The primitives of all meshes of the scene.
fn primitives_of(
    accessors: &Accessors<'_>,
    document: &Document,
    of_scene: &[usize],
    warnings: &mut Warnings,
) -> Result<BTreeMap<usize, Vec<Primitive>>, Problem> {
    let mut of_meshes = BTreeMap::new();
    for (index, mesh) in meshes_of(document, of_scene) {
        let mesh_name = mesh.name().map(|name| format!(" ({name})")).unwrap_or_default();
        let mut primitives = Vec::new();
        for primitive in mesh.primitives() {
            let element = format!("mesh {index}{mesh_name} primitive {}", primitive.index());
            primitives.extend(read_primitive(accessors, &primitive, &element, warnings)?);
        }
        of_meshes.insert(index, primitives);
    }
    Ok(of_meshes)
}

/// The meshes of the scene, each once.
fn meshes_of<'a>(document: &'a Document, of_scene: &[usize]) -> BTreeMap<usize, gltf::Mesh<'a>> {
    let nodes = of_scene.iter().filter_map(|&node| document.nodes().nth(node));
    nodes.filter_map(|node| node.mesh()).map(|mesh| (mesh.index(), mesh)).collect()
}
