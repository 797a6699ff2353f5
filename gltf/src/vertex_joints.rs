//! Which joints move the vertices of a primitive.

use std::collections::BTreeMap;

use drawloom::glam::Vec3;

use crate::element::Element;
use crate::error::Problem;

/// Which joints move the vertices of a primitive, and where those vertices are.
#[derive(Debug)]
pub(crate) struct VertexJoints {
    /// For each joint that moves a vertex, the lowest and highest corner of a box around all vertices that it moves.
    pub(crate) boxes: BTreeMap<u32, [Vec3; 2]>,
    /// The greatest index of a joint that moves a vertex.
    pub(crate) greatest: u32,
}

impl VertexJoints {
    /// Makes the weights of each vertex add up to 1. Returns the joints and weights too, as shaders read them.
    ///
    /// # Errors
    /// If a weight is negative.
    #[expect(clippy::type_complexity, reason = "three parts of one primitive")]
    pub(crate) fn new(
        primitive: &Element<'_>,
        positions: &[Vec3],
        joints: Vec<[u32; 4]>,
        mut weights: Vec<[f32; 4]>,
    ) -> Result<(Self, Vec<[u32; 4]>, Vec<[f32; 4]>), Problem> {
        let mut boxes = BTreeMap::new();
        for (index, ((position, joints), weights)) in positions.iter().zip(&joints).zip(&mut weights).enumerate() {
            if weights.iter().any(|&weight| weight < 0.0) {
                return Err(Problem::invalid(primitive, format!("has a negative weight at vertex {index}")));
            }
            let sum: f32 = weights.iter().sum();
            *weights =
                if sum > 0.0 && sum.is_finite() { weights.map(|weight| weight / sum) } else { [1.0, 0.0, 0.0, 0.0] };
            for (&joint, _) in joints.iter().zip(*weights).filter(|&(_, weight)| weight > 0.0) {
                let [low, high] = boxes.entry(joint).or_insert([*position; 2]);
                (*low, *high) = (low.min(*position), high.max(*position));
            }
        }
        let greatest = boxes.keys().next_back().copied().unwrap_or(0);
        Ok((Self { boxes, greatest }, joints, weights))
    }
}
