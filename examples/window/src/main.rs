//! An engine's loop in a window: the world is updated on all threads while the frame before is submitted, and its
//! pictures are drawn straight into the textures of the windows' surfaces.
//!
//!     cargo run --release -p window
//!
//! W, A, S and D fly, Q and E sink and rise, Shift flies faster, and a drag with the mouse looks around. F1 shows the
//! inspector, F11 is full screen, V switches vertical synchronisation, N opens another window, Escape closes one.

mod engine;
mod fly_camera;
mod frame_pacing;
mod graphics;
mod key_presses;
mod options;
mod view_window;
mod world;

use std::error::Error;
use std::process::ExitCode;

use tracing_subscriber::filter::LevelFilter;
use winit::event_loop::EventLoop;

use engine::Engine;
use options::Options;

fn main() -> ExitCode {
    let options: Options = drawloom_output::parse_arguments();
    // What Drawloom and wgpu warn of.
    tracing_subscriber::fmt()
        .with_ansi(false)
        .with_max_level(LevelFilter::WARN)
        .with_writer(drawloom_output::diagnostics)
        .init();
    drawloom_output::exit_code(run(options))
}

fn run(options: Options) -> Result<(), Box<dyn Error>> {
    let event_loop = EventLoop::new().map_err(|error| {
        format!(
            "no window can be opened here: {error}\n\
             Without a display, a virtual one does: xvfb-run cargo run --release -p window"
        )
    })?;
    let mut engine = Engine::new(options)?;
    event_loop.run_app(&mut engine)?;
    engine.finish()
}
