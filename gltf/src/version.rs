//! The version of glTF that a file is of.

use crate::error::{Problem, excerpt};
use crate::json::Json;
use crate::warnings::Warnings;

/// Checks that a loader of glTF 2.0 can read the file.
///
/// # Errors
/// If it is of another major version, needs a later minor one, or does not say which.
pub(crate) fn check_version(root: &Json, warnings: &mut Warnings) -> Result<(), Problem> {
    let Some(asset) = root.get("asset") else {
        return Err(Problem::Version { found: "no `asset`, and so no version".to_owned() });
    };
    let Some([major, minor]) = version(asset, "version")? else {
        return Err(Problem::Version { found: "no `asset.version`".to_owned() });
    };
    let found = |member: &str, [major, minor]: [u32; 2]| {
        Err(Problem::Version { found: format!("the `asset.{member}` {major}.{minor}") })
    };
    if major != 2 {
        return found("version", [major, minor]);
    }
    match version(asset, "minVersion")? {
        Some(least) if least > [2, 0] => return found("minVersion", least),
        _ => {}
    }
    if minor > 0 {
        warnings.add(format!("it is of version 2.{minor}, and is read as 2.0"));
    }
    Ok(())
}

fn version(asset: &Json, member: &str) -> Result<Option<[u32; 2]>, Problem> {
    let Some(json) = asset.get(member) else { return Ok(None) };
    let shown = match json {
        Json::Text(text) => {
            let number = |digits: &str| {
                let is_number = !digits.is_empty() && digits.bytes().all(|digit| digit.is_ascii_digit());
                // A number that is too large for the type is still a later version.
                is_number.then(|| digits.parse().unwrap_or(u32::MAX))
            };
            let parts = text.split_once('.').and_then(|(major, minor)| Some([number(major)?, number(minor)?]));
            if parts.is_some() {
                return Ok(parts);
            }
            format!("\"{}\"", excerpt(text))
        }
        Json::Number(number) => format!("{number} without quotes"),
        _ => "of another type".to_owned(),
    };
    Err(Problem::Version { found: format!("the `asset.{member}` {shown}, which is not of the form \"2.0\",") })
}
