//! Row `tiny`: so little that a plain loop may be the best of all.

use std::time::Duration;

use drawloom_benches::work::Work;

use crate::Extent;
use crate::passes::Shape;
use crate::turns::{Contender, Row};

/// A frame is 7 jobs of 1 µs.
pub fn row(extent: &Extent) -> Row {
    let shape = Shape { passes: 1, jobs: 7 };
    let mut contenders = vec![Contender::plain_loop(shape.all()), Contender::ideal(shape.all())];
    contenders.extend(shape.contenders());
    Row {
        name: "tiny",
        unit: "µs a frame",
        scale: 1e6,
        pace: extent.hot(),
        work: Work::busy(Duration::from_micros(1)),
        jobs: shape.all(),
        order: shape.order(),
        contenders,
    }
}
