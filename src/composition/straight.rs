//! This module cuts a cell by a straight line, from the share and the centroid of one material.
//!
//! The line is the only one for which the material's side has the area of its particles and a
//! centroid in the same direction from the centre of the cell. The coordinates `x, y >= 0` are
//! measured from the corner of the cell towards which the material lies, with `y` along the axis to
//! which its centroid `(X, Y)` is closer. With the area `A = 4 s <= 2` and `q = X/Y <= 1`, the side
//! is
//!
//! ```text
//! q <= 1/(3 - A):  0 <= x <= 2,  0 <= y <= A/2 + m (1 - x),
//!                  m = 3 A q (1 - A/4) / (1 + sqrt(1 + 3 A q^2 (1 - A/4)))
//! otherwise:       a triangle with the legs 2A/v along x and v along y,
//!                  v = 4 A / (3 (1 - q) + sqrt(9 (1 - q)^2 + 8 A q))
//! ```
//! Both are exact: the line of a horizontal surface is horizontal, whatever the positions of the
//! particles along it.

use super::interface::fade;
use crate::space::shape::{GAUSS_4, GAUSS_6, GaussPoint, SUBPOINTS, Shape, lagrange_6};

/// Ratio of the distance of the material's centroid from the centre of the cell to that of its side
/// of the line, below which the material does not lie on one side (drops, sheets, debris), and from
/// which it certainly does.
const ONE_SIDED: [f64; 2] = [0.5, 0.75];

/// A cell cut by a straight line.
#[derive(Clone, Debug)]
pub struct StraightCut {
    /// Shares of the material at the points of [`GAUSS_6X6`](crate::space::shape::GAUSS_6X6). With
    /// them the rule integrates polynomials of degree five in each coordinate exactly over the
    /// material's side; single shares may be negative or larger than one.
    pub share: [f64; SUBPOINTS],
    /// The line `l[0] + l[1] xi + l[2] eta = 0`; the material is on the negative side.
    pub line: [f64; 3],
    /// 1 if the material certainly lies on one side of the line, 0 if it does not.
    pub trust: f64,
    /// The smaller side.
    lesser: Side,
    /// Which side is the smaller one: 1 for that of the material.
    lesser_side: usize,
    /// Whether `y` of the smaller side is the first coordinate of the cell.
    turned: bool,
    /// Signs of the reference coordinates of the smaller side's corner.
    corner: [f64; 2],
}

impl StraightCut {
    /// The cut of a cell in which a material has the given share and centroid (reference
    /// coordinates); `None` if the material does not lie on one side of a line.
    pub fn new(share: f64, centroid: [f64; 2]) -> Option<Self> {
        if share <= 0.5 {
            return Self::of_lesser(share, centroid);
        }
        let rest = 1.0 - share;
        let mut cut = Self::of_lesser(rest, centroid.map(|c| -c * share / rest))?;
        cut.share.iter_mut().for_each(|s| *s = 1.0 - *s);
        cut.line = cut.line.map(|l| -l);
        cut.lesser_side = 0;
        Some(cut)
    }

    /// Integration points of both sides, with the index of their side: 0 for the rest, 1 for the material.
    ///
    /// The rule is exact for products of the gradients of two biquadratic velocities with a linear
    /// thickness, and for their hoop rates to 1e-4. All its weights are positive: a form that is not
    /// negative at any point stays so.
    pub fn points(&self) -> impl Iterator<Item = (usize, GaussPoint)> + '_ {
        let Side { width, height: [a, b] } = self.lesser;
        let other = 1 - self.lesser_side;
        // Ranges of x, and of y at both ends of that of x.
        let parts = [
            (self.lesser_side, [0.0, width], [[0.0, a], [0.0, b]]),
            (other, [0.0, width], [[a, 2.0], [b, 2.0]]),
            (other, [width, 2.0], [[0.0, 2.0]; 2]),
        ];
        parts.into_iter().flat_map(move |(side, x, y)| {
            let points = if x[1] > x[0] { GAUSS_6.len() * GAUSS_4.len() } else { 0 };
            (0..points).map(move |k| {
                let ((s, ws), (t, wt)) = (GAUSS_6[k % 6], GAUSS_4[k / 6]);
                let between = |[from, to]: [f64; 2], t: f64| from + 0.5 * (1.0 + t) * (to - from);
                let [low, high] = [0, 1].map(|end| between([y[0][end], y[1][end]], s));
                let area = (x[1] - x[0]) * (high - low);
                let [x, y] = [between(x, s), between([low, high], t)];
                let at = if self.turned { [y, x] } else { [x, y] };
                let r = [0, 1].map(|c| self.corner[c] * (1.0 - at[c]));
                let weight = 0.25 * ws * wt * area;
                (side, GaussPoint { r, weight, shape: Shape::at(r) })
            })
        })
    }

    /// The cut for a material that fills at most half of the cell.
    fn of_lesser(share: f64, centroid: [f64; 2]) -> Option<Self> {
        let along = usize::from(centroid[0].abs() <= centroid[1].abs());
        let [x, y] = [centroid[1 - along].abs(), centroid[along].abs()];
        let found = x.hypot(y);
        if !(share > 0.0 && found > 0.0) {
            return None;
        }
        let side = Side::new(4.0 * share, x / y);
        let trust = 1.0 - fade(found / side.distance(), ONE_SIDED);
        if trust == 0.0 {
            return None;
        }
        let weights = side.weights();
        // The points lie symmetrically: a coordinate from the far corner has the same index.
        let index = |k: usize, c: f64| if c < 0.0 { k } else { 5 - k };
        let share = std::array::from_fn(|point| {
            let at = [index(point % 6, centroid[0]), index(point / 6, centroid[1])];
            weights[at[along]][at[1 - along]]
        });
        // y - height(x) with x = 1 - sign xi and y = 1 - sign eta, or the other way round.
        let slope = (side.height[1] - side.height[0]) / side.width;
        let mut line = [1.0 - side.height[0] - slope, 0.0, 0.0];
        line[1 + along] = -centroid[along].signum();
        line[2 - along] = slope * centroid[1 - along].signum();
        let corner = centroid.map(f64::signum);
        Some(StraightCut {
            share,
            line,
            trust,
            lesser: side,
            lesser_side: 1,
            turned: along == 0,
            corner,
        })
    }
}

/// The side of the material, `0 <= x <= width` and `0 <= y <= height[0] + (height[1] - height[0])
/// x/width`, in the coordinates of the module documentation.
#[derive(Clone, Copy, Debug)]
struct Side {
    width: f64,
    height: [f64; 2],
}

impl Side {
    fn new(area: f64, q: f64) -> Self {
        if q <= 1.0 / (3.0 - area) {
            let b = 3.0 * area * q * (1.0 - 0.25 * area);
            let m = b / (1.0 + (1.0 + b * q).sqrt());
            Side { width: 2.0, height: [0.5 * area + m, 0.5 * area - m] }
        } else {
            let open = 3.0 * (1.0 - q);
            let v = 4.0 * area / (open + (open * open + 8.0 * area * q).sqrt());
            Side { width: 2.0 * area / v, height: [v, 0.0] }
        }
    }

    /// Distance of the centroid from the centre of the cell.
    fn distance(&self) -> f64 {
        let [a, b] = self.height;
        let x = self.width / 3.0 * (a + 2.0 * b) / (a + b);
        let y = (a * a + a * b + b * b) / (3.0 * (a + b));
        (1.0 - x).hypot(1.0 - y)
    }

    /// Integrals over the side of the Lagrange polynomials of the points, divided by those over the
    /// cell; indices along y, then x.
    fn weights(&self) -> [[f64; 6]; 6] {
        let [a, b] = self.height;
        let mut out = [[0.0; 6]; 6];
        for (t, w) in GAUSS_6 {
            // GAUSS_6 has weights that add up to one.
            let f = 0.5 * (1.0 + t);
            let h = a + (b - a) * f;
            let at_x = lagrange_6(self.width * f - 1.0);
            let mut up_y = [0.0; 6];
            for (t, w) in GAUSS_6 {
                let at = lagrange_6(0.5 * h * (1.0 + t) - 1.0);
                up_y.iter_mut().zip(at).for_each(|(sum, l)| *sum += w * h * l);
            }
            for (row, y) in out.iter_mut().zip(up_y) {
                for (sum, x) in row.iter_mut().zip(at_x) {
                    *sum += w * self.width * x * y;
                }
            }
        }
        for (row, (_, wy)) in out.iter_mut().zip(GAUSS_6) {
            for (sum, (_, wx)) in row.iter_mut().zip(GAUSS_6) {
                *sum /= 4.0 * wx * wy;
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::shape::GAUSS_6X6;

    /// Integral of `x^i y^j` over the material's side, divided by the area of the cell.
    fn moment(cut: &StraightCut, [i, j]: [i32; 2]) -> f64 {
        GAUSS_6X6
            .iter()
            .zip(cut.share)
            .map(|(g, s)| g.weight * s * g.r[0].powi(i) * g.r[1].powi(j))
            .sum()
    }

    /// The same integral over the half plane `n.r > c`, by adaptive slices.
    fn exact(n: [f64; 2], c: f64, [i, j]: [i32; 2]) -> f64 {
        const SLICES: usize = 20_000;
        (0..SLICES)
            .map(|k| {
                let x = (2 * k + 1) as f64 / SLICES as f64 - 1.0;
                let edge = ((c - n[0] * x) / n[1]).clamp(-1.0, 1.0);
                let [from, to] = if n[1] > 0.0 { [edge, 1.0] } else { [-1.0, edge] };
                let inner = (to.powi(j + 1) - from.powi(j + 1)) / f64::from(j + 1);
                0.25 * inner * x.powi(i) * 2.0 / SLICES as f64
            })
            .sum()
    }

    #[test]
    fn a_line_is_found_again_from_the_area_and_the_centroid_of_its_side() {
        for k in 0..200 {
            let angle = 0.1 + 0.77 * f64::from(k);
            let n = [angle.cos(), angle.sin()];
            let c = 1.2 * (0.9 * f64::from(k)).sin();
            let area = exact(n, c, [0, 0]);
            if !(1e-3..1.0 - 1e-3).contains(&area) {
                continue;
            }
            let centroid = [exact(n, c, [1, 0]) / area, exact(n, c, [0, 1]) / area];
            let cut = StraightCut::new(area, centroid).unwrap();
            assert!(cut.trust == 1.0);
            for powers in [[0, 0], [1, 0], [0, 1], [2, 0], [1, 1], [4, 4], [5, 2], [3, 5]] {
                let [found, truth] = [moment(&cut, powers), exact(n, c, powers)];
                assert!((found - truth).abs() < 1e-6, "{n:?} {c} {powers:?}: {found} {truth}");
            }
            for powers in [[0, 0], [1, 0], [0, 1], [2, 1], [5, 0], [4, 1], [0, 4]] {
                let points = cut.points().filter(|(side, _)| *side == 1).map(|(_, g)| {
                    assert!(g.weight >= 0.0 && g.r.iter().all(|r| r.abs() <= 1.0));
                    g.weight * g.r[0].powi(powers[0]) * g.r[1].powi(powers[1])
                });
                let [found, truth] = [points.sum::<f64>(), exact(n, c, powers)];
                assert!((found - truth).abs() < 1e-6, "{n:?} {c} {powers:?}: {found} {truth}");
            }
            let all: f64 = cut.points().map(|(_, g)| g.weight).sum();
            assert!((all - 1.0).abs() < 1e-14);
            let [l, x, y] = cut.line;
            let length = x.hypot(y);
            let found = [-x / length - n[0], -y / length - n[1], l / length - c];
            assert!(found.iter().all(|d| d.abs() < 1e-4), "{n:?} {c}: {:?}", cut.line);
        }
    }

    #[test]
    fn a_level_surface_is_cut_level() {
        for share in [1e-3, 0.2, 0.5, 0.8, 0.999] {
            for up in [1.0, -1.0] {
                let cut = StraightCut::new(share, [0.0, up * (1.0 - share)]).unwrap();
                assert!((moment(&cut, [0, 0]) - share).abs() < 1e-14);
                for row in cut.share.chunks(6) {
                    assert!(row.iter().all(|s| (s - row[0]).abs() < 1e-11), "{row:?}");
                }
            }
        }
    }

    #[test]
    fn a_drop_in_the_middle_is_not_cut() {
        assert!(StraightCut::new(0.3, [0.1, 0.05]).is_none());
        assert!(StraightCut::new(0.7, [0.02, 0.0]).is_none());
        assert!(StraightCut::new(0.5, [0.0, 0.0]).is_none());
    }
}
