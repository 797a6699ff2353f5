//! Shaders that leave out pixels, of processes that do not say so.

use wgpu::naga::front::wgsl;
use wgpu::naga::{Binding, Block, BuiltIn, Function, Module, ShaderStage, Statement, TypeInner};

use crate::command::Blending;
use crate::process::{Draws, ShadowCasters};
use crate::unwind::emit_unlocked;

/// Warns if a fragment shader, which compiles, discards pixels or returns a depth, and its process does not say so: its
/// objects then hide from culling what is seen through their holes.
pub(super) fn warn_of_undeclared_discards(process: &str, draws: &Draws<'_>, before: &str, own: &[(&str, &str)]) {
    let Draws::Commands(commands) = draws else { return };
    // It discards in maps of paraboloids, in which nothing hides anything.
    if process == ShadowCasters::NAME {
        return;
    }
    let may_hide = draws.hides() && commands.selection.blending != Blending::Blended;
    if let Some(fragment) = commands.fragment.filter(|_| may_hide)
        && leaves_out_pixels(fragment, commands.masked.map(|masked| masked.fragment), before, own)
    {
        let process = process.to_owned();
        emit_unlocked(move || {
            tracing::warn!(
                target: "drawloom", %process,
                "discards pixels, or returns their depth, and does not set `CommandDraws::discards`: its objects hide what is seen through \
                 their holes from occlusion culling"
            );
        });
    }
}

/// Whether a process's fragment entry point discards pixels or returns a depth; `masked` is the one of masked objects,
/// which may. `own` are the process's own texts of WGSL, each with what it is.
fn leaves_out_pixels(fragment: &str, masked: Option<&str>, before: &str, own: &[(&str, &str)]) -> bool {
    let may_leave_out = |text: &str| text.contains("discard") || text.contains("frag_depth");
    let around_masked = |text| masked.and_then(|masked| around_function(text, masked)).unwrap_or([text, ""]);
    // Parsing takes about as long as wgpu needs to make the module.
    if !own.iter().flat_map(|(_, text)| around_masked(*text)).any(may_leave_out) {
        return false;
    }
    let texts: Vec<_> = std::iter::once(before).chain(own.iter().map(|(_, text)| *text)).collect();
    // An error means that it uses extensions of the language that only the device knows.
    let Ok(module) = wgsl::parse_str(&texts.join("\n")) else { return false };
    let mut entry_points = module.entry_points.iter();
    let is_drawn = |name: &str, stage| name == fragment && stage == ShaderStage::Fragment;
    let entry_point = entry_points.find(|entry_point| is_drawn(&entry_point.name, entry_point.stage));
    entry_point.is_some_and(|entry_point| {
        returns_depth(&module, &entry_point.function) || discards(&module, &entry_point.function.body)
    })
}

/// The text before and behind a function; `None` if there is no such function, or its braces are not in pairs.
fn around_function<'a>(text: &'a str, name: &str) -> Option<[&'a str; 2]> {
    let start = text.find(&format!("fn {name}("))?;
    let mut depth = 0_usize;
    for (offset, brace) in text[start..].match_indices(['{', '}']) {
        depth = if brace == "{" { depth + 1 } else { depth.checked_sub(1)? };
        if depth == 0 {
            return Some([&text[..start], &text[start + offset + 1..]]);
        }
    }
    None
}

fn returns_depth(module: &Module, function: &Function) -> bool {
    let is_depth = |binding: &Option<Binding>| matches!(binding, Some(Binding::BuiltIn(BuiltIn::FragDepth)));
    function.result.as_ref().is_some_and(|result| match &module.types[result.ty].inner {
        TypeInner::Struct { members, .. } => members.iter().any(|member| is_depth(&member.binding)),
        _ => is_depth(&result.binding),
    })
}

/// Whether a block discards the pixel, or a function that it calls does. WGSL has no recursion.
fn discards(module: &Module, block: &Block) -> bool {
    block.iter().any(|statement| match statement {
        Statement::Kill => true,
        Statement::Block(block) => discards(module, block),
        Statement::If { accept, reject, .. } => discards(module, accept) || discards(module, reject),
        Statement::Switch { cases, .. } => cases.iter().any(|case| discards(module, &case.body)),
        Statement::Loop { body, continuing, .. } => discards(module, body) || discards(module, continuing),
        Statement::Call { function, .. } => discards(module, &module.functions[*function].body),
        _ => false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_function_is_cut_out_at_its_own_braces() {
        let text = "fn a() {} fn b(x: u32) { if x > 1u { loop { break; } } } fn c() {}";
        assert_eq!(around_function(text, "b"), Some(["fn a() {} ", " fn c() {}"]));
        assert_eq!(around_function(text, "d"), None);
        assert_eq!(around_function("fn b( { {}", "b"), None);
    }

    #[test]
    fn discarded_pixels_and_returned_depths_are_found() {
        let found = |text: &str| {
            leaves_out_pixels("fragment", Some("masked_fragment"), "const A: u32 = 1u;", &[("shader", text)])
        };
        for body in [
            "discard;",
            "if x > 1.0 { discard; }",
            "if x > 1.0 { return; } else { loop { if x > 2.0 { discard; } break; } }",
            "switch A { case 0u: { discard; } default: {} }",
            "inner(x);",
        ] {
            let text = format!(
                "fn inner(x: f32) {{ if x > 3.0 {{ discard; }} }}
                @fragment fn fragment(@location(0) x: f32) {{ {body} }}"
            );
            assert!(found(&text), "{body}");
        }
        assert!(found("@fragment fn fragment() -> @builtin(frag_depth) f32 { return 0.5; }"));
        let in_structure = "struct Out { @location(0) color: vec4<f32>, @builtin(frag_depth) depth: f32 }
            @fragment fn fragment() -> Out { return Out(vec4<f32>(), 0.5); }";
        assert!(found(in_structure));
        // Beside an entry point for masked objects that discards, too.
        for text in [
            "@fragment fn masked_fragment() { if A > 0u { discard; } } @fragment fn fragment() { discard; }",
            "fn hole() { discard; } @fragment fn fragment() { hole(); } @fragment fn masked_fragment() { hole(); }",
            "@fragment fn masked_fragment() { /* { */ discard; } @fragment fn fragment() { discard; }",
        ] {
            assert!(found(text), "{text}");
        }
        // In a comment, in another entry point, and in none.
        for text in [
            "// discard\n@fragment fn fragment() -> @location(0) vec4<f32> { return vec4<f32>(); }",
            "@fragment fn fragment() {} @fragment fn masked_fragment() { discard; }",
            "@fragment fn fragment() {} fn unused() { discard; }",
            "@fragment fn fragment() {}",
            "@vertex fn vertex() -> @builtin(position) vec4<f32> { return vec4<f32>(); } // discard",
            "this is no WGSL: discard",
        ] {
            assert!(!found(text), "{text}");
        }
    }
}
