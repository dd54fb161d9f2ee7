//! The prepared judge: against the plain path, with the reference itself, and with invalid input.

use super::super::tests::pairs::{Sphere, sphere};
use super::super::{CidOptions, DisplayImage, cid};
use super::*;
use crate::math::to_f32;

/// A linear image of the sphere in a black frame, and its coverage: 0 outside, 0.5 on the silhouette.
fn framed(s: &Sphere, width: usize, height: usize, (left, top): (usize, usize)) -> (Image, Vec<f32>) {
    let picture = sphere(s);
    let mut image = Image::new(width, height);
    let mut coverage = vec![0.0; width * height];
    for (i, pixel) in picture.pixels.iter().enumerate() {
        let (x, y) = (i % s.size, i / s.size);
        let to = (top + y) * width + left + x;
        image.pixels_mut()[to] = pixel.map(to_f32);
        let radius = |i: usize| (i as f64 + 0.5) / s.size as f64 * 2.0 - 1.0;
        let r2 = (radius(x) * radius(x) + radius(y) * radius(y)) / (0.92 * 0.92);
        coverage[to] = if r2 < 0.98 {
            1.0
        } else if r2 < 1.0 {
            0.5
        } else {
            0.0
        };
    }
    (image, coverage)
}

fn plastic(alpha: f64) -> Sphere {
    Sphere { alpha, size: 72, ..Sphere::default() }
}

fn judge(reference: &Image, coverage: &[f32], lanes: Lanes) -> Judge {
    Judge::new(reference, coverage, 1.3, &JudgeOptions { lanes, ..JudgeOptions::default() }).unwrap()
}

#[test]
fn the_judge_agrees_with_the_plain_path_through_encoded_images() {
    let (reference, coverage) = framed(&plastic(0.2), 120, 100, (20, 10));
    let (image, _) = framed(&plastic(0.3), 120, 100, (20, 10));
    let score = judge(&reference, &coverage, Lanes::Detected).score(&image).unwrap();
    let [a, b] = [&reference, &image].map(|image| DisplayImage::from_linear(image, &coverage, 1.3).unwrap());
    let plain = cid(&a, &b, &CidOptions::default()).unwrap();
    assert!((score.cssim - plain).abs() < 1e-12 && plain > 0.01, "{score:?} {plain}");
    // The object covers a third of the image and has nearly all of the error.
    assert!(score.cssim_object > 1.5 * score.cssim, "{score:?}");
    let combined = 1.0 - score.features.iter().product::<f64>();
    assert_eq!(combined, score.cssim);
}

#[test]
fn the_score_of_the_spans_equals_that_of_the_whole_image_bit_for_bit() {
    for corner in [(3, 0), (41, 30), (88, 68)] {
        let (reference, coverage) = framed(&plastic(0.2), 160, 140, corner);
        let (image, _) = framed(&plastic(0.25), 160, 140, corner);
        let options = JudgeOptions::default();
        let boxed = Judge::new(&reference, &coverage, 1.0, &options).unwrap();
        let whole = |_: &[f32], width, height, _| {
            let region = Region::whole(width, height);
            Some((region, Spans::whole(&region)))
        };
        let whole = Judge::<f64>::over(&reference, &coverage, 1.0, &options, whole).unwrap();
        assert!(boxed.region.width < whole.region.width && boxed.region.height < whole.region.height);
        assert_eq!(boxed.score(&image).unwrap(), whole.score(&image).unwrap(), "{corner:?}");
        assert_eq!(boxed.maps(&image).unwrap(), whole.maps(&image).unwrap(), "{corner:?}");
    }
}

#[test]
fn vector_instructions_and_threads_change_no_bit() {
    let (reference, coverage) = framed(&plastic(0.2), 96, 90, (10, 9));
    let (image, _) = framed(&plastic(0.27), 96, 90, (10, 9));
    let expected = judge(&reference, &coverage, Lanes::Plain).score(&image).unwrap();
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let found = pool.install(|| judge(&reference, &coverage, Lanes::Detected).score(&image).unwrap());
        assert_eq!(found, expected, "{threads} threads");
    }
}

#[test]
fn single_precision_is_exact_enough_for_a_search() {
    let (reference, coverage) = framed(&plastic(0.2), 120, 100, (20, 10));
    let double = judge(&reference, &coverage, Lanes::Detected);
    let [single, plain] = [Lanes::Detected, Lanes::Plain].map(|lanes| {
        Judge::single(&reference, &coverage, 1.3, &JudgeOptions { lanes, ..JudgeOptions::default() }).unwrap()
    });
    for alpha in [0.05, 0.19, 0.199, 0.201, 0.3] {
        let (image, _) = framed(&plastic(alpha), 120, 100, (20, 10));
        let [exact, found] = [double.score(&image).unwrap(), single.score(&image).unwrap()];
        // A buffer that another image has used changes no bit.
        assert_eq!(judge(&reference, &coverage, Lanes::Detected).score(&image).unwrap(), exact);
        double.free_buffers();
        assert_eq!(double.score(&image).unwrap(), exact);
        assert_eq!((plain.score(&image).unwrap(), single.score(&image).unwrap()), (found, found));
        let scores = [(exact.cssim, found.cssim), (exact.cssim_object, found.cssim_object)];
        assert!(scores.iter().all(|(e, f)| (e - f).abs() < 2e-6), "{alpha}: {exact:?} {found:?}");
    }
}

#[test]
fn the_reference_itself_scores_exactly_zero() {
    let (reference, coverage) = framed(&plastic(0.1), 100, 83, (11, 6));
    let judge = judge(&reference, &coverage, Lanes::Detected);
    let score = judge.score(&reference).unwrap();
    assert_eq!((score.cssim.to_bits(), score.cssim_object.to_bits()), (0, 0));
    assert_eq!((score.features, score.features_object), ([1.0; 5], [1.0; 5]));
    let single = Judge::single(&reference, &coverage, 1.3, &JudgeOptions::default()).unwrap();
    assert_eq!(single.score(&reference).unwrap(), score);
    assert!(judge.error_map(&reference).unwrap().error.iter().all(|&e| e == 0.0));
}

#[test]
fn the_maps_average_to_the_features() {
    let (reference, coverage) = framed(&plastic(0.2), 100, 90, (12, 8));
    let (image, _) = framed(&plastic(0.3), 100, 90, (12, 8));
    let judge = judge(&reference, &coverage, Lanes::Detected);
    let (score, maps) = (judge.score(&image).unwrap(), judge.maps(&image).unwrap());
    for (map, feature) in maps.features.iter().zip(score.features) {
        assert_eq!(map.len(), 90 * 80);
        let mean = map.iter().sum::<f64>() / map.len() as f64;
        assert!((mean - feature).abs() < 1e-12, "{mean} {feature}");
    }
    let error = maps.error();
    let covered = |i: usize| coverage[(i / 90 + 5) * 100 + i % 90 + 5] > 0.0;
    let object: Vec<f64> = (0..error.error.len()).filter(|&i| covered(i)).map(|i| maps.features[2][i]).collect();
    let mean = object.iter().sum::<f64>() / object.len() as f64;
    assert!((mean - score.features_object[2]).abs() < 1e-12);
}

#[test]
fn pixels_outside_the_object_are_ignored() {
    let (reference, coverage) = framed(&plastic(0.2), 100, 90, (12, 8));
    let (mut image, _) = framed(&plastic(0.3), 100, 90, (12, 8));
    let judge = judge(&reference, &coverage, Lanes::Detected);
    let clean = judge.score(&image).unwrap();
    image.pixels_mut()[0] = [f32::NAN, 1e30, f32::INFINITY];
    image.pixels_mut()[99] = [7.0; 3];
    assert_eq!(judge.score(&image).unwrap(), clean);
}

#[test]
fn invalid_input_is_an_error_with_coordinates() {
    let (reference, coverage) = framed(&plastic(0.2), 100, 90, (12, 8));
    let options = JudgeOptions::default();
    let message = |result: Result<Judge, MetricError>| result.unwrap_err().to_string();
    let judge = judge(&reference, &coverage, Lanes::Detected);
    let mut image = reference.clone();
    image.pixels_mut()[44 * 100 + 48][2] = f32::NAN;
    let found = judge.score(&image).unwrap_err().to_string();
    assert!(found.contains("the image must be finite: found NaN in channel 2 at column 48, row 44"), "{found}");
    let found = message(Judge::new(&image, &coverage, 1.0, &options));
    assert!(found.contains("the reference must be finite"), "{found}");
    assert!(judge.score(&Image::new(100, 89)).is_err());
    assert!(
        message(Judge::new(&reference, &coverage[1..], 1.0, &options)).contains("expected 9000 values, found 8999")
    );
    assert!(message(Judge::new(&reference, &coverage, 0.0, &options)).contains("exposure"));
    assert_eq!(message(Judge::new(&reference, &vec![0.0; 9000], 1.0, &options)), MetricError::NoObject.to_string());
    let mut corner = vec![0.0; 9000];
    corner[304] = 1.0;
    assert_eq!(message(Judge::new(&reference, &corner, 1.0, &options)), MetricError::NoObject.to_string());
    let tiny = Image::new(10, 12);
    assert!(message(Judge::new(&tiny, &[1.0; 120], 1.0, &options)).contains("too small"));
}
