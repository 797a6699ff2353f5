//! Primitives: the parts of meshes, each with a material.

use drawloom::glam::Vec3;
use drawloom::scene::{Mesh, Topology, Vertex};
use gltf::{Accessor, Semantic};

use crate::accessors::Accessors;
use crate::attributes::{COLOR, JOINTS, NUMBER, SECOND_UV, TANGENT, WEIGHTS};
use crate::error::Problem;
use crate::morph_targets::{MorphTargets, check_count};
use crate::triangles::triangle_list;
use crate::vertex_joints::VertexJoints;
use crate::warnings::Warnings;

/// A primitive as Drawloom draws it.
pub(crate) struct Primitive {
    pub(crate) mesh: Mesh,
    /// The index of its material; `None` for the default one.
    pub(crate) material: Option<usize>,
    pub(crate) targets: MorphTargets,
    /// Which joints move its vertices, if any do.
    pub(crate) joints: Option<VertexJoints>,
}

/// Reads a primitive; `None`, with a warning, if it has no triangles.
///
/// # Errors
/// If its attributes or indices are out of range, not finite or of the wrong type, or have different counts.
pub(crate) fn read_primitive(
    accessors: &Accessors<'_>,
    primitive: &gltf::Primitive<'_>,
    element: &str,
    warnings: &mut Warnings,
) -> Result<Option<Primitive>, Problem> {
    warn_of_ignored(primitive, element, warnings);
    let Some(positions) = primitive.get(&Semantic::Positions) else {
        warnings.add(format!("{element} has no positions, and is not drawn"));
        return Ok(None);
    };
    let positions = accessors.floats::<3>(&positions, &format!("the positions of {element}"))?;
    let count = positions.len();
    let Some(indices) = triangle_list(accessors, primitive, element, count)? else {
        warnings.add(format!("{element} of mode {:?} has no triangles, and is not drawn", primitive.mode()));
        return Ok(None);
    };
    let attributes = Attributes { accessors, primitive, element, count };
    let normals = attributes.floats::<3>(Semantic::Normals, "normals")?;
    let uvs = attributes.floats::<2>(Semantic::TexCoords(0), "texture coordinates")?;
    let or_zero =
        |values: &Option<Vec<[f32; 3]>>, index: usize| values.as_ref().map_or([0.0; 3], |values| values[index]);
    let vertex = |(index, &position)| Vertex {
        position,
        normal: or_zero(&normals, index),
        uv: uvs.as_ref().map_or([0.0; 2], |uvs| uvs[index]),
    };
    let vertices: Vec<_> = positions.iter().enumerate().map(vertex).collect();
    let refused = Problem::of_scene(element);
    let mut mesh = Mesh::new(element, Topology::TriangleList, vertices, indices).map_err(refused)?;
    if let Some(values) = attributes.floats::<2>(Semantic::TexCoords(1), "second texture coordinates")? {
        mesh = mesh.with_attribute(SECOND_UV, &values).map_err(Problem::of_scene(element))?;
    }
    // Without normals tangents mean nothing.
    if let (Some(values), true) = (attributes.floats::<4>(Semantic::Tangents, "tangents")?, normals.is_some()) {
        mesh = mesh.with_attribute(TANGENT, &values).map_err(Problem::of_scene(element))?;
    }
    if let Some(values) = attributes.colors()? {
        mesh = mesh.with_attribute(COLOR, &values).map_err(Problem::of_scene(element))?;
    }
    let targets = MorphTargets::read(accessors, primitive, element, count, warnings)?;
    if !targets.reach.is_empty() {
        let numbers: Vec<_> = (0..count as u32).collect();
        mesh = mesh.with_attribute(NUMBER, &numbers).map_err(Problem::of_scene(element))?;
    }
    let joints = attributes.get(Semantic::Joints(0)).zip(attributes.get(Semantic::Weights(0)));
    let joints = match joints {
        None => None,
        Some((joints, weights)) => {
            let joints = accessors.integers::<4>(&joints, &format!("the joints of {element}"))?;
            check_count(&format!("joints of {element}"), joints.len(), count)?;
            let weights = accessors.floats::<4>(&weights, &format!("the weights of {element}"))?;
            check_count(&format!("weights of {element}"), weights.len(), count)?;
            let points: Vec<_> = positions.iter().map(|&position| Vec3::from(position)).collect();
            let (of_vertices, joints, weights) = VertexJoints::new(element, &points, joints, weights)?;
            mesh = mesh.with_attribute(JOINTS, &joints).map_err(Problem::of_scene(element))?;
            mesh = mesh.with_attribute(WEIGHTS, &weights).map_err(Problem::of_scene(element))?;
            Some(of_vertices)
        }
    };
    Ok(Some(Primitive { mesh, material: primitive.material().index(), targets, joints }))
}

/// The optional attributes of a primitive.
struct Attributes<'a> {
    accessors: &'a Accessors<'a>,
    primitive: &'a gltf::Primitive<'a>,
    element: &'a str,
    count: usize,
}

impl<'a> Attributes<'a> {
    fn get(&self, semantic: Semantic) -> Option<Accessor<'a>> {
        self.primitive.get(&semantic)
    }

    fn floats<const N: usize>(&self, semantic: Semantic, name: &str) -> Result<Option<Vec<[f32; N]>>, Problem> {
        let Some(accessor) = self.get(semantic) else { return Ok(None) };
        let name = format!("{name} of {}", self.element);
        let values = self.accessors.floats(&accessor, &format!("the {name}"))?;
        check_count(&name, values.len(), self.count)?;
        Ok(Some(values))
    }

    /// With an opacity of 1 if they have none.
    fn colors(&self) -> Result<Option<Vec<[f32; 4]>>, Problem> {
        let Some(accessor) = self.get(Semantic::Colors(0)) else { return Ok(None) };
        if accessor.dimensions().multiplicity() != 3 {
            return self.floats(Semantic::Colors(0), "colours");
        }
        let colors = self.floats::<3>(Semantic::Colors(0), "colours")?;
        Ok(colors.map(|colors| colors.into_iter().map(|[red, green, blue]| [red, green, blue, 1.0]).collect()))
    }
}

fn warn_of_ignored(primitive: &gltf::Primitive<'_>, element: &str, warnings: &mut Warnings) {
    for (semantic, _) in primitive.attributes() {
        let ignored = match semantic {
            Semantic::Colors(set @ 1..) => format!("colours {set}"),
            Semantic::TexCoords(set @ 2..) => format!("texture coordinates {set}"),
            Semantic::Joints(set @ 1..) => format!("joints {set}: four joints move a vertex at most"),
            Semantic::Weights(1..) => continue,
            _ => continue,
        };
        warnings.add(format!("{element}: ignored are its {ignored}"));
    }
}
