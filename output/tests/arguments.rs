//! A program whose arguments are wrong, or ask for the help or the version. It is this program itself.

use std::path::Path;
use std::process::{Command, ExitCode, Output, Stdio};

use clap::Parser;
use drawloom_output::{exit_code, parse_arguments, print_line};
use libtest_mimic::{Failed, Trial};

/// Set in the environment of the program.
const IS_PROGRAM: &str = "DRAWLOOM_ARGUMENTS_PROGRAM";

/// What argument a test passes: escape sequences of one and two bytes, a bell, a character that turns
/// text, and lines of its own.
const FORGED: &str = "\u{1b}[31mred\u{7}\u{9b}2J\u{202e}\u{2028}\nerror: forged";
const ESCAPED: &str = "\\u{1b}[31mred\\u{7}\\u{9b}2J\\u{202e}\\u{2028}\\u{a}error: forged";

/// Draws leaves.
#[derive(Parser)]
#[command(name = "leaves", version = "1.2")]
struct Arguments {
    /// How many.
    #[arg(long, default_value_t = 3)]
    count: u32,
    #[arg(long, value_parser = ["oak", "elm"])]
    tree: Option<String>,
}

type Case = fn() -> Result<(), Failed>;

fn main() -> ExitCode {
    if std::env::var_os(IS_PROGRAM).is_some() {
        let arguments: Arguments = parse_arguments();
        print_line!("{} leaves of {}", arguments.count, arguments.tree.unwrap_or_default());
        return exit_code::<String>(Ok(()));
    }
    let cases: [(&str, Case); 4] = [
        ("right_arguments_are_parsed", parsed),
        ("wrong_arguments_are_escaped", wrong),
        ("help_and_version_are_printed", help),
        ("help_on_outputs_that_are_closed_full_or_unread", lost),
    ];
    let trials = cases.map(|(name, case)| Trial::test(name, case)).into();
    libtest_mimic::run(&libtest_mimic::Arguments::from_args(), trials).exit_code()
}

/// This program, run with arguments, or by a shell that redirects its outputs.
fn run(arguments: &[&str], script: Option<&str>) -> Result<Output, Failed> {
    let this = std::env::current_exe()?;
    let mut command = match script {
        Some(script) => {
            let mut shell = Command::new("sh");
            shell.args(["-c", script, "sh"]).arg(this);
            shell
        }
        None => Command::new(this),
    };
    Ok(command.args(arguments).env(IS_PROGRAM, "1").stdin(Stdio::null()).output()?)
}

fn ensure(holds: bool, what: &dyn std::fmt::Debug) -> Result<(), Failed> {
    if holds { Ok(()) } else { Err(format!("{what:?}").into()) }
}

fn parsed() -> Result<(), Failed> {
    let output = run(&["--count", "7", "--tree", "oak"], None)?;
    ensure(output.status.success() && output.stdout == b"7 leaves of oak\n" && output.stderr.is_empty(), &output)
}

fn wrong() -> Result<(), Failed> {
    let option = format!("--{FORGED}");
    for arguments in [&["--count", FORGED][..], &["--tree", FORGED], &[FORGED], &[&option], &["--count", "1", FORGED]] {
        let output = run(arguments, None)?;
        let errors = String::from_utf8(output.stderr)?;
        let is_active = |one: char| one.is_control() && one != '\n' || matches!(one, '\u{2028}' | '\u{202e}');
        ensure(output.status.code() == Some(2) && output.stdout.is_empty(), &(arguments, &output.status, &errors))?;
        ensure(errors.starts_with("error: ") && errors.contains(ESCAPED), &(arguments, &errors))?;
        ensure(errors.lines().count() > 1 && errors.ends_with(".\n"), &errors)?;
        ensure(!errors.contains(is_active), &(arguments, &errors))?;
        ensure(errors.lines().filter(|line| line.starts_with("error: ")).count() == 1, &(arguments, &errors))?;
    }
    Ok(())
}

fn help() -> Result<(), Failed> {
    for (argument, expected) in [("--help", "Draws leaves\n\nUsage: "), ("--version", "leaves 1.2\n")] {
        let output = run(&[argument], None)?;
        let printed = String::from_utf8(output.stdout)?;
        ensure(output.status.success() && output.stderr.is_empty(), &output.status)?;
        ensure(printed.starts_with(expected) && printed.ends_with('\n'), &printed)?;
    }
    Ok(())
}

fn lost() -> Result<(), Failed> {
    if !cfg!(unix) {
        return Ok(());
    }
    let statuses = [
        ("\"$@\" >&-", 0),
        ("\"$@\" >&- 2>&-", 0),
        ("{ sleep 0.1; \"$@\"; echo $? >&2; } | true", 0),
        ("\"$@\" >/dev/full", 1),
    ];
    for (script, expected) in statuses {
        if script.contains("/dev/full") && !Path::new("/dev/full").exists() {
            continue;
        }
        let output = run(&["--help"], Some(script))?;
        let errors = String::from_utf8(output.stderr)?;
        ensure(!errors.contains("panicked"), &(script, &errors))?;
        let status = errors.trim().parse().ok().or(output.status.code());
        ensure(status == Some(expected), &(script, status, &errors))?;
        let is_told = errors.starts_with("error: the standard output cannot be written");
        ensure(is_told == (expected == 1), &(script, &errors))?;
    }
    let output = run(&["--count", "many"], Some("\"$@\" 2>&-"))?;
    ensure(output.status.code() == Some(2), &output)
}
