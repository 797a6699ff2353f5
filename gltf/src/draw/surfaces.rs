//! Metallic-roughness surfaces: the processes that draw them.

use drawloom::command::Selection;
use drawloom::process::{
    CommandDraws, Declare, Deformation, Draws, ILLUMINATION_SHADER, InjectionPoint, RenderProcess, ShaderResource,
    targets,
};
use drawloom::scene::ViewKind;

use super::deformation::SkinsAndMorphs;
use crate::attributes::{COLOR, DEFORMED, RIGID, SECOND_UV, TANGENT};
use crate::surface::{MASKED_SURFACE, SURFACE};
use crate::surface_kind::SurfaceKind;

/// Draws surfaces of a kind, those that are deformed or those that are not, lit by all lights with their shadows.
pub(crate) struct Surfaces {
    name: String,
    kind: SurfaceKind,
    deformation: Option<SkinsAndMorphs>,
    /// The name of the process that it comes after.
    previous: Option<String>,
    shader: String,
    resources: Vec<ShaderResource<'static>>,
}

impl Surfaces {
    /// Processes that draw into one target need an order: this one comes after `previous`.
    pub(crate) fn new(kind: SurfaceKind, deformation: Option<SkinsAndMorphs>, previous: Option<String>) -> Self {
        let of_deformation = deformation.as_ref().map(|deformation| deformation.resources().into_iter().map(owned));
        let resources = of_deformation.into_iter().flatten().collect();
        // After the column of poses.
        let materials = u32::from(deformation.is_some());
        let binding =
            format!("@group(3) @binding({materials}) var<storage, read> gltf_materials: array<GltfMaterial>;");
        let shader = [ILLUMINATION_SHADER, include_str!("shadows.wgsl"), &binding, include_str!("surfaces.wgsl")];
        let of = if deformation.is_some() { "deformed surfaces" } else { "surfaces" };
        let name = format!("{kind:?} {of}").to_lowercase();
        Self { name, kind, deformation, previous, shader: shader.join("\n"), resources }
    }
}

impl RenderProcess for Surfaces {
    fn name(&self) -> &str {
        &self.name
    }

    fn declare(&self, declare: &mut Declare) {
        match self.kind {
            SurfaceKind::Blended => {
                declare.at(InjectionPoint::AfterTransparency);
                declare.tests_depth(targets::DEPTH);
            }
            SurfaceKind::MaskedCasters => {
                declare.views(ViewKind::Shadow);
                declare.draws_depth(targets::SHADOW_MAP);
            }
            SurfaceKind::Opaque | SurfaceKind::Masked => {
                declare.at(InjectionPoint::AfterLighting);
                declare.draws_depth(targets::DEPTH);
            }
        }
        if let Some(previous) = &self.previous {
            declare.after(previous);
        }
        if self.kind != SurfaceKind::MaskedCasters {
            declare.draws_over(targets::RADIANCE);
            declare.samples_layers(ViewKind::Shadow, targets::SHADOW_MAP);
        }
        if let Some(deformation) = &self.deformation {
            deformation.declare(declare);
        } else {
            declare.reads_attribute(TANGENT, [0.0; 4]);
        }
        declare.reads_materials(if self.kind.has_holes() { MASKED_SURFACE } else { SURFACE });
        declare.reads_attribute(SECOND_UV, [0.0; 2]);
        declare.reads_attribute(COLOR, [1.0; 4]);
    }

    fn draws(&self) -> Draws<'_> {
        let selection = match self.kind {
            SurfaceKind::Opaque => Selection::OPAQUE.of_material_type(SURFACE),
            SurfaceKind::Masked | SurfaceKind::MaskedCasters => Selection::OPAQUE.of_material_type(MASKED_SURFACE),
            SurfaceKind::Blended => Selection::BLENDED.of_material_type(SURFACE),
        };
        Draws::Commands(CommandDraws {
            shader: &self.shader,
            deformation: self.deformation.as_ref().map(Deformation::shader),
            selection: selection.in_layers(if self.deformation.is_some() { DEFORMED } else { RIGID }),
            fragment: Some(if self.kind == SurfaceKind::MaskedCasters { "caster" } else { "fragment" }),
            discards: self.kind.has_holes(),
            writes_depth: self.kind != SurfaceKind::Blended,
            resources: self.resources.clone(),
            ..CommandDraws::default()
        })
    }
}

/// Resources whose bytes are shared borrow nothing.
fn owned(resource: ShaderResource<'_>) -> ShaderResource<'static> {
    match resource {
        ShaderResource::SharedBytes(bytes) => ShaderResource::SharedBytes(bytes),
        ShaderResource::Bytes(bytes) => ShaderResource::SharedBytes((*bytes).into()),
        ShaderResource::Buffer(buffer) => ShaderResource::Buffer(buffer),
        ShaderResource::Texture { view, dimension } => ShaderResource::Texture { view, dimension },
        ShaderResource::Sampler { sampler, kind } => ShaderResource::Sampler { sampler, kind },
        _ => unreachable!("a deformation has bytes only"),
    }
}
