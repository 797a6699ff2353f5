//! The text of an OBJ file, made ready for tobj.
//!
//! tobj 4.0.5 makes triangles of lines, tells neither which material is missing nor which line is wrong, reads neither
//! continued lines nor comments behind a face, mixes up vertices of which only some have a colour, a normal or a texture
//! coordinate, and overflows on some indices. So every line it gets was checked here first.

use std::fmt::Write;

use glam::DVec3;

/// What tobj is given, and what it is not told.
#[derive(Debug, Default)]
pub(super) struct Preprocessed {
    /// What tobj reads. Materials are called by their index in `materials`. Every corner of a face has all three indices,
    /// and what it lacked refers to [`NOTHING`].
    pub text: String,
    /// What `mtllib` names, each once, in order.
    pub libraries: Vec<String>,
    /// What `usemtl` names, each once.
    pub materials: Vec<String>,
    /// Positions in `text` are relative to it.
    pub origin: DVec3,
    /// Points that were left out.
    pub points: usize,
    /// Lines that were left out.
    pub lines: usize,
    /// Free-form curves and surfaces that were left out.
    pub surfaces: usize,
    /// Normals that are zero or not finite; zero in `text`.
    pub bad_normals: usize,
    /// Texture coordinates that are not finite; those of [`NOTHING`] in `text`.
    pub bad_texture_coordinates: usize,
    /// Corners that refer to a normal or texture coordinate that is not there.
    pub dangling_corners: usize,
    counts: Counts,
    positions: Vec<DVec3>,
    /// The position of the first face's first corner.
    first_corner: Option<usize>,
}

/// A line that cannot be understood: its number from 1, and why.
#[derive(Debug)]
pub(super) struct BadLine {
    pub line: usize,
    pub reason: String,
}

/// How many there are so far: what relative indices count back from.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    positions: usize,
    texture_coordinates: usize,
    normals: usize,
}

/// What a corner without normal or texture coordinate gets: a normal that is none, and, since the second axis points up,
/// the upper left of the texture.
const NOTHING: &str = "vt 0 1\nvn 0 0 0\n";

/// Scenes nearer to the world's origin than this are read as they are; others relative to a multiple of it, since tobj
/// reads `f32`, which is 0.5 m coarse in a survey's coordinates.
const ORIGIN_STEP: f64 = 4096.0;

/// Farther than a frame draws. A vertex out there is a mistake that the others do not have to follow.
const FARTHEST_ORIGIN: f64 = 1e10;

impl Preprocessed {
    pub(super) fn new(source: &str) -> Result<Self, BadLine> {
        let mut preprocessed = Self { text: String::from(NOTHING), ..Self::default() };
        for (line, statement) in statements(source) {
            preprocessed.statement(&statement).map_err(|reason| BadLine { line, reason })?;
        }
        preprocessed.write_positions();
        Ok(preprocessed)
    }

    fn statement(&mut self, statement: &str) -> Result<(), String> {
        let (keyword, rest) = statement.split_once(char::is_whitespace).unwrap_or((statement, ""));
        let rest = rest.trim();
        // Names may hold a `#`, numbers may not.
        let values = rest.split_once('#').map_or(rest, |(values, _)| values);
        match keyword {
            "v" => self.position(values),
            "vt" => self.texture_coordinates(values),
            "vn" => self.normal(values),
            "f" => self.face(values),
            "p" => {
                self.points += values.split_whitespace().count();
                Ok(())
            }
            "l" => {
                self.lines += 1;
                Ok(())
            }
            "curv" | "curv2" | "surf" => {
                self.surfaces += 1;
                Ok(())
            }
            "o" | "g" => {
                self.emit(format_args!("{keyword} {rest}"));
                Ok(())
            }
            "usemtl" => {
                let known = self.materials.iter().position(|name| name == rest);
                let index = known.unwrap_or_else(|| {
                    self.materials.push(rest.to_owned());
                    self.materials.len() - 1
                });
                self.emit(format_args!("usemtl {index}"));
                Ok(())
            }
            "mtllib" => {
                if !self.libraries.iter().any(|name| name == rest) {
                    self.libraries.push(rest.to_owned());
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Three coordinates; a fourth divides them, and any further ones are a colour.
    fn position(&mut self, values: &str) -> Result<(), String> {
        let numbers = numbers(values)?;
        let [x, y, z, ..] = numbers[..] else {
            return Err(format!("a vertex needs 3 coordinates and has {}", numbers.len()));
        };
        let position = match numbers[..] {
            [_, _, _, 0.0] => return Err(String::from("a vertex has the weight 0")),
            [_, _, _, weight] => DVec3::new(x, y, z) / weight,
            _ => DVec3::new(x, y, z),
        };
        self.positions.push(position);
        self.counts.positions += 1;
        Ok(())
    }

    /// Writes the positions, before all else, relative to the first corner of a face: vertices that no face refers to may be
    /// anywhere.
    fn write_positions(&mut self) {
        let within = |position: &&DVec3| position.abs().cmple(DVec3::splat(FARTHEST_ORIGIN)).all();
        let anchor = self.first_corner.and_then(|corner| self.positions.get(corner)).filter(within);
        self.origin = anchor.map_or(DVec3::ZERO, |anchor| (*anchor / ORIGIN_STEP).trunc() * ORIGIN_STEP);
        let mut text = String::new();
        for position in &self.positions {
            let DVec3 { x, y, z } = *position - self.origin;
            // Writing to a string cannot fail.
            let _ = writeln!(text, "v {x:e} {y:e} {z:e}");
        }
        self.text.insert_str(0, &text);
    }

    fn texture_coordinates(&mut self, values: &str) -> Result<(), String> {
        let numbers = numbers(values)?;
        let [u, ..] = numbers[..] else {
            return Err(String::from("texture coordinates without a number"));
        };
        let v = numbers.get(1).copied().unwrap_or(0.0);
        // As 32-bit numbers, which is what they will be.
        let is_finite = (u as f32).is_finite() && (v as f32).is_finite();
        self.bad_texture_coordinates += usize::from(!is_finite);
        self.counts.texture_coordinates += 1;
        let [u, v] = if is_finite { [u, v] } else { [0.0, 1.0] };
        self.emit(format_args!("vt {u:e} {v:e}"));
        Ok(())
    }

    fn normal(&mut self, values: &str) -> Result<(), String> {
        let numbers = numbers(values)?;
        let [x, y, z, ..] = numbers[..] else {
            return Err(format!("a normal needs 3 numbers and has {}", numbers.len()));
        };
        let normal = DVec3::new(x, y, z).try_normalize();
        self.bad_normals += usize::from(normal.is_none());
        self.counts.normals += 1;
        let DVec3 { x, y, z } = normal.unwrap_or_default();
        self.emit(format_args!("vn {x:e} {y:e} {z:e}"));
        Ok(())
    }

    fn face(&mut self, values: &str) -> Result<(), String> {
        let mut face = String::from("f");
        let mut corners = 0;
        for corner in values.split_whitespace() {
            face.push_str(&self.corner(corner)?);
            corners += 1;
        }
        match corners {
            0 => return Err(String::from("a face without a corner")),
            1 => self.points += 1,
            2 => self.lines += 1,
            _ => self.emit(format_args!("{face}")),
        }
        Ok(())
    }

    /// A corner is `position`, `position/texture`, `position//normal` or `position/texture/normal`.
    fn corner(&mut self, corner: &str) -> Result<String, String> {
        let no_corner = || format!("`{corner}` is no corner of a face");
        let mut indices = [None; 3];
        for (place, index) in corner.split('/').enumerate().filter(|(_, index)| !index.is_empty()) {
            *indices.get_mut(place).ok_or_else(no_corner)? = Some(index.parse::<i64>().map_err(|_| no_corner())?);
        }
        let [Some(position), texture, normal] = indices else {
            return Err(no_corner());
        };
        let Counts { positions, texture_coordinates, normals } = self.counts;
        let position = absolute(position, positions)
            .ok_or_else(|| format!("a face refers to vertex {position}, and there are {positions} so far"))?;
        self.first_corner.get_or_insert(position as usize - 1);
        let found = [(texture, texture_coordinates), (normal, normals)]
            .map(|(index, count)| index.map(|index| absolute(index, count)));
        self.dangling_corners += usize::from(found.contains(&Some(None)));
        // The first of either is that of `NOTHING`.
        let [texture, normal] = found.map(|index| index.flatten().map_or(1, |index| index + 1));
        Ok(format!(" {position}/{texture}/{normal}"))
    }

    fn emit(&mut self, line: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{line}");
    }
}

/// The statements of an OBJ or MTL file, each with the number of its last line: a backslash continues a line on the next.
pub(super) fn statements(source: &str) -> impl Iterator<Item = (usize, String)> {
    let mut begun = String::new();
    let lines = source.strip_prefix('\u{feff}').unwrap_or(source).lines().chain([""]);
    lines.enumerate().filter_map(move |(index, line)| {
        // A comment ends with its line, whatever it ends in: many name a folder.
        if begun.is_empty() && line.trim_start().starts_with('#') {
            return None;
        }
        if let Some(part) = line.strip_suffix('\\') {
            begun.push_str(part);
            begun.push(' ');
            return None;
        }
        begun.push_str(line);
        let statement = begun.trim().to_owned();
        begun.clear();
        (!statement.is_empty() && !statement.starts_with('#')).then_some((index + 1, statement))
    })
}

/// An index counted from 1, if there is such an entry; a negative one counts back from the last.
fn absolute(index: i64, count: usize) -> Option<u64> {
    let count = count as u64;
    let distance = index.unsigned_abs();
    (1..=count).contains(&distance).then(|| if index > 0 { distance } else { count + 1 - distance })
}

fn numbers(values: &str) -> Result<Vec<f64>, String> {
    let number = |word: &str| word.parse().map_err(|_| format!("`{word}` is no number"));
    values.split_whitespace().map(number).collect()
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;

    #[test]
    fn a_scene_far_away_keeps_its_millimetres() {
        let stray_vertex = "v 999999999 0 0\n";
        let face = "v 500000.125 4500000.001 30\nv 500000.126 4500000.002 30\nf 2 3 2\n";
        let preprocessed = Preprocessed::new(&format!("{stray_vertex}{face}")).unwrap();
        assert_eq!(preprocessed.origin, DVec3::new(499_712.0, 4_497_408.0, 0.0));
        let second: Vec<f32> =
            preprocessed.text.lines().nth(2).unwrap().split(' ').skip(1).map(|word| word.parse().unwrap()).collect();
        assert!((f64::from(second[1]) + preprocessed.origin.y - 4_500_000.002).abs() < 5e-4);
    }

    #[test]
    fn a_line_goes_on_after_a_backslash_and_keeps_its_number() {
        let found: Vec<_> = statements("# head\r\nf 1 2 \\\r\n 3\r\n\nv 1\\").collect();
        assert_eq!(found, [(3, String::from("f 1 2   3")), (6, String::from("v 1"))]);
        let found: Vec<_> = statements("# C:\\models\\\nv 1\n  # D:\\\nv 2").collect();
        assert_eq!(found, [(2, String::from("v 1")), (4, String::from("v 2"))]);
    }
}
