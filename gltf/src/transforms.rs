//! What an affine transform is made of: a translation, a rotation, a scale, and whether that is all.

use drawloom::glam::{DAffine3, DMat3, DQuat, DVec3};

/// The translation, rotation and scale of a transform.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Decomposed {
    pub(crate) translation: DVec3,
    pub(crate) rotation: DQuat,
    /// Negative along x if the transform mirrors.
    pub(crate) scale: DVec3,
    /// Whether the transform is skewed, so that these are not all of it.
    pub(crate) is_skewed: bool,
}

/// The parts of a transform. One that flattens has a scale of 0.
pub(crate) fn decompose(transform: &DAffine3) -> Decomposed {
    let columns = transform.matrix3;
    let mut scale = DVec3::new(columns.x_axis.length(), columns.y_axis.length(), columns.z_axis.length());
    if columns.determinant() < 0.0 {
        scale.x = -scale.x;
    }
    let axis = |column: DVec3, length: f64| if length == 0.0 { DVec3::ZERO } else { column / length };
    let axes = [axis(columns.x_axis, scale.x), axis(columns.y_axis, scale.y), axis(columns.z_axis, scale.z)];
    let dots = [axes[0].dot(axes[1]), axes[1].dot(axes[2]), axes[2].dot(axes[0])];
    let [x, y, z] = right_angled(axes);
    Decomposed {
        translation: transform.translation,
        rotation: DQuat::from_mat3(&DMat3::from_cols(x, y, z)).normalize(),
        scale,
        is_skewed: dots.into_iter().any(|dot| dot.abs() > 1e-5),
    }
}

/// The nearest right-handed axes at right angles, by Gram and Schmidt. Axes of length 0 become any that fit.
fn right_angled([x, y, z]: [DVec3; 3]) -> [DVec3; 3] {
    let x = x.try_normalize().or_else(|| y.cross(z).try_normalize());
    let x = x.unwrap_or_else(|| (y + z).try_normalize().map_or(DVec3::X, DVec3::any_orthonormal_vector));
    let y = (y - x * x.dot(y)).try_normalize().or_else(|| z.cross(x).try_normalize());
    let y = y.unwrap_or_else(|| x.any_orthonormal_vector());
    [x, y, x.cross(y)]
}
