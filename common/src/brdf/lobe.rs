//! One basis lobe, and the loop that integrates it for many widths at once.

use super::{Angles, Lights, Spread};
use crate::math::simd;
use std::fmt::Debug;

/// How a lobe's integral splits into basis integrals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Split {
    /// One term.
    Whole,
    /// Two terms: the lobe times `(1 - F5)` and the lobe times `F5` (Schlick's Fresnel term is linear in `f0`).
    Schlick,
}

/// How fast a lobe's distribution falls with the angle of the half vector, `u = sin^2(th)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tail {
    /// No slower than GGX: as `1/u^2`.
    Short,
    /// As `1/u`: a generalised Trowbridge-Reitz distribution of exponent 1 (Burley 2012, section B.2.1).
    Long,
}

/// A lobe `f(wi, wo) cos(theta_i)` without Fresnel term, of a given width.
pub trait Lobe: Debug + Sync {
    /// The name in messages and table headers.
    fn name(&self) -> &'static str;

    /// How its integral splits.
    fn split(&self) -> Split;

    /// The GGX alpha of a lobe about as wide, for importance sampling and adaptive quadrature; `None` for a lobe as wide as the
    /// hemisphere.
    fn equivalent_alpha(&self, width: f64) -> Option<f64>;

    /// How many times more the lobe varies than GGX or the cosine of the same width. The quadrature divides its tolerance by it.
    fn care(&self) -> f64 {
        1.0
    }

    /// How its distribution falls, for adaptive quadrature.
    fn tail(&self) -> Tail {
        Tail::Short
    }

    /// For a lobe as wide as the hemisphere, a bound of the second derivative of `f cos(theta_i)` by the light's cosine, in units of
    /// `1/pi`. Where it is not 0, the quadrature is refined up to the horizon.
    fn bend(&self) -> f64 {
        0.0
    }

    /// The turn of the normal, in radians, within which a lobe of this width varies little.
    fn footprint(&self, width: f64) -> f64 {
        width
    }

    /// The limits against which tests check the lobe.
    fn expected(&self) -> Expected {
        Expected::default()
    }

    /// `f cos(theta_i)` in 1/sr, without Fresnel term, averaged over the spread of the light to second order; zero for light from below
    /// the horizon. Mark it `#[inline(always)]`, or the loop over the widths is not vectorised.
    fn kernel(&self, angles: &Angles, spread: &Spread, width: f64) -> f64;

    /// [`Self::kernel`] of light without spread.
    fn eval(&self, angles: &Angles, width: f64) -> f64 {
        self.kernel(angles, &Spread::default(), width)
    }

    /// Adds the lobe's basis integrals over `lights`, for every width.
    ///
    /// `sums` has shape `term x channel x width` and grows by `share * sum over lights of energy * split_t * lobe(width)`.
    /// `cos_o` is the `n.v` of the surface point.
    fn accumulate(&self, lights: &Lights, cos_o: f64, share: f64, widths: &[f64], sums: &mut [f64]) {
        simd::dispatch(Accumulate { lobe: self, lights, cos_o, share, widths, sums });
    }
}

/// The limits against which tests check a lobe. The defaults suit a lobe of microfacets that conserves energy; other lobes state the
/// limits of their formula.
#[derive(Debug, Clone, Copy)]
pub struct Expected {
    /// Largest directional albedo without Fresnel term.
    pub most_albedo: f64,
    /// From width and viewer's cosine, for a width of at most 0.02 and a cosine of at least 0.5: the directional albedo of a mirror,
    /// and how far below it the lobe may stay.
    pub sharp_albedo: fn(f64, f64) -> (f64, f64),
    /// Whether `f` has a kink in the mirror direction, where `n.l = n.v`.
    pub is_kinked: bool,
    /// The lobe of the same model that this one only adjusts: the error of a table is a share of the sum of the two.
    pub adjusts: Option<&'static str>,
}

impl Default for Expected {
    fn default() -> Self {
        Self { most_albedo: 1.0, sharp_albedo: |_, _| (1.0, 0.01), is_kinked: false, adjusts: None }
    }
}

/// Widths handled in one pass; longer lists go through in chunks.
const LANES: usize = 8;

/// The loop of [`Lobe::accumulate`]: directions outside, widths inside, so that the widths fill SIMD lanes.
///
/// It runs under run-time dispatch. Every operation is a plain IEEE one without contraction and each sum runs over directions in
/// order, so all SIMD levels give the same bits.
struct Accumulate<'a, L: ?Sized> {
    lobe: &'a L,
    lights: &'a Lights,
    cos_o: f64,
    share: f64,
    widths: &'a [f64],
    sums: &'a mut [f64],
}

impl<L: Lobe + ?Sized> pulp::NullaryFnOnce for Accumulate<'_, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let (count, split) = (self.widths.len(), self.lobe.split());
        for first in (0..count).step_by(LANES) {
            let lanes = LANES.min(count - first);
            // Unused lanes repeat the last width; their sums are dropped.
            let widths: [f64; LANES] = std::array::from_fn(|k| self.widths[first + k.min(lanes - 1)]);
            let mut total = [[[0.0; LANES]; 3]; 2];
            for light in (0..self.lights.len()).filter(|&light| self.lights.cos_i[light] > 0.0) {
                let mut value = [0.0; LANES];
                let (angles, spread) = self.lights.at(light, self.cos_o);
                for (v, &width) in value.iter_mut().zip(&widths) {
                    *v = self.lobe.kernel(&angles, &spread, width);
                }
                let [red, green, blue] = &self.lights.energy;
                let energy = [red[light], green[light], blue[light]].map(f64::from);
                add(split, angles.f5(), energy, &value, &mut total);
            }
            let terms = if split == Split::Whole { 1 } else { 2 };
            for (row, lane_sums) in total[..terms].iter().flatten().enumerate() {
                let out = &mut self.sums[row * count + first..][..lanes];
                out.iter_mut().zip(lane_sums).for_each(|(s, t)| *s += self.share * t);
            }
        }
    }
}

#[inline(always)]
fn add(split: Split, f5: f64, energy: [f64; 3], value: &[f64; LANES], total: &mut [[[f64; LANES]; 3]; 2]) {
    let parts = match split {
        Split::Whole => [1.0, 0.0],
        Split::Schlick => [1.0 - f5, f5],
    };
    let terms = if split == Split::Whole { 1 } else { 2 };
    for (part, sums) in parts[..terms].iter().zip(total) {
        for (energy, sum) in energy.iter().zip(sums) {
            let weight = part * energy;
            sum.iter_mut().zip(value).for_each(|(s, v)| *s += weight * v);
        }
    }
}
