//! Minimisers of a function over a box: pattern search and bounded least squares. Knows nothing about light.
