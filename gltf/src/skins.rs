//! Skins: the joints that move the vertices of a mesh.

use drawloom::glam::{DAffine3, DMat4, DVec4};

use crate::accessors::Accessors;
use crate::element::{Element, Kind};
use crate::error::Problem;

/// The joints of a skin.
#[derive(Debug)]
pub(crate) struct Skin {
    /// Each joint: its node, and from the mesh as it was modelled to the joint.
    pub(crate) joints: Vec<(usize, DAffine3)>,
}

impl Skin {
    /// # Errors
    /// If it has no joints, or fewer matrices than joints, or one that is not affine and finite.
    pub(crate) fn read(accessors: Accessors<'_>, skin: &Element<'_>) -> Result<Self, Problem> {
        let joint = |json: &crate::json::Json| {
            let index = json.as_index().ok_or_else(|| Problem::invalid(skin, "has a joint that is no index"))?;
            Ok(accessors.source.referred(skin, Kind::Node, index)?.index)
        };
        let nodes = skin.list("joints")?.iter().map(joint).collect::<Result<Vec<_>, Problem>>()?;
        let joint_bytes = size_of::<(usize, DAffine3)>() as u64;
        accessors.source.budget.poses.take(skin, nodes.len() as u64, joint_bytes)?;
        if nodes.is_empty() {
            return Err(Problem::invalid(skin, "has no joints"));
        }
        let Some(accessor) = accessors.member(skin, "inverseBindMatrices")? else {
            return Ok(Self { joints: nodes.into_iter().map(|node| (node, DAffine3::IDENTITY)).collect() });
        };
        let matrices = accessors.floats::<16>(&accessor, &format!("the inverse bind matrices of {skin}"))?;
        if matrices.len() < nodes.len() {
            return Err(Problem::UnequalCounts {
                element: skin.to_string(),
                what: "inverse bind matrices",
                count: matrices.len(),
                expected: nodes.len(),
                expected_by: "joints".to_owned(),
            });
        }
        let mut joints = Vec::new();
        for (index, (node, matrix)) in nodes.into_iter().zip(matrices).enumerate() {
            let matrix = DMat4::from_cols_array(&matrix.map(f64::from));
            if !matrix.row(3).abs_diff_eq(DVec4::W, 1e-4) {
                return Err(Problem::invalid(skin, format!("has an inverse bind matrix {index} that is not affine")));
            }
            joints.push((node, DAffine3::from_mat4(matrix)));
        }
        Ok(Self { joints })
    }
}
