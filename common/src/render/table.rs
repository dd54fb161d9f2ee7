//! A transport table: the basis integrals of a list of pixels on a grid of lobe widths, and the radiance computed from them.
//!
//! `B[p] = sum_t weight_t(parameters) * T_t[p](width)`: see [`crate::brdf`]. Values are stored in `f32`, sums are `f64` in a
//! fixed order.

use super::knots::Knots;
use crate::{
    brdf::{Model, lobe_terms, term_count},
    math::Rgb,
};

/// Basis integrals of one lobe.
#[derive(Debug, Clone, PartialEq)]
pub struct LobeTable {
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

/// Basis integrals of every lobe of a model for a list of pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct TransportTable {
    /// Number of pixels.
    pub pixels: usize,
    /// One table per lobe of the model, in its order.
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
        let same = |s: &&Self| {
            s.lobes.len() == first.lobes.len()
                && s.lobes.iter().zip(&first.lobes).all(|(a, b)| a.knots == b.knots && a.terms == b.terms)
        };
        if !shards.iter().all(same) {
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
            LobeTable { knots: lobe.knots, terms: lobe.terms, values }
        });
        Some(Self { pixels, lobes: lobes.collect() })
    }

    /// Planes of zeros, one value per pixel.
    #[must_use]
    pub fn planes(&self) -> Planes {
        std::array::from_fn(|_| vec![0.0; self.pixels])
    }

    /// Smallest and largest width of the model's main lobe, the first that has one.
    #[must_use]
    pub fn span(&self) -> Option<(f64, f64)> {
        self.lobes.iter().find_map(|l| l.knots.map(|k| k.span()))
    }

    /// Radiance of every pixel at a flat parameter vector of `model`, the model the table was made for.
    pub fn radiance(&self, model: &dyn Model, parameters: &[f64], out: &mut Planes) {
        let mut weights = vec![Rgb::ZERO; term_count(model)];
        model.weights(parameters, &mut weights);
        out.iter_mut().for_each(|plane| plane.fill(0.0));
        let mut first_term = 0;
        for (basis, table) in model.lobes().iter().zip(&self.lobes) {
            let (first, coefficients) = slice_weights(table, basis.width_at(parameters));
            for (channel, plane) in out.iter_mut().enumerate() {
                for (k, coefficient) in coefficients.iter().enumerate() {
                    for t in 0..table.terms {
                        let scale = coefficient * weights[first_term + t][channel];
                        self.add_scaled(table, first + k, t, channel, scale, plane);
                    }
                }
            }
            first_term += lobe_terms(basis.lobe);
        }
    }

    /// The basis integrals at a parameter vector: one set of planes per term. With `slope`, their derivatives with respect to
    /// the logarithm of the width (zero for lobes of fixed shape).
    pub fn terms(&self, model: &dyn Model, parameters: &[f64], slope: bool, out: &mut [Planes]) {
        let mut first_term = 0;
        for (basis, table) in model.lobes().iter().zip(&self.lobes) {
            let width = basis.width_at(parameters);
            let (first, coefficients) = if slope { slice_slopes(table, width) } else { slice_weights(table, width) };
            for t in 0..table.terms {
                for (channel, plane) in out[first_term + t].iter_mut().enumerate() {
                    plane.fill(0.0);
                    for (k, &coefficient) in coefficients.iter().enumerate() {
                        self.add_scaled(table, first + k, t, channel, coefficient, plane);
                    }
                }
            }
            first_term += lobe_terms(basis.lobe);
        }
    }

    fn add_scaled(&self, table: &LobeTable, slice: usize, term: usize, channel: usize, scale: f64, plane: &mut [f64]) {
        if scale == 0.0 {
            return;
        }
        let start = ((slice * table.terms + term) * 3 + channel) * self.pixels;
        let values = &table.values[start..][..self.pixels];
        plane.iter_mut().zip(values).for_each(|(sum, &value)| *sum += scale * f64::from(value));
    }
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
