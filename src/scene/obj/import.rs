//! Loading an OBJ file into a scene.

use std::io::Read;
use std::path::Path;
use std::{fs, io, mem};

use glam::Vec3;

use super::error::{ObjError, ObjWarning};
use super::geometry::{GeometryPart, ModelGeometry};
use super::preprocessing::Preprocessed;
use super::{emission, material};
use crate::handle::Handle;
use crate::scene::{Material, Mesh, RenderObject, Scene, SceneError, Topology};

/// A scene from an OBJ file, without cameras.
#[derive(Debug)]
pub struct Imported {
    /// One object, or several, each with a mesh of its own, for every material of every model, and a light for every emissive mesh.
    pub scene: Scene,
    /// What was left out or replaced.
    pub warnings: Vec<ObjWarning>,
    /// The triangles of the scene.
    pub triangles: usize,
    /// Triangles of the file that were left out, because they have no area or are not finite.
    pub degenerate_triangles: usize,
}

/// Loads a scene from an OBJ file, with the `.mtl` files and textures that it names.
///
/// - The origin of an object is the centre of its bounding box. A model whose extent is a million times its smallest triangle
///   becomes several objects, so that 32-bit coordinates suffice for each.
/// - Polygons are triangulated, including concave ones. Points, lines, free-form surfaces and vertex colours are left out.
/// - Every material is double-sided, since OBJ guarantees no winding. Of a material, `Kd`, `map_Kd`, `Ke` and `d` or `Tr`
///   are read; PNG, JPEG, TGA and BMP textures are decoded.
/// - A model without normals is shaded flat.
/// - An emissive mesh (`Ke`) adds a light. There are no other lights, and no cameras.
///
/// ```no_run
/// use drawloom::scene::obj;
///
/// let imported = obj::load("assets/sponza.obj")?;
/// for warning in &imported.warnings {
///     eprintln!("{warning}");
/// }
/// println!("{} objects, {} triangles", imported.scene.object_count(), imported.triangles);
/// # Ok::<(), obj::ObjError>(())
/// ```
///
/// # Errors
/// If the file cannot be read, is not UTF-8 text, has a line that cannot be parsed, or has no triangle to draw. Problems
/// with the files that it names are warnings.
pub fn load(path: impl AsRef<Path>) -> Result<Imported, ObjError> {
    let path = path.as_ref();
    let file = path.display().to_string();
    let bytes = fs::read(path).map_err(|source| ObjError::Unreadable { file: file.clone(), source })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    read(&file, &bytes, |name| fs::read(folder.join(name)))
}

/// As [`load`], from bytes that an engine already has. `file` names them in errors; `fetch` reads the `.mtl` files and
/// textures, by their paths relative to the OBJ file, with `/` between folders.
///
/// ```
/// use std::io;
///
/// use drawloom::scene::obj;
///
/// let triangle = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
/// let imported = obj::read("triangle.obj", triangle, |_| Err(io::ErrorKind::NotFound.into()))?;
/// assert_eq!(imported.triangles, 1);
/// # Ok::<(), obj::ObjError>(())
/// ```
///
/// # Errors
/// As [`load`].
pub fn read(file: &str, bytes: &[u8], fetch: impl Fn(&str) -> io::Result<Vec<u8>>) -> Result<Imported, ObjError> {
    let text = str::from_utf8(bytes)
        .map_err(|error| ObjError::NotText { file: file.to_owned(), offset: error.valid_up_to() })?;
    let mut preprocessed = Preprocessed::new(text).map_err(|bad| ObjError::Malformed {
        file: file.to_owned(),
        line: bad.line,
        reason: bad.reason,
    })?;
    let models = parse(&mut preprocessed)
        .map_err(|error| ObjError::Refused { file: file.to_owned(), reason: error.to_string() })?;
    let mut imported = Imported { scene: Scene::new(), warnings: Vec::new(), triangles: 0, degenerate_triangles: 0 };
    imported.fill(models, &preprocessed, &fetch).map_err(|source| ObjError::Scene { file: file.to_owned(), source })?;
    if imported.triangles == 0 {
        return Err(ObjError::NoTriangles {
            file: file.to_owned(),
            degenerate_triangles: imported.degenerate_triangles,
            points: preprocessed.points,
            lines: preprocessed.lines,
        });
    }
    Ok(imported)
}

/// Parses the text with tobj, and drops it: a model for every run of faces with one name and one material. Polygons are not triangulated.
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
    [
        (points + lines + surfaces, ObjWarning::NotDrawn { points, lines, surfaces }),
        (bad_normals, ObjWarning::ReplacedNormals { normals: bad_normals }),
        (bad_texture_coordinates, ObjWarning::ReplacedTextureCoordinates { coordinates: bad_texture_coordinates }),
        (dangling_corners, ObjWarning::DanglingCorners { corners: dangling_corners }),
    ]
    .into_iter()
    .filter_map(|(count, warning)| (count > 0).then_some(warning))
}

impl Imported {
    fn fill(
        &mut self,
        models: Vec<tobj::Model>,
        file: &Preprocessed,
        fetch: &dyn Fn(&str) -> io::Result<Vec<u8>>,
    ) -> Result<(), SceneError> {
        self.warnings.extend(warnings_of(file));
        let materials = material::add_materials(&mut self.scene, file, fetch, &mut self.warnings)?;
        let mut emissive = Vec::new();
        for model in models {
            let geometry = ModelGeometry::new(&model.mesh, &file.positions);
            self.report(&model.name, &geometry);
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
        let mesh = Mesh::new(name, Topology::TriangleList, geometry.vertices.clone(), geometry.indices.clone())?;
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

    fn report(&mut self, model: &str, geometry: &ModelGeometry) {
        let model = model.to_owned();
        let degenerate_triangles = geometry.degenerate_triangles;
        self.degenerate_triangles += degenerate_triangles;
        if geometry.parts.is_empty() {
            self.warnings.push(ObjWarning::EmptyModel { model: model.clone(), degenerate_triangles });
        }
        if geometry.fanned_polygons > 0 {
            self.warnings.push(ObjWarning::FannedPolygons { model, polygons: geometry.fanned_polygons });
        }
    }
}
