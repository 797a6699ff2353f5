//! Materials and textures of the scene, from the definitions in libraries.

use std::collections::HashMap;
use std::io::{self, Cursor};

use glam::Vec3;
use image::{ImageFormat, ImageReader, imageops};

use super::error::ObjWarning;
use super::library::{self, Definition};
use super::preprocessing::Preprocessed;
use crate::handle::Handle;
use crate::scene::{Blend, Material, Scene, SceneError, Texture};

/// If at least this share of materials has opacity 0, the exporter wrote transparency as opacity, as 3ds Max does.
const INVERTED_SHARE: f64 = 0.8;

/// Adds the materials that an OBJ file uses, in the order of [`Preprocessed::materials`], and last the default material.
///
/// # Errors
/// Returns the error of [`Scene::add`].
pub(super) fn add_materials(
    scene: &mut Scene,
    file: &Preprocessed,
    fetch: &dyn Fn(&str) -> io::Result<Vec<u8>>,
    warnings: &mut Vec<ObjWarning>,
) -> Result<Vec<Handle<Material>>, SceneError> {
    let mut definitions = Vec::new();
    for library in &file.libraries {
        add_library(library, fetch, &mut definitions, warnings);
    }
    correct_opacity(&mut definitions, warnings);
    // A later definition of the same name replaces an earlier one.
    let defined: HashMap<_, _> = definitions.iter().map(|definition| (definition.name.as_str(), definition)).collect();
    let mut textures = TextureCache { fetch, by_path: HashMap::new() };
    let default = || Material { double_sided: true, ..Material::default() };
    let mut handles = Vec::new();
    for name in &file.materials {
        let material = match defined.get(name.as_str()) {
            Some(definition) => textures.material(scene, definition, warnings)?,
            None => {
                warnings.push(ObjWarning::UndefinedMaterial { material: name.clone() });
                default()
            }
        };
        handles.push(scene.add(material)?);
    }
    handles.push(scene.add(default())?);
    Ok(handles)
}

/// Reads a library. If there is no file of that name and the name contains spaces, it is a list of names.
fn add_library(
    library: &str,
    fetch: &dyn Fn(&str) -> io::Result<Vec<u8>>,
    definitions: &mut Vec<Definition>,
    warnings: &mut Vec<ObjWarning>,
) {
    match fetch(&library.replace('\\', "/")) {
        // Only names can contain invalid UTF-8. Materials of such names are reported as undefined.
        Ok(bytes) => definitions.extend(library::definitions(library, &String::from_utf8_lossy(&bytes), warnings)),
        Err(_) if library.contains(char::is_whitespace) => {
            for part in library.split_whitespace() {
                add_library(part, fetch, definitions, warnings);
            }
        }
        Err(error) => {
            warnings.push(ObjWarning::MissingLibrary { library: library.to_owned(), reason: error.to_string() });
        }
    }
}

fn correct_opacity(definitions: &mut [Definition], warnings: &mut Vec<ObjWarning>) {
    let materials = definitions.iter().filter(|definition| definition.opacity.is_some()).count();
    let invisible = definitions.iter().filter(|definition| definition.opacity == Some(0.0)).count();
    if invisible > 0 && invisible as f64 >= INVERTED_SHARE * materials as f64 {
        warnings.push(ObjWarning::InvertedOpacity { invisible, materials });
        definitions.iter_mut().for_each(|definition| definition.opacity = None);
    }
}

/// Textures by path, shared between materials.
struct TextureCache<'a> {
    fetch: &'a dyn Fn(&str) -> io::Result<Vec<u8>>,
    by_path: HashMap<String, Result<Handle<Texture>, String>>,
}

impl TextureCache<'_> {
    fn material(
        &mut self,
        scene: &mut Scene,
        definition: &Definition,
        warnings: &mut Vec<ObjWarning>,
    ) -> Result<Material, SceneError> {
        let texture = match &definition.texture {
            Some(path) => self.texture(scene, path, &definition.name, warnings)?,
            None => None,
        };
        let diffuse = match definition.diffuse {
            // Exporters write black if there is a texture.
            Some(Vec3::ZERO) if texture.is_some() => Vec3::ONE,
            Some(diffuse) => diffuse,
            None if texture.is_some() => Vec3::ONE,
            None => Material::default().diffuse,
        };
        let opacity = definition.opacity.unwrap_or(1.0);
        Ok(Material {
            name: definition.name.clone(),
            diffuse,
            texture,
            emission: definition.emission,
            opacity,
            blend: if opacity < 1.0 { Blend::Alpha } else { Blend::None },
            double_sided: true,
            values: None,
        })
    }

    fn texture(
        &mut self,
        scene: &mut Scene,
        path: &str,
        material: &str,
        warnings: &mut Vec<ObjWarning>,
    ) -> Result<Option<Handle<Texture>>, SceneError> {
        if !self.by_path.contains_key(path) {
            let handle = match self.decode(path, warnings) {
                Ok(texture) => Ok(scene.add(texture)?),
                Err(reason) => Err(reason),
            };
            self.by_path.insert(path.to_owned(), handle);
        }
        match &self.by_path[path] {
            Ok(handle) => Ok(Some(*handle)),
            Err(reason) => {
                let (texture, material) = (path.to_owned(), material.to_owned());
                warnings.push(ObjWarning::UnusableTexture { texture, material, reason: reason.clone() });
                Ok(None)
            }
        }
    }

    fn decode(&self, path: &str, warnings: &mut Vec<ObjWarning>) -> Result<Texture, String> {
        let bytes = (self.fetch)(path).map_err(|error| error.to_string())?;
        let mut reader = ImageReader::new(Cursor::new(bytes));
        // The guess from the contents comes first, but TGA has no magic number.
        if let Ok(format) = ImageFormat::from_path(path) {
            reader.set_format(format);
        }
        let reader = reader.with_guessed_format().map_err(|error| error.to_string())?;
        let mut image = reader.decode().map_err(|error| error.to_string())?.into_rgba8();
        let (width, height) = image.dimensions();
        if width.max(height) > Texture::MAX_SIZE {
            let [wide, high] = [width, height].map(|side| side.min(Texture::MAX_SIZE));
            image = imageops::resize(&image, wide, high, imageops::FilterType::Triangle);
            warnings.push(ObjWarning::ScaledTexture { texture: path.to_owned(), width, height });
        }
        let (width, height) = image.dimensions();
        Texture::new(path, width, height, image.into_raw()).map_err(|error| error.to_string())
    }
}
