//! A frame as lanes of intervals over time.

use std::time::Duration;

use egui::{Align2, FontId, Painter, Rect, Response, Sense, Ui, pos2, vec2};

use super::tracks::{Interval, Track, tracks};
use crate::colors::ON_GROUP;
use crate::frame_history::FrameRecord;

/// The lanes, and which part of a frame they show.
#[derive(Debug)]
pub struct Lanes {
    /// The first and the last point in time, in fractions of the frame.
    part: [f64; 2],
}

const NAME_WIDTH: f32 = 110.0;
const ROW_HEIGHT: f32 = 20.0;
const AXIS_HEIGHT: f32 = 16.0;
const SMALLEST_PART: f64 = 1e-5;

impl Default for Lanes {
    fn default() -> Self {
        Self { part: [0.0, 1.0] }
    }
}

impl Lanes {
    /// Shows the lanes. The wheel zooms, a drag moves, a double click shows the whole frame.
    pub fn show(&mut self, ui: &mut Ui, record: &FrameRecord) {
        let tracks = tracks(record);
        let rows: usize = tracks.iter().map(|track| track.rows).sum();
        let gaps = 2.0 * tracks.len() as f32;
        let size = vec2(ui.available_width(), AXIS_HEIGHT + rows as f32 * ROW_HEIGHT + gaps);
        let (response, painter) = ui.allocate_painter(size, Sense::click_and_drag());
        let area = response.rect.with_min_x(response.rect.left() + NAME_WIDTH);
        if record.duration().is_zero() || area.width() <= 0.0 {
            return;
        }
        self.navigate(ui, &response, area);
        let axis = TimeAxis { began: record.began(), duration: record.duration(), part: self.part, area };
        axis.draw(ui, &painter);
        let mut top = area.top() + AXIS_HEIGHT;
        let mut pointed = None;
        for track in &tracks {
            let lane = Rect::from_x_y_ranges(area.x_range(), top..=top + track.rows as f32 * ROW_HEIGHT);
            top = lane.bottom() + 2.0;
            draw_name(ui, &painter, track, lane);
            painter.rect_filled(lane, 0.0, ui.visuals().extreme_bg_color);
            let clipped = painter.with_clip_rect(lane.intersect(painter.clip_rect()));
            for interval in &track.intervals {
                let rect = axis.rect(interval, lane.top());
                draw_interval(&clipped, interval, rect);
                if response.hover_pos().is_some_and(|pointer| rect.contains(pointer) && lane.contains(pointer)) {
                    pointed = Some(interval);
                }
            }
        }
        if let Some(interval) = pointed {
            response.on_hover_text_at_pointer(interval.explanation());
        }
    }

    fn navigate(&mut self, ui: &Ui, response: &Response, area: Rect) {
        let [first, last] = self.part;
        let length = last - first;
        if response.double_clicked() {
            *self = Self::default();
        } else if response.dragged() {
            self.move_to(first - f64::from(response.drag_delta().x / area.width()) * length, length);
        } else if let Some(pointer) = response.hover_pos() {
            let wheel = ui.input(|input| input.smooth_scroll_delta.y);
            if wheel != 0.0 {
                let at = f64::from((pointer.x - area.left()) / area.width()).clamp(0.0, 1.0);
                let zoomed = (length * f64::from(-wheel / 200.0).exp()).clamp(SMALLEST_PART, 1.0);
                self.move_to(first + at * (length - zoomed), zoomed);
            }
        }
    }

    fn move_to(&mut self, first: f64, length: f64) {
        let first = first.clamp(0.0, 1.0 - length);
        self.part = [first, first + length];
    }
}

/// From points in time to positions in an area.
struct TimeAxis {
    began: Duration,
    duration: Duration,
    part: [f64; 2],
    area: Rect,
}

impl TimeAxis {
    /// The position of a time since the frame began, in seconds.
    fn x(&self, seconds: f64) -> f32 {
        let [first, last] = self.part;
        let fraction = (seconds / self.duration.as_secs_f64() - first) / (last - first);
        self.area.left() + (fraction * f64::from(self.area.width())) as f32
    }

    fn rect(&self, interval: &Interval<'_>, top: f32) -> Rect {
        // An idle worker may have slept since long before.
        let since = |time: Duration| time.as_secs_f64() - self.began.as_secs_f64();
        let (left, right) = (self.x(since(interval.began)), self.x(since(interval.ended)));
        let top = top + interval.row as f32 * ROW_HEIGHT;
        let [left, right] = [left, right].map(|x| x.clamp(self.area.left() - 1.0, self.area.right() + 1.0));
        Rect::from_min_max(pos2(left, top), pos2(right.max(left + 0.5), top + ROW_HEIGHT - 1.0))
    }

    fn draw(&self, ui: &Ui, painter: &Painter) {
        let [first, last] = self.part.map(|fraction| fraction * self.duration.as_secs_f64());
        let step = tick_step((last - first) / f64::from(self.area.width() / 90.0).max(1.0));
        let color = ui.visuals().weak_text_color();
        let mut tick = (first / step).ceil();
        while tick * step <= last {
            let x = self.x(tick * step);
            painter.vline(x, self.area.y_range(), (0.5, color.gamma_multiply(0.5)));
            let text = time_text(tick * step, step);
            painter.text(pos2(x + 3.0, self.area.top()), Align2::LEFT_TOP, text, FontId::proportional(10.0), color);
            tick += 1.0;
        }
    }
}

/// The step of 1, 2 or 5 times a power of ten that is at least this long, in seconds.
fn tick_step(shortest: f64) -> f64 {
    let power = 10_f64.powf(shortest.log10().floor());
    [1.0, 2.0, 5.0].map(|factor| factor * power).into_iter().find(|step| *step >= shortest).unwrap_or(10.0 * power)
}

fn time_text(seconds: f64, step: f64) -> String {
    match step {
        ..1e-6 => format!("{:.0} ns", seconds * 1e9),
        ..1e-3 => format!("{:.0} µs", seconds * 1e6),
        _ => format!("{:.0} ms", seconds * 1e3),
    }
}

fn draw_name(ui: &Ui, painter: &Painter, track: &Track<'_>, lane: Rect) {
    let position = pos2(lane.left() - NAME_WIDTH, lane.top() + ROW_HEIGHT / 2.0);
    let names = Rect::from_x_y_ranges(position.x..=lane.left() - 4.0, lane.y_range());
    let clipped = painter.with_clip_rect(names.intersect(painter.clip_rect()));
    clipped.text(position, Align2::LEFT_CENTER, track.name, FontId::proportional(12.0), ui.visuals().text_color());
}

fn draw_interval(painter: &Painter, interval: &Interval<'_>, rect: Rect) {
    painter.rect_filled(rect, 0.0, interval.color());
    if !interval.text().is_empty() && rect.width() > 24.0 {
        let clipped = painter.with_clip_rect(rect.intersect(painter.clip_rect()));
        let position = pos2(rect.left() + 3.0, rect.center().y);
        clipped.text(position, Align2::LEFT_CENTER, interval.text(), FontId::proportional(11.0), ON_GROUP);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_far_enough_apart() {
        for (shortest, step) in [(0.9e-6, 1e-6), (1.1e-6, 2e-6), (2.5e-5, 5e-5), (6e-4, 1e-3), (1.0, 1.0)] {
            assert!((tick_step(shortest) / step - 1.0).abs() < 1e-9, "{shortest}: {}", tick_step(shortest));
        }
    }

    #[test]
    fn the_part_stays_inside_of_the_frame() {
        let mut lanes = Lanes::default();
        for (first, length, part) in
            [(-1.0, 0.5, [0.0, 0.5]), (0.9, 0.5, [0.5, 1.0]), (0.2, 0.1, [0.2, 0.3]), (3.0, 1.0, [0.0, 1.0])]
        {
            lanes.move_to(first, length);
            lanes.part.into_iter().zip(part).for_each(|(found, expected)| assert!((found - expected).abs() < 1e-12));
        }
    }
}
