//! The light of the bundled scene: a garden pavilion on a sunny morning, as a lat-long map.
//!
//! The observer stands in a room that opens to a terrace on +Z; windows are on -X, a panel and a doorway on +X. The module
//! `pavilion` holds the room; this file holds the surroundings and the map. The radiance is made up to look plausible in a
//! mirror sphere; it is not a solution of light transport.

use super::{
    pavilion,
    sky::{SUN_AZIMUTH, smooth_step, sun_direction},
};
use lookalike::{
    image::Image,
    math::{
        Rgb, Vec3,
        elementary::{acos, atan2, exp_bounded, sin_cos},
        narrow,
    },
};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// The canonical lat-long map, `2 height` x `height` texels, each the mean of 4 x 4 points inside it.
///
/// Texel (i, j) covers theta in pi [i, i+1]/H from +Y and u in [j, j+1]/W, with the direction
/// `(sin(theta) sin(2 pi u), cos(theta), -sin(theta) cos(2 pi u))`.
#[must_use]
pub fn lat_long(height: usize) -> Image {
    let width = 2 * height;
    let thetas = sines_and_cosines(height, PI);
    let phis = sines_and_cosines(width, TAU);
    let texel = |index: usize| {
        let (row, column) = (index / width, index % width);
        let mut sum = Rgb::ZERO;
        for k in 0..POINTS * POINTS {
            let (sin_theta, cos_theta) = thetas[row * POINTS + k / POINTS];
            let (sin_phi, cos_phi) = phis[column * POINTS + k % POINTS];
            sum += radiance(Vec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi));
        }
        narrow(sum / (POINTS * POINTS) as f64)
    };
    Image::from_pixels(width, height, (0..width * height).into_par_iter().map(texel).collect())
}

/// Sines and cosines of the angles of the points along an axis of `texels`, which spans `range` radians.
fn sines_and_cosines(texels: usize, range: f64) -> Vec<(f64, f64)> {
    let place = |k: usize| ((k / POINTS) as f64 + ((k % POINTS) as f64 + 0.5) / POINTS as f64) / texels as f64;
    (0..texels * POINTS).map(|k| sin_cos(range * place(k))).collect()
}

/// Radiance from a unit direction.
#[must_use]
pub fn radiance(direction: Vec3) -> Rgb {
    pavilion::radiance(direction).unwrap_or_else(|| outdoors(direction))
}

/// Radiance from outside the pavilion.
fn outdoors(d: Vec3) -> Rgb {
    let elevation = FRAC_PI_2 - acos(d.y);
    let azimuth = atan2(d.x, d.z);
    if d.y < 0.0 {
        return ground(d);
    }
    if let Some(tree) = cypress(azimuth, elevation) {
        return tree;
    }
    let (ripple, swell) = (sin_cos(5.0 * azimuth + 0.4).0, sin_cos(13.0 * azimuth).0);
    let far = 0.085 + 0.03 * ripple + 0.008 * swell;
    let near = 0.045 + 0.02 * sin_cos(7.0 * azimuth + 2.0).0;
    if elevation < near {
        return Rgb::new(0.16, 0.24, 0.12);
    }
    if elevation < far {
        return Rgb::new(0.34, 0.44, 0.50);
    }
    sky(d, elevation)
}

/// A gradient from the pale horizon to the blue zenith, a glow around the sun, and the sun with its soft edge.
fn sky(d: Vec3, elevation: f64) -> Rgb {
    let haze = exp_bounded(-elevation / 0.32);
    let gradient = ZENITH + (HORIZON - ZENITH) * haze;
    let angle = acos(d.dot(sun_direction()));
    let glow = Rgb::new(1.0, 0.78, 0.48) * (1.1 * exp_bounded(-angle / 0.14));
    let disc = SUN * (1.0 - smooth_step(SUN_RADIUS - SUN_EDGE, SUN_RADIUS + SUN_EDGE, angle));
    gradient + glow + disc
}

/// The terrace in front of the pavilion, then a mown lawn that fades into the haze.
fn ground(d: Vec3) -> Rgb {
    let distance = pavilion::FLOOR / d.y;
    let (x, z) = (distance * d.x, distance * d.z);
    let haze = 1.0 - exp_bounded(-distance / 90.0);
    let surface = if z < TERRACE_END {
        let joint = (x / 0.9 - (x / 0.9).floor() < 0.05) || (z / 0.9 - (z / 0.9).floor() < 0.05);
        Rgb::new(0.95, 0.86, 0.72) * if joint { 0.6 } else { 1.0 }
    } else {
        let stripe = if (x / 2.4).floor() % 2.0 == 0.0 { 1.0 } else { 0.78 };
        Rgb::new(0.16, 0.30, 0.06) * stripe
    };
    surface + (Rgb::new(0.60, 0.66, 0.62) - surface) * haze
}

/// A row of cypresses: tapered silhouettes, lighter on the side of the sun.
fn cypress(azimuth: f64, elevation: f64) -> Option<Rgb> {
    TREES.iter().find_map(|&(center, height)| {
        let along = elevation / height;
        if along >= 1.0 {
            return None;
        }
        let half_width = 0.026 * ((1.0 - along) * (0.35 + along)).sqrt() * 1.5;
        let across = (azimuth - center) / half_width;
        let lit = 0.5 + 0.5 * across.clamp(-1.0, 1.0) * (SUN_AZIMUTH - center).signum();
        (across.abs() < 1.0).then(|| Rgb::new(0.035, 0.06, 0.03) + Rgb::new(0.09, 0.12, 0.04) * lit * lit)
    })
}

/// Points along each side of a texel.
const POINTS: usize = 4;
/// In radians: the sun is three texels wide at 512 x 256, and a third of that is its soft edge.
const SUN_RADIUS: f64 = 0.020;
const SUN_EDGE: f64 = 0.006;
/// About 300 times the radiance of the sky beside it.
const SUN: Rgb = Rgb::new(420.0, 345.0, 235.0);
const ZENITH: Rgb = Rgb::new(0.22, 0.46, 1.05);
const HORIZON: Rgb = Rgb::new(1.25, 1.30, 1.32);
/// Metres along +Z.
const TERRACE_END: f64 = 9.0;
/// Azimuth and height of each tree in radians.
const TREES: [(f64, f64); 6] = [(-0.60, 0.20), (-0.48, 0.27), (-0.37, 0.17), (0.13, 0.15), (0.60, 0.30), (-0.08, 0.11)];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::sky::SUN_ELEVATION;
    use lookalike::math::{luminance, widen};

    #[test]
    fn the_map_is_finite_positive_and_the_same_each_time() {
        let map = lat_long(64);
        assert_eq!((map.width(), map.height()), (128, 64));
        assert!(map.pixels().iter().flatten().all(|&x| x.is_finite() && x > 0.0));
        assert_eq!(map, lat_long(64));
    }

    #[test]
    fn the_sun_is_the_brightest_spot_and_where_it_is_said_to_be() {
        let map = lat_long(128);
        let brightness = |&i: &usize| luminance(widen(map.pixels()[i]));
        let best = (0..256 * 128).max_by(|a, b| brightness(a).total_cmp(&brightness(b))).unwrap();
        let (theta, phi) = (PI * ((best / 256) as f64 + 0.5) / 128.0, TAU * ((best % 256) as f64 + 0.5) / 256.0);
        let ((st, ct), (sp, cp)) = (sin_cos(theta), sin_cos(phi));
        let angle = acos(Vec3::new(st * sp, ct, -st * cp).dot(sun_direction()));
        assert!(angle < 0.03, "{angle} rad from the sun; a texel is 0.025 wide");
        let beside = luminance(sky(sun_direction(), SUN_ELEVATION + 0.1) - SUN);
        let ratio = luminance(SUN) / beside;
        assert!((100.0..1000.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn supersampling_keeps_the_energy_of_a_finer_map() {
        let mean = |height: usize| {
            let map = lat_long(height);
            let weighted = |i: usize| {
                let theta = PI * ((i / map.width()) as f64 + 0.5) / height as f64;
                luminance(widen(map.pixels()[i])) * sin_cos(theta).0
            };
            (0..map.pixels().len()).map(weighted).sum::<f64>() * PI * PI / (map.pixels().len() as f64)
        };
        // At 32 rows the sun is a third of a texel wide; 4 x 4 points resolve its light to a few per cent.
        let (coarse, fine) = (mean(32), mean(128));
        assert!((coarse / fine - 1.0).abs() < 0.05, "{coarse} {fine}");
    }
}
