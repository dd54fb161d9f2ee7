//! The measurements of a study: one flat table of scored matches, from which every section of the report selects its rows.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A match with its score.
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
    /// Pixels that stage one drew; `None` if it used all pixels, or if there was no stage one.
    pub samples: Option<u32>,
    /// How these pixels were drawn: `importance`, `stratified`, `uniform`.
    pub sampling: String,
    /// Whether Eq. 1 used values clamped to the range of a display.
    pub clamped: bool,
    /// Independent subsets of pixels.
    pub subsets: u32,
    /// Side of the scored images, in pixels.
    pub size: u32,
    /// Side of the images that were searched on, in pixels: smaller than `size` for `lowres`.
    pub searched_size: u32,
    /// Seed of the subset.
    pub seed: u64,
    /// Number of gammas that were tried; 0 for a method without gamma.
    #[serde(default)]
    pub gammas: u32,
    /// The gamma of the candidate or of the winner.
    pub gamma: Option<f64>,
    /// Name of the start, if a method has several.
    pub start: Option<String>,
    /// Value of Eq. 1 on the subset, for a candidate.
    pub cost: Option<f64>,
    /// The metric of the score: `cssim`, or the name of a variant.
    pub metric: String,
    /// The score, by `metric`.
    pub cssim: f64,
    /// CSSIM over windows centred on the object; `None` for a variant.
    pub cssim_object: Option<f64>,
    /// Evaluations of the minimised function: Eq. 1 or CSSIM.
    pub evaluations: u64,
    /// Core-seconds to find the parameters, including the tables that this needed.
    pub cpu_seconds: f64,
    /// Core-seconds of stage two within `cpu_seconds`, including its table; `None` for a method without stage two.
    #[serde(default)]
    pub stage_two_seconds: Option<f64>,
    /// The parameters by their flat names, such as `kd.r` and `alpha`.
    pub parameters: BTreeMap<String, f64>,
}

/// The method by which parameters were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Method {
    /// Two stages: least squares, 21 gammas, the winner by CSSIM.
    #[serde(rename = "ours")]
    Ours,
    /// `Ours`, then polished on CSSIM.
    #[serde(rename = "ours+polish")]
    OursPolished,
    /// The best candidate of `Ours` among the gammas that are far from the winner's.
    #[serde(rename = "runner-up")]
    RunnerUp,
    /// The candidate of one gamma of `Ours`; one row per gamma.
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
    /// Only gamma 1: least squares on radiance.
    #[serde(rename = "l2")]
    L2,
    /// Only the logarithm of radiance instead of a power.
    #[serde(rename = "log")]
    Log,
    /// Only gamma 3.
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
    /// The name of the method in results.
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

/// The time of one evaluation of brute force without tables: one rendering by the direct integrator.
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
    /// Core-seconds of each rendering, at the parameters of the candidates.
    pub seconds: Vec<f64>,
}

/// The agreement of Eq. 1 with CSSIM in the ranking of matches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// Name of the measured material.
    pub material: String,
    /// Name of the light.
    pub probe: String,
    /// The gamma of Eq. 1, which is summed over all pixels.
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

/// How the study was made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// The command line that repeats it.
    pub command: String,
    /// Version of the program.
    pub version: String,
    /// Processor and cores of the coordinator's machine.
    pub machine: String,
    /// Wall-clock seconds of the run; of the last part if it was resumed.
    pub seconds: f64,
    /// Workers that joined.
    pub workers: u32,
    /// The study file as it was read.
    pub study: String,
    /// Materials in the study's order.
    pub materials: Vec<String>,
    /// Those materials that are among the paper's six, in order.
    pub six: Vec<String>,
    /// Lights of the fits, in order.
    pub probes: Vec<String>,
    /// Lights under which matches were only scored.
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

/// All measurements of a study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StudyData {
    /// How the study was made.
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

/// Smallest distance of a runner-up's gamma from the winner's, because neighbouring gammas find the same match.
pub const APART: f64 = 0.5;
