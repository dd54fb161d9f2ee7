//! The neural networks of the measured materials: Sztrajman, Rainer, Ritschel & Weyrich, *Neural BRDF Representation and Importance
//! Sampling* (2021). A port of `make_merl.py`, which is beside the data; made reciprocal in the same way.

use lookalike::math::{
    Rgb, Vec3,
    elementary::{exp, sin_cos},
    sampling::{key, uniform},
};
use std::path::Path;

/// Layers 6-21-21-3; input the half vector (turned to phi 0) and the difference vector.
pub(crate) struct Network {
    layers: [Layer; 3],
}

struct Layer {
    /// Input by output.
    weights: Vec<Vec<f64>>,
    bias: Vec<f64>,
}

impl Network {
    pub(crate) fn read(path: &Path) -> Self {
        let json: serde_json::Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
        let numbers = |value: &serde_json::Value| -> Vec<f64> { flat(value) };
        let layer = |n: usize, outputs: usize| {
            let weights = numbers(&json[format!("w{n}")]).chunks_exact(outputs).map(<[f64]>::to_vec).collect();
            Layer { weights, bias: numbers(&json[format!("b{n}")]) }
        };
        Self { layers: [layer(1, 21), layer(2, 21), layer(3, 3)] }
    }

    /// 1/sr, without the cosine; reciprocal.
    pub(crate) fn eval(&self, wi: Vec3, wo: Vec3) -> Rgb {
        let h = (wi + wo).normalize();
        let sin_h = (h.x * h.x + h.y * h.y).sqrt();
        let (c, s) = (h.x / sin_h, h.y / sin_h);
        // Light in the frame of the half vector.
        let turned = Vec3::new(c * wi.x + s * wi.y, c * wi.y - s * wi.x, wi.z);
        let d = Vec3::new(h.z * turned.x - sin_h * turned.z, turned.y, sin_h * turned.x + h.z * turned.z);
        let at = |d: Vec3| self.forward([sin_h, 0.0, h.z, d.x, d.y, d.z]);
        (at(d) + at(Vec3::new(-d.x, -d.y, d.z))) * 0.5
    }

    fn forward(&self, input: [f64; 6]) -> Rgb {
        let mut values = input.to_vec();
        for (n, layer) in self.layers.iter().enumerate() {
            let sum = |j: usize| values.iter().zip(&layer.weights).fold(layer.bias[j], |s, (x, row)| s + x * row[j]);
            let last = n == 2;
            let next = (0..layer.bias.len()).map(sum);
            values = next.map(|x| if last { (exp(x) - 1.0).max(0.0) } else { x.max(0.0) }).collect();
        }
        Rgb::from_slice(&values)
    }
}

fn flat(value: &serde_json::Value) -> Vec<f64> {
    match value {
        serde_json::Value::Array(items) => items.iter().flat_map(flat).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

/// A direction above the horizon, a function of `n`.
pub(crate) fn direction(n: u64, least_cos: f64) -> Vec3 {
    let z = least_cos + (1.0 - least_cos) * uniform(key(&[n, 31]));
    let (s, c) = sin_cos(std::f64::consts::TAU * uniform(key(&[n, 32])));
    let r = (1.0 - z * z).sqrt();
    Vec3::new(r * c, r * s, z)
}
