//! The coordinator: the command line of Lookalike, and the process that plans a fit, hands its nodes to workers and
//! judges the candidates.
