//! Materials and textures of the scene, from the definitions in libraries.

use std::collections::{HashMap, HashSet};
use std::io::{self, Seek, SeekFrom};

use drawloom::glam::Vec3;
use drawloom::handle::Handle;
use drawloom::scene::{Blend, Material, Scene, SceneError, Texture};

use crate::error::ObjWarning;
use crate::files::{Open, PossibleName, Stream, first_readable, possible_names};
use crate::library::{self, Definition, Definitions, TextureStatement};
use crate::limits::{Limit, ObjLimits};
use crate::preprocessing::Preprocessed;
use crate::texture::{self, Pixels};
use crate::warnings::Warnings;

/// If at least this share of materials has opacity 0, the exporter wrote transparency as opacity, as 3ds Max does.
const INVERTED_SHARE: f64 = 0.8;

/// Adds the materials that an OBJ file uses, in the order of [`Preprocessed::materials`], and last the default
/// material.
///
/// # Errors
/// Returns the error of [`Scene::add`].
pub(crate) fn add_materials(
    scene: &mut Scene,
    file: &Preprocessed,
    open: Open<'_>,
    limits: &ObjLimits,
    warnings: &mut Warnings,
) -> Result<Vec<Handle<Material>>, SceneError> {
    let used = file.materials.iter().map(String::as_str).collect();
    let mut libraries = Libraries { open, limits, used, bytes: 0, definitions: Definitions::default() };
    for library in &file.libraries {
        libraries.add(library, warnings);
    }
    let mut definitions = libraries.definitions;
    correct_opacity(&mut definitions, warnings);
    // A later definition of the same name replaces an earlier one.
    let defined: HashMap<_, _> =
        definitions.used.iter().map(|definition| (definition.name.as_str(), definition)).collect();
    let mut textures = TextureCache::new(open, limits);
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
    open: Open<'a>,
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
        let read = match self.open_library(library) {
            Ok((name, mut file)) => {
                let is_used = |name: &str| self.used.contains(name);
                let max_line_bytes = self.limits.line_bytes;
                library::add_definitions(&mut self.definitions, &name, &mut file, is_used, max_line_bytes, warnings)
                    .and_then(|()| file.stream_position())
                    .map(|bytes| self.bytes += bytes)
            }
            Err(error) if library.contains(char::is_whitespace) && !exists_but_is_unusable(&error) => {
                library.split_whitespace().for_each(|part| self.add(part, warnings));
                Ok(())
            }
            Err(error) => Err(error),
        };
        if let Err(error) = read {
            warnings.push(ObjWarning::MissingLibrary { library: library.to_owned(), reason: error.to_string() });
        }
    }

    /// Opens the file of a library, and returns its name, too.
    fn open_library(&self, library: &str) -> io::Result<(String, Box<dyn Stream>)> {
        let limit = Limit { taken: self.bytes, ..Limit::new("library_bytes", self.limits.library_bytes) };
        let names = possible_names("", library)?;
        let (PossibleName { name, .. }, file) = first_readable(&names, |name| (self.open)(name, limit))?;
        Ok((name.clone(), file))
    }
}

/// Whether there is a file that cannot be read, of which this is the error.
fn exists_but_is_unusable(error: &io::Error) -> bool {
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
    open: Open<'a>,
    limits: &'a ObjLimits,
    /// Of the textures in the scene.
    all_textures: Limit,
    /// Of what is read and decoded.
    decoded: Limit,
    /// By name, the files that were tried: whether they can be decoded, or why not.
    files: HashMap<String, Result<(), (io::ErrorKind, String)>>,
    /// By the files of colours and mask.
    by_files: HashMap<[Option<String>; 2], CombinedTexture>,
    /// By the likeliest names of colours and mask.
    by_statements: HashMap<[Option<String>; 2], MaterialTexture>,
}

/// A texture of the scene, from the files of colours and mask.
#[derive(Clone, Copy)]
struct CombinedTexture {
    handle: Option<Handle<Texture>>,
    /// Whether it has the colours of `map_Kd`.
    has_colors: bool,
    /// `None` if there is no `map_d`, or it hides nothing.
    mask: Option<Mask>,
}

/// What a `map_d` is.
#[derive(Clone, Copy)]
struct Mask {
    /// Whether it [cuts holes](Pixels::cuts_holes), so that the material need not be blended.
    cuts_holes: bool,
    /// The greatest opacity, from 0 to 255.
    max_opacity: u8,
}

impl Mask {
    /// The alpha below which there is a hole.
    const CUTOFF: f32 = 0.5;

    fn new(pixels: &Pixels) -> Self {
        Self { cuts_holes: pixels.cuts_holes(), max_opacity: pixels.opacities().1 }
    }

    /// Whether nothing is visible of a material that it makes masked, or else blended.
    fn hides_all(self, is_masked: bool) -> bool {
        self.max_opacity == 0 || is_masked && f32::from(self.max_opacity) < Self::CUTOFF * 255.0
    }
}

/// The texture of a material.
#[derive(Clone)]
struct MaterialTexture {
    texture: CombinedTexture,
    /// The files that cannot be used, and why.
    unusable: Vec<(String, String)>,
}

/// A file that can be decoded.
struct TextureFile {
    name: String,
    /// `None` if it was decoded before, for another texture. It is decoded again for another pair of colours and mask.
    pixels: Option<Pixels>,
}

impl<'a> TextureCache<'a> {
    fn new(open: Open<'a>, limits: &'a ObjLimits) -> Self {
        let (files, by_files, by_statements) = (HashMap::new(), HashMap::new(), HashMap::new());
        let all_textures = Limit::new("all_textures_bytes", limits.all_textures_bytes);
        let decoded = Limit::new("decoded_bytes", limits.decoded_bytes);
        Self { open, limits, all_textures, decoded, files, by_files, by_statements }
    }

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
        // A mask of a material that is transparent everywhere is part of its transparency.
        let is_masked = opacity == 1.0 && texture.mask.is_some_and(|mask| mask.cuts_holes);
        let is_blended = !is_masked && (opacity < 1.0 || texture.mask.is_some());
        if opacity == 0.0 || texture.mask.is_some_and(|mask| mask.hides_all(is_masked)) {
            warnings.push(ObjWarning::InvisibleMaterial { material: definition.name.clone() });
        }
        Ok(Material {
            name: definition.name.clone(),
            diffuse,
            texture: texture.handle,
            textures: Vec::new(),
            emission: definition.emission,
            opacity,
            blend: if is_blended { Blend::Alpha } else { Blend::None },
            alpha_cutoff: is_masked.then_some(Mask::CUTOFF),
            double_sided: true,
            values: None,
        })
    }

    fn texture(
        &mut self,
        scene: &mut Scene,
        definition: &Definition,
        warnings: &mut Warnings,
    ) -> Result<CombinedTexture, SceneError> {
        let statements = [&definition.texture, &definition.mask].map(Option::as_ref);
        let names = statements.map(|statement| statement.map(|statement| statement.names[0].name.clone()));
        let known = match self.by_statements.get(&names) {
            Some(known) => known.clone(),
            None => {
                let texture = self.texture_of_statements(scene, statements, warnings)?;
                self.by_statements.insert(names, texture.clone());
                texture
            }
        };
        for (texture, reason) in known.unusable {
            warnings.push(ObjWarning::UnusableTexture { texture, material: definition.name.clone(), reason });
        }
        Ok(known.texture)
    }

    fn texture_of_statements(
        &mut self,
        scene: &mut Scene,
        statements: [Option<&TextureStatement>; 2],
        warnings: &mut Warnings,
    ) -> Result<MaterialTexture, SceneError> {
        let mut unusable = Vec::new();
        let files = statements.map(|statement| {
            let statement = statement?;
            match self.find(statement, warnings) {
                Ok(file) => return Some(file),
                // Colours and opacity may be in the same file.
                Err(error) => {
                    let failure = (statement.names[0].name.clone(), error.to_string());
                    if !unusable.contains(&failure) {
                        unusable.push(failure);
                    }
                }
            }
            None
        });
        let texture = self.texture_of_files(scene, files, &mut unusable, warnings)?;
        Ok(MaterialTexture { texture, unusable })
    }

    /// The first possible file of a statement that can be decoded.
    fn find(
        &mut self,
        TextureStatement { names, library, line }: &TextureStatement,
        warnings: &mut Warnings,
    ) -> io::Result<TextureFile> {
        let (PossibleName { name, drops_options }, pixels) = first_readable(names, |name| {
            if let Some(known) = self.files.get(name) {
                return known.as_ref().map(|()| None).map_err(|(kind, reason)| io::Error::new(*kind, reason.clone()));
            }
            let decoded = self.decode(name);
            let outcome = decoded.as_ref().map(drop).map_err(|error| (error.kind(), error.to_string()));
            self.files.insert(name.to_owned(), outcome);
            decoded.map(Some)
        })?;
        if *drops_options {
            let (library, reason) = (library.clone(), format!("the options of the texture `{name}` were left out"));
            warnings.push(ObjWarning::LibraryLine { library, line: *line, reason });
        }
        if let Some([width, height]) = pixels.as_ref().and_then(|pixels| pixels.scaled_from) {
            warnings.push(ObjWarning::ScaledTexture { texture: name.clone(), width, height });
        }
        Ok(TextureFile { name: name.clone(), pixels })
    }

    fn decode(&mut self, name: &str) -> io::Result<Pixels> {
        let of_file = Limit::new("texture_file_bytes", self.limits.texture_file_bytes);
        let mut file = (self.open)(name, of_file.min(self.decoded))?;
        self.decoded.take(file.seek(SeekFrom::End(0))?)?;
        file.rewind()?;
        let while_decoded = Limit::new("texture_bytes", self.limits.texture_bytes);
        texture::decode(name, file, while_decoded, self.all_textures, &mut self.decoded)
            .map_err(|reason| io::Error::new(io::ErrorKind::InvalidData, reason))
    }

    /// The texture of these files, which is added to the scene if there is none yet.
    fn texture_of_files(
        &mut self,
        scene: &mut Scene,
        files: [Option<TextureFile>; 2],
        unusable: &mut Vec<(String, String)>,
        warnings: &mut Warnings,
    ) -> Result<CombinedTexture, SceneError> {
        let names = files.each_ref().map(|file| file.as_ref().map(|file| file.name.clone()));
        if let Some(known) = self.by_files.get(&names) {
            return Ok(*known);
        }
        let mut is_complete = true;
        let [colors, mask] = files.map(|file| {
            let TextureFile { name, pixels } = file?;
            match pixels.map_or_else(|| self.decode(&name), Ok) {
                Ok(pixels) => Some((name, pixels)),
                Err(error) => {
                    is_complete = false;
                    unusable.push((name, error.to_string()));
                    None
                }
            }
        });
        let mask = mask.map(|(name, pixels)| (name, pixels.into_mask()));
        // One that hides nothing makes no other texture than the colours alone.
        let mask = mask.filter(|(_, pixels)| !pixels.hides_nothing());
        let used_names = [&colors, &mask].map(|used| used.as_ref().map(|(name, _)| name.clone()));
        let texture = match self.by_files.get(&used_names) {
            Some(known) => *known,
            None => self.combine(scene, colors, mask, warnings)?,
        };
        self.by_files.insert(used_names, texture);
        // Else the next material with these files would lack the reason why one of them is missing.
        if is_complete {
            self.by_files.insert(names, texture);
        }
        Ok(texture)
    }

    /// Adds a texture of colours and mask, with their names.
    fn combine(
        &mut self,
        scene: &mut Scene,
        colors: Option<(String, Pixels)>,
        mask: Option<(String, Pixels)>,
        warnings: &mut Warnings,
    ) -> Result<CombinedTexture, SceneError> {
        let mut texture = CombinedTexture {
            handle: None,
            has_colors: colors.is_some(),
            mask: mask.as_ref().map(|(_, pixels)| Mask::new(pixels)),
        };
        let (name, pixels) = match (colors, mask) {
            (None, None) => return Ok(texture),
            (Some(colors), None) => colors,
            (None, Some((name, mask))) => (name, mask.into_white()),
            (Some((name, mut pixels)), Some((mask_name, mask))) => {
                let max_bytes = self.limits.texture_bytes.min(self.all_textures.left());
                if !pixels.set_opacity(&mask, max_bytes) {
                    let Pixels { width, height, .. } = mask;
                    warnings.push(ObjWarning::ScaledTexture { texture: mask_name, width, height });
                }
                (name, pixels)
            }
        };
        self.all_textures.taken += pixels.bytes.len() as u64;
        texture.handle = Some(scene.add(Texture::new(name, pixels.width, pixels.height, pixels.bytes)?)?);
        Ok(texture)
    }
}
