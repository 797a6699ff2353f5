//! Material libraries, the `.mtl` files beside an OBJ file.
//!
//! tobj does not parse them, because it rejects a whole library for one malformed line without naming the line, and
//! panics on a colour of one number, which the format allows.

use std::io::{self, BufRead};

use drawloom::glam::Vec3;

use crate::error::{ObjWarning, excerpt};
use crate::files::{PossibleName, possible_names};
use crate::ignored::IgnoredStatements;
use crate::statements::{Statements, without_comment};
use crate::warnings::Warnings;

/// A material as its library defines it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Definition {
    pub name: String,
    pub diffuse: Option<Vec3>,
    pub emission: Vec3,
    /// 1 is opaque. `d` where there is one, else 1 − `Tr`.
    pub opacity: Option<f32>,
    /// `map_Kd`.
    pub texture: Option<TextureStatement>,
    /// `map_d`.
    pub mask: Option<TextureStatement>,
    dissolve: Option<f32>,
    transparency: Option<f32>,
    /// `Ka`, and its line.
    ambient: Option<(Vec3, usize)>,
}

/// A statement that names a texture.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TextureStatement {
    /// The names that its file may have, relative to the OBJ file, the likeliest first. There is at least one.
    pub names: Vec<PossibleName>,
    pub library: String,
    /// Counted from 1.
    pub line: usize,
}

/// What libraries define.
#[derive(Debug, Default)]
pub(crate) struct Definitions {
    /// The materials that are used. A library of many materials may be used for a few.
    pub used: Vec<Definition>,
    /// The number of all materials with an opacity.
    pub with_opacity: usize,
    /// The number of all materials with opacity 0.
    pub invisible: usize,
}

/// Adds the materials of a library to others. A malformed line is left out, with a warning.
///
/// # Errors
/// If the reader fails. What was read before counts.
pub(crate) fn add_definitions(
    definitions: &mut Definitions,
    library: &str,
    file: impl BufRead,
    is_used: impl Fn(&str) -> bool,
    max_line_bytes: u64,
    warnings: &mut Warnings,
) -> io::Result<()> {
    let mut current: Option<Definition> = None;
    let mut ignored = IgnoredStatements::default();
    let mut statements = Statements::new(file, max_line_bytes)?;
    let end = loop {
        let (line, statement) = match statements.next() {
            Ok(Some(next)) => next,
            Ok(None) => break Ok(()),
            Err(error) => break Err(error),
        };
        let (keyword, rest) = statement.split_once(char::is_whitespace).unwrap_or((statement, ""));
        let rest = rest.trim();
        let mut warn =
            |reason: String| warnings.push(ObjWarning::LibraryLine { library: library.to_owned(), line, reason });
        if keyword == "newmtl" {
            let new = Definition { name: rest.to_owned(), ..Definition::default() };
            definitions.add(current.replace(new), &is_used, &mut ignored);
            continue;
        }
        if !["Kd", "Ke", "Ka", "d", "Tr", "map_Kd", "map_d"].contains(&keyword) {
            if !changes_nothing(keyword, rest) {
                ignored.add(keyword, line);
            }
            continue;
        }
        let Some(definition) = &mut current else {
            warn(format!("`{keyword}` before the first `newmtl` was left out"));
            continue;
        };
        match keyword {
            "Kd" => definition.diffuse = color(rest, 1.0, &mut warn).or(definition.diffuse),
            "Ke" => definition.emission = color(rest, f32::MAX, &mut warn).unwrap_or(definition.emission),
            "Ka" => match color(rest, 1.0, &mut |_| ()) {
                Some(color) => definition.ambient = Some((color, line)),
                // A spectrum, for example, which is not drawn either.
                None => ignored.add(keyword, line),
            },
            "d" => {
                definition.dissolve = opacity(rest, &mut warn).or(definition.dissolve);
                definition.resolve_opacity(&mut warn);
            }
            "Tr" => {
                definition.transparency = opacity(rest, &mut warn).or(definition.transparency);
                definition.resolve_opacity(&mut warn);
            }
            _ => {
                let names = texture(library, rest, &mut warn);
                let slot = if keyword == "map_Kd" { &mut definition.texture } else { &mut definition.mask };
                if let Some(names) = names {
                    *slot = Some(TextureStatement { names, library: library.to_owned(), line });
                }
            }
        }
    };
    definitions.add(current, is_used, &mut ignored);
    ignored.warn(library, warnings);
    statements.warn(library, warnings);
    end
}

impl Definitions {
    /// Adds a material that is defined as a whole.
    fn add(&mut self, definition: Option<Definition>, is_used: impl Fn(&str) -> bool, ignored: &mut IgnoredStatements) {
        let Some(definition) = definition else { return };
        self.with_opacity += usize::from(definition.opacity.is_some());
        self.invisible += usize::from(definition.opacity == Some(0.0));
        // Ambient light is reflected by the diffuse colour.
        if let Some((color, line)) = definition.ambient
            && color != Vec3::ZERO
            && definition.diffuse != Some(color)
        {
            ignored.add("Ka", line);
        }
        if is_used(&definition.name) {
            self.used.push(definition);
        }
    }
}

impl Definition {
    /// Computes the opacity from `d` and `Tr`, of which programs write either or both.
    fn resolve_opacity(&mut self, warn: &mut impl FnMut(String)) {
        self.opacity = match (self.dissolve, self.transparency) {
            (Some(dissolve), Some(transparency)) => {
                if (1.0 - transparency - dissolve).abs() > 1e-3 {
                    warn(format!("`Tr {transparency}` contradicts `d {dissolve}` and was left out"));
                }
                Some(dissolve)
            }
            (dissolve, transparency) => dissolve.or(transparency.map(|transparency| 1.0 - transparency)),
        };
    }
}

/// Whether a statement that is not supported would change nothing, or changes only what another one says, which is not
/// supported either: `Ns` and `Ni` are details of `Ks` and `illum`.
fn changes_nothing(keyword: &str, values: &str) -> bool {
    let numbers = without_comment(values).split_whitespace();
    let all = |is_neutral: fn(f32) -> bool| numbers.clone().all(|word| word.parse().is_ok_and(is_neutral));
    match keyword {
        "Ns" | "Ni" => true,
        "Ks" => all(|number| number == 0.0),
        "Tf" => all(|number| number == 1.0),
        // 1 is lit, and 2 adds the highlights of `Ks`. 0 is unlit, which is not drawn.
        "illum" => all(|number| (1.0..=2.0).contains(&number)),
        _ => false,
    }
}

/// A colour: one number for all channels, or one for each, clamped to 0 to `max`.
fn color(values: &str, max: f32, warn: &mut impl FnMut(String)) -> Option<Vec3> {
    let numbers: Result<Vec<f32>, _> = without_comment(values).split_whitespace().map(str::parse).collect();
    let color = match numbers.as_deref() {
        Ok([red, green, blue, ..]) => Vec3::new(*red, *green, *blue),
        Ok([gray]) => Vec3::splat(*gray),
        _ => Vec3::NAN,
    };
    if !color.is_finite() {
        warn(format!("`{}` is not a colour, and was left out", excerpt(values)));
        return None;
    }
    let clamped = color.clamp(Vec3::ZERO, Vec3::splat(max));
    if clamped != color {
        warn(format!("the colour `{}` was clamped", excerpt(values)));
    }
    Some(clamped)
}

fn opacity(values: &str, warn: &mut impl FnMut(String)) -> Option<f32> {
    // `-halo` makes the rim of a curved surface more opaque than its middle; a uniform opacity approximates that.
    let after_halo = values.strip_prefix("-halo");
    if after_halo.is_some() {
        warn("the opacity's option `-halo` was left out".to_owned());
    }
    let number = after_halo.unwrap_or(values).split_whitespace().next().and_then(|word| word.parse::<f32>().ok());
    match number {
        Some(opacity) if (0.0..=1.0).contains(&opacity) => Some(opacity),
        _ => {
            warn(format!("`{}` is not a number from 0 to 1, and was left out", excerpt(values)));
            None
        }
    }
}

/// The names that a texture file may have, after options with values.
fn texture(library: &str, values: &str, warn: &mut impl FnMut(String)) -> Option<Vec<PossibleName>> {
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
    let folder = library.rfind(['/', '\\']).map_or("", |slash| &library[..=slash]);
    let names = possible_names(&folder.replace('\\', "/"), rest);
    names.inspect_err(|reason| warn(format!("a texture was left out: {reason}"))).ok()
}

#[cfg(test)]
mod tests {
    use std::io::{BufReader, Read};

    use super::*;

    fn parse(text: &str) -> (Vec<Definition>, Vec<ObjWarning>) {
        let mut warnings = Warnings::new(99);
        let mut found = Definitions::default();
        let is_used = |name: &str| name != "unused";
        add_definitions(&mut found, "folder\\a.mtl", text.as_bytes(), is_used, 1 << 20, &mut warnings).unwrap();
        (found.used, warnings.listed)
    }

    fn parse_one(text: &str) -> (Definition, usize) {
        let (found, warnings) = parse(&format!("newmtl\ta name\t\n{text}"));
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].name, "a name");
        (found[0].clone(), warnings.len())
    }

    fn texture_name(text: &str) -> String {
        parse_one(text).0.texture.unwrap().names[0].name.clone()
    }

    #[test]
    fn statements_of_a_library_are_parsed() {
        assert_eq!(parse_one("Kd 0.5").0.diffuse, Some(Vec3::splat(0.5)));
        assert_eq!(parse_one("Kd 0.1 0.2 0.3 # red").0.diffuse, Some(Vec3::new(0.1, 0.2, 0.3)));
        assert_eq!(parse_one("Ke 17 12 4").0.emission, Vec3::new(17.0, 12.0, 4.0));
        assert_eq!(parse_one("Tr 0.25").0.opacity, Some(0.75));
        let (halo, warnings) = parse_one("d -halo 0.25");
        assert_eq!((halo.opacity, warnings), (Some(0.25), 1));
        assert_eq!(texture_name("map_Kd in\\a file.png"), "folder/in/a file.png");
        assert_eq!(texture_name("map_Kd -s 2 2 -bm 1 -clamp on -x.png"), "folder/-x.png");
        assert_eq!(parse_one("map_Kd -s 2 2 -bm 1 -clamp on -x.png").1, 3);
        assert_eq!(parse_one("map_d a.png").0.mask.unwrap().names[0].name, "folder/a.png");
    }

    #[test]
    fn what_was_read_before_an_error_counts() {
        struct Failing;
        impl Read for Failing {
            fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
                Err(io::Error::other("the disk is gone"))
            }
        }
        let text = "newmtl a\nKd 1 1 1\nillum 3\nKd red\nnewmtl b\nKd 0.5 0.5 0.5\nKe 1";
        let (mut found, mut warnings) = (Definitions::default(), Warnings::new(99));
        let file = BufReader::new(text.as_bytes().chain(Failing));
        let error = add_definitions(&mut found, "a.mtl", file, |_| true, 1 << 20, &mut warnings).unwrap_err();
        assert_eq!(error.to_string(), "the disk is gone");
        let colors: Vec<_> = found.used.iter().map(|material| (material.name.as_str(), material.diffuse)).collect();
        assert_eq!(colors, [("a", Some(Vec3::ONE)), ("b", Some(Vec3::splat(0.5)))]);
        let [ObjWarning::LibraryLine { line: 4, .. }, ObjWarning::IgnoredStatements { .. }] = warnings.listed[..]
        else {
            panic!("{:?}", warnings.listed);
        };
    }

    #[test]
    fn only_a_malformed_line_is_left_out() {
        for bad in ["Kd 0.1 0.2", "Kd red", "Kd nan 0 0", "Ke inf 0 0", "d 2", "d", "map_Kd", "map_Kd -s 1", "Kd"] {
            let (definition, warnings) = parse_one(&format!("Kd 0.5 0.5 0.5\n{bad}\nKe 1 1 1"));
            assert_eq!((definition.diffuse, definition.emission), (Some(Vec3::splat(0.5)), Vec3::ONE), "{bad}");
            assert_eq!((definition.opacity, definition.texture), (None, None), "{bad}");
            assert!(warnings >= 1, "{bad}");
        }
        let (clamped, warnings) = parse_one("Kd -1 2 0.5");
        assert_eq!((clamped.diffuse, warnings), (Some(Vec3::new(0.0, 1.0, 0.5)), 1));
        let (found, _) = parse("newmtl unused\nKd 1\nnewmtl used\nKd 1\nnewmtl unused\nKd 1\n");
        assert_eq!(found.iter().map(|definition| definition.name.as_str()).collect::<Vec<_>>(), ["used"]);
        let (found, warnings) = parse("Kd 1 1 1");
        assert_eq!((found.len(), warnings.len()), (0, 1));
    }

    #[test]
    fn d_wins_over_a_contradicting_tr_in_either_order() {
        for text in ["d 1\nTr 1", "Tr 1\nd 1"] {
            let (definition, warnings) = parse_one(text);
            assert_eq!((definition.opacity, warnings), (Some(1.0), 1), "{text}");
        }
        for text in ["d 0.3\nTr 0.7", "Tr 0.7\nd 0.3"] {
            let (definition, warnings) = parse_one(text);
            assert_eq!((definition.opacity, warnings), (Some(0.3), 0), "{text}");
        }
    }

    #[test]
    fn what_is_not_drawn_is_counted_unless_it_changes_nothing() {
        let neutral = "Kd 0.5\nKa 0.5\nKs 0 0 0 # black\nNs 10\nNi 1.5\nTf 1 1 1\nillum 1\nillum 2";
        assert_eq!(parse_one(neutral).1, 0);
        let spectra = ["Ka spectral a.rfl", "Ks spectral a.rfl 1", "Tf spectral a.rfl"];
        for ignored in [&spectra[..], &["Ks 0 0 red", "illum full", "illum 0"]].concat() {
            let warnings = parse(&format!("newmtl a\nKd 0.5\n{ignored}")).1;
            assert!(matches!(warnings[..], [ObjWarning::IgnoredStatements { .. }]), "{ignored}: {warnings:?}");
        }
        let mut text =
            format!("newmtl a\n{neutral}\nKs 0 0 1\nnewmtl b\nKa 1 0 0\nKs 1\nillum 3\nTf 0 1 1\nmap_Ke b.png");
        for index in 0..99 {
            text += &format!("\nodd{index} 1");
        }
        let warnings = parse(&text).1;
        let [ObjWarning::IgnoredStatements { file, keywords, others }] = &warnings[..] else {
            panic!("{warnings:?}");
        };
        let counts: Vec<_> = keywords[..5].iter().map(ToString::to_string).collect();
        assert_eq!(file, "folder\\a.mtl");
        assert_eq!(counts[0], "2 × `Ks` from line 10 on");
        assert_eq!(counts[1..4], ["`illum` in line 14", "`Tf` in line 15", "`map_Ke` in line 16"]);
        assert_eq!(keywords.len() + others, 99 + 5);
        assert!(
            warnings[0].to_string().ends_with("`odd11` in line 28 and 88 statements with other keywords left out"),
            "{}",
            warnings[0]
        );
    }
}
