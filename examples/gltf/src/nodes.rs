//! The hierarchy of nodes: where each is in the world.

use drawloom::glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::scene::Transform;

use crate::document::Source;
use crate::error::Problem;

/// All nodes of a file, whichever scenes they are in.
pub(crate) struct Nodes {
    /// The transform of each, relative to its parent.
    pub(crate) local: Vec<LocalTransform>,
    parents: Vec<Option<usize>>,
    /// Parents before their children.
    order: Vec<usize>,
}

/// The transform of a node relative to its parent. An animation changes its parts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalTransform {
    pub(crate) translation: DVec3,
    pub(crate) rotation: DQuat,
    pub(crate) scale: DVec3,
    /// Instead of the others, if the file has a matrix.
    pub(crate) matrix: Option<DAffine3>,
}

impl Nodes {
    /// # Errors
    /// If the nodes are no forest, or a transform is not finite.
    pub(crate) fn new(source: &Source) -> Result<Self, Problem> {
        let local = source.document.nodes().map(|node| local_transform(&node)).collect::<Result<Vec<_>, _>>()?;
        let mut parents = vec![None; local.len()];
        for node in source.document.nodes() {
            for child in node.children() {
                if parents[child.index()].replace(node.index()).is_some() {
                    return Err(Problem::Hierarchy { node: child.index(), reason: "is a child twice" });
                }
            }
        }
        let mut order: Vec<_> = (0..local.len()).filter(|&node| parents[node].is_none()).collect();
        let nodes: Vec<_> = source.document.nodes().collect();
        let mut next = 0;
        while next < order.len() {
            order.extend(nodes[order[next]].children().map(|child| child.index()));
            next += 1;
        }
        if order.len() < local.len() {
            let mut is_reached = vec![false; local.len()];
            order.iter().for_each(|&node| is_reached[node] = true);
            let node = is_reached.iter().position(|reached| !reached).unwrap_or(0);
            return Err(Problem::Hierarchy { node, reason: "is its own ancestor, or a descendant of such a node" });
        }
        Ok(Self { local, parents, order })
    }

    /// From each node to the world.
    ///
    /// # Errors
    /// If one is not finite.
    pub(crate) fn world_transforms(&self) -> Result<Vec<DAffine3>, Problem> {
        let mut world = vec![DAffine3::IDENTITY; self.local.len()];
        for &node in &self.order {
            let parent = self.parents[node].map_or(DAffine3::IDENTITY, |parent| world[parent]);
            world[node] = parent * self.local[node].to_affine();
            // The range of f32, which objects and the device have.
            let is_far = world[node].matrix3.to_cols_array().iter().any(|number| number.abs() > 1e30);
            if !world[node].is_finite() || is_far {
                return Err(Problem::Transform { node, reason: "is not finite in the world" });
            }
            if world[node].translation.abs().max_element() > MAX_DISTANCE {
                return Err(Problem::Transform { node, reason: "is more than 4e9 m from the world's origin" });
            }
        }
        Ok(world)
    }

    /// The nodes of a scene, or all if there is none: each with those below it, parents first.
    pub(crate) fn of_scene(&self, scene: Option<gltf::Scene<'_>>) -> Vec<usize> {
        let Some(scene) = scene else { return self.order.clone() };
        let mut is_in_scene = vec![false; self.local.len()];
        scene.nodes().for_each(|root| is_in_scene[root.index()] = true);
        let mut of_scene = Vec::new();
        for &node in &self.order {
            is_in_scene[node] |= self.parents[node].is_some_and(|parent| is_in_scene[parent]);
            if is_in_scene[node] {
                of_scene.push(node);
            }
        }
        of_scene
    }
}

impl LocalTransform {
    fn to_affine(self) -> DAffine3 {
        let from_parts = DAffine3::from_scale_rotation_translation(self.scale, self.rotation, self.translation);
        self.matrix.unwrap_or(from_parts)
    }
}

/// How far Drawloom's world reaches, in metres.
const MAX_DISTANCE: f64 = 4e9;

fn local_transform(node: &gltf::Node<'_>) -> Result<LocalTransform, Problem> {
    let refused = |reason| Problem::Transform { node: node.index(), reason };
    let mut local =
        LocalTransform { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: DVec3::ONE, matrix: None };
    match node.transform() {
        Transform::Matrix { matrix } => {
            let matrix = DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from)));
            if !matrix.is_finite() {
                return Err(refused("is not finite"));
            }
            if !matrix.row(3).abs_diff_eq(drawloom::glam::DVec4::W, 1e-6) {
                return Err(refused("is not affine"));
            }
            local.matrix = Some(DAffine3::from_mat4(matrix));
        }
        Transform::Decomposed { translation, rotation, scale } => {
            local.translation = DVec3::from(translation.map(f64::from));
            local.rotation = DQuat::from_array(rotation.map(f64::from));
            local.scale = DVec3::from(scale.map(f64::from));
            if !local.translation.is_finite() || !local.rotation.is_finite() || !local.scale.is_finite() {
                return Err(refused("is not finite"));
            }
            if local.rotation.length_squared() < 1e-12 {
                return Err(refused("has a rotation of length 0"));
            }
            local.rotation = local.rotation.normalize();
        }
    }
    Ok(local)
}
