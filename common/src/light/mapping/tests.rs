use super::*;
use crate::math::sampling::{key, uniform};

impl Mapping {
    /// Steradians per unit of image area (the whole image has area 1) at a position that has a direction.
    pub(in crate::light) fn solid_angle_density(self, [x, y]: [f64; 2]) -> f64 {
        match self {
            Self::LatLong => TAU * PI * sin_cos(PI * y).0,
            Self::Cross => {
                let (a, b) = (2.0 * (3.0 * x).fract() - 1.0, 2.0 * (4.0 * y).fract() - 1.0);
                let square = 1.0 + a * a + b * b;
                // The face is 2 x 2 at distance 1, and covers a twelfth of the image.
                4.0 * 12.0 / (square * square.sqrt())
            }
            Self::Angular => {
                let r = on_disk(x, y).map_or(1.0, |[_, _, r]| r);
                // Both axes run over 2 units; sin(phi) d(phi) d(psi) = pi sin(pi r) / r dx dy.
                4.0 * PI * if r > 0.0 { sin_cos(PI * r).0 / r } else { PI }
            }
            // The orthographic view of a mirror ball preserves area: d(omega) = 4 dx dy.
            Self::MirrorBall => 16.0,
        }
    }
}

fn points(count: u64) -> impl Iterator<Item = [f64; 2]> {
    (0..count).map(|i| [uniform(key(&[i, 1])), uniform(key(&[i, 2]))])
}

fn close(a: [f64; 2], b: [f64; 2], tolerance: f64) -> bool {
    (a[0] - b[0]).abs() < tolerance && (a[1] - b[1]).abs() < tolerance
}

#[test]
fn position_and_direction_invert_each_other() {
    for mapping in Mapping::ALL {
        let mut seen = 0;
        for p in points(20_000) {
            let Some(d) = mapping.direction(p) else { continue };
            seen += 1;
            assert!((d.length() - 1.0).abs() < 1e-14, "{mapping} {p:?}");
            let back = mapping.position(d);
            // All positions near the rim of a ball have nearly the same direction, so compare directions there.
            let again = mapping.direction(back).unwrap();
            assert!((again - d).length() < 1e-7, "{mapping} {p:?} {back:?}");
            assert!(close(back, p, 1e-7) || d.z.abs() > 0.999, "{mapping} {p:?} {back:?}");
        }
        assert!(seen > 9_000, "{mapping}: {seen} of 20000 positions are directions");
    }
}

#[test]
fn every_direction_has_a_position() {
    for mapping in Mapping::ALL {
        for d in [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z] {
            let back = mapping.direction(mapping.position(d)).unwrap();
            assert!((back - d).length() < 1e-7, "{mapping} {d} {back}");
        }
    }
}

#[test]
fn angular_and_mirror_ball_have_the_directions_of_the_design() {
    assert!((Mapping::Angular.direction([0.5, 0.5]).unwrap() + Vec3::Z).length() < 1e-15);
    assert!((Mapping::Angular.direction([0.75, 0.5]).unwrap() - Vec3::X).length() < 1e-15);
    assert!((Mapping::Angular.direction([0.5, 0.25]).unwrap() - Vec3::Y).length() < 1e-15);
    assert!((Mapping::MirrorBall.direction([0.5, 0.5]).unwrap() - Vec3::Z).length() < 1e-15);
    let half = 0.5 * std::f64::consts::FRAC_1_SQRT_2;
    assert!((Mapping::MirrorBall.direction([0.5 + half, 0.5]).unwrap() - Vec3::X).length() < 1e-15);
    assert!((Mapping::MirrorBall.direction([0.5, 0.5 - half]).unwrap() - Vec3::Y).length() < 1e-15);
    for outside in [[0.01, 0.01], [0.99, 0.99], [1.2, 0.5], [f64::NAN, 0.5]] {
        assert_eq!(Mapping::Angular.direction(outside), None);
    }
}

/// Checks the centre and the top left corner (as stored) of each face.
#[test]
fn every_face_of_the_cross_has_the_documented_place_and_orientation() {
    let eps = 1e-9;
    for (name, place, centre, top_left) in [
        ("up", [1.0, 0.0], Vec3::Y, Vec3::new(-1.0, 1.0, 1.0)),
        ("left", [0.0, 1.0], -Vec3::X, Vec3::new(-1.0, 1.0, 1.0)),
        ("front", [1.0, 1.0], -Vec3::Z, Vec3::new(-1.0, 1.0, -1.0)),
        ("right", [2.0, 1.0], Vec3::X, Vec3::new(1.0, 1.0, -1.0)),
        ("down", [1.0, 2.0], -Vec3::Y, Vec3::new(-1.0, -1.0, -1.0)),
        // Upright, the top left of the back face is (1, 1, 1); rotated by 180 degrees it is (-1, -1, 1).
        ("back", [1.0, 3.0], Vec3::Z, Vec3::new(-1.0, -1.0, 1.0)),
    ] {
        let [column, row] = place;
        let middle = Mapping::Cross.direction([(column + 0.5) / 3.0, (row + 0.5) / 4.0]).unwrap();
        assert!((middle - centre).length() < 1e-14, "{name}");
        let corner = Mapping::Cross.direction([(column + eps) / 3.0, (row + eps) / 4.0]).unwrap();
        assert!((corner - top_left.normalize()).length() < 1e-8, "{name}: {corner}");
    }
    for empty in [[0.1, 0.1], [0.9, 0.1], [0.1, 0.6], [0.9, 0.6], [0.1, 0.9], [0.9, 0.9]] {
        assert_eq!(Mapping::Cross.direction(empty), None, "{empty:?}");
    }
}

#[test]
fn directions_are_continuous_across_the_folds_of_the_cross() {
    let eps = 1e-9;
    for (x, y) in [(0.4, 0.25), (0.6, 0.5), (0.4, 0.75)] {
        let (above, below) = (Mapping::Cross.direction([x, y - eps]), Mapping::Cross.direction([x, y + eps]));
        assert!((above.unwrap() - below.unwrap()).length() < 1e-7, "fold at y = {y}");
    }
    for (x, y) in [(1.0 / 3.0, 0.3), (2.0 / 3.0, 0.4)] {
        let (left, right) = (Mapping::Cross.direction([x - eps, y]), Mapping::Cross.direction([x + eps, y]));
        assert!((left.unwrap() - right.unwrap()).length() < 1e-7, "fold at x = {x}");
    }
}

#[test]
fn solid_angle_densities_integrate_to_the_sphere() {
    let n = 1200;
    for mapping in Mapping::ALL {
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..n {
                let p = [(f64::from(j) + 0.5) / f64::from(n), (f64::from(i) + 0.5) / f64::from(n)];
                sum += mapping.direction(p).map_or(0.0, |_| mapping.solid_angle_density(p));
            }
        }
        let sphere = sum / f64::from(n * n);
        // 1e-3: the rim of the disks is resolved to one of 1200 points.
        assert!((sphere / (4.0 * PI) - 1.0).abs() < 1e-3, "{mapping}: {sphere}");
    }
}

#[test]
fn only_two_to_one_and_three_to_four_are_recognised_by_shape() {
    assert_eq!(Mapping::recognise(1200, 600), Ok(Mapping::LatLong));
    assert_eq!(Mapping::recognise(768, 1024), Ok(Mapping::Cross));
    for (width, height) in [(512, 512), (1024, 768), (0, 0), (1000, 501)] {
        let error = Mapping::recognise(width, height).unwrap_err();
        assert!(error.to_string().contains("--env-mapping"), "{error}");
    }
}

#[test]
fn names_round_trip_and_shapes_are_checked() {
    for mapping in Mapping::ALL {
        assert_eq!(mapping.name().parse(), Ok(mapping));
    }
    assert!("probe".parse::<Mapping>().unwrap_err().to_string().contains("probe"));
    assert!(Mapping::Angular.check_shape(512, 512).is_ok() && Mapping::Cross.check_shape(768, 1024).is_ok());
    let error = Mapping::MirrorBall.check_shape(512, 500).unwrap_err().to_string();
    assert!(error.contains("square") && error.contains("512 x 500"), "{error}");
    assert!(Mapping::Cross.check_shape(3, 3).is_err() && Mapping::LatLong.check_shape(7, 4).is_err());
}
