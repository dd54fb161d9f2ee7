//! The levels of the pyramid from texels up.

use super::quadrants::{LONGEST_REGISTER, Middle, Quadrants, bilinear, load3, store};
use crate::{
    light::Environment,
    math::{
        lanes::{Double, Lanes},
        simd::dispatch,
    },
    render::moments::{Moments, NUMBERS, NodeLanes, Quad},
};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

/// The nodes of one level, in groups of those that form a cell of the next coarser level.
#[derive(Debug)]
pub(super) struct Level {
    pub(super) rows: u32,
    pub(super) columns: u32,
    pub(super) quads: Vec<Quad>,
}

impl Level {
    /// The nodes of texels.
    pub(super) fn of_texels(environment: &Environment) -> Self {
        let parts = Quadrants::new(environment, 2.0);
        let (height, width) = (environment.height(), environment.width());
        let padded = width.next_multiple_of(LONGEST_REGISTER);
        // Sine and cosine of the left and right quadrants of every texel.
        let side = |k: usize, of: fn(Middle) -> f64| -> Vec<f64> {
            (0..padded).map(|j| of(parts.column((2 * j + k) as f64))).collect()
        };
        let columns = [[side(0, |m| m.sin), side(0, |m| m.cos)], [side(1, |m| m.sin), side(1, |m| m.cos)]];
        Self::of_rows(height, width, |i| {
            let rows = [2 * i, 2 * i + 1].map(|row| parts.row(row as f64));
            // The texels of this row and of those above and below, each once more to the left and the right.
            let texels = [i, i + 1, i + 2].map(|row| {
                let texels = environment.bordered_row(row);
                std::array::from_fn(|channel| {
                    let mut list: Vec<f64> = texels.iter().map(|texel| f64::from(texel[channel])).collect();
                    list.resize(padded + 2, 0.0);
                    list
                })
            });
            let mut nodes = empty_row(width);
            dispatch(TexelRow { parts: &parts, rows, columns: &columns, texels: &texels, nodes: &mut nodes });
            nodes
        })
    }

    /// The next coarser level.
    pub(super) fn coarsened(&self) -> Self {
        let (rows, columns) = (self.rows.div_ceil(2) as usize, self.columns.div_ceil(2) as usize);
        Self::of_rows(rows, columns, |row| {
            let quads = &self.quads[row * columns..][..columns];
            let parts: [Row; 4] = std::array::from_fn(|k| {
                let mut part = empty_row(columns);
                for (column, quad) in quads.iter().enumerate() {
                    quad.numbers(k).iter().zip(&mut part).for_each(|(number, list)| list[column] = f64::from(*number));
                }
                part
            });
            // Whether the cells of odd rows and of odd columns are there; only those of the last column can be missing.
            let has_lower = 2 * row + 1 < self.rows as usize;
            let mut has_right = vec![1.0; columns.next_multiple_of(LONGEST_REGISTER)];
            if !self.columns.is_multiple_of(2) {
                has_right[columns - 1] = 0.0;
            }
            let mut nodes = empty_row(columns);
            dispatch(CoarseRow { parts: &parts, has_lower, has_right: &has_right, nodes: &mut nodes });
            nodes
        })
    }

    /// The level of these rows of nodes.
    fn of_rows(rows: usize, columns: usize, row: impl Fn(usize) -> Row + Sync) -> Self {
        let of_pair = |first: usize| {
            let mut quads = vec![Quad::default(); columns.div_ceil(2)];
            for (below, row) in (2 * first..rows.min(2 * first + 2)).map(&row).enumerate() {
                for column in 0..columns {
                    quads[column / 2].set(2 * below + column % 2, |number| row[number][column]);
                }
            }
            quads
        };
        let quads = (0..rows.div_ceil(2)).into_par_iter().flat_map_iter(of_pair).collect();
        let [rows, columns] = [rows, columns].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
        Self { rows, columns, quads }
    }
}

/// Nodes of one row of a level, one padded list for each number.
type Row = [Vec<f64>; NUMBERS];

fn empty_row(columns: usize) -> Row {
    std::array::from_fn(|_| vec![0.0; columns.next_multiple_of(LONGEST_REGISTER)])
}

/// The nodes of one row of texels.
struct TexelRow<'a> {
    parts: &'a Quadrants,
    rows: [Middle; 2],
    columns: &'a [[Vec<f64>; 2]; 2],
    texels: &'a [[Vec<f64>; 3]; 3],
    nodes: &'a mut Row,
}

impl WithSimd for TexelRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        const { assert!(LONGEST_REGISTER.is_multiple_of(S::F64_LANES), "lists are padded to whole registers") };
        let Self { parts, rows, columns, texels, nodes } = self;
        let columns = columns.each_ref().map(|side| side.each_ref().map(|list| S::as_simd_f64s(list).0));
        // From the left neighbours, the texels, the right neighbours.
        let texels: [[[&[S::f64s]; 3]; 3]; 3] = std::array::from_fn(|row| {
            std::array::from_fn(|first| texels[row].each_ref().map(|list| S::as_simd_f64s(&list[first..]).0))
        });
        let mut nodes = nodes.each_mut().map(|list| S::as_mut_simd_f64s(list).0);
        let rows = rows.map(|row| [row.sin, row.cos]);
        for j in 0..columns[0][0].len() {
            let quadrants = [
                parts.quadrant(simd, &texels, &columns, rows, [0, 0], j),
                parts.quadrant(simd, &texels, &columns, rows, [0, 1], j),
                parts.quadrant(simd, &texels, &columns, rows, [1, 0], j),
                parts.quadrant(simd, &texels, &columns, rows, [1, 1], j),
            ];
            store(&Moments::join(&quadrants, [Lanes::splat(Double(simd), 1.0); 4]).node(), &mut nodes, j);
        }
    }
}

impl Quadrants {
    /// The light of the quadrants in row `y` and column `x` of texels.
    #[inline(always)]
    fn quadrant<S: Simd>(
        &self,
        simd: S,
        texels: &[[[&[S::f64s]; 3]; 3]; 3],
        columns: &[[&[S::f64s]; 2]; 2],
        rows: [[f64; 2]; 2],
        [y, x]: [usize; 2],
        j: usize,
    ) -> Moments<Double<S>> {
        let corners = [
            load3(simd, &texels[y][x], j),
            load3(simd, &texels[y][x + 1], j),
            load3(simd, &texels[y + 1][x], j),
            load3(simd, &texels[y + 1][x + 1], j),
        ];
        const PLACES: [f64; 2] = [0.75, 0.25];
        let light = bilinear(corners, Lanes::splat(Double(simd), PLACES[x]), Lanes::splat(Double(simd), PLACES[y]));
        let row = [Lanes::splat(Double(simd), rows[y][0]), Lanes::splat(Double(simd), rows[y][1])];
        let column = [Lanes::new(Double(simd), columns[x][0][j]), Lanes::new(Double(simd), columns[x][1][j])];
        self.moments(row, column, light)
    }
}

/// The nodes of one row of a coarser level.
struct CoarseRow<'a> {
    parts: &'a [Row; 4],
    has_lower: bool,
    has_right: &'a [f64],
    nodes: &'a mut Row,
}

impl WithSimd for CoarseRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        const { assert!(LONGEST_REGISTER.is_multiple_of(S::F64_LANES), "lists are padded to whole registers") };
        let parts = self.parts.each_ref().map(|row| row.each_ref().map(|list| S::as_simd_f64s(list).0));
        let has_right = S::as_simd_f64s(self.has_right).0;
        let mut nodes = self.nodes.each_mut().map(|list| S::as_mut_simd_f64s(list).0);
        let one = Lanes::splat(Double(simd), 1.0);
        let lower = Lanes::splat(Double(simd), if self.has_lower { 1.0 } else { 0.0 });
        for (j, &right) in has_right.iter().enumerate() {
            let right = Lanes::new(Double(simd), right);
            let parts = [
                Moments::of_node(load(simd, &parts[0], j)),
                Moments::of_node(load(simd, &parts[1], j)),
                Moments::of_node(load(simd, &parts[2], j)),
                Moments::of_node(load(simd, &parts[3], j)),
            ];
            store(&Moments::join(&parts, [one, right, lower, lower * right]).node(), &mut nodes, j);
        }
    }
}

#[inline(always)]
fn load<S: Simd>(simd: S, lists: &[&[S::f64s]; NUMBERS], k: usize) -> NodeLanes<Double<S>> {
    let mut node = [Lanes::splat(Double(simd), 0.0); NUMBERS];
    for number in 0..NUMBERS {
        node[number].value = lists[number][k];
    }
    node
}
