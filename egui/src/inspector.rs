//! The window that shows frames.

use drawloom::backend::Backend;
use drawloom::{RecordedFrame, Renderer};
use egui::{Context, ScrollArea, Ui, Vec2, Window};

use crate::choices;
use crate::frame_history::FrameHistory;
use crate::graph::GraphView;
use crate::quality::QualityPanel;
use crate::timeline::TimelinePanel;
use crate::views;
use crate::warnings::WarningList;

/// A window that shows the frames of a [`Renderer`] as they are drawn, and changes its quality.
///
/// Prices of settings are measured where the renderer has a quality of its own, from
/// [`RendererBuilder::quality`](drawloom::RendererBuilder::quality) or chosen in the inspector.
///
/// While it is open, it records the scheduler's [timeline](drawloom::timeline), and takes out the
/// [logs](drawloom::timeline::Timeline::take): an engine that takes them itself lacks what the inspector took. An
/// inspector belongs to one renderer. [Close](Self::close) it before it is dropped: a measurement that is not ended
/// leaves its quality behind.
pub struct Inspector {
    is_open: bool,
    /// Whether the inspector switched the timeline on, and so switches it off.
    started_timeline: bool,
    tab: Tab,
    history: FrameHistory,
    timeline: TimelinePanel,
    graph: GraphView,
    quality: QualityPanel,
    warnings: WarningList,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Tab {
    Timeline,
    Graph,
    Choices,
    Quality,
    Views,
    Warnings,
}

impl Tab {
    const ALL: [(Self, &str); 6] = [
        (Self::Timeline, "Timeline"),
        (Self::Graph, "Frame graph"),
        (Self::Choices, "Choices"),
        (Self::Quality, "Quality"),
        (Self::Views, "Views"),
        (Self::Warnings, "Warnings"),
    ];
}

/// The size of the window when it is first shown: small enough to leave some of the picture visible.
fn default_size(context: &Context) -> Vec2 {
    let area = context.content_rect().size();
    Vec2::new((area.x - 60.0).clamp(320.0, 760.0), (area.y * 0.5).clamp(240.0, 400.0))
}

/// An inspector that is open.
impl Default for Inspector {
    fn default() -> Self {
        Self::new(true)
    }
}

impl Inspector {
    /// An inspector that is open, or not yet.
    pub fn new(is_open: bool) -> Self {
        Self {
            is_open,
            started_timeline: false,
            tab: Tab::Timeline,
            history: FrameHistory::default(),
            timeline: TimelinePanel::default(),
            graph: GraphView::default(),
            quality: QualityPanel::default(),
            warnings: WarningList::default(),
        }
    }

    /// Whether it is shown.
    pub fn is_open(&self) -> bool {
        self.is_open
    }

    /// Shows it from the next frame on.
    pub fn open(&mut self) {
        self.is_open = true;
    }

    /// Hides it, as its close button does. A measurement ends, and so does the recording of the timeline, if the
    /// inspector began it.
    pub fn close<B: Backend>(&mut self, renderer: &mut Renderer<B>) {
        self.is_open = false;
        self.quality.cancel_measurement(renderer);
        if self.started_timeline {
            renderer.scheduler().timeline().stop();
            self.started_timeline = false;
        }
    }

    /// Adds a frame that was just recorded. Call it once for each, whether the inspector is open or not.
    pub fn add_frame<B: Backend>(&mut self, renderer: &Renderer<B>, recorded: &RecordedFrame<B>) {
        if !self.is_open {
            return;
        }
        let timeline = renderer.scheduler().timeline();
        if !timeline.is_on() {
            timeline.start();
            self.started_timeline = true;
        }
        self.history.add_log(timeline.take());
        if let Some(number) = recorded.frame_number() {
            self.history.add_statistics(number, recorded.statistics());
        }
        self.warnings.add_frame(recorded.statistics());
        self.quality.add_frame(recorded.statistics());
    }

    /// Shows the window, if it is open. Call it once a frame. A quality that is chosen in it holds from the next frame
    /// on.
    pub fn show<B: Backend>(&mut self, context: &Context, renderer: &mut Renderer<B>) {
        if !self.is_open {
            return;
        }
        // A window that is collapsed does not show what is in it, and a measurement goes on.
        self.update(context, renderer);
        let mut is_open = self.is_open;
        let window = Window::new("Drawloom").open(&mut is_open).default_size(default_size(context));
        window.show(context, |ui| self.show_in(ui, renderer));
        if self.is_open && !is_open {
            self.close(renderer);
        }
    }

    /// Shows what the window contains in an area of the engine's own.
    pub fn show_in<B: Backend>(&mut self, ui: &mut Ui, renderer: &mut Renderer<B>) {
        self.update(ui.ctx(), renderer);
        ui.horizontal(|ui| {
            for (tab, name) in Tab::ALL {
                let count = if tab == Tab::Warnings { self.warnings.len() } else { 0 };
                let text = if count == 0 { name.to_owned() } else { format!("{name} ({count})") };
                ui.selectable_value(&mut self.tab, tab, text);
            }
        });
        ui.separator();
        let scroll = ScrollArea::both().auto_shrink(false);
        match self.tab {
            Tab::Timeline => self.timeline.show(ui, &mut self.history),
            Tab::Graph => self.graph.show(ui, self.history.shown()),
            Tab::Choices => _ = scroll.show(ui, |ui| choices::show(ui, self.history.shown())),
            Tab::Quality => _ = scroll.show(ui, |ui| self.quality.show(ui, renderer)),
            Tab::Views => _ = scroll.show(ui, |ui| views::show(ui, &self.history)),
            Tab::Warnings => _ = scroll.show(ui, |ui| self.warnings.show(ui)),
        }
    }

    /// Sets the quality that a running measurement needs for the next frame.
    fn update<B: Backend>(&mut self, context: &Context, renderer: &mut Renderer<B>) {
        self.quality.update(renderer);
        if self.quality.is_measuring() {
            context.request_repaint();
        }
    }
}
