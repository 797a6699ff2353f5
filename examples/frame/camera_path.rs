//! The path of a camera: keyframes in a file, and a smooth curve through them.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

use drawloom::glam::DVec3;

use crate::arguments::{CameraPosition, parse_numbers};

/// Where a camera is, and what it looks at, from frame to frame.
#[derive(Debug)]
pub struct CameraPath {
    /// At least one, in ascending order of frames.
    keyframes: Vec<Keyframe>,
}

#[derive(Clone, Copy, Debug)]
struct Keyframe {
    frame: u32,
    /// Position and target, in metres.
    points: [DVec3; 2],
}

impl CameraPath {
    /// The most bytes of a file.
    pub const MAX_BYTES: u64 = 1 << 26;

    /// Reads keyframes from a file: see [`CameraPath::parse`].
    ///
    /// # Errors
    /// If it is no regular file, as others may have no end; if it is too large, cannot be read, or has a line that is
    /// wrong.
    pub fn load(path: &Path) -> Result<Self, String> {
        let read = || -> io::Result<String> {
            // To open a pipe is to wait for its writer.
            if !fs::metadata(path)?.is_file() {
                return Err(io::Error::other("it is not a regular file"));
            }
            let mut text = String::new();
            File::open(path)?.take(Self::MAX_BYTES + 1).read_to_string(&mut text)?;
            if text.len() as u64 > Self::MAX_BYTES {
                return Err(io::Error::other(format!("it has more than {} bytes", Self::MAX_BYTES)));
            }
            Ok(text)
        };
        Self::parse(&read().map_err(|error| error.to_string())?)
    }

    /// Parses keyframes, one a line: the frame's number, and position and target, `12 x y z tx ty tz`. Frames ascend.
    /// What follows a `#` is a comment.
    ///
    /// # Errors
    /// Names the line that is wrong.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut keyframes: Vec<Keyframe> = Vec::new();
        for (number, line) in (1..).zip(text.lines()) {
            let line = line.split_once('#').map_or(line, |(values, _)| values);
            if line.trim().is_empty() {
                continue;
            }
            let keyframe = Keyframe::parse(line).map_err(|problem| format!("line {number}: {problem}"))?;
            if keyframes.last().is_some_and(|last| last.frame >= keyframe.frame) {
                return Err(format!("line {number}: frame {} does not come after the one before", keyframe.frame));
            }
            keyframes.push(keyframe);
        }
        if keyframes.is_empty() { Err("it has no keyframe".to_owned()) } else { Ok(Self { keyframes }) }
    }

    /// The camera of a frame: on a cubic curve through the keyframes (Catmull–Rom), and at rest before the first and
    /// after the last.
    ///
    /// # Errors
    /// If its position is its target.
    pub fn at(&self, frame: u32) -> Result<CameraPosition, String> {
        let next = self.keyframes.partition_point(|keyframe| keyframe.frame <= frame);
        let [position, target] = match (next.checked_sub(1), self.keyframes.get(next)) {
            (None, _) => self.keyframes[0].points,
            (Some(last), None) => self.keyframes[last].points,
            (Some(before), Some(_)) => [0, 1].map(|point| self.between(before, frame, point)),
        };
        CameraPosition::new(position, target).map_err(|problem| format!("frame {frame}: {problem}"))
    }

    /// A point of the curve between a keyframe and the next, as a cubic Hermite spline.
    fn between(&self, before: usize, frame: u32, point: usize) -> DVec3 {
        let [start, end] = [before, before + 1].map(|index| self.keyframes[index]);
        let length = f64::from(end.frame - start.frame);
        let share = f64::from(frame - start.frame) / length;
        let (square, cube) = (share * share, share * share * share);
        start.points[point] * (2.0 * cube - 3.0 * square + 1.0)
            + self.velocity(before, point) * (length * (cube - 2.0 * square + share))
            + end.points[point] * (3.0 * square - 2.0 * cube)
            + self.velocity(before + 1, point) * (length * (cube - square))
    }

    /// The change of a point per frame at a keyframe: the difference of its neighbours, divided by the frames between
    /// them.
    fn velocity(&self, index: usize, point: usize) -> DVec3 {
        let before = self.keyframes[index.saturating_sub(1)];
        let behind = self.keyframes[(index + 1).min(self.keyframes.len() - 1)];
        (behind.points[point] - before.points[point]) / f64::from(behind.frame - before.frame)
    }
}

impl Keyframe {
    fn parse(line: &str) -> Result<Self, String> {
        let mut words = line.split_whitespace();
        let frame = words.next().unwrap_or_default();
        let frame = frame.parse().map_err(|error| format!("frame {frame:?}: {error}"))?;
        let numbers = parse_numbers(words)?;
        let &[x, y, z, target_x, target_y, target_z] = numbers.as_slice() else {
            return Err(format!("expected a frame and six numbers, found {} numbers", numbers.len()));
        };
        let points = [DVec3::new(x, y, z), DVec3::new(target_x, target_y, target_z)];
        CameraPosition::new(points[0], points[1])?;
        Ok(Self { frame, points })
    }
}
