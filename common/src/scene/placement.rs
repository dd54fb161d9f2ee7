//! The choice of the circle that the sphere fills: the given one, else that of the mask or of the alpha channel, else the largest in the photo.

use super::{Circle, CircleFit, Mask, SceneError, fit_circle};

/// The origin of the circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CircleSource {
    /// Given by the user.
    Given,
    /// Fitted to the mask.
    Mask,
    /// Fitted to the photo's alpha channel.
    Alpha,
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
    /// Chooses the circle for a photo with this mask or alpha channel.
    ///
    /// # Errors
    /// [`SceneError::EmptyMask`] if the circle must be fitted to a mask that covers too little.
    pub fn choose(
        given: Option<Circle>,
        mask: Option<&Mask>,
        alpha: Option<&Mask>,
        (width, height): (usize, usize),
    ) -> Result<Self, SceneError> {
        if let Some(circle) = given {
            return Ok(Self { circle, source: CircleSource::Given, warning: None });
        }
        if let Some(mask) = mask {
            let fit = fit_circle(mask)?;
            let warning = (fit.mismatch > MOST_MISMATCH).then(|| {
                format!(
                    "the mask differs from its best circle {} by {:.1} % of its area: give --normals if the object is not a \
                     sphere, or --sphere if the circle is wrong",
                    fit.circle,
                    100.0 * fit.mismatch
                )
            });
            return Ok(Self { circle: fit.circle, source: CircleSource::Mask, warning });
        }
        let inscribed = Circle::inscribed(width, height);
        let found = alpha.filter(|alpha| alpha.coverage().iter().any(|&a| a < 1.0)).and_then(|a| fit_circle(a).ok());
        let is_disk = |fit: &CircleFit| {
            let Circle { x, y, radius } = fit.circle;
            let (width, height) = (width as f64, height as f64);
            let is_inside = (0.0..=width).contains(&x) && (0.0..=height).contains(&y) && radius <= width.max(height);
            is_inside && fit.mismatch <= MOST_MISMATCH
        };
        let away = found.filter(|fit| is_disk(fit) && differs(fit.circle, inscribed));
        Ok(match away {
            Some(CircleFit { circle, .. }) => {
                let Circle { x, y, radius } = circle;
                let warning = format!(
                    "the sphere is at {x:.1},{y:.1},{radius:.1} by the photo's alpha channel; --sphere gives another circle"
                );
                Self { circle, source: CircleSource::Alpha, warning: Some(warning) }
            }
            None => Self { circle: inscribed, source: CircleSource::Inscribed, warning: None },
        })
    }
}

/// Whether two circles differ by more than finding one in a photo is off.
fn differs(a: Circle, b: Circle) -> bool {
    [a.x - b.x, a.y - b.y, a.radius - b.radius].iter().any(|difference| difference.abs() > SAME)
}

/// Circles up to so many pixels from the largest in the photo are taken for it.
const SAME: f64 = 1.0;

/// A square differs from its best circle by 18 %, a clean mask of a sphere by less than 1 %.
const MOST_MISMATCH: f64 = 0.05;

#[cfg(test)]
mod tests {
    use super::*;

    const DISK: Circle = Circle { x: 30.0, y: 22.0, radius: 15.0 };

    /// 1 inside [`DISK`], 0 outside, of a photo of 60 x 40 pixels.
    fn disk() -> Vec<f32> {
        let inside = |k: usize| DISK.distance((k % 60) as f64 + 0.5, (k / 60) as f64 + 0.5) < DISK.radius;
        (0..2400).map(|k| if inside(k) { 1.0 } else { 0.0 }).collect()
    }

    fn is_disk(placement: &Placement) -> bool {
        !differs(Circle { x: placement.circle.x, ..placement.circle }, DISK)
    }

    #[test]
    fn the_given_circle_is_preferred_then_the_mask_then_the_photo() {
        let given = Circle { x: 1.0, y: 2.0, radius: 3.0 };
        let mask = Mask::new(60, 40, disk()).unwrap();
        let choose = |given, mask| Placement::choose(given, mask, None, (60, 40)).unwrap();
        assert_eq!(choose(Some(given), Some(&mask)).circle, given);
        let fitted = choose(None, Some(&mask));
        assert!(fitted.source == CircleSource::Mask && fitted.warning.is_none() && is_disk(&fitted), "{fitted:?}");
        let inscribed = choose(None, None);
        assert_eq!((inscribed.circle, inscribed.source), (Circle::inscribed(60, 40), CircleSource::Inscribed));
    }

    #[test]
    fn sphere_is_found_by_the_alpha_channel_which_says_where() {
        let by = |alpha: Vec<f32>| {
            let alpha = Mask::new(60, 40, alpha).unwrap();
            Placement::choose(None, None, Some(&alpha), (60, 40)).unwrap()
        };
        let found = by(disk());
        assert!(found.source == CircleSource::Alpha && is_disk(&found), "{found:?}");
        assert!(found.warning.unwrap().contains("alpha channel"));
        // Opaque everywhere; empty; no disk; and the circle that is meant without it.
        let circle = Circle::inscribed(60, 40);
        let inside = |k: usize| circle.distance((k % 60) as f64 + 0.5, (k / 60) as f64 + 0.5) < circle.radius;
        let usual = (0..2400).map(|k| if inside(k) { 1.0 } else { 0.0 }).collect();
        let half = (0..2400).map(|k| if k < 1200 { 1.0 } else { 0.0 }).collect();
        for alpha in [vec![1.0; 2400], vec![0.0; 2400], half, usual] {
            let placed = by(alpha);
            assert_eq!((placed.circle, placed.source, placed.warning), (circle, CircleSource::Inscribed, None));
        }
    }

    #[test]
    fn a_square_mask_is_reported() {
        let at = |k: usize| if (10..40).contains(&(k % 50)) && (10..40).contains(&(k / 50)) { 1.0 } else { 0.0 };
        let mask = Mask::new(50, 50, (0..2500).map(at).collect()).unwrap();
        let warning = Placement::choose(None, Some(&mask), None, (50, 50)).unwrap().warning.unwrap();
        assert!(warning.contains("--normals"), "{warning}");
    }
}
