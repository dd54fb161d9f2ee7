//! Charts as SVG: the same bytes for the same data.
//!
//! Plotters rounds positions to whole pixels, so a chart is drawn [`SCALE`] times as large as it is shown.

mod bars;
mod plot;
mod spread;
mod style;

pub(super) use bars::{Bars, Group};
pub(super) use plot::{Axis, Plot, Series};
pub(super) use spread::{Spread, SpreadRow};
pub(super) use style::{colour, method_colour};

use plotters::{coord::Shift, prelude::*};

/// The drawing area of a chart.
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Drawn pixels per shown pixel.
const SCALE: i32 = 4;

/// Draws on a white sheet of `width` x `height` shown pixels; `title` is for screen readers.
fn sheet(
    title: &str,
    (width, height): (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> anyhow::Result<()>,
) -> anyhow::Result<String> {
    let mut text = String::new();
    let scale = SCALE.unsigned_abs();
    {
        let root = SVGBackend::with_string(&mut text, (width * scale, height * scale)).into_drawing_area();
        root.fill(&WHITE)?;
        draw(&root)?;
        root.present()?;
    }
    let body = text.find("viewBox").and_then(|place| text[place..].find('>').map(|end| &text[place + end + 1..]));
    let (w, h) = (width * scale, height * scale);
    let title = escaped(title);
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {w} {h}\" role=\"img\">\n\
         <title>{title}</title>{}",
        body.unwrap_or_default()
    ))
}

/// Escapes text between tags.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// The range that shows all the numbers, with a margin; from zero if asked.
fn range(numbers: impl Iterator<Item = f64>, from_zero: bool) -> (f64, f64) {
    let numbers: Vec<f64> = numbers.collect();
    let Some((low, high)) = super::statistics::range(&numbers) else { return (0.0, 1.0) };
    let low = if from_zero { low.min(0.0) } else { low };
    let high = if from_zero { high.max(0.0) } else { high };
    let margin = if high > low { 0.06 * (high - low) } else { 0.5 * high.abs().max(0.01) };
    let below = if from_zero && low == 0.0 { 0.0 } else { margin };
    (low - below, high + margin)
}

/// A tick of an axis without trailing zeros.
fn tick(value: f64) -> String {
    let text = if value.abs() >= 1000.0 { format!("{value:.0}") } else { format!("{value:.4}") };
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}
