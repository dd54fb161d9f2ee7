//! A study: the paper's tables and figures, measured again.

mod report;
mod row;
