//! Statistics of the numbers in tables and sentences; `None` without numbers.

/// The mean of the finite numbers.
pub(super) fn mean(numbers: &[f64]) -> Option<f64> {
    let finite: Vec<f64> = finite(numbers);
    (!finite.is_empty()).then(|| finite.iter().sum::<f64>() / length(&finite))
}

/// The median of the finite numbers.
pub(super) fn median(numbers: &[f64]) -> Option<f64> {
    quantile(numbers, 0.5)
}

/// A quantile of the finite numbers, linear between neighbours; `q` in [0, 1].
pub(super) fn quantile(numbers: &[f64], q: f64) -> Option<f64> {
    let mut sorted = finite(numbers);
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let place = q.clamp(0.0, 1.0) * length(&sorted[..last]);
    let below = (0..=last).rev().find(|&i| length(&sorted[..i]) <= place)?;
    let above = (below + 1).min(last);
    let part = place - length(&sorted[..below]);
    Some(sorted[below] + part * (sorted[above] - sorted[below]))
}

/// The standard deviation of a sample, with n - 1; `None` for fewer than two numbers.
pub(super) fn deviation(numbers: &[f64]) -> Option<f64> {
    let finite = finite(numbers);
    let mean = mean(&finite)?;
    let squares: f64 = finite.iter().map(|x| (x - mean) * (x - mean)).sum();
    (finite.len() > 1).then(|| (squares / (length(&finite) - 1.0)).sqrt())
}

/// The lowest and the highest of the finite numbers.
pub(super) fn range(numbers: &[f64]) -> Option<(f64, f64)> {
    let finite = finite(numbers);
    let lowest = finite.iter().copied().min_by(f64::total_cmp)?;
    Some((lowest, finite.iter().copied().max_by(f64::total_cmp)?))
}

/// Spearman's rank correlation, with mean ranks for ties; `None` if a side is constant or there are fewer than three pairs.
pub(super) fn spearman(pairs: &[(f64, f64)]) -> Option<f64> {
    if pairs.len() < 3 || pairs.iter().any(|(x, y)| !x.is_finite() || !y.is_finite()) {
        return None;
    }
    let x = ranks(&pairs.iter().map(|pair| pair.0).collect::<Vec<_>>());
    let y = ranks(&pairs.iter().map(|pair| pair.1).collect::<Vec<_>>());
    let (mean_x, mean_y) = (mean(&x)?, mean(&y)?);
    let product: f64 = x.iter().zip(&y).map(|(a, b)| (a - mean_x) * (b - mean_y)).sum();
    let square = |ranks: &[f64], mean: f64| ranks.iter().map(|a| (a - mean) * (a - mean)).sum::<f64>();
    let scale = (square(&x, mean_x) * square(&y, mean_y)).sqrt();
    (scale > 0.0).then(|| product / scale)
}

fn ranks(numbers: &[f64]) -> Vec<f64> {
    let rank = |x: f64| {
        let below = numbers.iter().filter(|&&y| y < x).count();
        let equal = numbers.iter().filter(|&&y| y == x).count();
        length(&numbers[..below]) + (length(&numbers[..equal]) + 1.0) / 2.0
    };
    numbers.iter().map(|&x| rank(x)).collect()
}

fn finite(numbers: &[f64]) -> Vec<f64> {
    numbers.iter().copied().filter(|x| x.is_finite()).collect()
}

/// The length as `f64`: exact below 2^32, which no table exceeds.
fn length(numbers: &[f64]) -> f64 {
    number(numbers.len())
}

/// A count as `f64`: exact below 2^32, clamped above.
pub(super) fn number(count: usize) -> f64 {
    f64::from(u32::try_from(count).unwrap_or(u32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_of_known_numbers() {
        let numbers = [4.0, 1.0, 2.0, 3.0, f64::NAN];
        assert_eq!((mean(&numbers), median(&numbers), range(&numbers)), (Some(2.5), Some(2.5), Some((1.0, 4.0))));
        assert_eq!((quantile(&numbers, 0.25), quantile(&numbers, 1.0)), (Some(1.75), Some(4.0)));
        assert_eq!(deviation(&[1.0, 3.0]), Some(2.0_f64.sqrt()));
        assert_eq!((mean(&[]), median(&[f64::NAN]), deviation(&[1.0]), range(&[])), (None, None, None, None));
    }

    #[test]
    fn spearman_depends_on_order_and_not_on_distance() {
        let up: Vec<_> = [1.0, 2.0, 4.0, 30.0].into_iter().zip([0.1, 0.2, 0.3, 0.9]).collect();
        assert_eq!(spearman(&up), Some(1.0));
        assert_eq!(spearman(&up.iter().map(|(x, y)| (*x, -y)).collect::<Vec<_>>()), Some(-1.0));
        assert_eq!(spearman(&[(1.0, 2.0), (2.0, 2.0), (3.0, 2.0)]), None);
        assert_eq!(spearman(&up[..2]), None);
    }
}
