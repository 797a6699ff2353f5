//! A camera that flies: keys move it, and a drag with the mouse turns it.

use std::collections::HashSet;
use std::f32::consts::FRAC_PI_2;
use std::mem;
use std::time::Duration;

use drawloom::glam::{DVec2, DVec3, EulerRot, Quat, Vec3};
use winit::keyboard::KeyCode;

/// A camera that flies.
#[derive(Debug)]
pub struct FlyCamera {
    /// In the world, in metres.
    pub position: DVec3,
    /// To the left, in radians: 0 looks along −Z.
    yaw: f32,
    /// Upwards, in radians.
    pitch: f32,
    held: HashSet<KeyCode>,
    /// Where the pointer was when it was last seen while the button was held, in logical pixels.
    drag: Option<DVec2>,
    pointer: DVec2,
}

impl FlyCamera {
    /// Metres a second.
    const SPEED: f64 = 8.0;
    const FAST: f64 = 4.0;
    const RADIANS_PER_PIXEL: f32 = 0.004;

    /// At `position`, looking at `target`.
    pub fn looking_at(position: DVec3, target: DVec3) -> Self {
        let direction = (target - position).normalize_or(DVec3::NEG_Z).as_vec3();
        let (yaw, pitch) = ((-direction.x).atan2(-direction.z), direction.y.asin());
        Self { position, yaw, pitch, held: HashSet::new(), drag: None, pointer: DVec2::ZERO }
    }

    /// From camera space to the world.
    pub fn orientation(&self) -> Quat {
        Quat::from_euler(EulerRot::YXZ, self.yaw, self.pitch, 0.0).normalize()
    }

    /// A key went down or up.
    pub fn set_key(&mut self, key: KeyCode, is_held: bool) {
        if is_held {
            self.held.insert(key);
        } else {
            self.held.remove(&key);
        }
    }

    /// The mouse button went down or up.
    pub fn set_dragging(&mut self, is_dragging: bool) {
        self.drag = is_dragging.then_some(self.pointer);
    }

    /// The pointer is at a position, in logical pixels.
    pub fn move_pointer(&mut self, position: DVec2) {
        self.pointer = position;
        if let Some(before) = &mut self.drag {
            let moved = position - mem::replace(before, position);
            self.turn(moved.as_vec2().to_array());
        }
    }

    /// The window no longer hears of keys and buttons that go up.
    pub fn release_all(&mut self) {
        self.held.clear();
        self.drag = None;
    }

    /// Flies on by so much time.
    pub fn update(&mut self, elapsed: Duration) {
        let axis = |forth, back| f32::from(self.held.contains(&forth)) - f32::from(self.held.contains(&back));
        let direction =
            self.orientation() * Vec3::new(axis(KeyCode::KeyD, KeyCode::KeyA), 0.0, axis(KeyCode::KeyS, KeyCode::KeyW));
        let direction = direction + Vec3::Y * axis(KeyCode::KeyE, KeyCode::KeyQ);
        let is_fast = self.held.contains(&KeyCode::ShiftLeft) || self.held.contains(&KeyCode::ShiftRight);
        let speed = if is_fast { Self::SPEED * Self::FAST } else { Self::SPEED };
        self.position += direction.normalize_or_zero().as_dvec3() * speed * elapsed.as_secs_f64();
    }

    /// The scene follows the pointer: a drag to the right turns the camera to the left.
    fn turn(&mut self, [right, down]: [f32; 2]) {
        self.yaw += right * Self::RADIANS_PER_PIXEL;
        self.pitch = (self.pitch + down * Self::RADIANS_PER_PIXEL).clamp(-FRAC_PI_2, FRAC_PI_2);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn forward(camera: &FlyCamera) -> Vec3 {
        camera.orientation() * Vec3::NEG_Z
    }

    #[test]
    fn it_looks_where_it_is_told_to() {
        for direction in [DVec3::NEG_Z, DVec3::Z, DVec3::X, DVec3::new(1.0, -2.0, 0.5), DVec3::Y] {
            let camera = FlyCamera::looking_at(DVec3::splat(3.0), DVec3::splat(3.0) + direction);
            let difference = forward(&camera) - direction.normalize().as_vec3();
            assert!(difference.length() < 1e-6, "{direction}: {difference}");
        }
    }

    #[test]
    fn keys_move_it_while_they_are_held() {
        let mut camera = FlyCamera::looking_at(DVec3::ZERO, DVec3::NEG_Z);
        camera.set_key(KeyCode::KeyW, true);
        camera.update(Duration::from_secs(1));
        assert!((camera.position - DVec3::NEG_Z * FlyCamera::SPEED).length() < 1e-6);
        camera.set_key(KeyCode::KeyS, true);
        camera.set_key(KeyCode::KeyE, true);
        camera.update(Duration::from_secs(1));
        assert!((camera.position - DVec3::new(0.0, 1.0, -1.0) * FlyCamera::SPEED).length() < 1e-5);
        camera.release_all();
        let before = camera.position;
        camera.update(Duration::from_secs(1));
        assert_eq!(camera.position, before);
    }

    #[test]
    fn only_a_drag_turns_it() {
        let mut camera = FlyCamera::looking_at(DVec3::ZERO, DVec3::NEG_Z);
        camera.move_pointer(DVec2::new(200.0, 300.0));
        camera.move_pointer(DVec2::new(500.0, 0.0));
        assert_eq!(forward(&camera), Vec3::NEG_Z);
        camera.set_dragging(true);
        camera.move_pointer(DVec2::new(600.0, 0.0));
        assert!((camera.yaw - 0.4).abs() < 1e-6);
        camera.move_pointer(DVec2::new(600.0, 1e6));
        assert_eq!(camera.pitch, FRAC_PI_2);
        camera.set_dragging(false);
        camera.move_pointer(DVec2::ONE);
        camera.move_pointer(DVec2::ZERO);
        assert!((camera.yaw - 0.4).abs() < 1e-6);
    }
}
