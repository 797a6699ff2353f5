//! Mip levels in f64, pixel by pixel.

/// All levels of a target.
#[derive(Clone, Debug)]
pub(super) struct Chain(pub(super) Vec<Level>);

/// A level of a target, in numbers.
#[derive(Clone, Debug)]
pub(super) struct Level {
    pub(super) size: [usize; 2],
    pub(super) values: Vec<f64>,
}

impl Level {
    pub(super) fn new(size: [usize; 2], value: impl Fn([usize; 2]) -> f64) -> Self {
        let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
        Self { size, values: pixels.map(value).collect() }
    }

    pub(super) fn at(&self, [x, y]: [usize; 2]) -> f64 {
        self.values[y.min(self.size[1] - 1) * self.size[0] + x.min(self.size[0] - 1)]
    }

    /// The next level: of each pixel the mean over its rectangle.
    pub(super) fn coarser(&self) -> Self {
        let size = self.size.map(|pixels| (pixels / 2).max(1));
        // The share of a pixel's extent that a pixel of this level covers.
        let share = |axis: usize, coarse: usize, fine: usize| {
            let extent = self.size[axis] as f64 / size[axis] as f64;
            let [start, end] = [coarse, coarse + 1].map(|edge| edge as f64 * extent);
            (end.min(fine as f64 + 1.0) - start.max(fine as f64)).max(0.0) / extent
        };
        Self::new(size, |[x, y]| {
            let of_row = |row: usize| {
                (0..self.size[0]).map(|column| share(0, x, column) * self.at([column, row])).sum::<f64>()
                    * share(1, y, row)
            };
            (0..self.size[1]).map(of_row).sum()
        })
    }

    fn bilinear(&self, uv: [f64; 2]) -> f64 {
        let weight = |axis: usize, index: usize| {
            let position = (uv[axis] * self.size[axis] as f64 - 0.5).clamp(0.0, self.size[axis] as f64 - 1.0);
            (1.0 - (position - index as f64).abs()).max(0.0)
        };
        let pixels = (0..self.size[1]).flat_map(|y| (0..self.size[0]).map(move |x| [x, y]));
        pixels.map(|[x, y]| weight(0, x) * weight(1, y) * self.at([x, y])).sum()
    }
}

impl Chain {
    pub(super) fn of(level: Level) -> Self {
        let mut levels = vec![level];
        while let Some(last) = levels.last().filter(|last| last.size != [1, 1]) {
            levels.push(last.coarser());
        }
        Self(levels)
    }

    pub(super) fn zeros(size: [usize; 2]) -> Self {
        Self::of(Level::new(size, |_| 0.0))
    }

    pub(super) fn loaded(&self, pixel: [usize; 2], level: usize) -> f64 {
        self.0[level.min(self.0.len() - 1)].at(pixel)
    }

    pub(super) fn sampled(&self, uv: [f64; 2], level: f64) -> f64 {
        let level = level.clamp(0.0, self.0.len() as f64 - 1.0);
        let [finer, coarser] = [level.floor(), level.ceil()].map(|level| self.0[level as usize].bilinear(uv));
        finer + (coarser - finer) * level.fract()
    }
}
