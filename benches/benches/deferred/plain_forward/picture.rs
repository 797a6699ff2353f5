//! What lights reach of a picture.

use drawloom::view::GpuView;
use drawloom::view::internal::GpuLight;

/// A perspective camera's axes, to find what a light reaches of its picture.
pub struct Picture {
    axes: [[f32; 3]; 3],
    /// Half the picture's width and height at a distance of 1.
    pub half: [f32; 2],
    pub size: [f32; 2],
    pub near: f32,
}

/// A sphere around what a light reaches, in the camera's axes: to the right, down, forward.
#[derive(Clone, Copy)]
pub struct SeenLight {
    pub center: [f32; 3],
    pub radius: f32,
}

impl Picture {
    pub fn new(view: &GpuView) -> Self {
        let half = [view.right.length(), view.up.length()];
        let axes = [view.right / half[0], -view.up / half[1], view.forward].map(|axis| axis.to_array());
        Self { axes, half, size: [view.width, view.height], near: view.near }
    }

    pub fn seen(&self, light: &GpuLight) -> SeenLight {
        let (ahead, radius) = bounding_sphere(light);
        let center = (light.position + light.direction * ahead).to_array();
        let along = |axis: [f32; 3]| (0..3).map(|index| axis[index] * center[index]).sum();
        SeenLight { center: self.axes.map(along), radius }
    }

    /// The pixels that a light may reach: x, y, width and height.
    pub fn rectangle(&self, light: &GpuLight) -> [u32; 4] {
        let SeenLight { center: [x, y, z], radius } = self.seen(light);
        let (near, far) = ((z - radius).max(self.near), z + radius);
        if far <= near {
            return [0; 4];
        }
        let [x, y] = [(0, x), (1, y)].map(|(axis, center)| {
            let [begin, end] = if z - radius > self.near {
                // No slope is multiplied: the distances are 1.
                self.pixels(axis, tangents([center, z], radius), [1.0; 2])
            } else {
                self.pixels(axis, [center - radius, center + radius], [near, far])
            };
            let size = self.size[axis];
            [begin.clamp(0.0, size) as u32, end.clamp(0.0, size).ceil() as u32]
        });
        [x[0], y[0], x[1] - x[0], y[1] - y[0]]
    }

    /// The pixels that an interval across the view covers between two distances.
    pub fn pixels(&self, axis: usize, [low, high]: [f32; 2], [near, far]: [f32; 2]) -> [f32; 2] {
        let pixel = |across: f32| (across / self.half[axis] + 1.0) * 0.5 * self.size[axis];
        [pixel((low / near).min(low / far)), pixel((high / near).max(high / far))]
    }
}

/// The smallest sphere around what a light reaches: how far its centre is from the light, in the light's direction, and
/// its radius.
fn bounding_sphere(light: &GpuLight) -> (f32, f32) {
    let cosine = light.cone_end;
    if light.kind != SPOT || cosine <= 0.0 {
        (0.0, light.range)
    } else if cosine * cosine < 0.5 {
        // Through the rim of the cone, with its centre in the rim's plane.
        (light.range * cosine, light.range * (1.0 - cosine * cosine).sqrt())
    } else {
        // Through the rim and the light.
        let radius = light.range / (2.0 * cosine);
        (radius, radius)
    }
}

/// [`GpuLight::kind`].
const SPOT: u32 = 2;

/// The slopes of the lines through the origin that touch a disc, which is farther away than its radius (Mara and
/// McGuire 2013).
fn tangents([across, ahead]: [f32; 2], radius: f32) -> [f32; 2] {
    let root = radius * (across * across + ahead * ahead - radius * radius).sqrt();
    let divisor = ahead * ahead - radius * radius;
    [(across * ahead - root) / divisor, (across * ahead + root) / divisor]
}
