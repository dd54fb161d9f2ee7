//! The kernels against those of the authors (`separableFilters(40, 3)`; half of each, from its centre).

use super::*;

/// First taps of each kernel at 40 samples per degree, to the digits published with the reference.
const EXPECTED: [&[f64]; 7] = [
    &[0.454159163042, 0.238780028034, 0.0337504949669, 0.00119686330435, 9.84730599151e-06, 1.76458208354e-08],
    &[0.0357680985194, 0.0345334700833, 0.0310794434449, 0.0260732171962, 0.0203893763323, 0.0148627977249],
    &[0.00865252041486, 0.00865221406582, 0.00865129508379, 0.00864976366396, 0.00864762013161, 0.00864486494197],
    &[0.268700476328, 0.186140705423, 0.0617098197145, 0.00971514342673, 0.000718279490027, 2.46276119021e-05],
    &[0.020895700494, 0.0208422025227, 0.0206825290123, 0.0204191202402, 0.0200559743064, 0.0195985461678],
    &[0.19447189516, 0.157780880378, 0.084241540825, 0.0295746774032, 0.00681832314741, 0.00103056539544],
    &[0.0258092428611, 0.025700748532, 0.0253779943488, 0.0248490526542, 0.0241270037771, 0.0232293984704],
];
/// Last tap (the 20th) of the kernels that are not truncated.
const LAST: [(usize, f64); 4] =
    [(1, 1.10986140997e-07), (2, 0.008542630242), (4, 0.00828222943459), (6, 0.00564064101431)];
/// Twelve digits are published; the taps are below 1.
const TOLERANCE: f64 = 1e-12;

fn kernels(filter: &Scielab<f64>) -> [Vec<f64>; 7] {
    let wide = |g: usize| filter.achromatic.wide.iter().map(|w| w[g]).collect::<Vec<_>>();
    [
        filter.achromatic.narrow.clone(),
        wide(0),
        wide(1),
        filter.red_green.narrow.clone(),
        filter.red_green.wide.iter().map(|w| w[0]).collect(),
        filter.blue_yellow.narrow.clone(),
        filter.blue_yellow.wide.iter().map(|w| w[0]).collect(),
    ]
}

#[test]
fn kernels_are_those_of_the_authors() {
    let filter = Scielab::new(40.0);
    let kernels = kernels(&filter);
    for (ours, expected) in kernels.iter().zip(EXPECTED) {
        for (a, b) in ours.iter().zip(expected) {
            assert!((a - b).abs() < TOLERANCE, "{a} {b}");
        }
    }
    assert_eq!(filter.reach(), 19);
    for (kernel, tap) in LAST {
        assert!((kernels[kernel][19] - tap).abs() < TOLERANCE);
    }
    // Truncation keeps every tap that can change a sum.
    assert_eq!([0, 3, 5].map(|k: usize| kernels[k].len()), [8, 11, 15]);
}

#[test]
fn gains_for_a_constant_are_those_of_the_authors() {
    let kernels = kernels(&Scielab::new(40.0));
    let gain = |k: usize| {
        let sum = kernels[k][0] + 2.0 * kernels[k][1..].iter().sum::<f64>();
        sum * sum
    };
    let expected = [1.0048296274401594, 0.9920003931007706, 0.9944292378568567];
    for (ours, expected) in [gain(0) + gain(1) - gain(2), gain(3) + gain(4), gain(5) + gain(6)].iter().zip(expected) {
        assert!((ours - expected).abs() < TOLERANCE, "{ours} {expected}");
    }
}

#[test]
fn a_point_becomes_the_outer_products_of_the_kernels() {
    let filter = Scielab::new(40.0);
    let (width, height) = (61, 47);
    let region = Region::whole(width, height);
    let spans = Spans::whole(&region);
    let mut opponent = Planes::new(width, height);
    opponent.fill_rows(|| (), |(), y, mut rows| rows.iter_mut().for_each(|row| row[20] = f64::from(u8::from(y == 25))));
    let mut filtered = Planes::<f64, 3>::new(width, height);
    filtered
        .fill_rows(|| filter.scratch(&region), |scratch, y, out| filter.filter_row(&opponent, y, &spans, scratch, out));
    let kernels = kernels(&filter);
    let tap = |k: usize, d: usize| kernels[k].get(d).copied().unwrap_or(0.0);
    for (x, y) in [(20, 25), (22, 24), (1, 25), (39, 44), (40, 25), (25, 5), (30, 46)] {
        let (dx, dy) = (usize::abs_diff(x, 20), usize::abs_diff(y, 25));
        // Rows are mirrored at the border: row 47 is row 46, so the point of row 25 is also at row 68.
        let mirrored = 68 - y;
        let at = |k| tap(k, dx) * (tap(k, dy) + tap(k, mirrored));
        let expected = [at(0) + at(1) - at(2), at(3) + at(4), at(5) + at(6)];
        let found = filtered.row(y).map(|row| row[x]);
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() < 1e-16, "({x}, {y}): {found:?} {expected:?}");
        }
    }
}
