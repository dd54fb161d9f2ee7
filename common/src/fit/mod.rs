//! The method of \[BP20b\], as pure functions that read like its section 3:
//!
//! 1. a pixel subset ([`crate::render::subset`]) and its transport table,
//! 2. stage one, [`search_gamma`]: for each gamma, minimise Eq. 1 over the parameters,
//! 3. stage two, [`judge_candidates`]: render the candidates in full, keep the one of lowest CSSIM,
//! 4. stage three, [`polish`]: a short search on CSSIM itself, from the winner or from another lobe that looks better on a coarse picture.
//!
//! [`nodes`] wraps these steps as nodes of the job graph, and [`FitPlanner`] joins them.

mod best;
mod brute_force;
mod candidate;
mod direct;
mod explore;
mod method;
pub mod nodes;
mod objective;
mod plan;
mod polish;
mod scan;
mod stage_one;
mod stage_two;
mod uncertainty;
mod wire;

pub use best::BestScore;
pub use brute_force::brute_force;
pub use candidate::{Candidate, SAME, distinct, needed_span};
pub use direct::DirectPixels;
pub use method::{Compress, Integration, JudgedBy, MOST_SEARCHES, Method, MethodError, SearchKind, Start, gamma_range};
pub use objective::Objective;
pub use plan::{
    Appraisal, FitError, FitOutcome, FitPlanner, PhotoPlanner, Subject, SurveyOutcome, SurveyPlanner, SurveyRequest,
    encode_light,
};
pub use polish::{MAX_EVALUATIONS, Polished, polish};
pub use stage_one::{SearchFailure, search_gamma};
pub use stage_two::{FullView, Judged, judge_candidates, winner};
pub use uncertainty::{LARGEST_SHARE, Uncertainty};

#[cfg(test)]
mod tests;
