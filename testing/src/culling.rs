//! Random cameras, spheres and boxes, and an f64 oracle that counts the culling tests' wrong answers.

pub mod boxes;
pub mod cameras;
pub mod lanes;
pub mod naive;
pub mod oracle;
pub mod spheres;
pub mod tally;
