//! The choice among the models that a fit has tried (design section 4): the simplest whose match is as good as the best one, as far as the
//! photo can tell.
//!
//! Two matches are compared window by window, because most of what decides how well a material can be matched at all is common to both: the
//! standard error is that of the paired difference of CSSIM ([`Blocks::difference`]).

use super::method::JudgedBy;
use crate::metric::Blocks;

/// A model whose CSSIM is above the best by at most so many standard errors of the difference is as good as the best, and so is one that is
/// above it by less than the photo's noise costs.
pub const AS_GOOD: f64 = 1.0;

/// What the error of full-resolution tables may cost: they agree with the direct integrator within .5 % of mean radiance, and noise of
/// .5 % costs this much (design sections 5 and 6).
const OF_TABLES: f64 = 4e-4;

/// CSSIM that noise costs, over the square of its relative standard deviation: .0004 at .5 %, .0064 at 2 % (design section 6).
pub(crate) const COST_OF_NOISE: f64 = 16.0;

/// What noise costs counts up to this share of the best score: fine texture of the material looks like noise.
const OF_BEST: f64 = 0.5;

/// The best match of one model.
#[derive(Debug, Clone, PartialEq)]
pub struct Tried {
    /// The gamma of the winner of stage two; `None` if the model was given up before.
    pub gamma: Option<f64>,
    /// The parameters of the match, polished if polish is on.
    pub parameters: Vec<f64>,
    /// CSSIM over the whole image.
    pub cssim: f64,
    /// CSSIM over windows centred on the object.
    pub cssim_object: f64,
    /// By how much its score is above the best one of all models, and the standard error of this difference; (0, 0) for the best.
    pub above_best: (f64, f64),
    /// Up to which difference the photo does not tell it from the best.
    pub tolerance: f64,
    /// Whether the model was given up on the coarse picture, where all its numbers are from.
    pub is_coarse: bool,
}

impl Tried {
    /// The match of a model that is not compared with others yet.
    #[must_use]
    pub fn new(gamma: Option<f64>, parameters: Vec<f64>, cssim: f64, cssim_object: f64) -> Self {
        Self { gamma, parameters, cssim, cssim_object, above_best: (0.0, 0.0), tolerance: 0.0, is_coarse: false }
    }

    /// Whether the photo does not tell it from the best.
    #[must_use]
    pub fn is_as_good(&self) -> bool {
        self.above_best.0 <= self.tolerance
    }
}

/// The match of a model, its windows, and what the photo's noise costs it.
pub(crate) type Match = (Tried, Blocks, f64);

/// Compares the matches of models, from simple to rich, with the best of them.
#[must_use]
pub(crate) fn compare(tried: Vec<Match>, judge: JudgedBy) -> Vec<Tried> {
    let score = |tried: &Tried| judge.pick(tried.cssim, tried.cssim_object);
    let best = tried.iter().min_by(|a, b| score(&a.0).total_cmp(&score(&b.0)));
    let Some((best, of_best, floor)) = best.cloned() else { return Vec::new() };
    let compared = tried.into_iter().map(|(tried, blocks, _)| {
        let (difference, error) = (score(&tried) - score(&best), blocks.difference(&of_best).1);
        let tolerance = floor.min(OF_BEST * score(&best)).max(AS_GOOD * error).max(OF_TABLES);
        Tried { above_best: (difference, error), tolerance, ..tried }
    });
    compared.collect()
}

/// The index of the simplest model that is as good as the best, among those that were not given up.
#[must_use]
pub(crate) fn chosen(compared: &[Tried]) -> Option<usize> {
    compared.iter().position(|tried| !tried.is_coarse && tried.is_as_good())
}

/// A model is given up on the coarse picture if it is worse there than the best by so many times the tolerance, and by this share of the
/// score of the best.
const HOPELESS: (f64, f64) = (3.0, 0.1);

/// Whether the coarse picture shows that the model will not match as well as the best one.
#[must_use]
pub(crate) fn is_hopeless(tried: &Tried, judge: JudgedBy) -> bool {
    let difference = tried.above_best.0;
    let of_best = judge.pick(tried.cssim, tried.cssim_object) - difference;
    difference > HOPELESS.0 * tried.tolerance && difference > HOPELESS.1 * of_best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metric::Block;

    /// A match with this difference from the reference in each block.
    fn tried(deficit: impl Fn(usize) -> f64, floor: f64) -> Match {
        let block = |b: usize| (100.0, [100.0 * deficit(b), 0.0, 0.0, 0.0, 0.0]);
        let blocks = (0..64).map(block).chain([(0.0, [0.0; 5])]).collect::<Vec<Block>>();
        let blocks = Blocks::from_parts(blocks).unwrap();
        (Tried::new(Some(2.0), Vec::new(), blocks.cssim(), blocks.cssim()), blocks, floor)
    }

    /// The simple model is worse by .01 everywhere, or here and there.
    #[test]
    fn simplest_model_within_the_uncertainty_of_the_best_is_chosen() {
        let here_and_there = |b: usize| 0.05 + if b.is_multiple_of(2) { 0.05 } else { -0.04 };
        let everywhere = |b: usize| 0.055 + 1e-6 * (b % 3) as f64;
        assert_eq!(compare(vec![tried(|_| 0.0003, 0.0), tried(|_| 0.0, 0.0)], JudgedBy::Image)[0].tolerance, OF_TABLES);
        let choice = |of_simple: &dyn Fn(usize) -> f64, floor: f64| {
            let compared = compare(vec![tried(of_simple, floor), tried(|_| 0.05, floor)], JudgedBy::Image);
            (chosen(&compared).unwrap(), compared)
        };
        let (index, compared) = choice(&here_and_there, 0.0);
        assert_eq!(index, 0);
        let (difference, error) = compared[0].above_best;
        assert!((difference - 0.005).abs() < 1e-9 && (error - 0.045 / 63.0_f64.sqrt()).abs() < 1e-4, "{error}");
        assert_eq!(choice(&everywhere, 0.0).0, 1);
        assert_eq!(choice(&everywhere, 0.006).0, 0);
        assert_eq!(choice(&|_| 0.09, 0.2).0, 1, "texture is not noise");
    }

    #[test]
    fn model_is_given_up_only_if_it_is_clearly_and_much_worse() {
        let best = || tried(|b| 0.05 + 1e-3 * (b % 2) as f64, 0.0);
        let hopeless = |of_other: &dyn Fn(usize) -> f64| {
            let compared = compare(vec![tried(of_other, 0.0), best()], JudgedBy::Image);
            is_hopeless(&compared[0], JudgedBy::Image)
        };
        assert!(hopeless(&|_| 0.07));
        assert!(!hopeless(&|_| 0.053), "clearly, but not much");
        assert!(!hopeless(&|b| 0.05 + 0.1 * f64::from(u8::from(b.is_multiple_of(16)))), "much, but not clearly");
        // A model that was given up is never chosen.
        let mut compared = compare(vec![tried(|_| 0.06, 0.0), best()], JudgedBy::Image);
        compared[0].is_coarse = true;
        assert_eq!(chosen(&compared), Some(1));
    }
}
