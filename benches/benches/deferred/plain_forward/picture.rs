//! What lights reach of a picture.

use drawloom::view::{GpuLight, GpuView};

/// A perspective camera's axes, to find what a light reaches of its picture.
pub struct Picture {
    axes: [[f32; 3]; 3],
    /// Half the picture's width and height at a distance of 1.
    pub half: [f32; 2],
    pub size: [f32; 2],
    pub near: f32,
}

/// A light's sphere in the camera's axes: to the right, down, forward.
#[derive(Clone, Copy)]
pub struct SeenLight {
    pub center: [f32; 3],
    pub range: f32,
}

impl Picture {
    pub fn new(view: &GpuView) -> Self {
        let half = [view.right.length(), view.up.length()];
        let axes = [view.right / half[0], -view.up / half[1], view.forward].map(|axis| axis.to_array());
        Self { axes, half, size: [view.width, view.height], near: view.near }
    }

    pub fn seen(&self, light: &GpuLight) -> SeenLight {
        let position = light.position.to_array();
        let along = |axis: [f32; 3]| (0..3).map(|index| axis[index] * position[index]).sum();
        SeenLight { center: self.axes.map(along), range: light.range }
    }

    /// The pixels that a light's sphere may reach: x, y, width and height.
    pub fn rectangle(&self, light: &GpuLight) -> [u32; 4] {
        let SeenLight { center: [x, y, z], range } = self.seen(light);
        let (near, far) = ((z - range).max(self.near), z + range);
        if far <= near {
            return [0; 4];
        }
        let [x, y] = [(0, x), (1, y)].map(|(axis, center)| {
            let [begin, end] = self.pixels(axis, [center - range, center + range], [near, far]);
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
