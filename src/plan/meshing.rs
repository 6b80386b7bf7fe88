//! This module places mesh lines: on all required coordinates, and graded towards singular points.

/// A required coordinate of a mesh line, and the object that requires it.
#[derive(Clone, Debug)]
pub struct Line {
    /// Coordinate, m.
    pub at: f64,
    /// Object that requires the line, for messages.
    pub owner: String,
    /// Whether the scene lists the line in `[mesh]`; such lines may be closer together than a cell.
    pub explicit: bool,
}

/// A coordinate towards which cells become smaller.
#[derive(Clone, Copy, Debug)]
pub struct Refinement {
    /// Coordinate, m.
    pub at: f64,
    /// Factor by which the cells there are smaller.
    pub factor: f64,
}

/// Cell sizes along an axis.
#[derive(Clone, Debug)]
pub struct Sizing {
    /// Cell size away from refinements, m.
    pub size: f64,
    /// Coordinates towards which cells become smaller.
    pub refinements: Vec<Refinement>,
    /// Size ratio of neighbouring cells in graded parts.
    pub growth: f64,
}

/// An error: two required lines are less than a cell apart.
#[derive(Debug)]
pub struct TooClose {
    /// The line with the smaller coordinate.
    pub first: Line,
    /// The line with the larger coordinate.
    pub second: Line,
    /// Cell size between them, m.
    pub size: f64,
}

impl Sizing {
    /// Cell size at a coordinate, m; sizes grow geometrically away from each refinement.
    fn at(&self, x: f64) -> f64 {
        let slope = self.growth.ln();
        self.refinements
            .iter()
            .map(|r| self.size / r.factor + slope * (x - r.at).abs())
            .fold(self.size, f64::min)
    }

    /// Coordinates among `wished` that are a cell or more from all required ones and from each other;
    /// equal ones count once. Of two that are closer, neither is taken, so that mirror images stay such.
    pub fn granted(&self, demanded: &[Line], wished: &[f64]) -> Vec<f64> {
        let low = demanded.iter().map(|l| l.at).fold(f64::INFINITY, f64::min);
        let high = demanded.iter().map(|l| l.at).fold(f64::NEG_INFINITY, f64::max);
        let same = |a: f64, b: f64| (a - b).abs() <= 1e-9 * (high - low);
        let far = |a: f64, b: f64| self.cells_between(a.min(b), a.max(b)) >= 1.0 - 1e-6;
        let mut wished: Vec<f64> =
            wished.iter().copied().filter(|&w| w > low && w < high).collect();
        wished.sort_by(f64::total_cmp);
        wished.dedup_by(|b, a| same(*a, *b));
        let free = |&w: &f64| {
            demanded.iter().all(|l| far(l.at, w)) && wished.iter().all(|&o| o == w || far(o, w))
        };
        wished.iter().copied().filter(free).collect()
    }

    /// Mesh lines along an axis, m: they include all required coordinates, and the cells in between
    /// are as large as the sizing allows.
    pub fn lines(&self, mut demanded: Vec<Line>) -> Result<Vec<f64>, TooClose> {
        demanded.sort_by(|a, b| a.at.total_cmp(&b.at));
        let span = demanded.last().map_or(0.0, |l| l.at) - demanded.first().map_or(0.0, |l| l.at);
        demanded.dedup_by(|b, a| {
            let same = b.at - a.at <= 1e-9 * span;
            a.explicit |= same && b.explicit;
            same
        });
        let mut lines = vec![demanded[0].at];
        for pair in demanded.windows(2) {
            let (a, b) = (&pair[0], &pair[1]);
            let cells = self.cells_between(a.at, b.at);
            if cells < 1.0 - 1e-6 && !a.explicit && !b.explicit {
                return Err(TooClose {
                    first: a.clone(),
                    second: b.clone(),
                    size: (b.at - a.at) / cells,
                });
            }
            let mut n = (cells - 1e-6).ceil().max(1.0) as usize;
            if self.is_gap(a.at, b.at, span) {
                n += n % 2;
            }
            self.fill(a.at, b.at, n, &mut lines);
        }
        Ok(lines)
    }

    /// Whether `a` and `b` are both refined, as the two edges of an aperture are. Such a gap gets
    /// an even number of cells, so that a line lies in its middle: in a column of cells across the
    /// axis of a symmetric jet, splitting and merging of particles is not symmetric, and the jet of
    /// the silo was deflected by 0.8 apertures at 0.6 ms.
    fn is_gap(&self, a: f64, b: f64, span: f64) -> bool {
        let refined = |x: f64| {
            self.refinements.iter().any(|r| r.factor > 1.0 && (r.at - x).abs() <= 1e-9 * span)
        };
        refined(a) && refined(b)
    }

    fn is_uniform_between(&self, a: f64, b: f64) -> bool {
        // The size is concave between refinements, so testing the ends and the refinements
        // suffices.
        self.at(a) >= self.size
            && self.at(b) >= self.size
            && !self.refinements.iter().any(|r| r.at > a && r.at < b)
    }

    /// Number of cells between two coordinates, `integral dx / size`.
    fn cells_between(&self, a: f64, b: f64) -> f64 {
        if self.is_uniform_between(a, b) {
            (b - a) / self.size
        } else {
            self.cumulative(a, b)[SAMPLES]
        }
    }

    fn cumulative(&self, a: f64, b: f64) -> Vec<f64> {
        let dx = (b - a) / SAMPLES as f64;
        let mut sum = 0.0;
        let mut out = vec![0.0];
        for k in 0..SAMPLES {
            // Midpoint rule: symmetric about the middle.
            sum += dx / self.at(a + (k as f64 + 0.5) * dx);
            out.push(sum);
        }
        out
    }

    /// Appends the upper lines of `n` cells from `a` to `b`, equally spaced in
    /// `integral dx / size`.
    fn fill(&self, a: f64, b: f64, n: usize, lines: &mut Vec<f64>) {
        if self.is_uniform_between(a, b) {
            lines.extend((1..n).map(|i| a + (b - a) * i as f64 / n as f64));
        } else {
            let sum = self.cumulative(a, b);
            for i in 1..n {
                let target = sum[SAMPLES] * i as f64 / n as f64;
                let k = sum.partition_point(|&s| s < target).clamp(1, SAMPLES);
                let t = (target - sum[k - 1]) / (sum[k] - sum[k - 1]);
                lines.push(a + (b - a) * (k as f64 - 1.0 + t) / SAMPLES as f64);
            }
        }
        lines.push(b);
    }
}

/// Number of samples of the cell size between two required lines.
const SAMPLES: usize = 4096;

#[cfg(test)]
mod tests {
    use super::*;

    fn line(at: f64) -> Line {
        Line { at, owner: format!("line at {at}"), explicit: false }
    }

    #[test]
    fn uniform_lines_divide_evenly_and_meet_demands() {
        let s = Sizing { size: 0.25, refinements: vec![], growth: 1.2 };
        let lines = s.lines(vec![line(0.0), line(1.0), line(0.5)]).unwrap();
        assert_eq!(lines, [0.0, 0.25, 0.5, 0.75, 1.0]);
    }

    #[test]
    fn graded_lines_shrink_towards_the_refinement_by_the_growth_ratio() {
        let s = Sizing {
            size: 0.25,
            refinements: vec![Refinement { at: 1.0, factor: 8.0 }],
            growth: 1.3,
        };
        let lines = s.lines(vec![line(0.0), line(1.0), line(2.0)]).unwrap();
        let h: Vec<f64> = lines.windows(2).map(|w| w[1] - w[0]).collect();
        assert!(lines.contains(&1.0));
        assert!(h.windows(2).all(|w| w[0] / w[1] < 1.35 && w[1] / w[0] < 1.35), "{h:?}");
        let smallest = h.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(smallest < 0.25 / 6.0 && smallest > 0.25 / 10.0);
        let n = lines.len();
        for i in 0..n {
            assert!((lines[i] + lines[n - 1 - i] - 2.0).abs() < 1e-12, "not symmetric");
        }
    }

    #[test]
    fn an_aperture_has_a_line_in_its_middle() {
        let lip = |at| Refinement { at, factor: 3.0 };
        for size in [0.1, 0.15, 0.2, 0.3] {
            let s = Sizing { size, refinements: vec![lip(-0.5), lip(0.5)], growth: 1.6 };
            let lines = s.lines(vec![line(-2.0), line(-0.5), line(0.5), line(2.0)]).unwrap();
            assert!(lines.iter().any(|x| x.abs() < 1e-12), "{lines:?}");
        }
    }

    #[test]
    fn lines_closer_than_a_cell_are_refused_by_name() {
        let s = Sizing { size: 0.25, refinements: vec![], growth: 1.2 };
        let e = s.lines(vec![line(0.0), line(0.1), line(1.0)]).unwrap_err();
        assert_eq!((e.first.at, e.second.at), (0.0, 0.1));
    }

    #[test]
    fn wishes_are_granted_where_there_is_room_and_to_mirror_images_alike() {
        let s = Sizing { size: 0.25, refinements: vec![], growth: 1.5 };
        let demanded = [line(-1.0), line(1.0), line(0.0)];
        // Two that are too close to each other, one too close to a line, one outside, one twice.
        let wished = [-0.6, -0.5, 0.5, 0.6, 0.1, 3.0, -0.3, 0.3, 0.3];
        assert!(s.granted(&demanded, &wished).is_empty());
        assert_eq!(s.granted(&demanded, &[-0.4, 0.4, 0.4, 0.1]), [-0.4, 0.4]);
    }
}
