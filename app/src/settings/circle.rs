//! `--sphere`: where the sphere lies in the photo.

use anyhow::{Context, bail};
use std::{fmt, str::FromStr};

/// The silhouette circle of the sphere, in pixels: pixel (c, r), top left first, covers [c, c+1] x [r, r+1].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Column of the centre; x grows to the right.
    pub center_x_px: f64,
    /// Row of the centre; y grows downwards.
    pub center_y_px: f64,
    /// Radius, above 0.
    pub radius_px: f64,
}

impl FromStr for Circle {
    type Err = anyhow::Error;

    /// `CX,CY,R`.
    fn from_str(text: &str) -> anyhow::Result<Self> {
        let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
        let numbers = numbers.context("expected three numbers CX,CY,R in pixels")?;
        let [center_x_px, center_y_px, radius_px] = numbers[..] else {
            bail!("expected three numbers CX,CY,R in pixels, found {}", numbers.len());
        };
        if !(center_x_px.is_finite() && center_y_px.is_finite()) {
            bail!("the centre must be finite");
        }
        if !(radius_px > 0.0 && radius_px.is_finite()) {
            bail!("the radius must be above 0");
        }
        Ok(Self { center_x_px, center_y_px, radius_px })
    }
}

impl fmt::Display for Circle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{},{}", self.center_x_px, self.center_y_px, self.radius_px)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_is_centre_and_radius_in_pixels() {
        let circle: Circle = "128, 127.5,100".parse().unwrap();
        assert_eq!(circle, Circle { center_x_px: 128.0, center_y_px: 127.5, radius_px: 100.0 });
        assert_eq!(circle.to_string().parse::<Circle>().unwrap(), circle);
    }

    #[test]
    fn incomplete_and_degenerate_circles_are_refused() {
        for text in ["", "1,2", "1,2,3,4", "1,2,0", "1,2,-3", "1,2,inf", "nan,2,3", "a,b,c"] {
            assert!(text.parse::<Circle>().is_err(), "{text}");
        }
    }
}
