//! From linear pixels to the working space: spatial filter, then CIELAB, then LAB2000HL.

use super::colour::{Matrix, RGB_TO_XYZ, WHITEN, inverse, product, transform_row, working_row};
use super::dispatch::Lanes;
use super::planes::Planes;
use super::region::Region;
use super::row_math::RowMath;
use super::scielab::{Scielab, XYZ_TO_OPPONENT};
use super::spans::Spans;
use super::{Lab2000hl, MetricError, icam};
use std::ops::Range;

/// The spatial filter that removes detail invisible to the viewer, before colours are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SpatialFilter {
    /// S-CIELAB's sums of Gaussians, the default of CID.
    #[default]
    Scielab,
    /// iCAM's contrast sensitivity in YCC-RIT by Fourier transform, the default of iCID. The transform uses the
    /// platform's sines, so the last bits of a score may differ between platforms. A fit does not use this filter.
    Icam,
    /// No filter.
    None,
}

/// The steps from linear pixels to the working space, with all data that do not depend on the image.
#[derive(Debug, Clone)]
pub(super) struct Pipeline<R> {
    filter: Filter<R>,
    /// Linear Rec. 709 to the space of the filter.
    before: Matrix<R>,
    /// The space of the filter to XYZ relative to the white.
    after: Matrix<R>,
    space: Lab2000hl,
    lanes: Lanes,
}

#[derive(Debug, Clone)]
enum Filter<R> {
    Scielab(Scielab<R>),
    Icam { cycles_per_degree: f64 },
    None,
}

/// Smallest and largest cycles per degree.
const CYCLES_PER_DEGREE: (f64, f64) = (1.0, 500.0);

impl<R: RowMath> Pipeline<R> {
    /// # Errors
    /// [`MetricError::CyclesPerDegree`] outside [1, 500].
    pub(super) fn new(
        filter: SpatialFilter,
        cycles_per_degree: f64,
        space: Lab2000hl,
        lanes: Lanes,
    ) -> Result<Self, MetricError> {
        if !(CYCLES_PER_DEGREE.0..=CYCLES_PER_DEGREE.1).contains(&cycles_per_degree) {
            return Err(MetricError::CyclesPerDegree { range: CYCLES_PER_DEGREE, found: cycles_per_degree });
        }
        let in_space = |from_xyz: &Matrix| (product(from_xyz, &RGB_TO_XYZ), product(&WHITEN, &inverse(from_xyz)));
        let (filter, (before, after)) = match filter {
            SpatialFilter::Scielab => {
                (Filter::Scielab(Scielab::new(2.0 * cycles_per_degree)), in_space(&XYZ_TO_OPPONENT))
            }
            SpatialFilter::Icam => (Filter::Icam { cycles_per_degree }, in_space(&icam::XYZ_TO_YCC)),
            SpatialFilter::None => (Filter::None, (*RGB_TO_XYZ, WHITEN)),
        };
        let [before, after] = [before, after].map(|matrix| matrix.map(|row| row.map(R::of)));
        Ok(Self { filter, before, after, space, lanes })
    }

    /// The distance in pixels within which a pixel affects the result; `None` if unlimited.
    pub(super) fn reach(&self) -> Option<usize> {
        match &self.filter {
            Filter::Scielab(filter) => Some(filter.reach()),
            Filter::Icam { .. } => None,
            Filter::None => Some(0),
        }
    }

    /// The working space over a region of an image that is 0 outside the region. `fill` writes row `y` of the region,
    /// linear Rec. 709 in [0, 1].
    pub(super) fn convert(&self, region: &Region, fill: impl Fn(usize, [&mut [R]; 3]) + Sync + Send) -> Planes<R, 4> {
        let mut buffer = Planes::new(region.width, region.height);
        let mut working = Planes::new(region.width, region.height);
        let spans = Spans::whole(region);
        let fill = |y: usize, _: Range<usize>, rgb: [&mut [R]; 3]| fill(y, rgb);
        self.run((region, &spans), fill, (&mut buffer, &mut working), |_, _, row, out| {
            for (out, row) in out.into_iter().zip(row) {
                out.copy_from_slice(row);
            }
        });
        working
    }

    /// Calls `each` with the filtered span of every row of the working space of [`Pipeline::convert`] and the same span of `out`, in
    /// parallel. `fill` writes the object's span of a row; `buffer`, of the size of the region, is 0 elsewhere. iCAM's filter needs whole spans and a
    /// new buffer.
    pub(super) fn run<const N: usize>(
        &self,
        (region, spans): (&Region, &Spans),
        fill: impl Fn(usize, Range<usize>, [&mut [R]; 3]) + Sync + Send,
        (buffer, out): (&mut Planes<R, 3>, &mut Planes<R, N>),
        each: impl Fn(usize, Range<usize>, [&[R]; 4], [&mut [R]; N]) + Sync + Send,
    ) {
        buffer.fill_rows(
            || (),
            |(), y, rows| {
                let span = spans.object(y);
                self.lanes.run(
                    #[inline(always)]
                    || {
                        let [r, g, b] = rows.map(|row| &mut row[span.clone()]);
                        fill(y, span, [&mut *r, &mut *g, &mut *b]);
                        transform_row(&self.before, [r, g, b]);
                    },
                );
            },
        );
        if let Filter::Icam { cycles_per_degree } = self.filter {
            icam::filter(buffer, cycles_per_degree);
        }
        let planes = &*buffer;
        let stride = planes.stride();
        let row = || vec![R::ZERO; stride];
        let scratch = || {
            let filter = match &self.filter {
                Filter::Scielab(filter) => Some((filter, filter.scratch(region))),
                _ => None,
            };
            (filter, [row(), row(), row()], [row(), row(), row(), row()])
        };
        out.fill_rows(scratch, |(filter, filtered, working), y, out| {
            let span = spans.filtered(y);
            self.lanes.run(
                #[inline(always)]
                || {
                    let [x, y_row, z] = filtered.each_mut().map(|row| &mut row[..]);
                    match filter {
                        Some((filter, scratch)) => {
                            filter.filter_row(planes, y, spans, scratch, [&mut *x, &mut *y_row, &mut *z])
                        }
                        None => {
                            let from = planes.row(y);
                            x.copy_from_slice(from[0]);
                            y_row.copy_from_slice(from[1]);
                            z.copy_from_slice(from[2]);
                        }
                    }
                    let [x, y_row, z] = [x, y_row, z].map(|row| &mut row[span.clone()]);
                    transform_row(&self.after, [&mut *x, &mut *y_row, &mut *z]);
                    working_row(&self.space, [x, y_row, z], working.each_mut().map(|row| &mut row[span.clone()]));
                    let out = out.map(|row| &mut row[span.clone()]);
                    each(y, span.clone(), working.each_ref().map(|row| &row[span.clone()]), out);
                },
            );
        });
    }
}
