//! From linear pixels to the working space: spatial filter, then CIELAB, then LAB2000HL.

use super::colour::{Matrix, RGB_TO_XYZ, WHITEN, inverse, product, transform_row, working_row};
use super::dispatch::Lanes;
use super::planes::Planes;
use super::region::Region;
use super::scielab::{Scielab, XYZ_TO_OPPONENT};
use super::{Lab2000hl, MetricError, icam};

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
pub(super) struct Pipeline {
    filter: Filter,
    /// Linear Rec. 709 to the space of the filter.
    before: Matrix,
    /// The space of the filter to XYZ relative to the white.
    after: Matrix,
    space: Lab2000hl,
    lanes: Lanes,
}

#[derive(Debug, Clone)]
enum Filter {
    Scielab(Scielab),
    Icam { cycles_per_degree: f64 },
    None,
}

/// Smallest and largest cycles per degree.
const CYCLES_PER_DEGREE: (f64, f64) = (1.0, 500.0);

impl Pipeline {
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
    /// linear Rec. 709 in [0, 1], to rows that are padded with zeros.
    pub(super) fn convert(&self, region: &Region, fill: impl Fn(usize, [&mut [f64]; 3]) + Sync + Send) -> Planes<4> {
        let mut planes = Planes::<3>::new(region.width, region.height);
        planes.fill_rows(
            || (),
            |(), y, [r, g, b]| {
                self.lanes.run(
                    #[inline(always)]
                    || {
                        fill(y, [&mut *r, &mut *g, &mut *b]);
                        transform_row(&self.before, [r, g, b]);
                    },
                );
            },
        );
        if let Filter::Icam { cycles_per_degree } = self.filter {
            icam::filter(&mut planes, cycles_per_degree);
        }
        self.finish(region, &planes)
    }

    fn finish(&self, region: &Region, planes: &Planes<3>) -> Planes<4> {
        let mut working = Planes::new(region.width, region.height);
        let stride = working.stride();
        let scratch = || {
            let filter = match &self.filter {
                Filter::Scielab(filter) => Some((filter, filter.scratch(region))),
                _ => None,
            };
            (filter, [vec![0.0; stride], vec![0.0; stride], vec![0.0; stride]])
        };
        working.fill_rows(scratch, |(filter, rows), y, out| {
            self.lanes.run(
                #[inline(always)]
                || {
                    let [x, y_row, z] = rows.each_mut().map(|row| &mut row[..]);
                    match filter {
                        Some((filter, scratch)) => {
                            filter.filter_row(planes, y, scratch, [&mut *x, &mut *y_row, &mut *z])
                        }
                        None => {
                            let from = planes.row(y);
                            x.copy_from_slice(from[0]);
                            y_row.copy_from_slice(from[1]);
                            z.copy_from_slice(from[2]);
                        }
                    }
                    transform_row(&self.after, [&mut *x, &mut *y_row, &mut *z]);
                    working_row(&self.space, [x, y_row, z], out);
                },
            );
        });
        working
    }
}
