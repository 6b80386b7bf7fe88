//! Arithmetic of prices: fits, fronts and what to try next. Pure functions.

/// `C h^p`: what one knob adds to the error at a setting of size `h`, 1 for the scene's own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Power {
    pub c: f64,
    pub p: f64,
    /// The rate was seen: two differences or more decided on it.
    pub seen: bool,
    /// Differences do not lie on the curve: largest ratio to it.
    pub misfit: f64,
}

impl Power {
    pub fn at(&self, h: f64) -> f64 {
        self.c * h.powf(self.p)
    }
}

/// Slower rates are not believed: differences between neighbouring settings would be blown up to
/// errors many times as large.
const RATES: [f64; 2] = [0.8, 4.5];

/// Fits `d = C (h^p - f^p)` to differences `d` of settings of sizes `h` from that of size `f`.
/// With one difference the rate is `expected`. `None` if nothing differs.
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

/// Less than this share of an error is no gain that anyone would pay for.
const GAIN: f64 = 0.03;

/// Indices that no other index beats in both error and seconds, ascending in seconds.
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

/// Nearer points of a front say nothing about a slope.
const APART: f64 = 0.75;

/// Seconds that halving the error adds to each point `(error, seconds)` of a front, by the slope
/// `d ln seconds / d ln error` to the next one that is clearly better; the last ones take the slope
/// from the one before that is clearly worse.
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

/// What is known of a setting of a knob: error it adds, seconds relative to the scene's own.
pub type Offer = (f64, f64);

/// Most combinations looked at.
const MOST: usize = 200_000;

/// Settings, one index per knob, that the model calls a front, cheapest first.
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

/// At most `count` members of a list, spread evenly over it, both ends included.
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
    fn a_power_is_found_again() {
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
    fn the_front_has_what_nothing_beats() {
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
    fn the_model_buys_where_it_is_cheap() {
        // The second knob is nearly free: nobody should take its coarse setting to save time.
        let offers =
            vec![vec![(0.4, 0.25), (0.1, 1.0), (0.025, 4.0)], vec![(0.5, 0.99), (0.01, 1.0)]];
        let found = model_front(&offers);
        assert!(found.contains(&vec![0, 1]) && found.contains(&vec![2, 1]), "{found:?}");
        assert!(!found.contains(&vec![2, 0]) && !found.contains(&vec![1, 0]), "{found:?}");
    }

    #[test]
    fn spreads() {
        assert_eq!(spread(&[1, 2, 3, 4, 5, 6, 7], 3), [1, 4, 7]);
        assert_eq!(spread(&[1, 2], 3), [1, 2]);
    }
}
