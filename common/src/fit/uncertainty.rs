//! How well the photo determines the reported parameters (docs/design.md section 1): the range of each one over which another match would look about
//! as good.
//!
//! The range of a parameter holds the values for which CSSIM, at its minimum over all other parameters, stays within a share of the reached
//! score. That is a profile, as of a likelihood: the reached score is what the photo's noise and the error of the model leave, so it stands for the
//! variance of the residuals. The share ([`SHARE`]) is set so that the ranges of synthetic photos hold the truth in at least 95 of 100 cases
//! (docs/accuracy.md); there is no theory that gives it, because the windows of CSSIM overlap.
//!
//! The profile is that of a quadratic in the scaled parameters of polish: its Hessian is from differences of CSSIM over steps that raise it visibly,
//! then slope and curvature are measured along each eigenvector. It knows the bounds: near one, a range has one side.
//!
//! A parameter may have an effect only where another one is not zero, such as the width of a haze whose strength may be 0. Where the range
//! of a parameter reaches 0, the others are judged there too.
//!
//! Not included: errors of the light and of the geometry.

use super::{
    method::SearchKind,
    polish::{Judges, visible_bounds},
    ranges::Ranges,
    stage_one::{search_bounds, within_table},
    stage_two::{FullView, Renderer},
};
use crate::{
    brdf::Model,
    image::Image,
    metric::Score,
    search::{Bounds, NormalEquations, SearchError, bvls, eigen},
};
use std::{cell::RefCell, cmp::Ordering};

/// What the photo says of one entry of the flat parameter vector.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// The range is narrow.
    Determined,
    /// The value is at its lower or upper bound, and the range is narrow.
    AtBound,
    /// A large part of the parameter's range matches the photo equally well.
    Undetermined,
    /// The fit holds the parameter.
    Held,
}

/// The range of one entry of the flat parameter vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// The smallest value.
    pub low: f64,
    /// The largest value.
    pub high: f64,
    /// What the photo says of the entry.
    pub standing: Standing,
}

/// How well the photo determines the reported parameters.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Uncertainty {
    /// One entry per entry of the flat parameter vector.
    pub entries: Vec<Known>,
    /// Pairs of entries of which one can make up for the other.
    pub trades: Vec<(usize, usize)>,
}

/// Ranges hold the values for which CSSIM rises by at most this share of the reached score.
const SHARE: f64 = 0.002;

/// A lower score counts as this one: the error of tables may cost as much (design sections 5 and 6).
const LEAST: f64 = 4e-4;

/// Steps of the first differences raise CSSIM by about this much.
const RISE: f64 = 1e-4;

/// Steps that raise it by up to so many times less or more are kept.
const NEAR: f64 = 6.0;

/// Most trials to find a step.
const TRIALS: usize = 5;

/// The first step and the largest, as shares of the range.
const FIRST: f64 = 0.01;
const LARGEST: f64 = 0.1;

/// A parameter is undetermined if its range is above this share of its range in the model (of the logarithmic range for widths).
const LARGEST_SHARE: f64 = 0.5;

/// Entries trade if their correlation is beyond this, and each range is above a share of its value.
const TRADE: (f64, f64) = (0.9, 0.1);

/// CSSIM near the match.
struct Surroundings<'a> {
    view: &'a FullView<'a>,
    renderer: Renderer<'a>,
    /// The score of a picture; `None` if it cannot be scored.
    judge: &'a dyn Fn(&Image) -> Option<f64>,
    bounds: &'a Bounds,
    /// Where it can be rendered, in scaled parameters: the table may not have all widths.
    inside: &'a [(f64, f64)],
    /// Scores that are known: steps of different entries share their middle and ends.
    known: RefCell<Vec<(Vec<f64>, f64)>>,
}

impl Surroundings<'_> {
    /// CSSIM at scaled parameters.
    fn score(&self, scaled: &[f64]) -> Result<f64, SearchError> {
        if let Some((_, score)) = self.known.borrow().iter().find(|(known, _)| known == scaled) {
            return Ok(*score);
        }
        let point: Vec<f64> = scaled.iter().enumerate().map(|(i, &t)| self.bounds.to_natural(i, t)).collect();
        let score = (self.judge)(&self.renderer.render(&point));
        let score = score.ok_or(SearchError::NotFinite { what: "the CSSIM", point })?;
        self.known.borrow_mut().push((scaled.to_vec(), score));
        Ok(score)
    }

    fn moved(&self, from: &[f64], steps: &[(usize, f64)]) -> Result<f64, SearchError> {
        let mut scaled = from.to_vec();
        steps.iter().for_each(|&(i, step)| scaled[i] += step);
        self.score(&scaled)
    }

    /// The nearest place from which a step to both sides stays where it can be rendered.
    fn middle(&self, at: &[f64], direction: &[(usize, f64)], step: f64) -> Vec<f64> {
        let mut middle = at.to_vec();
        for &(i, share) in direction {
            let ((low, high), step) = (self.inside[i], (share * step).abs());
            middle[i] = at[i].min(high - step).max(low + step);
        }
        middle
    }

    /// CSSIM at a step to either side that raises it by about `rise`, at first `guess`.
    fn step(&self, at: &[f64], direction: &[(usize, f64)], rise: f64, guess: f64) -> Result<Step, SearchError> {
        let most = direction.iter().filter(|(_, share)| *share != 0.0).map(|&(i, share)| {
            let (low, high) = self.inside[i];
            LARGEST.min(0.5 * (high - low)) / share.abs()
        });
        let most = most.fold(f64::INFINITY, f64::min);
        let scaled = |step: f64| direction.iter().map(|&(i, share)| (i, share * step)).collect::<Vec<_>>();
        let mut length = guess.min(most);
        for trial in 1.. {
            let middle = self.middle(at, direction, length);
            let (below, here, above) =
                (self.moved(&middle, &scaled(-length))?, self.score(&middle)?, self.moved(&middle, &scaled(length))?);
            let found = 0.5 * (below + above) - here;
            let is_near = (rise / NEAR..=rise * NEAR).contains(&found) || (length >= most && found < rise);
            if is_near || trial == TRIALS {
                return Ok(Step { length, middle, below, here, above });
            }
            length = (length * (rise / found.max(0.01 * rise)).sqrt()).min(most);
        }
        unreachable!("the last trial returns")
    }

    /// The Hessian of CSSIM around the scaled parameters `at`, over the entries `free`.
    fn hessian(&self, at: &[f64], free: &[usize], rise: f64) -> Result<NormalEquations, SearchError> {
        let steps = free.iter().map(|&i| Ok(self.step(at, &[(i, 1.0)], rise, FIRST)?.length));
        let steps = steps.collect::<Result<Vec<f64>, SearchError>>()?;
        let mut middle = at.to_vec();
        for (&i, &step) in free.iter().zip(&steps) {
            middle = self.middle(&middle, &[(i, 1.0)], step);
        }
        let mut hessian = NormalEquations::new(free.len());
        let here = self.score(&middle)?;
        let mut above = Vec::new();
        // Widths come last: neighbouring evaluations then have the same widths, whose integrals are kept.
        for (a, (&i, &step)) in free.iter().zip(&steps).enumerate() {
            let (up, down) = (self.moved(&middle, &[(i, step)])?, self.moved(&middle, &[(i, -step)])?);
            hessian.set_matrix(a, a, (up - 2.0 * here + down) / (step * step));
            for b in 0..a {
                let both = self.moved(&middle, &[(i, step), (free[b], steps[b])])?;
                hessian.set_matrix(a, b, (both - up - above[b] + here) / (step * steps[b]));
            }
            above.push(up);
        }
        Ok(hessian)
    }
}

/// CSSIM in the middle of a step and at its ends.
struct Step {
    length: f64,
    middle: Vec<f64>,
    below: f64,
    here: f64,
    above: f64,
}

/// A quadratic around the match: its value above that there is `x^T A x / 2 - b^T x` at x from there, with A and b of the normal equations.
struct Quadratic {
    /// The match, in scaled parameters.
    at: Vec<f64>,
    normal: NormalEquations,
}

impl Quadratic {
    fn value(&self, x: &[f64]) -> f64 {
        let of = |(i, (x, ax)): (usize, (&f64, f64))| x * (0.5 * ax - self.normal.vector(i));
        x.iter().zip(self.normal.times(x)).enumerate().map(of).sum()
    }

    /// The quadratic around `at` over the entries `free`, along the eigenvectors of the Hessian. Valleys are narrow and curved: the differences over
    /// the parameters do not tell how CSSIM rises along one, so along each eigenvector slope and curvature are measured again, over a step that
    /// raises CSSIM by about `allowed`.
    fn along(
        hessian: &NormalEquations,
        near: &Surroundings<'_>,
        (at, free): (&[f64], &[usize]),
        allowed: f64,
    ) -> Result<Self, SearchError> {
        let n = free.len();
        let mut normal = NormalEquations::new(n);
        for (value, vector) in eigen::symmetric(n, |i, j| hessian.matrix(i, j)) {
            let direction: Vec<(usize, f64)> = free.iter().copied().zip(vector.iter().copied()).collect();
            let guess = if value > 0.0 { (2.0 * allowed / value).sqrt() } else { LARGEST };
            let step = near.step(at, &direction, allowed, guess)?;
            // Over the whole range CSSIM rises by so much at least.
            let curvature =
                ((step.above - 2.0 * step.here + step.below) / (step.length * step.length)).max(2.0 * allowed);
            let moved: f64 = direction.iter().map(|&(i, share)| share * (step.middle[i] - at[i])).sum();
            let slope = (step.above - step.below) / (2.0 * step.length) - curvature * moved;
            for i in 0..n {
                normal.set_vector(i, normal.vector(i) - slope * vector[i]);
                (i..n).for_each(|j| normal.set_matrix(i, j, normal.matrix(i, j) + curvature * vector[i] * vector[j]));
            }
        }
        Ok(Self { at: free.iter().map(|&i| at[i]).collect(), normal })
    }

    /// Its minimum over all entries in [0, 1] but entry `i`, which is `t`.
    fn profile(&self, i: usize, t: f64) -> Result<f64, SearchError> {
        let mut lower: Vec<f64> = self.at.iter().map(|at| -at).collect();
        let mut upper: Vec<f64> = self.at.iter().map(|at| 1.0 - at).collect();
        (lower[i], upper[i]) = (t - self.at[i], t - self.at[i]);
        Ok(self.value(&bvls::solve(&self.normal, &lower, &upper)?.point))
    }

    /// The end of the range of entry `i` towards `end`: where its profile rises above `limit`.
    fn end(&self, i: usize, end: f64, limit: f64) -> Result<f64, SearchError> {
        if self.profile(i, end)? <= limit {
            return Ok(end);
        }
        let (mut within, mut beyond) = (self.at[i], end);
        for _ in 0..BISECTIONS {
            let between = 0.5 * (within + beyond);
            if self.profile(i, between)? <= limit { within = between } else { beyond = between }
        }
        Ok(within)
    }
}

/// Bisections to the end of a range: to 1e-6 of the whole one.
const BISECTIONS: usize = 20;

/// The uncertainty of the match at `point`.
///
/// # Errors
/// If the bounds are not a valid box, a picture near the match cannot be scored, or `is_cancelled`.
pub(crate) fn uncertainty(
    view: &FullView<'_>,
    judges: Judges<'_>,
    (ranges, point): (&Ranges, &[f64]),
    is_cancelled: &dyn Fn() -> bool,
) -> Result<Uncertainty, SearchError> {
    let model = view.model;
    let bounds = visible_bounds(model, ranges)?;
    let (table, _) = within_table(model, &bounds, view.span())?;
    let scaled: Vec<f64> = (0..point.len()).map(|i| bounds.to_scaled(i, point[i])).collect();
    let limits = |i: usize| {
        let limit = |x: f64| bounds.to_scaled(i, x);
        // An end of the table that lies beyond the match by rounding counts as its own.
        (limit(table.lower()[i]).min(scaled[i]), limit(table.upper()[i]).max(scaled[i]))
    };
    let inside: Vec<(f64, f64)> = (0..point.len()).map(limits).collect();
    let pick = |score: Score| judges.by.pick(score.cssim, score.cssim_object);
    let roughly = |image: &Image| judges.searching.score(image).ok().filter(|_| !is_cancelled()).map(pick);
    let exactly = |image: &Image| judges.reporting.score(image).ok().filter(|_| !is_cancelled()).map(pick);
    let (bounds, inside) = (&bounds, &inside[..]);
    let around = |judge| {
        let (renderer, known) = (Renderer::new(view), RefCell::default());
        Surroundings { view, renderer, judge, bounds, inside, known }
    };
    let near = around(&roughly);
    let reached = near.score(&scaled)?;
    let allowed = SHARE * reached.max(LEAST);
    let free: Vec<usize> = (0..point.len()).filter(|&i| near.bounds.lower()[i] < near.bounds.upper()[i]).collect();
    let mut entries: Vec<Known> = point.iter().map(|&x| Known { low: x, high: x, standing: Standing::Held }).collect();
    if free.is_empty() {
        return Ok(Uncertainty { entries, trades: Vec::new() });
    }
    let hessian = near.hessian(&scaled, &free, allowed.max(RISE))?;
    let quadratic = Quadratic::along(&hessian, &around(&exactly), (&scaled, &free), allowed)?;
    judges.reporting.free_buffers();
    // A narrower range of the search makes no value more certain.
    let of_model = search_bounds(model, &Ranges::default(), SearchKind::LeastSquares)?;
    for (k, &i) in free.iter().enumerate() {
        let (low, high) = (quadratic.end(k, 0.0, allowed)?, quadratic.end(k, 1.0, allowed)?);
        let (low, high) = (near.bounds.to_natural(i, low).min(point[i]), near.bounds.to_natural(i, high).max(point[i]));
        let share = of_model.to_scaled(i, high) - of_model.to_scaled(i, low);
        let standing = match scaled[i] {
            _ if share > LARGEST_SHARE => Standing::Undetermined,
            t if t <= AT_BOUND || t >= 1.0 - AT_BOUND => Standing::AtBound,
            _ => Standing::Determined,
        };
        entries[i] = Known { low, high, standing };
    }
    near.judge_where_others_vanish(&scaled, allowed, &mut entries)?;
    let trades = trades(&quadratic, &free, &entries, point);
    Ok(Uncertainty { entries, trades })
}

/// A value nearer to a bound than this share of the range is at the bound.
const AT_BOUND: f64 = 1e-5;

/// How far a value is moved, as a share of its range, to see whether it has an effect.
const MOVED: f64 = 0.25;

impl Surroundings<'_> {
    /// A parameter without effect where another one is 0, as it may be, is undetermined.
    fn judge_where_others_vanish(&self, at: &[f64], allowed: f64, entries: &mut [Known]) -> Result<(), SearchError> {
        for (name, vanishing) in groups(self.view.model) {
            let can_vanish = |i: usize| entries[i].standing != Standing::Held && entries[i].low <= 0.0;
            if !vanishing.clone().all(can_vanish) {
                continue;
            }
            let mut there = at.to_vec();
            vanishing.clone().for_each(|i| there[i] = 0.0);
            let here = self.score(&there)?;
            for (_, others) in groups(self.view.model).filter(|(other, _)| *other != name) {
                for i in others {
                    if matches!(entries[i].standing, Standing::Determined | Standing::AtBound)
                        && self.has_no_effect(i, &there, here, allowed)?
                    {
                        let (low, high) = (self.bounds.lower()[i], self.bounds.upper()[i]);
                        entries[i] = Known { low, high, standing: Standing::Undetermined };
                    }
                }
            }
        }
        Ok(())
    }

    /// Whether moving entry `i` either way changes CSSIM by little. The table may not have all widths: then a smaller way counts for more.
    fn has_no_effect(&self, i: usize, at: &[f64], here: f64, allowed: f64) -> Result<bool, SearchError> {
        let (low, high) = self.inside[i];
        for end in [(at[i] - MOVED).max(low), (at[i] + MOVED).min(high)] {
            let way = (end - at[i]).abs();
            if way > 0.0 {
                let rise = (self.moved(at, &[(i, end - at[i])])? - here).abs();
                let share = MOVED / way;
                if rise * (share * share).max(1.0) > allowed {
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }
}

/// The parameters of a model: name and entries of the flat vector.
fn groups(model: &dyn Model) -> impl Iterator<Item = (&'static str, std::ops::Range<usize>)> {
    let mut first = 0;
    model.parameters().iter().map(move |parameter| {
        let entries = first..first + parameter.channels.count();
        first = entries.end;
        (parameter.name, entries)
    })
}

/// The pairs of entries of which one can make up for the other, strongest first.
fn trades(quadratic: &Quadratic, free: &[usize], entries: &[Known], point: &[f64]) -> Vec<(usize, usize)> {
    let is_wide = |i: usize| {
        let Known { low, high, standing } = entries[i];
        let is_known = matches!(standing, Standing::Determined | Standing::Undetermined);
        is_known && high - low > TRADE.1 * point[i].abs()
    };
    let at: Vec<usize> = (0..free.len()).filter(|&k| is_wide(free[k])).collect();
    let mut found: Vec<(f64, (usize, usize))> = Vec::new();
    for (n, &a) in at.iter().enumerate() {
        for &b in &at[..n] {
            let correlation = quadratic.normal.correlation(b, a);
            if correlation.abs() > TRADE.0 {
                found.push((correlation.abs(), (free[b], free[a])));
            }
        }
    }
    found.sort_by(|a, b| b.0.partial_cmp(&a.0).unwrap_or(Ordering::Equal));
    found.into_iter().map(|(_, pair)| pair).collect()
}
