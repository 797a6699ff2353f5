//! Loading an OBJ file into a scene.

use std::collections::BTreeMap;
use std::io::{self, BufRead, Cursor, Read};
use std::mem;
use std::path::Path;

use drawloom::glam::Vec3;
use drawloom::handle::Handle;
use drawloom::scene::{Material, Mesh, RenderObject, Scene, SceneError, Topology, VERTEX_COLOR};
use drawloom::text::{Escaped, path_text};

use crate::error::{ObjError, ObjWarning};
use crate::files::{self, Open, Stream};
use crate::geometry::{GeometryPart, ModelGeometry};
use crate::limits::{Limit, ObjLimits};
use crate::preprocessing::{MalformedLine, Preprocessed};
use crate::statements::Statements;
use crate::warnings::Warnings;
use crate::{emission, material};

/// A scene from an OBJ file, without cameras.
#[derive(Debug, Default)]
pub struct Imported {
    /// One object, or several, each with a mesh of its own, for every material of every model, and a light for every
    /// emissive mesh.
    pub scene: Scene,
    /// What was left out or replaced: of each kind, the first [`ObjLimits::warnings`]. Control characters of the files
    /// are escaped in them.
    pub warnings: Vec<ObjWarning>,
    /// The number of warnings of each [kind](ObjWarning::kind), with those that are not listed.
    pub warning_counts: BTreeMap<&'static str, usize>,
    /// The triangles of the scene.
    pub triangles: usize,
    /// Triangles of the file that were left out: they have no area, or are too thin or too large for 32-bit
    /// coordinates, or a corner of their polygon is not finite.
    pub degenerate_triangles: usize,
}

/// Loads a scene from an OBJ file, with the `.mtl` files and textures that it names.
///
/// - The origin of an object is the centre of its bounding box. A model whose extent is some million times its smallest
///   triangle becomes several objects, so that 32-bit coordinates suffice for each.
/// - Polygons are triangulated, including concave ones. Points, lines and free-form surfaces are left out.
/// - Colours of vertices (three numbers behind the coordinates) count as sRGB, as in other programs. They become the
///   attribute [`VERTEX_COLOR`] of the meshes, which a pipeline [with vertex
///   colours](drawloom::process::Deferred::vertex_colors) draws.
/// - Every material is double-sided, because OBJ guarantees no winding. The loader reads `Kd`, `map_Kd`, `Ke`, `d` or
///   `Tr`, and `map_d` of a material, and decodes PNG, JPEG, TGA and BMP textures.
/// - A material with a `d` below 1 is blended, and casts no shadow. Only then does the alpha of `map_Kd` count.
/// - A material with a `map_d` that cuts holes is [masked](drawloom::scene::Material::alpha_cutoff) at 0.5: it writes
///   depth, and its shadow has the shape of the mask. A material with another `map_d` is blended, and casts no shadow.
/// - The opacity of a `map_d` is its alpha, or its luminance if it is opaque everywhere. Texels below 16 are clear,
///   those above 239 solid. A mask cuts holes if it has clear texels, and at most 1 in 64 of its texels are neither
///   clear nor solid nor at an edge. A texel is at an edge if it has both a clear and a solid texel within two texels
///   along each axis. A mask whose texels are all solid hides nothing. A mask that cuts holes, and has no texel above
///   127, hides everything: the loader warns of it.
/// - A model without normals is shaded flat. Names of models are cut after 160 characters.
/// - An emissive mesh (`Ke`) adds a light. There are no other lights, and no cameras.
/// - What is malformed or not supported is left out, with a warning. Lines may end in LF, CR or both; text may be UTF-8
///   or UTF-16, and lines in other encodings are read as Latin-1.
///
/// ```no_run
/// let imported = drawloom_obj::load("assets/sponza.obj")?;
/// for warning in &imported.warnings {
///     eprintln!("{warning}");
/// }
/// println!("{} objects, {} triangles", imported.scene.object_count(), imported.triangles);
/// # Ok::<(), drawloom_obj::ObjError>(())
/// ```
///
/// # Errors
/// If the file cannot be read or exceeds a limit of [`ObjLimits::default`], or if it has no triangle to draw. Problems
/// with the files that it names are warnings.
pub fn load(path: impl AsRef<Path>) -> Result<Imported, ObjError> {
    load_within(path, &ObjLimits::default())
}

/// As [`load`], with other limits.
///
/// # Errors
/// As [`load`].
pub fn load_within(path: impl AsRef<Path>, limits: &ObjLimits) -> Result<Imported, ObjError> {
    let path = path.as_ref();
    let file = path.display().to_string();
    let reader = files::open(path, Limit::new("scene_bytes", limits.scene_bytes))
        .map_err(|source| ObjError::Unreadable { file: path_text(path), source })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let open = |name: &str, limit: Limit| Ok(Box::new(files::open(&folder.join(name), limit)?) as Box<dyn Stream>);
    import(&file, reader, &open, limits)
}

/// As [`load`], from bytes that an engine already has. `file` names them in errors; `fetch` reads the `.mtl` files and
/// textures, by their paths relative to the OBJ file, with `/` between folders, and `..` only in front of them. It is
/// asked for several names where it is not clear which one is meant. If it panics, the panic unwinds to the caller.
///
/// ```
/// use std::io;
///
/// let triangle = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
/// let imported = drawloom_obj::read("triangle.obj", triangle, |_| Err(io::ErrorKind::NotFound.into()))?;
/// assert_eq!(imported.triangles, 1);
/// # Ok::<(), drawloom_obj::ObjError>(())
/// ```
///
/// # Errors
/// As [`load`].
pub fn read(file: &str, bytes: &[u8], fetch: impl Fn(&str) -> io::Result<Vec<u8>>) -> Result<Imported, ObjError> {
    read_within(file, bytes, fetch, &ObjLimits::default())
}

/// As [`read`], with other limits.
///
/// # Errors
/// As [`load`].
pub fn read_within(
    file: &str,
    bytes: &[u8],
    fetch: impl Fn(&str) -> io::Result<Vec<u8>>,
    limits: &ObjLimits,
) -> Result<Imported, ObjError> {
    Limit::new("scene_bytes", limits.scene_bytes)
        .check(bytes.len() as u64)
        .map_err(|source| ObjError::Unreadable { file: Escaped::new(file).to_string(), source })?;
    let open = |name: &str, limit: Limit| {
        let bytes = fetch(name)?;
        limit.check(bytes.len() as u64)?;
        Ok(Box::new(Cursor::new(bytes)) as Box<dyn Stream>)
    };
    import(file, bytes, &open, limits)
}

fn import(file: &str, reader: impl BufRead, open: Open<'_>, limits: &ObjLimits) -> Result<Imported, ObjError> {
    let file = Escaped::new(file).to_string();
    let mut warnings = Warnings::new(limits.warnings);
    let mut preprocessed = Statements::new(reader, limits.line_bytes)
        .and_then(|statements| Preprocessed::new(statements, &file, &mut warnings))
        .map_err(|source| ObjError::Unreadable { file: file.clone(), source })?;
    let models = parse(&mut preprocessed)
        .map_err(|error| ObjError::Refused { file: file.clone(), reason: error.to_string() })?;
    let mut imported = Imported::default();
    imported
        .fill(models, &preprocessed, open, limits, &mut warnings)
        .map_err(|source| ObjError::Scene { file: file.clone(), source })?;
    if imported.triangles == 0 {
        return Err(nothing_to_draw(file, preprocessed, imported.degenerate_triangles, warnings.listed));
    }
    (imported.warnings, imported.warning_counts) = (warnings.listed, warnings.counts);
    Ok(imported)
}

/// The error of a file without a triangle, with the likeliest reason.
fn nothing_to_draw(
    file: String,
    preprocessed: Preprocessed,
    degenerate_triangles: usize,
    warnings: Vec<ObjWarning>,
) -> ObjError {
    let Preprocessed { first_malformed, first_non_text_line, points, lines, surfaces, .. } = preprocessed;
    match (first_non_text_line, first_malformed) {
        (Some(line), _) => ObjError::NotText { file, line, warnings },
        (None, Some(MalformedLine { line, reason })) => ObjError::Malformed { file, line, reason, warnings },
        (None, None) => ObjError::NoTriangles { file, degenerate_triangles, points, lines, surfaces, warnings },
    }
}

/// Parses the text with tobj, and drops it: a model for every run of faces with one name and one material. Polygons are
/// not triangulated.
fn parse(file: &mut Preprocessed) -> Result<Vec<tobj::Model>, tobj::LoadError> {
    let options = tobj::LoadOptions { single_index: true, ..tobj::LoadOptions::default() };
    // Defines every material that is used, so that each model has a material, even one that no library defines.
    let text = mem::take(&mut file.text);
    let mut text = "mtllib all\n".as_bytes().chain(text.as_bytes());
    let materials = |_: &Path| {
        let names = (0..file.materials.len()).map(|index| index.to_string());
        let materials = names.clone().map(|name| tobj::Material { name, ..tobj::Material::default() }).collect();
        Ok((materials, names.zip(0..).collect()))
    };
    let (models, _) = tobj::load_obj_buf(&mut text, &options, materials)?;
    Ok(models)
}

/// Warnings about what preprocessing replaced or left out.
fn warnings_of(file: &Preprocessed) -> impl Iterator<Item = ObjWarning> {
    let Preprocessed { points, lines, surfaces, bad_normals, bad_texture_coordinates, dangling_corners, .. } = *file;
    let Preprocessed { bad_colors, unsmoothed_faces, .. } = *file;
    [
        (points + lines + surfaces, ObjWarning::NotDrawn { points, lines, surfaces }),
        (bad_normals, ObjWarning::ReplacedNormals { normals: bad_normals }),
        (bad_texture_coordinates, ObjWarning::ReplacedTextureCoordinates { coordinates: bad_texture_coordinates }),
        (dangling_corners, ObjWarning::DanglingCorners { corners: dangling_corners }),
        (bad_colors, ObjWarning::ReplacedColors { vertices: bad_colors }),
        (unsmoothed_faces, ObjWarning::NotSmoothed { faces: unsmoothed_faces }),
    ]
    .into_iter()
    .filter_map(|(count, warning)| (count > 0).then_some(warning))
}

impl Imported {
    fn fill(
        &mut self,
        models: Vec<tobj::Model>,
        file: &Preprocessed,
        open: Open<'_>,
        limits: &ObjLimits,
        warnings: &mut Warnings,
    ) -> Result<(), SceneError> {
        warnings_of(file).for_each(|warning| warnings.push(warning));
        let materials = material::add_materials(&mut self.scene, file, open, limits, warnings)?;
        let mut emissive = Vec::new();
        for model in models {
            let geometry = ModelGeometry::new(&model.mesh, &file.positions, &file.colors);
            self.report(&model.name, &geometry, warnings);
            let material = materials[model.mesh.material_id.unwrap_or(materials.len() - 1)];
            let emission = self.scene.assets().get(material)?.emission;
            for part in geometry.parts {
                self.add_object(&model.name, &part, material)?;
                if emission != Vec3::ZERO {
                    emissive.push((part, emission));
                }
            }
        }
        self.add_lights(&emissive);
        Ok(())
    }

    fn add_object(
        &mut self,
        name: &str,
        geometry: &GeometryPart,
        material: Handle<Material>,
    ) -> Result<(), SceneError> {
        let mut mesh = Mesh::new(name, Topology::TriangleList, geometry.vertices.clone(), geometry.indices.clone())?;
        if !geometry.colors.is_empty() {
            mesh = mesh.with_attribute(VERTEX_COLOR, &geometry.colors)?;
        }
        self.triangles += mesh.triangle_count();
        let mesh = self.scene.add(mesh)?;
        self.scene.add_object(RenderObject::new(mesh, material, geometry.center))?;
        Ok(())
    }

    /// Adds the lights of emissive surfaces.
    fn add_lights(&mut self, emissive: &[(GeometryPart, Vec3)]) {
        let diameter = 2.0 * self.scene.as_scene_ref().bounding_sphere().1;
        let lights = emissive.iter();
        let lights = lights.filter_map(|(geometry, radiance)| emission::light(geometry, *radiance, diameter));
        self.scene.lights.extend(lights);
    }

    fn report(&mut self, model: &str, geometry: &ModelGeometry, warnings: &mut Warnings) {
        let model = model.to_owned();
        let degenerate_triangles = geometry.degenerate_triangles;
        self.degenerate_triangles += degenerate_triangles;
        if geometry.parts.is_empty() {
            warnings.push(ObjWarning::EmptyModel { model: model.clone(), degenerate_triangles });
        }
        if geometry.fanned_polygons > 0 {
            warnings.push(ObjWarning::FannedPolygons { model, polygons: geometry.fanned_polygons });
        }
    }
}
