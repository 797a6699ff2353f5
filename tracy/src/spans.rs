//! Shows spans as zones. The zone of a node has the node's name, that of any other span the span's name.

use std::cell::RefCell;
use std::fmt::{self, Debug};

use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id};
use tracing::{Metadata, Subscriber};
use tracing_subscriber::field::RecordFields;
use tracing_subscriber::fmt::FormatFields;
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::layer::{Context, Layer};
use tracing_subscriber::registry::LookupSpan;
use tracing_tracy::Config;
use tracing_tracy::client::{Client, Span};

use crate::RUNS;

/// Whether the metadata is that of a node's span.
pub fn is_node(metadata: &Metadata<'_>) -> bool {
    metadata.is_span() && metadata.target() == RUNS && metadata.name() == "node"
}

/// Whether the metadata is that of a chunk's span.
pub fn is_chunk(metadata: &Metadata<'_>) -> bool {
    metadata.is_span() && metadata.target() == RUNS && metadata.name() == "chunk"
}

/// Configures zones to have only their span's name: no fields, and no call stack.
#[derive(Default)]
pub struct NameOnly(NoFields);

/// Formats no fields, because their values may differ from span to span.
#[derive(Default)]
pub struct NoFields;

impl Config for NameOnly {
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

/// Makes the zones of nodes. [`TracyLayer`](tracing_tracy::TracyLayer) cannot name a zone by a single field.
pub struct NodeZones {
    client: Client,
}

/// The name of a node, stored with its span while a viewer is connected.
struct Name(String);

thread_local! {
    /// The thread's open zones and the ids of their spans, innermost last.
    static ZONES: RefCell<Vec<(Id, Span)>> = const { RefCell::new(Vec::new()) };
}

impl NodeZones {
    pub fn new(client: Client) -> Self {
        Self { client }
    }
}

impl<S> Layer<S> for NodeZones
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
        // Without a viewer, the zone would be discarded.
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
            // The zones inside it end with it.
            if let Some(index) = zones.iter().rposition(|(open, _)| open == id) {
                zones.drain(index..).rev().for_each(drop);
            }
        });
    }
}

/// The name of a node's zone: the node's name, truncated to a length that Tracy accepts.
pub fn name_of(attributes: &Attributes<'_>) -> String {
    let mut name = NameField(String::new());
    attributes.record(&mut name);
    let NameField(mut name) = name;
    name.truncate(name.floor_char_boundary(MAX_NAME_BYTES));
    name
}

/// Tracy allows 64 KiB for a zone's name and the path of its source file together, and shows a few dozen characters.
const MAX_NAME_BYTES: usize = 1024;

/// Reads the field `name`.
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
    use std::collections::BTreeSet;
    use std::sync::{Arc, Mutex};

    use tracing::span::{Attributes, Id};
    use tracing::{Subscriber, debug_span, info_span, trace_span};
    use tracing_subscriber::Registry;
    use tracing_subscriber::field::RecordFields;
    use tracing_subscriber::fmt::FormatFields;
    use tracing_subscriber::fmt::format::Writer;
    use tracing_subscriber::layer::{Context, Layer, SubscriberExt};
    use tracing_tracy::Config;

    use super::{MAX_NAME_BYTES, NameOnly, is_chunk, is_node, name_of};

    /// Collects the names of zones: a node's name, or a span's name and the formatter's addition.
    #[derive(Clone, Default)]
    struct Collected(Arc<Mutex<BTreeSet<String>>>);

    impl<S: Subscriber> Layer<S> for Collected {
        fn on_new_span(&self, attributes: &Attributes<'_>, _id: &Id, _context: Context<'_, S>) {
            let metadata = attributes.metadata();
            let name = if is_node(metadata) {
                name_of(attributes)
            } else {
                metadata.name().to_owned() + &formatted_fields(attributes)
            };
            self.0.lock().unwrap().insert(name);
        }
    }

    fn formatted_fields(fields: impl RecordFields) -> String {
        let mut text = String::new();
        NameOnly::default().formatter().format_fields(Writer::new(&mut text), fields).unwrap();
        text
    }

    fn collected(call: impl FnOnce()) -> Vec<String> {
        let collected = Collected::default();
        tracing::subscriber::with_default(Registry::default().with(collected.clone()), call);
        let names = collected.0.lock().unwrap();
        names.iter().cloned().collect()
    }

    #[test]
    fn zone_names_contain_no_fields() {
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
    fn any_name_is_used_unchanged_and_truncated_at_a_character() {
        let long = "a".to_owned() + &"ä".repeat(5_000);
        let names = collected(|| {
            for name in ["", "\"{name}\" <b>\0\u{7}", &long] {
                debug_span!(target: "drawloom::graph", "node", name);
            }
            debug_span!(target: "drawloom::graph", "node", name = ?Some(1));
        });
        let cut = "a".to_owned() + &"ä".repeat(MAX_NAME_BYTES / 2 - 1);
        assert_eq!(names, ["", "\"{name}\" <b>\0\u{7}", "Some(1)", &cut]);
    }

    #[test]
    fn only_drawlooms_own_spans_are_nodes_and_chunks() {
        let kind = |span: &tracing::Span| {
            let metadata = span.metadata().unwrap();
            (is_node(metadata), is_chunk(metadata))
        };
        tracing::subscriber::with_default(Registry::default(), || {
            assert_eq!(kind(&debug_span!(target: "drawloom::graph", "node")), (true, false));
            assert_eq!(kind(&trace_span!(target: "drawloom::graph", "chunk")), (false, true));
            assert_eq!(kind(&debug_span!("node")), (false, false));
            assert_eq!(kind(&debug_span!(target: "drawloom", "record")), (false, false));
        });
    }
}
