//! Pixels whose value is known without integration: constant light, mirrors, rotated maps, finer images, other descriptions of the same
//! sphere.

use super::knots;
use lookalike::{
    brdf::{CookTorrance, Ggx, Model, flat_len, offset_of},
    image::Image,
    light::Environment,
    math::{Rgb, Vec3, narrow, widen},
    render::{
        knots::PER_OCTAVE,
        table::Planes,
        transport::{Accuracy, Pixel, TransportPlan},
    },
    scene::{Camera, Geometry},
};
use lookalike_tests::scene::{Scene, spread, synthetic};

/// The material of the sphere: `None` is white Lambert, else a metal of F = 1 with this alpha.
type Surface = Option<f64>;

/// How many pixels are compared: `most` with `--features slow`.
const fn count(few: usize, most: usize) -> usize {
    if cfg!(feature = "slow") { most } else { few }
}

fn render(scene: &Scene, pixels: &[Pixel], surface: Surface, accuracy: Accuracy) -> Planes {
    let (model, colour): (&'static dyn Model, &str) =
        if surface.is_some() { (&Ggx, "f0") } else { (&CookTorrance, "kd") };
    let mut parameters = vec![0.0; flat_len(model.parameters())];
    let first = offset_of(model.parameters(), colour).unwrap();
    parameters[first..first + 3].fill(1.0);
    if let Some(f90) = offset_of(model.parameters(), "f90") {
        parameters[f90] = 1.0;
    }
    *parameters.last_mut().unwrap() = surface.unwrap_or(0.1);
    let plan = TransportPlan::of_model(model, knots(PER_OCTAVE), accuracy);
    let table = plan.integrate(&scene.geometry, &scene.pyramid, pixels);
    let mut planes = table.planes();
    table.radiance(model, &parameters, &mut planes);
    planes
}

fn sphere(environment: Environment) -> Scene {
    Scene::sphere(256, Camera::Orthographic, environment).unwrap()
}

/// Root mean square difference as a share of the first's mean, over all channels.
fn difference(a: &Planes, b: &Planes) -> f64 {
    let pairs = || a.iter().flatten().zip(b.iter().flatten());
    let count = pairs().count() as f64;
    let mean = pairs().map(|(a, _)| a).sum::<f64>() / count;
    (pairs().map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / count).sqrt() / mean
}

#[test]
fn white_lambertian_sphere_in_constant_light_has_its_radiance() {
    let scene = sphere(synthetic::uniform(2.5));
    let pixels = spread(&scene.interior(), count(24, 64), 3);
    for plane in render(&scene, &pixels, None, Accuracy::SUBSET) {
        // The map has 16 rows of texels; this is the error of a cut at the kink at the horizon.
        assert!(plane.iter().all(|value| (value / 2.5 - 1.0).abs() < 2e-3), "{plane:?}");
    }
}

#[test]
fn sharp_lobe_of_unit_fresnel_conserves_energy_in_constant_light() {
    let scene = sphere(synthetic::uniform(1.0));
    // Away from the rim, masking removes less than alpha^2 of a sharp lobe.
    let pixels: Vec<Pixel> = (0..32).step_by(32 / count(8, 32)).map(|i| [128 + 3 * i, 128 - 2 * i]).collect();
    for plane in render(&scene, &pixels, Some(0.02), Accuracy::SUBSET) {
        assert!(plane.iter().all(|value| (value - 1.0).abs() < 2e-3), "{plane:?}");
    }
}

#[test]
fn sharpest_lobe_mirrors_smooth_light() {
    // Radiance linear in the direction: a lobe symmetric about the mirror direction sees its value there.
    let (height, width) = (256, 512);
    let uniform = synthetic::uniform(1.0);
    let slope = Vec3::new(0.5, -0.3, 0.2);
    let light = |d: Vec3| 1.0 + slope.dot(d);
    let texel = |k: usize| {
        let (v, u) = ((k / width) as f64 + 0.5, (k % width) as f64 + 0.5);
        narrow(Rgb::splat(light(uniform.direction(u / width as f64, v / height as f64))))
    };
    let map = Image::from_pixels(width, height, (0..width * height).map(texel).collect());
    let scene = sphere(Environment::new(map).unwrap());
    let pixels: Vec<Pixel> = (0..32).step_by(32 / count(8, 32)).map(|i| [128 - 3 * i, 128 + i]).collect();
    let planes = render(&scene, &pixels, Some(0.005), Accuracy::SUBSET);
    for (pixel, value) in pixels.iter().zip(&planes[0]) {
        let surface = scene.geometry.point(f64::from(pixel[0]) + 0.5, f64::from(pixel[1]) + 0.5).unwrap();
        let mirrored = 2.0 * surface.normal.dot(surface.view) * surface.normal - surface.view;
        // The tail of the lobe (alpha^2 ln(1/alpha)) and the pixel's area average the linear light.
        assert!((value / light(mirrored) - 1.0).abs() < 2e-3, "{pixel:?}: {value} {}", light(mirrored));
    }
}

#[test]
fn rotating_the_map_equals_shifting_its_columns() {
    let map = synthetic::room(32);
    let image = map.to_image();
    let width = image.width();
    // 90 degrees brings the light at +Z (u = 1/2) to +X (u = 1/4).
    let shifted = |k: usize| image.pixel((k % width + width / 4) % width, k / width);
    let pixels = (0..width * image.height()).map(shifted).collect();
    let shifted = Environment::new(Image::from_pixels(width, image.height(), pixels)).unwrap();
    let (turned, shifted) = (sphere(map.rotated(90.0)), sphere(shifted));
    let pixels = spread(&turned.interior(), count(16, 64), 4);
    for surface in [None, Some(0.1)] {
        let accuracy = Accuracy { tolerance: 1e-4, footprint: 1.0 };
        let [a, b] = [&turned, &shifted].map(|scene| render(scene, &pixels, surface, accuracy));
        // Both use the same cut of the same cells; only the rounding of directions differs.
        assert!(difference(&a, &b) < 1e-5, "{surface:?}: {}", difference(&a, &b));
    }
}

/// A pixel of a near-mirror sphere covers 0.9 degrees of the map at the centre and 2 degrees at 0.9 R: many lobe widths.
#[test]
fn near_mirror_pixel_is_the_mean_of_an_eight_times_finer_image() {
    const FINER: u32 = 8;
    let scene = sphere(synthetic::room(256));
    let fine = Scene::sphere(256 * FINER as usize, Camera::Orthographic, synthetic::room(256)).unwrap();
    let pixels = spread(&scene.interior(), count(6, 24), 5);
    let inside = |[c, r]: Pixel| (0..FINER * FINER).map(move |k| [c * FINER + k % FINER, r * FINER + k / FINER]);
    let parts: Vec<Pixel> = pixels.iter().flat_map(|&pixel| inside(pixel)).collect();
    let accuracy = Accuracy { tolerance: 1e-4, footprint: 1.0 };
    for (alpha, tolerance) in [(0.01, 2e-3), (0.03, 2e-3)] {
        let coarse = render(&scene, &pixels, Some(alpha), accuracy);
        let fine = render(&fine, &parts, Some(alpha), accuracy).map(|plane| {
            let count = (FINER * FINER) as usize;
            plane.chunks_exact(count).map(|part| part.iter().sum::<f64>() / count as f64).collect()
        });
        println!("alpha {alpha}: {:.4} %", 100.0 * difference(&fine, &coarse));
        assert!(difference(&fine, &coarse) < tolerance, "alpha {alpha}: {}", difference(&fine, &coarse));
    }
}

#[test]
fn normal_map_of_the_sphere_gives_the_image_of_the_sphere() {
    let scene = sphere(synthetic::room(64));
    let normal = |k: usize| {
        let point = scene.geometry.point((k % 256) as f64 + 0.5, (k / 256) as f64 + 0.5);
        point.map_or([0.0; 3], |p| narrow(p.normal))
    };
    let map = Image::from_pixels(256, 256, (0..256 * 256).map(normal).collect());
    assert!(map.pixels().iter().any(|n| widen(*n).length() > 0.99));
    let mapped = Scene::new(Geometry::normals(&map, Camera::Orthographic).unwrap(), synthetic::room(64));
    // Towards the rim bilinear normals lag behind the sphere's by h^2 / (8 (1 - r^2)^1.5): 2.5e-4 radians here, a
    // hundredth of the sharpest lobe's width.
    let inner = |p: &Pixel| {
        let [x, y] = p.map(|k| (f64::from(k) - 127.5) / 128.0);
        x * x + y * y < 0.95 * 0.95 && mapped.geometry.is_interior(p[0] as usize, p[1] as usize)
    };
    let pixels = spread(&scene.interior().into_iter().filter(inner).collect::<Vec<_>>(), count(24, 100), 6);
    for surface in [None, Some(0.02), Some(0.2)] {
        let accuracy = Accuracy { tolerance: 1e-4, footprint: 1.0 };
        let [a, b] = [&scene, &mapped].map(|scene| render(scene, &pixels, surface, accuracy));
        println!("{surface:?}: {:.4} %", 100.0 * difference(&a, &b));
        assert!(difference(&a, &b) < 5e-3, "{surface:?}: {}", difference(&a, &b));
    }
}
