//! Planners on scenes that are small enough for a unit test.

mod models;
mod planner;
mod survey;
