//! The triangles of a primitive, as a list.

use gltf::mesh::Mode;

use crate::accessors::Accessors;
use crate::error::Problem;

/// The corners of the triangles of a primitive; `None` if it is of points or lines, or has no triangle.
///
/// # Errors
/// If an index is not that of a vertex, or a list ends within a triangle.
pub(crate) fn triangle_list(
    accessors: &Accessors<'_>,
    primitive: &gltf::Primitive<'_>,
    element: &str,
    vertices: usize,
) -> Result<Option<Vec<u32>>, Problem> {
    if !matches!(primitive.mode(), Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        return Ok(None);
    }
    let corners: Vec<u32> = match primitive.indices() {
        Some(accessor) => {
            let indices = accessors.integers::<1>(&accessor, &format!("the indices of {element}"))?;
            indices.into_iter().map(|[index]| index).collect()
        }
        None => (0..vertices as u32).collect(),
    };
    if let Some(&index) = corners.iter().find(|&&index| index as usize >= vertices) {
        let element = element.to_owned();
        return Err(Problem::IndexOutOfRange { element, index: index.into(), count: vertices, what: "vertices" });
    }
    let triangles = match primitive.mode() {
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
    if triangles.len() % 3 != 0 {
        return Err(Problem::invalid(
            element,
            format!("has {} corners, which are no whole triangles", triangles.len()),
        ));
    }
    Ok((!triangles.is_empty()).then_some(triangles))
}
