//! Prints the result of a comparison on stdout: a table, or JSON.

use super::coverage::{Coverage, Object};
use crate::{
    inputs::{LoadedMask, LoadedPhoto},
    outputs::print_result,
    settings::{CompareSettings, DisplayExposure},
    wrap::wrap,
};
use anyhow::Context;
use lookalike::metric::Difference;
use serde_json::{Map, Value, json};

/// Everything that the report shows.
#[derive(Debug)]
pub(super) struct Report<'a> {
    pub(super) settings: &'a CompareSettings,
    pub(super) reference: &'a LoadedPhoto,
    pub(super) image: &'a LoadedPhoto,
    pub(super) mask: Option<&'a LoadedMask>,
    pub(super) coverage: &'a Coverage,
    pub(super) exposure: f64,
    pub(super) difference: &'a Difference,
}

impl Report<'_> {
    /// Writes the report to stdout.
    pub(super) fn print(&self) -> anyhow::Result<()> {
        let text = if self.settings.json { format!("{:#}\n", self.json()) } else { self.table() };
        print_result(&text).context("cannot write to stdout")
    }

    fn json(&self) -> Value {
        let Difference { score, score_object, features, .. } = *self.difference;
        let by_name = |values: [f64; 5]| -> Map<String, Value> {
            FEATURES.iter().zip(values).map(|(name, value)| ((*name).to_owned(), json!(value))).collect()
        };
        json!({
            "metric": self.settings.metric.to_string(),
            "score": score,
            "score_object": score_object,
            "features": features.map(|[image, _]| by_name(image)),
            "features_object": features.map(|[_, object]| by_name(object)),
            "display_exposure": self.exposure,
            "object": self.coverage.object.word(),
            "width": self.reference.image.width(),
            "height": self.reference.image.height(),
            "reference": self.reference.source.to_json(),
            "image": self.image.source.to_json(),
            "mask": self.mask.map(|mask| mask.source.to_json()),
            "map": self.settings.map.as_ref().map(|path| path.to_string_lossy()),
        })
    }

    fn table(&self) -> String {
        let Difference { score, score_object, features, .. } = *self.difference;
        let object = match self.coverage.object {
            Object::Mask => "what the mask covers",
            Object::Alpha => "what the alpha channel covers",
            Object::Image => "the whole image: no mask, no alpha channel over black",
        };
        let metric = self.settings.metric.to_string();
        let (reference, image) = (self.settings.reference.display(), self.settings.image.display());
        let mut text = wrap(&format!("{metric} of {image} against {reference}: 0 is equal, larger is worse")) + "\n\n";
        let mut row =
            |name: &str, object: f64, image: f64| text.push_str(&format!("{name:<10} {object:>10.6} {image:>10.6}\n"));
        row(&metric, score_object, score);
        if let Some([image, object]) = features {
            for (i, name) in FEATURES.iter().enumerate() {
                row(name, object[i], image[i]);
            }
        }
        let heading = format!("{:<10} {:>10} {:>10}\n", "", "on object", "on image");
        text.insert_str(text.find("\n\n").map_or(0, |end| end + 2), &heading);
        text.push_str(&format!("\nobject: {object}\n"));
        if features.is_some() {
            text.push_str("features: 1 is equal; the score is 1 minus their product\n");
        }
        let source = exposure_source(&self.settings.display_exposure);
        text + &wrap(&format!("display exposure: {} ({source})\n", self.exposure))
    }
}

/// In the order l_L, c_L, s_L, l_C, l_H.
const FEATURES: [&str; 5] = ["lightness", "contrast", "structure", "chroma", "hue"];

/// How the exposure was chosen, in words.
fn exposure_source(asked: &DisplayExposure) -> String {
    match asked {
        DisplayExposure::Auto => "auto: the 97th percentile of the reference's largest channel becomes 0.9".to_owned(),
        DisplayExposure::Value(_) => "as given; 1 unless --display-exposure says otherwise".to_owned(),
        DisplayExposure::From(path) => format!("from {}", path.display()),
    }
}
