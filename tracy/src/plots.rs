//! Counts that come with events, as plots.

use std::{
    cell::Cell,
    collections::BTreeMap,
    fmt::Debug,
    sync::{Mutex, PoisonError},
    thread,
};

use tracing::{
    Event, Metadata, Subscriber,
    field::{Field, Visit},
};
use tracing_subscriber::layer::{Context, Layer};
use tracing_tracy::client::{Client, PlotName, plot_name};

use crate::RUNS;

/// Whether it is the event with which Drawloom tells its counts.
pub fn is_count(metadata: &Metadata<'_>) -> bool {
    metadata.is_event() && metadata.target() == RUNS && metadata.name() == "taken"
}

/// Plots how many processes are ready and, for each worker, how many jobs are in its queues.
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
        let Counts { ready, queued } = counts_of(event);
        if let Some(ready) = ready {
            self.client.plot(plot_name!("ready processes"), ready as f64);
        }
        if let Some(queued) = queued {
            self.client.plot(name_for_this_thread(), queued as f64);
        }
    }
}

/// What an event tells.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Counts {
    pub ready: Option<u64>,
    pub queued: Option<u64>,
}

pub fn counts_of(event: &Event<'_>) -> Counts {
    let mut counts = Counts::default();
    event.record(&mut counts);
    counts
}

impl Visit for Counts {
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

/// The name of the plot of this thread's queues.
fn name_for_this_thread() -> PlotName {
    NAME.get().unwrap_or_else(|| {
        let name = name_for(thread::current().name().unwrap_or("a thread"));
        NAME.set(Some(name));
        name
    })
}

/// A name can never be given back, so threads that come and go under one name share theirs.
fn name_for(thread: &str) -> PlotName {
    static NAMES: Mutex<BTreeMap<String, PlotName>> = Mutex::new(BTreeMap::new());
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    *names
        .entry(thread.to_owned())
        .or_insert_with(|| PlotName::new_leak(format!("queued jobs of {}", thread.replace('\0', " "))))
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use drawloom::{
        graph::{Closure, FrameGraph},
        task::Scheduler,
    };
    use tracing::{Event, Subscriber};
    use tracing_subscriber::{
        Registry,
        filter::FilterFn,
        layer::{Context, Layer, SubscriberExt},
    };

    use super::{Counts, counts_of, is_count, name_for};

    #[derive(Clone, Default)]
    struct Collected(Arc<Mutex<Vec<Counts>>>);

    impl<S: Subscriber> Layer<S> for Collected {
        fn on_event(&self, event: &Event<'_>, _context: Context<'_, S>) {
            self.0.lock().unwrap().push(counts_of(event));
        }
    }

    #[test]
    fn every_process_of_a_shared_run_comes_with_both_counts() {
        let collected = Collected::default();
        let layer = collected.clone().with_filter(FilterFn::new(is_count));
        tracing::subscriber::set_global_default(Registry::default().with(layer)).unwrap();
        let mut graph = FrameGraph::new();
        for process in 0..10 {
            let process = graph.add(format!("process {process}"), Closure::new(|(): &(), _, _| Ok(())));
            graph.keep(process);
        }
        let mut schedule = graph.compile().unwrap();
        schedule.always_parallel(true);
        schedule.run(&Scheduler::new(2).unwrap(), &()).unwrap();
        tracing::trace!(target: "drawloom::graph", ready = 77_u64, "another event");
        tracing::trace!(name: "taken", ready = 77_u64);
        let counts = collected.0.lock().unwrap();
        assert_eq!(counts.len(), 10);
        for count in counts.iter() {
            assert!(count.ready.is_some_and(|ready| ready < 10) && count.queued.is_some_and(|queued| queued < 10));
        }
    }

    #[test]
    fn threads_of_one_name_have_one_plot() {
        assert_eq!(name_for("worker"), name_for("worker"));
        assert_ne!(name_for("worker"), name_for("another"));
        assert_ne!(name_for("nul\0"), name_for("nul"));
    }
}
