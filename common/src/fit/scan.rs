//! Starts for the least-squares search (design section 2).
//!
//! For every width of the main lobe's grid, and every scanned value of the parameters that multiply others, the remaining parameters
//! enter linearly. At gamma = 1 their best values solve a small bounded linear least-squares problem, one per channel if no scalar
//! couples the channels. Terms of fixed weight move to the right-hand side. A model in which one linear parameter multiplies another
//! provides coordinates in which it does not (`Model::scan_weights`).

use super::{
    objective::{flat_roles, observed},
    ranges::Ranges,
};
use crate::{
    brdf::{Channels, Model, Role, flat_len, lobe_terms, main_lobe, term_count},
    math::Rgb,
    render::table::{Planes, TransportTable},
    search::{NormalEquations, bvls},
};
use std::ops::Range;

/// All points of the scan, in the order of widths, then scanned values. Of several points that give the same material, such as points
/// that differ only in a lobe of zero weight, only the first is kept.
pub(super) fn scan(
    model: &dyn Model,
    ranges: &Ranges,
    table: &TransportTable,
    weights: &[f64],
    photo: &[[f32; 3]],
) -> Vec<Vec<f64>> {
    let (lower, upper) = ranges.bounds(model);
    let bounds = [&lower[..], &upper[..]];
    let grids = grids(model, bounds, table);
    let mut terms: Vec<Planes> = (0..term_count(model)).map(|_| table.planes()).collect();
    let mut points: Vec<Vec<f64>> = Vec::new();
    let mut index = vec![0; grids.len()];
    loop {
        let mut point = vec![0.0; flat_len(model.parameters())];
        for (&i, (entry, values)) in index.iter().zip(&grids) {
            point[*entry] = values[i];
        }
        table.terms(model, &point, false, &mut terms);
        if solve_linear(model, bounds, &terms, weights, photo, &mut point)
            && !points.iter().any(|known| same(model, known, &point))
        {
            points.push(point);
        }
        // Next combination of grid values; the last grid varies fastest.
        let Some(digit) = (0..grids.len()).rev().find(|&d| index[d] + 1 < grids[d].1.len()) else { return points };
        index[digit] += 1;
        index[digit + 1..].fill(0);
    }
}

/// Whether two points have the same weights, and the same widths of all lobes whose weight is not zero.
fn same(model: &dyn Model, a: &[f64], b: &[f64]) -> bool {
    const EQUAL: f64 = 1e-9;
    let weights = |point: &[f64]| {
        let mut weights = vec![Rgb::ZERO; term_count(model)];
        model.weights(point, &mut weights);
        weights
    };
    let (of_a, of_b) = (weights(a), weights(b));
    let mut first = 0;
    model.lobes().iter().all(|basis| {
        let terms = first..first + lobe_terms(basis.lobe);
        first = terms.end;
        let is_dark = of_a[terms.clone()].iter().all(|weight| *weight == Rgb::ZERO);
        (is_dark || basis.width_at(a) == basis.width_at(b))
            && terms.into_iter().all(|t| (of_a[t] - of_b[t]).abs().max_element() <= EQUAL)
    })
}

/// Entries of the flat vector that are scanned, with their values.
fn grids(model: &dyn Model, [lower, upper]: [&[f64]; 2], table: &TransportTable) -> Vec<(usize, Vec<f64>)> {
    let within = |entry: usize, values: &mut dyn Iterator<Item = f64>| {
        let mut values: Vec<f64> = values.map(|x| x.clamp(lower[entry], upper[entry])).collect();
        values.dedup();
        (entry, values)
    };
    let scanned = flat_roles(model).into_iter().enumerate().filter_map(|(entry, role)| match role {
        Role::Linear => None,
        Role::Scanned(values) => Some(within(entry, &mut values.iter().copied())),
        Role::Width => {
            let (basis, width) = main_lobe(model)?;
            // The outermost knots equal the model's bounds up to rounding.
            Some(within(entry, &mut table.lobe(basis.lobe)?.knots?.widths().into_iter().map(width.inverse)))
        }
    });
    scanned.collect()
}

/// Fills the linear entries of `point` with the bounded least-squares solution at gamma = 1; false if there is no solution.
fn solve_linear(
    model: &dyn Model,
    [lower, upper]: [&[f64]; 2],
    terms: &[Planes],
    weights: &[f64],
    photo: &[[f32; 3]],
    point: &mut [f64],
) -> bool {
    let fixed = weights_with(model, point, None);
    for (channels, entries) in systems(model) {
        let columns: Vec<Vec<Rgb>> = entries.iter().map(|&e| weights_with(model, point, Some(e))).collect();
        let mut normal = NormalEquations::new(entries.len());
        let mut row = vec![0.0; entries.len()];
        for (p, weight) in weights.iter().enumerate() {
            let scale = weight.sqrt();
            for channel in channels.clone() {
                let sum = |w: &dyn Fn(usize) -> f64| (0..terms.len()).map(|t| w(t) * terms[t][channel][p]).sum::<f64>();
                for (x, column) in row.iter_mut().zip(&columns) {
                    *x = scale * sum(&|t| column[t][channel] - fixed[t][channel]);
                }
                normal.add_row(&row, scale * (observed(photo[p][channel]) - sum(&|t| fixed[t][channel])));
            }
        }
        let bound = |b: &[f64]| entries.iter().map(|&e| b[e]).collect::<Vec<f64>>();
        let Ok(solution) = bvls::solve(&normal, &bound(lower), &bound(upper)) else { return false };
        entries.iter().zip(&solution.point).for_each(|(&e, &x)| point[e] = x);
    }
    model.parameters_of_scan(point);
    point.iter_mut().zip(lower.iter().zip(upper)).for_each(|(x, (l, u))| *x = x.clamp(*l, *u));
    true
}

/// The weights of the scan with one linear entry at 1 (or no entry), and all entries that are not solved yet at 0.
fn weights_with(model: &dyn Model, point: &[f64], entry: Option<usize>) -> Vec<Rgb> {
    let mut probe = point.to_vec();
    if let Some(entry) = entry {
        probe[entry] = 1.0;
    }
    let mut weights = vec![Rgb::ZERO; term_count(model)];
    model.scan_weights(&probe, &mut weights);
    weights
}

/// The least-squares problems: the channels of each, and the entries that it solves for. If all linear parameters are colours, the
/// channels are independent; a linear scalar couples them.
fn systems(model: &dyn Model) -> Vec<(Range<usize>, Vec<usize>)> {
    let (mut of_channel, mut scalars, mut first) = ([const { Vec::new() }; 3], Vec::new(), 0);
    for parameter in model.parameters() {
        match (parameter.role, parameter.channels) {
            (Role::Linear, Channels::Rgb) => (0..3).for_each(|c| of_channel[c].push(first + c)),
            (Role::Linear, Channels::Scalar) => scalars.push(first),
            _ => {}
        }
        first += parameter.channels.count();
    }
    if scalars.is_empty() {
        of_channel.into_iter().enumerate().map(|(c, entries)| (c..c + 1, entries)).collect()
    } else {
        vec![(0..3, [of_channel.concat(), scalars].concat())]
    }
}
