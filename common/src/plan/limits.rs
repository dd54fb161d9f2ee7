//! Size limits of a fit: photos, maps and subsets must fit into blobs and into memory.

use super::tables::FULL_SHARD;
use crate::{
    brdf::{Model, flat_bounds},
    fit::{Integration, Method, MethodError},
    graph::{MAX_BLOB_BYTES, MAX_INPUTS},
    image::Image,
    render::subset::SampleCount,
    scene::Capture,
};
use thiserror::Error;

/// Why a fit cannot be planned.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FitError {
    /// A setting is out of range.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// The photo has no light to fit to.
    #[error("every usable pixel of the photo is black: check the exposure of the photo and the place of the object")]
    Black,
    /// More samples per evaluation than the coordinator can check without blocking its event loop.
    #[error(
        "--integrator direct with {pixels} pixels of {samples} samples each is more than the limit of {MOST_DIRECT} samples per \
         evaluation: use fewer --samples, or direct:N with a smaller N"
    )]
    DirectTooLarge {
        /// Pixels of stage one.
        pixels: usize,
        /// Samples per pixel.
        samples: u32,
    },
    /// A point outside the model's parameter space.
    #[error("the parameters {point:?} do not fit {model}: wrong number of values, or a value outside its bounds")]
    Point {
        /// As given.
        point: Vec<f64>,
        /// The model.
        model: &'static str,
    },
    /// Larger than a blob or the memory can hold.
    #[error("{what} has {found} pixels, more than the limit of {limit}: {remedy}")]
    TooLarge {
        /// What is too large.
        what: &'static str,
        /// Its pixels.
        found: usize,
        /// The largest number allowed.
        limit: usize,
        /// How to make it smaller.
        remedy: &'static str,
    },
}

/// Refuses parameter vectors outside the model's bounds.
pub(super) fn check_points<'a>(
    model: &'static dyn Model,
    points: impl Iterator<Item = &'a Vec<f64>>,
) -> Result<(), FitError> {
    let (lower, upper) = flat_bounds(model.parameters());
    let is_inside = |point: &Vec<f64>| {
        point.len() == lower.len() && point.iter().zip(lower.iter().zip(&upper)).all(|(x, (l, u))| (l..=u).contains(&x))
    };
    for point in points {
        if !is_inside(point) {
            return Err(FitError::Point { point: point.clone(), model: model.name() });
        }
    }
    Ok(())
}

/// Refuses inputs that would not fit into a blob or into memory, before any work is done.
pub(super) fn check_sizes(capture: &Capture, method: &Method) -> Result<(), FitError> {
    let size = |image: &Image| image.width() * image.height();
    let map = capture.environment();
    let usable = if method.samples == SampleCount::Full { capture.counts().usable } else { 0 };
    let checks = [
        ("the photo", size(capture.photo()), MOST_PHOTO, "crop it around the object, or scale it down"),
        ("the environment map", map.width() * map.height(), MOST_MAP, "scale it down"),
        ("the full set of samples", usable, MOST_FULL, "scale the photo down, or draw a number of samples"),
    ];
    for (what, found, limit, remedy) in checks {
        if found > limit {
            return Err(FitError::TooLarge { what, found, limit, remedy });
        }
    }
    if let Integration::Direct { samples } = method.integration {
        let pixels = match method.samples {
            SampleCount::Draws(draws) => draws as usize,
            SampleCount::Full => usable,
        };
        if (pixels as u64).saturating_mul(u64::from(samples)) > MOST_DIRECT {
            return Err(FitError::DirectTooLarge { pixels, samples });
        }
    }
    Ok(())
}

/// Most samples of one evaluation by the direct integrator, a second or less: the coordinator repeats one evaluation of every
/// search, and its event loop is blocked meanwhile.
const MOST_DIRECT: u64 = 1 << 20;
/// Most pixels of a photo: its pictures (32 bytes per pixel) are sent in one blob, its table in [`MAX_INPUTS`] shards.
const MOST_PHOTO: usize = 8_000_000;
/// Most texels of a map, 12 bytes each in one blob.
const MOST_MAP: usize = 20_000_000;
/// Most pixels of stage one: their table takes about 1.2 kB per pixel, and more than one copy exists at a time.
const MOST_FULL: usize = 200_000;

const _: () = assert!(MOST_PHOTO * 32 < MAX_BLOB_BYTES && MOST_PHOTO / FULL_SHARD + 2 < MAX_INPUTS);
const _: () = assert!(MOST_MAP * 12 < MAX_BLOB_BYTES);
