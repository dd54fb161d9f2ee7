//! Colours, fonts and marks of all charts.

use super::{Area, SCALE};
use crate::measured::Method;
use plotters::{
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};

/// Okabe and Ito's palette, which colour-blind readers can distinguish, without its yellow, which is too faint on white.
const PALETTE: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(60, 60, 60),
];

/// The colour of text and axes.
pub(super) const INK: RGBColor = RGBColor(34, 34, 34);
/// The colour of grid lines.
pub(super) const GRID: RGBColor = RGBColor(225, 225, 225);
/// Size of text, in shown pixels.
pub(super) const TEXT: f64 = 13.0;

/// The colour of the series of this number, for series without a fixed colour.
pub(crate) fn colour(index: usize) -> RGBColor {
    PALETTE[index % PALETTE.len()]
}

/// The colour of a method.
pub(crate) const fn method_colour(method: Method) -> RGBColor {
    PALETTE[match method {
        Method::OursPolished | Method::SubsetsPolished => 0,
        Method::Brute | Method::BruteDirect => 1,
        Method::LowRes | Method::Subsets => 2,
        Method::Paper => 3,
        Method::L2 => 4,
        Method::Ours | Method::Candidate => 5,
        Method::Log | Method::CubeRoot | Method::RunnerUp => 6,
    }]
}

/// Converts shown pixels to drawn ones.
pub(super) const fn px(shown: i32) -> i32 {
    shown * SCALE
}

/// Text of this size in shown pixels, anchored at its left end, middle or right end.
pub(super) fn font(shown: f64, horizontal: HPos) -> TextStyle<'static> {
    // The backend divides by 1.24, its ratio of line height to font size.
    let size = shown * f64::from(SCALE) * 1.24;
    ("sans-serif", size).into_font().color(&INK).pos(Pos::new(horizontal, VPos::Center))
}

/// Marks differ in shape as well as in colour.
pub(super) fn mark(area: &Area<'_>, place: (i32, i32), shape: usize, colour: RGBColor) -> anyhow::Result<()> {
    let (x, y) = place;
    let r = px(4);
    match shape % 4 {
        0 => area.draw(&Circle::new(place, r, colour.filled()))?,
        1 => area.draw(&Rectangle::new([(x - r, y - r), (x + r, y + r)], colour.filled()))?,
        2 => area.draw(&Polygon::new([(x - r, y + r), (x + r, y + r), (x, y - r)], colour.filled()))?,
        _ => area.draw(&Polygon::new([(x - r, y), (x, y + r), (x + r, y), (x, y - r)], colour.filled()))?,
    }
    Ok(())
}

/// Names and marks in a column whose left end is at `x`, from `y` down.
pub(super) fn legend(area: &Area<'_>, (x, y): (i32, i32), entries: &[(&str, usize, RGBColor)]) -> anyhow::Result<()> {
    let mut line = y;
    for (name, shape, colour) in entries {
        mark(area, (x, line), *shape, *colour)?;
        area.draw(&Text::new((*name).to_owned(), (x + px(12), line), font(TEXT, HPos::Left)))?;
        line += px(22);
    }
    Ok(())
}

/// Approximate width of a text in shown pixels; the backend has no fonts to measure it.
pub(super) fn width(text: &str) -> i32 {
    let letters = i32::try_from(text.chars().count()).unwrap_or(i32::MAX / 64);
    letters * 15 / 2 + 8
}
