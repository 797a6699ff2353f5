//! The chart of the flight, as SVG: frame times above, bytes below.

use std::error::Error;
use std::fmt::Write;

use drawloom_output::OutputFile;

use crate::report::Recorder;

const WIDTH: f64 = 960.0;
const LEFT: f64 = 70.0;
const RIGHT: f64 = 24.0;
const PANEL: f64 = 190.0;
/// Columns of the frame times: what falls into one is drawn as a bar from the shortest to the longest.
const COLUMNS: usize = 430;

/// Writes the chart.
///
/// # Errors
/// If the file cannot be written.
pub fn write(recorder: &Recorder, file: &OutputFile) -> Result<(), Box<dyn Error>> {
    Ok(file.write_all(svg(recorder)?)?)
}

fn svg(recorder: &Recorder) -> Result<String, std::fmt::Error> {
    let samples = &recorder.samples;
    let end = samples.last().map_or(1.0, |sample| sample.time).max(1e-3);
    let milliseconds: Vec<_> = samples.iter().map(|sample| (sample.time, sample.frame.as_secs_f64() * 1e3)).collect();
    let median = median(milliseconds.iter().map(|(_, value)| *value).collect());
    let longest = milliseconds.iter().map(|(_, value)| *value).fold(0.0, f64::max);
    let megabytes = |bytes: u64| bytes as f64 / 1e6;
    let budget = megabytes(recorder.budget.mesh_bytes + recorder.budget.texture_bytes);
    let resident: Vec<_> =
        samples.iter().map(|sample| (sample.time, megabytes(sample.streaming.resident_bytes()))).collect();
    let (made, uploaded) = samples
        .last()
        .map_or((0.0, 0.0), |last| (megabytes(last.made_bytes), megabytes(last.streaming.uploaded_bytes)));

    let mut svg = String::new();
    let height = 2.0 * PANEL + 190.0;
    writeln!(
        svg,
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" font-family="sans-serif" font-size="13">"#
    )?;
    writeln!(svg, r##"<rect width="100%" height="100%" fill="#fff"/>"##)?;
    text(
        &mut svg,
        (LEFT, 30.0),
        ("start", 17),
        &format!("{made:.0} MB of land through {budget:.0} MB, in {end:.0} s"),
    )?;

    let times = Panel { top: 70.0, end, most: (longest * 1.1).max(median * 2.4) };
    let title = format!("Frame time, ms. Median {median:.1}, longest {longest:.1}: {:.2} medians", longest / median);
    times.frame(&mut svg, &title)?;
    times.level(&mut svg, median, "median", "#888")?;
    times.level(&mut svg, median * 2.0, "2 × median", "#c33")?;
    times.bars(&mut svg, &milliseconds, "#2a6fb0")?;

    let bytes = Panel { top: 70.0 + PANEL + 70.0, end, most: budget * 1.2 };
    bytes.frame(&mut svg, &format!("Meshes and textures on the device, MB. {uploaded:.0} MB uploaded"))?;
    bytes.level(&mut svg, budget, "budget", "#c33")?;
    bytes.area(&mut svg, &resident, "#5b9a4f")?;
    text(&mut svg, (WIDTH / 2.0, height - 14.0), ("middle", 13), "seconds")?;
    svg.push_str("</svg>\n");
    Ok(svg)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(1.0)
}

fn text(svg: &mut String, (x, y): (f64, f64), (anchor, size): (&str, u32), content: &str) -> std::fmt::Result {
    writeln!(
        svg,
        r##"<text x="{x:.1}" y="{y:.1}" text-anchor="{anchor}" font-size="{size}" fill="#222">{content}</text>"##
    )
}

/// A part of the chart: time to the right, up to `end` seconds, and a value upwards, from 0 to `most`.
struct Panel {
    top: f64,
    end: f64,
    most: f64,
}

impl Panel {
    fn x(&self, time: f64) -> f64 {
        LEFT + time / self.end * (WIDTH - LEFT - RIGHT)
    }

    fn y(&self, value: f64) -> f64 {
        self.top + PANEL * (1.0 - (value / self.most).min(1.0))
    }

    /// Axes, ticks and a title.
    fn frame(&self, svg: &mut String, title: &str) -> std::fmt::Result {
        text(svg, (LEFT, self.top - 10.0), ("start", 13), title)?;
        let step = tick_step(self.most, 5.0);
        let mut value = 0.0;
        while value <= self.most {
            let y = self.y(value);
            writeln!(
                svg,
                r##"<line x1="{LEFT}" x2="{:.1}" y1="{y:.1}" y2="{y:.1}" stroke="#e3e3e3"/>"##,
                WIDTH - RIGHT
            )?;
            text(svg, (LEFT - 8.0, y + 4.0), ("end", 12), &format!("{value}"))?;
            value += step;
        }
        let (step, mut time) = (tick_step(self.end, 8.0), 0.0);
        while time <= self.end {
            text(svg, (self.x(time), self.top + PANEL + 18.0), ("middle", 12), &format!("{time}"))?;
            time += step;
        }
        Ok(())
    }

    /// A horizontal line with a name.
    fn level(&self, svg: &mut String, value: f64, name: &str, color: &str) -> std::fmt::Result {
        let (y, right) = (self.y(value), WIDTH - RIGHT);
        writeln!(
            svg,
            r#"<line x1="{LEFT}" x2="{right}" y1="{y:.1}" y2="{y:.1}" stroke="{color}" stroke-dasharray="5 4"/>"#
        )?;
        text(svg, (right, y - 5.0), ("end", 12), name)
    }

    /// The range of the values in each column.
    fn bars(&self, svg: &mut String, points: &[(f64, f64)], color: &str) -> std::fmt::Result {
        let mut columns = vec![None; COLUMNS];
        for &(time, value) in points {
            let column = ((time / self.end * COLUMNS as f64) as usize).min(COLUMNS - 1);
            let (low, high) = columns[column].unwrap_or((value, value));
            columns[column] = Some((value.min(low), value.max(high)));
        }
        write!(svg, r#"<path stroke="{color}" stroke-width="2" stroke-linecap="round" d=""#)?;
        for (column, range) in columns.iter().enumerate() {
            let Some((low, high)) = range else { continue };
            let x = self.x((column as f64 + 0.5) / COLUMNS as f64 * self.end);
            write!(svg, "M{x:.1} {:.1}V{:.1}", self.y(*low) + 0.5, self.y(*high))?;
        }
        writeln!(svg, r#""/>"#)
    }

    /// The area below the values.
    fn area(&self, svg: &mut String, points: &[(f64, f64)], color: &str) -> std::fmt::Result {
        let Some((first, _)) = points.first() else { return Ok(()) };
        write!(
            svg,
            r#"<path fill="{color}" fill-opacity="0.35" stroke="{color}" d="M{:.1} {:.1}"#,
            self.x(*first),
            self.y(0.0)
        )?;
        for (time, value) in points.iter().step_by((points.len() / (2 * COLUMNS)).max(1)) {
            write!(svg, "L{:.1} {:.1}", self.x(*time), self.y(*value))?;
        }
        writeln!(svg, r#"V{:.1}Z"/>"#, self.y(0.0))
    }
}

/// A round step of which at most `count` fit into `most`.
fn tick_step(most: f64, count: f64) -> f64 {
    let least = most / count;
    let power = 10.0_f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power).into_iter().find(|step| *step >= least).unwrap_or(power * 10.0)
}
