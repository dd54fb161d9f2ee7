use super::*;
use crate::math::narrow;

const CAMERAS: [Camera; 2] = [Camera::Orthographic, Camera::Perspective { vertical_fov_deg: 40.0 }];

#[test]
fn coverage_adds_up_to_the_disks_area() {
    let circle = Circle { x: 31.2, y: 29.7, radius: 25.4 };
    for camera in CAMERAS {
        let geometry = Geometry::sphere(64, 60, circle, camera).unwrap();
        let area: f64 = (0..64 * 60).map(|k| f64::from(geometry.coverage(k % 64, k / 64))).sum();
        // About 200 silhouette pixels, each accurate to about 1/256; off the axis the ellipse is slightly smaller.
        assert!((area / (std::f64::consts::PI * 25.4 * 25.4) - 1.0).abs() < 1e-3, "{camera}: {area}");
    }
}

#[test]
fn coverage_is_full_if_and_only_if_the_whole_pixel_is_inside() {
    let circle = Circle { x: 20.3, y: 19.6, radius: 15.7 };
    let geometry = Geometry::sphere(40, 40, circle, Camera::Orthographic).unwrap();
    for (column, row) in (0..1600).map(|k| (k % 40, k / 40)) {
        let corners =
            [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| circle.distance((column + i) as f64, (row + j) as f64));
        let coverage = geometry.coverage(column, row);
        let is_inside = corners.iter().all(|&d| d < circle.radius);
        assert_eq!(coverage == 1.0, is_inside, "({column}, {row})");
        assert_eq!(geometry.is_interior(column, row), is_inside);
        assert!(coverage > 0.0 || corners.iter().all(|&d| d > circle.radius - 0.2), "({column}, {row})");
    }
}

#[test]
fn a_sphere_smaller_than_a_pixel_has_its_area() {
    let geometry = Geometry::sphere(4, 4, Circle { x: 1.5, y: 1.5, radius: 0.3 }, Camera::Orthographic).unwrap();
    assert!((geometry.coverage(1, 1) - 0.283).abs() < 0.01, "{}", geometry.coverage(1, 1));
    assert_eq!(geometry.coverage(2, 1), 0.0);
    assert_eq!(geometry.normal_turns(1, 1), [0.0; 2]);
}

#[test]
fn normal_turns_have_the_designs_value_in_the_middle_and_grow_towards_the_edge() {
    // Design section 5: at 256 pixels a pixel at the centre of a mirror sphere sees 0.9 degrees of the map, so its
    // normal changes by half of that.
    let geometry = Geometry::sphere(256, 256, Circle::inscribed(256, 256), Camera::Orthographic).unwrap();
    let [x, y] = geometry.normal_turns(128, 128).map(f64::to_degrees);
    assert!((x - 0.45).abs() < 0.01 && (y - 0.45).abs() < 0.01, "{x} {y}");
    // Across the silhouette, not along it.
    let [x, y] = geometry.normal_turns(128 + 115, 128).map(f64::to_degrees);
    assert!(x > 1.9 * 0.45 && x < 4.0 * 0.45 && (y - 0.45).abs() < 0.01, "{x} {y}");
    assert!(geometry.normal_turns(255, 128).iter().all(|turn| turn.is_finite() && *turn < 1.6));
}

#[test]
fn a_one_pixel_hole_in_a_normal_map_is_not_covered() {
    let mut map = Image::from_pixels(9, 9, vec![[0.0, 0.0, 1.0]; 81]);
    map.pixels_mut()[4 * 9 + 4] = [0.0; 3];
    let geometry = Geometry::normals(&map, Camera::Orthographic).unwrap();
    assert!(geometry.coverage(4, 4) < 1.0 && geometry.coverage(4, 4) > 0.0);
    assert_eq!(geometry.coverage(3, 4), 1.0);
    assert!(!geometry.is_interior(3, 4) && !geometry.is_interior(4, 4) && geometry.is_interior(2, 4));
    assert!(geometry.circle().is_none() && geometry.normal_map().is_some());
}

#[test]
fn a_sphere_and_its_normal_map_cover_the_same_area() {
    let sphere = Geometry::sphere(48, 48, Circle { x: 24.0, y: 24.0, radius: 20.0 }, Camera::Orthographic).unwrap();
    let at = |k: usize| {
        let point = sphere.point((k % 48) as f64 + 0.5, (k / 48) as f64 + 0.5);
        point.map_or([0.0; 3], |point| narrow(point.normal))
    };
    let map =
        Geometry::normals(&Image::from_pixels(48, 48, (0..48 * 48).map(at).collect()), Camera::Orthographic).unwrap();
    let area = |g: &Geometry| (0..48 * 48).map(|k| f64::from(g.coverage(k % 48, k / 48))).sum::<f64>();
    assert!((area(&map) / area(&sphere) - 1.0).abs() < 0.01, "{} {}", area(&map), area(&sphere));
}

#[test]
fn tiny_photos_are_refused() {
    let error = Geometry::sphere(1, 1, Circle::inscribed(1, 1), Camera::Orthographic).unwrap_err();
    assert_eq!(error, SceneError::TooSmall { width: 1, height: 1 });
    assert!(Geometry::normals(&Image::new(1, 5), Camera::Orthographic).is_err());
}
