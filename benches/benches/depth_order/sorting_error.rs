//! The sorting error by the number of depth bits in a sort key.
//!
//! - ties: the share of pairs of neighbours by distance that have the same code;
//! - inversions: the share of pairs drawn one after the other that are in the wrong order;
//! - worst: the greatest distance between two that are in the wrong order, as a share of the documented step.

use std::error::Error;

use drawloom::quality::{DepthCurve, DepthPrecision};
use drawloom_benches::table::Table;
use drawloom_testing::random::Random;

const NEAR: f32 = 0.1;
const FAR: f32 = 1e4;
const COUNT: usize = 10_000;

/// Prints the table.
///
/// # Errors
/// Returns an error if two distances in the wrong order differ by more than the documented step.
pub fn print() -> Result<(), Box<dyn Error>> {
    let mut random = Random::new();
    let (low, high) = (f64::from(NEAR), f64::from(FAR));
    let even = (0..COUNT).map(|_| random.between(low, high) as f32).collect();
    let log_even = (0..COUNT).map(|_| random.between(low.ln(), high.ln()).exp() as f32).collect();
    let distributions: [(&str, Vec<f32>); 2] = [("log-uniform", log_even), ("uniform", even)];

    let mut within = true;
    let mut table = Table::new(&["distances", "curve", "bits", "ties, %", "inversions, %", "worst"]);
    for (name, distances) in &distributions {
        for (curve_name, curve) in
            [("linear", DepthCurve::Linear { far: FAR }), ("logarithmic", DepthCurve::Logarithmic)]
        {
            for bits in [8, 12, 16, 18, 20, 24, 32] {
                let Order { ties, inversions, worst } = Order::of(DepthPrecision { bits, curve }, distances);
                within &= worst <= 1.0;
                let percent = |share: f64| format!("{:.3}", share * 100.0);
                let cells = [(*name).to_owned(), curve_name.to_owned(), bits.to_string(), percent(ties)];
                let [distances, curve, bits, ties] = cells;
                table.row([distances, curve, bits, ties, percent(inversions), format!("{worst:.3}")]);
            }
        }
    }
    table.print();
    if within {
        return Ok(());
    }
    Err("two distances in the wrong order differ by more than the documented step".into())
}

/// The errors of an order.
struct Order {
    ties: f64,
    inversions: f64,
    worst: f64,
}

impl Order {
    fn of(key: DepthPrecision, distances: &[f32]) -> Self {
        let code = |distance: f32| key.quantize(distance, NEAR, FAR);
        let share = |count: usize| count as f64 / (distances.len() - 1) as f64;

        let mut exact = distances.to_vec();
        exact.sort_by(f32::total_cmp);
        let ties = exact.windows(2).filter(|pair| pair[0] < pair[1] && code(pair[0]) == code(pair[1])).count();

        let mut drawn = distances.to_vec();
        drawn.sort_by_key(|&distance| code(distance));
        let inversions = drawn.windows(2).filter(|pair| pair[0] > pair[1]).count();

        let (mut farthest, mut worst) = (0.0_f32, 0.0_f64);
        for &distance in &drawn {
            if farthest > distance {
                let apart = f64::from(farthest) - f64::from(distance);
                worst = worst.max(apart / key.step(farthest, NEAR, FAR));
            }
            farthest = farthest.max(distance);
        }
        Self { ties: share(ties), inversions: share(inversions), worst }
    }
}
