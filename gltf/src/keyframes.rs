//! Values over time, from keyframes.

use drawloom::glam::DQuat;

use crate::accessors::Accessors;
use crate::element::Element;
use crate::error::Problem;

/// What a channel animates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Property {
    Translation,
    Rotation,
    Scale,
    Weights,
}

/// Values over time.
pub(crate) struct Keyframes {
    /// In seconds.
    times: Vec<f32>,
    /// For each time `width` numbers; with cubic splines thrice that: the tangent before it, the value, the tangent
    /// behind it.
    values: Vec<f32>,
    width: usize,
    interpolation: Interpolation,
}

/// What is between two keyframes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Interpolation {
    Linear,
    Step,
    CubicSpline,
}

impl Keyframes {
    /// # Errors
    /// If there is no time, the times do not increase, or there is not a value of `width` numbers for each.
    pub(crate) fn read(
        accessors: Accessors<'_>,
        sampler: &Element<'_>,
        width: usize,
        property: Property,
    ) -> Result<Self, Problem> {
        let needed = |member: &str| accessors.member(sampler, member)?.ok_or_else(|| sampler.lacks(member));
        let (input, output) = (needed("input")?, needed("output")?);
        let interpolation = match sampler.text("interpolation")? {
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::CubicSpline,
            Some("LINEAR") | None => Interpolation::Linear,
            Some(_) => return Err(Problem::invalid(sampler, "has an `interpolation` that is not known")),
        };
        let times = accessors.floats::<1>(&input, &format!("the times of {sampler}"))?.into_flattened();
        if times.is_empty() || times.array_windows().any(|[one, next]| one >= next) {
            return Err(Problem::invalid(sampler, "has no times, or ones that do not increase"));
        }
        let purpose = format!("the values of {sampler}");
        let values = match property {
            Property::Weights => accessors.floats::<1>(&output, &purpose)?.into_flattened(),
            Property::Rotation => accessors.floats::<4>(&output, &purpose)?.into_flattened(),
            Property::Translation | Property::Scale => accessors.floats::<3>(&output, &purpose)?.into_flattened(),
        };
        let per_time = if interpolation == Interpolation::CubicSpline { width.saturating_mul(3) } else { width };
        if values.len() != times.len().saturating_mul(per_time) {
            return Err(Problem::UnequalCounts {
                element: sampler.to_string(),
                what: "numbers",
                count: values.len(),
                expected: times.len().saturating_mul(per_time),
                expected_by: format!("for {} times", times.len()),
            });
        }
        Ok(Self { times, values, width, interpolation })
    }

    /// The time of the last keyframe, in seconds.
    pub(crate) fn end(&self) -> f64 {
        self.times.last().copied().unwrap_or(0.0).into()
    }

    /// The value at a time: the first one before the first time, and the last one after the last.
    pub(crate) fn sample(&self, time: f64, property: Property) -> Vec<f64> {
        let next = self.times.partition_point(|&of_key| f64::from(of_key) <= time);
        let last = self.times.len() - 1;
        if next == 0 || next > last {
            return self.value(next.min(last)).collect();
        }
        let [from, to] = [self.times[next - 1], self.times[next]].map(f64::from);
        let (duration, t) = (to - from, (time - from) / (to - from));
        let (one, other) = (self.value(next - 1), self.value(next));
        match self.interpolation {
            Interpolation::Step => one.collect(),
            Interpolation::Linear if property == Property::Rotation => {
                let [one, other] =
                    [one.collect(), other.collect()].map(|value: Vec<f64>| DQuat::from_slice(&value).normalize());
                one.slerp(other, t).to_array().to_vec()
            }
            Interpolation::Linear => one.zip(other).map(|(one, other)| one + (other - one) * t).collect(),
            Interpolation::CubicSpline => {
                let behind = self.part(next - 1, 2).map(|tangent| tangent * duration);
                let before = self.part(next, 0).map(|tangent| tangent * duration);
                let (t2, t3) = (t * t, t * t * t);
                let ends = one
                    .zip(other)
                    .map(|(one, other)| (2.0 * t3 - 3.0 * t2 + 1.0) * one + (3.0 * t2 - 2.0 * t3) * other);
                let tangents =
                    behind.zip(before).map(|(behind, before)| (t3 - 2.0 * t2 + t) * behind + (t3 - t2) * before);
                ends.zip(tangents).map(|(ends, tangents)| ends + tangents).collect()
            }
        }
    }

    fn value(&self, index: usize) -> impl Iterator<Item = f64> {
        self.part(index, if self.interpolation == Interpolation::CubicSpline { 1 } else { 0 })
    }

    fn part(&self, index: usize, part: usize) -> impl Iterator<Item = f64> {
        let parts = if self.interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        self.values[(index * parts + part) * self.width..][..self.width].iter().copied().map(f64::from)
    }
}
