use super::*;
use crate::math::sampling::{key, uniform};

/// Sum over the pixels of an image in the layout `mapping` of radiance times solid angle. [`Environment::total`] of the
/// resampled map must agree with it.
fn source_total(image: &Image, mapping: Mapping) -> Rgb {
    let (width, height) = (image.width(), image.height());
    let mut total = Rgb::ZERO;
    for row in 0..height {
        for column in 0..width {
            if is_used(mapping, width, height, column, row) {
                let pixel = widen(image.pixel(column, row));
                total += pixel * pixel_solid_angle(mapping, [width, height], column, row);
            }
        }
    }
    total
}

fn pixel_solid_angle(mapping: Mapping, [width, height]: [usize; 2], column: usize, row: usize) -> f64 {
    const POINTS: u32 = 4;
    let mut sum = 0.0;
    for i in 0..POINTS {
        for j in 0..POINTS {
            let at = |pixel: usize, k: u32, size: usize| {
                (pixel as f64 + (f64::from(k) + 0.5) / f64::from(POINTS)) / size as f64
            };
            let position = [at(column, j, width), at(row, i, height)];
            sum += mapping.direction(position).map_or(0.0, |_| mapping.solid_angle_density(position));
        }
    }
    sum / (f64::from(POINTS * POINTS) * width as f64 * height as f64)
}

/// The largest relative difference, over the channels, of the totals before and after.
fn energy_error(image: &Image, mapping: Mapping) -> f64 {
    let before = source_total(image, mapping);
    let after = to_lat_long(image.clone(), mapping).unwrap().total();
    (after / before - Rgb::ONE).abs().max_element()
}

fn filled(mapping: Mapping, size: usize, texel: impl Fn(Vec3) -> [f32; 3]) -> Image {
    let (width, height) = if mapping == Mapping::Cross { (3 * size, 4 * size) } else { (size, size) };
    let mut image = Image::from_pixels(width, height, vec![[f32::NAN; 3]; width * height]);
    for row in 0..height {
        for column in 0..width {
            let position = [(column as f64 + 0.5) / width as f64, (row as f64 + 0.5) / height as f64];
            if let Some(d) = mapping.direction(position) {
                image.pixels_mut()[row * width + column] = texel(d);
            }
        }
    }
    image
}

const RESAMPLED: [Mapping; 3] = [Mapping::Cross, Mapping::Angular, Mapping::MirrorBall];

#[test]
fn a_constant_map_stays_constant_and_empty_parts_do_not_contribute() {
    for mapping in RESAMPLED {
        // The empty parts of the source are NaN.
        let map = to_lat_long(filled(mapping, 32, |_| [0.25, 1.0, 3.0]), mapping).unwrap();
        for i in 0..map.height() {
            for j in 0..map.width() {
                let off = (widen(map.texel(i, j)) - Rgb::new(0.25, 1.0, 3.0)).abs().max_element();
                assert!(off < 1e-6, "{mapping} texel ({i}, {j})");
            }
        }
    }
}

#[test]
fn sizes_follow_the_source() {
    for (mapping, size, width) in [
        (Mapping::Cross, 16, 64),
        (Mapping::Angular, 64, 64),
        (Mapping::Angular, 33, 34),
        (Mapping::MirrorBall, 40, 64),
    ] {
        let map = to_lat_long(filled(mapping, size, |_| [1.0; 3]), mapping).unwrap();
        assert_eq!((map.width(), map.height()), (width, width / 2), "{mapping} {size}");
    }
    let lat_long = Image::from_pixels(10, 3, vec![[1.0; 3]; 30]);
    let map = to_lat_long(lat_long.clone(), Mapping::LatLong).unwrap();
    assert_eq!(map.to_image(), lat_long);
}

#[test]
fn a_smooth_map_is_reproduced_from_every_layout() {
    let smooth = |d: Vec3| Rgb::new(1.0 + d.x, 1.0 + d.y * d.z, 1.5 + d.z);
    for mapping in RESAMPLED {
        let map = to_lat_long(filled(mapping, 64, |d| narrow(smooth(d))), mapping).unwrap();
        let mut worst = 0.0_f64;
        for k in 0..2000_u64 {
            let d = map.direction(uniform(key(&[k, 1])), uniform(key(&[k, 2])));
            // Skips the outermost pixels of a mirror ball: each spans 0.35 radians.
            if mapping == Mapping::MirrorBall && d.z < -0.8 {
                continue;
            }
            worst = worst.max((map.radiance(d) - smooth(d)).abs().max_element());
        }
        println!("{mapping}: {worst:.4}");
        // A pixel of the source spans up to 0.05 radians; a swapped or mirrored axis shows as 1.
        assert!(worst < 0.06, "{mapping}: {worst}");
    }
}

#[test]
fn energy_is_kept_on_noise() {
    let noise = |d: Vec3| {
        let x = uniform(key(&[d.x.to_bits(), d.y.to_bits(), d.z.to_bits()]));
        narrow(Rgb::new(x, x * x, x * x * x * x))
    };
    for mapping in RESAMPLED {
        let error = energy_error(&filled(mapping, 128, noise), mapping);
        println!("{mapping}: {error:.5}");
        assert!(error < 5e-3, "{mapping}: {error}");
    }
}

#[test]
fn a_light_of_one_pixel_keeps_its_energy_and_its_direction() {
    for mapping in RESAMPLED {
        let mut worst = 0.0_f64;
        for k in 0..25_u64 {
            let mut image = filled(mapping, 48, |_| [0.0; 3]);
            let used: Vec<usize> = (0..image.pixels().len()).filter(|&p| image.pixels()[p][0] == 0.0).collect();
            let pixel = used[cell(uniform(key(&[k, 5])) * used.len() as f64, used.len())];
            image.pixels_mut()[pixel] = [1000.0; 3];
            let (width, height) = (image.width(), image.height());
            let position =
                [((pixel % width) as f64 + 0.5) / width as f64, ((pixel / width) as f64 + 0.5) / height as f64];
            let light = mapping.direction(position).unwrap();
            let map = to_lat_long(image.clone(), mapping).unwrap();
            let [x, y] = position.map(|x| 2.0 * x - 1.0);
            let is_at_rim = mapping != Mapping::Cross && x * x + y * y > 0.9 * 0.9;
            let kept = map.total().x / source_total(&image, mapping).x;
            if is_at_rim {
                // Across a pixel at the rim the solid angle per area changes by as much as itself.
                assert!((0.5..2.0).contains(&kept), "{mapping}: {light} kept {kept}");
            } else {
                worst = worst.max((kept - 1.0).abs());
            }
            // The centroid of the energy lies within a source pixel (0.05 to 0.15 radians) of the light.
            let pull = |axis: Vec3| map.irradiance(axis).x - map.irradiance(-axis).x;
            let centroid = Vec3::new(pull(Vec3::X), pull(Vec3::Y), pull(Vec3::Z)).normalize();
            assert!(centroid.dot(light) > 0.985 || is_at_rim, "{mapping}: expected {light}, found {centroid}");
        }
        println!("{mapping}: {worst:.4}");
        // The solid angle varies across the bilinear footprint of one of 48 pixels; a lost light shows as 1.
        assert!(worst < 0.05, "{mapping}: {worst}");
    }
}

#[test]
fn a_cross_of_six_coloured_faces_lights_the_right_sides() {
    let colours: [(Vec3, [f32; 3]); 6] = [
        (Vec3::Y, [1.0, 0.0, 0.0]),
        (-Vec3::X, [0.0, 1.0, 0.0]),
        (-Vec3::Z, [0.0, 0.0, 1.0]),
        (Vec3::X, [1.0, 1.0, 0.0]),
        (-Vec3::Y, [0.0, 1.0, 1.0]),
        (Vec3::Z, [1.0, 0.0, 1.0]),
    ];
    // Column and row of up, left, front, right, down, back, independent of the code under test.
    let places = [(1, 0), (0, 1), (1, 1), (2, 1), (1, 2), (1, 3)];
    let size = 16;
    let mut image = Image::new(3 * size, 4 * size);
    for (&(column, row), (_, colour)) in places.iter().zip(&colours) {
        for i in 0..size {
            for j in 0..size {
                image.pixels_mut()[(row * size + i) * 3 * size + column * size + j] = *colour;
            }
        }
    }
    let map = to_lat_long(image, Mapping::Cross).unwrap();
    for (direction, colour) in colours {
        assert!((map.radiance(direction) - widen(colour)).abs().max_element() < 1e-6, "{direction}");
        let near = (direction + Vec3::new(0.4, 0.3, 0.5) * (Vec3::ONE - direction.abs())).normalize();
        assert!((map.radiance(near) - widen(colour)).abs().max_element() < 1e-6, "{near}");
    }
    // The front, -Z, lies at the edge u = 0 of the lat-long map; the back, +Z, lies in its centre.
    assert!((widen(map.texel(16, 0)) - widen([0.0, 0.0, 1.0])).length() < 1e-6);
    assert!((widen(map.texel(16, 32)) - widen([1.0, 0.0, 1.0])).length() < 1e-6);
}

#[test]
fn bad_pixels_are_named_in_the_source() {
    let mut image = filled(Mapping::Cross, 8, |_| [1.0; 3]);
    image.pixels_mut()[9 * 24 + 10] = [1.0, -2.0, 1.0];
    let expected = LightError::Texel { column: 10, row: 9, found: [1.0, -2.0, 1.0] };
    assert_eq!(to_lat_long(image, Mapping::Cross), Err(expected));
    let error = to_lat_long(Image::new(8, 8), Mapping::Cross).unwrap_err();
    assert!(matches!(error, LightError::Shape { width: 8, height: 8, .. }), "{error}");
}

#[test]
fn energy_is_kept_on_real_maps() {
    let root = std::env::var("LOOKALIKE_DATA")
        .unwrap_or_else(|_| concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data").to_owned());
    for name in ["grace_cross", "rnl_cross"] {
        let Ok(bytes) = std::fs::read(format!("{root}/probes/{name}.hdr")) else {
            println!("skipped: {name}.hdr is not in {root} (set LOOKALIKE_DATA)");
            continue;
        };
        let image = crate::image::decode(name, &bytes).unwrap().image;
        assert_eq!(Mapping::recognise(image.width(), image.height()), Ok(Mapping::Cross));
        let clock = std::time::Instant::now();
        let error = energy_error(&image, Mapping::Cross);
        println!("{name}: energy off by {:.4} %, {:?}", 100.0 * error, clock.elapsed());
        assert!(error < 5e-3, "{name}: {error}");
    }
}
