//! Wire forms of the method's inputs and outputs: plain data, which is checked when it is decoded into the library's types.

use crate::{
    brdf::{self, Lobe, Model, flat_bounds},
    fit::{Candidate, Judged, Polished, SearchFailure},
    graph::NodeFailure,
    image::Image,
    light::Environment,
    metric::Score,
    protocol::{decode, encode},
    render::{
        knots::Knots,
        spans::LobeKnots,
        subset::PixelSubset,
        table::{LobeTable, TransportTable},
        transport::Pixel,
    },
    search::{Termination, pattern::Minimum},
};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

/// Decodes a payload; an error becomes the node's failure.
pub(crate) fn read<T: DeserializeOwned>(what: &str, bytes: &[u8]) -> Result<T, NodeFailure> {
    decode(bytes).map_err(|error| NodeFailure::new(format!("{what}: {error}")))
}

/// Encodes a payload.
pub(crate) fn write<T: Serialize>(what: &str, value: &T) -> Result<Vec<u8>, NodeFailure> {
    encode(value).map_err(|error| NodeFailure::new(format!("{what}: {error}")))
}

fn refused(what: &str, found: impl std::fmt::Display) -> NodeFailure {
    NodeFailure::new(format!("{what}: {found}; was it written by another version?"))
}

fn index(value: usize) -> u32 {
    u32::try_from(value).unwrap_or(u32::MAX)
}

/// An image.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct ImageWire {
    width: u32,
    height: u32,
    pixels: Vec<[f32; 3]>,
}

impl ImageWire {
    pub(crate) fn of(image: &Image) -> Self {
        Self { width: index(image.width()), height: index(image.height()), pixels: image.pixels().to_vec() }
    }

    pub(crate) fn image(self) -> Result<Image, NodeFailure> {
        let (width, height) = (self.width as usize, self.height as usize);
        if width.checked_mul(height) != Some(self.pixels.len()) {
            let found = self.pixels.len();
            return Err(refused("image", format!("expected {width} x {height} pixels, found {found}")));
        }
        Ok(Image::from_pixels(width, height, self.pixels))
    }
}

/// An environment map.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct EnvironmentWire {
    rotation_deg: f64,
    image: ImageWire,
}

impl EnvironmentWire {
    pub(crate) fn of(environment: &Environment) -> Self {
        Self { rotation_deg: environment.rotation_deg(), image: ImageWire::of(&environment.to_image()) }
    }

    pub(crate) fn environment(self) -> Result<Environment, NodeFailure> {
        let map = Environment::new(self.image.image()?).map_err(|error| refused("environment", error))?;
        Ok(map.rotated(self.rotation_deg))
    }
}

/// The pixels of stage one with their weights and the photo's values there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct SubsetWire {
    pub(crate) pixels: Vec<Pixel>,
    pub(crate) weights: Vec<f64>,
    pub(crate) photo: Vec<[f32; 3]>,
}

impl SubsetWire {
    pub(crate) fn subset(&self) -> Result<PixelSubset, NodeFailure> {
        if self.weights.len() != self.pixels.len() || self.photo.len() != self.pixels.len() {
            return Err(refused("pixel subset", "pixels, weights and values differ in number"));
        }
        Ok(PixelSubset { pixels: self.pixels.clone(), weights: self.weights.clone() })
    }
}

/// A grid of widths.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct KnotsWire(f64, f64, u32);

impl KnotsWire {
    pub(crate) fn of(knots: &Knots) -> Self {
        let (first, step, count) = knots.to_parts();
        Self(first, step, index(count))
    }

    pub(crate) fn knots(self) -> Result<Knots, NodeFailure> {
        Knots::from_parts(self.0, self.1, self.2 as usize).ok_or_else(|| refused("knots", format!("{self:?}")))
    }
}

/// A lobe of a table, by its name, with its grid of widths.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct LobeWire(String, Option<KnotsWire>);

impl LobeWire {
    pub(crate) fn of(LobeKnots { lobe, knots }: &LobeKnots) -> Self {
        Self(lobe.name().to_owned(), knots.as_ref().map(KnotsWire::of))
    }

    pub(crate) fn lobe(self) -> Result<LobeKnots, NodeFailure> {
        let has_widths = |lobe: &&dyn Lobe| lobe.equivalent_alpha(1.0).is_some() == self.1.is_some();
        let lobe = brdf::lobe(&self.0).filter(has_widths).ok_or_else(|| refused("lobe", &self.0))?;
        Ok(LobeKnots { lobe, knots: self.1.map(KnotsWire::knots).transpose()? })
    }
}

/// A transport table.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct TableWire {
    pixels: u32,
    lobes: Vec<LobeTableWire>,
}

#[derive(Debug, Serialize, Deserialize)]
struct LobeTableWire {
    lobe: String,
    knots: Option<KnotsWire>,
    terms: u32,
    values: Vec<f32>,
}

impl TableWire {
    pub(crate) fn of(table: TransportTable) -> Self {
        let lobes = table.lobes.into_iter().map(|lobe| LobeTableWire {
            lobe: lobe.lobe,
            knots: lobe.knots.as_ref().map(KnotsWire::of),
            terms: index(lobe.terms),
            values: lobe.values,
        });
        Self { pixels: index(table.pixels), lobes: lobes.collect() }
    }

    pub(crate) fn table(self) -> Result<TransportTable, NodeFailure> {
        let pixels = self.pixels as usize;
        let lobe = |lobe: LobeTableWire| {
            let knots = lobe.knots.map(KnotsWire::knots).transpose()?;
            let table = LobeTable { lobe: lobe.lobe, knots, terms: lobe.terms as usize, values: lobe.values };
            let expected = table.slices().checked_mul(3 * table.terms).and_then(|n| n.checked_mul(pixels));
            if expected != Some(table.values.len()) {
                let found = table.values.len();
                return Err(refused("transport table", format!("expected {expected:?} values, found {found}")));
            }
            Ok(table)
        };
        Ok(TransportTable { pixels, lobes: self.lobes.into_iter().map(lobe).collect::<Result<_, _>>()? })
    }
}

/// A candidate of stage one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct CandidateWire {
    gamma: f64,
    subset: u32,
    parameters: Vec<f64>,
    cost: f64,
    evaluations: u64,
    termination: String,
}

impl CandidateWire {
    pub(crate) fn of(candidate: &Candidate) -> Self {
        Self {
            gamma: candidate.gamma,
            subset: candidate.subset,
            parameters: candidate.parameters.clone(),
            cost: candidate.cost,
            evaluations: candidate.evaluations as u64,
            termination: candidate.termination.name().to_owned(),
        }
    }

    /// The candidate, after a check that its parameters are those of `model`: the right number, finite and inside their bounds.
    pub(crate) fn candidate(self, model: &dyn Model) -> Result<Candidate, NodeFailure> {
        check_parameters("candidate", model, &self.parameters)?;
        if !self.cost.is_finite() {
            return Err(refused("candidate", format!("a cost of {}", self.cost)));
        }
        Ok(Candidate {
            gamma: self.gamma,
            subset: self.subset,
            parameters: self.parameters,
            cost: self.cost,
            evaluations: usize::try_from(self.evaluations).map_err(|_| refused("candidate", self.evaluations))?,
            termination: termination(&self.termination)?,
        })
    }
}

/// The scores of the candidates, in order: over the whole image, over the object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct ScoresWire(pub(crate) Vec<(f64, f64)>);

impl ScoresWire {
    pub(crate) fn of(judged: &[Judged]) -> Self {
        Self(judged.iter().map(|j| (j.cssim, j.cssim_object)).collect())
    }
}

/// The outcome of polish.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct PolishedWire {
    parameters: Vec<f64>,
    cssim: f64,
    cssim_object: f64,
    evaluations: u64,
    termination: String,
    at_table_edge: bool,
}

impl PolishedWire {
    pub(crate) fn of(polished: Polished) -> Self {
        Self {
            parameters: polished.parameters,
            cssim: polished.cssim,
            cssim_object: polished.cssim_object,
            evaluations: polished.evaluations as u64,
            termination: polished.termination.name().to_owned(),
            at_table_edge: polished.at_table_edge,
        }
    }

    /// The minimum of a pattern search on the score.
    pub(crate) fn of_minimum(minimum: Minimum, score: &Score) -> Self {
        Self {
            parameters: minimum.point,
            cssim: score.cssim,
            cssim_object: score.cssim_object,
            evaluations: minimum.evaluations as u64,
            termination: minimum.termination.name().to_owned(),
            at_table_edge: false,
        }
    }

    /// The outcome, after a check that its parameters are those of `model`.
    pub(crate) fn polished(self, model: &dyn Model) -> Result<Polished, NodeFailure> {
        check_parameters("polish", model, &self.parameters)?;
        Ok(Polished {
            parameters: self.parameters,
            cssim: self.cssim,
            cssim_object: self.cssim_object,
            evaluations: usize::try_from(self.evaluations).map_err(|_| refused("polish", self.evaluations))?,
            termination: termination(&self.termination)?,
            at_table_edge: self.at_table_edge,
        })
    }
}

pub(crate) fn check_parameters(what: &str, model: &dyn Model, parameters: &[f64]) -> Result<(), NodeFailure> {
    let (lower, upper) = flat_bounds(model.parameters());
    let inside = parameters.iter().zip(lower.iter().zip(&upper)).all(|(p, (l, u))| (l..=u).contains(&p));
    if parameters.len() != lower.len() || !inside {
        return Err(refused(what, format!("the parameters {parameters:?} do not fit {}", model.name())));
    }
    Ok(())
}

fn termination(name: &str) -> Result<Termination, NodeFailure> {
    Termination::from_name(name).ok_or_else(|| refused("termination", format!("{name:?}")))
}

impl From<SearchFailure> for NodeFailure {
    fn from(failure: SearchFailure) -> Self {
        Self::new(failure.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Ggx;

    #[test]
    fn a_table_survives_the_wire_and_a_short_one_is_refused() {
        let knots = Knots::covering(0.1, 0.4, 5.0);
        let table = TransportTable {
            pixels: 2,
            lobes: vec![
                LobeTable { lobe: "lambert".to_owned(), knots: None, terms: 1, values: vec![0.5; 6] },
                LobeTable {
                    lobe: "ggx".to_owned(),
                    knots: Some(knots),
                    terms: 2,
                    values: vec![0.25; knots.count() * 12],
                },
            ],
        };
        let bytes = write("table", &TableWire::of(table.clone())).unwrap();
        assert_eq!(read::<TableWire>("table", &bytes).unwrap().table().unwrap(), table);
        let mut short = TableWire::of(table);
        short.lobes[1].values.pop();
        assert!(short.table().unwrap_err().to_string().contains("expected"));
        assert!(read::<TableWire>("table", &bytes[..bytes.len() - 1]).is_err());
    }

    #[test]
    fn hostile_sizes_are_refused() {
        let image = ImageWire { width: u32::MAX, height: u32::MAX, pixels: vec![[0.0; 3]] };
        assert!(image.image().unwrap_err().to_string().contains("found 1"));
        assert!(KnotsWire(0.0, -1.0, 10).knots().is_err());
        let candidate = CandidateWire {
            gamma: 1.0,
            subset: 0,
            parameters: vec![],
            cost: 0.0,
            evaluations: 1,
            termination: "because".to_owned(),
        };
        assert!(candidate.clone().candidate(&Ggx).unwrap_err().to_string().contains("do not fit ggx"));
        let inside = CandidateWire { parameters: vec![0.5; 8], ..candidate };
        assert!(inside.clone().candidate(&Ggx).unwrap_err().to_string().contains("because"));
        let outside = CandidateWire { parameters: vec![f64::NAN; 8], ..inside };
        assert!(outside.candidate(&Ggx).unwrap_err().to_string().contains("do not fit ggx"));
    }
}
