//! Planners on scenes that are small enough for a unit test.

mod planner;
mod survey;
