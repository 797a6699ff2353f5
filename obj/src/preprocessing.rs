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
use std::io::{self, BufRead};

use drawloom::glam::DVec3;

use crate::error::{ObjWarning, excerpt};
use crate::ignored::IgnoredStatements;
use crate::statements::{Statements, without_comment};
use crate::warnings::Warnings;

/// The text for tobj, and what preprocessing took out of it.
#[derive(Debug, Default)]
pub(crate) struct Preprocessed {
    /// The text for tobj. The name of a material is its index in `materials`. Every corner of a face has all three
    /// indices; missing ones refer to [`PLACEHOLDERS`].
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
    /// The colour of each position, in sRGB; empty if there is none. Positions without a colour are white.
    pub colors: Vec<[f64; 3]>,
    /// The number of colours that are not between 0 and 1. They are clamped in `colors`, and white if they are not
    /// numbers.
    pub bad_colors: usize,
    /// The number of faces of smoothing groups that have a corner without normal.
    pub unsmoothed_faces: usize,
    /// The first malformed line.
    pub first_malformed: Option<MalformedLine>,
    /// The first line that is not text.
    pub first_non_text_line: Option<usize>,
    ignored: IgnoredStatements,
    /// Whether faces belong to a smoothing group.
    is_smoothed: bool,
    counts: Counts,
    /// The index of each name in `materials`.
    material_indices: HashMap<String, usize>,
    /// The names in `libraries`.
    library_names: HashSet<String>,
}

/// A malformed line: its number, counted from 1, and the reason.
#[derive(Debug)]
pub(crate) struct MalformedLine {
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

/// The attributes of a corner without texture coordinates or normal: the upper left of the texture, as the v axis of
/// OBJ points up, and a zero normal.
const PLACEHOLDERS: &str = "vt 0 1\nvn 0 0 0\n";

const WHITE: [f64; 3] = [1.0; 3];

/// The index of a position has two digits of this base in the text.
const INDEX_BASE: usize = 1 << 16;

/// The most bytes of a word that is not a number in which one is looked for.
const MAX_NUMBER_BYTES: usize = 64;

/// The index that a position in the text for tobj stands for.
pub(crate) fn position_index([low, high, _]: [f64; 3]) -> usize {
    low as usize + high as usize * INDEX_BASE
}

impl Preprocessed {
    /// Reads the statements of a file. What is malformed is left out, with a warning.
    ///
    /// # Errors
    /// If reading fails.
    pub(crate) fn new(
        mut statements: Statements<impl BufRead>,
        file: &str,
        warnings: &mut Warnings,
    ) -> io::Result<Self> {
        let mut preprocessed = Self { text: String::from(PLACEHOLDERS), ..Self::default() };
        while let Some((line, statement)) = statements.next()? {
            let mut warn = |reason: String| warnings.push(ObjWarning::Line { line, reason });
            if let Err(reason) = preprocessed.statement(line, statement, &mut warn) {
                preprocessed.first_malformed.get_or_insert_with(|| MalformedLine { line, reason: reason.clone() });
                warn(format!("{reason}; the line was left out"));
            }
        }
        if !preprocessed.colors.is_empty() {
            preprocessed.colors.resize(preprocessed.positions.len(), WHITE);
        }
        preprocessed.first_non_text_line = statements.first_non_text_line();
        if let Some(line) = statements.first_long_line() {
            let reason = String::from("the line has more bytes than `ObjLimits::line_bytes`");
            preprocessed.first_malformed.get_or_insert(MalformedLine { line, reason });
        }
        std::mem::take(&mut preprocessed.ignored).warn(file, warnings);
        statements.warn(file, warnings);
        Ok(preprocessed)
    }

    fn statement(&mut self, line: usize, statement: &str, warn: &mut impl FnMut(String)) -> Result<(), String> {
        let (keyword, rest) = statement.split_once(char::is_whitespace).unwrap_or((statement, ""));
        let rest = rest.trim();
        // Names may contain `#`; numbers are followed by comments.
        let values = without_comment(rest);
        match keyword {
            "v" => self.position(values, warn),
            "vt" => self.texture_coordinates(values, warn),
            "vn" => self.normal(values, warn),
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
                // tobj repeats the name in each run of faces that changes the material.
                self.emit(format_args!("{keyword} {}", excerpt(rest)));
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
            "s" => {
                self.is_smoothed = !matches!(values.trim(), "off" | "0" | "");
                Ok(())
            }
            // Parts of curves and surfaces, which are counted.
            "vp" | "cstype" | "deg" | "bmat" | "step" | "parm" | "trim" | "hole" | "scrv" | "sp" | "con" | "end" => {
                Ok(())
            }
            _ => {
                self.ignored.add(keyword, line);
                Ok(())
            }
        }
    }

    /// The numbers of a statement. A word that only starts with a number counts as that number, as in other programs.
    fn numbers(values: &str, warn: &mut impl FnMut(String)) -> Result<Vec<f64>, String> {
        let number = |word| match number(word) {
            Some((number, true)) => Ok(number),
            Some((number, false)) => {
                warn(format!("`{}` is not a number and was read as {number}", excerpt(word)));
                Ok(number)
            }
            None => Err(format!("`{}` is not a number", excerpt(word))),
        };
        values.split_whitespace().map(number).collect()
    }

    /// Three coordinates. A fourth number is a weight, which divides them; three further numbers are a colour.
    fn position(&mut self, values: &str, warn: &mut impl FnMut(String)) -> Result<(), String> {
        let numbers = Self::numbers(values, warn);
        if let Ok([_, _, _, red, green, blue, ..]) = numbers.as_deref() {
            self.color([*red, *green, *blue]);
        }
        let position = numbers.and_then(|numbers| match numbers[..] {
            [_, _, _, 0.0] => Err(String::from("a vertex has the weight 0")),
            [x, y, z, weight] => Ok(DVec3::new(x, y, z) / weight),
            [x, y, z, ..] => Ok(DVec3::new(x, y, z)),
            _ => Err(format!("a vertex needs 3 coordinates and has {}", numbers.len())),
        });
        let index = self.positions.len();
        // Faces count a malformed vertex as well. Triangles that have it as a corner are left out.
        self.positions.push(*position.as_ref().unwrap_or(&DVec3::NAN));
        self.counts.positions += 1;
        // tobj reads f32, which has every whole number below 2²⁴, and whose precision is 0.5 m in the coordinates of a
        // land survey.
        self.emit(format_args!("v {} {} 0", index % INDEX_BASE, index / INDEX_BASE));
        position.map(drop)
    }

    /// The colour of the next position.
    fn color(&mut self, color: [f64; 3]) {
        self.bad_colors += usize::from(color.iter().any(|channel| !(0.0..=1.0).contains(channel)));
        let is_number = color.iter().all(|channel| !channel.is_nan());
        self.colors.resize(self.positions.len(), WHITE);
        self.colors.push(if is_number { color.map(|channel| channel.clamp(0.0, 1.0)) } else { WHITE });
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

    fn texture_coordinates(&mut self, values: &str, warn: &mut impl FnMut(String)) -> Result<(), String> {
        let numbers = Self::numbers(values, warn);
        let coordinates = numbers.and_then(|numbers| match numbers[..] {
            [u, v, ..] => Ok([u, v]),
            [u] => Ok([u, 0.0]),
            [] => Err(String::from("texture coordinates need a number and have none")),
        });
        let [u, v] = *coordinates.as_ref().unwrap_or(&[0.0, 1.0]);
        // Checked as f32, the type of the result.
        let is_finite = (u as f32).is_finite() && (v as f32).is_finite();
        self.bad_texture_coordinates += usize::from(!is_finite);
        self.counts.texture_coordinates += 1;
        let [u, v] = if is_finite { [u, v] } else { [0.0, 1.0] };
        self.emit(format_args!("vt {u:e} {v:e}"));
        coordinates.map(drop)
    }

    fn normal(&mut self, values: &str, warn: &mut impl FnMut(String)) -> Result<(), String> {
        let numbers = Self::numbers(values, warn);
        let given = numbers.and_then(|numbers| match numbers[..] {
            [x, y, z, ..] => Ok(DVec3::new(x, y, z)),
            _ => Err(format!("a normal needs 3 numbers and has {}", numbers.len())),
        });
        let normal = given.as_ref().ok().and_then(|given| given.try_normalize());
        self.bad_normals += usize::from(given.is_ok() && normal.is_none());
        self.counts.normals += 1;
        let DVec3 { x, y, z } = normal.unwrap_or_default();
        self.emit(format_args!("vn {x:e} {y:e} {z:e}"));
        given.map(drop)
    }

    fn face(&mut self, values: &str) -> Result<(), String> {
        let mut face = String::from("f");
        let mut corners = 0;
        let mut has_normals = true;
        for corner in values.split_whitespace() {
            let [position, texture, normal] = self.corner(corner)?;
            has_normals &= normal > 1;
            // Writing to a string cannot fail.
            let _ = write!(face, " {position}/{texture}/{normal}");
            corners += 1;
        }
        match corners {
            0 => return Err(String::from("a face without a corner")),
            1 => self.points += 1,
            2 => self.lines += 1,
            _ => {
                self.unsmoothed_faces += usize::from(self.is_smoothed && !has_normals);
                self.emit(format_args!("{face}"));
            }
        }
        Ok(())
    }

    /// Position, texture coordinates and normal of a corner: `position`, `position/texture`, `position//normal` or
    /// `position/texture/normal`.
    fn corner(&mut self, corner: &str) -> Result<[u64; 3], String> {
        let malformed = || format!("`{}` is not a corner of a face", excerpt(corner));
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
        Ok([position, texture, normal])
    }

    fn emit(&mut self, line: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{line}");
    }
}

/// The index counted from 1, if there is such an entry. A negative index counts back from the last entry.
fn absolute_index(index: i64, count: usize) -> Option<u64> {
    let count = count as u64;
    let distance = index.unsigned_abs();
    (1..=count).contains(&distance).then(|| if index > 0 { distance } else { count + 1 - distance })
}

/// The number at the start of a word, and whether it is the whole word.
fn number(word: &str) -> Option<(f64, bool)> {
    if let Ok(number) = word.parse() {
        return Some((number, true));
    }
    // No character of a number has more than a byte.
    let ends = (1..word.len().min(MAX_NUMBER_BYTES)).rev().filter(|&end| word.is_char_boundary(end));
    ends.into_iter().find_map(|end| word[..end].parse().ok()).map(|number| (number, false))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_has_the_index_of_each_position() {
        let vertices = "v 500000.125 4500000.001 30\n".repeat(70_000);
        let statements = Statements::new(vertices.as_bytes(), 1 << 20).unwrap();
        let preprocessed = Preprocessed::new(statements, "a.obj", &mut Warnings::default()).unwrap();
        assert_eq!(preprocessed.positions[69_999], DVec3::new(500_000.125, 4_500_000.001, 30.0));
        let positions = preprocessed.text.lines().filter_map(|line| line.strip_prefix("v "));
        let numbers = positions.map(|line| line.split(' ').map(|word| f64::from(word.parse::<f32>().unwrap())));
        let indices = numbers.map(|numbers| position_index(numbers.collect::<Vec<_>>().try_into().unwrap()));
        assert!(indices.eq(0..70_000));
    }
}
