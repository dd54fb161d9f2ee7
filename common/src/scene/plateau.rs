//! Finds where values end because the camera or a program cut them off.

/// Fewest equal values that are a plateau.
const FEWEST: usize = 8;

/// A plateau has more values than each of the next levels below it, by this factor. Around a smooth maximum that is stored in steps, levels have about
/// as many values each.
const ABOVE_OTHERS: usize = 4;

/// The levels below the largest with which it is compared.
const LEVELS: usize = 4;

/// The largest of finite values, if so many share it that they were cut off there: at any level, 1 in a float file or the largest code of another. `None`
/// too if most of the values are equal: then they may be so.
#[must_use]
pub fn plateau(values: impl Iterator<Item = f32>) -> Option<f32> {
    let mut sorted: Vec<f32> = values.filter(|x| x.is_finite()).collect();
    sorted.sort_by(|a, b| b.total_cmp(a));
    let level = *sorted.first().filter(|level| **level > 0.0)?;
    let mut counts = sorted.chunk_by(|a, b| a == b).map(<[f32]>::len);
    let at_level = counts.next()?;
    let below: usize = counts.take(LEVELS).sum();
    let stands_out = at_level >= FEWEST && at_level * LEVELS > ABOVE_OTHERS * below;
    (stands_out && 2 * at_level < sorted.len()).then_some(level)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hill(count: usize) -> impl Iterator<Item = f32> {
        (0..count * count).map(move |i| {
            let at = |k: usize| (k as f32 + 0.3) / count as f32 - 0.5;
            1.5 - 3.0 * (at(i % count).powi(2) + at(i / count).powi(2))
        })
    }

    #[test]
    fn values_that_were_cut_off_are_found_at_any_level() {
        for level in [1.2, 1.35, 1.1998] {
            assert_eq!(plateau(hill(40).map(|x| x.min(level))), Some(level));
        }
        assert_eq!(plateau(hill(40).map(|x| (x.min(1.25) * 200.0).round())), Some(250.0), "in steps");
    }

    #[test]
    fn smooth_maxima_steps_and_even_light_are_no_plateaus() {
        assert_eq!(plateau(hill(40)), None);
        assert_eq!(plateau(hill(400).map(|x| (x * 100.0).round())), None, "in steps");
        assert_eq!(plateau([0.5; 100].into_iter()), None);
        assert_eq!(plateau([0.0; 100].into_iter().chain([-1.0])), None);
        assert_eq!(plateau([f32::NAN, f32::INFINITY].into_iter()), None);
    }
}
