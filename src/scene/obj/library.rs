//! Material libraries, the `.mtl` files beside an OBJ file.
//!
//! tobj does not parse them, because it rejects a whole library for one malformed line without naming the line, and panics on
//! a colour of one number, which the format allows.

use glam::Vec3;

use super::error::ObjWarning;
use super::preprocessing::statements;

/// A material as its library defines it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Definition {
    pub name: String,
    pub diffuse: Option<Vec3>,
    pub emission: Vec3,
    /// 1 is opaque.
    pub opacity: Option<f32>,
    /// Relative to the OBJ file.
    pub texture: Option<String>,
}

/// Every material that `text` defines. A malformed line is left out, with a warning.
pub(super) fn definitions(library: &str, text: &str, warnings: &mut Vec<ObjWarning>) -> Vec<Definition> {
    let mut found: Vec<Definition> = Vec::new();
    for (line, statement) in statements(text) {
        let (keyword, rest) = statement.split_once(char::is_whitespace).unwrap_or((&statement, ""));
        let rest = rest.trim();
        let mut warn =
            |reason: String| warnings.push(ObjWarning::LibraryLine { library: library.to_owned(), line, reason });
        if keyword == "newmtl" {
            found.push(Definition { name: rest.to_owned(), ..Definition::default() });
            continue;
        }
        if !["Kd", "Ke", "d", "Tr", "map_Kd"].contains(&keyword) {
            continue;
        }
        let Some(definition) = found.last_mut() else {
            warn(format!("`{keyword}` before the first `newmtl` was left out"));
            continue;
        };
        match keyword {
            "Kd" => definition.diffuse = color(rest, 1.0, &mut warn).or(definition.diffuse),
            "Ke" => definition.emission = color(rest, f32::MAX, &mut warn).unwrap_or(definition.emission),
            "d" => definition.opacity = opacity(rest, &mut warn).or(definition.opacity),
            "Tr" => {
                definition.opacity =
                    opacity(rest, &mut warn).map(|transparency| 1.0 - transparency).or(definition.opacity)
            }
            _ => definition.texture = texture(library, rest, &mut warn).or(definition.texture.take()),
        }
    }
    found
}

/// A colour: one number for all channels, or one for each, clamped to 0 to `max`.
fn color(values: &str, max: f32, warn: &mut impl FnMut(String)) -> Option<Vec3> {
    let numbers = values.split_once('#').map_or(values, |(numbers, _)| numbers);
    let numbers: Result<Vec<f32>, _> = numbers.split_whitespace().map(str::parse).collect();
    let color = match numbers.as_deref() {
        Ok([red, green, blue, ..]) => Vec3::new(*red, *green, *blue),
        Ok([gray]) => Vec3::splat(*gray),
        _ => Vec3::NAN,
    };
    if !color.is_finite() {
        warn(format!("`{values}` is not a colour, and was left out"));
        return None;
    }
    let clamped = color.clamp(Vec3::ZERO, Vec3::splat(max));
    if clamped != color {
        warn(format!("the colour `{values}` was clamped"));
    }
    Some(clamped)
}

fn opacity(values: &str, warn: &mut impl FnMut(String)) -> Option<f32> {
    // `-halo` makes the rim of a curved surface more opaque than its middle; a uniform opacity approximates that.
    let number = values.trim_start_matches("-halo").split_whitespace().next().and_then(|word| word.parse::<f32>().ok());
    match number {
        Some(opacity) if (0.0..=1.0).contains(&opacity) => Some(opacity),
        _ => {
            warn(format!("`{values}` is not a number from 0 to 1, and was left out"));
            None
        }
    }
}

/// The name of a texture file, which may contain spaces, after options with values.
fn texture(library: &str, values: &str, warn: &mut impl FnMut(String)) -> Option<String> {
    let mut rest = values;
    while rest.starts_with('-') {
        let (option, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
        let max_values = match option {
            "-o" | "-s" | "-t" => 3,
            "-mm" => 2,
            "-blendu" | "-blendv" | "-bm" | "-boost" | "-cc" | "-clamp" | "-imfchan" | "-texres" | "-type" => 1,
            // A name that starts with a dash.
            _ => break,
        };
        warn(format!("the texture option `{option}` was left out"));
        rest = after.trim_start();
        for number in 0..max_values {
            let (value, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
            // The second and third value are optional.
            if number > 0 && value.parse::<f32>().is_err() {
                break;
            }
            rest = after.trim_start();
        }
    }
    if rest.is_empty() {
        warn(String::from("a texture without a name was left out"));
        return None;
    }
    let folder = library.rfind(['/', '\\']).map_or("", |slash| &library[..=slash]);
    Some(format!("{folder}{rest}").replace('\\', "/"))
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;

    fn parse_one(text: &str) -> (Definition, usize) {
        let mut warnings = Vec::new();
        let found = definitions("folder\\a.mtl", &format!("newmtl\ta name\t\n{text}"), &mut warnings);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].name, "a name");
        (found[0].clone(), warnings.len())
    }

    #[test]
    fn statements_of_a_library_are_parsed() {
        assert_eq!(parse_one("Kd 0.5").0.diffuse, Some(Vec3::splat(0.5)));
        assert_eq!(parse_one("Kd 0.1 0.2 0.3 # red").0.diffuse, Some(Vec3::new(0.1, 0.2, 0.3)));
        assert_eq!(parse_one("Ke 17 12 4").0.emission, Vec3::new(17.0, 12.0, 4.0));
        assert_eq!(parse_one("Tr 0.25").0.opacity, Some(0.75));
        assert_eq!(parse_one("d -halo 0.25").0.opacity, Some(0.25));
        assert_eq!(parse_one("map_Kd in\\a file.png").0.texture.as_deref(), Some("folder/in/a file.png"));
        assert_eq!(parse_one("map_Kd -s 2 2 -bm 1 -clamp on -x.png"), {
            let texture = Some(String::from("folder/-x.png"));
            (Definition { name: String::from("a name"), texture, ..Definition::default() }, 3)
        });
    }

    #[test]
    fn only_a_malformed_line_is_left_out() {
        for bad in ["Kd 0.1 0.2", "Kd red", "Kd nan 0 0", "Ke inf 0 0", "d 2", "d", "map_Kd", "map_Kd -s 1", "Kd"] {
            let (definition, warnings) = parse_one(&format!("Kd 0.5 0.5 0.5\n{bad}\nKe 1 1 1"));
            assert_eq!((definition.diffuse, definition.emission), (Some(Vec3::splat(0.5)), Vec3::ONE), "{bad}");
            assert_eq!((definition.opacity, definition.texture), (None, None), "{bad}");
            assert!(warnings >= 1, "{bad}");
        }
        assert_eq!(parse_one("Kd -1 2 0.5"), {
            let diffuse = Some(Vec3::new(0.0, 1.0, 0.5));
            (Definition { name: String::from("a name"), diffuse, ..Definition::default() }, 1)
        });
        let mut warnings = Vec::new();
        assert!(definitions("a.mtl", "Kd 1 1 1", &mut warnings).is_empty());
        assert_eq!(warnings.len(), 1);
    }
}
