//! The metric against the authors' program, with the image pairs of `pairs` and the scores of `vectors`.

pub(super) mod pairs;
mod vectors;

use std::path::PathBuf;

use super::window::{Statistics, Window};
use super::working::Pipeline;
use super::*;
use pairs::{Picture, base, noise, pair};
use vectors::{COLOURS, EXPECTED, VARIANTS};

/// The expected scores have twelve digits; sums of 1e5 terms add rounding errors. A wrong constant shows at 1e-6 or
/// more.
const TABLE_TOLERANCE: f64 = 1e-9;
/// The largest difference between scores with the fitted working space and with the table (measured: 0.0068 on
/// `sphere_kd_hue`).
const FIT_TOLERANCE: f64 = 0.007;
/// The expected scores with the fit have nine digits.
const FIT_DIGITS: f64 = 2e-9;

/// The authors' table, or `None` with a note if it is not available. It is not shipped, because its licence is unknown.
fn table() -> Option<Lab2000hl> {
    let metric = std::env::var_os("LOOKALIKE_DATA").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/metric")),
        |data| PathBuf::from(data).join("../metric"),
    );
    let path = metric.join("lab2000hl_grid.f64");
    match std::fs::read(&path) {
        Ok(bytes) => Some(Lab2000hl::from_table(&bytes).unwrap()),
        Err(error) => {
            println!("skipped: no LAB2000HL table at {} ({error}); set LOOKALIKE_DATA", path.display());
            None
        }
    }
}

/// Scores a pair by each variant, in the order of `VARIANTS`.
fn scores(first: &Picture, second: &Picture, space: &Lab2000hl) -> [Result<f64, MetricError>; 13] {
    let (first, second) = (first.display(), second.display());
    let cid_default = CidOptions { space: space.clone(), ..CidOptions::default() };
    let icid_default = IcidOptions { space: space.clone(), ..IcidOptions::default() };
    let by_cid = |change: fn(&mut CidOptions)| {
        let mut options = cid_default.clone();
        change(&mut options);
        cid(&first, &second, &options)
    };
    let everything = vec![1.0; first.width() * first.height()];
    let by_icid = |change: fn(&mut IcidOptions)| {
        let mut options = icid_default.clone();
        change(&mut options);
        let score = icid(&first, &second, &everything, &options)?;
        assert_eq!(score.icid, score.icid_object);
        Ok(score.icid)
    };
    [
        by_cid(|_| ()),
        by_cid(|o| o.filter = SpatialFilter::None),
        by_cid(|o| o.filter = SpatialFilter::Icam),
        by_cid(|o| o.chroma_contrast = true),
        by_cid(|o| o.cycles_per_degree = 40.0),
        by_cid(|o| o.scales = Scales::Three),
        by_cid(|o| o.scales = Scales::Five),
        by_icid(|_| ()),
        by_icid(|o| o.intent = Intent::HuePreserving),
        by_icid(|o| o.intent = Intent::Chromatic),
        by_icid(|o| o.filter = SpatialFilter::None),
        by_icid(|o| o.chroma_maps = false),
        by_icid(|o| o.downsample = false),
    ]
}

fn default_cid(first: &Picture, second: &Picture) -> f64 {
    cid(&first.display(), &second.display(), &CidOptions::default()).unwrap()
}

#[test]
fn every_variant_agrees_with_the_authors_program_with_their_table() {
    let Some(space) = table() else { return };
    // Each kind of picture, and the sizes at which a variant has no score or no second scale.
    let default = ["identical", "noise_0.02", "hue_20deg", "small30x34_noise", "odd97x131_blur", "sphere_alpha.20_.22"];
    let is_tested = |expected: &&vectors::Expected| cfg!(feature = "slow") || default.contains(&expected.name);
    let tested: Vec<_> = EXPECTED.iter().filter(is_tested).collect();
    assert_eq!(tested.len(), if cfg!(feature = "slow") { EXPECTED.len() } else { default.len() });
    for expected in tested {
        let (first, second) = pair(expected.name);
        for ((found, expected_score), variant) in
            scores(&first, &second, &space).iter().zip(expected.scores).zip(VARIANTS)
        {
            let name = expected.name;
            match (found, expected_score) {
                (Ok(found), Some(score)) => {
                    assert!((found - score).abs() < TABLE_TOLERANCE, "{name} {variant}: {found} {score}");
                }
                (Err(MetricError::TooSmall { .. }), None) => {}
                other => panic!("{name} {variant}: {other:?}"),
            }
        }
    }
}

#[test]
fn the_means_of_the_features_agree_with_the_authors_program_with_their_table() {
    let Some(space) = table() else { return };
    let lanes = Lanes::Detected;
    let pipeline = Pipeline::new(SpatialFilter::Scielab, 20.0, space, lanes).unwrap();
    let statistics = Statistics { window: Window::new(cssim::SIGMA), chroma: false, lanes };
    for expected in &EXPECTED {
        let (first, second) = pair(expected.name);
        let [first, second] = [first, second].map(|picture| cid::working(&pipeline, &picture.display()));
        let means = cid::means(&statistics, &first, &second);
        for (found, feature) in means.iter().zip(expected.features) {
            assert!((found - feature).abs() < TABLE_TOLERANCE, "{}: {means:?}", expected.name);
        }
    }
}

#[test]
fn scores_with_the_fitted_space_are_within_the_bound_of_the_table_and_keep_the_order() {
    let mut ranked: Vec<(f64, f64)> = Vec::new();
    for expected in &EXPECTED {
        let (first, second) = pair(expected.name);
        let found = default_cid(&first, &second);
        let by_table = expected.scores[0].unwrap();
        assert!((found - expected.fit00).abs() < FIT_DIGITS, "{}: {found} {}", expected.name, expected.fit00);
        assert!((found - by_table).abs() < FIT_TOLERANCE, "{}: {found} {by_table}", expected.name);
        ranked.push((by_table, found));
    }
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    for pair in ranked.windows(2).filter(|pair| pair[0].0 < pair[1].0) {
        assert!(pair[0].1 < pair[1].1, "{pair:?}");
    }
}

#[test]
fn colours_convert_as_in_the_authors_program() {
    let table = table();
    for [srgb, lab, lab2000hl] in COLOURS {
        let found = lab_from_linear(srgb.map(decode_srgb));
        assert!(found.iter().zip(lab).all(|(a, b)| (a - b).abs() < 1e-8), "{found:?} {lab:?}");
        if let Some(table) = &table {
            let found = table.convert(found);
            assert!(found.iter().zip(lab2000hl).all(|(a, b)| (a - b).abs() < 1e-8), "{found:?} {lab2000hl:?}");
        }
    }
}

#[test]
fn every_variant_scores_identical_images_exactly_zero() {
    for name in ["identical", "large400x420_noise"] {
        let (_, picture) = pair(name);
        for (score, variant) in scores(&picture, &picture, &Lab2000hl::fit00()).into_iter().zip(VARIANTS) {
            match score {
                Ok(score) => assert_eq!(score.to_bits(), 0, "{name} {variant}: {score:e}"),
                Err(error) => assert!(matches!(error, MetricError::TooSmall { .. }), "{error}"),
            }
        }
    }
}

#[test]
fn swapping_the_images_changes_no_bit() {
    let names = ["odd97x131_blur", "hue_20deg", "inverted", "noise_0.05", "sphere_alpha.20_.30"];
    for name in &names[..if cfg!(feature = "slow") { names.len() } else { 2 }] {
        let (first, second) = pair(name);
        let space = Lab2000hl::fit00();
        assert_eq!(scores(&first, &second, &space), scores(&second, &first, &space), "{name}");
    }
}

#[test]
fn the_score_grows_with_the_noise() {
    let picture = base(96, 80);
    let scores: Vec<f64> =
        [0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4].map(|a| default_cid(&picture, &noise(&picture, a))).into();
    assert!(scores.is_sorted() && scores[0] == 0.0 && scores[6] > 0.1, "{scores:?}");
}

#[test]
fn the_object_score_of_icid_uses_only_windows_centred_on_the_object() {
    // Noise on the left and the object on the right, in an image that is averaged down by 2.
    let clean = base(420, 400);
    let mut noisy = noise(&clean, 0.2);
    let right = |i: usize| i % 420 >= 210;
    noisy.pixels.iter_mut().zip(&clean.pixels).enumerate().filter(|&(i, _)| right(i)).for_each(|(_, (n, c))| *n = *c);
    let coverage_from =
        |column: usize| -> Vec<f32> { (0..420 * 400).map(|i| f32::from(u8::from(i % 420 >= column))).collect() };
    let options = IcidOptions { filter: SpatialFilter::None, ..IcidOptions::default() };
    let score = |from| icid(&clean.display(), &noisy.display(), &coverage_from(from), &options).unwrap();
    // A window of 11 averaged pixels extends 10 or 11 pixels to the left of its centre.
    assert_eq!(score(222).icid_object.to_bits(), 0);
    let touched = score(206);
    assert!(touched.icid_object > 0.0 && touched.icid > 10.0 * touched.icid_object);
    assert_eq!((touched.error.width, touched.error.height, touched.error.error.len()), (210, 200, 200 * 190));
}

#[test]
fn unequal_or_tiny_images_are_refused() {
    let (small, odd) = (base(34, 30).display(), base(34, 31).display());
    let message = cid(&small, &odd, &CidOptions::default()).unwrap_err().to_string();
    assert!(message.contains("expected 34 x 30 pixels, found 34 x 31"), "{message}");
    let tiny = base(10, 40).display();
    let message = cid(&tiny, &tiny, &CidOptions::default()).unwrap_err().to_string();
    assert!(message.contains("10 x 40 pixels is too small") && message.contains("at least 11 x 11"), "{message}");
    let far = CidOptions { cycles_per_degree: f64::NAN, ..CidOptions::default() };
    assert!(matches!(cid(&small, &small, &far), Err(MetricError::CyclesPerDegree { .. })));
}
