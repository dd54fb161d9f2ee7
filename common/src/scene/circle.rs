//! The circle that the sphere fills in the photo.

use super::SceneError;

/// A circle in pixels: x to the right and y down from the top left corner of the photo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Centre, from the left edge.
    pub x: f64,
    /// Centre, from the top edge.
    pub y: f64,
    /// Radius, above 0.
    pub radius: f64,
}

impl Circle {
    /// A circle from its centre and radius in pixels.
    ///
    /// # Errors
    /// [`SceneError::Circle`] unless all are finite and the radius is above 0.
    pub fn new(x: f64, y: f64, radius: f64) -> Result<Self, SceneError> {
        if x.is_finite() && y.is_finite() && radius.is_finite() && radius > 0.0 {
            Ok(Self { x, y, radius })
        } else {
            Err(SceneError::Circle { found: format!("{x},{y},{radius}") })
        }
    }

    /// The largest circle around the middle of a photo.
    #[must_use]
    pub fn inscribed(width: usize, height: usize) -> Self {
        Self { x: 0.5 * width as f64, y: 0.5 * height as f64, radius: 0.5 * width.min(height) as f64 }
    }

    /// Whether any part of the disk lies in a photo of this size.
    #[must_use]
    pub fn meets(&self, width: usize, height: usize) -> bool {
        let dx = self.x - self.x.clamp(0.0, width as f64);
        let dy = self.y - self.y.clamp(0.0, height as f64);
        dx * dx + dy * dy < self.radius * self.radius
    }

    /// Whether the whole disk lies in a photo of this size, to a thousandth of a pixel.
    #[must_use]
    pub fn fits(&self, width: usize, height: usize) -> bool {
        let margin = self.radius - 1e-3;
        self.x >= margin && self.y >= margin && self.x <= width as f64 - margin && self.y <= height as f64 - margin
    }

    /// Distance of a point from the centre, in pixels.
    #[must_use]
    pub fn distance(&self, x: f64, y: f64) -> f64 {
        let (dx, dy) = (x - self.x, y - self.y);
        (dx * dx + dy * dy).sqrt()
    }
}

impl std::str::FromStr for Circle {
    type Err = SceneError;

    /// Reads `CX,CY,R` in pixels.
    fn from_str(text: &str) -> Result<Self, SceneError> {
        let fault = || SceneError::Circle { found: text.to_owned() };
        let numbers: Vec<f64> =
            text.split(',').map(|part| part.trim().parse()).collect::<Result<_, _>>().map_err(|_| fault())?;
        match numbers[..] {
            [x, y, radius] => Self::new(x, y, radius).map_err(|_| fault()),
            _ => Err(fault()),
        }
    }
}

impl std::fmt::Display for Circle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{},{},{}", self.x, self.y, self.radius)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_round_trips_and_invalid_text_is_quoted() {
        assert_eq!("128, 127.5,120".parse(), Ok(Circle { x: 128.0, y: 127.5, radius: 120.0 }));
        let circle = Circle { x: 0.1, y: -3.0, radius: 1e-3 };
        assert_eq!(circle.to_string().parse(), Ok(circle));
        for bad in ["", "1,2", "1,2,3,4", "a,b,c", "1,2,0", "1,2,-3", "NaN,1,2", "1,2,inf"] {
            let message = bad.parse::<Circle>().unwrap_err().to_string();
            assert!(message.contains(&format!("`{bad}`")), "{message}");
        }
    }

    #[test]
    fn inscribed_circle_touches_the_nearer_edges() {
        assert_eq!(Circle::inscribed(256, 200), Circle { x: 128.0, y: 100.0, radius: 100.0 });
        assert!(Circle::inscribed(256, 200).fits(256, 200));
    }

    #[test]
    fn circles_partly_and_wholly_in_the_photo_are_recognised() {
        let at = |x: f64, y: f64| Circle { x, y, radius: 10.0 };
        assert!(at(-9.0, 50.0).meets(100, 100) && !at(-9.0, 50.0).fits(100, 100));
        // The corner is 7.1 away in x and in y: a distance of 10.04.
        assert!(!at(-7.1, -7.1).meets(100, 100) && at(-7.0, -7.0).meets(100, 100));
        assert!(at(10.0, 90.0).fits(100, 100) && !at(10.0, 90.1).fits(100, 100));
    }
}
