//! A program that prints and writes a file, with outputs that nobody reads, that are full, or that are closed. It is
//! this program itself.

use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::{Command, ExitCode, Output, Stdio};

use drawloom_output::{OutputFile, exit_code, path_text, print_diagnostic, print_line, text};
use libtest_mimic::{Arguments, Failed, Trial};
use tempfile::TempDir;

/// Names the file that the program writes, in its environment.
const FILE: &str = "DRAWLOOM_CONSOLE_FILE";

type Case = fn() -> Result<(), Failed>;

fn main() -> ExitCode {
    if let Some(file) = std::env::var_os(FILE) {
        return exit_code(program(Path::new(&file)));
    }
    let cases: [(&str, Case); 6] = [
        ("what_is_printed_is_read", read),
        ("an_output_that_nobody_reads_is_no_error", unread),
        ("a_full_output_is_an_error_after_the_files", full),
        ("closed_outputs_end_nothing", closed),
        ("an_error_is_told_with_the_status", failed),
        ("control_characters_are_escaped_everywhere", escaped),
    ];
    let trials = cases.map(|(name, case)| Trial::test(name, case)).into();
    libtest_mimic::run(&Arguments::from_args(), trials).exit_code()
}

/// Prints more than a pipe holds, then writes the file, then prints again.
fn program(path: &Path) -> Result<(), Box<dyn Error>> {
    let mut events = drawloom_output::diagnostics();
    std::io::Write::write_all(&mut events, b"an event of \x1b[31m\n")?;
    for number in 0..20_000 {
        print_line!("line {number}");
    }
    print_diagnostic!("warning: {}", "\u{1b}]0;title\u{7}");
    let file = OutputFile::new(path)?;
    file.write_all("content")?;
    print_line!();
    print_line!("the leaf {}", text("oak\u{1b}[2J\nerror: forged"));
    print_line!("{} written", path_text(file.path()));
    Ok(())
}

/// This program, run with a file in a new folder, and what it left of that.
fn run(name: &str, script: Option<&str>) -> Result<(Output, Option<String>), Failed> {
    let (folder, this) = (TempDir::new()?, std::env::current_exe()?);
    let mut command = match script {
        Some(script) => Command::new(script.split(' ').next().unwrap_or_default()),
        None => Command::new(&this),
    };
    if let Some(script) = script {
        command.args(["-c", &script[3..]]).arg("sh").arg(&this);
    }
    let file = folder.path().join(name);
    let output = command.env(FILE, &file).stdin(Stdio::null()).output()?;
    Ok((output, fs::read_to_string(file).ok()))
}

fn ensure(holds: bool, what: &dyn std::fmt::Debug) -> Result<(), Failed> {
    if holds { Ok(()) } else { Err(format!("{what:?}").into()) }
}

fn written(content: &Option<String>) -> bool {
    content.as_deref() == Some("content")
}

fn read() -> Result<(), Failed> {
    let (output, content) = run("a.txt", None)?;
    ensure(output.status.success() && written(&content), &output.status)?;
    let printed = String::from_utf8(output.stdout)?;
    ensure(printed.lines().count() == 20_003 && printed.ends_with("a.txt written\n"), &printed.len())
}

fn unread() -> Result<(), Failed> {
    if !cfg!(unix) {
        return Ok(());
    }
    for script in ["sh { \"$1\"; echo $? >&2; } | true", "sh { \"$1\"; echo $? >&2; } | head -n 1"] {
        let (output, content) = run("a.txt", Some(script))?;
        let errors = String::from_utf8(output.stderr)?;
        ensure(errors.ends_with("\n0\n") && written(&content) && !errors.contains("panicked"), &errors)?;
    }
    Ok(())
}

fn full() -> Result<(), Failed> {
    if !Path::new("/dev/full").exists() {
        return Ok(());
    }
    let (output, content) = run("a.txt", Some("sh \"$1\" >/dev/full"))?;
    let errors = String::from_utf8(output.stderr)?;
    ensure(output.status.code() == Some(1) && written(&content), &(output.status, &content))?;
    ensure(
        errors.lines().filter(|line| line.starts_with("error: the standard output cannot be written")).count() == 1,
        &errors,
    )?;
    // Nowhere is left to say so, but the status.
    let (output, content) = run("a.txt", Some("sh \"$1\" >/dev/full 2>/dev/full"))?;
    ensure(output.status.code() == Some(1) && written(&content), &output)
}

fn closed() -> Result<(), Failed> {
    if !cfg!(unix) {
        return Ok(());
    }
    for script in ["sh \"$1\" >&-", "sh \"$1\" 2>&-", "sh \"$1\" >&- 2>&-", "sh \"$1\" 2>&1 | true"] {
        let (output, content) = run("a.txt", Some(script))?;
        ensure(output.status.success() && written(&content), &(script, &output))?;
    }
    Ok(())
}

fn failed() -> Result<(), Failed> {
    let (output, content) = run("missing/a.txt", None)?;
    let errors = String::from_utf8(output.stderr)?;
    ensure(output.status.code() == Some(1) && content.is_none(), &output.status)?;
    ensure(errors.lines().any(|line| line.starts_with("error: ") && line.contains("is no folder")), &errors)
}

fn escaped() -> Result<(), Failed> {
    let name = if cfg!(unix) { "a\u{1b}[31m.txt" } else { "a.txt" };
    let (output, _) = run(name, None)?;
    let printed = [String::from_utf8(output.stdout)?, String::from_utf8(output.stderr)?].concat();
    let controls: Vec<_> = printed.chars().filter(|one| one.is_control() && *one != '\n').collect();
    ensure(controls.is_empty() && printed.contains("the leaf oak\\u{1b}[2J\\u{a}error: forged\n"), &controls)
}
