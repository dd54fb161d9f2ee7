//! One CSSIM score of a 256 x 256 image of a sphere: against a prepared reference, and by the plain path `cid`.
//!
//! For the time on one core: `RAYON_NUM_THREADS=1 cargo bench -p lookalike --bench cssim`.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use lookalike::image::Image;
use lookalike::metric::{CidOptions, DisplayImage, Judge, JudgeOptions, Lanes, cid};

const SIZE: usize = 256;

/// A shaded sphere with two highlights in the inscribed circle, and its coverage.
fn sphere(sharpness: i32) -> (Image, Vec<f32>) {
    let mut image = Image::new(SIZE, SIZE);
    let mut coverage = vec![0.0; SIZE * SIZE];
    let pixels = image.pixels_mut().iter_mut().zip(&mut coverage);
    for (i, (pixel, covered)) in pixels.enumerate() {
        let at = |k: usize| (k as f32 + 0.5) / (SIZE as f32 / 2.0) - 1.0;
        let (x, y) = (at(i % SIZE), -at(i / SIZE));
        let r2 = x * x + y * y;
        if r2 < 1.0 {
            let z = (1.0 - r2).sqrt();
            let diffuse = (0.5 * x + 0.6 * y + 0.62 * z).max(0.0);
            let highlight = (0.28 * x + 0.33 * y + 0.9 * z).max(0.0).powi(sharpness)
                + 0.4 * (-0.4 * x + 0.2 * y + 0.89 * z).max(0.0).powi(sharpness);
            *pixel = [0.5, 0.2, 0.1].map(|albedo| albedo * diffuse + 0.8 * highlight);
            *covered = 1.0;
        }
    }
    (image, coverage)
}

fn bench(criterion: &mut Criterion) {
    let (reference, coverage) = sphere(60);
    let (image, _) = sphere(80);
    for (name, lanes) in [("prepared", Lanes::Detected), ("prepared, plain instructions", Lanes::Plain)] {
        let options = JudgeOptions { lanes, ..JudgeOptions::default() };
        let judge = Judge::new(&reference, &coverage, 1.0, &options).expect("a sphere is a valid reference");
        criterion.bench_function(&format!("cssim 256x256 {name}"), |bencher| {
            bencher.iter(|| judge.score(black_box(&image)));
        });
    }
    let [first, second] =
        [&reference, &image].map(|image| DisplayImage::from_linear(image, &coverage, 1.0).expect("a valid image"));
    criterion.bench_function("cssim 256x256 plain path on encoded images", |bencher| {
        bencher.iter(|| cid(black_box(&first), black_box(&second), &CidOptions::default()));
    });
}

criterion_group!(benches, bench);
criterion_main!(benches);
