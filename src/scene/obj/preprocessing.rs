//! Preprocessing: checks and cleans the text of an OBJ file before tobj parses it.
//!
//! tobj 4.0.5 has these defects, so it only gets lines that were checked here:
//!
//! - It turns lines into triangles.
//! - It reports neither which material is missing nor which line is malformed.
//! - It supports neither continued lines nor comments behind a face.
//! - It confuses vertices if only some have a colour, a normal or texture coordinates.
//! - It overflows on some indices.

use std::collections::{HashMap, HashSet};
use std::fmt::Write;

use glam::DVec3;

/// The text for tobj, and what preprocessing took out of it.
#[derive(Debug, Default)]
pub(super) struct Preprocessed {
    /// The text for tobj. The name of a material is its index in `materials`. Every corner of a face has all three indices;
    /// missing ones refer to [`PLACEHOLDERS`].
    pub text: String,
    /// The names of `mtllib` statements, each once, in order.
    pub libraries: Vec<String>,
    /// The names of `usemtl` statements, each once, in order.
    pub materials: Vec<String>,
    /// The positions of the file. `text` has their indices instead, as [`position_index`] reads them.
    pub positions: Vec<DVec3>,
    /// The number of points, which are left out.
    pub points: usize,
    /// The number of lines, which are left out.
    pub lines: usize,
    /// The number of free-form curves and surfaces, which are left out.
    pub surfaces: usize,
    /// The number of normals that are zero or not finite. They are zero in `text`.
    pub bad_normals: usize,
    /// The number of texture coordinates that are not finite. In `text` they are those of [`PLACEHOLDERS`].
    pub bad_texture_coordinates: usize,
    /// The number of corners that refer to a missing normal or missing texture coordinates.
    pub dangling_corners: usize,
    counts: Counts,
    /// The index of each name in `materials`.
    material_indices: HashMap<String, usize>,
    /// The names in `libraries`.
    library_names: HashSet<String>,
}

/// A malformed line: its number, counted from 1, and the reason.
#[derive(Debug)]
pub(super) struct MalformedLine {
    pub line: usize,
    pub reason: String,
}

/// The numbers of vertex attributes so far, from which relative indices count back.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    positions: usize,
    texture_coordinates: usize,
    normals: usize,
}

/// The attributes of a corner without texture coordinates or normal: the upper left of the texture, as the v axis of OBJ points
/// up, and a zero normal.
const PLACEHOLDERS: &str = "vt 0 1\nvn 0 0 0\n";

/// The index of a position has two digits of this base in the text.
const INDEX_BASE: usize = 1 << 16;

/// The index that a position in the text for tobj stands for.
pub(super) fn position_index([low, high, _]: [f64; 3]) -> usize {
    low as usize + high as usize * INDEX_BASE
}

impl Preprocessed {
    /// Reads the statements of a file.
    ///
    /// # Errors
    /// Returns the first line that is malformed.
    pub(super) fn new(source: &str) -> Result<Self, MalformedLine> {
        let mut preprocessed = Self { text: String::from(PLACEHOLDERS), ..Self::default() };
        for (line, statement) in statements(source) {
            preprocessed.statement(&statement).map_err(|reason| MalformedLine { line, reason })?;
        }
        Ok(preprocessed)
    }

    fn statement(&mut self, statement: &str) -> Result<(), String> {
        let (keyword, rest) = statement.split_once(char::is_whitespace).unwrap_or((statement, ""));
        let rest = rest.trim();
        // Names may contain `#`; numbers are followed by comments.
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
                let index = self.material_index(rest);
                self.emit(format_args!("usemtl {index}"));
                Ok(())
            }
            "mtllib" => {
                if self.library_names.insert(rest.to_owned()) {
                    self.libraries.push(rest.to_owned());
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Three coordinates. A fourth number is a weight, which divides them; further numbers are a colour.
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
        let index = self.positions.len();
        self.positions.push(position);
        self.counts.positions += 1;
        // tobj reads f32, which has every whole number below 2²⁴, and whose precision is 0.5 m in the coordinates of a land survey.
        self.emit(format_args!("v {} {} 0", index % INDEX_BASE, index / INDEX_BASE));
        Ok(())
    }

    fn material_index(&mut self, name: &str) -> usize {
        if let Some(index) = self.material_indices.get(name) {
            return *index;
        }
        let index = self.materials.len();
        self.materials.push(name.to_owned());
        self.material_indices.insert(name.to_owned(), index);
        index
    }

    fn texture_coordinates(&mut self, values: &str) -> Result<(), String> {
        let numbers = numbers(values)?;
        let [u, ..] = numbers[..] else {
            return Err(String::from("texture coordinates need a number and have none"));
        };
        let v = numbers.get(1).copied().unwrap_or(0.0);
        // Checked as f32, the type of the result.
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
        let malformed = || format!("`{corner}` is not a corner of a face");
        let mut indices = [None; 3];
        for (number, index) in corner.split('/').enumerate().filter(|(_, index)| !index.is_empty()) {
            *indices.get_mut(number).ok_or_else(malformed)? = Some(index.parse::<i64>().map_err(|_| malformed())?);
        }
        let [Some(position), texture, normal] = indices else {
            return Err(malformed());
        };
        let Counts { positions, texture_coordinates, normals } = self.counts;
        let position = absolute_index(position, positions)
            .ok_or_else(|| format!("a face refers to vertex {position}, but there are {positions} so far"))?;
        let resolved = [(texture, texture_coordinates), (normal, normals)]
            .map(|(index, count)| index.map(|index| absolute_index(index, count)));
        self.dangling_corners += usize::from(resolved.contains(&Some(None)));
        // Index 1 of either is that of `PLACEHOLDERS`.
        let [texture, normal] = resolved.map(|index| index.flatten().map_or(1, |index| index + 1));
        Ok(format!(" {position}/{texture}/{normal}"))
    }

    fn emit(&mut self, line: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{line}");
    }
}

/// The statements of an OBJ or MTL file, each with the number of its last line. A backslash at the end continues a line.
pub(super) fn statements(source: &str) -> impl Iterator<Item = (usize, String)> {
    let mut statement_so_far = String::new();
    let lines = source.strip_prefix('\u{feff}').unwrap_or(source).lines().chain([""]);
    lines.enumerate().filter_map(move |(index, line)| {
        // A comment is not continued: many end with the path of a folder.
        if statement_so_far.is_empty() && line.trim_start().starts_with('#') {
            return None;
        }
        if let Some(part) = line.strip_suffix('\\') {
            statement_so_far.push_str(part);
            statement_so_far.push(' ');
            return None;
        }
        statement_so_far.push_str(line);
        let statement = statement_so_far.trim().to_owned();
        statement_so_far.clear();
        (!statement.is_empty() && !statement.starts_with('#')).then_some((index + 1, statement))
    })
}

/// The index counted from 1, if there is such an entry. A negative index counts back from the last entry.
fn absolute_index(index: i64, count: usize) -> Option<u64> {
    let count = count as u64;
    let distance = index.unsigned_abs();
    (1..=count).contains(&distance).then(|| if index > 0 { distance } else { count + 1 - distance })
}

fn numbers(values: &str) -> Result<Vec<f64>, String> {
    let number = |word: &str| word.parse().map_err(|_| format!("`{word}` is not a number"));
    values.split_whitespace().map(number).collect()
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;

    #[test]
    fn the_text_has_the_index_of_each_position() {
        let vertices = "v 500000.125 4500000.001 30\n".repeat(70_000);
        let preprocessed = Preprocessed::new(&vertices).unwrap();
        assert_eq!(preprocessed.positions[69_999], DVec3::new(500_000.125, 4_500_000.001, 30.0));
        let positions = preprocessed.text.lines().filter_map(|line| line.strip_prefix("v "));
        let numbers = positions.map(|line| line.split(' ').map(|word| f64::from(word.parse::<f32>().unwrap())));
        let indices = numbers.map(|numbers| position_index(numbers.collect::<Vec<_>>().try_into().unwrap()));
        assert!(indices.eq(0..70_000));
    }

    #[test]
    fn a_continued_line_has_the_number_of_its_last_line() {
        let parsed: Vec<_> = statements("# head\r\nf 1 2 \\\r\n 3\r\n\nv 1\\").collect();
        assert_eq!(parsed, [(3, String::from("f 1 2   3")), (6, String::from("v 1"))]);
        let parsed: Vec<_> = statements("# C:\\models\\\nv 1\n  # D:\\\nv 2").collect();
        assert_eq!(parsed, [(2, String::from("v 1")), (4, String::from("v 2"))]);
    }
}
