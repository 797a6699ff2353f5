//! The contact sheet: a view that is composed of other views' pictures.

use drawloom::backend::Picture;
use drawloom::process::{
    ClearColor, CpuShader, Declare, Draws, Format, FullScreen, FullScreenCpuShader, FullScreenPixel, PassInputs,
    RenderProcess, Target, targets,
};
use drawloom::raster::{Real, Vector, Vector4};
use drawloom::scene::{Light, ViewKind};
use font8x8::UnicodeFonts;

use crate::gallery::{self, Gallery};
use crate::{impostor, mirror_ball, smoke};

/// The sheet's view, and its target.
pub const TARGET: &str = "sheet";

/// The height of a label, in pixels.
const LABEL: u32 = 22;
const COLUMNS: u32 = 3;
const ROWS: u32 = 5;

/// The height of a cell: its content, and its label.
pub const CELL_HEIGHT: u32 = gallery::SIZE[1] + LABEL;

/// The pixels of the sheet.
pub const SIZE: [u32; 2] = [COLUMNS * gallery::SIZE[0], ROWS * CELL_HEIGHT];

/// What is in a cell of the sheet.
#[derive(Clone, Copy, PartialEq)]
enum Cell {
    /// A target of a view.
    Picture(ViewKind, &'static str, Target),
    /// The shadow maps of a light, three to a row.
    ShadowMaps(ShadowedLight),
    /// The mean of the tiles of a camera.
    Tiles(&'static str),
    /// The faces of a cube map, in two rows of three.
    Cube(&'static str),
}

/// A light whose shadow maps are on the sheet.
#[derive(Clone, Copy, PartialEq)]
enum ShadowedLight {
    /// The first that shines into a half space.
    Hemispherical,
    /// The first directional one.
    Sun,
    /// The first that shines in all directions.
    Lamp,
}

impl ShadowedLight {
    /// What the names of its maps' views end with.
    fn maps(self) -> &'static [&'static str] {
        match self {
            Self::Hemispherical => &[""],
            Self::Sun => &[", cascade 1", ", cascade 2", ", cascade 3"],
            Self::Lamp => &[", +X", ", -X", ", +Y", ", -Y", ", +Z", ", -Z"],
        }
    }

    /// The width of a map on the sheet.
    fn side(self) -> u32 {
        let [width, height] = gallery::SIZE;
        match self {
            Self::Hemispherical => height,
            Self::Sun => width / 3,
            Self::Lamp => height / 2,
        }
    }

    /// The name of the views of its maps, without their ends.
    fn name(self, lights: &[Light]) -> String {
        let is_wanted = |light: &Light| match light {
            Light::Hemispherical { .. } => self == Self::Hemispherical,
            Light::Directional { .. } => self == Self::Sun,
            Light::Point { .. } => self == Self::Lamp,
            _ => false,
        };
        let index = lights.iter().position(|light| light.casts_shadow() && is_wanted(light));
        format!("shadow of light {}", index.unwrap_or(0))
    }

    /// How bright a depth is on the sheet, the nearer the brighter. `shadow_map` in `contact_sheet.wgsl` is the same.
    fn brightness<R: Real>(self, depth: R) -> R {
        match self {
            // Depth is linear, and most of what it sees is close to it compared with its range.
            Self::Hemispherical => depth * depth * depth * depth,
            // Depth is linear, and reaches far towards the light.
            Self::Sun => (depth * R::of(6.0)).min(R::one()),
            // The near plane is at 1e-5 of the range.
            Self::Lamp => (R::one() - R::of(1e-5) / depth.max(R::of(1e-9))).max(R::zero()),
        }
    }
}

/// The cells, row by row, and their labels.
const CELLS: [(Cell, &str); 15] = [
    (Cell::Picture(ViewKind::Main, "main", targets::PICTURE), "main: pool, portals, screen, ball, tree, smoke"),
    (Cell::Picture(ViewKind::Main, "guest", targets::PICTURE), "guest: a second player"),
    (Cell::Picture(ViewKind::Main, "plan", targets::PICTURE), "plan: from above, without perspective"),
    (Cell::Picture(ViewKind::Reflection, "main/pool", targets::PICTURE), "main/pool: mirrored, clipped at the water"),
    (Cell::Picture(ViewKind::Reflection, "main/portal", targets::PICTURE), "main/portal: from the exit's side"),
    (
        Cell::Picture(ViewKind::Reflection, "main/portal/portal", targets::PICTURE),
        "main/portal/portal: the portal in itself",
    ),
    (Cell::Picture(ViewKind::Reflection, "screen", targets::PICTURE), "screen: one camera for every viewer"),
    (Cell::Cube(mirror_ball::PROBE), "probe: the cube map of the ball"),
    (Cell::Picture(ViewKind::Reflection, impostor::VIEW, targets::PICTURE), "impostor: the tree, for its square"),
    (Cell::Picture(ViewKind::Main, "main", smoke::TARGET), "main: smoke, with a quarter of the pixels"),
    (Cell::Picture(ViewKind::Main, "detail", targets::PICTURE), "detail: one camera"),
    (Cell::Tiles("tiles"), "detail: the mean of 2 x 2 tiles"),
    (Cell::ShadowMaps(ShadowedLight::Hemispherical), "the shadow map of a ceiling light: a paraboloid"),
    (Cell::ShadowMaps(ShadowedLight::Sun), "the sun's shadow maps: three cascades"),
    (Cell::ShadowMaps(ShadowedLight::Lamp), "a lamp's shadow maps: the faces of a cube"),
];

/// Draws a row of the sheet: not every device lets a shader sample as many textures as there are cells.
#[derive(Clone)]
pub struct ContactSheetRow {
    row: usize,
    name: String,
    /// What the names of the views of the shadow maps begin with.
    shadow_maps: [String; 3],
    shader: String,
}

impl ContactSheetRow {
    pub fn all() -> impl Iterator<Item = Self> {
        let lights = Gallery::lights().unwrap_or_default();
        let lights =
            [ShadowedLight::Hemispherical, ShadowedLight::Sun, ShadowedLight::Lamp].map(|light| light.name(&lights));
        (0..ROWS as usize).map(move |row| Self {
            row,
            name: name_of(row),
            shadow_maps: lights.clone(),
            shader: shader(row),
        })
    }
}

fn name_of(row: usize) -> String {
    format!("contact sheet, row {row}")
}

impl Cell {
    /// How many textures it samples.
    fn texture_count(self) -> usize {
        match self {
            Self::ShadowMaps(light) => light.maps().len(),
            _ => 1,
        }
    }
}

/// The cells of a row.
fn cells_of(row: usize) -> impl Iterator<Item = Cell> {
    CELLS.into_iter().map(|(cell, _)| cell).skip(row * COLUMNS as usize).take(COLUMNS as usize)
}

impl RenderProcess for ContactSheetRow {
    fn name(&self) -> &str {
        &self.name
    }

    fn declare(&self, declare: &mut Declare) {
        declare.views(ViewKind::Post);
        for cell in cells_of(self.row) {
            match cell {
                Cell::Picture(kind, view, target) => declare.samples_view(kind, view, target),
                Cell::ShadowMaps(light) => {
                    for map in light.maps() {
                        let view = format!("{}{map}", self.shadow_maps[light as usize]);
                        declare.samples_view(ViewKind::Shadow, &view, targets::SHADOW_MAP);
                    }
                }
                Cell::Tiles(view) => {
                    declare.samples_view_layers(
                        ViewKind::Main,
                        view,
                        targets::PICTURE,
                        gallery::TILES * gallery::TILES,
                    );
                }
                Cell::Cube(view) => declare.samples_view_layers(ViewKind::Reflection, view, targets::PICTURE, 6),
            }
        }
        match self.row.checked_sub(1) {
            None => declare.clears_color(TARGET, Format::Rgba8Srgb, ClearColor::Value([0.0, 0.0, 0.0, 1.0])),
            Some(above) => {
                declare.draws_over(TARGET);
                declare.after(&name_of(above));
            }
        }
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen { shader: &self.shader, ..FullScreen::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(self.clone()))
    }
}

impl<R: Real> FullScreenCpuShader<R> for ContactSheetRow {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let [width, height] = gallery::SIZE.map(|side| side as usize);
        let [x, y] = pixel.coordinates;
        let (row, y) = (y / (height + LABEL as usize), y % (height + LABEL as usize));
        let (column, x) = (x / width, x % width);
        let Some(y) = y.checked_sub(LABEL as usize).filter(|_| row == self.row) else { return false };
        let Some(cell) = cells_of(row).nth(column) else { return false };
        let textures = &pass.sampled[cells_of(row).take(column).map(Cell::texture_count).sum()..];
        let shown = textures[0];
        let load = |[x, y]: [usize; 2], layer: usize| {
            let [width, height] = shown.size();
            shown.load([x.min(width - 1), y.min(height - 1)], layer)
        };
        // The number of the square in which a pixel is, three to a row, and where in the square, as pixels of a texture
        // of this size.
        let square = |side: usize, count: usize, pixels: usize| {
            let columns = count.min(3);
            let x = x.checked_sub((width - columns * side) / 2).filter(|x| *x < columns * side)?;
            let index = Some(x / side + y / side * 3).filter(|index| *index < count)?;
            Some((index, [x % side * pixels / side, y % side * pixels / side]))
        };
        // Stretched to the height of the cell.
        let fitted = |[x, y]: [usize; 2]| {
            let [shown_width, shown_height] = shown.size();
            let across = height * shown_width / shown_height;
            let x = x.checked_sub((width - across.min(width)) / 2).filter(|x| *x < across)?;
            Some([x * shown_height / height, y * shown_height / height])
        };
        let color = match cell {
            Cell::ShadowMaps(light) => {
                let [pixels, _] = shown.size();
                let found = square(light.side() as usize, light.maps().len(), pixels);
                let Some((map, [x, y])) = found else { return false };
                let last = textures[map].size()[0] - 1;
                let brightness = light.brightness(textures[map].load([x.min(last), y.min(last)], 0)[0]);
                Vector([brightness, brightness, brightness, R::one()])
            }
            Cell::Picture(..) => {
                let Some(at) = fitted([x, y]) else { return false };
                load(at, 0)
            }
            Cell::Tiles(_) => {
                // Two pixels of the tiles in each direction are one of the picture.
                let mut sum = Vector::zero();
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let (x, y) = (2 * x + dx, 2 * y + dy);
                    sum = sum + load([x % width, y % height], x / width + y / height * gallery::TILES as usize);
                }
                sum * R::of(0.25)
            }
            Cell::Cube(_) => {
                let Some((face, at)) = square(height / 2, 6, shown.size()[0]) else { return false };
                load(at, face)
            }
        };
        targets[0] = Vector([color[0], color[1], color[2], R::one()]);
        true
    }
}

/// The shader of a row, with the bindings of its cells and a case for each of them.
fn shader(row: usize) -> String {
    let (mut bindings, mut cases, mut binding) = (String::new(), String::new(), 1);
    let mut bind = |texture: &str| {
        bindings += &format!("@group(2) @binding({binding}) var shown_{binding}: {texture};\n");
        binding += 1;
        format!("shown_{}", binding - 1)
    };
    for (column, cell) in cells_of(row).enumerate() {
        let color = match cell {
            Cell::Picture(..) => format!("picture({}, at)", bind("texture_2d<f32>")),
            Cell::Tiles(_) => format!("tiles({}, at)", bind("texture_2d_array<f32>")),
            Cell::Cube(_) => format!("cube({}, at)", bind("texture_2d_array<f32>")),
            Cell::ShadowMaps(light) => {
                // Squares are apart, so all but one of them add nothing.
                let map = |map: usize| {
                    let (texture, count, side) = (bind("texture_depth_2d"), light.maps().len(), light.side());
                    format!("shadow_map({texture}, at, {map}, {count}, {side}, {})", light as usize)
                };
                (0..light.maps().len()).map(map).collect::<Vec<_>>().join(" + ")
            }
        };
        cases += &format!("        case {column}: {{ return {color}; }}\n");
    }
    let color_of = format!(
        "const ROW: i32 = {row};

fn color_of(column: i32, at: vec2<i32>) -> vec3<f32> {{
    switch column {{
{cases}        default: {{ return vec3<f32>(0.0); }}
    }}
}}
"
    );
    [&bindings, &color_of, include_str!("contact_sheet.wgsl")].concat()
}

/// Writes the labels above the pictures.
pub fn draw_labels(sheet: &mut Picture) {
    for (cell, (_, label)) in (0..).zip(CELLS) {
        let left = cell % COLUMNS * gallery::SIZE[0] + 6;
        let top = cell / COLUMNS * CELL_HEIGHT + 7;
        for (letter, character) in (0..).zip(label.chars()) {
            let rows = font8x8::BASIC_FONTS.get(character).unwrap_or_default();
            for (y, row) in (0..).zip(rows) {
                for x in (0..8).filter(|x| row >> x & 1 == 1) {
                    let pixel = ((top + y) * sheet.width + left + letter * 9 + x) as usize * 4;
                    if let Some(channels) = sheet.bytes.get_mut(pixel..pixel + 3) {
                        channels.fill(230);
                    }
                }
            }
        }
    }
}
