//! The window as a user meets it: on a virtual display with a window manager, with keys and a mouse.
//!
//! Without Xvfb, xdotool and Openbox those that need a display show as ignored. With `DRAWLOOM_REQUIRE_DISPLAY` set
//! they fail instead.

mod display;
mod program;

use std::path::Path;
use std::process::Command;
use std::thread;
use std::time::Duration;

use libtest_mimic::{Arguments, Failed, Trial};

use display::{Display, Picture};
use program::{Program, screenshot};

type Case = (&'static str, fn() -> Result<(), Failed>);

const CASES: &[Case] = &[
    ("a_moving_world_looks_the_same_on_every_run", same_on_every_run),
    ("a_screenshot_is_what_the_window_shows", screenshot_is_shown),
    ("a_converted_picture_is_what_the_window_shows", converted_is_shown),
    ("after_fifty_resizes_the_window_shows_the_same_and_nothing_is_left", fifty_resizes),
    ("after_resizes_a_converted_picture_is_the_same_and_nothing_is_left", converted_resizes),
    ("a_window_is_as_large_as_the_scale_factor_says", scale_factor),
    ("keys_fly_and_a_drag_looks_around", keys_and_mouse),
    ("a_restored_window_shows_the_same", restored),
    ("full_screen_covers_the_display", full_screen),
    ("windows_open_and_close_one_by_one", several_windows),
    ("a_window_without_focus_hears_no_more_of_its_keys", focus_is_lost),
    ("the_inspector_lies_over_the_picture_and_takes_the_mouse", inspector),
    ("the_inspectors_button_closes_it", inspector_is_closed),
    ("a_screenshot_that_cannot_be_written_is_named", unwritable),
];

const STILL: &[&str] = &["--still", "--objects", "150"];
const STILL_AND_LARGE: &[&str] = &["--still", "--objects", "150", "--size", "900x600"];
const SIZE: [u32; 2] = [320, 200];

fn main() {
    let missing = Display::missing_programs();
    if !missing.is_empty() {
        eprintln!("ignored, as there is no {}", missing.join(" and no "));
    }
    let ignored = !missing.is_empty() && std::env::var_os("DRAWLOOM_REQUIRE_DISPLAY").is_none();
    let trials = CASES.iter().map(|&(name, run)| Trial::test(name, run).with_ignored_flag(ignored));
    let trials = trials.chain([Trial::test("without_a_display_it_says_so", without_display)]).collect();
    libtest_mimic::run(&Arguments::from_args(), trials).exit();
}

fn without_display() -> Result<(), Failed> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_window"));
    for variable in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(variable);
    }
    let output = command.output()?;
    let help = command.arg("--help").output()?;
    expect(help.status.success() && help.stdout.starts_with(b"An engine"), || format!("--help: {help:?}"))?;
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    let is_clear = message.contains("no window can be opened here") && message.contains("xvfb-run");
    expect(output.status.code() == Some(1) && is_clear, || format!("{:?}: {message}", output.status))
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
    resize_and_count(50, STILL)
}

fn converted_resizes() -> Result<(), Failed> {
    resize_and_count(25, &[STILL, &["--convert"]].concat())
}

fn resize_and_count(count: u32, arguments: &[&str]) -> Result<(), Failed> {
    let display = Display::new()?;
    let expected = screenshot(&display, &[STILL, &["--frames", "3"]].concat())?;
    let mut resources = Vec::new();
    for resizes in [0, count] {
        let program = Program::start(&display, arguments)?;
        program.wait_until_shown(1, &expected)?;
        for step in 1..=resizes {
            let size = [200 + (step * 37) % 500, 150 + (step * 53) % 400];
            display.resize(program.window(1)?, size)?;
            // Every other one comes while the one before is drawn.
            if step % 2 == 0 {
                program.wait_until(1, |picture| picture.size == size && picture.is_drawn())?;
            }
        }
        display.resize(program.window(1)?, SIZE)?;
        program.wait_until_shown(1, &expected)?;
        resources.push(program.close_and_count(1)?);
    }
    // A few buffers more or less, by how many frames were in flight at once. What a resize leaves is there for each.
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
    let mut at_rest = program.wait_for_picture(1)?;
    for keys in [&["w"][..], &["a"], &["s"], &["d"], &["e"], &["q"], &["shift", "w"]] {
        display.focus(window)?;
        keys.iter().try_for_each(|key| display.xdotool(&["keydown", key]))?;
        program.wait_until(1, |picture| *picture != at_rest)?;
        keys.iter().try_for_each(|key| display.xdotool(&["keyup", key]))?;
        at_rest = program.wait_until_at_rest(1)?;
    }
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
        display.xdotool(&["keydown", "w"])?;
        program.wait_until(1, |picture| *picture != before)?;
        display.xdotool(&["keyup", "w"])?;
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
    let first = program.window(1)?;
    display.focus(first)?;
    program.wait_for_picture(1)?;
    display.close(first)?;
    program.wait_until_closed(first)?;
    // The others go on, and the last one ends the program.
    let before = program.wait_until_at_rest(3)?;
    display.focus(program.window(3)?)?;
    display.xdotool(&["keydown", "w"])?;
    program.wait_until(3, |picture| *picture != before)?;
    display.xdotool(&["keyup", "w"])?;
    program.close(3)
}

fn focus_is_lost() -> Result<(), Failed> {
    let display = Display::new()?;
    let program = Program::start(&display, STILL)?;
    let before = program.wait_until_at_rest(1)?;
    display.focus(program.window(1)?)?;
    display.xdotool(&["keydown", "w"])?;
    program.wait_until(1, |picture| *picture != before)?;
    display.take_focus_away()?;
    program.wait_until_at_rest(1)?;
    display.xdotool(&["keyup", "w"])?;
    program.close(1)
}

fn inspector() -> Result<(), Failed> {
    let display = Display::new()?;
    let program = Program::start(&display, STILL_AND_LARGE)?;
    let window = program.window(1)?;
    let before = program.wait_until_at_rest(1)?;
    display.focus(window)?;
    display.xdotool(&["key", "F1"])?;
    let is_over = |picture: &Picture| picture.share_equal_to(&before) < 0.9;
    program.wait_until(1, is_over)?;
    // A drag of its title moves it, and turns no camera.
    display.point_at(window, [300, 33])?;
    display.xdotool(&["mousedown", "1"])?;
    display.point_at(window, [360, 120])?;
    display.xdotool(&["mouseup", "1"])?;
    program.wait_until(1, is_over)?;
    display.xdotool(&["key", "F1"])?;
    program.wait_until_shown(1, &before)?;
    program.close(1)
}

fn inspector_is_closed() -> Result<(), Failed> {
    let display = Display::new()?;
    let expected = screenshot(&display, &[STILL_AND_LARGE, &["--frames", "3"]].concat())?;
    let program = Program::start(&display, &[STILL_AND_LARGE, &["--inspector"]].concat())?;
    let window = program.window(1)?;
    program.wait_until(1, |picture| picture.is_drawn() && picture.share_equal_to(&expected) < 0.9)?;
    display.focus(window)?;
    display.point_at(window, [757, 34])?;
    display.xdotool(&["click", "1"])?;
    program.wait_until_shown(1, &expected)?;
    program.close(1)
}

fn unwritable() -> Result<(), Failed> {
    let display = Display::new()?;
    let path = Path::new("no such folder").join("picture.png");
    let arguments = ["--frames", "1", "--screenshot", path.to_str().ok_or("it is UTF-8")?];
    let output = program::command(&display, &arguments).output()?;
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    // The argument is refused before a window opens.
    expect(output.status.code() == Some(2) && message.contains("no such folder is no folder"), || message)
}

fn expect(holds: bool, otherwise: impl FnOnce() -> String) -> Result<(), Failed> {
    if holds { Ok(()) } else { Err(otherwise().into()) }
}
