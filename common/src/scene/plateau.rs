//! Finds where values end because the camera or a program cut them off.

/// Fewest equal values that are a plateau.
const FEWEST: usize = 8;

/// The levels below the largest with which it is compared.
const LEVELS: usize = 4;

/// The mean number of values at each of these levels is at most this: of values in coarse steps, such as 8-bit codes or half floats of a dull surface,
/// many share the largest without being cut off.
const MOST_BELOW: usize = 2;

/// The largest of finite values, if so many share it that they were cut off there, at any level. `None` too if most of the values are equal: then they may
/// be so.
#[must_use]
pub fn plateau(values: impl Iterator<Item = f32>) -> Option<f32> {
    // The largest levels with the number of values at each, largest first.
    let mut top: Vec<(f32, usize)> = Vec::with_capacity(LEVELS + 2);
    let mut count = 0;
    for x in values.filter(|x| x.is_finite()) {
        count += 1;
        if top.len() > LEVELS && top.last().is_some_and(|last| x < last.0) {
            continue;
        }
        match top.iter().position(|(level, _)| x >= *level) {
            Some(place) if top[place].0 == x => top[place].1 += 1,
            place => top.insert(place.unwrap_or(top.len()), (x, 1)),
        }
        top.truncate(LEVELS + 1);
    }
    let (&(level, at_level), below) = top.split_first()?;
    let below: usize = below.iter().map(|(_, count)| count).sum();
    let stands_out = level > 0.0 && at_level >= FEWEST && below <= MOST_BELOW * LEVELS;
    (stands_out && 2 * at_level < count).then_some(level)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hill(count: usize) -> impl Iterator<Item = f32> {
        (0..count * count).map(move |i| {
            let at = |k: usize| (k as f32 + 0.3) / count as f32 - 0.5;
            1.5 - 3.0 * (at(i % count).powi(2) + 1.1 * at(i / count).powi(2))
        })
    }

    #[test]
    fn values_that_were_cut_off_are_found_at_any_level() {
        for level in [1.2, 1.35, 1.1998] {
            assert_eq!(plateau(hill(40).map(|x| x.min(level))), Some(level));
        }
        // 16-bit codes.
        assert_eq!(plateau(hill(40).map(|x| (x.min(1.25) * 52427.2).round())), Some(65534.0));
    }

    #[test]
    fn smooth_maxima_steps_and_even_light_are_no_plateaus() {
        assert_eq!(plateau(hill(40)), None);
        assert_eq!(plateau(hill(400).map(|x| (x * 100.0).round())), None, "in steps");
        assert_eq!(plateau(hill(400).map(|x| (0.1 * x + 100.0).round())), None, "dull, in steps");
        assert_eq!(plateau([0.5; 100].into_iter()), None);
        assert_eq!(plateau([0.0; 100].into_iter().chain([-1.0])), None);
        assert_eq!(plateau([f32::NAN, f32::INFINITY].into_iter()), None);
    }
}
