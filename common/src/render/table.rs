//! A transport table: the basis integrals of a list of pixels on a grid of lobe widths, and the radiance computed from them.
//!
//! `B[p] = sum_t weight_t(parameters) * T_t[p](width)`: see [`crate::brdf`]. Values are stored in `f32`. Sums are `f64` in
//! stage one and `f32` for full images, in a fixed order.

use super::knots::Knots;
use crate::{
    brdf::{BasisLobe, Lobe, Model, lobe_terms, main_lobe, term_count},
    math::{Rgb, simd, to_f32},
};

/// Basis integrals of one lobe.
#[derive(Debug, Clone, PartialEq)]
pub struct LobeTable {
    /// Name of the lobe.
    pub lobe: String,
    /// Grid of widths; `None` for a lobe of fixed shape.
    pub knots: Option<Knots>,
    /// Number of terms into which the lobe splits.
    pub terms: usize,
    /// Shape `knot x term x channel x pixel`, linear Rec. 709 radiance per unit weight.
    pub values: Vec<f32>,
}

impl LobeTable {
    /// Number of width slices: 1 for a lobe of fixed shape.
    #[must_use]
    pub fn slices(&self) -> usize {
        self.knots.map_or(1, |k| k.count())
    }
}

/// Basis integrals of some lobes, each with another name, for a list of pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct TransportTable {
    /// Number of pixels.
    pub pixels: usize,
    /// One table per lobe.
    pub lobes: Vec<LobeTable>,
}

/// Radiance of the table's pixels, one plane per channel.
pub type Planes = [Vec<f64>; 3];

impl TransportTable {
    /// Joins the tables of consecutive pixel ranges.
    ///
    /// Returns `None` if there is no shard, or if the shards have different grids.
    #[must_use]
    pub fn concatenate(shards: &[&Self]) -> Option<Self> {
        let first = shards.first()?;
        if !shards.iter().all(|shard| shard.has_the_grids_of(first)) {
            return None;
        }
        let pixels = shards.iter().map(|s| s.pixels).sum();
        let lobes = first.lobes.iter().enumerate().map(|(l, lobe)| {
            let planes = lobe.slices() * lobe.terms * 3;
            let mut values = Vec::with_capacity(planes * pixels);
            for plane in 0..planes {
                for shard in shards {
                    values.extend_from_slice(&shard.lobes[l].values[plane * shard.pixels..][..shard.pixels]);
                }
            }
            LobeTable { lobe: lobe.lobe.clone(), knots: lobe.knots, terms: lobe.terms, values }
        });
        Some(Self { pixels, lobes: lobes.collect() })
    }

    /// Whether both have the same lobes with the same widths, as the shards of one table do.
    #[must_use]
    pub fn has_the_grids_of(&self, other: &Self) -> bool {
        let same = |(a, b): (&LobeTable, &LobeTable)| a.lobe == b.lobe && a.knots == b.knots && a.terms == b.terms;
        self.lobes.len() == other.lobes.len() && self.lobes.iter().zip(&other.lobes).all(same)
    }

    /// Planes of zeros, one value per pixel.
    #[must_use]
    pub fn planes(&self) -> Planes {
        std::array::from_fn(|_| vec![0.0; self.pixels])
    }

    /// The integrals of a lobe.
    #[must_use]
    pub fn lobe(&self, lobe: &dyn Lobe) -> Option<&LobeTable> {
        self.lobes.iter().find(|table| table.lobe == lobe.name())
    }

    /// Whether it has the integrals of all lobes of a model.
    #[must_use]
    pub fn is_of(&self, model: &dyn Model) -> bool {
        model.lobes().iter().all(|basis| {
            let fits = |t: &LobeTable| t.terms == lobe_terms(basis.lobe) && t.knots.is_some() == basis.width.is_some();
            self.lobe(basis.lobe).is_some_and(fits)
        })
    }

    /// The basis lobes of a model with their integrals, those of a model that [it is of](Self::is_of).
    fn of_model<'a>(&'a self, model: &'a dyn Model) -> impl Iterator<Item = (&'a BasisLobe, &'a LobeTable)> {
        model.lobes().iter().filter_map(|basis| Some((basis, self.lobe(basis.lobe)?)))
    }

    /// Smallest and largest width of the main lobe of a model.
    #[must_use]
    pub fn span(&self, model: &dyn Model) -> Option<(f64, f64)> {
        let (basis, _) = main_lobe(model)?;
        self.lobe(basis.lobe)?.knots.map(|knots| knots.span())
    }

    /// Radiance of every pixel at a flat parameter vector of a model that the table [is of](Self::is_of).
    pub fn radiance(&self, model: &dyn Model, parameters: &[f64], out: &mut Planes) {
        let mut weights = vec![Rgb::ZERO; term_count(model)];
        model.weights(parameters, &mut weights);
        let (mut layers, mut first_term) = (Vec::new(), 0);
        for (basis, table) in self.of_model(model) {
            let (first, coefficients) = slice_weights(table, basis.width_at(parameters));
            for (k, &coefficient) in coefficients.iter().enumerate() {
                for t in 0..table.terms {
                    let start = ((first + k) * table.terms + t) * 3 * self.pixels;
                    layers.push((&table.values[start..][..3 * self.pixels], weights[first_term + t] * coefficient));
                }
            }
            first_term += lobe_terms(basis.lobe);
        }
        for (channel, plane) in out.iter_mut().enumerate() {
            for (block, sums) in plane.chunks_mut(BLOCK).enumerate() {
                sums.fill(0.0);
                for &(layer, weight) in &layers {
                    add_scaled(&layer[channel * self.pixels + block * BLOCK..][..sums.len()], weight[channel], sums);
                }
            }
        }
    }

    /// The basis integrals at the widths of a parameter vector, `term x channel x pixel`, in single precision. Images of any weights are
    /// sums of these.
    #[must_use]
    pub fn terms_single(&self, model: &dyn Model, parameters: &[f64]) -> Vec<f32> {
        let mut out = vec![0.0; term_count(model) * 3 * self.pixels];
        let mut planes = out.chunks_exact_mut((3 * self.pixels).max(1));
        for (basis, table) in self.of_model(model) {
            let (first, coefficients) = slice_weights(table, basis.width_at(parameters));
            for (t, plane) in planes.by_ref().take(table.terms).enumerate() {
                let slice =
                    |k: usize| &table.values[((first + k) * table.terms + t) * 3 * self.pixels..][..plane.len()];
                let slices: Vec<(&[f32], f32)> =
                    coefficients.iter().enumerate().map(|(k, &c)| (slice(k), to_f32(c))).collect();
                sum_of(&slices, plane);
            }
        }
        out
    }

    /// Radiance of every pixel from [`Self::terms_single`] and the weights of the terms.
    #[must_use]
    pub fn radiance_single(&self, terms: &[f32], weights: &[Rgb]) -> [Vec<f32>; 3] {
        std::array::from_fn(|channel| {
            let plane = |t: usize| &terms[(3 * t + channel) * self.pixels..][..self.pixels];
            let scaled: Vec<(&[f32], f32)> =
                weights.iter().enumerate().map(|(t, weight)| (plane(t), to_f32(weight[channel]))).collect();
            let mut sums = vec![0.0; self.pixels];
            sum_of(&scaled, &mut sums);
            sums
        })
    }

    /// The basis integrals at a parameter vector: one set of planes per term. With `slope`, their derivatives with respect to
    /// the logarithm of the width (zero for lobes of fixed shape).
    pub fn terms(&self, model: &dyn Model, parameters: &[f64], slope: bool, out: &mut [Planes]) {
        let mut first_term = 0;
        for (basis, table) in self.of_model(model) {
            let width = basis.width_at(parameters);
            let (first, coefficients) = if slope { slice_slopes(table, width) } else { slice_weights(table, width) };
            for t in 0..table.terms {
                for (channel, plane) in out[first_term + t].iter_mut().enumerate() {
                    plane.fill(0.0);
                    for (k, &coefficient) in coefficients.iter().enumerate() {
                        let start = (((first + k) * table.terms + t) * 3 + channel) * self.pixels;
                        add_scaled(&table.values[start..][..self.pixels], coefficient, plane);
                    }
                }
            }
            first_term += lobe_terms(basis.lobe);
        }
    }
}

/// Pixels whose sums stay in the first-level cache while all layers are added.
const BLOCK: usize = 1024;

/// Sets `sums` to the sum of the scaled slices, added in their order. Every slice is as long as `sums`.
fn sum_of(scaled: &[(&[f32], f32)], sums: &mut [f32]) {
    for (block, sums) in sums.chunks_mut(BLOCK).enumerate() {
        simd::dispatch(
            #[inline(always)]
            || {
                sums.fill(0.0);
                for &(values, scale) in scaled {
                    let values = &values[block * BLOCK..][..sums.len()];
                    for i in 0..sums.len() {
                        sums[i] += scale * values[i];
                    }
                }
            },
        );
    }
}

fn add_scaled(values: &[f32], scale: f64, sums: &mut [f64]) {
    if scale == 0.0 {
        return;
    }
    simd::dispatch(
        #[inline(always)]
        || {
            let n = sums.len().min(values.len());
            let (sums, values) = (&mut sums[..n], &values[..n]);
            for i in 0..n {
                sums[i] += scale * f64::from(values[i]);
            }
        },
    );
}

fn slice_weights(table: &LobeTable, width: Option<f64>) -> (usize, Vec<f64>) {
    match (table.knots, width) {
        (Some(knots), Some(width)) => {
            let s = knots.stencil(width);
            (s.first, s.value.to_vec())
        }
        _ => (0, vec![1.0]),
    }
}

fn slice_slopes(table: &LobeTable, width: Option<f64>) -> (usize, Vec<f64>) {
    match (table.knots, width) {
        (Some(knots), Some(width)) => {
            let s = knots.stencil(width);
            (s.first, s.slope.to_vec())
        }
        _ => (0, vec![0.0; 1]),
    }
}
