//! The contact sheet: a view that is composed of other views' pictures.

use drawloom::backend::Picture;
use drawloom::demo;
use drawloom::process::{
    ClearColor, CpuShader, Declare, Draws, Format, FullScreen, FullScreenCpuShader, FullScreenPixel, PassInputs,
    RenderProcess, ShadowCasters,
};
use drawloom::raster::{Real, Vector, Vector4};
use drawloom::scene::ViewKind;
use font8x8::UnicodeFonts;

use crate::gallery::{self, Gallery};

/// The sheet's view, and its target.
pub const TARGET: &str = "sheet";

/// The height of a label, in pixels.
const LABEL: u32 = 22;
const COLUMNS: u32 = 3;
const ROWS: u32 = 3;

/// The pixels of the sheet.
pub const SIZE: [u32; 2] = [COLUMNS * gallery::SIZE[0], ROWS * (gallery::SIZE[1] + LABEL)];

/// The pictures in the cells, row by row, and their labels. The seventh is a shadow map; the last is the mean of tiles.
const CELLS: [(ViewKind, &str, &str); 8] = [
    (ViewKind::Main, "main", "main: pool, portals and a screen"),
    (ViewKind::Main, "guest", "guest: a second player"),
    (ViewKind::Reflection, "main/pool", "main/pool: mirrored, clipped at the water"),
    (ViewKind::Reflection, "main/portal", "main/portal: from the exit's side"),
    (ViewKind::Reflection, "main/portal/portal", "main/portal/portal: the portal in itself"),
    (ViewKind::Reflection, "screen", "screen: one camera for every viewer"),
    (ViewKind::Shadow, "", "a light's shadow map"),
    (ViewKind::Main, "detail", "detail: one camera"),
];
const LABEL_OF_TILES: &str = "detail: the mean of 2 x 2 tiles";

/// Draws the sheet.
#[derive(Clone)]
pub struct ContactSheet {
    shadow_map: String,
}

impl ContactSheet {
    pub fn new() -> Self {
        let lights = demo::colonnade().map(|scene| scene.lights).unwrap_or_default();
        let light = Gallery::light_of_shadow_map(&lights).unwrap_or(0);
        Self { shadow_map: format!("shadow of light {light}") }
    }
}

impl RenderProcess for ContactSheet {
    fn name(&self) -> &str {
        "contact sheet"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.views(ViewKind::Post);
        for (kind, view, _) in CELLS {
            match kind {
                ViewKind::Shadow => declare.samples_view(kind, &self.shadow_map, ShadowCasters::TARGET),
                _ => declare.samples_view(kind, view, "picture"),
            }
        }
        for tile in 0..gallery::TILES * gallery::TILES {
            let name = format!("detail, tile {} {}", tile % gallery::TILES, tile / gallery::TILES);
            declare.samples_view(ViewKind::Main, &name, "picture");
        }
        declare.clears_color(TARGET, Format::Rgba8Srgb, ClearColor::Value([0.0, 0.0, 0.0, 1.0]));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen { shader: include_str!("contact_sheet.wgsl"), ..FullScreen::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(self.clone()))
    }
}

impl<R: Real> FullScreenCpuShader<R> for ContactSheet {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let [width, height] = gallery::SIZE.map(|side| side as usize);
        let [x, y] = pixel.coordinates;
        let (cell, x, y) = (x / width + y / (height + LABEL as usize) * 3, x % width, y % (height + LABEL as usize));
        let Some(y) = y.checked_sub(LABEL as usize) else { return false };
        let load = |texture: usize, x: usize, y: usize| {
            let [width, height] = pass.sampled[texture].size();
            pass.sampled[texture].load([x.min(width - 1), y.min(height - 1)], 0)
        };
        let color = match CELLS.get(cell) {
            Some((ViewKind::Shadow, ..)) => {
                let [side, _] = pass.sampled[cell].size();
                let Some(x) = x.checked_sub((width - height) / 2).filter(|x| *x < height) else { return false };
                let depth = load(cell, x * side / height, y * side / height)[0];
                // Most of what a lamp sees is close to it compared with its range.
                let depth = depth * depth * depth * depth;
                Vector([depth, depth, depth, R::one()])
            }
            Some(_) => load(cell, x, y),
            None => {
                // Two pixels of the tiles in each direction are one of the picture.
                let mut sum = Vector::zero();
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let (x, y) = (2 * x + dx, 2 * y + dy);
                    let tile = CELLS.len() + x / width + y / height * 2;
                    sum = sum + load(tile, x % width, y % height);
                }
                sum * R::of(0.25)
            }
        };
        targets[0] = Vector([color[0], color[1], color[2], R::one()]);
        true
    }
}

/// Writes the labels above the pictures.
pub fn draw_labels(sheet: &mut Picture) {
    let labels = CELLS.iter().map(|(.., label)| *label).chain([LABEL_OF_TILES]);
    for (cell, label) in (0..).zip(labels) {
        let left = cell % COLUMNS * gallery::SIZE[0] + 6;
        let top = cell / COLUMNS * (gallery::SIZE[1] + LABEL) + 7;
        for (letter, character) in (0..).zip(label.chars()) {
            let rows = font8x8::BASIC_FONTS.get(character).unwrap_or_default();
            for (y, row) in (0..).zip(rows) {
                for x in (0..8).filter(|x| row >> x & 1 == 1) {
                    let pixel = ((top + y) * sheet.width + left + letter * 9 + x) as usize * 4;
                    if let Some(channels) = sheet.bytes.get_mut(pixel..pixel + 4) {
                        channels.fill(230);
                    }
                }
            }
        }
    }
}
