//! OBJ files.
//!
//! [`load`] reads one from disk; [`read`] reads one from wherever an engine keeps its files. Either gives a scene that can
//! be drawn as it is, with a camera and lights, and says what it could not take from the file.

mod emission;
mod error;
mod library;
mod material;
mod polygon;
mod shape;
mod tidy;

use std::path::Path;
use std::{fs, io};

use glam::{DVec3, Vec3};

use self::shape::Shape;
use self::tidy::Tidy;
use super::{Material, Mesh, RenderObject, Scene, SceneError, Topology, defaults};
use crate::handle::Handle;

pub use self::error::{ObjError, ObjWarning};

/// A scene from an OBJ file.
#[derive(Debug)]
pub struct Imported {
    /// One object, with a mesh of its own, for every material of every model; a camera called `main`; lights.
    pub scene: Scene,
    /// What could not be taken as it is.
    pub warnings: Vec<ObjWarning>,
    /// The triangles of the scene.
    pub triangles: usize,
    /// Triangles of the file that are not in the scene, since they have no area or are not finite.
    pub degenerate_triangles: usize,
}

/// Loads a scene from an OBJ file, with the `.mtl` files and textures that it names.
///
/// - Objects stand at the centre of their box, and their vertices are relative to it.
/// - Polygons are cut into triangles, also where they are not convex. Points, lines, free-form surfaces and vertex colours
///   are left out.
/// - Every material is double-sided, since OBJ promises no winding. Of a material, `Kd`, `map_Kd`, `Ke` and `d` or `Tr`
///   are read; PNG, JPEG, TGA and BMP textures are decoded.
/// - A model without normals is shaded flat.
/// - A glowing mesh (`Ke`) gives a light. A scene without one gets [`defaults::lights`]; every scene gets
///   [`defaults::camera`], a weak ambient light and a dark bluish background.
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
/// If the file cannot be read, is no UTF-8 text, has a line that cannot be understood, or has no triangle to draw. What
/// is wrong with the files that it names is a warning.
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
    let tidy = Tidy::new(text).map_err(|bad| ObjError::Malformed {
        file: file.to_owned(),
        line: bad.line,
        reason: bad.reason,
    })?;
    let models =
        parse(&tidy).map_err(|error| ObjError::Refused { file: file.to_owned(), reason: error.to_string() })?;
    let mut imported = Imported { scene: Scene::new(), warnings: Vec::new(), triangles: 0, degenerate_triangles: 0 };
    imported.fill(&models, &tidy, &fetch).map_err(|source| ObjError::Scene { file: file.to_owned(), source })?;
    if imported.triangles == 0 {
        return Err(ObjError::NoTriangles {
            file: file.to_owned(),
            degenerate_triangles: imported.degenerate_triangles,
            points: tidy.points,
            lines: tidy.lines,
        });
    }
    Ok(imported)
}

/// What tobj makes of it: a model for every run of faces with one name and one material, polygons left whole.
fn parse(tidy: &Tidy) -> Result<Vec<tobj::Model>, tobj::LoadError> {
    let options = tobj::LoadOptions { single_index: true, ..tobj::LoadOptions::default() };
    // Every name that is used is defined here, so that each model says which material it uses, even one that no library
    // defines.
    let text = format!("mtllib all\n{}", tidy.text);
    let materials = |_: &Path| {
        let names = (0..tidy.materials.len()).map(|index| index.to_string());
        let materials = names.clone().map(|name| tobj::Material { name, ..tobj::Material::default() }).collect();
        Ok((materials, names.zip(0..).collect()))
    };
    let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &options, materials)?;
    Ok(models)
}

/// What tidying up replaced or left out.
fn losses(tidy: &Tidy) -> impl Iterator<Item = ObjWarning> {
    let Tidy { points, lines, surfaces, bad_normals, bad_texture_coordinates, dangling_corners, .. } = *tidy;
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
        models: &[tobj::Model],
        tidy: &Tidy,
        fetch: &dyn Fn(&str) -> io::Result<Vec<u8>>,
    ) -> Result<(), SceneError> {
        self.warnings.extend(losses(tidy));
        let materials = material::add_materials(&mut self.scene, tidy, fetch, &mut self.warnings)?;
        let mut glowing = Vec::new();
        for model in models {
            let shape = Shape::new(&model.mesh);
            self.report(&model.name, &shape);
            if shape.indices.is_empty() {
                continue;
            }
            let material = materials[model.mesh.material_id.unwrap_or(materials.len() - 1)];
            let position = self.add_object(&model.name, &shape, tidy.origin, material)?;
            let emission = self.scene.assets().get(material)?.emission;
            if emission != Vec3::ZERO {
                glowing.push((shape, position, emission));
            }
        }
        self.add_surroundings(&glowing);
        Ok(())
    }

    fn add_object(
        &mut self,
        name: &str,
        shape: &Shape,
        origin: DVec3,
        material: Handle<Material>,
    ) -> Result<DVec3, SceneError> {
        let mesh = Mesh::new(name, Topology::TriangleList, shape.vertices.clone(), shape.indices.clone())?;
        self.triangles += mesh.triangle_count();
        let mesh = self.scene.add(mesh)?;
        let position = origin + shape.center;
        self.scene.add_object(RenderObject::new(mesh, material, position))?;
        Ok(position)
    }

    fn add_surroundings(&mut self, glowing: &[(Shape, DVec3, Vec3)]) {
        let size = 2.0 * defaults::extent(self.scene.as_scene_ref()).1;
        let lights =
            glowing.iter().filter_map(|(shape, position, emission)| emission::light(shape, *position, *emission, size));
        self.scene.lights.extend(lights);
        let camera = defaults::camera(self.scene.as_scene_ref());
        if self.scene.lights.is_empty() {
            self.scene.lights.extend(defaults::lights(self.scene.as_scene_ref(), &camera));
        }
        self.scene.cameras.push(camera);
        self.scene.ambient = defaults::AMBIENT;
        self.scene.background = defaults::BACKGROUND;
    }

    fn report(&mut self, model: &str, shape: &Shape) {
        let model = model.to_owned();
        let degenerate_triangles = shape.degenerate_triangles;
        self.degenerate_triangles += degenerate_triangles;
        if shape.indices.is_empty() {
            self.warnings.push(ObjWarning::EmptyModel { model: model.clone(), degenerate_triangles });
        }
        if shape.fanned_polygons > 0 {
            self.warnings.push(ObjWarning::FannedPolygons { model, polygons: shape.fanned_polygons });
        }
    }
}
