use super::*;
use crate::math::sampling::{key, uniform};
use crate::math::to_f32;
use crate::scene::coverage::pixel_coverage;

/// The mask of a disk, with `change` applied to each value.
fn disk(width: usize, height: usize, circle: Circle, change: impl Fn(usize, usize, f32) -> f32) -> Mask {
    let hit = |x: f64, y: f64| circle.distance(x, y) < circle.radius;
    let value = |k: usize| change(k % width, k / width, pixel_coverage(k % width, k / width, hit));
    Mask::new(width, height, (0..width * height).map(value).collect()).unwrap()
}

/// The largest error of the fitted centre and radius, in pixels.
fn off(mask: &Mask, circle: Circle) -> f64 {
    let found = fit_circle(mask).unwrap().circle;
    (found.x - circle.x).abs().max((found.y - circle.y).abs()).max((found.radius - circle.radius).abs())
}

const CIRCLE: Circle = Circle { x: 70.3, y: 52.8, radius: 41.6 };

#[test]
fn antialiased_disks_are_found_to_a_fiftieth_of_a_pixel() {
    for k in 0..20_u64 {
        let random = |c: u64| uniform(key(&[k, c]));
        let circle = Circle { x: 60.0 + 9.0 * random(0), y: 50.0 + 9.0 * random(1), radius: 5.0 + 30.0 * random(2) };
        let off = off(&disk(140, 110, circle, |_, _, m| m), circle);
        assert!(off < 0.02, "{circle:?}: {off}");
    }
}

#[test]
fn hard_edged_masks_are_found_to_a_tenth_of_a_pixel() {
    let mask = disk(140, 110, CIRCLE, |_, _, m| m.round());
    assert!(off(&mask, CIRCLE) < 0.1, "{}", off(&mask, CIRCLE));
}

#[test]
fn holes_and_specks_do_not_move_the_circle() {
    let holes = disk(140, 110, CIRCLE, |c, r, m| if (60..75).contains(&c) && (40..52).contains(&r) { 0.0 } else { m });
    assert!(off(&holes, CIRCLE) < 0.02, "{}", off(&holes, CIRCLE));
    let specks = disk(140, 110, CIRCLE, |c, r, m| if c > 130 && r % 9 == 0 { 1.0 } else { m });
    assert!(off(&specks, CIRCLE) < 0.02, "{}", off(&specks, CIRCLE));
    let salt = disk(140, 110, CIRCLE, |c, r, m| if uniform(key(&[c as u64, r as u64])) < 0.02 { 1.0 - m } else { m });
    assert!(off(&salt, CIRCLE) < 0.2, "{}", off(&salt, CIRCLE));
    let notch = disk(140, 110, CIRCLE, |c, r, m| if c > 105 && (50..56).contains(&r) { 0.0 } else { m });
    assert!(off(&notch, CIRCLE) < 0.5, "{}", off(&notch, CIRCLE));
}

#[test]
fn a_disk_cut_off_by_the_border_of_the_photo_is_found() {
    let circle = Circle { x: 20.0, y: 52.8, radius: 41.6 };
    let off = off(&disk(140, 110, circle, |_, _, m| m), circle);
    assert!(off < 0.05, "{off}");
}

#[test]
fn mismatch_distinguishes_a_disk_from_a_square() {
    let round = fit_circle(&disk(140, 110, CIRCLE, |_, _, m| m)).unwrap();
    assert!(round.mismatch < 0.01, "{round:?}");
    let square = |k: usize| if (40..100).contains(&(k % 140)) && (25..85).contains(&(k / 140)) { 1.0 } else { 0.0 };
    let square = fit_circle(&Mask::new(140, 110, (0..140 * 110).map(square).collect()).unwrap()).unwrap();
    assert!(square.mismatch > 0.1, "{square:?}");
}

#[test]
fn empty_masks_are_refused() {
    let error = fit_circle(&Mask::new(50, 50, vec![to_f32(0.004); 2500]).unwrap()).unwrap_err();
    assert!(matches!(error, SceneError::EmptyMask { covered } if (covered - 10.0).abs() < 1e-3), "{error}");
}
