//! Cameras from an engine's matrices see what these show.

use drawloom::glam::camera::rh::proj::directx;
use drawloom::glam::{DMat4, DQuat, DVec3, EulerRot, dcamera};
use drawloom::scene::Camera;
use drawloom::view::internal::Frustum;
use proptest::prelude::*;

const SIZE: [u32; 2] = [800, 500];

fn any_view() -> impl Strategy<Value = DMat4> {
    let number = || -50.0..50.0_f64;
    ((number(), number(), number()), (-3.0..3.0_f64, -1.5..1.5_f64, -3.0..3.0_f64)).prop_map(|(place, turn)| {
        let turn = DQuat::from_euler(EulerRot::YXZ, turn.0, turn.1, turn.2);
        DMat4::from_rotation_translation(turn, DVec3::new(place.0, place.1, place.2)).inverse()
    })
}

fn any_projection() -> impl Strategy<Value = DMat4> {
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    (0..6, 0.2..2.5_f32, 0.05..2.0_f32, 1.0..200.0_f32, (-0.8..0.8_f32, -0.8..0.8_f32), -20.0..3.0_f32).prop_map(
        move |(kind, angle, near, depth, (x, y), before)| {
            let far = near + depth;
            let (half, first, last) = (angle * 10.0, before, before + depth);
            let matrix = match kind {
                0 => directx::perspective(angle, aspect, near, far),
                1 => directx::perspective_infinite(angle, aspect, near),
                2 => directx::perspective_infinite_reverse(angle, aspect, near),
                3 => directx::perspective(angle, aspect, far, near),
                4 => directx::orthographic(-half * aspect, half * aspect, -half, half, first, last),
                _ => directx::orthographic(
                    (x - 1.0) * half * aspect,
                    (x + 1.0) * half * aspect,
                    (y - 1.0) * half,
                    (y + 1.0) * half,
                    last,
                    first,
                ),
            };
            let mut matrix = matrix;
            if kind < 4 {
                // Off centre.
                (matrix.z_axis.x, matrix.z_axis.y) = (x, y);
            }
            matrix.as_dmat4()
        },
    )
}

proptest! {
    #[test]
    fn a_camera_sees_the_points_that_the_matrices_show(
        view in any_view(),
        projection in any_projection(),
        points in prop::collection::vec(prop::array::uniform3(-60.0..60.0_f64), 200),
    ) {
        let camera = Camera::from_matrices("main", view, projection, SIZE).unwrap();
        let frustum = Frustum::new(&camera);
        for point in points.into_iter().map(DVec3::from_array) {
            let clip = projection * view * point.extend(1.0);
            let inside = [clip.w - clip.x.abs(), clip.w - clip.y.abs(), clip.z, clip.w - clip.z];
            // Points at an edge may be on either side, by the rounding of f32.
            let margin = 1e-3 * clip.abs().max_element().max(1.0);
            let depth_margin = 1e-5 * clip.w.abs().max(1.0);
            let least = inside[0].min(inside[1]) / margin;
            let least_depth = inside[2].min(inside[3]) / depth_margin;
            let is_seen = frustum.intersects_sphere(point, 0.0);
            if least > 1.0 && least_depth > 1.0 {
                prop_assert!(is_seen, "{point}: {inside:?}, {camera:?}");
            }
            if least < -1.0 || least_depth < -1.0 {
                prop_assert!(!is_seen, "{point}: {inside:?}, {camera:?}");
            }
        }
    }
}

#[test]
fn matrices_that_a_camera_cannot_follow_are_refused_with_the_reason() {
    let view = dcamera::rh::view::look_at_mat4(DVec3::Z, DVec3::ZERO, DVec3::Y);
    let projection = dcamera::rh::proj::directx::perspective(1.0, 1.6, 0.1, 10.0);
    let mut sheared = projection;
    sheared.y_axis.x = 0.1;
    let scale = |x, y, z| DMat4::from_scale(DVec3::new(x, y, z));
    let cases = [
        (view * scale(2.0, 2.0, 2.0), projection, "its view matrix scales or shears"),
        (view * scale(-1.0, 1.0, 1.0), projection, "its view matrix mirrors"),
        (view * f64::NAN, projection, "its view matrix has a number that is not finite"),
        (projection, projection, "its view matrix has a number that is not finite, or a perspective"),
        (view, sheared, "its projection matrix turns or shears"),
        (view, dcamera::lh::proj::directx::perspective(1.0, 1.6, 0.1, 10.0), "looks along +Z"),
        (view, projection * view, "its projection matrix turns or shears"),
        (view, projection * f64::INFINITY, "its projection matrix turns or shears"),
        (view, scale(1.0, -1.0, 1.0) * projection, "its projection matrix mirrors"),
        (view, dcamera::rh::proj::directx::perspective(1.0, 1.0, 0.1, 10.0), "another aspect"),
        (view, dcamera::rh::proj::vulkan::perspective(1.0, 1.6, 0.1, 10.0), "its projection matrix mirrors"),
        (view, DMat4::ZERO, "its projection matrix turns or shears"),
        (view, dcamera::rh::proj::directx::perspective(1.0, 1.6, 5.0, 5.0), "not finite"),
    ];
    for (view, projection, expected) in cases {
        let error = Camera::from_matrices("main", view, projection, SIZE).unwrap_err().to_string();
        assert!(error.contains("main") && error.contains(expected), "{error}");
    }
    assert!(Camera::from_matrices("main", view, projection, [0, 0]).is_err());
}
