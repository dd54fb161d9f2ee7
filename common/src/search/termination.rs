//! Why a search ended, and what it tells while it runs.

use std::fmt;

/// Why a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Termination {
    /// The mesh of a pattern search became smaller than its tolerance.
    MeshTolerance,
    /// The step became smaller than its tolerance.
    StepTolerance,
    /// The objective changes by less than its tolerance.
    FunctionTolerance,
    /// The gradient, where it can be followed inside the box, is below its tolerance.
    GradientTolerance,
    /// The iteration limit was reached.
    MaxIterations,
    /// The evaluation limit was reached.
    MaxEvaluations,
    /// The observer asked to stop.
    Stopped,
}

impl Termination {
    /// The name that result files carry.
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

    /// The reason with this [`name`](Self::name), if there is one.
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

/// The state of a running search, shown to its observer after every evaluation of the objective. The observer answers
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
    fn names_lead_back_to_their_reason() {
        for reason in Termination::ALL {
            assert_eq!(Termination::from_name(reason.name()), Some(reason));
        }
        assert_eq!(Termination::from_name("tired"), None);
    }
}
