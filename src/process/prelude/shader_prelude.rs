//! The WGSL that every shader begins with.

use std::sync::LazyLock;

#[cfg(feature = "wgpu")]
use crate::scene::AttributeLayout;
use crate::scene::{LightKind, LightRules, LightVolume, ShadowProjection};
use crate::view::LightClass;

/// The bindings, structures and functions that Drawloom provides to every shader. A process's own WGSL is appended to
/// it. See `drawloom.wgsl` for what a process may use.
///
/// It does not compile by itself. `const ABSOLUTE_TRANSFORMS: bool = false;` goes before it, or `true` for
/// [`TransformPrecision::Absolute`](crate::quality::TransformPrecision::Absolute). The backend adds that line to the
/// shaders of a frame's processes; whoever compiles the prelude elsewhere adds it themselves.
///
/// `VertexInput` has further fields in the shaders of processes that [read
/// attributes](crate::process::Declare::reads_attribute), and `deform` is the process's own if it [has
/// one](crate::process::CommandDraws::deformation).
pub static SHADER_PRELUDE: LazyLock<String> =
    LazyLock::new(|| compose(include_str!("vertex_input.wgsl"), include_str!("no_deformation.wgsl"), true));

/// The prelude for a process that reads these attributes. With a deformation, the process brings the function `deform`.
/// `clamps_corners` says whether corners in front of the near plane of a directional light's map are moved onto it: not
/// if its pipelines clamp pixels instead.
#[cfg(feature = "wgpu")]
pub(crate) fn prelude_with(attributes: &[AttributeLayout], has_deformation: bool, clamps_corners: bool) -> String {
    let vertex_input = include_str!("vertex_input.wgsl");
    let fields = (FIRST_OWN_LOCATION..).zip(attributes).map(|(location, AttributeLayout { name, format })| {
        format!("    @location({location}) {name}: {},\n", format.wgsl_type())
    });
    let vertex_input =
        vertex_input.replace(END_OF_FIELDS, &fields.chain([END_OF_FIELDS.to_owned()]).collect::<String>());
    let deformation = if has_deformation { "" } else { include_str!("no_deformation.wgsl") };
    compose(&vertex_input, deformation, clamps_corners)
}

fn compose(vertex_input: &str, deformation: &str, clamps_corners: bool) -> String {
    let clamps_corners = format!("\nconst CLAMPS_CORNERS: bool = {clamps_corners};\n\n");
    let (own, light_volume) = (include_str!("drawloom.wgsl"), include_str!("light_volume.wgsl"));
    [own, &light_kinds(), &clamps_corners, light_volume, "\n", vertex_input, deformation].concat()
}

/// What shaders know of the kinds of lights, of [`LightKind::ALL`] and [`LightKind::rules`]: a constant for each kind,
/// the number of vectors that the ends of the light classes are in, and functions that say which kinds have what.
fn light_kinds() -> String {
    let constant = |kind: LightKind| format!("const {}: u32 = {}u;\n", kind.name().to_uppercase(), kind as u32);
    let mut text: String = LightKind::ALL.into_iter().map(constant).collect();
    text += &format!("const LIGHT_CLASS_VECTORS: u32 = {}u;\n", LightClass::COUNT.div_ceil(4));
    let mut define = |function: &str, has: &dyn Fn(&LightRules) -> bool| {
        let kinds = LightKind::ALL.into_iter().filter(|kind| has(kind.rules()));
        let tests: Vec<_> = kinds.map(|kind| format!("kind == {}", kind.name().to_uppercase())).collect();
        let any = if tests.is_empty() { "false".to_owned() } else { tests.join(" || ") };
        text += &format!("fn {function}(kind: u32) -> bool {{ return {any}; }}\n");
    };
    define("reaches_everything", &|rules| !rules.is_bounded());
    define("has_cone_volume", &|rules| rules.volume == LightVolume::Cone);
    define("has_cube_map", &|rules| rules.maps == ShadowProjection::Cube);
    define("has_paraboloid_map", &|rules| rules.maps == ShadowProjection::Paraboloid);
    text
}

/// The location of the first attribute of the engine's own, behind those of `VertexInput`.
#[cfg(feature = "wgpu")]
pub(crate) const FIRST_OWN_LOCATION: u32 = 3;

/// The last field of `VertexInput`.
#[cfg(feature = "wgpu")]
const END_OF_FIELDS: &str = "    @builtin(instance_index) instance: u32,\n";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shaders_know_the_kinds_of_lights() {
        let text = light_kinds();
        for expected in [
            "const DIRECTIONAL: u32 = 0u;",
            "const HEMISPHERICAL: u32 = 3u;",
            "const LIGHT_CLASS_VECTORS: u32 = 2u;",
            "fn reaches_everything(kind: u32) -> bool { return kind == DIRECTIONAL; }",
            "fn has_cone_volume(kind: u32) -> bool { return kind == SPOT || kind == HEMISPHERICAL; }",
            "fn has_cube_map(kind: u32) -> bool { return kind == POINT; }",
            "fn has_paraboloid_map(kind: u32) -> bool { return kind == HEMISPHERICAL; }",
        ] {
            assert!(text.contains(expected), "{expected} is not in {text}");
        }
        assert!(SHADER_PRELUDE.contains(&text));
    }
}
