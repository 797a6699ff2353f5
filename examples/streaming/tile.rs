//! A tile of land: its mesh and its texture, made by background jobs.

use drawloom::glam::{Vec3, Vec3Swizzles};
use drawloom::scene::{Mesh, SceneError, Texture, Topology, Vertex};

use crate::land::{ground, height};

/// The side of a tile in metres.
pub const SIDE: f64 = 64.0;

/// Quads along a side.
const QUADS: usize = 64;

/// Corners of quads along a side.
const SIDE_CORNERS: usize = QUADS + 1;

/// Pixels along a side of the texture.
const PIXELS: usize = 256;

/// The pixels around the tile that show its surroundings. Coarse mip levels blend an edge of the texture with the
/// opposite one.
const MARGIN: f32 = 8.0;

/// A tile's column and row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TileIndex {
    pub x: i64,
    pub z: i64,
}

impl TileIndex {
    /// The tile at a place.
    pub fn at(x: f64, z: f64) -> Self {
        Self { x: (x / SIDE).floor() as i64, z: (z / SIDE).floor() as i64 }
    }

    /// The corner with the lowest coordinates, in metres.
    pub fn corner(self) -> [f64; 2] {
        [self.x as f64 * SIDE, self.z as f64 * SIDE]
    }

    pub fn center(self) -> [f64; 2] {
        self.corner().map(|corner| corner + SIDE * 0.5)
    }
}

/// What a tile's mesh and texture take on the device, in bytes.
pub const BYTES: u64 = {
    let vertices = (QUADS + 1) * (QUADS + 1) * size_of::<Vertex>();
    let indices = QUADS * QUADS * 6 * size_of::<u32>();
    // A third more for the mip levels.
    (vertices + indices + PIXELS * PIXELS * 4 * 4 / 3) as u64
};

/// The heights and normals of a tile at the corners of its quads.
struct Surface {
    heights: Vec<f32>,
    normals: Vec<Vec3>,
}

impl Surface {
    /// Corners along a side, with one more on either side for the normals of the outermost.
    const CORNERS: usize = QUADS + 3;
    const STEP: f64 = SIDE / QUADS as f64;

    fn new(tile: TileIndex) -> Self {
        let [x, z] = tile.corner();
        let corners = (0..Self::CORNERS * Self::CORNERS).map(|index| (index % Self::CORNERS, index / Self::CORNERS));
        let place = |number: usize| (number as f64 - 1.0) * Self::STEP;
        let heights: Vec<_> = corners.map(|(column, row)| height(x + place(column), z + place(row))).collect();
        let normal = |index: usize| {
            let at = |right: usize, down: usize| {
                heights[(index / SIDE_CORNERS + down) * Self::CORNERS + index % SIDE_CORNERS + right]
            };
            let (along_x, along_z) = (at(2, 1) - at(0, 1), at(1, 2) - at(1, 0));
            Vec3::new(-along_x, 2.0 * Self::STEP as f32, -along_z).normalize()
        };
        let normals = (0..SIDE_CORNERS * SIDE_CORNERS).map(normal).collect();
        Self { heights, normals }
    }

    /// The height of a corner.
    fn height(&self, column: usize, row: usize) -> f32 {
        self.heights[(row + 1) * Self::CORNERS + column + 1]
    }

    fn normal(&self, column: usize, row: usize) -> Vec3 {
        self.normals[row * SIDE_CORNERS + column]
    }

    /// The height, and how far the normal points up, between corners. From 0 to 1 across the tile; beyond it, those
    /// of its edge.
    fn sample(&self, u: f64, v: f64) -> [f32; 2] {
        let [x, z] = [u, v].map(|share| share.clamp(0.0, 1.0) * QUADS as f64);
        let (column, row) = ((x as usize).min(QUADS - 1), (z as usize).min(QUADS - 1));
        let (right, down) = ((x - column as f64) as f32, (z - row as f64) as f32);
        let corner = |column, row| Vec3::new(self.height(column, row), self.normal(column, row).y, 0.0);
        let above = corner(column, row).lerp(corner(column + 1, row), right);
        let below = corner(column, row + 1).lerp(corner(column + 1, row + 1), right);
        above.lerp(below, down).xy().to_array()
    }
}

/// The mesh of a tile. Its origin is the tile's corner at a height of 0.
///
/// # Errors
/// If it is no valid mesh.
pub fn mesh(tile: TileIndex) -> Result<Mesh, SceneError> {
    let surface = Surface::new(tile);
    let side = SIDE_CORNERS;
    let vertex = |index: usize| {
        let (column, row) = (index % side, index / side);
        let along = |number: usize| (number as f64 * Surface::STEP) as f32;
        Vertex {
            position: [along(column), surface.height(column, row), along(row)],
            normal: surface.normal(column, row).to_array(),
            uv: [column, row]
                .map(|number| (MARGIN + number as f32 / QUADS as f32 * (PIXELS as f32 - 2.0 * MARGIN)) / PIXELS as f32),
        }
    };
    let quad = |index: usize| {
        let first = (index / QUADS * side + index % QUADS) as u32;
        let [right, below] = [first + 1, first + side as u32];
        [first, below, right, right, below, below + 1]
    };
    let vertices = (0..side * side).map(vertex).collect();
    let indices = (0..QUADS * QUADS).flat_map(quad).collect();
    Mesh::new(format!("tile {} {}", tile.x, tile.z), Topology::TriangleList, vertices, indices)
}

/// The colours of a tile.
///
/// # Errors
/// If it is no valid texture.
pub fn texture(tile: TileIndex) -> Result<Texture, SceneError> {
    let surface = Surface::new(tile);
    let [x, z] = tile.corner();
    let mut pixels = Vec::with_capacity(PIXELS * PIXELS * 4);
    for row in 0..PIXELS {
        for column in 0..PIXELS {
            let across = PIXELS as f64 - 2.0 * f64::from(MARGIN);
            let [u, v] = [column, row].map(|number| (number as f64 + 0.5 - f64::from(MARGIN)) / across);
            let [height, up] = surface.sample(u, v);
            let color = ground(x + u * SIDE, z + v * SIDE, height, up);
            pixels.extend(color.to_array().map(srgb));
            pixels.push(255);
        }
    }
    Texture::new(format!("ground {} {}", tile.x, tile.z), PIXELS as u32, PIXELS as u32, pixels)
}

/// A linear value as an sRGB byte, within a step or two.
fn srgb(linear: f32) -> u8 {
    (linear.clamp(0.0, 1.0).sqrt() * 255.0 + 0.5) as u8
}
