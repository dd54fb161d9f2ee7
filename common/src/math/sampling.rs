//! Low-discrepancy points that are a pure function of (seed, stream, index): the first dimensions of Sobol's sequence
//! under hash-based Owen scrambling.
//!
//! Sources: Joe & Kuo 2008 (direction numbers); Burley, *Practical Hash-based Owen Scrambling* (JCGT 9(4), 2020);
//! Vegdahl's revision of the Laine-Karras hash (2021).

/// Dimensions of a point.
pub const DIMENSIONS: usize = 4;

/// A stream of scrambled Sobol points, e.g. that of one pixel.
#[derive(Debug, Clone, Copy)]
pub struct PointStream {
    shuffle: u32,
    scramble: [u32; DIMENSIONS],
}

impl PointStream {
    /// The stream of a key. Equal keys give equal points; different keys give independent randomisations.
    #[must_use]
    pub fn new(key: u64) -> Self {
        let mut state = key;
        let mut next = || {
            state = mix(state.wrapping_add(0x9E37_79B9_7F4A_7C15));
            high_word(state)
        };
        Self { shuffle: next(), scramble: [next(), next(), next(), next()] }
    }

    /// Point `index` of the stream, each coordinate in [0, 1).
    #[must_use]
    pub fn point(&self, index: u32) -> [f64; DIMENSIONS] {
        let index = nested_uniform_scramble(index, self.shuffle);
        let mut point = [0.0; DIMENSIONS];
        for (d, x) in point.iter_mut().enumerate() {
            let bits = nested_uniform_scramble(sobol(index, d), self.scramble[d]);
            *x = f64::from(bits) * (1.0 / 4_294_967_296.0);
        }
        point
    }
}

/// Combines the parts of a key (seed, stage, pixel, ...) into one 64-bit key.
#[must_use]
pub fn key(parts: &[u64]) -> u64 {
    parts.iter().fold(0x243F_6A88_85A3_08D3, |state, &part| mix(state ^ mix(part.wrapping_add(0x9E37_79B9_7F4A_7C15))))
}

/// A uniform number in [0, 1) with 53 random bits, a pure function of the key.
#[must_use]
pub fn uniform(key: u64) -> f64 {
    (mix(key) >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
}

/// The finaliser of SplitMix64 (Steele, Lea & Flood 2014).
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[allow(clippy::cast_possible_truncation, reason = "keeps the upper half on purpose")]
fn high_word(x: u64) -> u32 {
    (x >> 32) as u32
}

fn nested_uniform_scramble(x: u32, seed: u32) -> u32 {
    laine_karras(x.reverse_bits(), seed).reverse_bits()
}

fn laine_karras(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3D20_ADEA);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6C56);
    x ^= x.wrapping_mul(0x53A2_2864);
    x
}

fn sobol(mut index: u32, dimension: usize) -> u32 {
    let mut bits = 0;
    for direction in DIRECTIONS[dimension] {
        if index == 0 {
            break;
        }
        bits ^= direction * (index & 1);
        index >>= 1;
    }
    bits
}

/// Direction numbers of the first four dimensions, from the primitive polynomials and initial values of
/// new-joe-kuo-6.21201 (`d s a m_i`: `2 1 0 1`, `3 2 1 1 3`, `4 3 1 1 3 1`); dimension 1 is van der Corput's sequence.
static DIRECTIONS: [[u32; 32]; DIMENSIONS] =
    [directions(0, 0, &[]), directions(1, 0, &[1]), directions(2, 1, &[1, 3]), directions(3, 1, &[1, 3, 1])];

const fn directions(s: usize, a: u32, m: &[u32]) -> [u32; 32] {
    let mut v = [0; 32];
    let mut i = 0;
    while i < 32 {
        if s == 0 {
            v[i] = 1 << (31 - i);
        } else if i < s {
            v[i] = m[i] << (31 - i);
        } else {
            let mut x = v[i - s] ^ (v[i - s] >> s);
            let mut k = 1;
            while k < s {
                x ^= ((a >> (s - 1 - k)) & 1) * v[i - k];
                k += 1;
            }
            v[i] = x;
        }
        i += 1;
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sobol_starts_as_published() {
        let first: Vec<[u32; 4]> = (0..4).map(|i| std::array::from_fn(|d| sobol(i, d) >> 30)).collect();
        assert_eq!(first, [[0, 0, 0, 0], [2, 2, 2, 2], [1, 3, 3, 3], [3, 1, 1, 1]]);
    }

    #[test]
    fn every_aligned_block_is_stratified_in_each_dimension_and_in_the_first_two() {
        let stream = PointStream::new(key(&[7, 11]));
        for d in 0..DIMENSIONS {
            let mut seen = [false; 256];
            (0..256).for_each(|i| seen[crate::math::cell(stream.point(i)[d] * 256.0, 256)] = true);
            assert!(seen.iter().all(|&s| s), "dimension {d}");
        }
        let mut seen = [false; 256];
        for i in 0..256 {
            let p = stream.point(i);
            seen[crate::math::cell(p[0] * 16.0, 16) * 16 + crate::math::cell(p[1] * 16.0, 16)] = true;
        }
        assert!(seen.iter().all(|&s| s));
    }

    #[test]
    fn streams_are_functions_of_their_key() {
        let (a, b) = (PointStream::new(1), PointStream::new(2));
        assert_eq!(a.point(5), PointStream::new(1).point(5));
        assert_ne!(a.point(5), b.point(5));
    }

    #[test]
    fn uniform_numbers_have_the_moments_of_the_unit_interval() {
        let n = 100_000;
        let (mut mean, mut square) = (0.0, 0.0);
        for i in 0..n {
            let u = uniform(key(&[3, i]));
            mean += u;
            square += u * u;
        }
        mean /= n as f64;
        square /= n as f64;
        // Both standard errors are 9e-4; the bound is five of them.
        assert!((mean - 0.5).abs() < 5e-3 && (square - 1.0 / 3.0).abs() < 5e-3);
    }
}
