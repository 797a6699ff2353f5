//! Values over time, from keyframes.

use drawloom::glam::DQuat;
use gltf::animation::{Interpolation, Property};

use crate::accessors::Accessors;
use crate::error::Problem;

/// Values over time.
pub(crate) struct Keyframes {
    times: Vec<f64>,
    /// For each time `width` numbers; with cubic splines thrice that: the tangent before it, the value, the tangent behind it.
    values: Vec<f64>,
    width: usize,
    interpolation: Interpolation,
}

impl Keyframes {
    /// # Errors
    /// If there is no time, the times do not increase, or there is not a value of `width` numbers for each.
    pub(crate) fn read(
        accessors: &Accessors<'_>,
        sampler: &gltf::animation::Sampler<'_>,
        width: usize,
        element: &str,
    ) -> Result<Self, Problem> {
        let times = accessors.floats::<1>(&sampler.input(), &format!("the times of {element}"))?;
        let times: Vec<_> = times.into_iter().map(|[time]| f64::from(time)).collect();
        if times.is_empty() || times.array_windows().any(|[one, next]| one >= next) {
            return Err(Problem::invalid(element, "has no times, or ones that do not increase"));
        }
        let (output, purpose) = (sampler.output(), format!("the values of {element}"));
        let values: Vec<f32> = match output.dimensions().multiplicity() {
            1 => accessors.floats::<1>(&output, &purpose)?.into_flattened(),
            4 if width == 4 => accessors.floats::<4>(&output, &purpose)?.into_flattened(),
            _ => accessors.floats::<3>(&output, &purpose)?.into_flattened(),
        };
        let interpolation = sampler.interpolation();
        let per_time = if interpolation == Interpolation::CubicSpline { 3 * width } else { width };
        if values.len() != times.len() * per_time {
            return Err(Problem::UnequalCounts {
                element: element.to_owned(),
                what: "numbers".to_owned(),
                count: values.len(),
                expected: times.len() * per_time,
                expected_by: format!("for {} times", times.len()),
            });
        }
        Ok(Self { times, values: values.into_iter().map(f64::from).collect(), width, interpolation })
    }

    /// The value at a time: the first one before the first time, and the last one after the last.
    pub(crate) fn sample(&self, time: f64, property: Property) -> Vec<f64> {
        let next = self.times.partition_point(|&of_key| of_key <= time);
        let last = self.times.len() - 1;
        if next == 0 || next > last {
            return self.value(next.min(last)).to_vec();
        }
        let (from, to) = (self.times[next - 1], self.times[next]);
        let (duration, t) = (to - from, (time - from) / (to - from));
        let [one, other] = [self.value(next - 1), self.value(next)];
        match self.interpolation {
            Interpolation::Step => one.to_vec(),
            Interpolation::Linear if property == Property::Rotation => {
                let [one, other] = [one, other].map(|value| DQuat::from_slice(value).normalize());
                one.slerp(other, t).to_array().to_vec()
            }
            Interpolation::Linear => one.iter().zip(other).map(|(one, other)| one + (other - one) * t).collect(),
            Interpolation::CubicSpline => {
                let behind = self.part(next - 1, 2).iter().map(|tangent| tangent * duration);
                let before = self.part(next, 0).iter().map(|tangent| tangent * duration);
                let (t2, t3) = (t * t, t * t * t);
                let ends = one
                    .iter()
                    .zip(other)
                    .map(|(one, other)| (2.0 * t3 - 3.0 * t2 + 1.0) * one + (3.0 * t2 - 2.0 * t3) * other);
                let tangents =
                    behind.zip(before).map(|(behind, before)| (t3 - 2.0 * t2 + t) * behind + (t3 - t2) * before);
                ends.zip(tangents).map(|(ends, tangents)| ends + tangents).collect()
            }
        }
    }

    fn value(&self, index: usize) -> &[f64] {
        self.part(index, if self.interpolation == Interpolation::CubicSpline { 1 } else { 0 })
    }

    fn part(&self, index: usize, part: usize) -> &[f64] {
        let parts = if self.interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        &self.values[(index * parts + part) * self.width..][..self.width]
    }
}
