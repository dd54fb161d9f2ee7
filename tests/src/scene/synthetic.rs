//! Light from closed formulas, without files, with the difficulties of real probes.

use lookalike::{image::Image, light::Environment, math::to_f32};

/// A room at noon, `2 n` x `n` texels: dim warm walls with texture, four windows of different colours, a sun of one texel
/// at 5,000 times the walls.
///
/// # Panics
/// When `n` is below 16.
#[must_use]
pub fn room(n: usize) -> Environment {
    furnished(n, [500.0, 450.0, 400.0])
}

/// The same room without the sun, for checks that would need very many samples with it.
///
/// # Panics
/// When `n` is below 16.
#[must_use]
pub fn room_at_dusk(n: usize) -> Environment {
    furnished(n, [0.1; 3])
}

fn furnished(n: usize, sun: [f64; 3]) -> Environment {
    assert!(n >= 16, "a room of {n} rows has no place for its windows");
    let texel = |k: usize| {
        let (row, column) = (k / (2 * n), k % (2 * n));
        let (v, u) = ((row as f64 + 0.5) / n as f64, (column as f64 + 0.5) / (2 * n) as f64);
        let texture = 1.0 + 0.3 * (37.0 * u).sin() * (23.0 * v).cos();
        let mut rgb = [0.10, 0.08, 0.06].map(|wall| wall * texture * (1.2 - v));
        for (left, top, width, height, colour) in WINDOWS {
            if (left..left + width).contains(&u) && (top..top + height).contains(&v) {
                rgb = colour;
            }
        }
        if (row, column) == (n * 3 / 10, n * 9 / 10) {
            rgb = sun;
        }
        rgb.map(to_f32)
    };
    Environment::new(Image::from_pixels(2 * n, n, (0..2 * n * n).map(texel).collect())).expect("a room is a valid map")
}

/// Left, top, width and height as shares of the map; radiance.
const WINDOWS: [(f64, f64, f64, f64, [f64; 3]); 4] = [
    (0.05, 0.30, 0.06, 0.15, [4.0, 5.0, 7.0]),
    (0.30, 0.25, 0.04, 0.30, [6.0, 5.5, 4.0]),
    (0.62, 0.35, 0.03, 0.08, [20.0, 18.0, 15.0]),
    (0.85, 0.55, 0.08, 0.05, [1.0, 3.0, 1.0]),
];

/// One texel of 1e5 in a uniform sky of 0.1: `2 n` x `n` texels, the sun at the given row and column.
///
/// # Panics
/// When the sun lies outside the map.
#[must_use]
pub fn one_texel_sun(n: usize, row: usize, column: usize) -> Environment {
    let mut pixels = vec![[0.1; 3]; 2 * n * n];
    pixels[row * 2 * n + column] = [1e5; 3];
    Environment::new(Image::from_pixels(2 * n, n, pixels)).expect("a sun in a sky is a valid map")
}

/// The same radiance from everywhere.
#[must_use]
pub fn uniform(radiance: f32) -> Environment {
    Environment::new(Image::from_pixels(32, 16, vec![[radiance; 3]; 512])).expect("a uniform map is valid")
}
