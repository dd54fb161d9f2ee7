//! A synthetic study: numbers from formulas, pictures of one colour.

use crate::measured::{About, Agreement, DirectCost, Method, Photo, Row, StudyData};
use lookalike::image::{Image, png};
use std::{collections::BTreeMap, fs, path::Path};

pub(super) const MATERIALS: [&str; 4] = ["gold-metallic-paint3", "aluminium", "red-metallic-paint", "delrin"];
pub(super) const PROBES: [&str; 3] = ["grace_cross", "uffizi", "rnl_cross"];
pub(super) const HELD_OUT: [&str; 1] = ["studio_small_05_1k"];
pub(super) const SIZE: u32 = 128;

/// A row of `ours` in a cell, as the grid has it.
pub(super) fn row(method: Method, material: &str, probe: &str, cssim: f64) -> Row {
    Row {
        material: material.to_owned(),
        probe: probe.to_owned(),
        shown: probe.to_owned(),
        model: if method == Method::Paper { "cook-torrance" } else { "ggx" }.to_owned(),
        method,
        samples: Some(256),
        sampling: "importance".to_owned(),
        clamped: false,
        subsets: 1,
        size: SIZE,
        searched_size: SIZE,
        seed: 0,
        gamma: Some(1.5),
        start: None,
        cost: None,
        metric: "cssim".to_owned(),
        cssim,
        cssim_object: Some(cssim * 2.0),
        evaluations: 400,
        cpu_seconds: 2.0,
        gammas: 21,
        stage_two_seconds: None,
        parameters: BTreeMap::new(),
    }
}

/// CSSIM of `ours+polish` in a cell: .040, .041, ... by material, .01 more per light.
pub(super) fn base(material: usize, probe: usize) -> f64 {
    0.04 + 0.001 * f64::from(u32::try_from(material).unwrap()) + 0.01 * f64::from(u32::try_from(probe).unwrap())
}

/// A study with every section.
pub(super) fn whole() -> StudyData {
    let mut data = empty();
    for (m, material) in MATERIALS.into_iter().enumerate() {
        for (p, probe) in PROBES.into_iter().enumerate() {
            cell(&mut data, (m, material), (p, probe));
        }
    }
    data
}

/// A study without measurements.
pub(super) fn empty() -> StudyData {
    let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
    let about = About {
        model: "ggx".to_owned(),
        seed: 0,
        command: "lookalike study STUDY.toml --out study".to_owned(),
        version: "0.1.0".to_owned(),
        machine: "a processor, 2 cores".to_owned(),
        seconds: 3600.0,
        workers: 2,
        study: "# Materials are network fits of measurements, not the measurements.\nsize = 128 # <tag> & \"quote\" | pipe\n".to_owned(),
        materials: names(&MATERIALS),
        six: names(&MATERIALS[..3]),
        probes: names(&PROBES),
        held_out: names(&HELD_OUT),
        size: SIZE,
    };
    StudyData { about, photos: Vec::new(), rows: Vec::new(), direct: Vec::new(), agreements: Vec::new() }
}

fn cell(data: &mut StudyData, (m, material): (usize, &str), (p, probe): (usize, &str)) {
    let base = base(m, p);
    let of = |method, cssim| row(method, material, probe, cssim);
    let none = |row: Row| Row { samples: None, gamma: None, sampling: String::new(), ..row };
    data.rows.extend([
        Row { stage_two_seconds: Some(0.5), ..of(Method::Ours, base + 0.004) },
        of(Method::OursPolished, base),
        of(Method::Paper, base + 0.012),
        of(Method::L2, base + 0.02),
        of(Method::Log, base + 0.015),
        of(Method::CubeRoot, base + 0.011),
        Row { subsets: 8, cpu_seconds: 9.0, ..of(Method::Subsets, base + 0.002) },
        Row { subsets: 8, cpu_seconds: 11.0, ..of(Method::SubsetsPolished, base - 0.0005) },
        Row { samples: None, cpu_seconds: 20.0, ..of(Method::Ours, base + 0.003) },
        // The same match from another experiment with other tables.
        Row { cpu_seconds: 1.0, ..of(Method::Ours, base + 0.0039) },
        Row { model: "cook-torrance".to_owned(), ..of(Method::OursPolished, base + 0.006) },
        Row {
            model: "ward".to_owned(),
            ..of(Method::OursPolished, base + 0.005 * f64::from(u32::try_from(m).unwrap()) - 0.004)
        },
    ]);
    for (start, worse) in [("paper", 0.03), ("plastic", 0.001)] {
        let start = Some(start.to_owned());
        data.rows.push(Row { start, evaluations: 900, cpu_seconds: 40.0, ..none(of(Method::Brute, base + worse)) });
    }
    for (searched_size, worse) in [(32, 0.03), (64, 0.018), (128, 0.006)] {
        data.rows.push(Row {
            searched_size,
            evaluations: 500,
            cpu_seconds: 5.0,
            ..none(of(Method::LowRes, base + worse))
        });
    }
    for shown in PROBES.into_iter().chain(HELD_OUT).filter(|shown| *shown != probe) {
        let scores =
            [(Method::L2, 0.03), (Method::RunnerUp, 0.014), (Method::Ours, 0.012), (Method::OursPolished, 0.01)];
        for (method, cssim) in scores {
            data.rows.push(Row { shown: shown.to_owned(), samples: None, gamma: None, ..of(method, base + cssim) });
        }
    }
    for (metric, scale) in [("multi-scale", 0.7), ("exposure x2", 1.2)] {
        for (method, more) in [(Method::OursPolished, 0.0), (Method::Brute, 0.001), (Method::L2, 0.02)] {
            data.rows.push(Row { metric: metric.to_owned(), samples: None, ..of(method, (base + more) * scale) });
        }
    }
    candidates(data, (material, probe), base);
    draws(data, (material, probe), base);
    let seconds = vec![0.5; 20];
    let model = "ggx".to_owned();
    let cost = DirectCost {
        material: material.to_owned(),
        probe: probe.to_owned(),
        model,
        size: SIZE,
        samples_per_pixel: 64,
        seconds,
    };
    data.direct.push(cost);
    let noise = Some(0.004);
    data.photos.push(Photo {
        material: material.to_owned(),
        probe: probe.to_owned(),
        size: SIZE,
        noise,
        exposure: 1.7,
    });
}

/// The 21 gammas: CSSIM is lowest at 1.5, the lobe widens, the diffuse part darkens; Eq. 1 agrees best at 2.
fn candidates(data: &mut StudyData, (material, probe): (&str, &str), base: f64) {
    for i in 0..21_u32 {
        let gamma = 1.0 + 0.1 * f64::from(i);
        let off = gamma - 1.5;
        let kd = 0.3 - 0.02 * gamma;
        let parameters = [("kd.r", kd), ("kd.g", kd), ("kd.b", kd), ("alpha", 0.1 + 0.03 * gamma)];
        data.rows.push(Row {
            gamma: Some(gamma),
            cost: Some(0.01 * gamma),
            parameters: parameters.map(|(name, value)| (name.to_owned(), value)).into(),
            ..row(Method::Candidate, material, probe, base + 0.004 + 0.02 * off * off)
        });
        let spearman = 0.9 - 0.3 * (gamma - 2.0).abs();
        data.agreements.push(Agreement {
            material: material.to_owned(),
            probe: probe.to_owned(),
            gamma,
            spearman,
            matches: 200,
        });
    }
}

/// Twenty seeds at three numbers of samples, three ways of sampling, and clamped values.
fn draws(data: &mut StudyData, (material, probe): (&str, &str), base: f64) {
    for (samples, worse) in [(32, 0.012), (64, 0.007), (256, 0.004)] {
        for seed in 0..20_u32 {
            let spread = worse / 4.0 * (f64::from(seed * 7 % 20) - 9.5) / 9.5;
            let gamma = Some(1.0 + 0.1 * f64::from(seed * 3 % 10));
            let drawn = Row {
                samples: Some(samples),
                seed: seed.into(),
                gamma,
                ..row(Method::Ours, material, probe, base + worse + spread)
            };
            if samples == 32 && probe == "grace_cross" {
                let gamma = drawn.gamma.map(|gamma| gamma * 0.5 + 0.75);
                data.rows.push(Row { clamped: true, gamma, cssim: base + worse + spread / 2.0, ..drawn.clone() });
            }
            // The grid has the first of 256.
            if samples != 256 || seed > 0 {
                data.rows.push(drawn);
            }
        }
        for (sampling, more) in [("stratified", 0.002), ("uniform", 0.009)] {
            let sampling = sampling.to_owned();
            data.rows.push(Row {
                samples: Some(samples),
                sampling,
                ..row(Method::Ours, material, probe, base + worse + more)
            });
        }
    }
}

/// One picture of one colour for each that a study would write, except those of the last material.
pub(super) fn pictures(out: &Path) {
    let folder = out.join("pictures");
    fs::create_dir_all(&folder).unwrap();
    let shown = [
        "photo",
        "ours",
        "ours+polish",
        "l2",
        "paper",
        "brute",
        "full",
        "samples32",
        "lowres32",
        "lowres64",
        "lowres128",
    ];
    for (m, material) in MATERIALS[..3].iter().enumerate() {
        let colour = [[220, 170, 60], [180, 185, 190], [190, 40, 40]][m];
        let disc = disc(colour);
        for (p, probe) in PROBES.iter().enumerate() {
            for what in shown {
                fs::write(folder.join(format!("{material}-{probe}-128-{what}.png")), &disc).unwrap();
            }
            let other = PROBES[(p + 1) % 3];
            for what in ["photo", "ours+polish", "l2"] {
                fs::write(folder.join(format!("{material}-{probe}-at-{other}-128-{what}.png")), &disc).unwrap();
            }
        }
    }
}

/// A lit disc on black, as PNG.
fn disc(colour: [u8; 3]) -> Vec<u8> {
    let side = 96_u8;
    let mut image = Image::new(side.into(), side.into());
    let places = (0..side).flat_map(|y| (0..side).map(move |x| (x, y)));
    for (pixel, (x, y)) in image.pixels_mut().iter_mut().zip(places) {
        let (x, y) = (f32::from(x) / 47.5 - 1.0, f32::from(y) / 47.5 - 1.0);
        let z = (1.0 - x * x - y * y).max(0.0).sqrt();
        *pixel = colour.map(|c| f32::from(c) / 255.0 * z);
    }
    png::write(&image, &[]).unwrap()
}
