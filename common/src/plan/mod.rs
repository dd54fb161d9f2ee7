//! The nodes of a fit, a photo and a survey, and the further nodes that their outputs lead to (design section 7).

mod appraisal;
mod coarse;
mod conclusion;
mod contender;
mod direct;
mod encode;
mod fit;
mod limits;
mod photo;
mod pictures;
mod pixels;
mod polishing;
mod scene_tables;
mod step;
mod survey;
mod tables;
mod verify;
mod work;

pub use appraisal::Appraisal;
pub use encode::encode_light;
pub use fit::{FitOutcome, FitPlanner};
pub use limits::FitError;
pub use photo::{PhotoPlanner, Subject};
pub use survey::{SurveyOutcome, SurveyPlanner, SurveyRequest};
pub use work::Work;

#[cfg(test)]
mod tests;
