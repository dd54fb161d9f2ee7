//! Natural light: the environment map, its layouts, and the density it is sampled with.
