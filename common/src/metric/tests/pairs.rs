//! The nineteen pairs of images of the expected scores, given by formulas, as encoded sRGB.

use std::f64::consts::{PI, TAU};

use super::super::{DisplayImage, encode_srgb};
use crate::math::Vec3;

/// An encoded or linear image.
#[derive(Debug, Clone, PartialEq)]
pub(in super::super) struct Picture {
    pub(in super::super) width: usize,
    pub(in super::super) height: usize,
    pub(in super::super) pixels: Vec<[f64; 3]>,
}

impl Picture {
    pub(in super::super) fn display(&self) -> DisplayImage {
        DisplayImage::from_encoded(self.width, self.height, self.pixels.clone()).unwrap()
    }

    fn from_fn(width: usize, height: usize, pixel: impl Fn(usize, usize) -> [f64; 3]) -> Self {
        let pixels = (0..width * height).map(|i| pixel(i % width, i / width)).collect();
        Self { width, height, pixels }
    }

    fn map(&self, f: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        Self { pixels: self.pixels.iter().map(|&p| f(p)).collect(), ..*self }
    }
}

/// A pair by its name.
pub(in super::super) fn pair(name: &str) -> (Picture, Picture) {
    let b = || base(128, 96);
    let with = |changed: fn(&Picture) -> Picture| {
        let b = b();
        let changed = changed(&b);
        (b, changed)
    };
    let shown = |s: Sphere| sphere(&s).map(|p| p.map(|x| encode_srgb(x.clamp(0.0, 1.0))));
    let from_plastic = |s: Sphere| (shown(Sphere::default()), shown(s));
    match name {
        "identical" => with(Picture::clone),
        "noise_0.05" => with(|b| noise(b, 0.05)),
        "noise_0.02" => with(|b| noise(b, 0.02)),
        "blur_1.5" => with(blur),
        "hue_20deg" => with(|b| hue(b, 20.0)),
        "hue_5deg" => with(|b| hue(b, 5.0)),
        "chroma_0.7" => with(|b| chroma(b, 0.7)),
        "lightness_+0.08" => with(|b| b.map(|p| p.map(|x| (x + 0.08).clamp(0.0, 1.0)))),
        "contrast_0.8" => with(|b| b.map(|p| p.map(|x| 0.5 + 0.8 * (x - 0.5)))),
        "inverted" => with(|b| b.map(|p| p.map(|x| 1.0 - x))),
        "small30x34_noise" => (base(34, 30), noise(&base(34, 30), 0.05)),
        "odd97x131_blur" => (base(131, 97), blur(&base(131, 97))),
        "large400x420_noise" => (base(420, 400), noise(&base(420, 400), 0.05)),
        "sphere_alpha.20_.22" => from_plastic(Sphere { alpha: 0.22, ..Sphere::default() }),
        "sphere_alpha.20_.30" => from_plastic(Sphere { alpha: 0.30, ..Sphere::default() }),
        "sphere_f0.05_.04" => from_plastic(Sphere { f0: 0.04, ..Sphere::default() }),
        "sphere_kd_x1.1" => from_plastic(Sphere { kd: [0.33, 0.132, 0.066], ..Sphere::default() }),
        "sphere_kd_hue" => from_plastic(Sphere { kd: [0.30, 0.15, 0.06], ..Sphere::default() }),
        "sphere_alpha.05_.07" => {
            (shown(Sphere { alpha: 0.05, ..Sphere::default() }), shown(Sphere { alpha: 0.07, ..Sphere::default() }))
        }
        _ => panic!("no pair is called {name}"),
    }
}

/// Coloured waves with a chequerboard added.
pub(in super::super) fn base(width: usize, height: usize) -> Picture {
    use libm::{cos, sin};
    Picture::from_fn(width, height, |x, y| {
        let (u, v) = (x as f64 / width as f64, y as f64 / height as f64);
        let check = if (x / 8 + y / 8) % 2 == 1 { 0.05 } else { -0.05 };
        let r = 0.50 + 0.35 * sin(TAU * (3.0 * u + v)) * cos(TAU * 1.5 * v) + check;
        let g = 0.45 + 0.30 * sin(TAU * (2.0 * v - u) + 1.0) + check;
        let b = 0.50 + 0.30 * cos(TAU * 4.0 * u * v + 0.5) + check;
        [r, g, b].map(|c| c.clamp(0.02, 0.98))
    })
}

/// Adds noise in [-amplitude, amplitude], a hash of the position.
pub(in super::super) fn noise(picture: &Picture, amplitude: f64) -> Picture {
    Picture::from_fn(picture.width, picture.height, |x, y| {
        let pixel = picture.pixels[y * picture.width + x];
        std::array::from_fn(|k| (pixel[k] + amplitude * (2.0 * hash(x, y, k) - 1.0)).clamp(0.0, 1.0))
    })
}

fn hash(x: usize, y: usize, k: usize) -> f64 {
    let [x, y, k] = [x, y, k].map(|i| u32::try_from(i).unwrap());
    let h = x
        .wrapping_mul(374_761_393)
        .wrapping_add(y.wrapping_mul(668_265_263))
        .wrapping_add(k.wrapping_mul(2_246_822_519));
    let h = (h ^ (h >> 13)).wrapping_mul(1_274_126_177);
    f64::from(h ^ (h >> 16)) / 4_294_967_296.0
}

/// A Gaussian of sigma 1.5, with half-sample reflection.
fn blur(picture: &Picture) -> Picture {
    let mut kernel: [f64; 13] = std::array::from_fn(|i| libm::exp(-(i as f64 - 6.0) * (i as f64 - 6.0) / 4.5));
    let sum: f64 = kernel.iter().sum();
    kernel.iter_mut().for_each(|k| *k /= sum);
    let along = |picture: &Picture, dx: usize, dy: usize| {
        let mirror = |i: usize, n: usize| if i < 6 { 5 - i } else { (i - 6).min(2 * n + 5 - i) };
        Picture::from_fn(picture.width, picture.height, |x, y| {
            std::array::from_fn(|channel| {
                let value = |i: usize| {
                    let column = mirror(x + if dx > 0 { i } else { 6 }, picture.width);
                    let row = mirror(y + if dy > 0 { i } else { 6 }, picture.height);
                    kernel[i] * picture.pixels[row * picture.width + column][channel]
                };
                (0..13).map(value).sum()
            })
        })
    };
    along(&along(picture, 0, 1), 1, 0)
}

/// Rotates colours about the grey axis.
fn hue(picture: &Picture, degrees: f64) -> Picture {
    let axis = Vec3::splat(1.0 / 3f64.sqrt());
    let (sin, cos) = libm::sincos(degrees.to_radians());
    picture.map(|p| {
        let p = Vec3::from_array(p);
        let rotated = p + sin * axis.cross(p) + (1.0 - cos) * axis.cross(axis.cross(p));
        rotated.to_array().map(|c| c.clamp(0.0, 1.0))
    })
}

fn chroma(picture: &Picture, factor: f64) -> Picture {
    picture.map(|p| {
        let grey = 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2];
        p.map(|c| (grey + factor * (c - grey)).clamp(0.0, 1.0))
    })
}

/// A sphere on black, with a radius of 0.92 of half the image: Lambert and GGX under four directional lights.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Sphere {
    pub(in super::super) alpha: f64,
    pub(in super::super) kd: [f64; 3],
    pub(in super::super) f0: f64,
    pub(in super::super) size: usize,
}

impl Default for Sphere {
    fn default() -> Self {
        Self { alpha: 0.2, kd: [0.30, 0.12, 0.06], f0: 0.05, size: 160 }
    }
}

/// Direction (to be normalised), intensity, colour.
const LIGHTS: [([f64; 3], f64, [f64; 3]); 4] = [
    ([0.5, 0.6, 0.62], 2.2, [1.0, 0.97, 0.9]),
    ([-0.7, 0.3, 0.65], 1.1, [0.75, 0.85, 1.0]),
    ([0.1, -0.8, 0.6], 0.7, [1.0, 0.9, 0.8]),
    ([0.0, 0.2, 1.0], 0.5, [1.0, 1.0, 1.0]),
];

/// The sphere's linear radiance.
pub(in super::super) fn sphere(s: &Sphere) -> Picture {
    let view = Vec3::Z;
    let smith = |c: f64| 2.0 * c / (c + (s.alpha * s.alpha + (1.0 - s.alpha * s.alpha) * c * c).sqrt());
    Picture::from_fn(s.size, s.size, |column, row| {
        let at = |i: usize| ((i as f64 + 0.5) / s.size as f64 * 2.0 - 1.0) / 0.92;
        let (x, y) = (at(column), -at(row));
        if x * x + y * y >= 1.0 {
            return [0.0; 3];
        }
        let normal = Vec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt());
        let mut radiance = Vec3::ZERO;
        for (direction, intensity, colour) in LIGHTS {
            let light = Vec3::from_array(direction).normalize();
            let half = (light + view).normalize();
            let (nl, nh, nv) = (normal.dot(light).max(0.0), normal.dot(half).max(0.0), normal.z.max(1e-4));
            let a2 = s.alpha * s.alpha;
            let t = nh * nh * (a2 - 1.0) + 1.0;
            let d = a2 / (PI * t * t);
            let f = s.f0 + (1.0 - s.f0) * crate::math::elementary::fifth_power(1.0 - half.dot(view));
            let specular = d * f * smith(nl.max(1e-4)) * smith(nv) / (4.0 * nl.max(1e-4) * nv);
            let brdf = Vec3::from_array(s.kd) / PI + specular;
            radiance += brdf * (nl * intensity * PI / 2.0) * Vec3::from_array(colour);
        }
        radiance.to_array()
    })
}
