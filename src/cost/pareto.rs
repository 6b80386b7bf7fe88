//! Pure functions on errors and times: power-law fits, Pareto fronts and promising combinations.

/// Power law `C h^p` of the error that a knob adds at size `h`; `h = 1` is the scene's own setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Power {
    /// Relative error at `h = 1`.
    pub c: f64,
    /// Convergence rate.
    pub p: f64,
    /// True if the rate was fitted to at least two differences.
    pub seen: bool,
    /// Largest ratio between a difference and the fit; 1 for a perfect fit.
    pub misfit: f64,
}

impl Power {
    /// Relative error at size `h`.
    pub fn at(&self, h: f64) -> f64 {
        self.c * h.powf(self.p)
    }
}

/// Range of rates used in fits. With slower rates, differences between neighbouring levels would be
/// extrapolated to much larger errors.
const RATES: [f64; 2] = [0.8, 4.5];

/// Fits `d = C (h^p - f^p)` to pairs `(h, d)`: differences `d` between results at size `h` and at
/// the finest size `f`. With a single difference the rate is `expected`. `None` without
/// differences.
pub fn fit(finest: f64, differences: &[(f64, f64)], expected: f64) -> Option<Power> {
    let used: Vec<(f64, f64)> =
        differences.iter().copied().filter(|&(h, d)| h > finest * 1.0001 && d > 1e-14).collect();
    if used.is_empty() {
        return None;
    }
    let with = |p: f64| {
        let logs: Vec<f64> =
            used.iter().map(|(h, d)| (d / (h.powf(p) - finest.powf(p))).ln()).collect();
        let mean = logs.iter().sum::<f64>() / logs.len() as f64;
        let misfit = logs.iter().map(|l| (l - mean).abs()).fold(0.0, f64::max);
        (Power { c: mean.exp(), p, seen: used.len() > 1, misfit: misfit.exp() }, misfit)
    };
    if used.len() == 1 {
        return Some(with(expected).0);
    }
    let count = 74;
    let tried = (0..=count)
        .map(|k| with(RATES[0] + (RATES[1] - RATES[0]) * f64::from(k) / f64::from(count)));
    tried.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(power, _)| power)
}

/// Smallest relative reduction of the error that counts as an improvement.
const GAIN: f64 = 0.03;

/// Pareto front: indices of points `(error, seconds)` that no other point beats in both, ascending
/// in seconds.
pub fn front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> =
        (0..points.len()).filter(|&i| points[i].0.is_finite() && points[i].1.is_finite()).collect();
    order.sort_by(|&a, &b| {
        points[a].1.total_cmp(&points[b].1).then(points[a].0.total_cmp(&points[b].0))
    });
    let mut best = f64::INFINITY;
    order.retain(|&i| {
        let better = points[i].0 < (1.0 - GAIN) * best;
        if better {
            best = points[i].0;
        }
        better
    });
    order
}

/// Largest ratio of two errors from which a slope is computed.
const APART: f64 = 0.75;

/// Additional seconds needed to halve the error at each point `(error, seconds)` of a front, from
/// the slope `d ln seconds / d ln error` to the next point that is clearly more accurate. The last
/// points use the slope from the previous point that is clearly less accurate.
pub fn next_halving(front: &[(f64, f64)]) -> Vec<Option<f64>> {
    let slope = |a: (f64, f64), b: (f64, f64)| {
        let s = (b.1 / a.1).ln() / (a.0 / b.0).ln();
        (s.is_finite() && s > 0.0).then_some(s)
    };
    (0..front.len())
        .map(|i| {
            let here = front[i];
            let next = front[i + 1..].iter().find(|f| f.0 <= APART * here.0);
            let before = front[..i].iter().rev().find(|f| here.0 <= APART * f.0);
            let s = match (next, before) {
                (Some(&next), _) => slope(here, next),
                (None, Some(&before)) => slope(before, here),
                (None, None) => None,
            }?;
            let more = front[i].1 * (s.exp2() - 1.0);
            more.is_finite().then_some(more)
        })
        .collect()
}

/// A level of a knob: the relative error that it adds, and its time relative to the scene's own
/// setting.
pub type Offer = (f64, f64);

/// Largest number of combinations considered.
const MOST: usize = 200_000;

/// Pareto front of the model over all combinations: one level index per knob, fastest first. Errors
/// of the knobs are added, times multiplied.
pub fn model_front(offers: &[Vec<Offer>]) -> Vec<Vec<usize>> {
    let total = offers.iter().try_fold(1usize, |n, o| n.checked_mul(o.len()));
    if total.is_none_or(|n| n > MOST || n == 0) {
        return vec![];
    }
    let mut all: Vec<(Vec<usize>, (f64, f64))> = vec![(vec![], (0.0, 1.0))];
    for knob in offers {
        all = all
            .iter()
            .flat_map(|(settings, (error, seconds))| {
                knob.iter().enumerate().map(move |(i, (e, s))| {
                    let mut settings = settings.clone();
                    settings.push(i);
                    (settings, (error + e, seconds * s))
                })
            })
            .collect();
    }
    let points: Vec<(f64, f64)> = all.iter().map(|a| a.1).collect();
    front(&points).into_iter().map(|i| all[i].0.clone()).collect()
}

/// At most `count` elements of a list, evenly spaced, both ends included.
pub fn spread<T: Clone>(list: &[T], count: usize) -> Vec<T> {
    if list.len() <= count {
        return list.to_vec();
    }
    let last = list.len() - 1;
    let mut picks: Vec<usize> = (0..count).map(|k| (k * last) / (count.max(2) - 1)).collect();
    picks.dedup();
    picks.into_iter().map(|i| list[i].clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_is_recovered() {
        let (c, p, f) = (0.03f64, 2.0f64, 0.7f64);
        let d = |h: f64| (h, c * (h.powf(p) - f.powf(p)));
        let found = fit(f, &[d(2.0), d(1.4), d(1.0), (0.7, 0.0)], 1.0).expect("differs");
        assert!((found.p - p).abs() < 0.06 && (found.c - c).abs() < 0.05 * c, "{found:?}");
        assert!(found.seen && found.misfit < 1.1);
        let one = fit(f, &[d(1.0)], 2.0).expect("differs");
        assert!(!one.seen && (one.c - c).abs() < 1e-12);
        assert_eq!(fit(f, &[(1.0, 0.0)], 1.0), None);
    }

    #[test]
    fn the_front_has_all_points_that_are_not_dominated() {
        let points =
            [(0.1, 1.0), (0.05, 2.0), (0.06, 3.0), (0.2, 0.5), (0.2, 0.6), (f64::NAN, 0.1)];
        assert_eq!(front(&points), [3, 0, 1]);
        assert!(front(&[]).is_empty());
    }

    #[test]
    fn halving_follows_the_slope() {
        // seconds ~ error^-2: half the error costs four times as much, three times more.
        let list: Vec<(f64, f64)> = [1.0, 0.5, 0.125].map(|e: f64| (e, e.powi(-2))).to_vec();
        for (more, (_, seconds)) in next_halving(&list).iter().zip(&list) {
            let more = more.expect("a slope");
            assert!((more - 3.0 * seconds).abs() < 1e-9 * seconds, "{more}");
        }
        assert_eq!(next_halving(&[(1.0, 1.0)]), [None]);
    }

    #[test]
    fn the_model_refines_where_it_is_cheap() {
        // The second knob takes almost no time, so its coarse level is never worth while.
        let offers =
            vec![vec![(0.4, 0.25), (0.1, 1.0), (0.025, 4.0)], vec![(0.5, 0.99), (0.01, 1.0)]];
        let found = model_front(&offers);
        assert!(found.contains(&vec![0, 1]) && found.contains(&vec![2, 1]), "{found:?}");
        assert!(!found.contains(&vec![2, 0]) && !found.contains(&vec![1, 0]), "{found:?}");
    }

    #[test]
    fn spread_is_even() {
        assert_eq!(spread(&[1, 2, 3, 4, 5, 6, 7], 3), [1, 4, 7]);
        assert_eq!(spread(&[1, 2], 3), [1, 2]);
    }
}
