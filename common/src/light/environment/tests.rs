use super::*;
use crate::math::sampling::{key, uniform};

impl Environment {
    /// Irradiance on a surface of unit normal `normal`: sum over all texels of radiance, cosine and solid angle.
    pub(in crate::light) fn irradiance(&self, normal: Vec3) -> Rgb {
        (0..self.height).fold(Rgb::ZERO, |total, i| {
            let (sin_theta, cos_theta) = sin_cos(PI * (i as f64 + 0.5) / self.height as f64);
            let row = (0..self.width).fold(Rgb::ZERO, |sum, j| {
                let d = self.direction_at((j as f64 + 0.5) / self.width as f64, sin_theta, cos_theta);
                sum + widen(self.texel(i, j)) * d.dot(normal).max(0.0)
            });
            total + row * self.texel_solid_angle(i)
        })
    }
}

/// A map whose texels all differ.
fn speckled(width: usize, height: usize) -> Environment {
    let texel = |k: usize| std::array::from_fn(|c| to_f32(uniform(key(&[k as u64, c as u64]))));
    Environment::new(Image::from_pixels(width, height, (0..width * height).map(texel).collect())).unwrap()
}

fn directions(count: u64) -> impl Iterator<Item = Vec3> {
    (0..count).map(|i| {
        let y = 1.0 - 2.0 * uniform(key(&[i, 1]));
        let (s, c) = sin_cos(TAU * uniform(key(&[i, 2])));
        let r = (1.0 - y * y).sqrt();
        Vec3::new(r * s, y, r * c)
    })
}

fn close(a: Rgb, b: Rgb, tolerance: f64) -> bool {
    (a - b).abs().max_element() <= tolerance
}

#[test]
fn centre_is_plus_z_quarter_is_plus_x_edges_are_minus_z() {
    let map = speckled(8, 4);
    for (u, v, expected) in [
        (0.5, 0.5, Vec3::Z),
        (0.25, 0.5, Vec3::X),
        (0.75, 0.5, -Vec3::X),
        (0.0, 0.5, -Vec3::Z),
        (1.0, 0.5, -Vec3::Z),
        (0.3, 0.0, Vec3::Y),
        (0.3, 1.0, -Vec3::Y),
    ] {
        assert!((map.direction(u, v) - expected).length() < 1e-15, "{u} {v}");
    }
}

#[test]
fn uv_inverts_direction_under_any_rotation() {
    for degrees in [0.0, 30.0, -77.7, 359.999] {
        let map = speckled(16, 8).rotated(degrees);
        for d in directions(2000) {
            let [u, v] = map.uv(d);
            assert!((0.0..1.0).contains(&u) && (0.0..=1.0).contains(&v));
            assert!((map.direction(u, v) - d).length() < 1e-13, "{d} at {degrees}");
        }
    }
}

#[test]
fn radiance_at_a_texel_centre_is_the_texel() {
    let map = speckled(16, 8);
    for i in 0..8 {
        for j in 0..16 {
            let d = map.direction((j as f64 + 0.5) / 16.0, (i as f64 + 0.5) / 8.0);
            assert!(close(map.radiance(d), widen(map.texel(i, j)), 1e-13));
        }
    }
}

/// The definition of the bilinear map, without the border, the shared weights and the fast angles of the
/// implementation.
fn plain_bilinear(map: &Environment, d: Vec3) -> Rgb {
    use crate::math::elementary::{acos, atan2};
    let (w, h) = (map.width() as i64, map.height() as i64);
    let x = (atan2(d.x, -d.z) / TAU).rem_euclid(1.0) * w as f64 - 0.5;
    let y = acos(d.y) / PI * h as f64 - 0.5;
    let (j, i) = (x.floor(), y.floor());
    let fetch = |i: i64, j: i64| {
        let (i, shift) = if i < 0 { (-1 - i, w / 2) } else { (i, 0) };
        let (i, shift) = if i >= h { (2 * h - 1 - i, w / 2) } else { (i, shift) };
        let j = (j + shift).rem_euclid(w);
        widen(map.texel(usize::try_from(i).unwrap(), usize::try_from(j).unwrap()))
    };
    let (s, t) = (x - j, y - i);
    #[allow(clippy::cast_possible_truncation, reason = "whole numbers of the size of the map")]
    let (i, j) = (i as i64, j as i64);
    let upper = fetch(i, j) * (1.0 - s) + fetch(i, j + 1) * s;
    let lower = fetch(i + 1, j) * (1.0 - s) + fetch(i + 1, j + 1) * s;
    upper * (1.0 - t) + lower * t
}

#[test]
fn radiance_is_bilinear_wraps_in_u_and_continues_across_the_poles() {
    for (width, height) in [(16, 8), (2, 1), (6, 4)] {
        let map = speckled(width, height);
        for d in directions(3000) {
            // 1e-6, because the acos of this reference loses half its digits near a pole.
            assert!(close(map.radiance(d), plain_bilinear(&map, d), 1e-6), "{d}");
        }
    }
    let map = speckled(16, 8);
    let across = |epsilon: f64| map.radiance(map.direction(0.3, epsilon));
    assert!(close(
        across(1e-7),
        (widen(map.texel(0, 4)) * 0.7
            + widen(map.texel(0, 5)) * 0.3
            + widen(map.texel(0, 12)) * 0.7
            + widen(map.texel(0, 13)) * 0.3)
            * 0.5,
        1e-5
    ));
    assert!(close(map.radiance(Vec3::new(1e-9, 1.0, 0.0)), map.radiance(Vec3::new(-1e-9, 1.0, 0.0)), 1e-6));
}

#[test]
fn a_quarter_turn_brings_the_light_of_plus_z_to_plus_x() {
    let map = speckled(16, 8);
    let turned = map.clone().rotated(90.0);
    assert!(close(turned.radiance(Vec3::X), map.radiance(Vec3::Z), 1e-13));
    assert!(close(turned.radiance(-Vec3::Z), map.radiance(Vec3::X), 1e-13));
    assert!(close(turned.radiance(Vec3::Y), map.radiance(Vec3::Y), 1.0));
    for d in directions(200) {
        let (s, c) = sin_cos(0.3);
        let rotated = Vec3::new(c * d.x + s * d.z, d.y, -s * d.x + c * d.z);
        let by_angle = map.clone().rotated(0.3_f64.to_degrees());
        assert!(close(by_angle.radiance(rotated), map.radiance(d), 1e-12));
    }
}

#[test]
fn rotations_add_up_and_stay_below_a_turn() {
    let map = speckled(4, 2);
    assert_eq!(map.clone().rotated(200.0).rotated(200.0).rotation_deg(), 40.0);
    assert_eq!(map.clone().rotated(-90.0).rotation_deg(), 270.0);
    assert_eq!(map.clone().rotated(-1e-30).rotation_deg(), 0.0);
    let turned = map.rotated(123.456);
    let rebuilt = Environment::new(turned.to_image()).unwrap().rotated(turned.rotation_deg());
    assert_eq!(rebuilt, turned);
}

#[test]
fn texel_solid_angles_add_up_to_the_sphere_and_totals_use_them() {
    let map = Environment::new(Image::from_pixels(64, 32, vec![[0.5, 1.0, 2.0]; 64 * 32])).unwrap();
    let sphere: f64 = (0..32).map(|i| map.texel_solid_angle(i) * 64.0).sum();
    assert!((sphere - 4.0 * PI).abs() < 1e-12);
    assert!(close(map.mean_radiance(), Rgb::new(0.5, 1.0, 2.0), 1e-12));
    assert_eq!(map.max_radiance(), Rgb::new(0.5, 1.0, 2.0));
    // 0.01: the error of the midpoint rule over 64 x 32 texels.
    assert!(close(map.irradiance(Vec3::new(0.6, 0.0, 0.8)), Rgb::new(0.5, 1.0, 2.0) * PI, 0.01));
}

#[test]
fn faults_are_named_with_their_place() {
    let with = |texel: [f32; 3]| {
        let mut image = Image::from_pixels(4, 2, vec![[1.0; 3]; 8]);
        image.pixels_mut()[6] = texel;
        Environment::new(image)
    };
    for bad in [[-0.1, 0.0, 0.0], [0.0, f32::INFINITY, 0.0]] {
        assert_eq!(with(bad), Err(LightError::Texel { column: 2, row: 1, found: bad }));
    }
    let message = with([f32::NAN, 0.0, 0.0]).unwrap_err().to_string();
    assert!(message.contains("column 2, row 1") && message.contains("NaN"), "{message}");
    assert_eq!(Environment::new(Image::new(4, 2)), Err(LightError::Black));
    for (width, height) in [(0, 0), (3, 2), (1, 1)] {
        let image = Image::from_pixels(width, height, vec![[1.0; 3]; width * height]);
        assert_eq!(Environment::new(image), Err(LightError::Size { width, height }));
    }
}
