//! Three lights made by formula: to look at a material under other light than that of the photo that it was fitted to.

use super::Environment;
use crate::{
    image::Image,
    math::{Rgb, Vec3, elementary::sin_cos, narrow},
};
use std::f64::consts::{PI, TAU};

/// A light made by formula: a bright disc or several over a smooth surrounding.
#[derive(Debug, Clone, Copy)]
pub struct FormulaLight {
    /// Its name for users.
    pub name: &'static str,
    /// Radiance from straight below, from the horizon, and from straight above.
    surrounding: [[f64; 3]; 3],
    lamps: &'static [Lamp],
}

/// A disc with a soft edge.
#[derive(Debug, Clone, Copy)]
struct Lamp {
    /// Where its centre is seen; of any length.
    towards: [f64; 3],
    /// Angle from its centre to where its edge begins.
    radius_deg: f64,
    radiance: [f64; 3],
}

/// Three soft boxes in a dark room; the sun in a blue sky; a row of windows in a room with warm walls.
pub const FORMULA_LIGHTS: [FormulaLight; 3] = [
    FormulaLight {
        name: "studio",
        surrounding: [[0.02; 3], [0.05; 3], [0.04; 3]],
        lamps: &[
            Lamp { towards: [-0.7, 0.7, 0.6], radius_deg: 18.0, radiance: [6.0, 6.0, 6.0] },
            Lamp { towards: [0.9, 0.2, 0.5], radius_deg: 24.0, radiance: [1.2, 1.25, 1.3] },
            Lamp { towards: [0.2, 0.8, -0.7], radius_deg: 12.0, radiance: [8.0, 7.6, 7.0] },
        ],
    },
    FormulaLight {
        name: "sun",
        surrounding: [[0.12, 0.09, 0.06], [0.5, 0.55, 0.6], [0.15, 0.3, 0.7]],
        lamps: &[Lamp { towards: [0.5, 0.6, 0.7], radius_deg: 3.0, radiance: [500.0, 460.0, 390.0] }],
    },
    FormulaLight {
        name: "windows",
        surrounding: [[0.1, 0.07, 0.05], [0.25, 0.2, 0.15], [0.3, 0.27, 0.22]],
        lamps: &[
            Lamp { towards: [-1.0, 0.25, 0.9], radius_deg: 9.0, radiance: [5.0, 5.6, 6.4] },
            Lamp { towards: [-1.0, 0.25, 0.3], radius_deg: 9.0, radiance: [5.0, 5.6, 6.4] },
            Lamp { towards: [-1.0, 0.25, -0.3], radius_deg: 9.0, radiance: [5.0, 5.6, 6.4] },
        ],
    },
];

/// Rows of the map. A texel is 2.8 degrees, less than the smallest lamp's radius.
const HEIGHT: usize = 64;

/// The edge of a lamp ends at so many times its radius.
const EDGE: f64 = 1.4;

impl FormulaLight {
    /// Radiance from a unit direction.
    #[must_use]
    pub fn radiance(&self, direction: Vec3) -> Rgb {
        let [below, horizon, above] = self.surrounding.map(Rgb::from_array);
        let to = if direction.y < 0.0 { below } else { above };
        let lamps = self.lamps.iter().map(|lamp| {
            let cosine = |degrees: f64| sin_cos(degrees.to_radians()).1;
            let (inner, outer) = (cosine(lamp.radius_deg), cosine(EDGE * lamp.radius_deg));
            let at = Vec3::from_array(lamp.towards).normalize().dot(direction);
            Rgb::from_array(lamp.radiance) * ((at - outer) / (inner - outer)).clamp(0.0, 1.0)
        });
        horizon.lerp(to, direction.y.abs()) + lamps.sum::<Rgb>()
    }

    /// The map: at each texel the radiance from its centre.
    ///
    /// # Panics
    /// Never: the radiance of the lights above is finite and positive.
    #[must_use]
    pub fn environment(&self) -> Environment {
        let (width, height) = (2 * HEIGHT, HEIGHT);
        let texel = |index: usize| {
            let (theta, u) = (centre(index / width, height) * PI, centre(index % width, width));
            let ((sin_theta, cos_theta), (s, c)) = (sin_cos(theta), sin_cos(TAU * u));
            narrow(self.radiance(Vec3::new(sin_theta * s, cos_theta, -sin_theta * c)))
        };
        let image = Image::from_pixels(width, height, (0..width * height).map(texel).collect());
        Environment::new(image).expect("the radiance is finite and positive")
    }
}

/// The middle of a cell, as a share of all of them.
fn centre(index: usize, count: usize) -> f64 {
    (index as f64 + 0.5) / count as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lights_differ_and_their_lamps_are_where_they_are_said_to_be() {
        for light in FORMULA_LIGHTS {
            let map = light.environment();
            for lamp in light.lamps {
                let towards = Vec3::from_array(lamp.towards).normalize();
                let (seen, elsewhere) = (map.radiance(towards), map.radiance(-towards));
                assert!(seen.x > 0.9 * lamp.radiance[0] && seen.x > 5.0 * elsewhere.x, "{}: {lamp:?}", light.name);
            }
            assert!(map.mean_radiance().max_element() < 10.0 && light.radiance(Vec3::NEG_Y).min_element() > 0.0);
        }
    }
}
