//! An engine's loop in a window: the world is updated on all threads while the frame before is submitted, and its pictures
//! are drawn straight into the textures of the windows' surfaces.
//!
//!     cargo run --release -p window
//!
//! W, A, S and D fly, Q and E sink and rise, Shift flies faster, and a drag with the mouse looks around. F11 is full screen,
//! V switches vertical synchronisation, N opens another window, Escape closes the window.

mod engine;
mod fly_camera;
mod frame_pacing;
mod graphics;
mod options;
mod view_window;
mod window_surface;
mod world;

use std::error::Error;
use std::io;
use std::process::ExitCode;

use clap::Parser;
use tracing_subscriber::filter::LevelFilter;
use winit::event_loop::EventLoop;

use engine::Engine;
use options::Options;

fn main() -> ExitCode {
    // What Drawloom and wgpu warn of.
    tracing_subscriber::fmt().with_max_level(LevelFilter::WARN).with_writer(io::stderr).init();
    let event_loop = match EventLoop::new() {
        Ok(event_loop) => event_loop,
        Err(error) => {
            eprintln!("no window can be opened here: {error}");
            eprintln!("Without a display, a virtual one does: xvfb-run cargo run --release -p window");
            return ExitCode::from(2);
        }
    };
    match run(event_loop) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(event_loop: EventLoop<()>) -> Result<(), Box<dyn Error>> {
    let mut engine = Engine::new(Options::parse())?;
    event_loop.run_app(&mut engine)?;
    engine.finish()
}
