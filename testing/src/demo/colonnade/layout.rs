//! Measurements of the colonnade, in metres. +Y is up, and the nave runs along −Z.

/// The distance between columns, along a row and across an aisle.
pub(super) const BAY: f32 = 3.8;
/// The x of the rows of columns, beside the nave and beyond the aisles. Each is mirrored to −x.
pub(super) const ROWS: [f32; 2] = [5.6, 5.6 + BAY];
/// Columns in a row.
pub(super) const COLUMNS: usize = 11;
/// The z of the first column; the others are at lower z.
pub(super) const FIRST: f32 = 7.6;
/// The side of one of the squares of lawn.
pub(super) const LAWN: f32 = 30.0;
/// The height of the podium that the box stands on.
pub(super) const PODIUM: f32 = 0.6;

/// The x of each row of columns, from left to right.
pub(super) fn rows() -> impl Iterator<Item = f32> {
    [-ROWS[1], -ROWS[0], ROWS[0], ROWS[1]].into_iter()
}

/// The z of each column of a row, from the front.
pub(super) fn columns() -> impl Iterator<Item = f32> {
    (0..COLUMNS).map(|column| FIRST - BAY * column as f32)
}

/// The z of the middle of each bay, between two columns, from the front.
pub(super) fn bays() -> impl Iterator<Item = f32> {
    columns().take(COLUMNS - 1).map(|z| z - BAY / 2.0)
}
