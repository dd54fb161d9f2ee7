//! Collects the records of all cells in the table that the report is made from.

use super::{
    cells::{Cell, FitTask, Task, What},
    inputs::{Inputs, geometry},
    pictures::base,
    record::{self, Content, Cost, Match, Record},
    seconds::Seconds,
    variants,
};
use anyhow::Context;
use lookalike::{
    brdf::{self, flat_names},
    fit::Method,
    metric::auto_exposure,
    render::subset::SampleCount,
};
use lookalike_report::measured::{Agreement, DirectCost, Method as MethodName, Photo, Row};
use std::collections::BTreeMap;

/// The data for the report's tables.
#[derive(Debug, Default)]
pub(super) struct Data {
    pub(super) photos: Vec<Photo>,
    pub(super) rows: Vec<Row>,
    pub(super) direct: Vec<DirectCost>,
    pub(super) agreements: Vec<Agreement>,
}

/// The data of all complete cells.
pub(super) fn collect(inputs: &Inputs, seconds: &Seconds) -> anyhow::Result<Data> {
    let mut records = BTreeMap::new();
    for (id, cell) in inputs.cells.iter().enumerate() {
        records.extend(record::read(&inputs.out, &cell.name)?.map(|record| (id, record)));
    }
    let mut collector = Collector { inputs, seconds, records: &records, data: Data::default() };
    for (id, record) in &records {
        collector.cell(&inputs.cells[*id], record)?;
    }
    Ok(collector.data)
}

struct Collector<'a> {
    inputs: &'a Inputs,
    seconds: &'a Seconds,
    records: &'a BTreeMap<usize, Record>,
    data: Data,
}

impl Collector<'_> {
    fn cell(&mut self, cell: &Cell, record: &Record) -> anyhow::Result<()> {
        match (&cell.task, &record.content) {
            (Task::Photo, Content::Photo { noise }) => self.photo(cell, *noise),
            (Task::Fit(task), Content::Fit { .. }) => self.fit(cell, task, record),
            (Task::Brute { starts, direct }, Content::Survey { minima, .. }) => {
                let method = if direct.is_some() { MethodName::BruteDirect } else { MethodName::Brute };
                // All starts read the same table.
                let table = self.seconds.sum(&record.work, |work| work == Cost::Table);
                for (s, ((name, _), minimum)) in starts.iter().zip(minima).enumerate() {
                    let search = self.seconds.sum(&record.work, |work| work == Cost::Search(s));
                    let cost = search + table / starts.len() as f64;
                    let row = self.row(cell, &self.inputs.study.file.model, method, minimum, cost);
                    self.data.rows.push(Row { start: Some((*name).to_owned()), ..row });
                }
                if method == MethodName::Brute {
                    self.variants(cell, method, "brute", record.content.minimum())
                } else {
                    Ok(())
                }
            }
            (Task::Appraise { of, .. }, Content::Survey { .. }) => {
                self.appraised(cell, of, record);
                Ok(())
            }
            (Task::Agreement { .. }, Content::Survey { appraisals, .. }) => {
                let scores: Vec<f64> = appraisals.iter().map(|a| a.cssim).collect();
                for (g, gamma) in Method::default().gammas.into_iter().enumerate() {
                    let costs: Option<Vec<f64>> = appraisals.iter().map(|a| a.costs.get(g).copied()).collect();
                    let costs = costs.with_context(|| foreign(cell))?;
                    let (material, probe) = self.names(cell);
                    let (spearman, matches) = (spearman(&scores, &costs), u32::try_from(scores.len())?);
                    self.data.agreements.push(Agreement { material, probe, gamma, spearman, matches });
                }
                Ok(())
            }
            (Task::Direct { samples, .. }, _) => {
                let (material, probe) = self.names(cell);
                let seconds = self.seconds.sum(&record.work, |_| true);
                let (model, size, samples_per_pixel) =
                    (self.inputs.study.file.model.clone(), cell.scene.size, *samples);
                let known =
                    self.data.direct.iter_mut().find(|d| (&d.material, &d.probe, d.size) == (&material, &probe, size));
                match known {
                    Some(known) => known.seconds.push(seconds),
                    None => {
                        let seconds = vec![seconds];
                        self.data.direct.push(DirectCost { material, probe, model, size, samples_per_pixel, seconds });
                    }
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn names(&self, cell: &Cell) -> (String, String) {
        let study = &self.inputs.study;
        (study.materials[cell.scene.material].0.clone(), study.lights[cell.scene.light].0.clone())
    }

    fn photo(&mut self, cell: &Cell, noise: Option<f64>) -> anyhow::Result<()> {
        let (material, probe) = self.names(cell);
        let exposure = self.exposure(cell)?;
        self.data.photos.push(Photo {
            material,
            probe,
            size: cell.scene.size,
            noise,
            exposure: exposure.unwrap_or(1.0),
        });
        Ok(())
    }

    /// The exposure before the metric for a scene, if its photo is written.
    fn exposure(&self, cell: &Cell) -> anyhow::Result<Option<f64>> {
        let name = format!("{}-photo", base(self.inputs, cell.scene));
        let Some(photo) = record::read_image(&self.inputs.out, &name)? else { return Ok(None) };
        let geometry = geometry(cell.scene.size)?;
        let (width, height) = (photo.width(), photo.height());
        let coverage: Vec<f32> = (0..width * height).map(|i| geometry.coverage(i % width, i / width)).collect();
        Ok(Some(auto_exposure(&photo, &coverage)?))
    }

    /// A row of a match under the light and at the size of its cell.
    fn row(&self, cell: &Cell, model: &str, method: MethodName, found: &Match, cpu_seconds: f64) -> Row {
        let (material, probe) = self.names(cell);
        Row {
            material,
            shown: probe.clone(),
            probe,
            model: model.to_owned(),
            method,
            samples: None,
            sampling: "importance".to_owned(),
            clamped: false,
            subsets: 1,
            size: cell.scene.size,
            searched_size: cell.scene.size,
            seed: self.inputs.study.file.seed,
            gammas: 0,
            gamma: found.gamma,
            start: None,
            cost: found.cost,
            metric: "cssim".to_owned(),
            cssim: found.cssim,
            cssim_object: Some(found.cssim_object),
            evaluations: found.evaluations as u64,
            cpu_seconds,
            stage_two_seconds: None,
            parameters: named(model, &found.parameters),
        }
    }

    /// The rows of a fit: for each method, the part of the fit that it consists of, and the cost of that part.
    fn fit(&mut self, cell: &Cell, task: &FitTask, record: &Record) -> anyhow::Result<()> {
        let Content::Fit { candidates, winner, polished, explored } = &record.content else { return Ok(()) };
        let model = task.method.model.name();
        let of_fit = |row: Row| Row {
            samples: match task.method.samples {
                SampleCount::Draws(draws) => Some(draws),
                SampleCount::Full => None,
            },
            sampling: format!("{:?}", task.method.sampling).to_lowercase(),
            clamped: task.is_clamped,
            subsets: task.method.subsets,
            gammas: u32::try_from(task.method.gammas.len()).unwrap_or(u32::MAX),
            seed: task.method.seed,
            ..row
        };
        let cost = |counts: &dyn Fn(Cost) -> bool| self.seconds.sum(&record.work, counts);
        let single = |place: usize| cost(&|work| work == Cost::Table || work == Cost::Search(place));
        let all = cost(&|work| work != Cost::Pictures);
        let two_stages = cost(&|work| matches!(work, Cost::Table | Cost::Search(_) | Cost::StageTwo));
        let stage_two = cost(&|work| work == Cost::StageTwo);
        let evaluations: u64 = candidates.iter().map(|c| c.evaluations as u64).sum();
        let mut rows = Vec::new();
        let won = candidates.get(*winner).with_context(|| foreign(cell))?;
        let (plain, with_polish) = match task.name {
            MethodName::Subsets => (Some(MethodName::Subsets), MethodName::SubsetsPolished),
            MethodName::Candidate => (None, MethodName::OursPolished),
            other => (Some(other), MethodName::OursPolished),
        };
        if let Some(method) = plain {
            let is_single = method == MethodName::Log;
            let seconds = if is_single { single(*winner) } else { two_stages };
            let stage_two = (!is_single).then_some(stage_two);
            rows.push(Row { evaluations, stage_two_seconds: stage_two, ..self.row(cell, model, method, won, seconds) });
        }
        if let Some(polished) = polished {
            let row = self.row(cell, model, with_polish, polished, all);
            rows.push(Row { gamma: won.gamma, evaluations: row.evaluations + *explored as u64, ..row });
        }
        let is_main = task.name == MethodName::Ours && task.method.subsets == 1 && !task.is_clamped;
        if task.name == MethodName::Candidate || is_main {
            for (place, candidate) in candidates.iter().enumerate() {
                rows.push(self.row(cell, model, MethodName::Candidate, candidate, single(place)));
            }
        }
        let is_default = is_main && polished.is_some() && model == self.inputs.study.file.model;
        if is_default {
            for (method, gamma) in [(MethodName::L2, 1.0), (MethodName::CubeRoot, 3.0)] {
                let found = candidates.iter().position(|c| c.gamma == Some(gamma));
                rows.extend(found.map(|place| self.row(cell, model, method, &candidates[place], single(place))));
            }
        }
        self.data.rows.extend(rows.into_iter().map(of_fit));
        if is_default {
            let l2 = candidates.iter().find(|c| c.gamma == Some(1.0));
            self.variants(cell, MethodName::L2, "l2", l2)?;
            self.variants(cell, MethodName::OursPolished, "ours+polish", polished.as_ref())?;
        }
        Ok(())
    }

    /// Rows of a match for the variants of the metric.
    fn variants(&mut self, cell: &Cell, method: MethodName, what: &str, found: Option<&Match>) -> anyhow::Result<()> {
        if cell.scene.size < variants::SMALLEST {
            return Ok(());
        }
        let base = base(self.inputs, cell.scene);
        let photo = record::read_image(&self.inputs.out, &format!("{base}-photo"))?;
        let image = record::read_image(&self.inputs.out, &format!("{base}-{what}"))?;
        let (Some(photo), Some(image), Some(found)) = (photo, image, found) else { return Ok(()) };
        let Some(exposure) = self.exposure(cell)? else { return Ok(()) };
        let row = self.row(cell, &self.inputs.study.file.model, method, found, 0.0);
        let others = variants::scores(&photo, &image, exposure)?;
        let scores = [("object only", found.cssim_object)].into_iter().chain(others);
        self.data.rows.extend(scores.map(|(metric, cssim)| Row {
            metric: metric.to_owned(),
            cssim,
            cssim_object: None,
            ..row.clone()
        }));
        Ok(())
    }

    fn appraised(&mut self, cell: &Cell, of: &[(usize, What)], record: &Record) {
        let Content::Survey { appraisals, points, .. } = &record.content else { return };
        for (((from, what), appraised), point) in of.iter().zip(appraisals).zip(points) {
            let origin = &self.inputs.cells[*from];
            let method = match (&origin.task, what) {
                (Task::LowRes, _) => MethodName::LowRes,
                (_, What::Polished) => MethodName::OursPolished,
                (_, What::Winner) => MethodName::Ours,
                (_, What::L2) => MethodName::L2,
                (_, What::RunnerUp) => MethodName::RunnerUp,
                (_, What::Minimum) => MethodName::Brute,
            };
            let searched = self.records.get(from);
            let evaluations = searched.and_then(|r| r.content.minimum()).map_or(0, |found| found.evaluations);
            let cost = searched.map_or(0.0, |r| self.seconds.sum(&r.work, |work| work != Cost::Pictures));
            let found = Match {
                parameters: point.clone(),
                cssim: appraised.cssim,
                cssim_object: appraised.cssim_object,
                evaluations,
                gamma: None,
                cost: None,
            };
            let row = self.row(cell, &self.inputs.study.file.model, method, &found, cost);
            let probe = self.inputs.study.lights[origin.scene.light].0.clone();
            self.data.rows.push(Row { probe, searched_size: origin.scene.size, ..row });
        }
    }
}

/// The message about a record whose content does not belong to its cell.
fn foreign(cell: &Cell) -> String {
    format!("cells/{}.json is not a record of this study; remove it, and --resume computes it again", cell.name)
}

fn named(model: &str, parameters: &[f64]) -> BTreeMap<String, f64> {
    let names = brdf::model(model).map(|model| flat_names(model.parameters())).unwrap_or_default();
    names.into_iter().zip(parameters.iter().copied()).collect()
}

/// Spearman's rank correlation. Equal values get the mean of their ranks.
fn spearman(a: &[f64], b: &[f64]) -> f64 {
    let (a, b) = (ranks(a), ranks(b));
    let mean = (a.len() as f64 - 1.0) / 2.0;
    let product = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| (x - mean) * (y - mean)).sum::<f64>();
    let scale = (product(&a, &a) * product(&b, &b)).sqrt();
    if scale > 0.0 { product(&a, &b) / scale } else { 0.0 }
}

fn ranks(values: &[f64]) -> Vec<f64> {
    let rank = |x: &f64| {
        let less = values.iter().filter(|other| other.total_cmp(x).is_lt()).count();
        let equal = values.iter().filter(|other| other.total_cmp(x).is_eq()).count();
        less as f64 + (equal as f64 - 1.0) / 2.0
    };
    values.iter().map(rank).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rank_correlation_sees_order_and_nothing_else() {
        assert_eq!(spearman(&[1.0, 2.0, 3.0, 9.0], &[0.1, 0.2, 30.0, 31.0]), 1.0);
        assert_eq!(spearman(&[1.0, 2.0, 3.0], &[3.0, 2.0, 1.0]), -1.0);
        assert_eq!(ranks(&[5.0, 1.0, 5.0]), [1.5, 0.0, 1.5]);
        assert_eq!(spearman(&[1.0, 1.0], &[2.0, 3.0]), 0.0);
    }
}
