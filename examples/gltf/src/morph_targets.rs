//! Morph targets: where vertices are moved to.

use drawloom::glam::Vec3;

use crate::accessors::Accessors;
use crate::error::Problem;
use crate::warnings::Warnings;

/// How many numbers a vertex has for each morph target: the differences of its position, its normal and its tangent.
pub(crate) const NUMBERS_PER_VERTEX: usize = 9;

/// The morph targets of a primitive.
#[derive(Debug, Default)]
pub(crate) struct MorphTargets {
    /// [`NUMBERS_PER_VERTEX`] numbers for each vertex of each target.
    pub(crate) numbers: Vec<f32>,
    /// How far each target moves a vertex at most, along each axis.
    pub(crate) reach: Vec<Vec3>,
}

impl MorphTargets {
    /// # Errors
    /// If a target has not one finite value for each vertex.
    pub(crate) fn read(
        accessors: &Accessors<'_>,
        primitive: &gltf::Primitive<'_>,
        element: &str,
        vertices: usize,
        warnings: &mut Warnings,
    ) -> Result<Self, Problem> {
        let mut targets = Self::default();
        for (number, target) in primitive.morph_targets().enumerate() {
            let element = format!("morph target {number} of {element}");
            if target.positions().is_none() && target.normals().is_none() && target.tangents().is_none() {
                warnings.add(format!("{element} changes neither positions, normals nor tangents, and does nothing"));
            }
            accessors.count_bytes(|| element.clone(), vertices as u64, 4 * NUMBERS_PER_VERTEX as u64)?;
            let first = targets.numbers.len();
            targets.numbers.resize(first + vertices * NUMBERS_PER_VERTEX, 0.0);
            let parts =
                [(target.positions(), "positions"), (target.normals(), "normals"), (target.tangents(), "tangents")];
            for (part, (accessor, name)) in parts.into_iter().enumerate() {
                let Some(accessor) = accessor else { continue };
                let values = accessors.floats::<3>(&accessor, &format!("the {name} of {element}"))?;
                check_count(&format!("{name} of {element}"), values.len(), vertices)?;
                let of_target = targets.numbers[first..].chunks_mut(NUMBERS_PER_VERTEX);
                of_target.zip(values).for_each(|(numbers, value)| numbers[part * 3..][..3].copy_from_slice(&value));
            }
            let moves =
                targets.numbers[first..].chunks(NUMBERS_PER_VERTEX).map(|numbers| Vec3::from_slice(numbers).abs());
            targets.reach.push(moves.fold(Vec3::ZERO, Vec3::max));
        }
        Ok(targets)
    }
}

/// # Errors
/// If there is not one value for each vertex.
pub(crate) fn check_count(what: &str, count: usize, vertices: usize) -> Result<(), Problem> {
    if count == vertices {
        return Ok(());
    }
    let (element, what) = (what.to_owned(), "values".to_owned());
    Err(Problem::UnequalCounts { element, what, count, expected: vertices, expected_by: "vertices".to_owned() })
}
