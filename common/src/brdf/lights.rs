//! Light that falls on one surface point.

use super::Angles;

/// The effect of the spread of light around its mean direction on the half vector's angle; `n.l` is that of the mean direction.
///
/// With `u = sin^2(th)`, `th` the angle between half vector and normal, a lobe of distribution `D(u)` has the mean `D + D' du +
/// D''/2 du2` to second order in the spread. With it a quadrature needs fewer directions.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spread {
    /// Mean change of `sin^2(th)`.
    pub du: f64,
    /// Mean square change of `sin^2(th)`.
    pub du2: f64,
}

/// Lists of lights are padded to a multiple of this: as many single-precision numbers as the longest register has lanes.
pub const BLOCK: usize = 16;

/// Light that falls on one surface point from many directions, one list for each number. Lights at the end that only pad the lists have no
/// energy.
#[derive(Debug, Clone, Default)]
pub struct Lights {
    /// Radiance times solid angle, linear Rec. 709 (times any quadrature weight).
    pub energy: [Vec<f32>; 3],
    /// `n . l`; 0 for light from below the horizon.
    pub cos_i: Vec<f32>,
    /// `n . h`.
    pub cos_h: Vec<f32>,
    /// `1 - (n . h)^2`.
    pub sin2_h: Vec<f32>,
    /// `v . h`.
    pub cos_d: Vec<f32>,
    /// Mean change of `sin^2(th)`: see [`Spread`].
    pub du: Vec<f32>,
    /// Mean square change of `sin^2(th)`.
    pub du2: Vec<f32>,
}

impl Lights {
    /// Length of the lists, a multiple of [`BLOCK`].
    #[must_use]
    pub fn len(&self) -> usize {
        self.cos_i.len()
    }

    /// Whether there is no light.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.cos_i.is_empty()
    }

    /// One of them, seen from a point whose `n . v` is `cos_o`.
    #[inline(always)]
    pub(super) fn at(&self, k: usize, cos_o: f64) -> (Angles, Spread) {
        let [cos_i, cos_h, sin2_h, cos_d] =
            [self.cos_i[k], self.cos_h[k], self.sin2_h[k], self.cos_d[k]].map(f64::from);
        let spread = Spread { du: f64::from(self.du[k]), du2: f64::from(self.du2[k]) };
        (Angles { cos_i, cos_o, cos_h, sin2_h, cos_d }, spread)
    }
}

/// One direction of incoming light.
#[cfg(test)]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Incident {
    pub(crate) angles: Angles,
    pub(crate) energy: [f64; 3],
    pub(crate) spread: Spread,
}

#[cfg(test)]
impl FromIterator<Incident> for Lights {
    fn from_iter<I: IntoIterator<Item = Incident>>(incident: I) -> Self {
        let mut lights = Self::default();
        let Self { energy: [red, green, blue], cos_i, cos_h, sin2_h, cos_d, du, du2 } = &mut lights;
        let mut lists = [red, green, blue, cos_i, cos_h, sin2_h, cos_d, du, du2];
        for Incident { angles, energy: [r, g, b], spread } in incident {
            let Angles { cos_i, cos_h, sin2_h, cos_d, .. } = angles;
            let numbers = [r, g, b, cos_i, cos_h, sin2_h, cos_d, spread.du, spread.du2];
            lists.iter_mut().zip(numbers).for_each(|(list, number)| list.push(crate::math::to_f32(number)));
        }
        lists.iter_mut().for_each(|list| list.resize(list.len().next_multiple_of(BLOCK), 0.0));
        lights
    }
}
