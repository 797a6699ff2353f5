//! The data that a program sends to a viewer on the same machine.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command};
use std::time::{Duration, Instant};
use std::{env, thread};

use drawloom::graph::{Closure, FrameGraph};
use drawloom::task::Scheduler;
use drawloom::timeline::Labels;
use drawloom_tracy::Zones;
use tracing::{debug_span, trace_span};

/// The first bytes that every viewer of Tracy 0.14 sends, before the number of its protocol.
const GREETING: &[u8] = b"TracyPrf";
const PROTOCOL: u32 = 82;
const WELCOME: u8 = 1;
const PROTOCOL_MISMATCH: u8 = 2;

/// A unique string, so that Tracy's compression does not change it.
const NODE: &str = "Wq7x#jvKz9";
const SPAN: &str = "Yb3u@fnGd5";
const SECRETS: [&str; 4] = ["Ph8c!mtRs2", "Lk6e%ovXa4", "Uz1i&wyJr0", "Dg5o~hqBn3"];

#[test]
fn a_viewer_of_tracy_0_14_receives_names_and_no_fields() {
    let program = Program::start();
    let other_protocol = program.greet("127.0.0.1", PROTOCOL - 1).map(|(_, answer)| answer);
    assert_eq!(other_protocol, Some(PROTOCOL_MISMATCH));
    let (mut stream, answer) = program.greet("127.0.0.1", PROTOCOL).expect("it listens");
    assert_eq!(answer, WELCOME);
    stream.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
    let (mut received, mut part) = (Vec::new(), [0; 4096]);
    let has = |received: &[u8], text: &str| received.windows(text.len()).any(|window| window == text.as_bytes());
    let start = Instant::now();
    while !(has(&received, NODE) && has(&received, SPAN)) {
        assert!(start.elapsed() < Duration::from_secs(60), "{} bytes, and no names", received.len());
        if let Ok(count) = stream.read(&mut part) {
            assert!(count > 0, "the program has hung up after {} bytes", received.len());
            received.extend_from_slice(&part[..count]);
        }
    }
    for secret in SECRETS {
        assert!(!has(&received, secret), "{secret} of a field was sent");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn only_the_loopback_address_accepts_connections() {
    let program = Program::start();
    assert!(program.greet("127.0.0.1", PROTOCOL).is_some());
    // Another address of this machine: a program that listened to the network would answer there.
    assert!(TcpStream::connect(("127.0.0.2", program.port)).is_err());
}

/// The traced program: this test binary, started as a child process.
struct Program {
    child: Child,
    port: u16,
}

impl Program {
    fn start() -> Self {
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let child = Command::new(env::current_exe().unwrap())
            .args(["--ignored", "--exact", "the_traced_program"])
            .env("TRACY_PORT", port.to_string())
            .spawn()
            .unwrap();
        Self { child, port }
    }

    /// Connects as a viewer with this protocol, and returns the answer. `None` without an answer in time.
    fn greet(&self, address: &str, protocol: u32) -> Option<(TcpStream, u8)> {
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(20) {
            if let Ok(mut stream) = TcpStream::connect((address, self.port)) {
                let mut answer = [0];
                stream.write_all(GREETING).ok()?;
                stream.write_all(&protocol.to_le_bytes()).ok()?;
                stream.read_exact(&mut answer).ok()?;
                return Some((stream, answer[0]));
            }
            thread::sleep(Duration::from_millis(20));
        }
        None
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        _ = self.child.kill();
        _ = self.child.wait();
    }
}

#[test]
#[ignore = "the other tests start it in a process of its own"]
fn the_traced_program() {
    drawloom_tracy::install(Zones::Nodes).unwrap();
    let scheduler = Scheduler::builder().workers(2).on_start(drawloom_tracy::name_worker).build().unwrap();
    let mut graph = FrameGraph::new();
    let node = graph.add(NODE, Closure::new(|(): &(), _, _| Ok(())).with_width(|()| 100));
    let [process, stage, view] = [SECRETS[0], SECRETS[1], SECRETS[2]].map(|secret| Some(secret.into()));
    graph.label(node, Labels { process, stage, view });
    graph.keep(node);
    let mut schedule = graph.compile().unwrap();
    schedule.always_parallel(true);
    let start = Instant::now();
    // The test that started this program ends it sooner.
    while start.elapsed() < Duration::from_secs(120) {
        let outer = debug_span!("Yb3u@fnGd5", secret = SECRETS[3]).entered();
        trace_span!("of no interest").in_scope(|| schedule.run(&scheduler, &()).unwrap());
        drop(outer);
        drawloom_tracy::mark_frame();
        thread::sleep(Duration::from_millis(5));
    }
}
