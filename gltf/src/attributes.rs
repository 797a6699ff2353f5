//! What vertices and objects have beside what Drawloom knows, by the names that the shaders use.

use drawloom::scene::{LayerMask, ObjectColumn, VertexAttribute};

/// The second set of texture coordinates.
pub(crate) const SECOND_UV: VertexAttribute<[f32; 2]> = VertexAttribute::new("second_uv");
/// The direction in which the texture coordinate u grows, and the sign of the third axis; 0 where a mesh has none.
pub(crate) const TANGENT: VertexAttribute<[f32; 4]> = VertexAttribute::new("tangent");
/// The colour that the base colour is multiplied by.
pub(crate) const COLOR: VertexAttribute<[f32; 4]> = VertexAttribute::new("color");
/// The four joints that move a vertex.
pub(crate) const JOINTS: VertexAttribute<[u32; 4]> = VertexAttribute::new("joints");
/// How much each of them does; 1 in all.
pub(crate) const WEIGHTS: VertexAttribute<[f32; 4]> = VertexAttribute::new("weights");

/// How an object is deformed.
pub(crate) const POSE: ObjectColumn<Pose> = ObjectColumn::new("pose");

/// How an object is deformed: `Pose` in `deformation.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct Pose {
    /// The index of its first joint in the palette.
    pub(crate) first_joint: u32,
    /// The index of its first morph weight in the morph data.
    pub(crate) first_weight: u32,
    /// The index of the first number of its first morph target in the morph data.
    pub(crate) first_target: u32,
    /// The number of morph targets.
    pub(crate) target_count: u32,
    /// The number of vertices of its mesh.
    pub(crate) vertex_count: u32,
}

/// The layer of the objects that are drawn as their meshes are.
pub(crate) const RIGID: LayerMask = LayerMask::layer(0);
/// The layer of the objects that joints or morph targets deform.
pub(crate) const DEFORMED: LayerMask = LayerMask::layer(1);
