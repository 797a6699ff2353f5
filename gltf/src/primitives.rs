//! Primitives: the parts of meshes, each with a material.

use drawloom::glam::Vec3;
use drawloom::scene::{Mesh, Topology, Vertex};

use crate::accessors::Accessors;
use crate::attributes::{COLOR, JOINTS, SECOND_UV, TANGENT, WEIGHTS};
use crate::element::{Element, Kind};
use crate::error::{Problem, excerpt};
use crate::morph_targets::{MorphTargets, check_count};
use crate::triangles::{Mode, triangle_list};
use crate::vertex_joints::VertexJoints;
use crate::warnings::Warnings;

/// The extension that compresses primitives.
const COMPRESSION: &str = "KHR_draco_mesh_compression";

/// A primitive as Drawloom draws it.
pub(crate) struct Primitive {
    pub(crate) mesh: Mesh,
    /// The index of its material; `None` for the default one.
    pub(crate) material: Option<usize>,
    pub(crate) has_tangents: bool,
    pub(crate) targets: MorphTargets,
    /// Which joints move its vertices, if any do.
    pub(crate) joints: Option<VertexJoints>,
}

/// Reads a primitive; `None`, with a warning, if it is not drawn. What is wrong with one of its attributes loses that
/// attribute, with a warning; what is wrong with its positions or indices loses the primitive. The numbers of its morph
/// targets go to `morphs`.
///
/// # Errors
/// If a limit is exceeded.
pub(crate) fn read_primitive(
    accessors: Accessors<'_>,
    primitive: &Element<'_>,
    morphs: &mut Vec<f32>,
    warnings: &mut Warnings,
) -> Result<Option<Primitive>, Problem> {
    let mut reader = PrimitiveReader { accessors, primitive, count: 0 };
    let read = reader.read(morphs, warnings);
    Ok(warnings.keep_shape(read, format_args!("{primitive} is not drawn"))?.flatten())
}

struct PrimitiveReader<'a, 'r> {
    accessors: Accessors<'a>,
    primitive: &'r Element<'a>,
    /// The number of vertices.
    count: usize,
}

impl PrimitiveReader<'_, '_> {
    fn read(&mut self, morphs: &mut Vec<f32>, warnings: &mut Warnings) -> Result<Option<Primitive>, Problem> {
        let (accessors, primitive) = (self.accessors, self.primitive);
        let Some(attributes) = primitive.object("attributes")? else { return Err(primitive.lacks("attributes")) };
        warn_of_ignored(&attributes, warnings);
        let mode = mode(primitive, warnings)?;
        let Some(of_positions) = accessors.member(&attributes, "POSITION")? else {
            warnings.add(format!("{primitive} has no positions, and is not drawn"));
            return Ok(None);
        };
        self.check_compression(&of_positions)?;
        let positions = accessors.floats::<3>(&of_positions, &format!("the positions of {primitive}"))?;
        let count = positions.len();
        self.count = count;
        let Some(indices) = triangle_list(accessors, primitive, mode, count, warnings)? else { return Ok(None) };
        accessors.limit.take(primitive, count as u64, size_of::<Vertex>() as u64)?;

        let normals = self.floats::<3>(&attributes, "NORMAL", "normals", warnings)?;
        let uvs = self.floats::<2>(&attributes, "TEXCOORD_0", "texture coordinates", warnings)?;
        let vertex = |(index, &position)| Vertex {
            position,
            normal: normals.as_ref().map_or([0.0; 3], |normals| normals[index]),
            uv: uvs.as_ref().map_or([0.0; 2], |uvs| uvs[index]),
        };
        let vertices: Vec<_> = positions.iter().enumerate().map(vertex).collect();
        let name = primitive.to_string();
        let refused = || Problem::of_scene(primitive);
        let mut mesh = Mesh::new(&name, Topology::TriangleList, vertices, indices).map_err(refused())?;
        if let Some(values) = self.floats::<2>(&attributes, "TEXCOORD_1", "second texture coordinates", warnings)? {
            mesh = mesh.with_attribute(SECOND_UV, &values).map_err(refused())?;
        }
        // Without normals tangents mean nothing.
        let mut has_tangents = false;
        if normals.is_some()
            && let Some(values) = self.floats::<4>(&attributes, "TANGENT", "tangents", warnings)?
        {
            has_tangents = true;
            mesh = mesh.with_attribute(TANGENT, &values).map_err(refused())?;
        }
        if let Some(values) = self.colors(&attributes, warnings)? {
            mesh = mesh.with_attribute(COLOR, &values).map_err(refused())?;
        }
        let targets = MorphTargets::read(accessors, primitive, count, morphs, warnings)?;
        let joints = self.joints(&attributes, &positions);
        let joints = warnings.keep(joints, format_args!("{primitive} is drawn without its joints"))?.flatten();
        let joints = match joints {
            None => None,
            Some((of_vertices, joints, weights)) => {
                mesh = mesh.with_attribute(JOINTS, &joints).map_err(refused())?;
                mesh = mesh.with_attribute(WEIGHTS, &weights).map_err(refused())?;
                Some(of_vertices)
            }
        };
        let material = accessors.source.member(primitive, "material", Kind::Material);
        let material = warnings.keep(material, format_args!("{primitive} is drawn with the default material"))?;
        let material = material.flatten().map(|material| material.index);
        Ok(Some(Primitive { mesh, material, has_tangents, targets, joints }))
    }

    /// # Errors
    /// If the primitive has no data but compressed ones.
    fn check_compression(&self, of_positions: &Element<'_>) -> Result<(), Problem> {
        let has_data = ["bufferView", "sparse"].into_iter().any(|member| of_positions.json.get(member).is_some());
        if has_data || self.primitive.extension(COMPRESSION).is_none() {
            return Ok(());
        }
        Err(Problem::Compressed { element: self.primitive.to_string(), extension: COMPRESSION })
    }

    /// An attribute of floats, if the primitive has it.
    fn floats<const N: usize>(
        &self,
        attributes: &Element<'_>,
        member: &str,
        name: &str,
        warnings: &mut Warnings,
    ) -> Result<Option<Vec<[f32; N]>>, Problem> {
        let read = || {
            let Some(accessor) = self.accessors.member(attributes, member)? else { return Ok(None) };
            let name = format!("{name} of {}", self.primitive);
            let values = self.accessors.floats(&accessor, &format!("the {name}"))?;
            check_count(&name, values.len(), self.count)?;
            Ok(Some(values))
        };
        Ok(warnings.keep(read(), format_args!("{} is drawn without its {name}", self.primitive))?.flatten())
    }

    /// With an opacity of 1 if they have none.
    fn colors(&self, attributes: &Element<'_>, warnings: &mut Warnings) -> Result<Option<Vec<[f32; 4]>>, Problem> {
        let width = self.accessors.member(attributes, "COLOR_0").ok().flatten().map(|it| self.accessors.width(&it));
        if !matches!(width, Some(Ok(3))) {
            return self.floats::<4>(attributes, "COLOR_0", "colours", warnings);
        }
        let colors = self.floats::<3>(attributes, "COLOR_0", "colours", warnings)?;
        Ok(colors.map(|colors| colors.into_iter().map(|[red, green, blue]| [red, green, blue, 1.0]).collect()))
    }

    #[expect(clippy::type_complexity, reason = "three parts of one primitive")]
    fn joints(
        &self,
        attributes: &Element<'_>,
        positions: &[[f32; 3]],
    ) -> Result<Option<(VertexJoints, Vec<[u32; 4]>, Vec<[f32; 4]>)>, Problem> {
        let (accessors, primitive) = (self.accessors, self.primitive);
        let joints = accessors.member(attributes, "JOINTS_0")?;
        let Some((joints, weights)) = joints.zip(accessors.member(attributes, "WEIGHTS_0")?) else { return Ok(None) };
        let joints = accessors.integers::<4>(&joints, &format!("the joints of {primitive}"), 2)?;
        check_count(&format!("joints of {primitive}"), joints.len(), self.count)?;
        let weights = accessors.floats::<4>(&weights, &format!("the weights of {primitive}"))?;
        check_count(&format!("weights of {primitive}"), weights.len(), self.count)?;
        let points: Vec<_> = positions.iter().map(|&position| Vec3::from(position)).collect();
        VertexJoints::new(primitive, &points, joints, weights).map(Some)
    }
}

fn mode(primitive: &Element<'_>, warnings: &mut Warnings) -> Result<Mode, Problem> {
    Ok(match primitive.index("mode")? {
        Some(0) => Mode::Points,
        Some(1..=3) => Mode::Lines,
        None | Some(4) => Mode::Triangles,
        Some(5) => Mode::TriangleStrip,
        Some(6) => Mode::TriangleFan,
        Some(mode) => {
            warnings.add(format!("{primitive} has the mode {mode}, which is not known, and is drawn as triangles"));
            Mode::Triangles
        }
    })
}

/// Names attributes that are not read, but for those that begin with `_`, which are an application's own.
fn warn_of_ignored(attributes: &Element<'_>, warnings: &mut Warnings) {
    const READ: [&str; 8] =
        ["POSITION", "NORMAL", "TANGENT", "TEXCOORD_0", "TEXCOORD_1", "COLOR_0", "JOINTS_0", "WEIGHTS_0"];
    for (name, _) in attributes.json.members() {
        if !name.starts_with('_') && !READ.contains(&&**name) {
            let name = excerpt(name);
            let reason = match name.split_once('_') {
                Some(("JOINTS" | "WEIGHTS", _)) => ": four joints move a vertex at most",
                _ => "",
            };
            warnings.add(format!("{attributes}: its attribute {name} is ignored{reason}"));
        }
    }
}
