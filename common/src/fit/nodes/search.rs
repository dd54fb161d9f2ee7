//! `search`: stage one for one gamma on one pixel subset.
//!
//! Inputs: subset with the photo's values; the shards of its transport table, in order.

use super::view::concatenated;
use crate::{
    brdf,
    fit::{
        AtZero, Method, SearchKind, Start, search_gamma,
        wire::{CandidateWire, SubsetWire, read, write},
    },
    graph::{Blob, NodeFailure, NodeType, RunContext},
};
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(in crate::fit) struct SearchParameters {
    pub(in crate::fit) model: String,
    pub(in crate::fit) gamma: f64,
    pub(in crate::fit) subset: u32,
    /// Mean luminance of the photo over its usable pixels.
    pub(in crate::fit) mean_radiance: f64,
    pub(in crate::fit) pattern: bool,
    pub(in crate::fit) paper_start: bool,
    pub(in crate::fit) clamp_at_zero: bool,
}

#[derive(Debug)]
pub(super) struct Search;

impl NodeType for Search {
    fn kind(&self) -> &'static str {
        super::SEARCH
    }

    fn run(&self, parameters: &[u8], inputs: &[Blob], context: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        let parameters: SearchParameters = read("parameters of search", parameters)?;
        let Some((subset, shards)) = inputs.split_first() else {
            return Err(NodeFailure::new("search takes a subset and a transport table, found no input"));
        };
        let subset_wire = context.decoded(subset, |bytes| read::<SubsetWire>("pixel subset", bytes))?;
        let subset = subset_wire.subset()?;
        let model = brdf::model(&parameters.model).map_err(|error| NodeFailure::new(error.to_string()))?;
        let table = concatenated(model, shards, context)?;
        if table.pixels != subset.pixels.len() {
            let (expected, found) = (subset.pixels.len(), table.pixels);
            return Err(NodeFailure::new(format!("expected a table of {expected} pixels, found {found}")));
        }
        let positive = |x: f64| x.is_finite() && x > 0.0;
        if !positive(parameters.gamma) || !positive(parameters.mean_radiance) {
            let (gamma, mean) = (parameters.gamma, parameters.mean_radiance);
            return Err(NodeFailure::new(format!("gamma {gamma} and mean radiance {mean} must be positive")));
        }
        let method = Method {
            model,
            search: if parameters.pattern { SearchKind::Pattern } else { SearchKind::LeastSquares },
            start: if parameters.paper_start { Start::Paper } else { Start::Scan },
            at_zero: if parameters.clamp_at_zero { AtZero::Clamp } else { AtZero::Tangent },
            ..Method::default()
        };
        let mean = parameters.mean_radiance;
        let mut candidate = search_gamma(&method, parameters.gamma, &table, &subset, &subset_wire.photo, mean)?;
        candidate.subset = parameters.subset;
        write("candidate", &CandidateWire::of(&candidate))
    }
}
