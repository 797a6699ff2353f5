//! A layer that records all spans and events in order.

use std::collections::BTreeMap;
use std::fmt::Debug;
use std::mem;
use std::sync::{Arc, Mutex};
use std::thread::{self, ThreadId};

use drawloom_jobs::task::{Scheduler, SchedulerBuilder};
use tracing::field::{Field, Visit};
use tracing::level_filters::LevelFilter;
use tracing::span::{Attributes, Id};
use tracing::{Dispatch, Event, Level, Metadata, Subscriber};
use tracing_subscriber::layer::{Context, Layer, SubscriberExt};
use tracing_subscriber::registry::LookupSpan;

/// The spans, events and changes that a recorder has recorded.
#[derive(Debug, Default)]
pub struct Record {
    pub spans: Vec<Span>,
    pub events: Vec<(Origin, Fields)>,
    pub changes: Vec<Change>,
}

pub type Fields = BTreeMap<&'static str, String>;

/// The metadata of a span or an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Origin {
    pub target: &'static str,
    pub name: &'static str,
    pub level: Level,
}

#[derive(Debug)]
pub struct Span {
    pub origin: Origin,
    pub fields: Fields,
    /// The parent's index in the record.
    pub parent: Option<usize>,
}

/// A change of a span's state, with the span's index in the record.
#[derive(Clone, Copy, Debug)]
pub struct Change {
    pub kind: ChangeKind,
    pub span: usize,
    pub thread: ThreadId,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChangeKind {
    New,
    Enter,
    Exit,
    Close,
}

impl Record {
    /// The indices of all spans with this name, in the order they were created.
    pub fn named<'a>(&'a self, name: &'a str) -> impl Iterator<Item = usize> + 'a {
        (0..self.spans.len()).filter(move |&span| self.spans[span].origin.name == name)
    }

    /// The changes of a span, with their indices among all changes.
    pub fn changes_of(&self, span: usize) -> impl DoubleEndedIterator<Item = (usize, Change)> + '_ {
        self.changes.iter().copied().enumerate().filter(move |(_, change)| change.span == span)
    }

    /// Checks that each thread exits the span it entered last, never enters a span twice, and that all spans are closed
    /// at the end.
    pub fn check_nesting(&self) {
        let mut inside: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        let mut open = vec![false; self.spans.len()];
        for Change { kind, span, thread } in &self.changes {
            let inside = inside.entry(format!("{thread:?}")).or_default();
            let parent = self.spans[*span].parent;
            match kind {
                ChangeKind::New => open[*span] = true,
                ChangeKind::Enter => {
                    assert!(open[*span] && !inside.contains(span), "{:?}", self.spans[*span]);
                    assert!(parent.is_none_or(|parent| open[parent]), "{:?}", self.spans[*span]);
                    inside.push(*span);
                }
                ChangeKind::Exit => assert_eq!(inside.pop(), Some(*span), "{:?}", self.spans[*span]),
                ChangeKind::Close => assert!(mem::replace(&mut open[*span], false)),
            }
        }
        assert!(inside.values().all(Vec::is_empty), "{inside:?} are still entered");
        assert!(!open.contains(&true), "{open:?}");
    }
}

/// The layer. It writes to a record.
#[derive(Clone, Debug, Default)]
pub struct Recorder(Arc<Mutex<Record>>);

impl Recorder {
    /// Takes what was recorded since the last call.
    pub fn take(&self) -> Record {
        mem::take(&mut self.0.lock().unwrap())
    }

    fn record_change<S>(&self, kind: ChangeKind, span: &Id, context: &Context<'_, S>)
    where
        S: Subscriber + for<'a> LookupSpan<'a>,
    {
        let Some(Number(span)) = context.span(span).and_then(|span| span.extensions().get::<Number>().copied()) else {
            return;
        };
        self.0.lock().unwrap().changes.push(Change { kind, span, thread: thread::current().id() });
    }
}

/// A span's index in the record.
#[derive(Clone, Copy)]
struct Number(usize);

impl<S> Layer<S> for Recorder
where
    S: Subscriber + for<'a> LookupSpan<'a>,
{
    fn on_new_span(&self, attributes: &Attributes<'_>, id: &Id, context: Context<'_, S>) {
        let span = context.span(id).unwrap();
        let parent = span.parent().and_then(|parent| parent.extensions().get::<Number>().map(|number| number.0));
        let mut fields = FieldTexts::default();
        attributes.record(&mut fields);
        let mut record = self.0.lock().unwrap();
        span.extensions_mut().insert(Number(record.spans.len()));
        record.spans.push(Span { origin: origin(attributes.metadata()), fields: fields.0, parent });
        drop(record);
        self.record_change(ChangeKind::New, id, &context);
    }

    fn on_event(&self, event: &Event<'_>, _context: Context<'_, S>) {
        let mut fields = FieldTexts::default();
        event.record(&mut fields);
        self.0.lock().unwrap().events.push((origin(event.metadata()), fields.0));
    }

    fn on_enter(&self, id: &Id, context: Context<'_, S>) {
        self.record_change(ChangeKind::Enter, id, &context);
    }

    fn on_exit(&self, id: &Id, context: Context<'_, S>) {
        self.record_change(ChangeKind::Exit, id, &context);
    }

    fn on_close(&self, id: Id, context: Context<'_, S>) {
        self.record_change(ChangeKind::Close, &id, &context);
    }
}

fn origin(metadata: &'static Metadata<'static>) -> Origin {
    Origin { target: metadata.target(), name: metadata.name(), level: *metadata.level() }
}

#[derive(Default)]
struct FieldTexts(Fields);

impl Visit for FieldTexts {
    fn record_str(&mut self, field: &Field, value: &str) {
        self.0.insert(field.name(), value.to_owned());
    }

    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        self.0.insert(field.name(), format!("{value:?}"));
    }
}

/// A subscriber with this layer and maximum level.
pub fn subscriber<L>(layer: L, level: LevelFilter) -> Dispatch
where
    L: Layer<tracing_subscriber::layer::Layered<LevelFilter, tracing_subscriber::Registry>> + Send + Sync,
{
    Dispatch::new(tracing_subscriber::registry().with(level).with(layer))
}

/// A scheduler with this subscriber on its workers. The calling thread must set it for itself.
pub fn scheduler(builder: SchedulerBuilder, dispatch: &Dispatch) -> Scheduler {
    let dispatch = dispatch.clone();
    // Never dropped, so that the subscriber stays set until the thread ends.
    builder.on_start(move |_worker| mem::forget(tracing::dispatcher::set_default(&dispatch))).build().unwrap()
}
