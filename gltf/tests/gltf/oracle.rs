//! Where vertices are, by the plainest arithmetic that says so: matrices in double precision, written out.

use serde_json::Value;

use crate::generate::shapes::Shape;

/// A matrix by rows.
pub type Matrix = [[f64; 4]; 4];

pub const IDENTITY: Matrix = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];

/// Appends a shape below a chain of nodes, from the root on.
pub fn append_placed(flat: &mut Shape, shape: &Shape, chain: &[Value]) {
    let matrix = chain.iter().map(matrix_of).fold(IDENTITY, |product, matrix| multiply(&product, &matrix));
    append_transformed(flat, shape, &vec![matrix; shape.positions.len()]);
}

/// Appends a shape, each vertex of which has a matrix of its own.
pub fn append_transformed(flat: &mut Shape, shape: &Shape, matrices: &[Matrix]) {
    let first = flat.positions.len() as u32;
    for ((position, normal), matrix) in shape.positions.iter().zip(&shape.normals).zip(matrices) {
        flat.positions.push(point(matrix, *position));
        flat.normals.push(normal_of(matrix, *normal));
    }
    flat.uvs.extend(&shape.uvs);
    let is_mirrored = matrices.first().is_some_and(|matrix| determinant(matrix) < 0.0);
    for triangle in shape.indices.chunks(3) {
        let [a, b, c] = [triangle[0], triangle[1], triangle[2]].map(|index| first + index);
        flat.indices.extend(if is_mirrored { [a, c, b] } else { [a, b, c] });
    }
}

/// The matrix of a node.
pub fn matrix_of(node: &Value) -> Matrix {
    let numbers = |name: &str, default: &[f64]| -> Vec<f64> {
        let values = node.get(name).and_then(Value::as_array);
        values.map_or(default.to_vec(), |values| values.iter().map(|value| value.as_f64().expect("a number")).collect())
    };
    if let Some(matrix) = node.get("matrix") {
        let at = |row: usize, column: usize| matrix[column * 4 + row].as_f64().expect("a number");
        return std::array::from_fn(|row| std::array::from_fn(|column| at(row, column)));
    }
    let translation = numbers("translation", &[0.0; 3]);
    let scale = numbers("scale", &[1.0; 3]);
    let rotation = rotation_matrix(&numbers("rotation", &[0.0, 0.0, 0.0, 1.0]));
    let mut matrix = IDENTITY;
    for row in 0..3 {
        for column in 0..3 {
            matrix[row][column] = rotation[row][column] * scale[column];
        }
        matrix[row][3] = translation[row];
    }
    matrix
}

/// The matrix of a quaternion of unit length: x, y, z, w.
pub fn rotation_matrix(quaternion: &[f64]) -> [[f64; 3]; 3] {
    let [x, y, z, w] = [quaternion[0], quaternion[1], quaternion[2], quaternion[3]];
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

pub fn multiply(one: &Matrix, other: &Matrix) -> Matrix {
    let sum = |row: usize, column: usize| (0..4).map(|index| one[row][index] * other[index][column]).sum();
    std::array::from_fn(|row| std::array::from_fn(|column| sum(row, column)))
}

pub fn point(matrix: &Matrix, [x, y, z]: [f32; 3]) -> [f32; 3] {
    let point = [f64::from(x), f64::from(y), f64::from(z), 1.0];
    std::array::from_fn(|row| (0..4).map(|column| matrix[row][column] * point[column]).sum::<f64>() as f32)
}

/// By the transposed inverse, from cofactors, of unit length.
fn normal_of(matrix: &Matrix, normal: [f32; 3]) -> [f32; 3] {
    let m = matrix;
    let cofactor = |row: usize, column: usize| {
        let [a, b] = [(row + 1) % 3, (row + 2) % 3];
        let [c, d] = [(column + 1) % 3, (column + 2) % 3];
        m[a][c] * m[b][d] - m[a][d] * m[b][c]
    };
    let sign = determinant(matrix).signum();
    let turned: [f64; 3] =
        std::array::from_fn(|row| (0..3).map(|column| sign * cofactor(row, column) * f64::from(normal[column])).sum());
    let length = turned.iter().map(|number| number * number).sum::<f64>().sqrt();
    turned.map(|number| (number / length) as f32)
}

fn determinant(m: &Matrix) -> f64 {
    m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
        + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
}
