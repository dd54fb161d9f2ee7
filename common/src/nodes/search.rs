//! `search`: stage one for one gamma on one pixel subset.
//!
//! Inputs: the subset with the photo's values; the shards of its transport table, in order. With the direct integrator, after those: the
//! environment, and the normal map if the surface has one.

use super::view::concatenated;
use crate::{
    brdf::{self, Model},
    fit::{Compress, DirectPixels, Method, Ranges, ScannedTable, SearchKind, Start, search_gamma},
    graph::{Blob, BlobHash, NodeFailure, NodeType, RunContext},
    light::LightDistribution,
    nodes::wire::{CandidateWire, EnvironmentWire, ImageWire, SubsetWire, read, write},
    render::transport::Pixel,
    scene::{Geometry, GeometrySpec},
};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct SearchParameters {
    pub(crate) model: String,
    ranges: Ranges,
    pub(crate) gamma: f64,
    pub(crate) subset: u32,
    /// Mean luminance of the photo over its usable pixels.
    pub(crate) mean_radiance: f64,
    pub(crate) pattern: bool,
    pub(crate) paper_start: bool,
    compress: CompressWire,
    pub(crate) direct: Option<DirectWire>,
}

impl SearchParameters {
    /// The part of `method` that a worker needs to search one gamma on one subset.
    pub(crate) fn of(
        method: &Method,
        (gamma, subset): (f64, u32),
        mean_radiance: f64,
        direct: Option<DirectWire>,
    ) -> Self {
        // Without `..`: a new field of the method has to be named here, and passed on if searches depend on it. The direct
        // integrator is in `direct`, the pixels are in the subset.
        let Method {
            model,
            ranges,
            search,
            start,
            compress,
            gammas: _,
            samples: _,
            sampling: _,
            subsets: _,
            integration: _,
            polish: _,
            judge: _,
            seed: _,
        } = method;
        Self {
            model: model.name().to_owned(),
            ranges: ranges.clone(),
            gamma,
            subset,
            mean_radiance,
            pattern: *search == SearchKind::Pattern,
            paper_start: *start == Start::Paper,
            compress: CompressWire::of(*compress),
            direct,
        }
    }

    /// The method as far as a search depends on it.
    fn method(&self, model: &'static dyn Model) -> Result<Method, NodeFailure> {
        Ok(Method {
            model,
            ranges: self.ranges.clone(),
            search: if self.pattern { SearchKind::Pattern } else { SearchKind::LeastSquares },
            start: if self.paper_start { Start::Paper } else { Start::Scan },
            compress: self.compress.compress()?,
            ..Method::default()
        })
    }
}

/// The wire form of [`Compress`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
enum CompressWire {
    Tangent,
    Clamp,
    ClampTo(f64),
    Logarithm,
}

impl CompressWire {
    fn of(compress: Compress) -> Self {
        match compress {
            Compress::Tangent => Self::Tangent,
            Compress::Clamp => Self::Clamp,
            Compress::ClampTo { white } => Self::ClampTo(white),
            Compress::Logarithm => Self::Logarithm,
        }
    }

    fn compress(self) -> Result<Compress, NodeFailure> {
        Ok(match self {
            Self::Tangent => Compress::Tangent,
            Self::Clamp => Compress::Clamp,
            Self::ClampTo(white) if white.is_finite() && white > 0.0 => Compress::ClampTo { white },
            Self::ClampTo(white) => return Err(NodeFailure::new(format!("white {white} must be positive"))),
            Self::Logarithm => Compress::Logarithm,
        })
    }
}

/// The direct integrator in place of the table.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct DirectWire {
    pub(crate) geometry: GeometrySpec,
    pub(crate) has_normals: bool,
    pub(crate) samples: u32,
    pub(crate) seed: u64,
}

/// A scene for the direct integrator.
#[derive(Debug)]
pub(super) struct DirectScene {
    pub(super) geometry: Geometry,
    pub(super) light: Arc<LightDistribution>,
    pub(super) samples: u32,
    pub(super) seed: u64,
}

impl DirectScene {
    pub(super) fn read(wire: &DirectWire, inputs: &[Blob], context: &RunContext) -> Result<Self, NodeFailure> {
        let [environment, normals @ ..] = inputs else {
            return Err(NodeFailure::new("the direct integrator takes an environment, found none"));
        };
        let light = context.decoded(environment, |bytes| {
            let environment = read::<EnvironmentWire>("environment", bytes)?.environment()?;
            Ok(LightDistribution::new(Arc::new(environment)))
        })?;
        let map = |bytes: &[u8]| read::<ImageWire>("normal map", bytes)?.image();
        let normals = normals.first().map(|blob| context.decoded(blob, map)).transpose()?;
        let geometry = Geometry::from_spec(&wire.geometry, normals.as_deref())
            .map_err(|error| NodeFailure::new(error.to_string()))?;
        Ok(Self { geometry, light, samples: wire.samples, seed: wire.seed })
    }

    /// The renderer of these pixels, which must be inside the image.
    fn pixels<'a>(&'a self, pixels: &'a [Pixel]) -> Result<DirectPixels<'a>, NodeFailure> {
        let (geometry, light) = (&self.geometry, &*self.light);
        let outside = |p: &&Pixel| p[0] as usize >= geometry.width() || p[1] as usize >= geometry.height();
        match pixels.iter().find(outside) {
            Some(pixel) => Err(NodeFailure::new(format!("pixel {pixel:?} lies outside the image"))),
            None => Ok(DirectPixels { geometry, light, pixels, samples: self.samples, seed: self.seed }),
        }
    }
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
        let scene_inputs = parameters.direct.as_ref().map_or(0, |direct| 1 + usize::from(direct.has_normals));
        let Some((shards, of_scene)) = shards.len().checked_sub(scene_inputs).map(|at| shards.split_at(at)) else {
            return Err(NodeFailure::new(
                "the direct integrator takes a table and an environment, found too few inputs",
            ));
        };
        let scene = parameters.direct.as_ref().map(|wire| DirectScene::read(wire, of_scene, context)).transpose()?;
        let positive = |x: f64| x.is_finite() && x > 0.0;
        if !positive(parameters.gamma) || !positive(parameters.mean_radiance) {
            let (gamma, mean) = (parameters.gamma, parameters.mean_radiance);
            return Err(NodeFailure::new(format!("gamma {gamma} and mean radiance {mean} must be positive")));
        }
        parameters.ranges.check(model).map_err(|error| NodeFailure::new(error.to_string()))?;
        let method = parameters.method(model)?;
        // Searches of other gammas reuse the scan: it depends on the inputs, the start and the ranges alone.
        let hashes = inputs.iter().flat_map(|input| input.hash().0);
        let of_start = [u8::from(parameters.paper_start), u8::from(parameters.direct.is_some())];
        let ranges = write("ranges", &parameters.ranges)?;
        let key: Vec<u8> = of_start.into_iter().chain(model.name().bytes()).chain(ranges).chain(hashes).collect();
        let bytes = shards.iter().map(|shard| shard.len()).sum();
        let scanned = context.derived(BlobHash::of(&key), bytes, || {
            let table = concatenated(model, shards, context)?;
            if table.pixels != subset.pixels.len() {
                let (expected, found) = (subset.pixels.len(), table.pixels);
                return Err(NodeFailure::new(format!("expected a table of {expected} pixels, found {found}")));
            }
            Ok(ScannedTable::new(&method, table, &subset, &subset_wire.photo))
        })?;
        let mean = parameters.mean_radiance;
        let direct = scene.as_ref().map(|scene| scene.pixels(&subset.pixels)).transpose()?;
        let mut candidate =
            search_gamma(&method, parameters.gamma, &scanned, &subset, &subset_wire.photo, mean, direct)?;
        candidate.subset = parameters.subset;
        write("candidate", &CandidateWire::of(&candidate))
    }
}
