//! The triangles of a primitive, as a list.

use crate::accessors::Accessors;
use crate::element::Element;
use crate::error::Problem;
use crate::warnings::Warnings;

/// How the corners of a primitive form triangles; others are points and lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mode {
    Points,
    Lines,
    Triangles,
    TriangleStrip,
    TriangleFan,
}

/// The corners of the triangles of a primitive; `None`, with a warning, if it is of points or lines, or has no
/// triangle. Triangles that are not whole, or have a corner that is no vertex, are left out, with a warning.
///
/// # Errors
/// If the indices cannot be read.
pub(crate) fn triangle_list(
    accessors: Accessors<'_>,
    primitive: &Element<'_>,
    mode: Mode,
    vertices: usize,
    warnings: &mut Warnings,
) -> Result<Option<Vec<u32>>, Problem> {
    if matches!(mode, Mode::Points | Mode::Lines) {
        warnings.add(format!("{primitive} has the mode {mode:?}, not triangles, and is not drawn"));
        return Ok(None);
    }
    let Ok(vertices) = u32::try_from(vertices) else {
        return Err(Problem::invalid(primitive, format!("has {vertices} vertices")));
    };
    let corners: Vec<u32> = match accessors.member(primitive, "indices")? {
        Some(accessor) => {
            accessors.integers::<1>(&accessor, &format!("the indices of {primitive}"), 4)?.into_flattened()
        }
        None => {
            accessors.limit.take(primitive, vertices.into(), 4)?;
            (0..vertices).collect()
        }
    };
    if mode != Mode::Triangles {
        accessors.limit.take(primitive, corners.len() as u64, 12)?;
    }
    let mut triangles = match mode {
        Mode::TriangleStrip => {
            let turned = |(number, corners): (usize, &[u32; 3])| match (number % 2, *corners) {
                (0, corners) => corners,
                (_, [a, b, c]) => [a, c, b],
            };
            corners.array_windows().enumerate().flat_map(turned).collect()
        }
        Mode::TriangleFan => match corners.split_first() {
            Some((&first, rest)) => rest.array_windows().flat_map(|&[one, other]| [one, other, first]).collect(),
            None => Vec::new(),
        },
        _ => corners,
    };
    let rest = triangles.len() % 3;
    if rest > 0 {
        warnings.add(format!(
            "{primitive} has {} corners, which are no whole triangles, and is drawn without the last {rest}",
            triangles.len()
        ));
        triangles.truncate(triangles.len() - rest);
    }
    leave_out_invalid(&mut triangles, primitive, vertices, warnings);
    if triangles.is_empty() {
        warnings.add(format!("{primitive} has no triangles, and is not drawn"));
        return Ok(None);
    }
    Ok(Some(triangles))
}

/// Leaves out triangles with a corner that is no vertex.
fn leave_out_invalid(triangles: &mut Vec<u32>, primitive: &Element<'_>, vertices: u32, warnings: &mut Warnings) {
    let Some(&index) = triangles.iter().find(|&&index| index >= vertices) else { return };
    let (before, mut kept) = (triangles.len(), 0);
    for triangle in (0..before).step_by(3) {
        if triangles[triangle..triangle + 3].iter().all(|&index| index < vertices) {
            triangles.copy_within(triangle..triangle + 3, kept);
            kept += 3;
        }
    }
    triangles.truncate(kept);
    warnings.add(format!(
        "{primitive} has the index {index} of {vertices} vertices, and is drawn without {} triangles",
        (before - kept) / 3
    ));
}
