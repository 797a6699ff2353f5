//! The hierarchy of nodes: where each is in the world.

use drawloom::glam::{DAffine3, DMat4, DQuat, DVec3, DVec4};

use crate::document::Source;
use crate::element::{Element, Kind};
use crate::error::Problem;
use crate::warnings::Warnings;

/// All nodes of a file, whichever scenes they are in.
pub(crate) struct Nodes {
    /// The transform of each, relative to its parent.
    pub(crate) local: Vec<LocalTransform>,
    parents: Vec<Option<usize>>,
    /// Parents before their children. Nodes below themselves are missing.
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

const AT_PARENT: LocalTransform =
    LocalTransform { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: DVec3::ONE, matrix: None };

impl Nodes {
    /// Reads the nodes. What is wrong with them is a warning: they are then where their parents are, or in no scene.
    ///
    /// # Errors
    /// If a limit is exceeded.
    pub(crate) fn new(source: &Source, warnings: &mut Warnings) -> Result<Self, Problem> {
        let mut local = Vec::with_capacity(source.count(Kind::Node));
        for node in source.all(Kind::Node) {
            let lost = format_args!("{node} is placed as if it had no transform");
            local.push(warnings.keep(local_transform(&node), lost)?.unwrap_or(AT_PARENT));
        }
        let mut parents = vec![None; local.len()];
        for node in source.all(Kind::Node) {
            for child in children(source, &node, "children", warnings)? {
                if parents[child.index].is_some() {
                    warnings.add(format!("{child} is a child twice, and stays below its first parent"));
                } else {
                    parents[child.index] = Some(node.index);
                }
            }
        }
        // The children of each node are one behind another, in the order of their parents.
        let mut children_of: Vec<_> = (0..local.len()).filter(|&node| parents[node].is_some()).collect();
        children_of.sort_by_key(|&child| parents[child]);
        let mut order: Vec<_> = (0..local.len()).filter(|&node| parents[node].is_none()).collect();
        let mut next = 0;
        while let Some(&parent) = order.get(next) {
            let first = children_of.partition_point(|&child| parents[child] < Some(parent));
            order.extend(children_of[first..].iter().take_while(|&&child| parents[child] == Some(parent)));
            next += 1;
        }
        if order.len() < local.len() {
            let mut is_reached = vec![false; local.len()];
            order.iter().for_each(|&node| is_reached[node] = true);
            for node in source.all(Kind::Node).filter(|node| !is_reached[node.index]) {
                warnings.lose_shape(format!("{node} is its own ancestor, or below such a node, and is left out"));
            }
        }
        Ok(Self { local, parents, order })
    }

    /// From each node to the world; `None` if it has no place there: its transform leaves the range of numbers, which
    /// is a warning.
    ///
    /// # Errors
    /// If a limit is exceeded.
    pub(crate) fn world_transforms(
        &self,
        source: &Source,
        warnings: &mut Warnings,
    ) -> Result<Vec<Option<DAffine3>>, Problem> {
        let mut world = vec![None; self.local.len()];
        for &node in &self.order {
            let parent = self.parents[node].map_or(Some(DAffine3::IDENTITY), |parent| world[parent]);
            // What is below a node without a place has none, too.
            let Some(parent) = parent else { continue };
            let placed = parent * self.local[node].to_affine();
            match (problem_of(&placed), source.get(Kind::Node, node)) {
                (Some(reason), Some(element)) => {
                    let problem = Err(Problem::Transform { node: element.to_string(), reason });
                    let _: Option<()> = warnings.keep_shape(problem, "a node and those below it are left out")?;
                }
                _ => world[node] = Some(placed),
            }
        }
        Ok(world)
    }

    /// The nodes of a scene, or all if there is none: each with those below it, parents first.
    ///
    /// # Errors
    /// If a limit is exceeded.
    pub(crate) fn of_scene(
        &self,
        source: &Source,
        scene: Option<Element<'_>>,
        warnings: &mut Warnings,
    ) -> Result<Vec<usize>, Problem> {
        let Some(scene) = scene else { return Ok(self.order.clone()) };
        let mut is_in_scene = vec![false; self.local.len()];
        for root in children(source, &scene, "nodes", warnings)? {
            is_in_scene[root.index] = true;
        }
        let mut of_scene = Vec::new();
        for &node in &self.order {
            is_in_scene[node] |= self.parents[node].is_some_and(|parent| is_in_scene[parent]);
            if is_in_scene[node] {
                of_scene.push(node);
            }
        }
        Ok(of_scene)
    }
}

/// The nodes that a member lists. What is no index of a node is left out.
fn children<'a>(
    source: &'a Source,
    element: &Element<'a>,
    member: &str,
    warnings: &mut Warnings,
) -> Result<Vec<Element<'a>>, Problem> {
    let list = warnings.keep_shape(element.list(member), format_args!("the nodes below {element} are left out"))?;
    let mut nodes = Vec::new();
    for json in list.unwrap_or_default() {
        let index =
            json.as_index().ok_or_else(|| Problem::invalid(element, format!("has a `{member}` that is no index")));
        let node = index.and_then(|index| source.referred(element, Kind::Node, index));
        nodes.extend(warnings.keep_shape(node, "a node is left out")?);
    }
    Ok(nodes)
}

impl LocalTransform {
    fn to_affine(self) -> DAffine3 {
        let from_parts = DAffine3::from_scale_rotation_translation(self.scale, self.rotation, self.translation);
        self.matrix.unwrap_or(from_parts)
    }
}

/// How far Drawloom's world reaches, in metres.
pub(crate) const MAX_DISTANCE: f64 = 4e9;

fn problem_of(placed: &DAffine3) -> Option<&'static str> {
    // The range of f32, which objects and the device have.
    let is_large = placed.matrix3.to_cols_array().iter().any(|number| number.abs() > 1e30);
    if !placed.is_finite() || is_large {
        Some("is not finite in the world")
    } else if placed.translation.length() > MAX_DISTANCE {
        Some("is more than 4e9 m from the world's origin")
    } else {
        None
    }
}

fn local_transform(node: &Element<'_>) -> Result<LocalTransform, Problem> {
    let refused = |reason| Problem::Transform { node: node.to_string(), reason };
    if let Some(matrix) = node.numbers::<16>("matrix")? {
        let matrix = DMat4::from_cols_array(&matrix);
        if !matrix.row(3).abs_diff_eq(DVec4::W, 1e-6) {
            return Err(refused("is not affine"));
        }
        return Ok(LocalTransform { matrix: Some(DAffine3::from_mat4(matrix)), ..AT_PARENT });
    }
    let rotation = node.numbers::<4>("rotation")?.map_or(DQuat::IDENTITY, DQuat::from_array);
    if !rotation.length_squared().is_finite() || rotation.length_squared() < 1e-12 {
        return Err(refused("has a rotation without a direction"));
    }
    Ok(LocalTransform {
        translation: node.numbers::<3>("translation")?.map_or(DVec3::ZERO, DVec3::from_array),
        rotation: rotation.normalize(),
        scale: node.numbers::<3>("scale")?.map_or(DVec3::ONE, DVec3::from_array),
        matrix: None,
    })
}
