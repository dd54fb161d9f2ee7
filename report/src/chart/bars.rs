//! Horizontal bars in groups, one group below the other, so that long names stay readable.

use super::{
    range, sheet,
    style::{GRID, INK, TEXT, font, legend, px, width},
    tick,
};
use crate::statistics::number;
use plotters::{prelude::*, style::text_anchor::HPos};

/// The bars of one name.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Group {
    /// The label left of the bars.
    pub(crate) name: String,
    /// One for each of the chart's kinds.
    pub(crate) bars: Vec<Option<f64>>,
}

/// A chart of bars from zero.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bars {
    /// The heading above the chart.
    pub(crate) title: String,
    /// The measured quantity, with its unit.
    pub(crate) label: String,
    /// Names and colours of the bars of each group.
    pub(crate) kinds: Vec<(String, RGBColor)>,
    /// The groups, from top to bottom.
    pub(crate) groups: Vec<Group>,
}

/// Height of a bar, in shown pixels.
const BAR: u32 = 11;
/// Gap between groups, in shown pixels.
const GAP: u32 = 12;
/// Width of the area with the bars, in shown pixels.
const CHART: u32 = 440;

impl Bars {
    /// Draws the chart.
    ///
    /// # Errors
    /// If the drawing library fails.
    pub(crate) fn svg(&self) -> anyhow::Result<String> {
        let names = self.groups.iter().map(|group| width(&group.name)).max().unwrap_or(0) + 12;
        let kinds = self.kinds.iter().map(|kind| width(&kind.0)).max().unwrap_or(0) + 34;
        let step = BAR * u32::try_from(self.kinds.len().max(1))? + GAP;
        let high = 100 + step * u32::try_from(self.groups.len())?.max(3);
        let left = u32::try_from(names)? + CHART;
        sheet(&self.title, (left + u32::try_from(kinds)?, high), |root| {
            let (chart, beside) = root.split_horizontally(px(i32::try_from(left)?));
            let (low, top) = range(self.groups.iter().flat_map(|group| group.bars.iter().flatten().copied()), true);
            let mut builder = ChartBuilder::on(&chart);
            builder.caption(&self.title, font(TEXT + 2.0, HPos::Left)).margin(px(10)).x_label_area_size(px(46));
            builder.y_label_area_size(px(names));
            let rows = number(self.groups.len().max(1));
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
            for (i, group) in self.groups.iter().enumerate() {
                // Groups go from top to bottom, but the axis goes up.
                let middle = chart.backend_coord(&(0.0, rows - number(i) - 0.5)).1;
                let label_end = px(names + 4);
                root.draw(&Text::new(group.name.clone(), (label_end, middle), font(TEXT, HPos::Right)))?;
                let bar = px(i32::try_from(BAR)?);
                let mut y = middle - bar * i32::try_from(self.kinds.len())? / 2;
                for (value, (_, colour)) in group.bars.iter().zip(&self.kinds) {
                    if let Some(value) = value.filter(|value| value.is_finite()) {
                        let (zero, end) = (chart.backend_coord(&(0.0, 0.0)).0, chart.backend_coord(&(value, 0.0)).0);
                        let corners = [(zero.min(end), y), (zero.max(end), y + bar - px(1))];
                        root.draw(&Rectangle::new(corners, colour.filled()))?;
                    }
                    y += bar;
                }
            }
            // Filled squares in the colour of the bars.
            let entries: Vec<_> = self.kinds.iter().map(|(name, colour)| (name.as_str(), 1, *colour)).collect();
            legend(&beside, (px(14), px(54)), &entries)
        })
    }
}
