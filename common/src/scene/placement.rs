//! The choice of the circle that the sphere fills: the given one, else that of the mask, of the alpha channel or of the silhouette over black, else the
//! largest in the photo.

use super::{Circle, CircleFit, Mask, SceneError, fit_circle};
use crate::{image::Image, math::widen};

/// The origin of the circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CircleSource {
    /// Given by the user.
    Given,
    /// Fitted to the mask.
    Mask,
    /// Fitted to the photo's alpha channel.
    Alpha,
    /// Fitted to what is lit in a photo over black.
    Silhouette,
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
        photo: &Image,
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
        let inscribed = Circle::inscribed(photo.width(), photo.height());
        let of_alpha = alpha.filter(|alpha| alpha.coverage().iter().any(|&a| a < 1.0));
        let (shape, source, name) = match of_alpha {
            Some(alpha) => (Some(alpha.clone()), CircleSource::Alpha, "alpha channel"),
            None => (lit(photo), CircleSource::Silhouette, "silhouette over black"),
        };
        let found = shape.and_then(|shape| fit_circle(&shape).ok()).filter(|fit| fit.mismatch <= MOST_MISMATCH);
        let away = found.filter(|fit| differs(fit.circle, inscribed));
        Ok(match away {
            Some(CircleFit { circle, .. }) => {
                let warning = format!("the sphere is at {circle} by the photo's {name}; --sphere gives another circle");
                Self { circle, source, warning: Some(warning) }
            }
            None => Self { circle: inscribed, source: CircleSource::Inscribed, warning: None },
        })
    }
}

/// Whether two circles differ by more than finding one in a photo is off.
fn differs(a: Circle, b: Circle) -> bool {
    [a.x - b.x, a.y - b.y, a.radius - b.radius].iter().any(|difference| difference.abs() > SAME)
}

/// What is lit in a photo over black.
fn lit(photo: &Image) -> Option<Mask> {
    let lights: Vec<f64> = photo.pixels().iter().map(|&pixel| widen(pixel).max_element()).collect();
    let mean = lights.iter().filter(|light| light.is_finite()).sum::<f64>() / lights.len() as f64;
    let at = |light: &f64| if *light > BLACK * mean { 1.0 } else { 0.0 };
    Mask::new(photo.width(), photo.height(), lights.iter().map(at).collect()).ok()
}

/// Values below this share of the mean of the photo are black.
const BLACK: f64 = 0.005;

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

    fn photo(light: impl Fn(usize) -> f32) -> Image {
        Image::from_pixels(60, 40, (0..2400).map(|k| [light(k), 0.5 * light(k), 0.0]).collect())
    }

    fn is_disk(placement: &Placement) -> bool {
        !differs(Circle { x: placement.circle.x, ..placement.circle }, DISK)
    }

    #[test]
    fn the_given_circle_is_preferred_then_the_mask_then_the_photo() {
        let given = Circle { x: 1.0, y: 2.0, radius: 3.0 };
        let mask = Mask::new(60, 40, disk()).unwrap();
        let grey = photo(|_| 0.3);
        let choose = |given, mask| Placement::choose(given, mask, None, &grey).unwrap();
        assert_eq!(choose(Some(given), Some(&mask)).circle, given);
        let fitted = choose(None, Some(&mask));
        assert!(fitted.source == CircleSource::Mask && fitted.warning.is_none() && is_disk(&fitted), "{fitted:?}");
        let inscribed = choose(None, None);
        assert_eq!((inscribed.circle, inscribed.source), (Circle::inscribed(60, 40), CircleSource::Inscribed));
    }

    #[test]
    fn sphere_is_found_by_alpha_and_by_its_silhouette_and_the_photo_says_where() {
        let alpha = Mask::new(60, 40, disk()).unwrap();
        let by_alpha = Placement::choose(None, None, Some(&alpha), &photo(|_| 0.3)).unwrap();
        assert!(by_alpha.source == CircleSource::Alpha && is_disk(&by_alpha), "{by_alpha:?}");
        assert!(by_alpha.warning.unwrap().contains("alpha channel"));
        let shape = disk();
        let lit = photo(|k| shape[k] * (0.1 + 0.01 * (k % 60) as f32) + 1e-5);
        let by_light = Placement::choose(None, None, None, &lit).unwrap();
        assert!(by_light.source == CircleSource::Silhouette && is_disk(&by_light), "{by_light:?}");
        // Opaque everywhere, and lit everywhere or nowhere.
        let opaque = Mask::new(60, 40, vec![1.0; 2400]).unwrap();
        for photo in [photo(|k| 0.1 + shape[k]), photo(|_| 0.0)] {
            let placed = Placement::choose(None, None, Some(&opaque), &photo).unwrap();
            assert_eq!((placed.source, placed.warning), (CircleSource::Inscribed, None));
        }
    }

    #[test]
    fn sphere_that_fills_the_photo_stays_where_it_is_by_convention() {
        let circle = Circle::inscribed(40, 40);
        let inside = |k: usize| circle.distance((k % 40) as f64 + 0.5, (k / 40) as f64 + 0.5) < circle.radius;
        let pixels = (0..1600).map(|k| if inside(k) { [0.2; 3] } else { [0.0; 3] }).collect();
        let placed = Placement::choose(None, None, None, &Image::from_pixels(40, 40, pixels)).unwrap();
        assert_eq!((placed.circle, placed.source, placed.warning), (circle, CircleSource::Inscribed, None));
    }

    #[test]
    fn a_square_mask_is_reported() {
        let at = |k: usize| if (10..40).contains(&(k % 50)) && (10..40).contains(&(k / 50)) { 1.0 } else { 0.0 };
        let mask = Mask::new(50, 50, (0..2500).map(at).collect()).unwrap();
        let warning = Placement::choose(None, Some(&mask), None, &Image::new(50, 50)).unwrap().warning.unwrap();
        assert!(warning.contains("--normals"), "{warning}");
    }
}
