use super::*;

const CAMERAS: [Camera; 4] = [
    Camera::Orthographic,
    Camera::Perspective { vertical_fov_deg: 0.1 },
    Camera::Perspective { vertical_fov_deg: 30.0 },
    Camera::Perspective { vertical_fov_deg: 120.0 },
];

fn sphere(circle: Circle, camera: Camera) -> Sphere {
    Sphere::new(200, 100, circle, camera).unwrap()
}

#[test]
fn the_middle_of_a_centred_sphere_faces_the_camera() {
    for camera in CAMERAS {
        let point = sphere(Circle { x: 100.0, y: 50.0, radius: 40.0 }, camera).point(100.0, 50.0).unwrap();
        assert!((point.normal - Vec3::Z).length() < 1e-12 && (point.view - Vec3::Z).length() < 1e-12, "{camera}");
    }
}

#[test]
fn image_x_is_plus_x_and_image_y_is_minus_y() {
    for camera in CAMERAS {
        let sphere = sphere(Circle { x: 100.0, y: 50.0, radius: 40.0 }, camera);
        assert!(sphere.point(120.0, 50.0).unwrap().normal.x > 0.1);
        assert!(sphere.point(100.0, 30.0).unwrap().normal.y > 0.1);
    }
    let orthographic = sphere(Circle { x: 100.0, y: 50.0, radius: 40.0 }, Camera::Orthographic);
    let expected = Vec3::new(0.5, 0.25, (1.0_f64 - 0.3125).sqrt());
    assert!((orthographic.point(120.0, 40.0).unwrap().normal - expected).length() < 1e-15);
}

#[test]
fn the_silhouette_of_a_centred_sphere_is_the_circle() {
    for camera in CAMERAS {
        let sphere = sphere(Circle { x: 100.0, y: 50.0, radius: 40.0 }, camera);
        for k in 0..64 {
            let (s, c) = sin_cos(f64::from(k) * 0.1);
            let at = |r: f64| sphere.point(100.0 + r * c, 50.0 - r * s);
            assert!(at(40.0 + 1e-6).is_none(), "{camera}");
            let rim = at(40.0 - 1e-6).unwrap();
            // At the rim the normal is nearly perpendicular to the view.
            assert!(rim.normal.dot(rim.view) > 0.0 && rim.normal.dot(rim.view) < 1e-3, "{camera}");
        }
    }
}

#[test]
fn the_silhouette_of_an_off_centre_sphere_touches_the_circle_on_the_radial_line_and_lies_inside() {
    let circle = Circle { x: 150.0, y: 30.0, radius: 25.0 };
    for camera in &CAMERAS[2..] {
        let sphere = sphere(circle, *camera);
        let (dx, dy) = (50.0, -20.0);
        let length = 2900.0_f64.sqrt();
        for side in [-1.0, 1.0] {
            let at = |r: f64| sphere.point(150.0 + side * r * dx / length, 30.0 + side * r * dy / length);
            assert!(at(25.0 - 1e-6).is_some() && at(25.0 + 1e-6).is_none(), "{camera}");
        }
        for k in 0..64 {
            let (s, c) = sin_cos(f64::from(k) * 0.1);
            assert!(sphere.point(150.0 + 25.001 * c, 30.0 + 25.001 * s).is_none(), "{camera}");
        }
    }
}

#[test]
fn points_lie_on_the_sphere_and_on_the_ray() {
    for camera in CAMERAS {
        let sphere = sphere(Circle { x: 110.0, y: 45.0, radius: 30.0 }, camera);
        for k in 0..400 {
            let (x, y) = (80.0 + f64::from(k % 20) * 3.0, 15.0 + f64::from(k / 20) * 3.0);
            let Some(point) = sphere.point(x, y) else { continue };
            assert!((point.normal.length() - 1.0).abs() < 1e-9 && (point.view.length() - 1.0).abs() < 1e-14);
            assert!(point.normal.dot(point.view) > 0.0);
            if let View::Perspective { position, pinhole } = sphere.view {
                let to_camera = (position - point.normal).normalize();
                assert!((to_camera - point.view).length() < 1e-9 && (pinhole.ray(x, y) + point.view).length() < 1e-14);
            }
        }
    }
}

#[test]
fn a_narrow_field_of_view_approaches_parallel_rays() {
    let circle = Circle { x: 100.0, y: 50.0, radius: 40.0 };
    let (near, parallel) = (sphere(circle, CAMERAS[1]), sphere(circle, CAMERAS[0]));
    for (x, y) in [(100.0, 50.0), (120.0, 40.0), (70.0, 60.0)] {
        let (a, b) = (near.point(x, y).unwrap(), parallel.point(x, y).unwrap());
        // 2e-3, because the field of view of 0.1 degrees is 1.7e-3 radians.
        assert!((a.normal - b.normal).length() < 2e-3 && (a.view - b.view).length() < 2e-3);
    }
}

#[test]
fn every_fault_has_its_error() {
    let new = |x: f64, radius: f64, camera: Camera| Sphere::new(200, 100, Circle { x, y: 50.0, radius }, camera);
    assert!(matches!(new(-50.0, 40.0, Camera::Orthographic), Err(SceneError::CircleOutside { .. })));
    assert!(matches!(new(50.0, 0.0, Camera::Orthographic), Err(SceneError::Circle { .. })));
    assert!(matches!(new(f64::NAN, 1.0, Camera::Orthographic), Err(SceneError::Circle { .. })));
    let wide = Camera::Perspective { vertical_fov_deg: 180.0 };
    assert!(matches!(new(50.0, 40.0, wide), Err(SceneError::Camera { .. })));
}
