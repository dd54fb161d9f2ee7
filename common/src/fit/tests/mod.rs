//! The method and its plan on scenes that are small enough for a unit test.

mod direct;
mod explore;
mod planner;
mod polish;
mod recovery;
mod scene;
mod survey;
mod uncertainty;
