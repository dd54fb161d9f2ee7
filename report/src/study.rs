//! Selects the rows of a section from the flat table.

use crate::measured::{Method, Row, StudyData};
use lookalike::brdf::{DEFAULT_MODEL, PAPER_MODEL};
use std::collections::{BTreeMap, BTreeSet};

/// The name of the metric whose scores are CSSIM.
pub(super) const CSSIM: &str = "cssim";

/// The pixels of stage one by default, and in the paper.
const SAMPLES: u32 = 256;

/// The data of a study, and the settings common to its grid.
#[derive(Debug)]
pub(super) struct Study<'a> {
    /// All measurements.
    pub(super) data: &'a StudyData,
    /// Names of the files in `pictures/`.
    pub(super) pictures: BTreeSet<String>,
    /// The model of the grid.
    pub(super) model: String,
    /// The pixels of stage one in the grid.
    pub(super) samples: Option<u32>,
    /// The seed of the grid.
    pub(super) seed: u64,
}

/// A selection of rows; [`Study::pick`] makes one with the settings of the grid.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Pick<'a> {
    pub(super) method: Method,
    pub(super) material: &'a str,
    pub(super) probe: &'a str,
    pub(super) shown: &'a str,
    pub(super) size: u32,
    pub(super) samples: Option<u32>,
    pub(super) sampling: &'a str,
    pub(super) seed: u64,
    pub(super) clamped: bool,
    pub(super) searched_size: Option<u32>,
    pub(super) metric: &'a str,
    pub(super) model: Option<&'a str>,
}

/// The best of the selected rows, and the total cost of all of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Match<'a> {
    /// The row of the lowest score.
    pub(super) row: &'a Row,
    /// Its score.
    pub(super) cssim: f64,
    /// Core-seconds of all starts.
    pub(super) cpu_seconds: f64,
    /// Evaluations, of all starts.
    pub(super) evaluations: u64,
}

impl<'a> Study<'a> {
    /// Takes the model and the seed of the grid from `about`, or, if it has none, those of most two-stage matches. The number of samples
    /// is 256 if any match has it, otherwise that of most matches.
    pub(super) fn new(data: &'a StudyData, pictures: BTreeSet<String>) -> Self {
        let grid: Vec<&Row> = data
            .rows
            .iter()
            .filter(|row| matches!(row.method, Method::Ours | Method::OursPolished) && on_grid(row, data.about.size))
            .collect();
        let usual = data.rows.iter().filter_map(|row| row.samples).find(|samples| *samples == SAMPLES);
        let samples = usual.or_else(|| commonest(grid.iter().filter_map(|row| row.samples), |_| false));
        let about = &data.about;
        if !about.model.is_empty() {
            return Self { data, pictures, model: about.model.clone(), samples, seed: about.seed };
        }
        let drawn = || grid.iter().filter(|row| row.samples == samples);
        let model = commonest(drawn().map(|row| row.model.clone()), |model| model == DEFAULT_MODEL.name());
        let seed = commonest(drawn().map(|row| row.seed), |_| false);
        Self { data, pictures, model: model.unwrap_or_default(), samples, seed: seed.unwrap_or(0) }
    }

    /// Every material under every light of the fits, in the study's order, with or without a match.
    pub(super) fn places(&self) -> Vec<(&'a str, &'a str)> {
        let about = &self.data.about;
        let under = |material: &'a String| about.probes.iter().map(move |probe| (material.as_str(), probe.as_str()));
        about.materials.iter().flat_map(under).collect()
    }

    /// The cells of the paper's six materials; all cells if the study does not name the six.
    pub(super) fn six(&self) -> Vec<(&'a str, &'a str)> {
        let six = &self.data.about.six;
        if six.is_empty() { self.cells() } else { self.cells_of(six) }
    }

    /// Materials and lights of the grid that have a match, in the study's order.
    pub(super) fn cells(&self) -> Vec<(&'a str, &'a str)> {
        self.cells_of(&self.data.about.materials)
    }

    /// The cells of some materials, with every light of the fits.
    pub(super) fn cells_of(&self, materials: &'a [String]) -> Vec<(&'a str, &'a str)> {
        let there: BTreeSet<(&str, &str)> = self
            .data
            .rows
            .iter()
            .filter(|row| on_grid(row, self.size()))
            .map(|row| (row.material.as_str(), row.probe.as_str()))
            .collect();
        let probes = &self.data.about.probes;
        let all =
            materials.iter().flat_map(|material| probes.iter().map(move |probe| (material.as_str(), probe.as_str())));
        all.filter(|cell| there.contains(cell)).collect()
    }

    /// Side of the grid's images, in pixels.
    pub(super) const fn size(&self) -> u32 {
        self.data.about.size
    }

    /// The grid's rows of a method in a cell.
    pub(super) fn pick<'b>(&'b self, method: Method, (material, probe): (&'b str, &'b str)) -> Pick<'b> {
        Pick {
            method,
            material,
            probe,
            shown: probe,
            size: self.size(),
            samples: self.samples,
            sampling: "importance",
            seed: self.seed,
            clamped: false,
            searched_size: None,
            metric: CSSIM,
            model: None,
        }
    }

    /// The selected rows, in the order of the data. Without a model in the selection: the rows of the grid's model, or of the method's first.
    pub(super) fn rows(&self, pick: &Pick<'_>) -> Vec<&'a Row> {
        let rows: Vec<&Row> = self.data.rows.iter().filter(|row| pick.admits(row)).collect();
        let models: BTreeSet<&str> = rows.iter().map(|row| row.model.as_str()).collect();
        let usual = if pick.method == Method::Paper { PAPER_MODEL.name() } else { &self.model };
        let model = pick.model.or_else(|| models.get(usual).copied()).or_else(|| models.first().copied());
        rows.into_iter().filter(|row| Some(row.model.as_str()) == model).collect()
    }

    /// The best of the selected rows.
    pub(super) fn find(&self, pick: &Pick<'_>) -> Option<Match<'a>> {
        Match::best(&self.rows(pick))
    }

    /// The best of a method in a cell of the grid.
    pub(super) fn grid(&self, method: Method, cell: (&str, &str)) -> Option<Match<'a>> {
        self.find(&self.pick(method, cell))
    }

    /// Scores of two methods in the cells that have both: `(first, second)`.
    pub(super) fn pairs(&self, first: Method, second: Method) -> Vec<((&'a str, &'a str), f64, f64)> {
        let both = |cell| Some((cell, self.grid(first, cell)?.cssim, self.grid(second, cell)?.cssim));
        self.cells().into_iter().filter_map(both).collect()
    }

    /// The file of a picture, if it exists.
    pub(super) fn picture(&self, (material, probe): (&str, &str), size: u32, what: &str) -> Option<String> {
        self.existing(format!("{material}-{probe}-{size}-{what}.png"))
    }

    /// The file of a picture under a held-out light, if it exists.
    pub(super) fn held_out_picture(&self, (material, probe): (&str, &str), shown: &str, what: &str) -> Option<String> {
        self.existing(format!("{material}-{probe}-at-{shown}-{}-{what}.png", self.size()))
    }

    fn existing(&self, name: String) -> Option<String> {
        self.pictures.contains(&name).then_some(name)
    }
}

impl Pick<'_> {
    /// Whether a row is selected. Settings that its method does not have are not compared.
    fn admits(&self, row: &Row) -> bool {
        let place = row.material == self.material && row.probe == self.probe && row.shown == self.shown;
        let scored = row.size == self.size && row.metric == self.metric && row.cssim.is_finite();
        let searched = self.searched_size.is_none_or(|size| row.searched_size == size);
        let model = self.model.is_none_or(|model| row.model == model);
        let one_stage = matches!(row.method, Method::Brute | Method::LowRes | Method::BruteDirect);
        let several = matches!(row.method, Method::Subsets | Method::SubsetsPolished);
        let drawn = row.samples.is_none() || row.sampling == self.sampling && row.seed == self.seed;
        let subset = row.samples == self.samples && drawn && (several || row.subsets <= 1);
        // A match that is scored under another light or by another metric is identified by its cell and method.
        let again = row.shown != row.probe || row.metric != CSSIM;
        let stage_one = one_stage || again || subset && row.clamped == self.clamped;
        row.method == self.method && place && scored && searched && model && stage_one
    }
}

impl<'a> Match<'a> {
    /// The best of several starts. Of a match without starts the first row, as several experiments may have found the same match.
    pub(super) fn best(rows: &[&'a Row]) -> Option<Self> {
        let first = *rows.first()?;
        let row = rows.iter().copied().min_by(|a, b| a.cssim.total_cmp(&b.cssim))?;
        if row.start.is_none() {
            return Some(Self {
                row: first,
                cssim: first.cssim,
                cpu_seconds: first.cpu_seconds,
                evaluations: first.evaluations,
            });
        }
        let cpu_seconds = rows.iter().map(|row| row.cpu_seconds).sum();
        Some(Self { row, cssim: row.cssim, cpu_seconds, evaluations: rows.iter().map(|row| row.evaluations).sum() })
    }
}

/// Whether a row is a match with one subset under the light of its fit, at the grid's size.
fn on_grid(row: &Row, size: u32) -> bool {
    row.shown == row.probe && row.metric == CSSIM && row.size == size && !row.clamped
}

/// The most frequent value; of equally frequent ones the preferred one, otherwise the least.
fn commonest<T: Ord + Clone>(values: impl Iterator<Item = T>, preferred: impl Fn(&T) -> bool) -> Option<T> {
    let mut counts: BTreeMap<T, usize> = BTreeMap::new();
    values.for_each(|value| *counts.entry(value).or_default() += 1);
    let most = counts.values().copied().max()?;
    let equals: Vec<&T> = counts.iter().filter(|(_, count)| **count == most).map(|(value, _)| value).collect();
    equals.iter().copied().find(|value| preferred(value)).or_else(|| equals.first().copied()).cloned()
}
