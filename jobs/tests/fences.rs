//! Fences of the CPU alone.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Arc, Barrier};
use std::thread;
use std::time::{Duration, Instant};

use drawloom_jobs::fence::{DeviceProgress, Fence, FenceError};

/// Longer than anything here takes, also on a machine that is busy.
const LONG: Duration = Duration::from_secs(60);

#[test]
fn all_who_wait_go_on_when_the_fence_is_set() {
    for _ in 0..50 {
        let (setter, fence) = Fence::new("start");
        let data = Arc::new(AtomicUsize::new(0));
        let together = Arc::new(Barrier::new(5));
        let waiters: Vec<_> = (0..4)
            .map(|_| {
                let (fence, data, together) = (fence.clone(), Arc::clone(&data), Arc::clone(&together));
                thread::spawn(move || {
                    together.wait();
                    fence.wait(LONG).unwrap();
                    // Relaxed: only the fence orders it.
                    data.load(Ordering::Relaxed)
                })
            })
            .collect();
        together.wait();
        data.store(7, Ordering::Relaxed);
        setter.set();
        for waiter in waiters {
            assert_eq!(waiter.join().unwrap(), 7);
        }
    }
}

#[test]
fn a_fence_tells_when_it_was_set_and_only_then() {
    let (setter, fence) = Fence::new("moment");
    assert_eq!((fence.is_set(), fence.set_at()), (false, None));
    let before = Instant::now();
    setter.set();
    assert!(fence.set_at().is_some_and(|time| time >= before && time <= Instant::now()));
}

#[test]
fn a_fence_is_abandoned_when_its_setter_is_dropped_also_by_a_panic() {
    let (setter, fence) = Fence::new("loader");
    let abandoned = Err(FenceError::Abandoned { fence: "loader".to_owned() });
    let loader = thread::spawn(move || {
        let _setter = setter;
        std::panic::resume_unwind(Box::new("as planned"));
    });
    assert_eq!(fence.wait(LONG), abandoned);
    assert!(loader.join().is_err());
    assert!(!fence.is_set());
    assert_eq!(fence.wait(Duration::ZERO), abandoned);
}

#[test]
fn a_wait_ends_at_its_limit_and_names_the_fence() {
    let (_setter, fence) = Fence::new("never");
    let error = fence.wait(Duration::from_millis(2)).unwrap_err();
    let FenceError::TimedOut { fence: name, limit, waits } = &error else { panic!("{error}") };
    assert_eq!((name.as_str(), *limit), ("never", Duration::from_millis(2)));
    assert!(waits.iter().any(|wait| wait.fence == "never" && wait.waited >= *limit), "{error}");
    // It is no longer listed.
    let error = fence.wait(Duration::ZERO).unwrap_err();
    let FenceError::TimedOut { waits, .. } = &error else { panic!("{error}") };
    assert_eq!(waits.iter().filter(|wait| wait.fence == "never").count(), 1, "{error}");
}

#[test]
fn callbacks_are_called_once_before_and_after() {
    let (setter, fence) = Fence::new("call");
    let (calls, called) = channel();
    for number in 0..3 {
        let calls = calls.clone();
        fence.on_set(move |outcome| calls.send((number, outcome)).unwrap());
    }
    assert!(called.try_recv().is_err());
    setter.set();
    fence.on_set(move |outcome| calls.send((3, outcome)).unwrap());
    assert_eq!(called.iter().collect::<Vec<_>>(), (0..4).map(|number| (number, Ok(()))).collect::<Vec<_>>());

    let (setter, fence) = Fence::new("call");
    let (calls, called) = channel();
    fence.on_set(move |outcome| calls.send(outcome).unwrap());
    drop(setter);
    assert_eq!(called.recv().unwrap(), Err(FenceError::Abandoned { fence: "call".to_owned() }));
}

#[test]
fn a_callback_that_panics_holds_up_nobody() {
    let (setter, fence) = Fence::new("panic");
    let (calls, called) = channel();
    fence.on_set(|_| std::panic::resume_unwind(Box::new("as planned")));
    fence.on_set(move |_| calls.send(()).unwrap());
    setter.set();
    called.recv().unwrap();
    fence.wait(Duration::ZERO).unwrap();
}

#[test]
fn a_callback_may_use_its_own_fence() {
    let (setter, fence) = Fence::new("again");
    let (calls, called) = channel();
    let same = fence.clone();
    fence.on_set(move |_| {
        same.wait(Duration::ZERO).unwrap();
        same.on_set(move |outcome| calls.send(outcome).unwrap());
    });
    setter.set();
    assert_eq!(called.recv().unwrap(), Ok(()));
}

/// A device that has finished after a number of steps, or failed.
struct Steps {
    left: AtomicUsize,
    setter: parking_lot::Mutex<Option<drawloom_jobs::fence::FenceSetter>>,
    fails: bool,
}

impl DeviceProgress for Steps {
    fn advance(&self, _limit: Duration) -> Result<(), String> {
        if self.left.fetch_sub(1, Ordering::Relaxed) > 1 {
            return Ok(());
        }
        if self.fails {
            return Err("it is lost".to_owned());
        }
        if let Some(setter) = self.setter.lock().take() {
            setter.set();
        }
        Ok(())
    }
}

fn stepped(steps: usize, fails: bool) -> (Fence, Arc<Steps>) {
    let (setter, fence) = Fence::new("device");
    let device = Arc::new(Steps { left: steps.into(), setter: parking_lot::Mutex::new(None), fails });
    setter.advance_by(Arc::clone(&device));
    *device.setter.lock() = Some(setter);
    (fence, device)
}

#[test]
fn who_waits_or_asks_lets_the_device_advance() {
    let (fence, _device) = stepped(5, false);
    fence.wait(LONG).unwrap();
    let (fence, _device) = stepped(3, false);
    assert_eq!([fence.is_set(), fence.is_set(), fence.is_set()], [false, false, true]);
}

#[test]
fn a_device_that_fails_is_an_error_and_says_why() {
    let (fence, _device) = stepped(2, true);
    let failed = FenceError::Device { fence: "device".to_owned(), message: "it is lost".to_owned() };
    assert_eq!(fence.wait(LONG), Err(failed));
}

/// The device of a frame is known only when the frame is submitted, while others wait for its fence already.
#[test]
fn a_wait_that_began_before_the_device_was_known_lets_it_advance() {
    let (setter, fence) = Fence::new("late device");
    let waiter = {
        let fence = fence.clone();
        thread::spawn(move || fence.wait(LONG))
    };
    thread::sleep(Duration::from_millis(5));
    let device = Arc::new(Steps { left: 2.into(), setter: parking_lot::Mutex::new(None), fails: false });
    setter.advance_by(Arc::clone(&device));
    *device.setter.lock() = Some(setter);
    waiter.join().unwrap().unwrap();
}

#[test]
fn a_device_that_fails_is_told_to_all_and_for_good() {
    let (fence, device) = stepped(1, true);
    let (calls, called) = channel();
    fence.on_set(move |outcome| calls.send(outcome).unwrap());
    let failed = Err(FenceError::Device { fence: "device".to_owned(), message: "it is lost".to_owned() });
    assert_eq!(fence.wait(LONG), failed);
    assert_eq!(called.recv().unwrap(), failed);
    // What a device calls back for when it is dropped is not done.
    device.setter.lock().take().unwrap().set();
    assert_eq!((fence.wait(LONG), fence.is_set()), (failed, false));
}
