//! The WGSL that every shader begins with.

#[cfg(feature = "wgpu")]
use crate::scene::AttributeLayout;

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
pub const SHADER_PRELUDE: &str = concat!(
    include_str!("drawloom.wgsl"),
    "\nconst CLAMPS_CORNERS: bool = true;\n",
    "\n",
    include_str!("light_volume.wgsl"),
    "\n",
    include_str!("vertex_input.wgsl"),
    include_str!("no_deformation.wgsl")
);

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
    let clamps_corners = format!("\nconst CLAMPS_CORNERS: bool = {clamps_corners};\n");
    [
        include_str!("drawloom.wgsl"),
        &clamps_corners,
        "\n",
        include_str!("light_volume.wgsl"),
        "\n",
        &vertex_input,
        deformation,
    ]
    .concat()
}

/// The location of the first attribute of the engine's own, behind those of `VertexInput`.
#[cfg(feature = "wgpu")]
pub(crate) const FIRST_OWN_LOCATION: u32 = 3;

/// The last field of `VertexInput`.
#[cfg(feature = "wgpu")]
const END_OF_FIELDS: &str = "    @builtin(instance_index) instance: u32,\n";
