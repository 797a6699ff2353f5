//! Animations: where nodes are at a time, and how much morph targets count.

use std::collections::BTreeMap;

use drawloom::glam::{DAffine3, DQuat, DVec3};

use crate::accessors::Accessors;
use crate::document::Source;
use crate::element::{Element, Kind};
use crate::error::{Problem, excerpt};
use crate::json::Json;
use crate::keyframes::{Keyframes, Property};
use crate::nodes::{LocalTransform, Nodes};
use crate::transforms::decompose;
use crate::warnings::Warnings;

/// The moving parts of a file at a time.
pub(crate) struct Motion<'a> {
    /// The number of morph targets of each mesh.
    target_counts: &'a [usize],
    /// The morph weights of the nodes for which the animation has some.
    pub(crate) weights: BTreeMap<usize, Vec<f32>>,
    /// The time of the last keyframe in seconds, if something moves.
    pub(crate) end: Option<f64>,
}

/// Moves nodes to where an animation has them at a time in seconds. A channel with which something is wrong moves
/// nothing, which is a warning.
///
/// # Errors
/// If a limit is exceeded.
pub(crate) fn pose_at<'a>(
    source: &Source,
    animation: &Element<'_>,
    time: f64,
    nodes: &mut Nodes,
    target_counts: &'a [usize],
    warnings: &mut Warnings,
) -> Result<Motion<'a>, Problem> {
    let mut motion = Motion { target_counts, weights: BTreeMap::new(), end: None };
    for channel in channels(animation, warnings)? {
        let moved = move_node(source, animation, &channel, time, nodes, &mut motion);
        let _: Option<()> = warnings.keep(moved, format_args!("{channel} moves nothing"))?;
    }
    Ok(motion)
}

/// Names the channels of all animations that animate what is not known, whether an animation is drawn or not.
///
/// # Errors
/// If a limit is exceeded.
pub(crate) fn warn_of_unknown(source: &Source, warnings: &mut Warnings) -> Result<(), Problem> {
    for animation in source.all(Kind::Animation) {
        for channel in channels(&animation, warnings)? {
            let path = channel.object("target").ok().flatten().and_then(|target| target.text("path").ok().flatten());
            if let Some(path) = path.filter(|path| property(path).is_none()) {
                let reason = "which is not known, and is ignored";
                warnings.add(format!("{channel} animates \"{}\", {reason}", excerpt(path)));
            }
        }
    }
    Ok(())
}

fn channels<'a>(animation: &Element<'a>, warnings: &mut Warnings) -> Result<Vec<Element<'a>>, Problem> {
    let list = warnings.keep(animation.list("channels"), format_args!("{animation} moves nothing"))?;
    let list = list.unwrap_or_default().iter().enumerate();
    Ok(list.map(|(number, json)| animation.part(json, "channel", number)).collect())
}

fn property(path: &str) -> Option<Property> {
    Some(match path {
        "translation" => Property::Translation,
        "rotation" => Property::Rotation,
        "scale" => Property::Scale,
        "weights" => Property::Weights,
        _ => return None,
    })
}

fn move_node(
    source: &Source,
    animation: &Element<'_>,
    channel: &Element<'_>,
    time: f64,
    nodes: &mut Nodes,
    motion: &mut Motion<'_>,
) -> Result<(), Problem> {
    let target = channel.object("target")?.ok_or_else(|| channel.lacks("target"))?;
    // A channel without a node animates what an extension says, and one whose property is not known is named elsewhere.
    let Some(node) = source.member(&target, "node", Kind::Node)? else { return Ok(()) };
    let path = target.text("path")?.ok_or_else(|| channel.lacks("path"))?;
    let Some(property) = property(path) else { return Ok(()) };
    let width = match property {
        Property::Rotation => 4,
        Property::Weights => {
            source.member(&node, "mesh", Kind::Mesh)?.map_or(0, |mesh| motion.target_counts[mesh.index])
        }
        Property::Translation | Property::Scale => 3,
    };
    if width == 0 {
        return Err(Problem::invalid(channel, format!("animates morph weights of {node}, which has none")));
    }
    let number = channel.needed_index("sampler")?;
    let samplers = animation.list("samplers")?;
    let Some(sampler) = samplers.get(number).map(|json| channel.inner(json)) else {
        let (element, index, count) = (channel.to_string(), number as u64, samplers.len());
        return Err(Problem::IndexOutOfRange { element, index, count, what: "samplers" });
    };
    let keyframes = Keyframes::read(Accessors::of_keyframes(source), &sampler, width, property)?;
    motion.end = Some(motion.end.map_or(keyframes.end(), |end| end.max(keyframes.end())));
    let value = keyframes.sample(time, property);
    let Some(local) = nodes.local.get_mut(node.index).map(in_parts) else { return Ok(()) };
    match property {
        Property::Weights => {
            motion.weights.insert(node.index, value.into_iter().map(|weight| weight as f32).collect());
        }
        Property::Translation => local.translation = DVec3::from_slice(&value),
        Property::Scale => local.scale = DVec3::from_slice(&value),
        Property::Rotation => {
            let rotation = DQuat::from_slice(&value);
            // Not a number between two that are opposite, or have no direction themselves.
            if rotation.length_squared().is_nan() || rotation.length_squared() < 1e-12 {
                return Err(Problem::invalid(channel, format!("has a rotation without a direction at {time} s")));
            }
            local.rotation = rotation.normalize();
        }
    }
    Ok(())
}

/// The number of morph targets of each mesh: the most that one of its primitives has.
pub(crate) fn target_counts(source: &Source) -> Vec<usize> {
    let of_primitive = |json: &Json| json.get("targets").and_then(Json::as_list).map_or(0, <[Json]>::len);
    let of_mesh = |mesh: Element<'_>| {
        let primitives = mesh.json.get("primitives").and_then(Json::as_list).unwrap_or_default();
        primitives.iter().map(of_primitive).max().unwrap_or(0)
    };
    source.all(Kind::Mesh).map(of_mesh).collect()
}

/// The same transform without a matrix.
fn in_parts(local: &mut LocalTransform) -> &mut LocalTransform {
    if let Some(matrix) = local.matrix.take() {
        let parts = decompose(&DAffine3::from_mat4(matrix.into()));
        (local.translation, local.rotation, local.scale) = (parts.translation, parts.rotation, parts.scale);
    }
    local
}
