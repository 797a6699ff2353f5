//! What the command line says.

use clap::Parser;
use clap::builder::{PathBufValueParser, TypedValueParser};
use drawloom_output::PictureFile;

/// An engine's loop in a window. W, A, S, D, Q, E and Shift fly, a drag looks around, F1 shows the inspector, F11 is
/// full screen, V switches vertical synchronisation, N opens another window, Escape closes one.
#[derive(Debug, Parser)]
pub struct Options {
    /// How many cubes move.
    #[arg(long, default_value_t = 1_000, value_name = "N", value_parser = clap::value_parser!(u32).range(..=1_000_000))]
    pub objects: u32,
    /// How many windows open.
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=8))]
    pub windows: u8,
    /// Width and height of a window, in logical pixels.
    #[arg(long, default_value = "960x540", value_name = "WIDTHxHEIGHT", value_parser = parse_size)]
    pub size: [u32; 2],
    /// Draws as fast as possible, instead of once for each refresh of the display.
    #[arg(long)]
    pub no_vsync: bool,
    /// Ends after this number of frames, of a 60th of a second each.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub frames: Option<u64>,
    /// Writes the first window's last picture.
    #[arg(long, value_name = "FILE.png", requires = "frames", conflicts_with = "inspector", value_parser = PathBufValueParser::new().try_map(PictureFile::new))]
    pub screenshot: Option<PictureFile>,
    /// Shows the inspector over the first window: where the time of frames goes, and what each setting costs.
    #[arg(long)]
    pub inspector: bool,

    /// The world does not move.
    #[arg(long)]
    pub still: bool,
    /// Draws into a texture and converts it, as for a surface whose formats the renderer does not draw into.
    #[arg(long)]
    pub convert: bool,
}

fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let (width, height) = text.split_once('x').ok_or("a size is, for example, 960x540")?;
    let side = |side: &str| match side.parse() {
        Ok(pixels @ 1..=16_384) => Ok(pixels),
        _ => Err(format!("{side:?} is not a number of pixels from 1 to 16384")),
    };
    Ok([side(width)?, side(height)?])
}
