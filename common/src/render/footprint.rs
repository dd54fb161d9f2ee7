//! The parts of a pixel whose means the tables compute.
//!
//! A photo's pixel is a mean over its area. Over a small part of it the normal turns little against the width of the sharpest lobe, so the mean
//! of a lobe follows from the middle of the part and the lobe's second derivatives (`render/blur.rs`).

use crate::math::{cell, sampling::PointStream};

/// A rectangular part of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// Middle, in \[0, 1\]^2 of the pixel.
    pub middle: [f64; 2],
    /// Sides in pixels; 0 along an axis on which the part is a position of a quadrature rule.
    pub sides: [f64; 2],
    /// Share of the mean; shares of one pixel sum to 1.
    pub share: f64,
    /// The turn of the normal along the sides, as a share of the largest that a part may have.
    pub turns: [f64; 2],
}

/// The parts of a pixel over which the normal turns by `turns_rad` from edge to edge, horizontally and vertically, for lobes no sharper
/// than `width`. An axis on which a part would turn by more than `most_rad` has two positions of a quadrature rule in place of each part.
#[must_use]
pub fn parts(turns_rad: [f64; 2], width: f64, most_rad: f64) -> Vec<Part> {
    let [columns, rows] = turns_rad.map(|turn| along(turn / (LARGEST_TURN * width), most_rad / (LARGEST_TURN * width)));
    let part = |row: &Interval, column: &Interval| Part {
        middle: [column.middle, row.middle],
        sides: [column.side, row.side],
        share: column.share * row.share,
        turns: [column.turn, row.turn],
    };
    rows.iter().flat_map(|row| columns.iter().map(move |column| part(row, column))).collect()
}

/// A part along one axis.
struct Interval {
    middle: f64,
    side: f64,
    share: f64,
    turn: f64,
}

/// The parts along an axis on which the normal turns by `turn`, in units of the largest turn of a part.
fn along(turn: f64, most: f64) -> Vec<Interval> {
    let intervals = |turn: f64| cell(turn.ceil(), MOST_PARTS + 1).max(1);
    let middles = |count: usize| (0..count).map(move |k| (k as f64 + 0.5) / count as f64);
    let count = intervals(turn);
    let (side, of_part) = (1.0 / count as f64, turn / count as f64);
    if of_part <= most {
        return middles(count).map(|middle| Interval { middle, side, share: side, turn: of_part }).collect();
    }
    let count = intervals(turn * LARGEST_TURN / LARGEST_TURN_OF_POSITIONS);
    let side = 1.0 / count as f64;
    let position = |middle: f64| Interval { middle, side: 0.0, share: 0.5 * side, turn: 0.0 };
    middles(count).flat_map(|middle| GAUSS.map(|offset| position(middle + offset * side))).collect()
}

/// The two-point Gauss-Legendre rule on \[-1/2, 1/2\], exact for cubics.
const GAUSS: [f64; 2] = [-0.288_675_134_594_812_9, 0.288_675_134_594_812_9];

/// Largest turn of the normal over a part, in widths of the lobe: the error stays below 2e-3 of its peak (see the test).
const LARGEST_TURN: f64 = 0.4;

/// The same for two positions of the quadrature rule in place of a part. Their error is `h^4 f'''' / 4320` instead of `/ 1920`, so the turn
/// may be a third larger within the same 2e-3.
const LARGEST_TURN_OF_POSITIONS: f64 = 0.53;

/// Most parts along a side of a pixel.
const MOST_PARTS: usize = 16;

/// Positions for a pixel that the silhouette cuts: the first `count` points of a low-discrepancy sequence at which `hit(x, y)` holds, so
/// that a barely covered pixel gets as many as one that is almost full. Empty if no point hits.
#[must_use]
pub fn on_object(count: usize, hit: impl Fn(f64, f64) -> bool) -> Vec<Part> {
    let stream = PointStream::new(SILHOUETTE_STREAM);
    let points = (0..SILHOUETTE_TRIES).map(|index| stream.point(index)).filter(|&[x, y, ..]| hit(x, y));
    let mut positions: Vec<Part> = points
        .take(count)
        .map(|[x, y, ..]| Part { middle: [x, y], sides: [0.0; 2], share: 1.0, turns: [0.0; 2] })
        .collect();
    let share = 1.0 / positions.len() as f64;
    positions.iter_mut().for_each(|p| p.share = share);
    positions
}

/// Points of the pixel that are tried: enough to find an object that covers a 256th of the pixel.
const SILHOUETTE_TRIES: u32 = 1024;

/// The points are the same in every pixel, so that neighbours differ smoothly.
const SILHOUETTE_STREAM: u64 = 0;

impl Part {
    /// Positions whose mean is that of the part, for a bicubic function exactly. Only the middle along an axis on which the normal hardly turns.
    #[must_use]
    pub fn positions(&self) -> Vec<[f64; 2]> {
        let [x, y]: [Vec<f64>; 2] = std::array::from_fn(|axis| {
            let (middle, side) = (self.middle[axis], self.sides[axis]);
            if self.turns[axis] < SMALL_TURN { vec![middle] } else { GAUSS.map(|x| middle + x * side).to_vec() }
        });
        y.iter().flat_map(|&y| x.iter().map(move |&x| [x, y])).collect()
    }
}

/// Turn of the normal, as a share of the largest, over which a lobe changes by less than 1e-3 of its peak.
const SMALL_TURN: f64 = 0.12;

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of a GGX peak over a pixel, for several places of the peak, by the second-order mean over each part.
    #[test]
    fn the_mean_of_a_lobe_is_within_a_five_hundredth_of_its_peak() {
        const TOLERANCE: f64 = 2e-3;
        for q in [0.05, 0.3, 0.39, 0.41, 0.52, 0.79, 0.99, 1.05, 1.4, 1.58, 1.9, 2.39] {
            let lobe = |x: f64| 1.0 / ((1.0 + x * x) * (1.0 + x * x));
            // Second derivative by the lobe's variable.
            let bend = |x: f64| (20.0 * x * x - 4.0) / (1.0 + x * x).powi(4);
            for (centre, most) in [0.0, 0.2, 0.5, 0.9].into_iter().flat_map(|centre| [(centre, 1.0), (centre, 0.0)]) {
                let ours: f64 = parts([q, 0.0], 1.0, most)
                    .iter()
                    .map(|part| {
                        let (x, side) = ((part.middle[0] - centre) * q, part.sides[0] * q);
                        part.share * (lobe(x) + bend(x) * side * side / 24.0)
                    })
                    .sum();
                let n = 20_000;
                let exact: f64 = (0..n).map(|i| lobe(q * ((f64::from(i) + 0.5) / f64::from(n) - centre))).sum();
                assert!((ours - exact / f64::from(n)).abs() < TOLERANCE, "q {q} centre {centre} most {most}");
            }
        }
    }

    #[test]
    fn parts_tile_the_pixel() {
        let cases = [
            ([0.0; 2], 1.0, 1),
            ([0.4; 2], 1.0, 1),
            ([0.41, 0.1], 1.0, 2),
            ([0.41, 1.3], 1.0, 8),
            // Positions instead of parts: along one axis, along both.
            ([0.41, 0.1], 0.15, 2),
            ([0.41, 0.2], 0.15, 4),
            ([1.2, 0.2], 0.15, 12),
        ];
        for (turns, most, count) in cases {
            let parts = parts(turns, 1.0, most);
            assert_eq!(parts.len(), count);
            assert!((parts.iter().map(|part| part.share).sum::<f64>() - 1.0).abs() < 1e-14);
            for axis in 0..2 {
                let mean = parts.iter().map(|part| part.share * part.middle[axis]).sum::<f64>();
                assert!((mean - 0.5).abs() < 1e-14);
                // The variance of a uniform distribution over the pixel.
                let variance = parts
                    .iter()
                    .map(|part| part.share * ((part.middle[axis] - 0.5).powi(2) + part.sides[axis].powi(2) / 12.0));
                assert!((variance.sum::<f64>() - 1.0 / 12.0).abs() < 1e-14, "{turns:?} {most}");
            }
        }
    }

    #[test]
    fn positions_integrate_cubics() {
        let part = Part { middle: [0.3, 0.5], sides: [0.25, 0.125], share: 1.0, turns: [1.0; 2] };
        let cubic = |x: f64| 1.0 + x * (2.0 + x * (3.0 - 4.0 * x));
        let integral = |x: f64| x + x * x + x * x * x - x * x * x * x;
        for (axis, [low, high]) in [[0.175, 0.425], [0.4375, 0.5625]].into_iter().enumerate() {
            let exact = (integral(high) - integral(low)) / (high - low);
            let ours = part.positions().iter().map(|position| cubic(position[axis])).sum::<f64>() / 4.0;
            assert!((ours - exact).abs() < 1e-14);
        }
        assert_eq!(Part { turns: [0.1; 2], ..part }.positions(), [[0.3, 0.5]]);
        assert_eq!(Part { turns: [1.0, 0.1], ..part }.positions().len(), 2);
    }
}
