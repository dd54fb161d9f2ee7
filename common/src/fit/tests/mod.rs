//! The method and its plan on scenes that are small enough for a unit test.

mod direct;
mod explore;
mod polish;
mod recovery;
pub(crate) mod scene;
mod uncertainty;
