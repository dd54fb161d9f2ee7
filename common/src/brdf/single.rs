//! Formulas of lobes for either precision, and the loop of [`Lobe::accumulate`](super::Lobe::accumulate) in single precision.

use super::{
    Angles, Split, Spread,
    lights::{BLOCK, Lights},
};
use crate::math::{real::Real, simd, to_f32};
use std::marker::PhantomData;

/// Light at a surface point: angles and spread.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen<T> {
    pub(super) cos_i: T,
    pub(super) cos_o: T,
    pub(super) cos_h: T,
    pub(super) sin2_h: T,
    pub(super) cos_d: T,
    pub(super) du: T,
    pub(super) du2: T,
}

impl Seen<f64> {
    #[inline(always)]
    pub(super) fn new(g: &Angles, spread: &Spread) -> Self {
        let Angles { cos_i, cos_o, cos_h, sin2_h, cos_d } = *g;
        Self { cos_i, cos_o, cos_h, sin2_h, cos_d, du: spread.du, du2: spread.du2 }
    }
}

/// The formula of a lobe whose integrals have the same errors in single precision, which are those of the quadrature.
pub(super) trait Formula: Sync {
    /// [`Lobe::kernel`](super::Lobe::kernel). Mark it `#[inline(always)]`, or the loop over the lights is not vectorised.
    fn value<T: Real>(g: &Seen<T>, width: T) -> T;
}

/// The factor `1 + x` of a second-order correction, clamped to the range in which a second-order expansion holds.
#[inline(always)]
pub(super) fn second_order<T: Real>(x: T) -> T {
    (T::of(1.0) + x).clamped(0.25, 2.0)
}

/// The methods of a [`Lobe`](super::Lobe) that has a [`Formula`].
macro_rules! by_formula {
    () => {
        #[inline(always)]
        fn kernel(&self, g: &$crate::brdf::Angles, spread: &$crate::brdf::Spread, width: f64) -> f64 {
            <Self as $crate::brdf::single::Formula>::value(&$crate::brdf::single::Seen::new(g, spread), width)
        }

        fn accumulate(&self, lights: &$crate::brdf::Lights, cos_o: f64, share: f64, widths: &[f64], sums: &mut [f64]) {
            $crate::brdf::single::accumulate::<Self>(self.split(), lights, cos_o, share, widths, sums);
        }
    };
}

pub(super) use by_formula;

/// Adds the basis integrals of a lobe: see [`Lobe::accumulate`](super::Lobe::accumulate).
pub(super) fn accumulate<F: Formula>(
    split: Split,
    lights: &Lights,
    cos_o: f64,
    share: f64,
    widths: &[f64],
    sums: &mut [f64],
) {
    assert!(lights.len().is_multiple_of(BLOCK), "lists of lights are padded to whole blocks");
    let count = widths.len();
    let cos_o = to_f32(cos_o);
    for (chunk, some) in widths.chunks(WIDTHS).enumerate() {
        let mut totals = [[[0.0; BLOCK]; ROWS]; WIDTHS];
        let mut singles = [0.0; WIDTHS];
        some.iter().zip(&mut singles).for_each(|(width, single)| *single = to_f32(*width));
        let widths = &singles[..some.len()];
        let formula = PhantomData::<F>;
        simd::dispatch(Accumulate { formula, split, lights, cos_o, widths, totals: &mut totals });
        for (w, totals) in totals[..some.len()].iter().enumerate() {
            let rows = if split == Split::Whole { 3 } else { ROWS };
            for (row, lanes) in totals[..rows].iter().enumerate() {
                let total: f64 = lanes.iter().map(|x| f64::from(*x)).sum();
                sums[row * count + chunk * WIDTHS + w] += share * total;
            }
        }
    }
}

/// Widths handled in one pass.
const WIDTHS: usize = 8;

/// Channels of two terms.
const ROWS: usize = 6;

/// Blocks of lights outside, widths inside. A sum runs over every [`BLOCK`]th light, so its bits are the same at all SIMD levels.
struct Accumulate<'a, F: Formula> {
    formula: PhantomData<F>,
    split: Split,
    lights: &'a Lights,
    cos_o: f32,
    widths: &'a [f32],
    totals: &'a mut [[[f32; BLOCK]; ROWS]; WIDTHS],
}

impl<'a, F: Formula> pulp::NullaryFnOnce for Accumulate<'a, F> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Lights { energy, cos_i, cos_h, sin2_h, cos_d, du, du2 } = self.lights;
        let blocks = |list: &'a [f32]| list.as_chunks::<BLOCK>().0;
        let [red, green, blue] = energy.each_ref().map(|list| blocks(list));
        let (cos_i, cos_h, sin2_h) = (blocks(cos_i), blocks(cos_h), blocks(sin2_h));
        let (cos_d, du, du2) = (blocks(cos_d), blocks(du), blocks(du2));
        for block in 0..cos_i.len() {
            let mut weights = [red[block], green[block], blue[block], [0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]];
            if self.split == Split::Schlick {
                for k in 0..BLOCK {
                    let x = (1.0 - cos_d[block][k]).max(0.0);
                    let f5 = x * x * (x * x) * x;
                    for channel in 0..3 {
                        let energy = weights[channel][k];
                        weights[channel + 3][k] = f5 * energy;
                        weights[channel][k] = (1.0 - f5) * energy;
                    }
                }
            }
            for (&width, totals) in self.widths.iter().zip(self.totals.iter_mut()) {
                let mut value = [0.0; BLOCK];
                for k in 0..BLOCK {
                    let seen = Seen {
                        cos_i: cos_i[block][k],
                        cos_o: self.cos_o,
                        cos_h: cos_h[block][k],
                        sin2_h: sin2_h[block][k],
                        cos_d: cos_d[block][k],
                        du: du[block][k],
                        du2: du2[block][k],
                    };
                    value[k] = F::value(&seen, width);
                }
                for (total, weights) in totals.iter_mut().zip(&weights) {
                    for k in 0..BLOCK {
                        total[k] += weights[k] * value[k];
                    }
                }
            }
        }
    }
}
