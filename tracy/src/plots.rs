//! Plots of the counters in Drawloom's events.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::sync::{Mutex, PoisonError};
use std::thread;

use tracing::field::{Field, Visit};
use tracing::{Event, Metadata, Subscriber};
use tracing_subscriber::layer::{Context, Layer};
use tracing_tracy::client::{Client, PlotName, plot_name};

use crate::RUNS;

/// Whether the metadata is that of Drawloom's event with counters.
pub fn is_counters(metadata: &Metadata<'_>) -> bool {
    metadata.is_event() && metadata.target() == RUNS && metadata.name() == "taken"
}

/// Plots the number of ready nodes and, for each worker, the number of jobs in its queues.
pub struct Plots {
    client: Client,
}

impl Plots {
    pub fn new(client: Client) -> Self {
        Self { client }
    }
}

impl<S: Subscriber> Layer<S> for Plots {
    fn on_event(&self, event: &Event<'_>, _context: Context<'_, S>) {
        if !Client::is_connected() {
            return;
        }
        let Counters { ready, queued } = counters_of(event);
        if let Some(ready) = ready {
            self.client.plot(plot_name!("ready nodes"), ready as f64);
        }
        if let Some(queued) = queued {
            self.client.plot(plot_of_this_thread(), queued as f64);
        }
    }
}

/// The counters of an event.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Counters {
    pub ready: Option<u64>,
    pub queued: Option<u64>,
}

pub fn counters_of(event: &Event<'_>) -> Counters {
    let mut counters = Counters::default();
    event.record(&mut counters);
    counters
}

impl Visit for Counters {
    fn record_u64(&mut self, field: &Field, value: u64) {
        match field.name() {
            "ready" => self.ready = Some(value),
            "queued" => self.queued = Some(value),
            _ => {}
        }
    }

    fn record_debug(&mut self, _field: &Field, _value: &dyn Debug) {}
}

thread_local! {
    static NAME: Cell<Option<PlotName>> = const { Cell::new(None) };
}

/// The plot of this thread's queues.
fn plot_of_this_thread() -> PlotName {
    NAME.get().unwrap_or_else(|| {
        let name = plot_of(thread::current().name().unwrap_or("a thread"));
        NAME.set(Some(name));
        name
    })
}

/// The plot of a thread's queues. Threads with the same name share one, because Tracy never frees a name.
fn plot_of(thread: &str) -> PlotName {
    static NAMES: Mutex<BTreeMap<String, PlotName>> = Mutex::new(BTreeMap::new());
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    *names
        .entry(thread.to_owned())
        .or_insert_with(|| PlotName::new_leak(format!("queued jobs of {}", thread.replace('\0', " "))))
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use drawloom::graph::{Closure, FrameGraph};
    use drawloom::task::Scheduler;
    use tracing::{Event, Subscriber};
    use tracing_subscriber::Registry;
    use tracing_subscriber::filter::FilterFn;
    use tracing_subscriber::layer::{Context, Layer, SubscriberExt};

    use super::{Counters, counters_of, is_counters, plot_of};

    #[derive(Clone, Default)]
    struct Collected(Arc<Mutex<Vec<Counters>>>);

    impl<S: Subscriber> Layer<S> for Collected {
        fn on_event(&self, event: &Event<'_>, _context: Context<'_, S>) {
            self.0.lock().unwrap().push(counters_of(event));
        }
    }

    #[test]
    fn every_node_of_a_parallel_run_has_an_event_with_both_counters() {
        let collected = Collected::default();
        let layer = collected.clone().with_filter(FilterFn::new(is_counters));
        tracing::subscriber::set_global_default(Registry::default().with(layer)).unwrap();
        let mut graph = FrameGraph::new();
        for index in 0..10 {
            let node = graph.add(format!("node {index}"), Closure::new(|(): &(), _, _| Ok(())));
            graph.keep(node);
        }
        let mut schedule = graph.compile().unwrap();
        schedule.always_parallel(true);
        schedule.run(&Scheduler::new(2).unwrap(), &()).unwrap();
        tracing::trace!(target: "drawloom::graph", ready = 77_u64, "another event");
        tracing::trace!(name: "taken", ready = 77_u64);
        let counters = collected.0.lock().unwrap();
        assert_eq!(counters.len(), 10);
        for Counters { ready, queued } in counters.iter() {
            assert!(ready.is_some_and(|ready| ready < 10) && queued.is_some_and(|queued| queued < 10));
        }
    }

    #[test]
    fn threads_with_the_same_name_share_a_plot() {
        assert_eq!(plot_of("worker"), plot_of("worker"));
        assert_ne!(plot_of("worker"), plot_of("another"));
        assert_ne!(plot_of("nul\0"), plot_of("nul"));
    }
}
