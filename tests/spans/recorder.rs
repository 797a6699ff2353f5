//! A layer that writes down all it is told, in the one order in which it is told.

use std::collections::BTreeMap;
use std::fmt::Debug;
use std::mem;
use std::sync::{Arc, Mutex};
use std::thread::{self, ThreadId};

use drawloom::task::{Scheduler, SchedulerBuilder};
use tracing::field::{Field, Visit};
use tracing::level_filters::LevelFilter;
use tracing::span::{Attributes, Id};
use tracing::{Dispatch, Event, Level, Metadata, Subscriber};
use tracing_subscriber::layer::{Context, Layer, SubscriberExt};
use tracing_subscriber::registry::LookupSpan;

/// What a recorder was told.
#[derive(Debug, Default)]
pub struct Record {
    pub spans: Vec<Span>,
    pub events: Vec<(Origin, Fields)>,
    pub moves: Vec<Move>,
}

pub type Fields = BTreeMap<&'static str, String>;

/// Where a span or an event comes from.
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
    /// Its index among all.
    pub parent: Option<usize>,
}

/// What happened to a span: its index among all, and on which thread.
#[derive(Clone, Copy, Debug)]
pub struct Move {
    pub kind: MoveKind,
    pub span: usize,
    pub thread: ThreadId,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MoveKind {
    New,
    Enter,
    Exit,
    Close,
}

impl Record {
    /// The indices of all spans of that name, in the order in which they were made.
    pub fn named<'a>(&'a self, name: &'a str) -> impl Iterator<Item = usize> + 'a {
        (0..self.spans.len()).filter(move |&span| self.spans[span].origin.name == name)
    }

    /// What happened to a span, and as the how-manieth of all that happened.
    pub fn moves_of(&self, span: usize) -> impl DoubleEndedIterator<Item = (usize, Move)> + '_ {
        self.moves.iter().copied().enumerate().filter(move |(_, of)| of.span == span)
    }

    /// Every thread leaves what it entered last, and nothing is entered or open at the end, or was twice at once.
    pub fn check_nesting(&self) {
        let mut inside: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        let mut open = vec![false; self.spans.len()];
        for Move { kind, span, thread } in &self.moves {
            let inside = inside.entry(format!("{thread:?}")).or_default();
            let parent = self.spans[*span].parent;
            match kind {
                MoveKind::New => open[*span] = true,
                MoveKind::Enter => {
                    assert!(open[*span] && !inside.contains(span), "{:?}", self.spans[*span]);
                    assert!(parent.is_none_or(|parent| open[parent]), "{:?}", self.spans[*span]);
                    inside.push(*span);
                }
                MoveKind::Exit => assert_eq!(inside.pop(), Some(*span), "{:?}", self.spans[*span]),
                MoveKind::Close => assert!(mem::replace(&mut open[*span], false)),
            }
        }
        assert!(inside.values().all(Vec::is_empty), "{inside:?} are left");
        assert!(!open.contains(&true), "{open:?}");
    }
}

/// Writes into a record.
#[derive(Clone, Debug, Default)]
pub struct Recorder(Arc<Mutex<Record>>);

impl Recorder {
    /// What was told since the last call.
    pub fn take(&self) -> Record {
        mem::take(&mut self.0.lock().unwrap())
    }

    fn note<S>(&self, kind: MoveKind, span: &Id, context: &Context<'_, S>)
    where
        S: Subscriber + for<'a> LookupSpan<'a>,
    {
        let Some(Number(span)) = context.span(span).and_then(|span| span.extensions().get::<Number>().copied()) else {
            return;
        };
        self.0.lock().unwrap().moves.push(Move { kind, span, thread: thread::current().id() });
    }
}

/// A span's index.
#[derive(Clone, Copy)]
struct Number(usize);

impl<S> Layer<S> for Recorder
where
    S: Subscriber + for<'a> LookupSpan<'a>,
{
    fn on_new_span(&self, attributes: &Attributes<'_>, id: &Id, context: Context<'_, S>) {
        let span = context.span(id).unwrap();
        let parent = span.parent().and_then(|parent| parent.extensions().get::<Number>().map(|number| number.0));
        let mut fields = Text::default();
        attributes.record(&mut fields);
        let mut record = self.0.lock().unwrap();
        span.extensions_mut().insert(Number(record.spans.len()));
        record.spans.push(Span { origin: origin(attributes.metadata()), fields: fields.0, parent });
        drop(record);
        self.note(MoveKind::New, id, &context);
    }

    fn on_event(&self, event: &Event<'_>, _context: Context<'_, S>) {
        let mut fields = Text::default();
        event.record(&mut fields);
        self.0.lock().unwrap().events.push((origin(event.metadata()), fields.0));
    }

    fn on_enter(&self, id: &Id, context: Context<'_, S>) {
        self.note(MoveKind::Enter, id, &context);
    }

    fn on_exit(&self, id: &Id, context: Context<'_, S>) {
        self.note(MoveKind::Exit, id, &context);
    }

    fn on_close(&self, id: Id, context: Context<'_, S>) {
        self.note(MoveKind::Close, &id, &context);
    }
}

fn origin(metadata: &'static Metadata<'static>) -> Origin {
    Origin { target: metadata.target(), name: metadata.name(), level: *metadata.level() }
}

#[derive(Default)]
struct Text(Fields);

impl Visit for Text {
    fn record_str(&mut self, field: &Field, value: &str) {
        self.0.insert(field.name(), value.to_owned());
    }

    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        self.0.insert(field.name(), format!("{value:?}"));
    }
}

/// A subscriber that is told of what is at that level or above.
pub fn subscriber<L>(layer: L, level: LevelFilter) -> Dispatch
where
    L: Layer<tracing_subscriber::layer::Layered<LevelFilter, tracing_subscriber::Registry>> + Send + Sync,
{
    Dispatch::new(tracing_subscriber::registry().with(level).with(layer))
}

/// A scheduler whose workers tell that subscriber. The thread that calls it has to see to itself.
pub fn scheduler(builder: SchedulerBuilder, dispatch: &Dispatch) -> Scheduler {
    let dispatch = dispatch.clone();
    // For as long as the thread lives.
    builder.on_start(move |_worker| mem::forget(tracing::dispatcher::set_default(&dispatch))).build().unwrap()
}
