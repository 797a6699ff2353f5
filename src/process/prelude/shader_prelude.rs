//! The WGSL that every shader begins with.

/// The bindings, structures and functions that Drawloom provides to every shader. A process's own WGSL is appended to
/// it. See `drawloom.wgsl` for what a process may use.
///
/// It does not compile by itself. `const ABSOLUTE_TRANSFORMS: bool = false;` goes before it, or `true` for
/// [`TransformPrecision::Absolute`](crate::quality::TransformPrecision::Absolute). The backend adds that line to the
/// shaders of a frame's processes; whoever compiles the prelude elsewhere adds it themselves.
pub const SHADER_PRELUDE: &str = concat!(include_str!("drawloom.wgsl"), "\n", include_str!("light_volume.wgsl"));
