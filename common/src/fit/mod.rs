//! The method of \[BP20b\], as pure functions in the order of its section 3:
//!
//! 1. a pixel subset ([`crate::render::subset`]) and its transport table,
//! 2. stage one, [`search_gamma`]: for each gamma, minimise Eq. 1 over the parameters,
//! 3. stage two, [`judge_candidates`]: render the candidates in full, keep the one of lowest CSSIM,
//! 4. stage three, [`polish`]: a short search on CSSIM itself, from the winner or from a lobe of lower CSSIM on a coarse picture.
//!
//! [`crate::nodes`] wraps these steps as nodes of the job graph, and [`crate::plan`] joins them.

mod best;
mod brute_force;
pub(crate) mod candidate;
mod choice;
mod direct;
pub(crate) mod explore;
mod gammas;
mod method;
mod methods;
mod objective;
pub(crate) mod polish;
mod ranges;
pub(crate) mod relight;
mod scan;
pub(crate) mod stage_one;
mod stage_two;
pub(crate) mod uncertainty;
mod verdict;

pub use best::BestScore;
pub use brute_force::brute_force;
pub use candidate::{Candidate, SAME, distinct, needed_span};
pub use choice::{AS_GOOD, Tried};
pub(crate) use choice::{COST_OF_NOISE, Match, chosen, compare, is_hopeless};
pub use direct::DirectPixels;
pub use gammas::{Gammas, GammasError};
pub use method::{
    Compress, Integration, JudgedBy, MOST_SEARCHES, Method, MethodError, SearchKind, Setting, Start,
    UnknownIntegration, gamma_range,
};
pub use methods::Methods;
pub use objective::Objective;
pub use polish::{Judges, Limits, MAX_EVALUATIONS, Polished, polish};
pub use ranges::Ranges;
pub use relight::{Neighbour, spread};
pub(crate) use stage_one::scaled_distance;
pub use stage_one::{ScannedTable, SearchFailure, search_gamma};
pub use stage_two::{FullView, Judged, judge_candidates, winner};
pub use uncertainty::{Known, Standing, Uncertainty};
pub use verdict::{CLOSE, INDISTINGUISHABLE, VISIBLE, Verdict};

#[cfg(test)]
pub(crate) mod tests;
