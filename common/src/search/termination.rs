//! The reason why a search ended, and its progress reports.

use std::fmt;

/// The reason why a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Termination {
    /// The mesh of a pattern search became smaller than its tolerance.
    MeshTolerance,
    /// The step became smaller than its tolerance.
    StepTolerance,
    /// The objective changes by less than its tolerance.
    FunctionTolerance,
    /// The gradient, in directions with descent inside the box, is below its tolerance.
    GradientTolerance,
    /// The iteration limit was reached.
    MaxIterations,
    /// The evaluation limit was reached.
    MaxEvaluations,
    /// The observer stopped the search.
    Stopped,
}

impl Termination {
    /// The name in result files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::MeshTolerance => "mesh-tolerance",
            Self::StepTolerance => "step-tolerance",
            Self::FunctionTolerance => "function-tolerance",
            Self::GradientTolerance => "gradient-tolerance",
            Self::MaxIterations => "max-iterations",
            Self::MaxEvaluations => "max-evaluations",
            Self::Stopped => "stopped",
        }
    }

    /// The reason with this [`name`](Self::name), or `None`.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|reason| reason.name() == name)
    }

    /// Every reason.
    pub const ALL: [Self; 7] = [
        Self::MeshTolerance,
        Self::StepTolerance,
        Self::FunctionTolerance,
        Self::GradientTolerance,
        Self::MaxIterations,
        Self::MaxEvaluations,
        Self::Stopped,
    ];
}

impl fmt::Display for Termination {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

/// The state of a running search, passed to its observer. The observer returns
/// [`ControlFlow::Break`](std::ops::ControlFlow::Break) to end the search with the incumbent.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// Evaluations of the objective so far, the start included.
    pub evaluations: usize,
    /// Completed iterations.
    pub iterations: usize,
    /// Objective at the incumbent.
    pub value: f64,
    /// The incumbent, the best point so far, in the caller's parameters.
    pub point: &'a [f64],
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip() {
        for reason in Termination::ALL {
            assert_eq!(Termination::from_name(reason.name()), Some(reason));
        }
        assert_eq!(Termination::from_name("unknown"), None);
    }
}
