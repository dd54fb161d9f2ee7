//! What a study measures: one flat table of scored matches, which every section of the report picks its own from.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A match and how it was scored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Name of the measured material.
    pub material: String,
    /// Name of the light that it was fitted under.
    pub probe: String,
    /// Name of the light that it was scored under: `probe`, or one held out.
    pub shown: String,
    /// The BRDF model.
    pub model: String,
    /// How the parameters were found.
    pub method: Method,
    /// Pixels that stage one drew; none where it saw all, or there was no stage one.
    pub samples: Option<u32>,
    /// How they were drawn: `importance`, `stratified`, `uniform`.
    pub sampling: String,
    /// Whether Eq. 1 saw values clamped to what a display can show.
    pub clamped: bool,
    /// Independent subsets of pixels.
    pub subsets: u32,
    /// Columns and rows of the images that were scored.
    pub size: u32,
    /// Columns and rows of the images that were searched on: smaller than `size` for `lowres`.
    pub searched_size: u32,
    /// Seed of the subset.
    pub seed: u64,
    /// How many exponents were tried; 0 where there are none.
    #[serde(default)]
    pub gammas: u32,
    /// The exponent: of the candidate, or of the winner.
    pub gamma: Option<f64>,
    /// Name of the start, where a method has several.
    pub start: Option<String>,
    /// Eq. 1 on the subset, of a candidate.
    pub cost: Option<f64>,
    /// How it was scored: `cssim`, or the name of a variant.
    pub metric: String,
    /// The score, by `metric`.
    pub cssim: f64,
    /// CSSIM over windows centred on the object; none of a variant.
    pub cssim_object: Option<f64>,
    /// Evaluations of what was minimised: Eq. 1, or CSSIM.
    pub evaluations: u64,
    /// Seconds of one core that it took to find the parameters, the tables that it needed included.
    pub cpu_seconds: f64,
    /// Those of them that stage two took, its table included; none of a method without it.
    #[serde(default)]
    pub stage_two_seconds: Option<f64>,
    /// The parameters by their flat name: `kd.r`, `alpha`.
    pub parameters: BTreeMap<String, f64>,
}

/// How parameters were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Method {
    /// Two stages: least squares, 21 gammas, the winner by CSSIM.
    #[serde(rename = "ours")]
    Ours,
    /// `Ours`, then polished on CSSIM.
    #[serde(rename = "ours+polish")]
    OursPolished,
    /// The best candidate of `Ours` of the gammas that are far from the winner's.
    #[serde(rename = "runner-up")]
    RunnerUp,
    /// The candidate of one gamma of `Ours`: one row for each.
    #[serde(rename = "candidate")]
    Candidate,
    /// `Ours` with several subsets of pixels.
    #[serde(rename = "subsets")]
    Subsets,
    /// `Subsets`, then polished.
    #[serde(rename = "subsets+polish")]
    SubsetsPolished,
    /// The paper's two stages: Cook-Torrance, pattern search from one start, 21 gammas, no polish.
    #[serde(rename = "paper")]
    Paper,
    /// Gamma 1 alone: least squares on radiance.
    #[serde(rename = "l2")]
    L2,
    /// The logarithm of radiance instead of a power, alone.
    #[serde(rename = "log")]
    Log,
    /// Gamma 3 alone.
    #[serde(rename = "cuberoot")]
    CubeRoot,
    /// Pattern search on CSSIM at full resolution; one row per start.
    #[serde(rename = "brute")]
    Brute,
    /// Pattern search on CSSIM at `searched_size`, rendered again at `size`.
    #[serde(rename = "lowres")]
    LowRes,
    /// As `Brute`, every evaluation rendered by the direct integrator.
    #[serde(rename = "brute-direct")]
    BruteDirect,
}

impl Method {
    /// The name that results carry.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ours => "ours",
            Self::OursPolished => "ours+polish",
            Self::RunnerUp => "runner-up",
            Self::Candidate => "candidate",
            Self::Subsets => "subsets",
            Self::SubsetsPolished => "subsets+polish",
            Self::Paper => "paper",
            Self::L2 => "l2",
            Self::Log => "log",
            Self::CubeRoot => "cuberoot",
            Self::Brute => "brute",
            Self::LowRes => "lowres",
            Self::BruteDirect => "brute-direct",
        }
    }
}

/// What one evaluation of brute force costs without tables: one rendering by the direct integrator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DirectCost {
    /// Name of the measured material.
    pub material: String,
    /// Name of the light.
    pub probe: String,
    /// The BRDF model.
    pub model: String,
    /// Columns and rows.
    pub size: u32,
    /// Samples per pixel.
    pub samples_per_pixel: u32,
    /// Seconds of one core, of each rendering; their parameters are those of the candidates.
    pub seconds: Vec<f64>,
}

/// How well Eq. 1 ranks matches as CSSIM does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// Name of the measured material.
    pub material: String,
    /// Name of the light.
    pub probe: String,
    /// The exponent of Eq. 1, over all pixels.
    pub gamma: f64,
    /// Spearman's rank correlation with CSSIM.
    pub spearman: f64,
    /// The number of matches that were ranked.
    pub matches: u32,
}

/// A photo of the study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Photo {
    /// Name of the measured material.
    pub material: String,
    /// Name of the light.
    pub probe: String,
    /// Columns and rows.
    pub size: u32,
    /// Standard error of a typical pixel relative to its own luminance.
    pub noise: Option<f64>,
    /// Exposure before the metric.
    pub exposure: f64,
}

/// What made the study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// The command line that repeats it.
    pub command: String,
    /// Version of the program.
    pub version: String,
    /// Processor and cores of the coordinator's machine.
    pub machine: String,
    /// Seconds that the run took; of the last run, when it was gone on with.
    pub seconds: f64,
    /// Workers that joined.
    pub workers: u32,
    /// The study file as it was read.
    pub study: String,
    /// Materials in their order.
    pub materials: Vec<String>,
    /// The materials of the paper's six, in their order.
    pub six: Vec<String>,
    /// Lights that were fitted under, in their order.
    pub probes: Vec<String>,
    /// Lights that were only scored under.
    pub held_out: Vec<String>,
    /// Size of the grid.
    pub size: u32,
    /// The model of the grid.
    #[serde(default)]
    pub model: String,
    /// The seed of the grid.
    #[serde(default)]
    pub seed: u64,
}

/// All that a study has measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StudyData {
    /// What made it.
    pub about: About,
    /// Photos.
    pub photos: Vec<Photo>,
    /// Matches.
    pub rows: Vec<Row>,
    /// Costs of direct renderings.
    pub direct: Vec<DirectCost>,
    /// Rank agreements.
    pub agreements: Vec<Agreement>,
}

/// How far the gamma of a runner-up is from the winner's: those beside it have found the same match.
pub const APART: f64 = 0.5;
