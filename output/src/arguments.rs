//! The arguments of a program, which may hold control characters.

use std::process::exit;

use clap::Parser;
use clap::error::{ContextValue, Error};

use crate::console::{check_output, print_diagnostic, print_line, text};

/// The exit status of a program whose arguments are wrong, as clap has it.
const USAGE_STATUS: i32 = 2;

/// Parses the arguments of this program. If they are wrong, or ask for the help or the version, the program ends: see
/// [`exit_with`].
pub fn parse_arguments<A: Parser>() -> A {
    A::try_parse().unwrap_or_else(|error| exit_with(error))
}

/// Ends the program with what clap has to say. An error goes to the standard error output, with status 2. The help and
/// the version go to the standard output, with status 0, or 1 if they cannot be written there. Control characters of
/// arguments are escaped.
pub fn exit_with(error: Error) -> ! {
    let (is_error, message) = (error.use_stderr(), message_of(error));
    if is_error {
        print_diagnostic(message.trim_end());
        exit(USAGE_STATUS);
    }
    print_line(message.trim_end());
    match check_output() {
        Ok(()) => exit(0),
        Err(error) => {
            print_diagnostic(format_args!("error: {error}"));
            exit(1);
        }
    }
}

/// The message, with the arguments in it escaped: clap takes their control characters for its own styles, and leaves
/// them out of a text without styles.
fn message_of(mut error: Error) -> String {
    let escaped: Vec<_> = error.context().filter_map(|(kind, value)| Some((kind, escaped(value)?))).collect();
    for (kind, value) in escaped {
        error.insert(kind, value);
    }
    error.to_string()
}

fn escaped(value: &ContextValue) -> Option<ContextValue> {
    match value {
        ContextValue::String(value) => Some(ContextValue::String(text(value))),
        ContextValue::Strings(values) => Some(ContextValue::Strings(values.iter().map(text).collect())),
        _ => None,
    }
}
