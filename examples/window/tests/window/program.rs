//! The program under test.

use std::io::Read;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use libtest_mimic::Failed;
use x11rb::protocol::xproto::Window;

use crate::display::{Display, Killed, Picture};
use crate::{SIZE, expect};

/// A run of the program.
pub struct Program<'a> {
    display: &'a Display,
    child: Killed,
}

impl<'a> Program<'a> {
    pub fn start(display: &'a Display, arguments: &[&str]) -> Result<Self, Failed> {
        let child = command(display, arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().map(Killed)?;
        Ok(Self { display, child })
    }

    /// The program's `number`-th window, when it is open.
    pub fn window(&self, number: usize) -> Result<Window, Failed> {
        let title = format!("Drawloom, window {number}:");
        wait_for(&title, || self.display.find(&title))
    }

    pub fn wait_for_title(&self, number: usize, part: &str) -> Result<(), Failed> {
        let window = self.window(number)?;
        wait_for(part, || Ok(self.display.title(window)?.contains(part).then_some(())))
    }

    /// What a window shows when that meets a condition.
    pub fn wait_until(&self, number: usize, holds: impl Fn(&Picture) -> bool) -> Result<Picture, Failed> {
        let window = self.window(number)?;
        wait_for("a picture", || Ok(self.display.picture(window)?.filter(|picture| holds(picture))))
    }

    /// What a window shows when it is more than a background.
    pub fn wait_for_picture(&self, number: usize) -> Result<Picture, Failed> {
        self.wait_until(number, Picture::is_drawn)
    }

    pub fn wait_until_shown(&self, number: usize, expected: &Picture) -> Result<(), Failed> {
        self.wait_until(number, |picture| picture == expected).map(drop)
    }

    /// What a window shows when that no longer changes.
    pub fn wait_until_at_rest(&self, number: usize) -> Result<Picture, Failed> {
        let window = self.window(number)?;
        wait_for("a picture at rest", || {
            let before = self.display.picture(window)?;
            // Several frames later.
            thread::sleep(Duration::from_millis(700));
            let after = self.display.picture(window)?;
            Ok(after.filter(|after| before.as_ref() == Some(after)))
        })
    }

    pub fn wait_until_closed(&self, window: Window) -> Result<(), Failed> {
        wait_for("a closed window", || Ok((!self.display.clients()?.contains(&window)).then_some(())))
    }

    /// Closes the last window, and checks that the program ends well.
    pub fn close(self, number: usize) -> Result<(), Failed> {
        self.close_and_count(number).map(drop)
    }

    /// The same. Returns how many textures and buffers the program had in the end.
    pub fn close_and_count(mut self, number: usize) -> Result<[usize; 2], Failed> {
        self.display.close(self.window(number)?)?;
        let status = wait_for("the end", || Ok(self.child.0.try_wait()?))?;
        let (mut output, mut errors) = (String::new(), String::new());
        self.child.0.stdout.take().ok_or("it is piped")?.read_to_string(&mut output)?;
        self.child.0.stderr.take().ok_or("it is piped")?.read_to_string(&mut errors)?;
        expect(status.success(), || format!("{status}: {errors}"))?;
        check_messages(&errors)?;
        let words: Vec<_> = output.split_whitespace().collect();
        let count_of = |kind| words.windows(2).find(|pair| pair[1] == kind).and_then(|pair| pair[0].parse().ok());
        count_of("textures").zip(count_of("buffers")).map(<[_; 2]>::from).ok_or_else(|| output.clone().into())
    }
}

/// The program on a display.
pub fn command(display: &Display, arguments: &[&str]) -> Command {
    let [width, height] = SIZE;
    let mut command = Command::new(env!("CARGO_BIN_EXE_window"));
    if !arguments.contains(&"--size") {
        command.args(["--size", &format!("{width}x{height}")]);
    }
    command.args(arguments);
    command.env("DISPLAY", &display.name).env("WINIT_X11_SCALE_FACTOR", display.scale_factor);
    command.env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    // So that messages are plain text, whichever features of `tracing-subscriber` other packages enable.
    command.env("NO_COLOR", "1");
    command
}

/// The screenshot of a run that ends by itself.
pub fn screenshot(display: &Display, arguments: &[&str]) -> Result<Picture, Failed> {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let number = COUNT.fetch_add(1, Ordering::Relaxed);
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("window-{number}.png"));
    let output = command(display, arguments).arg("--screenshot").arg(&path).output()?;
    let errors = String::from_utf8_lossy(&output.stderr);
    expect(output.status.success(), || format!("{}: {errors}", output.status))?;
    check_messages(&errors)?;
    let image = image::open(&path)?.into_rgb8();
    std::fs::remove_file(path)?;
    Ok(Picture { size: image.dimensions().into(), pixels: image.pixels().map(|pixel| pixel.0).collect() })
}

/// Waits until `find` finds something.
pub fn wait_for<T>(what: &str, mut find: impl FnMut() -> Result<Option<T>, Failed>) -> Result<T, Failed> {
    // Long, so that only what never comes fails, however busy the machine is.
    let deadline = Instant::now() + Duration::from_secs(60);
    loop {
        if let Some(found) = find()? {
            return Ok(found);
        }
        if Instant::now() > deadline {
            return Err(format!("waited for {what:?} in vain").into());
        }
        thread::sleep(Duration::from_millis(20));
    }
}

/// Fails on a warning or an error. Those of winit are excepted: it warns where a desktop's services are missing.
fn check_messages(errors: &str) -> Result<(), Failed> {
    let is_message = |line: &&str| {
        !line.contains(" winit::") && ["WARN", "ERROR", "panicked"].iter().any(|word| line.contains(word))
    };
    let messages: Vec<_> = errors.lines().filter(is_message).collect();
    expect(messages.is_empty(), || messages.join("\n"))
}
