//! Compiles WGSL, and reports errors at the lines of the process's own text.

use crate::backend::BackendError;
use crate::backend::error::broken_rule;
use crate::backend::wgpu::error_scope::with_error_scope;

/// Compiles the [complete text](complete_text) of the shader of a process.
///
/// # Errors
/// If it does not compile: [`BackendError::Shader`], with the line and column in that of the process's own texts which
/// has the error.
pub(super) fn compile_shader(
    device: &wgpu::Device,
    process: &str,
    complete: &str,
    before: &str,
    own: &[(&'static str, &str)],
) -> Result<wgpu::ShaderModule, BackendError> {
    let source = wgpu::ShaderSource::Wgsl(complete.into());
    let mut created = None;
    let outcome = with_error_scope(device, process, || {
        // No name of a process: another one with the same text has this module too.
        let label = Some("shader of one text");
        created = Some(device.create_shader_module(wgpu::ShaderModuleDescriptor { label, source }));
    });
    let module = created.ok_or_else(|| broken_rule("a shader module is made, right or wrong"))?;
    match outcome {
        Ok(()) => Ok(module),
        Err(error) => Err(located(process, before, own, &module).unwrap_or(error)),
    }
}

/// What errors call the shader of a process.
pub(crate) fn shader_label(process: &str) -> String {
    format!("the shader of {process:?}")
}

/// The text that is compiled: a process's own texts of WGSL behind what the crate puts before them.
pub(super) fn complete_text(before: &str, own: &[(&'static str, &str)]) -> String {
    let texts: Vec<_> = std::iter::once(before).chain(own.iter().map(|(_, text)| *text)).collect();
    texts.join("\n")
}

/// The first error of a shader at its line; `None` if it is not in one of the process's own texts, which follow after
/// `before`.
fn located(
    process: &str,
    before: &str,
    own: &[(&'static str, &str)],
    module: &wgpu::ShaderModule,
) -> Option<BackendError> {
    // The future is ready at once on every native backend.
    let messages = pollster::block_on(module.get_compilation_info()).messages;
    let (message, location) = messages.into_iter().find_map(|message| Some((message.message, message.location?)))?;
    let mut offset = (location.offset as usize).checked_sub(before.len() + 1)?;
    let (part, own) = *own.iter().find(|(_, own)| match offset.checked_sub(own.len() + 1) {
        None => true,
        Some(in_later) => {
            offset = in_later;
            false
        }
    })?;
    let (line, column, text) = line_and_column(own, offset)?;
    let (process, message, text) = (process.to_owned(), without_excerpts(&message), text.to_owned());
    Some(BackendError::Shader { process, part, line, column, message, text })
}

/// What a diagnostic of wgpu says, without its excerpts, whose lines are counted from the beginning of the prelude: its
/// first line, and the notes on the cause.
fn without_excerpts(diagnostic: &str) -> String {
    let mut lines = diagnostic.lines().map(str::trim).filter(|line| !line.is_empty());
    let first = lines.next().unwrap_or_default();
    let first = first.split_once("error: ").map_or(first, |(_, what)| what);
    let notes = lines.filter_map(|line| line.strip_prefix("= ")).map(|note| format!("; {note}"));
    [first.to_owned()].into_iter().chain(notes).collect()
}

/// The line and the column of a byte, both from 1, and the line's text; `None` past the end.
fn line_and_column(text: &str, offset: usize) -> Option<(usize, usize, &str)> {
    let before = text.get(..offset)?;
    let line = before.matches('\n').count();
    let column = before.rsplit('\n').next()?.chars().count();
    Some((line + 1, column + 1, text.lines().nth(line).unwrap_or_default().trim_end()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::wgpu::noop_device::noop_device;

    #[test]
    fn bytes_have_lines_and_columns() {
        let text = "ab\nçd\n\nx";
        assert_eq!(line_and_column(text, 0), Some((1, 1, "ab")));
        assert_eq!(line_and_column(text, 2), Some((1, 3, "ab")));
        assert_eq!(line_and_column(text, 5), Some((2, 2, "çd")));
        assert_eq!(line_and_column(text, 7), Some((3, 1, "")));
        assert_eq!(line_and_column(text, 8), Some((4, 1, "x")));
        assert_eq!(line_and_column(text, 4), None, "amid a character");
        assert_eq!(line_and_column(text, 99), None);
    }

    #[test]
    fn errors_are_at_the_lines_of_the_process() {
        let (device, _) = noop_device();
        let compile_shader =
            |process, before, own: &[_]| compile_shader(&device, process, &complete_text(before, own), before, own);
        let before = "const A: u32 = 1u;\n// two lines\n";
        let own = "@fragment\nfn fragment() -> @location(0) vec4<f32> {\n    return vec4<f32>(unknown);\n}\n";
        let error =
            compile_shader("wrong", before, &[("deformation", "const B: u32 = A;"), ("shader", own)]).unwrap_err();
        let BackendError::Shader { process, line, column, text, .. } = &error else { panic!("{error}") };
        assert_eq!(
            (process.as_str(), *line, *column, text.as_str()),
            ("wrong", 3, 22, "    return vec4<f32>(unknown);")
        );
        let message = error.to_string();
        assert!(message.contains("`unknown`") && !message.contains("wgsl:"), "{error}");
        let invalid = "@fragment\nfn fragment() -> @location(0) vec4<f32> {\n    return 1u;\n}\n";
        let invalid = compile_shader("invalid", before, &[("shader", invalid)]).unwrap_err();
        let reports_error = matches!(&invalid, BackendError::Shader { message, .. } if !message.contains("wgsl:"));
        assert!(reports_error && invalid.to_string().contains("return"), "{invalid}");
        let syntax =
            compile_shader("wrong", before, &[("deformation", "\nfn fragment( {"), ("shader", own)]).unwrap_err();
        assert!(matches!(syntax, BackendError::Shader { part: "deformation", line: 2, .. }), "{syntax}");
        let twice = compile_shader("twice", before, &[("shader", "const A: u32 = 2u;")]).unwrap_err();
        assert!(matches!(&twice, BackendError::Shader { line: 1, .. }), "{twice}");
        assert!(compile_shader("right", before, &[("deformation", ""), ("shader", "const B: u32 = A;")]).is_ok());
    }
}
