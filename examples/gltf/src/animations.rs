//! Animations: where nodes are at a time, and how much morph targets count.

use std::collections::BTreeMap;

use drawloom::glam::{DAffine3, DQuat, DVec3};
use gltf::animation::Property;

use crate::accessors::Accessors;
use crate::error::Problem;
use crate::keyframes::Keyframes;
use crate::nodes::{LocalTransform, Nodes};
use crate::transforms::decompose;

/// Moves nodes to where an animation has them at a time in seconds. Returns the morph weights of the nodes for which it has some.
///
/// # Errors
/// If a channel has not a value for each time, or times that do not increase.
pub(crate) fn pose_at(
    accessors: &Accessors<'_>,
    animation: &gltf::Animation<'_>,
    time: f64,
    nodes: &mut Nodes,
) -> Result<BTreeMap<usize, Vec<f32>>, Problem> {
    let mut weights = BTreeMap::new();
    for (index, channel) in animation.channels().enumerate() {
        let element = format!("channel {index} of animation {}", animation.index());
        let target = channel.target();
        let node = target.node();
        let width = match target.property() {
            Property::Rotation => 4,
            Property::MorphTargetWeights => target_count(&node),
            _ => 3,
        };
        if width == 0 {
            return Err(Problem::invalid(
                element,
                format!("animates morph weights of node {}, which has none", node.index()),
            ));
        }
        let value = Keyframes::read(accessors, &channel.sampler(), width, &element)?.sample(time, target.property());
        let local = nodes.local.get_mut(node.index()).map(in_parts);
        match (target.property(), local) {
            (Property::MorphTargetWeights, _) => {
                weights.insert(node.index(), value.into_iter().map(|weight| weight as f32).collect());
            }
            (Property::Translation, Some(local)) => local.translation = DVec3::from_slice(&value),
            (Property::Scale, Some(local)) => local.scale = DVec3::from_slice(&value),
            (Property::Rotation, Some(local)) => {
                let rotation = DQuat::from_slice(&value);
                if rotation.length_squared() < 1e-12 {
                    return Err(Problem::invalid(element, format!("has a rotation of length 0 at {time} s")));
                }
                local.rotation = rotation.normalize();
            }
            (_, None) => {}
        }
    }
    Ok(weights)
}

/// The time of the last keyframe of an animation, in seconds.
pub(crate) fn duration(accessors: &Accessors<'_>, animation: &gltf::Animation<'_>) -> Result<f64, Problem> {
    let mut end = 0.0_f64;
    for sampler in animation.samplers() {
        let purpose = format!("the times of animation {}", animation.index());
        let times = accessors.floats::<1>(&sampler.input(), &purpose)?;
        end = times.last().map_or(end, |[last]| end.max(f64::from(*last)));
    }
    Ok(end)
}

/// The number of morph targets of a node's mesh.
pub(crate) fn target_count(node: &gltf::Node<'_>) -> usize {
    let of_mesh = |mesh: gltf::Mesh<'_>| mesh.primitives().map(|primitive| primitive.morph_targets().count()).max();
    node.mesh().and_then(of_mesh).unwrap_or(0)
}

/// The same transform without a matrix.
fn in_parts(local: &mut LocalTransform) -> &mut LocalTransform {
    if let Some(matrix) = local.matrix.take() {
        let parts = decompose(&DAffine3::from_mat4(matrix.into()));
        (local.translation, local.rotation, local.scale) = (parts.translation, parts.rotation, parts.scale);
    }
    local
}
