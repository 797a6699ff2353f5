//! Morph targets: where vertices are moved to.

use drawloom::glam::Vec3;

use crate::accessors::Accessors;
use crate::element::Element;
use crate::error::{Problem, excerpt};
use crate::warnings::Warnings;

/// How many numbers a vertex has for each morph target: the differences of its position, its normal and its tangent.
pub(crate) const NUMBERS_PER_VERTEX: usize = 9;

/// The greatest number of bytes of all targets. With the weights of objects, which are behind them, they are one
/// binding of the shader, and WebGPU allows 128 MiB.
const MAX_BYTES: u64 = 96 << 20;

/// The morph targets of a primitive. One that changes nothing takes no memory.
#[derive(Debug, Default)]
pub(crate) struct MorphTargets {
    /// Where its numbers begin: [`NUMBERS_PER_VERTEX`] for each vertex of each target.
    pub(crate) first: u32,
    /// The number of each target in the file.
    pub(crate) numbers: Vec<usize>,
    /// How far each target moves a vertex at most, along each axis.
    pub(crate) reach: Vec<Vec3>,
}

impl MorphTargets {
    /// Reads the targets of a primitive with this number of vertices. A target changes no attribute without a finite
    /// value for each vertex; that is a warning.
    ///
    /// # Errors
    /// If a limit is exceeded.
    pub(crate) fn read(
        accessors: Accessors<'_>,
        primitive: &Element<'_>,
        vertices: usize,
        morphs: &mut Vec<f32>,
        warnings: &mut Warnings,
    ) -> Result<Self, Problem> {
        let list = warnings.keep(primitive.list("targets"), format_args!("{primitive} has no morph targets"))?;
        let mut targets = Self { first: morphs.len() as u32, ..Self::default() };
        for (number, json) in list.unwrap_or_default().iter().enumerate() {
            let (target, element) = (primitive.inner(json), format!("morph target {number} of {primitive}"));
            for (name, _) in json.members() {
                if !matches!(&**name, "POSITION" | "NORMAL" | "TANGENT") && !name.starts_with('_') {
                    warnings.add(format!("{element}: its {} is ignored", excerpt(name)));
                }
            }
            let mut parts = Vec::new();
            for (part, member, name) in
                [(0, "POSITION", "positions"), (1, "NORMAL", "normals"), (2, "TANGENT", "tangents")]
            {
                let read = || {
                    let Some(accessor) = accessors.member(&target, member)? else { return Ok(None) };
                    let values = accessors.floats::<3>(&accessor, &format!("the {name} of {element}"))?;
                    check_count(&format!("{name} of {element}"), values.len(), vertices)?;
                    Ok(Some((part, values)))
                };
                parts.extend(warnings.keep(read(), format_args!("{element} does not change {name}"))?.flatten());
            }
            if parts.is_empty() {
                continue;
            }
            let first = morphs.len();
            let bytes = (first as u64).saturating_add(vertices as u64 * NUMBERS_PER_VERTEX as u64).saturating_mul(4);
            if bytes > MAX_BYTES {
                let reason =
                    format!("with those before it, it takes {bytes} bytes of the {MAX_BYTES} that devices bind");
                warnings.add(format!("{element} is left out: {reason}"));
                continue;
            }
            accessors.limit.take(&element, vertices as u64, 4 * NUMBERS_PER_VERTEX as u64)?;
            morphs.resize(first + vertices * NUMBERS_PER_VERTEX, 0.0);
            let of_target = &mut morphs[first..];
            for (part, values) in parts {
                let of_vertices = of_target.chunks_mut(NUMBERS_PER_VERTEX).zip(values);
                of_vertices.for_each(|(numbers, value)| numbers[part * 3..][..3].copy_from_slice(&value));
            }
            let moves = of_target.chunks(NUMBERS_PER_VERTEX).map(|numbers| Vec3::from_slice(numbers).abs());
            targets.numbers.push(number);
            targets.reach.push(moves.fold(Vec3::ZERO, Vec3::max));
        }
        Ok(targets)
    }

    /// The weight of each target, of those of all targets in the file.
    pub(crate) fn weights(&self, of_file: &[f32]) -> Vec<f32> {
        self.numbers.iter().map(|&number| of_file.get(number).copied().unwrap_or(0.0)).collect()
    }
}

/// # Errors
/// If there is not one value for each vertex.
pub(crate) fn check_count(what: &str, count: usize, vertices: usize) -> Result<(), Problem> {
    if count == vertices {
        return Ok(());
    }
    let expected_by = "vertices".to_owned();
    Err(Problem::UnequalCounts { element: what.to_owned(), what: "values", count, expected: vertices, expected_by })
}
