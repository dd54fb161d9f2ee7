//! What a table is integrated for, and how finely.

use crate::{
    brdf::{Lobe, lobe_terms},
    math::cell,
    render::{
        cut::Band,
        footprint::{self, Part},
        pyramid::LightPyramid,
    },
    scene::{Geometry, SurfacePoint},
};

/// A pixel: column and row.
pub type Pixel = [u32; 2];

/// How finely tables are integrated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Largest error of one node of a cut, in units of the map's mean radiance, for a lobe of unit weight and width 0.1 (for others see
    /// [`Cut::refine`](crate::render::cut::Cut::refine)). Interpolation between normals may have a fifth of it.
    pub tolerance: f64,
    /// Factor on the turn of the normal over a pixel up to which a given number of parts is used; 1 keeps the error below 2e-3 of the
    /// lobe's peak.
    pub footprint: f64,
}

impl Accuracy {
    /// Tables of stage one.
    pub const SUBSET: Self = Self { tolerance: 5e-4, footprint: 1.5 };
    /// Full-resolution tables of stage two and polish.
    pub const FULL: Self = Self { tolerance: 5e-3, footprint: 3.0 };
    /// Tables of the coarse picture, on which stage three finds the lobe to start from.
    pub const COARSE: Self = Self { tolerance: 3e-2, footprint: 10.0 };

    /// Positions in a pixel that the silhouette cuts.
    fn silhouette(&self) -> usize {
        cell((SILHOUETTE_POSITIONS as f64 / self.footprint).ceil(), SILHOUETTE_POSITIONS + 1).max(1)
    }
}

/// Positions in a pixel that the silhouette cuts, at a footprint of 1.
const SILHOUETTE_POSITIONS: usize = 32;

/// Glossy lobes change with the viewer's cosine, towards the rim as its inverse: their footprint is at most this share of it.
const RIM: f64 = 0.25;

/// Largest turn of the normal over a part, at a footprint of 1, as a share of the geometric mean of the turns over which the lobe and
/// `1/(n.v)` change by their own size. Both change at once, which the second-order mean over a part omits: in stage one, at twice this
/// share, `ks` and `f0` of a metal of `cook-torrance` moved by 2 of the standard deviations that noise of 0.2 % gives them.
const BOTH: f64 = 0.027;

/// Largest turn of the normal over a part, at a footprint of 1, as a share of the viewer's cosine, for a lobe of fixed shape. Such a lobe
/// may change with that cosine, and its value in the middle of a part stands for the mean.
const FIXED: f64 = 0.03;

/// A lobe at the widths of one band.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slice<'a> {
    pub(super) lobe: &'a dyn Lobe,
    pub(super) band: Band,
    pub(super) widths: &'a [f64],
}

impl Slice<'_> {
    /// Number of its basis integrals at one point: `term x channel x width`.
    pub(super) fn integrals(&self) -> usize {
        lobe_terms(self.lobe) * 3 * self.widths.len()
    }
}

/// Integrals of one slice, `place x term x channel x width`.
pub(super) type Integrals = Vec<f64>;

/// What a table is integrated for.
#[derive(Debug, Clone, Copy)]
pub(super) struct View<'a> {
    pub(super) accuracy: Accuracy,
    pub(super) geometry: &'a Geometry,
    pub(super) pyramid: &'a LightPyramid,
    pub(super) pixels: &'a [Pixel],
}

impl View<'_> {
    /// The parts of a pixel.
    pub(super) fn parts(&self, pixel: Pixel, Slice { lobe, band, .. }: Slice<'_>) -> Vec<Part> {
        let [c, r] = pixel.map(|x| x as usize);
        if self.geometry.coverage(c, r) < 1.0 {
            return footprint::on_object(self.accuracy.silhouette(), |x, y| self.surface(pixel, [x, y]).is_some());
        }
        let turns = self.geometry.normal_turns(c, r).map(|turn| turn / self.accuracy.footprint);
        let cos_o = self.surface(pixel, [0.5; 2]).map_or(1.0, |surface| surface.normal.dot(surface.view));
        let width = lobe.footprint(band.sharpest());
        if !matches!(band, Band::Glossy(..)) {
            return footprint::parts(turns, width, FIXED * cos_o);
        }
        // How far the normal turns while `1/(n.v)` grows by its own size.
        let turn_of_cosine = cos_o / (1.0 - cos_o * cos_o).max(0.0).sqrt();
        let most = BOTH * (width * turn_of_cosine).sqrt();
        footprint::parts(turns, width.min(RIM * cos_o), most)
    }

    /// The surface at a position in a pixel.
    pub(super) fn surface(&self, [column, row]: Pixel, [x, y]: [f64; 2]) -> Option<SurfacePoint> {
        self.geometry.point(f64::from(column) + x, f64::from(row) + y)
    }
}
