//! Reads STUDY.toml: materials, lights and experiments.

use anyhow::{Context, bail, ensure};
use glob::{MatchOptions, Pattern};
use lookalike::brdf;
use serde::Deserialize;
use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

/// The content of a study's file. docs/study.md explains every key.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct StudyFile {
    /// Measured materials: files in MERL's format, or glob patterns.
    materials: Vec<String>,
    /// Lights to fit under.
    probes: Vec<String>,
    /// Lights under which matches are shown and to which none are fitted.
    #[serde(default)]
    held_out: Vec<String>,
    /// The materials of the paper's tables, by name. Default: the first six.
    #[serde(default)]
    pub(super) six: Vec<String>,
    /// The model of most experiments.
    #[serde(default = "default_model")]
    pub(super) model: String,
    /// Further models for the table of models, on every material under every probe.
    #[serde(default)]
    pub(super) models: Vec<String>,
    /// Further models, only on the materials and under the light of the experiments that repeat.
    #[serde(default)]
    pub(super) more_models: Vec<String>,
    /// Columns and rows of the photos.
    #[serde(default = "default_size")]
    pub(super) size: u32,
    /// Columns and rows of the photos of `large-cells`.
    #[serde(default = "default_large")]
    pub(super) large: u32,
    /// Pairs of material and probe that are also fitted at the size `large`.
    #[serde(default)]
    pub(super) large_cells: Vec<[String; 2]>,
    /// Sizes of low-resolution brute force. Only those below `size` (or `large`, for its cells) are used.
    #[serde(default = "default_low")]
    pub(super) low_resolutions: Vec<u32>,
    /// Samples per pixel of photos.
    #[serde(default = "default_photo_samples")]
    pub(super) photo_samples: u32,
    /// Samples per pixel of direct renderings. Brute force is charged their cost.
    #[serde(default = "default_direct_samples")]
    pub(super) direct_samples: u32,
    /// Columns and rows of the photo for brute force without tables; 0 skips it.
    #[serde(default)]
    pub(super) direct_size: u32,
    /// The number of seeds of the experiments that repeat.
    #[serde(default = "default_seeds")]
    pub(super) seeds: u32,
    /// The gammas of fits to all pixels, which take minutes. Default: those of all fits.
    #[serde(default)]
    pub(super) full_gammas: Vec<f64>,
    /// The light of the experiments that repeat, of models and of subsets, by name. Default: the first probe.
    #[serde(default)]
    pub(super) repeat_probe: String,
    /// The materials of the experiments that repeat and of the ways to draw pixels, by name. Default: the first three of `six`.
    #[serde(default)]
    pub(super) repeat_materials: Vec<String>,
    /// The seed of everything else.
    #[serde(default)]
    pub(super) seed: u64,
    /// Experiments. Default: all.
    #[serde(default = "all_experiments")]
    experiments: BTreeSet<Experiment>,
}

/// An experiment of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Experiment {
    /// Every material under every probe by every method.
    Methods,
    /// Gammas beyond 3.
    Gamma,
    /// 32, 64 and all pixels.
    Samples,
    /// Matches under other lights.
    HeldOut,
    /// Brute force at low resolution.
    LowResolution,
    /// Other ways to draw pixels.
    Sampling,
    /// Eq. 1 clamped to the display.
    Clamped,
    /// Other models.
    Models,
    /// Spread over seeds.
    Spread,
    /// Rank agreement of Eq. 1 with CSSIM.
    Agreement,
    /// Several subsets of pixels.
    Subsets,
    /// The cost of direct renderings.
    Direct,
}

impl Experiment {
    const ALL: [Self; 12] = [
        Self::Methods,
        Self::Gamma,
        Self::Samples,
        Self::HeldOut,
        Self::LowResolution,
        Self::Sampling,
        Self::Clamped,
        Self::Models,
        Self::Spread,
        Self::Agreement,
        Self::Subsets,
        Self::Direct,
    ];
}

/// A study whose files were found.
#[derive(Debug, Clone)]
pub(super) struct Study {
    pub(super) file: StudyFile,
    /// The text of the file.
    pub(super) text: String,
    /// Measured materials by name.
    pub(super) materials: Vec<(String, PathBuf)>,
    /// Lights by name. Those to fit to come first.
    pub(super) lights: Vec<(String, PathBuf)>,
    /// The number of lights to fit to.
    pub(super) probes: usize,
}

impl Study {
    /// Reads a study and finds its files.
    ///
    /// # Errors
    /// If the file cannot be read or is not a valid study.
    pub(super) fn read(path: &Path) -> anyhow::Result<Self> {
        let text = fs::read_to_string(path).with_context(|| format!("cannot read the study {}", path.display()))?;
        let shown = path.display().to_string();
        let file: StudyFile = toml::from_str(&text).with_context(|| format!("the study {shown}"))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let materials = named(&file.materials, folder).with_context(|| format!("{shown}: materials"))?;
        let mut lights = named(&file.probes, folder).with_context(|| format!("{shown}: probes"))?;
        let probes = lights.len();
        lights.extend(named(&file.held_out, folder).with_context(|| format!("{shown}: held-out"))?);
        let mut study = Self { file, text, materials, lights, probes };
        study.fill().and_then(|()| study.check()).with_context(|| format!("the study {shown}"))?;
        Ok(study)
    }

    /// Whether the study includes an experiment.
    pub(super) fn has(&self, experiment: Experiment) -> bool {
        self.file.experiments.contains(&experiment)
    }

    /// The numbers of materials by name.
    pub(super) fn numbers(&self, names: &[String]) -> Vec<usize> {
        names.iter().filter_map(|name| self.materials.iter().position(|(known, _)| known == name)).collect()
    }

    /// The number of a light by name.
    pub(super) fn light(&self, name: &str) -> Option<usize> {
        self.lights.iter().position(|(known, _)| known == name)
    }

    fn fill(&mut self) -> anyhow::Result<()> {
        ensure!(!self.materials.is_empty(), "materials is an empty list; name at least one file in MERL's format");
        ensure!(self.probes > 0, "probes is an empty list; name at least one light to fit under");
        if self.file.six.is_empty() {
            self.file.six = self.materials.iter().take(6).map(|(name, _)| name.clone()).collect();
        }
        if self.file.repeat_materials.is_empty() {
            self.file.repeat_materials = self.file.six.iter().take(3).cloned().collect();
        }
        if self.file.repeat_probe.is_empty() {
            self.file.repeat_probe = self.lights.first().map(|(name, _)| name.clone()).context("no probes")?;
        }
        Ok(())
    }

    fn check(&self) -> anyhow::Result<()> {
        let known = |what: &str, name: &String, list: &[(String, PathBuf)]| {
            let names: Vec<&str> = list.iter().map(|(name, _)| &**name).collect();
            ensure!(names.contains(&&**name), "{what}: {name:?} is not one of {}", names.join(", "));
            Ok(())
        };
        let pairs = self.file.large_cells.iter();
        let materials = self.file.six.iter().chain(&self.file.repeat_materials).chain(pairs.clone().map(|[m, _]| m));
        for name in materials {
            known("materials", name, &self.materials)?;
        }
        let probes = std::iter::once(&self.file.repeat_probe).chain(pairs.map(|[_, probe]| probe));
        for name in probes {
            known("probes", name, &self.lights[..self.probes])?;
        }
        for list in [&self.materials, &self.lights] {
            let mut seen = BTreeSet::new();
            for (name, path) in list {
                ensure!(
                    seen.insert(name),
                    "two files are called {name:?}, the other one {}: rename one",
                    path.display()
                );
            }
        }
        for (what, list) in [("six", &self.file.six), ("repeat-materials", &self.file.repeat_materials)] {
            let distinct: BTreeSet<&String> = list.iter().collect();
            ensure!(distinct.len() == list.len(), "{what} names a material twice");
        }
        for model in std::iter::once(&self.file.model).chain(&self.file.models).chain(&self.file.more_models) {
            brdf::model(model)?;
        }
        let sizes = [self.file.size, self.file.large].into_iter().chain(self.file.low_resolutions.iter().copied());
        for size in sizes.chain((self.file.direct_size > 0).then_some(self.file.direct_size)) {
            // A fit to all pixels of a larger photo needs too much memory.
            ensure!((16..=512).contains(&size), "sizes must lie between 16 and 512 pixels, found {size}");
        }
        for (name, samples) in
            [("photo-samples", self.file.photo_samples), ("direct-samples", self.file.direct_samples)]
        {
            ensure!((1..=1 << 20).contains(&samples), "{name} must lie between 1 and 1048576, found {samples}");
        }
        let gammas = &self.file.full_gammas;
        let positive = gammas.iter().all(|gamma| *gamma > 0.0 && gamma.is_finite());
        let ascending = gammas.windows(2).all(|pair| pair[0] < pair[1]) && positive;
        ensure!(ascending, "full-gammas must be positive and ascending, found {gammas:?}");
        ensure!((1..=1000).contains(&self.file.seeds), "seeds must lie between 1 and 1000, found {}", self.file.seeds);
        Ok(())
    }
}

/// The files of names or patterns, each with its name in the study.
fn named(patterns: &[String], folder: &Path) -> anyhow::Result<Vec<(String, PathBuf)>> {
    let mut found = Vec::new();
    for text in patterns {
        let before = found.len();
        if text.contains(['*', '?', '[']) {
            let folder = folder.to_str().context("patterns need a study in a folder whose name is Unicode")?;
            let pattern = Path::new(&Pattern::escape(folder)).join(text);
            let options = MatchOptions { require_literal_separator: true, ..MatchOptions::new() };
            for path in glob::glob_with(&pattern.to_string_lossy(), options).context("malformed pattern")? {
                found.push(path?);
            }
            if found.len() == before {
                bail!("no file matches {text:?}; check the pattern");
            }
        } else {
            found.push(folder.join(text));
        }
    }
    ensure!(!found.is_empty() || patterns.is_empty(), "no files");
    found.into_iter().map(|path| Ok((name_of(&path)?, path))).collect()
}

/// The name of a file without its extension: the name in the report, in picture names and in other keys of the study.
fn name_of(path: &Path) -> anyhow::Result<String> {
    let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_' || c == '.';
    if stem.is_empty() || !stem.chars().all(is_plain) || stem.len() > 60 {
        bail!(
            "{}: names of materials and lights need letters, digits, - and _ alone, 60 at most, as they become names of files; rename it",
            path.display()
        );
    }
    Ok(stem.to_owned())
}

fn default_model() -> String {
    brdf::DEFAULT_MODEL.name().to_owned()
}

const fn default_size() -> u32 {
    128
}

const fn default_large() -> u32 {
    256
}

fn default_low() -> Vec<u32> {
    vec![32, 64, 128]
}

const fn default_photo_samples() -> u32 {
    1024
}

const fn default_direct_samples() -> u32 {
    256
}

const fn default_seeds() -> u32 {
    20
}

fn all_experiments() -> BTreeSet<Experiment> {
    Experiment::ALL.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Study, String> {
        let folder = tempfile::tempdir().unwrap();
        for name in ["gold.binary", "nickel.binary", "grace.hdr", "uffizi.hdr"] {
            fs::write(folder.path().join(name), b"").unwrap();
        }
        let path = folder.path().join("STUDY.toml");
        fs::write(&path, text).unwrap();
        Study::read(&path).map_err(|error| format!("{error:#}"))
    }

    #[test]
    fn a_short_study_has_every_default() {
        let study = read("materials = ['*.binary']\nprobes = ['grace.hdr']\nheld-out = ['uffizi.hdr']").unwrap();
        assert_eq!(study.materials.iter().map(|(name, _)| &**name).collect::<Vec<_>>(), ["gold", "nickel"]);
        assert_eq!((study.lights.len(), study.probes, study.file.size, study.file.seeds), (2, 1, 128, 20));
        assert_eq!((&*study.file.repeat_probe, study.file.six.len()), ("grace", 2));
        assert!(Experiment::ALL.into_iter().all(|experiment| study.has(experiment)));
    }

    #[test]
    fn mistakes_are_named() {
        let base = "materials = ['*.binary']\nprobes = ['grace.hdr']\n";
        for (text, phrase) in [
            ("materials = ['*.exr']\nprobes = ['grace.hdr']", "no file matches \"*.exr\""),
            (&format!("{base}six = ['tin']"), "\"tin\" is not one of gold, nickel"),
            (&format!("{base}repeat-probe = 'uffizi'"), "\"uffizi\" is not one of grace"),
            (&format!("{base}model = 'phong'"), "unknown model 'phong'"),
            (&format!("{base}size = 8"), "between 16 and 512"),
            (&format!("{base}six = ['gold', 'gold']"), "six names a material twice"),
            (&format!("{base}full-gammas = [2.0, inf]"), "full-gammas must be positive"),
            ("materials = []\nprobes = ['grace.hdr']", "materials is an empty list"),
            ("materials = ['*.binary']\nprobes = []\nheld-out = ['uffizi.hdr']", "probes is an empty list"),
            (&format!("{base}sizes = 8"), "unknown field `sizes`"),
            (&format!("{base}experiments = ['all']"), "unknown variant `all`"),
            (&format!("{base}held-out = ['grace.hdr']"), "two files are called \"grace\""),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(phrase), "{text}: {error}");
        }
    }
}
