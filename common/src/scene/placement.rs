//! The choice of the circle that the sphere fills: the given one, else that of the mask, else the largest in the photo.

use super::{Circle, Mask, SceneError, fit_circle};

/// The origin of the circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CircleSource {
    /// Given by the user.
    Given,
    /// Fitted to the mask.
    Mask,
    /// The largest circle around the middle of the photo.
    Inscribed,
}

/// The circle of the sphere and its origin.
#[derive(Debug, Clone, PartialEq)]
pub struct Placement {
    /// The circle, in pixels.
    pub circle: Circle,
    /// Its origin.
    pub source: CircleSource,
    /// A warning for the user.
    pub warning: Option<String>,
}

impl Placement {
    /// Chooses the circle for a photo of `width` x `height` pixels.
    ///
    /// # Errors
    /// [`SceneError::EmptyMask`] if the circle must be fitted to a mask that covers too little.
    pub fn choose(given: Option<Circle>, mask: Option<&Mask>, width: usize, height: usize) -> Result<Self, SceneError> {
        if let Some(circle) = given {
            return Ok(Self { circle, source: CircleSource::Given, warning: None });
        }
        let Some(mask) = mask else {
            let circle = Circle::inscribed(width, height);
            return Ok(Self { circle, source: CircleSource::Inscribed, warning: None });
        };
        let fit = fit_circle(mask)?;
        let warning = (fit.mismatch > MOST_MISMATCH).then(|| {
            format!(
                "the mask differs from its best circle {} by {:.1} % of its area: give --normals if the object is not a \
                 sphere, or --sphere if the circle is wrong",
                fit.circle,
                100.0 * fit.mismatch
            )
        });
        Ok(Self { circle: fit.circle, source: CircleSource::Mask, warning })
    }
}

/// A square differs from its best circle by 18 %, a clean mask of a sphere by less than 1 %.
const MOST_MISMATCH: f64 = 0.05;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_given_circle_is_preferred_then_the_mask_then_the_photo() {
        let given = Circle { x: 1.0, y: 2.0, radius: 3.0 };
        let disk = Circle { x: 30.0, y: 22.0, radius: 15.0 };
        let inside = |k: usize| disk.distance((k % 60) as f64 + 0.5, (k / 60) as f64 + 0.5) < disk.radius;
        let at = |k: usize| if inside(k) { 1.0 } else { 0.0 };
        let mask = Mask::new(60, 40, (0..2400).map(at).collect()).unwrap();
        let choose = |given, mask| Placement::choose(given, mask, 60, 40).unwrap();
        assert_eq!(choose(Some(given), Some(&mask)).circle, given);
        let fitted = choose(None, Some(&mask));
        assert!(fitted.source == CircleSource::Mask && fitted.warning.is_none());
        assert!((fitted.circle.radius - 15.0).abs() < 0.1 && (fitted.circle.x - 30.0).abs() < 0.1, "{fitted:?}");
        let inscribed = choose(None, None);
        assert_eq!((inscribed.circle, inscribed.source), (Circle::inscribed(60, 40), CircleSource::Inscribed));
    }

    #[test]
    fn a_square_mask_is_reported() {
        let at = |k: usize| if (10..40).contains(&(k % 50)) && (10..40).contains(&(k / 50)) { 1.0 } else { 0.0 };
        let mask = Mask::new(50, 50, (0..2500).map(at).collect()).unwrap();
        let warning = Placement::choose(None, Some(&mask), 50, 50).unwrap().warning.unwrap();
        assert!(warning.contains("--normals"), "{warning}");
    }
}
