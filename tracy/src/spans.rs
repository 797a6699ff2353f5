//! Spans as zones: those of processes by the processes' names, and all others by their own.

use std::{
    cell::RefCell,
    fmt::{self, Debug},
};

use tracing::{
    Metadata, Subscriber,
    field::{Field, Visit},
    span::{Attributes, Id},
};
use tracing_subscriber::{
    field::RecordFields,
    fmt::{FormatFields, format::Writer},
    layer::{Context, Layer},
    registry::LookupSpan,
};
use tracing_tracy::{
    Config,
    client::{Client, Span},
};

use crate::RUNS;

/// Whether it is the span of a process in a run.
pub fn is_process(metadata: &Metadata<'_>) -> bool {
    metadata.is_span() && metadata.target() == RUNS && metadata.name() == "node"
}

/// Whether it is the span of a chunk.
pub fn is_chunk(metadata: &Metadata<'_>) -> bool {
    metadata.is_span() && metadata.target() == RUNS && metadata.name() == "chunk"
}

/// Says that a zone has its span's name, and no call stack.
#[derive(Default)]
pub struct ByName(NoFields);

/// Writes nothing: what a field says may be different in every span.
#[derive(Default)]
pub struct NoFields;

impl Config for ByName {
    type Formatter = NoFields;

    fn formatter(&self) -> &NoFields {
        &self.0
    }

    fn stack_depth(&self, _metadata: &Metadata<'_>) -> u16 {
        0
    }

    fn format_fields_in_zone_name(&self) -> bool {
        false
    }
}

impl FormatFields<'_> for NoFields {
    fn format_fields<R: RecordFields>(&self, _writer: Writer<'_>, _fields: R) -> fmt::Result {
        Ok(())
    }
}

/// Makes the zones of processes. [`TracyLayer`](tracing_tracy::TracyLayer) cannot name them by a field alone.
pub struct Processes {
    client: Client,
}

/// The name of a process, kept with its span if a viewer is there to see it.
struct Name(String);

thread_local! {
    /// The zones that the thread is in, and their spans.
    static ZONES: RefCell<Vec<(Id, Span)>> = const { RefCell::new(Vec::new()) };
}

impl Processes {
    pub fn new(client: Client) -> Self {
        Self { client }
    }
}

impl<S> Layer<S> for Processes
where
    S: Subscriber + for<'span> LookupSpan<'span>,
{
    fn on_new_span(&self, attributes: &Attributes<'_>, id: &Id, context: Context<'_, S>) {
        if Client::is_connected()
            && let Some(span) = context.span(id)
        {
            span.extensions_mut().insert(Name(name_of(attributes)));
        }
    }

    fn on_enter(&self, id: &Id, context: Context<'_, S>) {
        // Without a viewer a zone would be made, and thrown away.
        if !Client::is_connected() {
            return;
        }
        let Some(span) = context.span(id) else { return };
        let (extensions, metadata) = (span.extensions(), span.metadata());
        let Some(Name(name)) = extensions.get::<Name>() else { return };
        let (file, line) = (metadata.file().unwrap_or("drawloom"), metadata.line().unwrap_or(0));
        let zone = self.client.clone().span_alloc(Some(name), "", file, line, 0);
        ZONES.with_borrow_mut(|zones| zones.push((id.clone(), zone)));
    }

    fn on_exit(&self, id: &Id, _context: Context<'_, S>) {
        ZONES.with_borrow_mut(|zones| {
            // Those inside it have to end with it.
            if let Some(place) = zones.iter().rposition(|(open, _)| open == id) {
                zones.drain(place..).rev().for_each(drop);
            }
        });
    }
}

/// What the zone of a process is called: its name, cut where Tracy could not take it.
pub fn name_of(attributes: &Attributes<'_>) -> String {
    let mut name = NameField(String::new());
    attributes.record(&mut name);
    let NameField(mut name) = name;
    name.truncate(name.floor_char_boundary(MOST_BYTES));
    name
}

/// Tracy keeps 64 KiB for a zone's name and the path of its source file, and shows some dozen letters.
const MOST_BYTES: usize = 1024;

/// Looks at nothing but the field `name`.
struct NameField(String);

impl Visit for NameField {
    fn record_str(&mut self, field: &Field, value: &str) {
        if field.name() == "name" {
            value.clone_into(&mut self.0);
        }
    }

    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        if field.name() == "name" {
            self.0 = format!("{value:?}");
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{
        collections::BTreeSet,
        sync::{Arc, Mutex},
    };

    use tracing::{
        Subscriber, debug_span, info_span,
        span::{Attributes, Id},
        trace_span,
    };
    use tracing_subscriber::{
        Registry,
        field::RecordFields,
        fmt::{FormatFields, format::Writer},
        layer::{Context, Layer, SubscriberExt},
    };
    use tracing_tracy::Config;

    use super::{ByName, MOST_BYTES, is_chunk, is_process, name_of};

    /// Collects what zones are called: a process by its name, all else by the span's and what the formatter adds.
    #[derive(Clone, Default)]
    struct Collected(Arc<Mutex<BTreeSet<String>>>);

    impl<S: Subscriber> Layer<S> for Collected {
        fn on_new_span(&self, attributes: &Attributes<'_>, _id: &Id, _context: Context<'_, S>) {
            let metadata = attributes.metadata();
            let name = if is_process(metadata) {
                name_of(attributes)
            } else {
                metadata.name().to_owned() + &added(attributes)
            };
            self.0.lock().unwrap().insert(name);
        }
    }

    fn added(fields: impl RecordFields) -> String {
        let mut text = String::new();
        ByName::default().formatter().format_fields(Writer::new(&mut text), fields).unwrap();
        text
    }

    fn collected(call: impl FnOnce()) -> Vec<String> {
        let collected = Collected::default();
        tracing::subscriber::with_default(Registry::default().with(collected.clone()), call);
        let names = collected.0.lock().unwrap();
        names.iter().cloned().collect()
    }

    #[test]
    fn zones_have_names_alone_however_many_there_are() {
        let names = collected(|| {
            for item in 0..100_000 {
                let name = ["fill", "sort", "record"][item % 3];
                let text = format!("part {item}");
                debug_span!(target: "drawloom::graph", "node", item, name, process = text, stage = text, view = text);
                trace_span!(target: "drawloom::graph", "chunk", start = item, end = item + 1);
                info_span!("engine", item, name = text);
            }
        });
        assert_eq!(names, ["chunk", "engine", "fill", "record", "sort"]);
    }

    #[test]
    fn a_name_of_any_sort_is_taken_as_it_is_and_cut_between_letters() {
        let long = "a".to_owned() + &"ä".repeat(5_000);
        let names = collected(|| {
            for name in ["", "\"{name}\" <b>\0\u{7}", &long] {
                debug_span!(target: "drawloom::graph", "node", name);
            }
            debug_span!(target: "drawloom::graph", "node", name = ?Some(1));
        });
        let cut = "a".to_owned() + &"ä".repeat(MOST_BYTES / 2 - 1);
        assert_eq!(names, ["", "\"{name}\" <b>\0\u{7}", "Some(1)", &cut]);
    }

    #[test]
    fn only_drawlooms_own_spans_are_processes_and_chunks() {
        let told = |span: &tracing::Span| {
            let metadata = span.metadata().unwrap();
            (is_process(metadata), is_chunk(metadata))
        };
        tracing::subscriber::with_default(Registry::default(), || {
            assert_eq!(told(&debug_span!(target: "drawloom::graph", "node")), (true, false));
            assert_eq!(told(&trace_span!(target: "drawloom::graph", "chunk")), (false, true));
            assert_eq!(told(&debug_span!("node")), (false, false));
            assert_eq!(told(&debug_span!(target: "drawloom", "record")), (false, false));
        });
    }
}
