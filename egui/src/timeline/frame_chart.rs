//! The durations of the latest frames, as bars.

use egui::{Align2, Color32, FontId, Rect, Sense, Ui, pos2, vec2};

use crate::colors::ACCENT;
use crate::frame_history::FrameHistory;

const HEIGHT: f32 = 48.0;

/// Shows the bars, the latest at the right. A click selects a frame.
pub fn show(ui: &mut Ui, history: &mut FrameHistory) {
    let (response, painter) = ui.allocate_painter(vec2(ui.available_width(), HEIGHT), Sense::click());
    let area = response.rect;
    painter.rect_filled(area, 2.0, ui.visuals().extreme_bg_color);
    let longest = history.ended().map(|frame| frame.duration()).max().unwrap_or_default().as_secs_f32();
    if longest == 0.0 {
        return;
    }
    let width = area.width() / FrameHistory::LENGTH as f32;
    let column = |index: usize| {
        let right = area.right() - index as f32 * width;
        Rect::from_min_max(pos2(right - width, area.top()), pos2(right, area.bottom()))
    };
    let shown = history.shown().map(|shown| shown.number);
    let pointer = response.hover_pos();
    let mut pointed = None;
    for (index, frame) in history.ended().enumerate() {
        let column = column(index);
        let is_pointed = pointer.is_some_and(|pointer| (column.left()..column.right()).contains(&pointer.x));
        if is_pointed {
            pointed = Some((frame.number, frame.duration()));
        }
        let height = (frame.duration().as_secs_f32() / longest * area.height()).max(1.0);
        let bar =
            Rect::from_min_max(pos2(column.left(), area.bottom() - height), pos2(column.right() - 0.5, area.bottom()));
        let color = match (Some(frame.number) == shown, is_pointed) {
            (true, _) => ACCENT,
            (_, true) => Color32::WHITE,
            _ => Color32::from_gray(130),
        };
        painter.rect_filled(bar, 0.0, color);
    }
    let text = format!("{:.2} ms", longest * 1e3);
    painter.text(
        area.left_top() + vec2(4.0, 2.0),
        Align2::LEFT_TOP,
        text,
        FontId::proportional(11.0),
        ui.visuals().weak_text_color(),
    );
    if response.clicked()
        && let Some((number, _)) = pointed
    {
        history.select(Some(number));
    }
    if let Some((number, duration)) = pointed {
        response.on_hover_text_at_pointer(format!("frame {number}: {:.2} ms", duration.as_secs_f64() * 1e3));
    }
}
