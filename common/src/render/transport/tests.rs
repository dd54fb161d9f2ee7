use super::*;
use crate::{
    brdf::model,
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

/// All pixels of one list, and the same pixels in lists that are too short for a grid of normals.
#[test]
fn tables_on_a_grid_of_normals_agree_with_integrals_at_the_pixels() {
    const SIDE: u32 = 64;
    let pyramid = room();
    for camera in [Camera::Orthographic, Camera::perspective(40.0).unwrap()] {
        let side = SIDE as usize;
        let geometry = Geometry::sphere(side, side, Circle::inscribed(side, side), camera).unwrap();
        let mut pixels: Vec<Pixel> = (0..SIDE * SIDE).map(|k| [k % SIDE, k / SIDE]).collect();
        pixels.retain(|&[column, row]| geometry.coverage(column as usize, row as usize) == 1.0);
        pixels.sort_by_key(|&pixel| tile_order(pixel));
        for name in ["ggx", "cook-torrance"] {
            let knots = Knots::covering(0.25, 0.5, 5.0);
            let plan = TransportPlan { model: model(name).unwrap(), knots, accuracy: Accuracy::SUBSET };
            let whole = plan.integrate(&geometry, &pyramid, &pixels);
            let parts: Vec<TransportTable> =
                pixels.chunks(16).map(|pixels| plan.integrate(&geometry, &pyramid, pixels)).collect();
            let parts = TransportTable::concatenate(&parts.iter().collect::<Vec<_>>()).unwrap();
            for (lobe, (whole, parts)) in whole.lobes.iter().zip(&parts.lobes).enumerate() {
                // A grid for the cosine lobe may have more nodes than this image has pixels.
                assert!(lobe == 0 || whole != parts, "on a grid twice, or never");
                for (plane, (whole, parts)) in
                    whole.values.chunks(pixels.len()).zip(parts.values.chunks(pixels.len())).enumerate()
                {
                    let mean = parts.iter().map(|&value| f64::from(value)).sum::<f64>() / pixels.len() as f64;
                    let squares = whole.iter().zip(parts).map(|(a, b)| f64::from(a - b) * f64::from(a - b));
                    let rms = (squares.sum::<f64>() / pixels.len() as f64).sqrt() / mean;
                    println!("{camera} {name} lobe {lobe} plane {plane}: {:.3} %", 100.0 * rms);
                    assert!(rms < 2e-3, "{camera} {name} lobe {lobe} plane {plane}: {rms}");
                }
            }
        }
    }
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
