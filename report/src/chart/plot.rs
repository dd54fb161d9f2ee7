//! Points over two axes, joined or not: CSSIM over gamma, CSSIM over cost.

use super::{
    range, sheet,
    style::{GRID, INK, TEXT, font, legend, mark, px, width},
    tick,
};
use plotters::{
    coord::{
        cartesian::Cartesian2d,
        ranged1d::{Ranged, ValueFormatter},
        types::RangedCoordf64,
    },
    prelude::*,
    style::text_anchor::HPos,
};

/// An axis.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Axis {
    label: String,
    log: bool,
    from_zero: bool,
}

impl Axis {
    /// A linear axis; the label names the unit.
    pub(crate) fn linear(label: &str) -> Self {
        Self { label: label.to_owned(), log: false, from_zero: false }
    }

    /// A linear axis from zero.
    pub(crate) fn from_zero(label: &str) -> Self {
        Self { from_zero: true, ..Self::linear(label) }
    }

    /// A logarithmic axis; for `x` only.
    pub(crate) fn log(label: &str) -> Self {
        Self { log: true, ..Self::linear(label) }
    }
}

/// Points that belong together.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Series {
    /// The name in the legend.
    pub(crate) name: String,
    /// The colour of marks and line.
    pub(crate) colour: RGBColor,
    /// The points, in the order of the line.
    pub(crate) points: Vec<(f64, f64)>,
    /// Whether a line joins them.
    pub(crate) joined: bool,
    /// Whether the lowest point is circled.
    pub(crate) minimum: bool,
}

/// A chart over two axes, with its legend at the side.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Plot {
    /// The heading above the chart.
    pub(crate) title: String,
    /// The horizontal axis.
    pub(crate) x: Axis,
    /// The vertical axis.
    pub(crate) y: Axis,
    /// The shown series.
    pub(crate) series: Vec<Series>,
}

/// Size of the area with the axes, without the legend, in shown pixels.
const CHART: (u32, u32) = (560, 360);

impl Plot {
    /// Draws the chart.
    ///
    /// # Errors
    /// If the drawing library fails.
    pub(crate) fn svg(&self) -> anyhow::Result<String> {
        let names = self.series.iter().map(|series| width(&series.name)).max().unwrap_or(0);
        let beside = u32::try_from(names + 34)?;
        sheet(&self.title, (CHART.0 + beside, CHART.1), |root| {
            let (left, right) = root.split_horizontally(px(i32::try_from(CHART.0)?));
            let (y0, y1) = range(self.shown().map(|point| point.1), self.y.from_zero);
            let mut builder = ChartBuilder::on(&left);
            let title = font(TEXT + 2.0, HPos::Left);
            builder.caption(&self.title, title).margin(px(10)).x_label_area_size(px(46)).y_label_area_size(px(66));
            if self.x.log {
                let logs = self.shown().map(|point| point.0.log10());
                let (low, high) = range(logs, false);
                let x = (10.0_f64.powf(low)..10.0_f64.powf(high)).log_scale().with_key_points(decades(low, high));
                self.fill(root, builder.build_cartesian_2d(x, y0..y1)?)?;
            } else {
                let (low, high) = range(self.shown().map(|point| point.0), self.x.from_zero);
                self.fill(root, builder.build_cartesian_2d(low..high, y0..y1)?)?;
            }
            let entries: Vec<_> =
                self.series.iter().enumerate().map(|(i, series)| (series.name.as_str(), i, series.colour)).collect();
            legend(&right, (px(14), px(54)), &entries)
        })
    }

    /// The points that can be shown.
    fn shown(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.series.iter().flat_map(|series| self.finite(series))
    }

    fn finite<'a>(&'a self, series: &'a Series) -> impl Iterator<Item = (f64, f64)> + 'a {
        series.points.iter().copied().filter(|(x, y)| x.is_finite() && y.is_finite() && (*x > 0.0 || !self.x.log))
    }

    fn fill<X: Ranged<ValueType = f64> + ValueFormatter<f64>>(
        &self,
        root: &super::Area<'_>,
        mut chart: ChartContext<'_, SVGBackend<'_>, Cartesian2d<X, RangedCoordf64>>,
    ) -> anyhow::Result<()> {
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID.stroke_width(px(1).unsigned_abs()))
            .axis_style(INK.stroke_width(px(1).unsigned_abs()))
            .x_desc(&self.x.label)
            .y_desc(&self.y.label)
            .x_labels(if self.x.log { 6 } else { 10 })
            .y_labels(7)
            .x_label_formatter(&|x| tick(*x))
            .y_label_formatter(&|y| tick(*y))
            .label_style(font(TEXT - 1.0, HPos::Center))
            .axis_desc_style(font(TEXT, HPos::Center))
            .draw()?;
        for (shape, series) in self.series.iter().enumerate() {
            let places: Vec<(i32, i32)> = self.finite(series).map(|point| chart.backend_coord(&point)).collect();
            if series.joined {
                root.draw(&PathElement::new(places.clone(), series.colour.stroke_width(px(2).unsigned_abs())))?;
            }
            for place in &places {
                mark(root, *place, shape, series.colour)?;
            }
            let lowest = self.finite(series).min_by(|a, b| a.1.total_cmp(&b.1));
            if let Some(lowest) = lowest.filter(|_| series.minimum) {
                let ring = INK.stroke_width(px(2).unsigned_abs());
                root.draw(&Circle::new(chart.backend_coord(&lowest), px(9), ring))?;
            }
        }
        Ok(())
    }
}

/// Ticks of a logarithmic axis: powers of ten, or 1, 2 and 5 times each power if there are only a few.
fn decades(low: f64, high: f64) -> Vec<f64> {
    let steps: &[f64] = if high - low < 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let powers = (-12_i32..=12).flat_map(|power| steps.iter().map(move |step| step * 10.0_f64.powi(power)));
    powers.filter(|tick| (low..=high).contains(&tick.log10())).collect()
}
