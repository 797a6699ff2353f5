//! All data of a log can be read back from its page, and no name in it ends a script element early.

use std::sync::Arc;
use std::time::Duration;

use crate::adversarial_names::{adversarial_names, log_of};
use drawloom_jobs::report::{SchedulerCosts, write_page};
use drawloom_jobs::timeline::{Chunk, Idle, IdleKind, Log};
use proptest::collection::vec;
use proptest::prelude::*;
use serde_json::Value;

fn page_of(log: &Log) -> String {
    let mut page = Vec::new();
    write_page(log, &SchedulerCosts::ZERO, &mut page).expect("the log is consistent");
    String::from_utf8(page).expect("a page is text")
}

/// The data that is embedded in a page.
fn data_of(page: &str) -> Value {
    let (_, rest) = page.split_once(r#"<script id="data" type="application/json">"#).expect("the page has data");
    let (data, _) = rest.split_once("</script>").expect("the data ends");
    serde_json::from_str(data).expect("the data is JSON")
}

fn numbers(list: &Value) -> Vec<i64> {
    list.as_array().unwrap().iter().map(|number| number.as_i64().unwrap()).collect()
}

fn assert_is_closed(page: &str) {
    let page = page.to_lowercase();
    let (opened, closed) = (page.matches("<script").count(), page.matches("</script").count());
    assert_eq!((opened, closed), (2, 2), "scripts opened, and closed");
    assert!(!page.contains("<!--") && !page.contains(['\u{2028}', '\u{2029}']));
}

#[test]
fn adversarial_names_are_escaped() {
    let names = adversarial_names();
    let log = log_of(&names);
    let page = page_of(&log);
    assert_is_closed(&page);
    let data = data_of(&page);
    let text = |index: &Value| data["texts"][index.as_u64().unwrap() as usize].as_str().unwrap().to_owned();
    let listed = |list: &Value| list.as_array().unwrap().iter().map(text).collect::<Vec<_>>();
    let nodes = data["graphs"][0].as_array().unwrap();
    for field in ["name", "group", "color", "view"] {
        assert_eq!(nodes.iter().map(|node| text(&node[field])).collect::<Vec<_>>(), names, "{field}");
    }
    assert_eq!(listed(&data["threads"]), names);
    let workers = data["workers"].as_array().unwrap();
    assert_eq!(workers.iter().map(|worker| text(&worker["name"])).collect::<Vec<_>>(), names);
    assert_eq!(text(&data["device"]["name"]), names.concat());
    for (list, length, field) in [(&data["spans"], 5, 0), (&data["device"]["passes"], 5, 1)] {
        let list = list.as_array().unwrap();
        assert_eq!(list.chunks(length).map(|numbers| text(&numbers[field])).collect::<Vec<_>>(), names);
    }
}

#[test]
fn a_page_loads_nothing() {
    let page = page_of(&log_of(&["a".to_owned()]));
    for load in ["http:", "https:", "src=", "href=", "url(", "@import", "import(", "fetch(", "XMLHttpRequest", "<link"]
    {
        assert!(!page.contains(load), "{load}");
    }
    assert!(page.contains("default-src 'none'"));
}

#[test]
fn an_empty_log_makes_a_page() {
    let data = data_of(&page_of(&Log::default()));
    assert_eq!(data["frames"], Value::Array(Vec::new()));
}

#[test]
fn a_frame_without_a_report_has_the_reason() {
    let mut log = log_of(&["a".to_owned()]);
    log.runs[0].complete = false;
    let data = data_of(&page_of(&log));
    let report = data["frames"][0]["report"].as_u64().unwrap() as usize;
    assert!(data["texts"][report].as_str().unwrap().contains("does not have all of frame 0"));
}

#[test]
fn an_inconsistent_log_is_an_error() {
    type Corruption = fn(&mut Log);
    let corruptions: [Corruption; 5] = [
        |log| log.runs[0].chunks[0].node = 1,
        |log| log.runs[0].chunks[0].worker = 1,
        |log| log.runs[0].empty.push(Chunk { worker: 7, ..Chunk::default() }),
        |log| log.spans[0].thread = 1,
        |log| Arc::make_mut(&mut log.runs[0].graph).nodes[0].dependencies.push(0),
    ];
    for (index, corrupt) in corruptions.into_iter().enumerate() {
        let mut log = log_of(&["a".to_owned()]);
        corrupt(&mut log);
        let error = write_page(&log, &SchedulerCosts::ZERO, Vec::new()).expect_err("the log is inconsistent");
        assert_eq!(error.kind(), std::io::ErrorKind::InvalidData, "{index}: {error}");
    }
}

#[test]
fn a_writer_that_fails_is_an_error() {
    let (mut buffer, log) = ([0; 1_000], log_of(&["a".to_owned()]));
    assert!(write_page(&log, &SchedulerCosts::ZERO, &mut buffer[..]).is_err());
}

/// Node, first item, number of items, worker, whether it was stolen, opening time, waiting time, duration.
type ChunkNumbers = (usize, usize, usize, usize, bool, u64, u64, u64);

fn any_chunk() -> impl Strategy<Value = ChunkNumbers> {
    let short = 0..1_u64 << 30;
    (0..3_usize, 0..1_000_usize, 1..50_usize, 0..2_usize, any::<bool>(), 0..1_u64 << 40, short.clone(), short)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(256) })]

    #[test]
    fn every_chunk_can_be_read_back_to_the_nanosecond(
        start in 0..1_u64 << 60,
        chunks_as_numbers in vec(any_chunk(), 0..40),
        idle in vec((any::<bool>(), 0..1_u64 << 40, 0..1_u64 << 40), 0..10),
    ) {
        let at = |after: u64| Duration::from_nanos(start) + Duration::from_nanos(after);
        let chunk = |&(node, first, items, worker, stolen, opened, waited, duration): &ChunkNumbers| Chunk {
            node,
            items: first..first + items,
            worker,
            opened: at(opened),
            started: at(opened + waited),
            ended: at(opened + waited + duration),
            stolen,
        };
        let kind = |asleep| if asleep { IdleKind::Asleep } else { IdleKind::Searching };
        let mut log = log_of(&["a".to_owned(), "b".to_owned(), "c".to_owned()]);
        log.frames[0].began = at(0);
        (log.runs[0].began, log.runs[0].ended) = (at(0), at(1 << 42));
        (log.spans, log.device) = (Vec::new(), None);
        log.runs[0].chunks = chunks_as_numbers.iter().map(chunk).collect();
        log.runs[0].chunks.sort_by_key(|chunk| (chunk.node, chunk.items.start));
        let idle_interval = |&(asleep, began, duration): &_| Idle { kind: kind(asleep), began: at(began), ended: at(began + duration) };
        log.workers[1].idle = idle.iter().map(idle_interval).collect();
        log.runs[0].complete = false;

        let data = data_of(&page_of(&log));
        let chunk = |numbers: &[i64]| {
            let time = |number: i64| at(u64::try_from(number).unwrap());
            Chunk {
                node: numbers[0] as usize,
                items: numbers[1] as usize..(numbers[1] + numbers[2]) as usize,
                worker: numbers[3] as usize,
                stolen: numbers[4] == 1,
                opened: time(numbers[5]),
                started: time(numbers[5] + numbers[6]),
                ended: time(numbers[5] + numbers[6] + numbers[7]),
            }
        };
        let chunks: Vec<_> = numbers(&data["runs"][0]["chunks"]).chunks(8).map(chunk).collect();
        prop_assert_eq!(&chunks, &log.runs[0].chunks);
        let expected = idle.iter().flat_map(|&(asleep, began, duration)| [i64::from(asleep), began as i64, duration as i64]);
        let expected: Vec<_> = expected.collect();
        prop_assert_eq!(numbers(&data["workers"][1]["idle"]), expected);
    }

    #[test]
    fn no_name_ends_a_script_element(name in "(</?(?i:script)>?|<!--|\\PC|[\\x00-\\x1f\u{2028}\u{2029}]){0,12}") {
        let page = page_of(&log_of(std::slice::from_ref(&name)));
        assert_is_closed(&page);
        let data = data_of(&page);
        prop_assert!(data["texts"].as_array().unwrap().iter().any(|text| text == &name));
    }
}
