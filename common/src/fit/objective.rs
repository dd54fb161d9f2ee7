//! Eq. 1 for one gamma as a function of the parameters, computed from the transport table of the pixel subset.

use super::direct::DirectPixels;
use crate::{
    brdf::{Model, Role, flat_len, term_count},
    math::Rgb,
    metric::cost::{Compression, cost},
    render::{
        subset::PixelSubset,
        table::{Planes, TransportTable},
    },
    search::{NormalEquations, least_squares::LeastSquaresProblem},
};

/// The function that stage one minimises.
#[derive(Debug)]
pub struct Objective<'a> {
    model: &'static dyn Model,
    table: &'a TransportTable,
    direct: Option<DirectPixels<'a>>,
    weights: &'a [f64],
    compression: Compression,
    /// The photo, compressed.
    reference: Planes,
    radiance: Planes,
    terms: Vec<Planes>,
    slopes: Vec<Planes>,
}

impl<'a> Objective<'a> {
    /// The objective of one gamma. `photo` holds the subset's pixels, linear Rec. 709, in its order.
    ///
    /// # Panics
    /// If table, subset and photo differ in their number of pixels.
    #[must_use]
    pub fn new(
        model: &'static dyn Model,
        table: &'a TransportTable,
        subset: &'a PixelSubset,
        photo: &[[f32; 3]],
        compression: Compression,
    ) -> Self {
        assert!(table.pixels == subset.pixels.len() && photo.len() == table.pixels, "table, subset and photo differ");
        let compress = |c: usize| photo.iter().map(|rgb| compression.apply(observed(rgb[c]))).collect();
        let planes = || (0..term_count(model)).map(|_| table.planes()).collect();
        Self {
            model,
            table,
            direct: None,
            weights: &subset.weights,
            compression,
            reference: std::array::from_fn(compress),
            radiance: table.planes(),
            terms: planes(),
            slopes: planes(),
        }
    }

    /// The same cost with pixels rendered by the direct integrator. Derivatives are still those of the table.
    ///
    /// # Panics
    /// If `direct` has another number of pixels.
    #[must_use]
    pub fn rendered_by(self, direct: DirectPixels<'a>) -> Self {
        assert_eq!(direct.pixels.len(), self.table.pixels, "table and direct integrator differ");
        Self { direct: Some(direct), ..self }
    }

    /// `C(A, B, gamma)` at a flat parameter vector.
    pub fn cost(&mut self, parameters: &[f64]) -> f64 {
        match &self.direct {
            None => self.table.radiance(self.model, parameters, &mut self.radiance),
            Some(direct) => direct.radiance(self.model, parameters, &mut self.radiance),
        }
        cost(&self.compression, self.weights, &self.reference, &self.radiance)
    }

    /// The rows of the linearised problem at a point, pixel by pixel and channel by channel: the pixel's index, the derivatives by
    /// the parameters, and the residual `sqrt(w) (B^(1/gamma) - A^(1/gamma))`; with
    /// `dB/dx = sum_t dweight_t/dx T_t + weight_t dT_t/dwidth dwidth/dx`.
    pub fn rows(&mut self, point: &[f64], add: &mut dyn FnMut(usize, &[f64], f64)) {
        self.table.radiance(self.model, point, &mut self.radiance);
        self.table.terms(self.model, point, false, &mut self.terms);
        self.table.terms(self.model, point, true, &mut self.slopes);
        let mut weights = vec![Rgb::ZERO; self.terms.len()];
        self.model.weights(point, &mut weights);
        // Per channel: (entry, term, derivative of the weight).
        let mut derivatives: [Vec<(usize, usize, f64)>; 3] = Default::default();
        self.model.weight_derivatives(point, &mut |term, channel, entry, value| {
            derivatives[channel].push((entry, term, value));
        });
        let widths = width_entries(self.model, point);
        let mut row = vec![0.0; point.len()];
        for p in 0..self.table.pixels {
            let scale = self.weights[p].sqrt();
            for (c, channel) in derivatives.iter().enumerate() {
                let (value, slope) = self.compression.apply_with_slope(self.radiance[c][p]);
                row.fill(0.0);
                for &(entry, term, derivative) in channel {
                    row[entry] += derivative * self.terms[term][c][p];
                }
                for &(entry, term, width, derivative) in &widths {
                    row[entry] += weights[term][c] * self.slopes[term][c][p] / width * derivative;
                }
                row.iter_mut().for_each(|x| *x *= scale * slope);
                add(p, &row, scale * (value - self.reference[c][p]));
            }
        }
    }
}

impl LeastSquaresProblem for Objective<'_> {
    fn dimension(&self) -> usize {
        flat_len(self.model.parameters())
    }

    fn cost(&mut self, point: &[f64]) -> f64 {
        Objective::cost(self, point)
    }

    fn linearise(&mut self, point: &[f64], normal: &mut NormalEquations) {
        self.rows(point, &mut |_, row, residual| normal.add_row(row, residual));
    }
}

/// A value of the photo as used in Eq. 1. A photo may have negative values, from colours outside the gamut of Rec. 709 or from noise
/// around black. At gamma = 3 the tangent below the knee is so steep (about 1e4 at a mean of 0.2) that one channel at -0.01 would
/// outweigh all other pixels, so the photo's negative values count as 0 (design section 1). Negative values of B keep their
/// order.
pub(super) fn observed(value: f32) -> f64 {
    f64::from(value).max(0.0)
}

/// For every term of a lobe that has a width: an entry that determines the width, the term, the width, and its derivative with respect
/// to the entry.
fn width_entries(model: &dyn Model, point: &[f64]) -> Vec<(usize, usize, f64, f64)> {
    let mut list = Vec::new();
    let mut first = 0;
    for basis in model.lobes() {
        let terms = crate::brdf::lobe_terms(basis.lobe);
        if let Some(width) = basis.width {
            width.derivatives(point, |entry, derivative| {
                list.extend((first..first + terms).map(|t| (entry, t, width.at(point), derivative)));
            });
        }
        first += terms;
    }
    list
}

/// The role of every entry of the flat parameter vector.
pub(super) fn flat_roles(model: &dyn Model) -> Vec<Role> {
    let parameters = model.parameters().iter();
    parameters.flat_map(|p| std::iter::repeat_n(p.role, p.channels.count())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        brdf::{MODELS, flat_bounds, lobe_terms},
        math::sampling::{key, uniform},
        render::{
            spans::{LobeKnots, Spans},
            table::LobeTable,
        },
        search::derivative::check_gradient,
    };

    /// A table of smooth random integrals.
    fn table(model: &dyn Model, pixels: usize) -> TransportTable {
        let lobes = Spans::whole(model).knots(6.0).into_iter().enumerate().map(|(l, LobeKnots { lobe, knots })| {
            let terms = lobe_terms(lobe);
            let slices = knots.map_or(1, |k| k.count());
            let mut values = Vec::new();
            for slice in 0..slices {
                for row in 0..terms * 3 * pixels {
                    let phase = uniform(key(&[l as u64, row as u64]));
                    values.push(crate::math::to_f32(0.5 + phase + 0.3 * (slice as f64 * 0.1 + 6.0 * phase).sin()));
                }
            }
            LobeTable { lobe: lobe.name().to_owned(), knots, terms, values }
        });
        TransportTable { pixels, lobes: lobes.collect() }
    }

    #[test]
    fn a_negative_channel_of_the_photo_counts_as_black() {
        let model = MODELS[0];
        let table = table(model, 2);
        let subset = PixelSubset { pixels: vec![[0, 0], [1, 0]], weights: vec![1.0; 2] };
        let cost = |red: f32| {
            let photo = [[red, 0.2, 0.7], [0.4, 0.3, 0.2]];
            Objective::new(model, &table, &subset, &photo, Compression::new(3.0, 0.2)).cost(&[0.2; 8])
        };
        assert_eq!(cost(-0.01).to_bits(), cost(0.0).to_bits());
        assert!(cost(0.0) < 10.0);
    }

    #[test]
    fn the_gradient_is_the_derivative_of_the_cost() {
        for model in MODELS {
            let pixels = 20;
            let table = table(*model, pixels);
            let subset =
                PixelSubset { pixels: vec![[0, 0]; pixels], weights: (0..pixels).map(|p| 0.5 + p as f64).collect() };
            let photo: Vec<[f32; 3]> = (0..pixels).map(|p| [0.1 * p as f32, 0.5, 0.9]).collect();
            let (lower, upper) = flat_bounds(model.parameters());
            for gamma in [1.0, 2.2, 3.0] {
                let compression = Compression::new(gamma, 0.5);
                let mut objective = Objective::new(*model, &table, &subset, &photo, compression);
                let point: Vec<f64> = lower.iter().zip(&upper).map(|(l, u)| l + 0.37 * (u - l)).collect();
                let steps: Vec<f64> = point.iter().map(|x| 1e-5 * x.max(1.0)).collect();
                let check = check_gradient(&mut objective, &point, &steps);
                // Central differences leave h^2 f''' and roundings of the cost over h.
                assert!(check.error < 1e-6, "{} gamma {gamma}: {check:?}", model.name());
            }
        }
    }
}
