//! The window as a user meets it: on a virtual display with a window manager, with keys and a mouse.
//!
//! Without Xvfb, xdotool and Openbox these tests show as ignored. With `DRAWLOOM_REQUIRE_DISPLAY` set they fail instead.

mod display;
mod program;

use std::path::Path;
use std::process::Command;
use std::thread;
use std::time::Duration;

use libtest_mimic::{Arguments, Failed, Trial};

use display::Display;
use program::{Program, screenshot};

type Case = (&'static str, fn() -> Result<(), Failed>);

const CASES: &[Case] = &[
    ("without_a_display_it_says_so", without_display),
    ("a_moving_world_looks_the_same_on_every_run", same_on_every_run),
    ("a_screenshot_is_what_the_window_shows", screenshot_is_shown),
    ("a_converted_picture_is_what_the_window_shows", converted_is_shown),
    ("after_fifty_resizes_the_window_shows_the_same_and_nothing_is_left", fifty_resizes),
    ("a_window_is_as_large_as_the_scale_factor_says", scale_factor),
    ("keys_fly_and_a_drag_looks_around", keys_and_mouse),
    ("a_restored_window_shows_the_same", restored),
    ("full_screen_covers_the_display", full_screen),
    ("windows_open_and_close_one_by_one", several_windows),
    ("a_screenshot_that_cannot_be_written_is_named", unwritable),
];

const STILL: &[&str] = &["--still", "--objects", "150"];
const SIZE: [u32; 2] = [320, 200];

fn main() {
    let is_missing = Display::missing_programs();
    if !is_missing.is_empty() {
        eprintln!("ignored, as there is no {}", is_missing.join(" and no "));
    }
    let ignored = !is_missing.is_empty() && std::env::var_os("DRAWLOOM_REQUIRE_DISPLAY").is_none();
    let trials = CASES.iter().map(|&(name, run)| Trial::test(name, run).with_ignored_flag(ignored)).collect();
    libtest_mimic::run(&Arguments::from_args(), trials).exit();
}

fn without_display() -> Result<(), Failed> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_window"));
    for variable in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(variable);
    }
    let output = command.output()?;
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    let is_clear = message.contains("no window can be opened here") && message.contains("xvfb-run");
    expect(output.status.code() == Some(2) && is_clear, || format!("{:?}: {message}", output.status))
}

fn same_on_every_run() -> Result<(), Failed> {
    let display = Display::new()?;
    let moving = ["--objects", "150", "--frames", "20"];
    let first = screenshot(&display, &moving)?;
    expect(screenshot(&display, &moving)? == first, || "two runs differ".into())?;
    let earlier = screenshot(&display, &["--objects", "150", "--frames", "4"])?;
    expect(earlier != first, || "nothing moves".into())
}

fn screenshot_is_shown() -> Result<(), Failed> {
    let display = Display::new()?;
    let expected = screenshot(&display, &[STILL, &["--frames", "3"]].concat())?;
    let program = Program::start(&display, STILL)?;
    program.wait_until_shown(1, &expected)?;
    program.close(1)
}

fn converted_is_shown() -> Result<(), Failed> {
    let display = Display::new()?;
    let expected = screenshot(&display, &[STILL, &["--frames", "3"]].concat())?;
    let converted = [STILL, &["--convert"]].concat();
    let of_converted = screenshot(&display, &[&*converted, &["--frames", "3"]].concat())?;
    expect(of_converted == expected, || "the screenshots differ".into())?;
    let program = Program::start(&display, &converted)?;
    program.wait_until_shown(1, &expected)?;
    program.close(1)
}

fn fifty_resizes() -> Result<(), Failed> {
    let display = Display::new()?;
    let expected = screenshot(&display, &[STILL, &["--frames", "3"]].concat())?;
    let mut resources = Vec::new();
    for resizes in [0, 50] {
        let program = Program::start(&display, STILL)?;
        program.wait_until_shown(1, &expected)?;
        for step in 1..=resizes {
            let size = [200 + (step * 37) % 500, 150 + (step * 53) % 400];
            display.resize(program.window(1)?, size)?;
            // So that most sizes are drawn.
            thread::sleep(Duration::from_millis(40));
        }
        display.resize(program.window(1)?, SIZE)?;
        program.wait_until_shown(1, &expected)?;
        resources.push(program.close_and_count(1)?);
    }
    // A few buffers more or less, by how many frames were in flight at once. What a resize leaves is there fifty times.
    let is_similar = |kind: usize| resources[1][kind] < resources[0][kind] + 10;
    expect(is_similar(0) && is_similar(1), || format!("textures and buffers without and with resizes: {resources:?}"))
}

fn scale_factor() -> Result<(), Failed> {
    let display = Display::new()?.with_scale_factor("1.5");
    let picture = screenshot(&display, &["--still", "--frames", "3"])?;
    expect(picture.size == SIZE.map(|side| side * 3 / 2), || format!("{:?}", picture.size))
}

fn keys_and_mouse() -> Result<(), Failed> {
    let display = Display::new()?;
    let program = Program::start(&display, STILL)?;
    let window = program.window(1)?;
    let mut seen = vec![program.wait_for_picture(1)?];
    for keys in [&["w"][..], &["a"], &["s"], &["d"], &["e"], &["q"], &["shift", "w"]] {
        display.focus(window)?;
        keys.iter().try_for_each(|key| display.xdotool(&["keydown", key]))?;
        let moved = program.wait_until(1, |picture| !seen.contains(picture))?;
        keys.iter().try_for_each(|key| display.xdotool(&["keyup", key]))?;
        seen.push(moved);
    }
    let at_rest = program.wait_until_at_rest(1)?;
    display.point_at(window, [100, 100])?;
    expect(program.wait_until_at_rest(1)? == at_rest, || "without a drag the pointer turns the camera".into())?;
    display.xdotool(&["mousedown", "1"])?;
    display.point_at(window, [160, 120])?;
    program.wait_until(1, |picture| *picture != at_rest)?;
    display.xdotool(&["mouseup", "1"])?;
    display.xdotool(&["key", "v"])?;
    program.wait_for_title(1, "vsync off")?;
    program.close(1)
}

fn restored() -> Result<(), Failed> {
    let display = Display::new()?;
    let program = Program::start(&display, STILL)?;
    let window = program.window(1)?;
    let mut before = program.wait_for_picture(1)?;
    for _ in 0..2 {
        display.minimize(window)?;
        // So that the program notices it.
        thread::sleep(Duration::from_millis(600));
        display.restore(window)?;
        program.wait_until_shown(1, &before)?;
        // It goes on: a key still moves the camera.
        display.xdotool(&["key", "--delay", "100", "w"])?;
        program.wait_until(1, |picture| *picture != before)?;
        before = program.wait_until_at_rest(1)?;
    }
    // A minimised window can be closed too.
    display.minimize(window)?;
    program.close(1)
}

fn full_screen() -> Result<(), Failed> {
    let display = Display::new()?;
    let program = Program::start(&display, STILL)?;
    let before = program.wait_for_picture(1)?;
    display.focus(program.window(1)?)?;
    display.xdotool(&["key", "F11"])?;
    program.wait_until(1, |picture| picture.size == Display::SIZE)?;
    display.xdotool(&["key", "F11"])?;
    program.wait_until_shown(1, &before)?;
    program.close(1)
}

fn several_windows() -> Result<(), Failed> {
    let display = Display::new()?;
    let program = Program::start(&display, &[STILL, &["--windows", "2"]].concat())?;
    let second = program.window(2)?;
    display.focus(second)?;
    display.xdotool(&["key", "n"])?;
    program.window(3)?;
    display.focus(second)?;
    display.xdotool(&["key", "Escape"])?;
    program.wait_until_closed(second)?;
    display.focus(program.window(1)?)?;
    program.wait_for_picture(1)?;
    display.close(program.window(1)?)?;
    // The last one ends the program.
    program.close(3)
}

fn unwritable() -> Result<(), Failed> {
    let display = Display::new()?;
    let path = Path::new("no such folder").join("picture.png");
    let arguments = ["--frames", "1", "--screenshot", path.to_str().ok_or("it is UTF-8")?];
    let output = program::command(&display, &arguments).output()?;
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    expect(output.status.code() == Some(1) && message.contains("no such folder"), || message)
}

fn expect(holds: bool, otherwise: impl FnOnce() -> String) -> Result<(), Failed> {
    if holds { Ok(()) } else { Err(otherwise().into()) }
}
