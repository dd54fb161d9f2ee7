//! The files that a fit writes to OUT (design section 10): numbers and pictures.

mod candidates_csv;
mod claim;
mod conventions;
mod fit_json;
mod folder;
mod ledger;
mod pictures;
mod strip;
mod summary;
mod table;

pub(crate) use claim::{ACCESS_FILE, BATCH_MARK, Claim, FIT_FILES, MARK, changed};
pub(crate) use conventions::conventions;
pub(crate) use fit_json::{FitRecord, Timing, parameters_json};
pub(crate) use folder::{ClaimedFolder, OutFolder};
pub(crate) use pictures::{Pictures, write_pictures};
pub(crate) use strip::{Panel, strip};
pub(crate) use summary::print_summary;
pub(crate) use table::{CSSIM_HINT, aligned, counted, print_result};

pub(crate) use candidates_csv::candidates_csv;

#[cfg(test)]
mod tests;
