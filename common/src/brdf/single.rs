//! The loop of [`Lobe::accumulate`](super::Lobe::accumulate) in single precision, for lobes that are as accurate in it.

use super::{
    Split,
    lights::{BLOCK, Lights},
};
use crate::math::{simd, to_f32};

/// A lobe in single precision.
pub(super) trait SingleLobe: Sync {
    /// Numbers that depend on the width and the viewer only.
    type Width: Copy + Default;

    /// These numbers for a width and `n . v`.
    fn width(width: f64, cos_o: f64) -> Self::Width;

    /// [`Lobe::kernel`](super::Lobe::kernel), from `n . l`, `sin^2(th)`, `du` and `du2`. Mark it `#[inline(always)]`.
    fn kernel(width: Self::Width, cos_i: f32, sin2_h: f32, du: f32, du2: f32) -> f32;
}

/// Adds the basis integrals of a lobe: see [`Lobe::accumulate`](super::Lobe::accumulate).
pub(super) fn accumulate<L: SingleLobe>(
    split: Split,
    lights: &Lights,
    cos_o: f64,
    share: f64,
    widths: &[f64],
    sums: &mut [f64],
) {
    for (chunk, some) in widths.chunks(WIDTHS).enumerate() {
        let mut of_widths = [L::Width::default(); WIDTHS];
        some.iter().zip(&mut of_widths).for_each(|(&width, of_width)| *of_width = L::width(width, cos_o));
        let mut totals = [[[0.0; BLOCK]; ROWS]; WIDTHS];
        let of_widths = &of_widths[..some.len()];
        simd::dispatch(Accumulate::<L> { split, lights, widths: of_widths, totals: &mut totals });
        for (w, totals) in totals[..some.len()].iter().enumerate() {
            let rows = if split == Split::Whole { 3 } else { ROWS };
            for (row, lanes) in totals[..rows].iter().enumerate() {
                let total: f64 = lanes.iter().map(|x| f64::from(*x)).sum();
                sums[row * widths.len() + chunk * WIDTHS + w] += share * total;
            }
        }
    }
}

/// Widths handled in one pass.
const WIDTHS: usize = 8;

/// Channels of two terms.
const ROWS: usize = 6;

/// Blocks of lights outside, widths inside. A sum runs over every [`BLOCK`]th light, so its bits are the same at all SIMD levels.
struct Accumulate<'a, L: SingleLobe> {
    split: Split,
    lights: &'a Lights,
    widths: &'a [L::Width],
    totals: &'a mut [[[f32; BLOCK]; ROWS]; WIDTHS],
}

impl<L: SingleLobe> pulp::NullaryFnOnce for Accumulate<'_, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Lights { energy: [red, green, blue], cos_i, sin2_h, cos_d, du, du2, .. } = self.lights;
        let blocks = cos_i.as_chunks::<BLOCK>().0.iter().zip(sin2_h.as_chunks::<BLOCK>().0);
        let blocks = blocks.zip(du.as_chunks::<BLOCK>().0.iter().zip(du2.as_chunks::<BLOCK>().0));
        let energies = red.as_chunks::<BLOCK>().0.iter().zip(green.as_chunks::<BLOCK>().0);
        let energies = energies.zip(blue.as_chunks::<BLOCK>().0.iter().zip(cos_d.as_chunks::<BLOCK>().0));
        for (((cos_i, sin2_h), (du, du2)), ((red, green), (blue, cos_d))) in blocks.zip(energies) {
            let mut weights = [*red, *green, *blue, [0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]];
            if self.split == Split::Schlick {
                for k in 0..BLOCK {
                    let x = (1.0 - cos_d[k]).max(0.0);
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
                    value[k] = L::kernel(width, cos_i[k], sin2_h[k], du[k], du2[k]);
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

/// Numbers in single precision.
pub(super) fn single<const N: usize>(numbers: [f64; N]) -> [f32; N] {
    numbers.map(to_f32)
}
