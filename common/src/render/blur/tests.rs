use super::*;
use crate::{
    brdf::{self, Angles, Incident, Lights, MODELS, Spread, Tail, lobe_terms},
    image::Image,
    light::Environment,
    math::{frame::Frame, to_f32},
    render::{
        cut::{Band, Cut},
        pyramid::LightPyramid,
    },
};
use glam::DMat3;

/// A node of energy 1, see [`NodeLanes`](super::super::moments::NodeLanes).
struct Node {
    centroid: [f32; 3],
    covariance: [f32; 3],
    radius: f32,
}

/// The angles of a node's light at a surface point, and the effect of its spread on them; `None` if all of it is below the horizon.
fn seen_from(node: &Node, point: &Point) -> Option<(Angles, Spread)> {
    let (mut nodes, mut lights) = (NodeLists::default(), Lights::default());
    let lists = nodes.centroid.iter_mut().chain(&mut nodes.covariance).chain([&mut nodes.radius]);
    let numbers = node.centroid.iter().chain(&node.covariance).chain([&node.radius]);
    lists.zip(numbers).for_each(|(list, number)| {
        list.resize(BLOCK, 0.0);
        list[0] = *number;
    });
    nodes.seen_from(point, &mut lights);
    let Lights { cos_i, cos_h, sin2_h, cos_d, du, du2, .. } = lights;
    let [cos_i, cos_h, sin2_h, cos_d] = [cos_i, cos_h, sin2_h, cos_d].map(|list| f64::from(list[0]));
    let spread = Spread { du: f64::from(du[0]), du2: f64::from(du2[0]) };
    (cos_i > 0.0).then_some((Angles { cos_i, cos_o: point.cos_o, cos_h, sin2_h, cos_d }, spread))
}

/// Directions on a skew grid of `size` (chord) around a direction, all of the same energy.
fn grid(centre: Vec3, size: f64) -> Vec<Vec3> {
    const N: i32 = 24;
    let frame = Frame::from_normal(centre);
    let place = |k: i32| (f64::from(k) + 0.5) / f64::from(N) - 0.5;
    (0..N * N)
        .map(|k| {
            let (x, y) = (place(k % N), place(k / N));
            let step = frame.tangent * (x + 0.4 * y) + frame.bitangent * (0.6 * y);
            (centre + step * size).normalize()
        })
        .collect()
}

/// The node of directions of equal energy, of total energy 1.
fn node(directions: &[Vec3]) -> Node {
    let count = directions.len() as f64;
    let mean = directions.iter().sum::<Vec3>() / count;
    let centroid = mean.normalize();
    let outer = |d: Vec3| DMat3::from_cols(d * d.x, d * d.y, d * d.z);
    let spread = directions.iter().fold(DMat3::ZERO, |sum, d| sum + outer(*d - centroid) * (1.0 / count));
    let radius = directions.iter().map(|d| d.distance(centroid)).fold(0.0, f64::max);
    let frame = Frame::from_normal(centroid);
    let covariance =
        [(frame.tangent, frame.tangent), (frame.tangent, frame.bitangent), (frame.bitangent, frame.bitangent)]
            .map(|(a, b)| to_f32(a.dot(spread * b)));
    Node { centroid: crate::math::narrow(centroid), covariance, radius: to_f32(radius) }
}

fn points() -> Vec<Point> {
    let view = Vec3::Z;
    [0.95, 0.7, 0.4].map(|cos: f64| Point::new(Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos), view).unwrap()).to_vec()
}

/// The largest error over lobes, with a kink or without, of light around directions near and off the mirror direction, as a share of the lobe's value there.
fn error(size: f64, width: f64, second_order: bool, kinked: bool) -> f64 {
    let mut worst: f64 = 0.0;
    for (point, away) in points().iter().flat_map(|p| [0.0, 0.7, 1.4].map(|away| (*p, away))) {
        let mirror = point.normal * (2.0 * point.cos_o) - point.view;
        let centre =
            (mirror + Frame::from_normal(mirror).to_world(Vec3::new(away, 0.6 * away, 0.0) * width)).normalize();
        let directions = grid(centre, size * width);
        let node = node(&directions);
        let (angles, spread) = seen_from(&node, &point).unwrap();
        let spread = if second_order { spread } else { Spread::default() };
        for basis in MODELS.iter().flat_map(|model| model.lobes()).filter(|basis| basis.width.is_some()) {
            if basis.lobe.expected().is_kinked != kinked {
                continue;
            }
            let terms = lobe_terms(basis.lobe);
            let mut sums = vec![0.0; 3 * terms];
            let lights = [Incident { angles, energy: [1.0; 3], spread }].into_iter().collect();
            basis.lobe.accumulate(&lights, point.cos_o, 1.0, &[width], &mut sums);
            let found: f64 = sums.iter().step_by(3).sum();
            let exact = |d: &Vec3| basis.lobe.eval(&Angles::new(point.normal, *d, point.view), width);
            let mean = directions.iter().map(exact).sum::<f64>() / directions.len() as f64;
            worst = worst.max((found / mean - 1.0).abs());
        }
    }
    worst
}

/// The remaining error is of fourth order where only the distribution varies over the node.
#[test]
fn second_order_terms_take_most_of_the_error_of_a_sharp_lobe() {
    const WIDTH: f64 = 0.01;
    let (plain, corrected) = (error(0.3, WIDTH, false, false), error(0.3, WIDTH, true, false));
    assert!(corrected < 0.05 * plain, "{corrected:.2e} of {plain:.2e}");
    let finer = error(0.15, WIDTH, true, false);
    assert!(finer < 0.15 * corrected, "{finer:.2e} of {corrected:.2e}");
}

/// The slow factors of the lobe (Fresnel, masking-shadowing, cosine) are taken at the centroid.
#[test]
fn second_order_terms_help_a_wide_lobe_too() {
    let (plain, corrected) = (error(0.3, 0.3, false, false), error(0.3, 0.3, true, false));
    assert!(corrected < 0.5 * plain, "{corrected:.2e} of {plain:.2e}");
}

/// The error of the kink is of first order, occurs within the plane of incidence only, and is a share of the width.
#[test]
fn second_order_terms_do_not_remove_the_error_of_a_kink() {
    for width in [0.01, 0.1, 0.3] {
        let (plain, corrected) = (error(0.3, width, false, true), error(0.3, width, true, true));
        assert!(corrected < 0.05 * width + 0.5 * plain, "width {width}: {corrected:.2e} of {plain:.2e}");
    }
}

#[test]
fn light_that_the_horizon_cuts_counts_only_above_it() {
    for cos_i in [-0.05, -0.02, 0.0, 0.03, 0.049, 0.2] {
        let n = 1000;
        let spread = |k: i32| cos_i + 0.1 * ((f64::from(k) + 0.5) / f64::from(n) - 0.5);
        let mean = (0..n).map(|k| spread(k).max(0.0)).sum::<f64>() / f64::from(n);
        let [cos, variance, radius] = [cos_i, 0.01 / 12.0, 0.1].map(|x| Lanes::splat(Single(pulp::Scalar), x));
        let found = above_horizon(cos, variance, radius).value;
        assert!((f64::from(found) - mean).abs() < 1e-6, "{cos_i}: {found} {mean}");
    }
}

#[test]
fn light_on_a_line_or_opposite_to_the_view_gives_finite_numbers() {
    let point = points()[2];
    let frame = Frame::from_normal(-point.view);
    for (covariance, radius) in [([1e-4, 0.0, -1e-12], 0.03), ([-1e-12, 0.0, 1e-4], 0.03), ([0.0; 3], 0.0)] {
        for centroid in [-point.view, -point.normal, frame.tangent, frame.bitangent, point.view] {
            let node = Node { centroid: crate::math::narrow(centroid), covariance, radius };
            let Some((angles, spread)) = seen_from(&node, &point) else { continue };
            assert!([angles.cos_i, angles.cos_h, spread.du, spread.du2].iter().all(|x| x.is_finite()), "{centroid}");
        }
    }
}

/// Directional albedo of GGX with F = 1 in constant light, also at grazing view, where a step of the light turns the half vector most.
/// Expected: the integral over half vectors drawn from the distribution, 4000 x 1440 of them (midpoint rule, in NumPy).
#[test]
fn grazing_views_reflect_the_albedo_of_the_lobe() {
    const TOLERANCE: f64 = 3e-3;
    const EXPECTED: [(f64, f64, f64); 8] = [
        (0.03, 0.02, 0.90120),
        (0.03, 0.05, 0.90042),
        (0.03, 0.1, 0.95132),
        (0.03, 0.5, 0.99762),
        (0.1, 0.02, 0.95448),
        (0.1, 0.05, 0.91187),
        (0.1, 0.1, 0.88426),
        (0.1, 0.5, 0.96921),
    ];
    let map = Environment::new(Image::from_pixels(128, 64, vec![[1.0; 3]; 128 * 64])).unwrap();
    let pyramid = LightPyramid::new(map);
    let lobe = brdf::model("ggx").unwrap().lobes()[1].lobe;
    for (alpha, cos_o, expected) in EXPECTED {
        let normal = Vec3::new((1.0_f64 - cos_o * cos_o).sqrt(), 0.0, cos_o);
        let point = Point::new(normal, Vec3::Z).unwrap();
        let (mut cut, mut sums) = (Cut::new(&pyramid), [0.0; 6]);
        cut.refine(&point, 0.0, Band::Glossy(alpha, 2.0 * alpha, Tail::Short), 1e-3);
        lobe.accumulate(cut.lights(&point), cos_o, 1.0, &[alpha], &mut sums);
        let found = sums[0] + sums[3];
        assert!((found - expected).abs() < TOLERANCE, "alpha {alpha} cos_o {cos_o}: {found} {expected}");
    }
}

/// The mean of a lobe over a part of a pixel, against many positions in it: seen by parallel rays and by a pinhole close by.
#[test]
fn the_mean_over_a_turning_point_is_that_of_many_positions() {
    for position in [None, Some(Vec3::new(0.3, 0.1, 2.2))] {
        let at = |x: f64, y: f64| {
            let normal = Vec3::new(0.3 + x, -0.2 + y, (1.0_f64 - (0.3 + x) * (0.3 + x) - (y - 0.2) * (y - 0.2)).sqrt());
            let view = position.map_or(Vec3::Z, |camera: Vec3| (camera - normal).normalize());
            Point::new(normal, view).unwrap()
        };
        const SIDE: f64 = 0.04;
        let half = 0.5 * SIDE;
        let turn = |of: fn(&Point) -> Vec3| {
            [(half, 0.0), (0.0, half)].map(|(x, y)| (of(&at(x, y)) - of(&at(-x, -y))) / f64::sqrt(12.0))
        };
        let turn = Turn { normal: turn(|p| p.normal), view: turn(|p| p.view) };
        let middle = at(0.0, 0.0);
        let mirror = (middle.normal * (2.0 * middle.cos_o) - middle.view).normalize();
        for offset in [Vec3::ZERO, Vec3::new(0.05, 0.0, 0.02), Vec3::new(0.0, -0.12, 0.05)] {
            let light = node(&[(mirror + offset).normalize()]);
            let width = 0.1;
            let value = |point: &Point| {
                let (angles, spread) = seen_from(&light, point).unwrap();
                brdf::Model::lobes(&brdf::Ggx)[1].lobe.kernel(&angles, &spread, width)
            };
            let many: Vec<f64> = (0..400)
                .map(|k| value(&at(SIDE * (f64::from(k % 20) - 9.5) / 20.0, SIDE * (f64::from(k / 20) - 9.5) / 20.0)))
                .collect();
            let exact = many.iter().sum::<f64>() / 400.0;
            let (ours, without) = (value(&Point { turn, ..middle }), value(&middle));
            assert!((ours - exact).abs() < 0.15 * (without - exact).abs() + 2e-3 * exact, "{position:?} {offset}");
        }
    }
}
