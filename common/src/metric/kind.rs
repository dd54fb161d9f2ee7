//! The metrics of `lookalike compare` by name, behind one function.

use super::{DisplayImage, ErrorMap, IcidOptions, Judge, JudgeOptions, MetricError, icid};
use crate::{choice::choice, image::Image};

/// A metric of the difference of two images: 0 is equal, larger is worse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MetricKind {
    /// CSSIM, by [`Judge`].
    #[default]
    Cssim,
    /// iCID, by [`icid`].
    Icid,
}

choice! { MetricKind:
    Cssim = "cssim", "CSSIM, single scale, five features, as in the paper";
    Icid = "icid", "iCID (Preiss et al. 2014), a later metric of CSSIM's authors";
}

/// The difference of two images.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Over the whole image.
    pub score: f64,
    /// Over the windows centred on the object.
    pub score_object: f64,
    /// Means of l_L, c_L, s_L, l_C, l_H over the image and over the object; CSSIM only.
    pub features: Option<[[f64; 5]; 2]>,
    /// The error of every window, if it was requested.
    pub map: Option<ErrorMap>,
}

impl MetricKind {
    /// The difference of `image` from `reference`, both linear Rec. 709. `coverage`: one value in [0, 1] per pixel, by which both are
    /// multiplied; its pixels above 0 are the object. `exposure`: factor of the display transform.
    ///
    /// # Errors
    /// As [`Judge::new`] and [`Judge::score`], or [`DisplayImage::from_linear`] and [`icid`].
    pub fn difference(
        self,
        reference: &Image,
        image: &Image,
        (coverage, exposure): (&[f32], f64),
        with_map: bool,
    ) -> Result<Difference, MetricError> {
        let shown = |image: &Image| DisplayImage::from_linear(image, coverage, exposure);
        match self {
            Self::Cssim => {
                let judge = Judge::new(reference, coverage, exposure, &JudgeOptions::default())?;
                let score = judge.score(image)?;
                let map = with_map.then(|| judge.error_map(image)).transpose()?;
                let features = Some([score.features, score.features_object]);
                Ok(Difference { score: score.cssim, score_object: score.cssim_object, features, map })
            }
            Self::Icid => {
                let score = icid(&shown(reference)?, &shown(image)?, coverage, &IcidOptions::default())?;
                let map = with_map.then_some(score.error);
                Ok(Difference { score: score.icid, score_object: score.icid_object, features: None, map })
            }
        }
    }
}
