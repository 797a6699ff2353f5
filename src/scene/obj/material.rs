//! Materials and textures of the scene, from the definitions in libraries.

use std::collections::{HashMap, HashSet};
use std::io;

use glam::Vec3;

use super::error::ObjWarning;
use super::files::{Fetch, PossibleName, possible_names, read_one_of};
use super::library::{self, Definition, Definitions, TextureStatement};
use super::limits::{Limit, ObjLimits};
use super::preprocessing::Preprocessed;
use super::texture::{self, Pixels};
use super::warnings::Warnings;
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
    fetch: Fetch<'_>,
    limits: &ObjLimits,
    warnings: &mut Warnings,
) -> Result<Vec<Handle<Material>>, SceneError> {
    let used = file.materials.iter().map(String::as_str).collect();
    let mut libraries = Libraries { fetch, limits, used, bytes: 0, definitions: Definitions::default() };
    for library in &file.libraries {
        libraries.add(library, warnings);
    }
    let mut definitions = libraries.definitions;
    correct_opacity(&mut definitions, warnings);
    // A later definition of the same name replaces an earlier one.
    let defined: HashMap<_, _> =
        definitions.used.iter().map(|definition| (definition.name.as_str(), definition)).collect();
    let mut textures = TextureCache { fetch, limits, decoded_bytes: 0, by_names: HashMap::new() };
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

/// Reads material libraries.
struct Libraries<'a> {
    fetch: Fetch<'a>,
    limits: &'a ObjLimits,
    /// The names of the materials that the OBJ file uses.
    used: HashSet<&'a str>,
    /// The bytes of those that were read.
    bytes: u64,
    definitions: Definitions,
}

impl Libraries<'_> {
    /// Reads a library. If there is no file of that name and the name contains spaces, it is a list of names.
    fn add(&mut self, library: &str, warnings: &mut Warnings) {
        let limit = Limit { taken: self.bytes, ..Limit::new("library_bytes", self.limits.library_bytes) };
        let read = read_one_of(&possible_names("", library), limit, self.fetch).and_then(|(name, bytes)| {
            self.bytes += bytes.len() as u64;
            let is_used = |name: &str| self.used.contains(name);
            let max_line_bytes = self.limits.line_bytes;
            library::add_definitions(&mut self.definitions, &name.name, &bytes, is_used, max_line_bytes, warnings)
        });
        match read {
            Ok(()) => {}
            Err(error) if library.contains(char::is_whitespace) && !is_there(&error) => {
                for part in library.split_whitespace() {
                    self.add(part, warnings);
                }
            }
            Err(error) => {
                warnings.push(ObjWarning::MissingLibrary { library: library.to_owned(), reason: error.to_string() });
            }
        }
    }
}

/// Whether there is a file that cannot be read, of which this is the error.
fn is_there(error: &io::Error) -> bool {
    // What exceeds a limit, and what is no regular file.
    matches!(error.kind(), io::ErrorKind::FileTooLarge | io::ErrorKind::InvalidInput | io::ErrorKind::PermissionDenied)
}

fn correct_opacity(definitions: &mut Definitions, warnings: &mut Warnings) {
    let Definitions { used, with_opacity: materials, invisible } = definitions;
    if *invisible > 0 && *invisible as f64 >= INVERTED_SHARE * *materials as f64 {
        warnings.push(ObjWarning::InvertedOpacity { invisible: *invisible, materials: *materials });
        used.iter_mut().for_each(|definition| definition.opacity = None);
    }
}

/// Textures, shared between materials.
struct TextureCache<'a> {
    fetch: Fetch<'a>,
    limits: &'a ObjLimits,
    /// The bytes of all textures in the scene.
    decoded_bytes: u64,
    /// By the likeliest names of colours and mask.
    by_names: HashMap<[Option<String>; 2], MaterialTexture>,
}

/// The texture of a material, and how it changes the material.
#[derive(Clone, Default)]
struct MaterialTexture {
    handle: Option<Handle<Texture>>,
    /// Whether it has the colours of `map_Kd`.
    has_colors: bool,
    /// The greatest opacity, from 0 to 255, if a part of `map_d` is less than opaque.
    masked: Option<u8>,
    /// The files that cannot be used, and why.
    unusable: Vec<(String, String)>,
}

impl TextureCache<'_> {
    fn material(
        &mut self,
        scene: &mut Scene,
        definition: &Definition,
        warnings: &mut Warnings,
    ) -> Result<Material, SceneError> {
        let texture = self.texture(scene, definition, warnings)?;
        let diffuse = match definition.diffuse {
            // Exporters write black if there is a texture.
            Some(Vec3::ZERO) if texture.has_colors => Vec3::ONE,
            Some(diffuse) => diffuse,
            None if texture.has_colors => Vec3::ONE,
            None => Material::default().diffuse,
        };
        let opacity = definition.opacity.unwrap_or(1.0);
        if opacity == 0.0 || texture.masked == Some(0) {
            warnings.push(ObjWarning::InvisibleMaterial { material: definition.name.clone() });
        }
        let is_blended = opacity < 1.0 || texture.masked.is_some();
        Ok(Material {
            name: definition.name.clone(),
            diffuse,
            texture: texture.handle,
            emission: definition.emission,
            opacity,
            blend: if is_blended { Blend::Alpha } else { Blend::None },
            double_sided: true,
            values: None,
        })
    }

    fn texture(
        &mut self,
        scene: &mut Scene,
        definition: &Definition,
        warnings: &mut Warnings,
    ) -> Result<MaterialTexture, SceneError> {
        let statements = [&definition.texture, &definition.mask].map(Option::as_ref);
        let names = statements.map(|statement| statement.map(|statement| statement.names[0].name.clone()));
        let texture = match self.by_names.get(&names) {
            Some(known) => known.clone(),
            None => {
                let texture = self.combine(scene, statements, warnings)?;
                self.by_names.insert(names, texture.clone());
                texture
            }
        };
        for (texture, reason) in texture.unusable.iter().cloned() {
            warnings.push(ObjWarning::UnusableTexture { texture, material: definition.name.clone(), reason });
        }
        Ok(texture)
    }

    /// Decodes colours and mask, and adds a texture of both.
    fn combine(
        &mut self,
        scene: &mut Scene,
        statements: [Option<&TextureStatement>; 2],
        warnings: &mut Warnings,
    ) -> Result<MaterialTexture, SceneError> {
        let mut texture = MaterialTexture::default();
        let [colors, mask] = statements.map(|statement| {
            let statement = statement?;
            let unusable = |reason| (statement.names[0].name.clone(), reason);
            match self.decode(statement, warnings).map_err(unusable) {
                Ok(decoded) => return Some(decoded),
                // Colours and opacity may be in the same file.
                Err(known) if texture.unusable.contains(&known) => {}
                Err(unusable) => texture.unusable.push(unusable),
            }
            None
        });
        texture.has_colors = colors.is_some();
        let mask =
            mask.map(|(name, pixels)| (name, pixels.into_mask())).filter(|(_, pixels)| pixels.opacities().0 < 255);
        texture.masked = mask.as_ref().map(|(_, pixels)| pixels.opacities().1);
        let Some((name, mut pixels)) =
            colors.or_else(|| mask.as_ref().map(|(name, mask)| (name.clone(), mask.to_white())))
        else {
            return Ok(texture);
        };
        if let Some((_, mask)) = &mask {
            pixels.set_opacity(mask);
        }
        self.decoded_bytes += pixels.bytes.len() as u64;
        texture.handle = Some(scene.add(Texture::new(name, pixels.width, pixels.height, pixels.bytes)?)?);
        Ok(texture)
    }

    /// Decodes the file that a statement names. Returns its name as well.
    fn decode(
        &self,
        TextureStatement { names, library, line }: &TextureStatement,
        warnings: &mut Warnings,
    ) -> Result<(String, Pixels), String> {
        let ObjLimits { texture_file_bytes, texture_bytes, all_textures_bytes, .. } = *self.limits;
        let file_limit = Limit::new("texture_file_bytes", texture_file_bytes);
        let (PossibleName { name, drops_options }, file) =
            read_one_of(names, file_limit, self.fetch).map_err(|error| error.to_string())?;
        let all = Limit { taken: self.decoded_bytes, ..Limit::new("all_textures_bytes", all_textures_bytes) };
        let pixels = texture::decode(name, file, Limit::new("texture_bytes", texture_bytes), all)?;
        if *drops_options {
            let (library, reason) = (library.clone(), format!("the options of the texture `{name}` were left out"));
            warnings.push(ObjWarning::LibraryLine { library, line: *line, reason });
        }
        if let Some([width, height]) = pixels.scaled_from {
            warnings.push(ObjWarning::ScaledTexture { texture: name.clone(), width, height });
        }
        Ok((name.clone(), pixels))
    }
}
