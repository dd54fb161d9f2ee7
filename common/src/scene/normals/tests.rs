use super::*;
use crate::scene::{Circle, Sphere};

/// The normals of an orthographic sphere at the pixel centres.
fn sphere_map(size: usize) -> (Image, Sphere) {
    let sphere = Sphere::new(size, size, Circle::inscribed(size, size), Camera::Orthographic).unwrap();
    let at = |k: usize| {
        let point = sphere.point((k % size) as f64 + 0.5, (k / size) as f64 + 0.5);
        point.map_or([0.0; 3], |point| narrow(point.normal))
    };
    (Image::from_pixels(size, size, (0..size * size).map(at).collect()), sphere)
}

#[test]
fn a_map_of_a_sphere_gives_the_spheres_normals_inside_pixels() {
    let (map, sphere) = sphere_map(64);
    let surface = NormalMap::new(&map, Camera::Orthographic).unwrap();
    assert!(surface.warnings().is_empty());
    for k in 0..2500 {
        let (x, y) = (12.3 + 0.8 * f64::from(k % 50), 11.9 + 0.8 * f64::from(k / 50));
        let Some(expected) = sphere.point(x, y).filter(|point| point.normal.z > 0.4) else { continue };
        let found = surface.point(x, y).unwrap();
        // The error of bilinear normals on a sphere of 64 pixels: second differences of (1/32)^2 / cos^3.
        assert!((found.normal - expected.normal).length() < 4e-3, "{x} {y}");
        assert!((found.normal.length() - 1.0).abs() < 1e-12);
        assert_eq!(found.view, Vec3::Z);
    }
    let centre = surface.point(20.5, 30.5).unwrap().normal;
    assert!((centre - widen(map.pixel(20, 30))).length() < 1e-7);
}

/// A map of 6 x 5 with the object in columns 2 to 5.
fn half_plane() -> Image {
    let at = |k: usize| if k % 6 >= 2 { [0.0, 0.0, 1.0] } else { [0.0; 3] };
    Image::from_pixels(6, 5, (0..30).map(at).collect())
}

#[test]
fn straight_edges_lie_between_pixels_and_the_map_ends_at_the_border_of_the_photo() {
    let surface = NormalMap::new(&half_plane(), Camera::Orthographic).unwrap();
    assert!(surface.point(1.99, 2.5).is_none() && surface.point(2.01, 2.5).is_some());
    for (x, y, inside) in [(6.0, 5.0, true), (5.9, 0.0, true), (6.01, 2.0, false), (4.0, -0.01, false)] {
        assert_eq!(surface.point(x, y).is_some(), inside, "{x} {y}");
    }
    assert!(surface.point(f64::NAN, 1.0).is_none());
    assert!(!surface.is_interior(2, 2) && surface.is_interior(3, 2) && surface.is_interior(5, 4));
}

#[test]
fn perspective_views_point_to_the_pinhole() {
    let map = Image::from_pixels(8, 8, vec![[0.0, 0.0, 1.0]; 64]);
    let surface = NormalMap::new(&map, Camera::Perspective { vertical_fov_deg: 60.0 }).unwrap();
    assert!((surface.point(4.0, 4.0).unwrap().view - Vec3::Z).length() < 1e-15);
    // This point is to the right and above, so the camera lies to the left and below.
    let view = surface.point(7.5, 0.5).unwrap().view;
    assert!(view.x < -0.1 && view.y < -0.1 && view.z > 0.5);
}

#[test]
fn normalised_normals_are_kept_bit_for_bit() {
    let odd = |k: usize| {
        narrow(Vec3::new(0.1 * (k % 7) as f64, -0.05 * k as f64, 1.0).normalize() * (0.97 + 0.002 * k as f64))
    };
    let map = Image::from_pixels(5, 5, (0..25).map(odd).collect());
    let surface = NormalMap::new(&map, Camera::Orthographic).unwrap();
    let again = NormalMap::new(&surface.to_image(), Camera::Orthographic).unwrap();
    assert_eq!(surface, again);
    assert!(surface.to_image().pixels().iter().all(|&n| (widen(n).length() - 1.0).abs() < 1e-6));
}

#[test]
fn odd_lengths_and_back_faces_become_background_with_a_warning() {
    let mut map = half_plane();
    map.pixels_mut()[8] = [0.0, 0.0, 0.4];
    map.pixels_mut()[21] = [0.6, 0.0, -0.8];
    let surface = NormalMap::new(&map, Camera::Orthographic).unwrap();
    assert_eq!(surface.warnings().len(), 2);
    assert!(!surface.is_object(2, 1) && !surface.is_object(3, 3));
}

#[test]
fn faults_are_named_with_their_place() {
    let with = |change: fn(&mut [[f32; 3]])| {
        let mut map = half_plane();
        change(map.pixels_mut());
        NormalMap::new(&map, Camera::Orthographic)
    };
    let nan = with(|pixels| pixels[9] = [0.0, f32::NAN, 1.0]).unwrap_err();
    assert!(matches!(nan, SceneError::Normal { column: 3, row: 1, .. }), "{nan}");
    let encoded = with(|pixels| pixels.iter_mut().for_each(|n| *n = n.map(|x| 0.5 * x + 0.5))).unwrap_err();
    assert!(matches!(encoded, SceneError::NormalLength { total: 30, .. }), "{encoded}");
    assert!(encoded.to_string().contains("2 c - 1"), "{encoded}");
    let empty = with(|pixels| pixels.fill([0.0; 3])).unwrap_err();
    assert_eq!(empty, SceneError::NoSurface);
    let away = with(|pixels| pixels.iter_mut().for_each(|n| n[2] = -n[2])).unwrap_err();
    assert_eq!(away, SceneError::NoSurface);
}
