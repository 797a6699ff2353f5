//! Row `tiny`: so little work that a plain loop may be fastest.

use std::time::Duration;

use drawloom_benches::work::Work;

use crate::Extent;
use crate::chains::Chain;
use crate::row::{Contender, Row};

/// 7 jobs of 1 µs.
pub fn row(extent: &Extent, workers: &[usize]) -> Row {
    let chain = Chain { nodes: 1, jobs: 7 };
    let mut contenders = vec![Contender::plain_loop(chain.all())];
    for &workers in workers {
        contenders.push(Contender::ideal(chain.all(), workers));
        contenders.extend(chain.contenders(workers));
    }
    Row {
        name: "tiny",
        unit: "µs per frame",
        scale: 1e6,
        pace: extent.back_to_back(),
        work: Work::busy(Duration::from_micros(1)),
        jobs: chain.all(),
        order: chain.order(),
        contenders,
    }
}
