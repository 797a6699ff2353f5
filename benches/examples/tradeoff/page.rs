//! A page with the charts and the pictures side by side.

use std::fmt::Write;
use std::path::Path;

use drawloom::backend::Picture;
use drawloom::view::ShadowMaps;
use drawloom_output::{OutputError, OutputFile, PictureFile, path_text, print_line};

use crate::Failure;
use crate::charts::file_name;
use crate::measure::Measurements;
use crate::results::{Entry, Results, short};

/// Writes the pictures of the path's last position, and `index.html`.
///
/// # Errors
/// Returns an error if a file cannot be written.
pub fn write(folder: &Path, results: &Results, measurements: &Measurements) -> Result<(), Failure> {
    let reference = measurements.reference.last().ok_or("the path has no position")?;
    save(&folder.join("reference.png"), reference)?;
    for (number, measured) in measurements.settings.iter().enumerate() {
        save(&folder.join(picture_name(number)), &measured.picture)?;
        save(&folder.join(difference_name(number)), &difference(&measured.picture, reference))?;
    }
    let path = folder.join("index.html");
    OutputFile::new(&path)?.write_all(html(results))?;
    print_line!("{} written", path_text(&path));
    Ok(())
}

fn picture_name(number: usize) -> String {
    format!("{number}.png")
}

fn difference_name(number: usize) -> String {
    format!("{number}-difference.png")
}

fn save(path: &Path, picture: &Picture) -> Result<(), OutputError> {
    PictureFile::new(path)?.write_opaque([picture.width, picture.height], &picture.bytes)
}

/// The difference of two pictures, magnified 16 times, around grey.
fn difference(picture: &Picture, reference: &Picture) -> Picture {
    let magnified = |(one, other): (&u8, &u8)| (128 + (i32::from(*one) - i32::from(*other)) * 16).clamp(0, 255) as u8;
    let bytes = picture.bytes.iter().zip(&reference.bytes).map(magnified).collect();
    Picture { bytes, ..picture.clone() }
}

fn html(results: &Results) -> String {
    let mut page = String::from(HEAD);
    let title = escaped(&format!("What accuracy costs: {} on {}", results.scene(), results.backend()));
    // Writing to a string does not fail.
    let _ = write!(
        page,
        "<title>{title}</title><h1>{title}</h1><p>Each knob alone, all else exact: <code>Quality::exact</code>, {cascades} cascades, \
         every view at its best, and no impostor. A knob is a field of <code>Quality</code>, unless another type is named. Hover over a \
         picture for how it differs from the reference in f64, sixteen times.</p><img class=chart src=\"front.svg\" alt=\"Pareto \
         front\">",
        cascades = ShadowMaps::MAX_CASCADES,
    );
    for knob in results.knobs() {
        let of_knob = |(_, entry): &(usize, &Entry)| entry.knob == knob.name();
        let own: Vec<_> = results.entries.iter().enumerate().filter(of_knob).collect();
        let _ = write!(
            page,
            "<h2>{name}</h2><img class=chart src=\"{file}\" alt=\"What {name} costs\"><div class=pictures>\
             <figure><img src=\"reference.png\" alt=\"reference\"><figcaption>reference, f64</figcaption></figure>",
            name = knob.name(),
            file = file_name(knob),
        );
        for (number, entry) in own {
            let _ = write!(
                page,
                "<figure{}><div class=turn><img src=\"{}\" alt=\"{setting}\"><img src=\"{}\" alt=\"its difference\"></div>\
                 <figcaption><b>{setting}</b> {:.2} ms, {}RMSE {:.3}/255</figcaption></figure>",
                if entry.exceeds() { " class=exceeded" } else { "" },
                picture_name(number),
                difference_name(number),
                entry.frame_ms(),
                error_text(entry),
                entry.rmse_from_reference * 255.0,
                setting = escaped(&entry.setting),
            );
        }
        page.push_str("</div>");
    }
    page
}

fn error_text(entry: &Entry) -> String {
    let bound = entry.bound.map_or_else(String::new, |bound| format!(" (at most {})", short(bound)));
    entry.error.map_or_else(String::new, |error| format!("{} {}{bound}, ", short(error), escaped(&entry.metric)))
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

const HEAD: &str =
    "<!doctype html><html lang=en><meta charset=utf-8><meta name=viewport content=\"width=device-width\"><style>
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 1240px; padding: 0 1rem }
.chart { width: 100%; max-width: 760px; display: block }
.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(290px, 1fr)); gap: 12px }
figure { margin: 0 } figure img { width: 100%; display: block }
figcaption { font-size: 13px; color: #444 }
.turn img + img { display: none } .turn:hover img { display: none } .turn:hover img + img { display: block }
.exceeded figcaption { color: #b00 }
</style>";
