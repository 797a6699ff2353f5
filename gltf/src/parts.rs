//! What is read of a file before the world is built of it.

use std::collections::BTreeMap;

use drawloom::glam::DAffine3;

use crate::document::Source;
use crate::element::Element;
use crate::materials::ReadMaterial;
use crate::primitives::Primitive;
use crate::skins::Skin;

/// The primitives of meshes, by the index of each mesh.
pub(crate) type PrimitivesOfMeshes = BTreeMap<usize, Vec<Primitive>>;

/// What is read of a file before the world is built of it.
pub(crate) struct Parts<'a> {
    pub(crate) source: &'a Source,
    /// The nodes of the scene that have a place in the world, with that.
    pub(crate) nodes: Vec<(Element<'a>, DAffine3)>,
    /// From each node to the world, whichever scene it is in.
    pub(crate) world: Vec<Option<DAffine3>>,
    /// The morph weights that the animation gives to nodes.
    pub(crate) weights: BTreeMap<usize, Vec<f32>>,
    /// The number of morph targets of each mesh.
    pub(crate) target_counts: Vec<usize>,
    /// The primitives of each mesh that the scene has.
    pub(crate) primitives: PrimitivesOfMeshes,
    /// The skins of the nodes of the scene. Those with which something is wrong are missing.
    pub(crate) skins: BTreeMap<usize, Skin>,
    /// By index; `None` for the default material.
    pub(crate) materials: BTreeMap<Option<usize>, ReadMaterial>,
}
