use super::*;
use crate::image::Image;
use crate::math::chi_square::SphereBins;
use crate::math::sampling::{key, uniform};

fn distribution(width: usize, height: usize, texel: impl Fn(usize) -> [f32; 3]) -> LightDistribution {
    let image = Image::from_pixels(width, height, (0..width * height).map(texel).collect());
    LightDistribution::new(Arc::new(Environment::new(image).unwrap()))
}

/// A map in which every texel differs; some are black, some bright.
fn speckled(width: usize, height: usize) -> LightDistribution {
    distribution(width, height, |k| {
        let x = crate::math::to_f32(uniform(key(&[k as u64])));
        if x < 0.3 { [0.0; 3] } else { [x * x * 10.0, x, 0.2] }
    })
}

fn points(count: u64) -> impl Iterator<Item = [f64; 2]> {
    (0..count).map(|i| [uniform(key(&[i, 7])), uniform(key(&[i, 8]))])
}

/// The map of the design's test (section 5): one texel of 1e5 in a given row, 1 elsewhere.
fn one_texel_sun(row: usize) -> LightDistribution {
    distribution(64, 32, |k| if k == row * 64 + 20 { [1e5; 3] } else { [1.0; 3] })
}

#[test]
fn samples_follow_the_density_and_the_density_integrates_to_one() {
    for (name, light) in [
        ("speckled", speckled(16, 8)),
        ("smallest", speckled(2, 1)),
        ("constant", distribution(8, 4, |_| [1.0; 3])),
        ("light at the pole only", distribution(16, 8, |k| if k == 3 { [1.0; 3] } else { [0.0; 3] })),
        ("one texel", distribution(16, 8, |k| if k == 60 { [0.0, 0.0, 1.0] } else { [0.0; 3] })),
        ("sun", one_texel_sun(9)),
    ] {
        let bins = SphereBins { rows: 32, columns: 64, quadrature: 16 };
        let sample = |i: u32| light.sample([uniform(key(&[u64::from(i), 1])), uniform(key(&[u64::from(i), 2]))]);
        let (test, total) = bins.test(200_000, |i| sample(i).direction, |d| light.pdf(d));
        println!("{name}: integral {total:.6}, {test:?}");
        // The midpoint rule errs by up to 1e-3 at the kinks between cells and at the peak of 1e5; a wrong cell area
        // shows as 1e-2.
        assert!((total - 1.0).abs() < 1e-3, "{name}: {total}");
        assert!(test.p_value > 1e-3, "{name}: {test:?}");
    }
}

#[test]
fn a_sample_carries_the_radiance_and_density_of_its_direction() {
    for light in [speckled(16, 8), speckled(2, 1), one_texel_sun(9)] {
        for u in points(20_000).chain([[0.0, 0.0], [1.0 - 1e-16, 1.0 - 1e-16], [0.5, 0.0], [0.0, 1.0 - 1e-16]]) {
            let sample = light.sample(u);
            assert!((sample.direction.length() - 1.0).abs() < 1e-14);
            assert!(sample.pdf > 0.0 && sample.pdf.is_finite(), "{u:?} {sample:?}");
            let (radiance, pdf) = light.radiance_and_pdf(sample.direction);
            // The direction is rounded to 1e-16; where a map changes by 1e5 per cell, that is 1e-8 of a node value.
            assert!((pdf - sample.pdf).abs() < 1e-6 * pdf.max(1e-3), "{u:?} {pdf} {sample:?}");
            assert!((radiance - sample.radiance).abs().max_element() < 1e-6 * radiance.max_element().max(1e-3));
            assert_eq!(pdf, light.pdf(sample.direction));
            assert_eq!(radiance, light.environment().radiance(sample.direction));
        }
    }
}

#[test]
fn radiance_over_pdf_is_bounded_beside_a_one_texel_sun() {
    // The ideal ratio is 1. The node value is exact at texel centres, so between two rows the ratio is at most the
    // ratio of their sin(theta): 3 in row 0, 1.1 in row 9. Beside a pole the opposite texel has the same node, which
    // doubles it.
    for (row, bound) in [(9, 1.15), (1, 1.7), (0, 6.0)] {
        let light = one_texel_sun(row);
        let total = light.environment().total().x;
        let mut worst = 0.0_f64;
        let mut ratio = |d: Vec3| {
            let (radiance, pdf) = light.radiance_and_pdf(d);
            assert!(pdf > 0.0, "{d}");
            worst = worst.max(radiance.max_element() / pdf / total);
        };
        for u in points(100_000) {
            ratio(light.sample(u).direction);
            // Points uniform over the map, then points close to the sun.
            ratio(light.environment().direction(u[0], u[1]));
            let v = (row as f64 - 1.0 + 3.0 * u[1]) / 32.0;
            ratio(light.environment().direction((19.0 + 3.0 * u[0]) / 64.0, v.max(0.0)));
        }
        println!("sun in row {row}: largest radiance / pdf is {worst:.3} of the map's total");
        assert!(worst < bound, "row {row}: {worst}");
    }
}

#[test]
fn colours_are_covered_by_their_largest_channel() {
    let light = distribution(32, 16, |k| [[5.0, 0.0, 0.0], [0.0, 0.0, 1e-3], [0.0; 3]][k % 3]);
    let mut worst = 0.0_f64;
    for u in points(20_000) {
        let (radiance, pdf) = light.radiance_and_pdf(light.environment().direction(u[0], u[1]));
        assert!(pdf > 0.0 || radiance == Rgb::ZERO);
        worst = worst.max(radiance.max_element() / pdf.max(1e-300));
    }
    assert!(worst < 3.0 * light.environment().total().max_element() * 3.0, "{worst}");
}

#[test]
fn density_is_finite_at_the_poles_and_continuous_around_them() {
    let light = speckled(16, 8);
    for pole in [Vec3::Y, -Vec3::Y] {
        let at = light.pdf(pole);
        assert!(at.is_finite() && at > 0.0);
        for epsilon in [1e-12, 1e-9, 1e-6] {
            let near = light.pdf((pole + Vec3::new(0.0, 0.0, -epsilon)).normalize());
            assert!((near - at).abs() < 1e-4 * at, "{epsilon}: {near} {at}");
        }
    }
}

#[test]
fn rotation_turns_samples_and_density_together() {
    let light = speckled(16, 8);
    let turned = LightDistribution::new(Arc::new(light.environment().as_ref().clone().rotated(90.0)));
    for u in points(1000) {
        let (a, b) = (light.sample(u), turned.sample(u));
        assert!((Vec3::new(a.direction.z, a.direction.y, -a.direction.x) - b.direction).length() < 1e-12);
        assert_eq!((a.radiance, a.pdf), (b.radiance, b.pdf));
        assert!((turned.pdf(b.direction) - b.pdf).abs() < 1e-6 * b.pdf.max(1e-3));
    }
}

#[test]
fn estimates_of_the_irradiance_converge_to_it() {
    let light = speckled(32, 16);
    let normal = Vec3::new(0.48, 0.6, 0.64);
    let count = 200_000;
    let estimate = points(count).fold(Rgb::ZERO, |sum, u| {
        let sample = light.sample(u);
        sum + sample.radiance * (sample.direction.dot(normal).max(0.0) / sample.pdf)
    }) / count as f64;
    let environment = light.environment();
    // The same integral of the bilinear function by a fine midpoint rule.
    let (rows, columns) = (800, 1600);
    let mut expected = Rgb::ZERO;
    for i in 0..rows {
        let v = (f64::from(i) + 0.5) / f64::from(rows);
        let weight = sin_cos(PI * v).0 * 2.0 * PI * PI / f64::from(rows * columns);
        for j in 0..columns {
            let d = environment.direction((f64::from(j) + 0.5) / f64::from(columns), v);
            expected += environment.radiance(d) * (d.dot(normal).max(0.0) * weight);
        }
    }
    // The standard deviation of the ratio is about its mean: 200 000 samples give a standard error of 0.3 %.
    assert!((estimate / expected - Rgb::ONE).abs().max_element() < 0.01, "{estimate} {expected}");
}
