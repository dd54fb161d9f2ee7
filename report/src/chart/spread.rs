//! The spread of numbers: each number as a dot, the middle half as a box, the median as a line.

use super::{
    range, sheet,
    style::{GRID, INK, TEXT, font, px, width},
    tick,
};
use crate::statistics::{median, number, quantile};
use plotters::{prelude::*, style::text_anchor::HPos};

/// The numbers of one name.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SpreadRow {
    /// The label left of the dots.
    pub(crate) name: String,
    /// The colour of the dots.
    pub(crate) colour: RGBColor,
    /// The numbers.
    pub(crate) values: Vec<f64>,
}

/// A chart of spreads, one row below the other.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Spread {
    /// The heading above the chart.
    pub(crate) title: String,
    /// The measured quantity, with its unit.
    pub(crate) label: String,
    /// The rows, from top to bottom.
    pub(crate) rows: Vec<SpreadRow>,
}

/// Height of a row, in shown pixels.
const ROW: u32 = 34;
/// Width of the area with the dots, in shown pixels.
const CHART: u32 = 520;

impl Spread {
    /// Draws the chart.
    ///
    /// # Errors
    /// If the drawing library fails.
    pub(crate) fn svg(&self) -> anyhow::Result<String> {
        let names = self.rows.iter().map(|row| width(&row.name)).max().unwrap_or(0) + 12;
        let high = 100 + ROW * u32::try_from(self.rows.len())?;
        sheet(&self.title, (u32::try_from(names)? + CHART, high), |root| {
            let (low, top) = range(self.rows.iter().flat_map(|row| row.values.iter().copied()), false);
            let mut builder = ChartBuilder::on(root);
            builder.caption(&self.title, font(TEXT + 2.0, HPos::Left)).margin(px(10)).x_label_area_size(px(46));
            builder.y_label_area_size(px(names));
            let rows = number(self.rows.len().max(1));
            let mut chart = builder.build_cartesian_2d(low..top, 0.0..rows)?;
            chart
                .configure_mesh()
                .disable_y_mesh()
                .y_labels(0)
                .light_line_style(TRANSPARENT)
                .bold_line_style(GRID.stroke_width(px(1).unsigned_abs()))
                .axis_style(INK.stroke_width(px(1).unsigned_abs()))
                .x_labels(7)
                .x_desc(&self.label)
                .x_label_formatter(&|x| tick(*x))
                .label_style(font(TEXT - 1.0, HPos::Center))
                .axis_desc_style(font(TEXT, HPos::Center))
                .draw()?;
            for (i, row) in self.rows.iter().enumerate() {
                let middle = rows - number(i) - 0.5;
                let place = |x: f64| chart.backend_coord(&(x, middle));
                let y = place(low).1;
                root.draw(&Text::new(row.name.clone(), (px(names + 4), y), font(TEXT, HPos::Right)))?;
                draw_row(root, row, place)?;
            }
            Ok(())
        })
    }
}

fn draw_row(root: &super::Area<'_>, row: &SpreadRow, place: impl Fn(f64) -> (i32, i32)) -> anyhow::Result<()> {
    let half = px(10);
    if let (Some(low), Some(high)) = (quantile(&row.values, 0.25), quantile(&row.values, 0.75)) {
        let ((left, y), (right, _)) = (place(low), place(high));
        root.draw(&Rectangle::new([(left, y - half), (right, y + half)], row.colour.mix(0.2).filled()))?;
    }
    for (i, value) in row.values.iter().enumerate().filter(|(_, value)| value.is_finite()) {
        let (x, y) = place(*value);
        // Dots are shifted by a fixed pattern so that they do not cover each other.
        let aside = px(i32::try_from(i % 5)? * 3 - 6);
        root.draw(&Circle::new((x, y + aside), px(3), row.colour.mix(0.75).filled()))?;
    }
    if let Some(middle) = median(&row.values) {
        let (x, y) = place(middle);
        let line = INK.stroke_width(px(2).unsigned_abs());
        root.draw(&PathElement::new(vec![(x, y - half - px(2)), (x, y + half + px(2))], line))?;
    }
    Ok(())
}
