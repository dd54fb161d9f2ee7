use super::*;
use crate::{
    brdf::MODELS,
    image::Image,
    light::Environment,
    math::elementary::acos,
    scene::{Camera, Circle},
};

/// Walls of some texture, a window and a lamp of one texel.
fn room() -> LightPyramid {
    let texel = |k: usize| match (k / 64, k % 64) {
        (8..=13, 10..=16) => [4.0, 5.0, 7.0],
        (9, 44) => [300.0, 250.0, 200.0],
        (row, column) => [0.10, 0.08, 0.06].map(|wall: f32| wall * (1.0 + 0.1 * ((3 * row + column) % 7) as f32)),
    };
    LightPyramid::new(Environment::new(Image::from_pixels(64, 32, (0..64 * 32).map(texel).collect())).unwrap())
}

/// Every lobe of every model, kinked ones and wide ones included, under lamps that set on the object, seen from afar and from close by.
#[test]
fn interpolated_integrals_agree_with_those_computed_at_the_pixels() {
    const SIDE: u32 = 64;
    let pyramid = room();
    for camera in [Camera::Orthographic, Camera::perspective(90.0).unwrap()] {
        let side = SIDE as usize;
        let geometry = Geometry::sphere(side, side, Circle::inscribed(side, side), camera).unwrap();
        let mut pixels: Vec<Pixel> = (0..SIDE * SIDE).map(|k| [k % SIDE, k / SIDE]).collect();
        pixels.retain(|&[column, row]| geometry.coverage(column as usize, row as usize) > 0.0);
        pixels.sort_by_key(|&pixel| tile_order(pixel));
        let view = View { accuracy: Accuracy::FULL, geometry: &geometry, pyramid: &pyramid, pixels: &pixels };
        let mut seen = std::collections::BTreeSet::new();
        for model in MODELS {
            for basis in model.lobes().iter().filter(|basis| seen.insert(basis.lobe.name())) {
                let widths = match basis.width {
                    Some(width) => {
                        let (low, high) = width.span(model.parameters());
                        Knots::covering((0.1 * high).max(low), high, 2.0).widths()
                    }
                    None => vec![0.0],
                };
                for (band, range) in bands(basis.lobe, &widths) {
                    check(&view, Slice { lobe: basis.lobe, band, widths: &widths[range] });
                }
            }
        }
    }
}

/// Largest root mean square difference, in units of the tolerance: that is the largest error of one node of a cut, and pixels as wide as
/// these have errors of their own, most from close by.
const MOST: f64 = 2.5;
const MOST_FROM_CLOSE_BY: f64 = 4.0;

/// The pixels that take their integrals from a grid agree with all pixels; `MOST` says how well.
fn check(view: &View<'_>, slice: Slice<'_>) {
    let parts: Vec<Vec<Part>> = view.pixels.iter().map(|&pixel| view.parts(pixel, slice)).collect();
    let mut interpolator = Interpolator::new(view, slice).unwrap();
    let mut rest: Vec<usize> = (0..view.pixels.len()).collect();
    let mut interpolated = Vec::new();
    while let Some(found) = interpolator.next(&parts, &rest) {
        let (taken, left): (Vec<_>, Vec<_>) = rest.into_iter().zip(found).partition(|(_, found)| found.is_some());
        interpolated.extend(taken.into_iter().filter_map(|(pixel, found)| Some((pixel, found?))));
        rest = left.into_iter().map(|(pixel, _)| pixel).collect();
    }
    let name = slice.lobe.name();
    // The grids of lobes that need more care have more nodes than this picture has pixels.
    if slice.band.sharpest() > 0.2 && slice.lobe.care() <= 1.0 {
        assert!(interpolated.len() > view.pixels.len() / 3, "{name} {:?}: {}", slice.band, interpolated.len());
    }
    interpolated = interpolated.into_iter().step_by(11).collect();
    let pixels: Vec<usize> = interpolated.iter().map(|(pixel, _)| *pixel).collect();
    let fine = View { accuracy: Accuracy { tolerance: 1e-3, footprint: 0.7 }, ..*view };
    let parts: Vec<Vec<Part>> = view.pixels.iter().map(|&pixel| fine.parts(pixel, slice)).collect();
    let exact = fine.at_pixels(slice, &parts, &pixels);
    let count = slice.integrals();
    let limit = view.accuracy.tolerance * view.pyramid.mean_radiance() / slice.lobe.care();
    for k in 0..count {
        let squares =
            interpolated.iter().zip(exact.chunks_exact(count)).map(|((_, found), exact)| (found[k] - exact[k]).powi(2));
        let rms = (squares.sum::<f64>() / pixels.len().max(1) as f64).sqrt() / limit;
        // The `F5` part is seen beside some hundredths of the rest.
        let share = if 2 * k >= count && lobe_terms(slice.lobe) == 2 { 0.1 } else { 1.0 };
        let camera = view.geometry.camera();
        let most = if camera == Camera::Orthographic { MOST } else { MOST_FROM_CLOSE_BY };
        assert!(rms < most * share, "{camera} {name} {:?}, integral {k}: {rms:.2} of the tolerance", slice.band);
    }
}

#[test]
fn neighbours_follow_each_other_in_tile_order() {
    let mut pixels: Vec<Pixel> = (0..64).map(|k| [k % 8, k / 8]).collect();
    pixels.sort_by_key(|&pixel| tile_order(pixel));
    assert_eq!(pixels[..6], [[0, 0], [1, 0], [0, 1], [1, 1], [2, 0], [3, 0]]);
    for (side, squares) in [(2, pixels.chunks(4)), (4, pixels.chunks(16))] {
        for square in squares {
            assert!(square.iter().all(|pixel| pixel.map(|x| x / side) == square[0].map(|x| x / side)));
        }
    }
    assert_eq!(tile_order([u32::MAX, 0]), 0x5555_5555_5555_5555);
}

#[test]
fn normal_maps_are_on_a_grid_under_parallel_rays_only() {
    let map = Image::from_pixels(8, 8, vec![[0.0, 0.0, 1.0]; 64]);
    let viewpoint = |camera| Geometry::normals(&map, camera).unwrap().viewpoint();
    assert!(viewpoint(Camera::Orthographic).is_some());
    assert!(viewpoint(Camera::perspective(30.0).unwrap()).is_none());
}

/// The same light, shape and lobe through a viewpoint and through the pixels.
#[test]
fn the_view_of_a_normal_is_that_of_the_pixel_that_shows_it() {
    for camera in [Camera::Orthographic, Camera::perspective(60.0).unwrap()] {
        let geometry = Geometry::sphere(90, 60, Circle { x: 30.0, y: 25.0, radius: 20.0 }, camera).unwrap();
        let viewpoint = geometry.viewpoint().unwrap();
        let mut seen = 0;
        for [x, y] in (0..90).flat_map(|x| (0..60).map(move |y| [f64::from(x) + 0.3, f64::from(y) + 0.6])) {
            let Some(point) = geometry.point(x, y) else { continue };
            assert!((viewpoint.view(point.normal) - point.view).length() < 1e-12, "{camera} {x} {y}");
            let from_axis = acos(point.normal.dot(viewpoint.axis()));
            assert!(from_axis < viewpoint.reach_rad() + 1e-9);
            seen += 1;
        }
        assert!(seen > 1000);
    }
}
