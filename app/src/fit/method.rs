//! From the settings of the command line to the method of the library.

use crate::settings::{self, MethodSettings};
use anyhow::Context;
use lookalike::{
    fit::{Compress, Integration, JudgedBy, Method, SearchKind, Start},
    render::subset::{SampleCount, Sampling},
};

/// The method that the settings ask for.
pub(crate) fn method(settings: &MethodSettings) -> anyhow::Result<Method> {
    Ok(Method {
        model: settings.model.model(),
        gammas: settings.gammas.values(),
        samples: match settings.samples {
            settings::Samples::Count(n) => {
                SampleCount::Draws(u32::try_from(n.get()).context("--samples is beyond 4294967295: use full")?)
            }
            settings::Samples::Full => SampleCount::Full,
        },
        sampling: match settings.sampling {
            settings::Sampling::Importance => Sampling::Importance,
            settings::Sampling::Stratified => Sampling::Stratified,
            settings::Sampling::Uniform => Sampling::Uniform,
        },
        subsets: u32::try_from(settings.subsets.get()).context("--subsets is too large")?,
        search: match settings.search {
            settings::SearchKind::LeastSquares => SearchKind::LeastSquares,
            settings::SearchKind::Pattern => SearchKind::Pattern,
        },
        integration: match settings.integrator {
            settings::Integrator::Tables => Integration::Tables,
            settings::Integrator::Direct(samples) => Integration::Direct { samples: samples.get() },
        },
        start: match settings.start {
            settings::Start::Scan => Start::Scan,
            settings::Start::Paper => Start::Paper,
        },
        compress: match settings.compress_at_zero {
            settings::CompressAtZero::Tangent => Compress::Tangent,
            settings::CompressAtZero::Clamp => Compress::Clamp,
        },
        polish: settings.polish,
        judge: match settings.judge {
            settings::Judge::Image => JudgedBy::Image,
            settings::Judge::Object => JudgedBy::Object,
        },
        seed: settings.seed,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_of_command_line_and_library_are_the_same() {
        let settings = MethodSettings::default();
        let (ours, theirs) = (method(&settings).unwrap(), Method::default());
        assert_eq!(format!("{ours:?}"), format!("{theirs:?}"));
    }
}
