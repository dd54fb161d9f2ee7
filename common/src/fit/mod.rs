//! The method of \[BP20b\]: pixel subset, one search per gamma, candidates, winner, polish.
