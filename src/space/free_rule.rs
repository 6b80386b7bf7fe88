//! This module makes integration rules for the parts of cells that solids leave free.
//!
//! The free part of a cell is found on a grid of 8 x 8 squares, in which the outline is straight; for
//! straight walls it is exact. Nine of its points with positive weights integrate all biquadratic
//! functions exactly: Caratheodory's theorem lets one point after the other be dropped from a fine
//! rule.

use super::outline::Point;
use super::shape::{GAUSS_3, GAUSS_3_WEIGHTS, NODES, side_point};

/// Number of squares along a cell that its outline is found with.
pub const SQUARES: usize = 8;

/// Distance, in the units of the mesh, up to which a corner of a square is on an outline.
const ON_OUTLINE: f64 = 1e-14;

/// A point of a rule with its weight.
pub type Weighted = (Point, f64);

/// Corners of the squares of a cell along one direction, in reference coordinates, from the side that
/// is farther from the middle of the domain: mirror images are treated alike.
fn grid(flipped: bool) -> [f64; SQUARES + 1] {
    std::array::from_fn(|k| {
        let t = 2.0 * k as f64 / SQUARES as f64 - 1.0;
        if flipped { -t } else { t }
    })
}

/// Two orbits of three points of a triangle, with the weight of a corner's opposite coordinates, that
/// integrate polynomials of degree 4: D. A. Dunavant, Int. J. Numer. Methods Eng. 21 (1985) 1129.
const DUNAVANT: [(f64, f64); 2] = [
    (0.445_948_490_915_964_9, 0.223_381_589_678_011_5),
    (0.091_576_213_509_770_7, 0.109_951_743_655_321_9),
];

/// A fine rule for the part of a cell in which a function is positive, which is linear in each
/// triangle; the weights are shares of the cell. `flipped`: whether to begin at the upper end of x, y.
pub fn rule(flipped: [bool; 2], distance: impl Fn(Point) -> f64) -> Vec<Weighted> {
    let [x, y] = flipped.map(grid);
    let mut out = Vec::new();
    let at: Vec<Vec<f64>> =
        x.iter().map(|&x| y.iter().map(|&y| distance([x, y])).collect()).collect();
    for i in 0..SQUARES {
        for j in 0..SQUARES {
            let corner = |a: usize, b: usize| ([x[i + a], y[j + b]], at[i + a][j + b]);
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            // The diagonal from the outer to the inner corner.
            for triangle in [[a, b, c], [a, c, d]] {
                add_triangle(&triangle, &distance, &mut out);
            }
        }
    }
    out
}

/// The same for a side of a cell (left, right, lower, upper); the weights are shares of the side.
/// Pieces with both ends within the distance `on_side` are not free.
pub fn side_rule(
    side: usize,
    on_side: Option<f64>,
    distance: impl Fn(Point) -> f64,
) -> Vec<Weighted> {
    let at = |t: f64| side_point(side, t);
    let lines = grid(false);
    let mut out = Vec::new();
    for ends in lines.windows(2) {
        let [mut low, mut high] = [ends[0], ends[1]];
        let [a, b] = [low, high].map(|t| distance(at(t)));
        if on_side.is_some_and(|most| a.abs() <= most && b.abs() <= most) {
            continue;
        }
        let root = low + (high - low) * a / (a - b);
        match (a >= 0.0, b >= 0.0) {
            (false, false) => continue,
            (false, true) => low = root,
            (true, false) => high = root,
            (true, true) => {}
        }
        for (g, w) in GAUSS_3.iter().zip(GAUSS_3_WEIGHTS) {
            let t = 0.5 * (low + high) + 0.5 * (high - low) * g;
            out.push((at(t), 0.5 * w * (high - low)));
        }
    }
    out
}

/// Adds a rule for the part of a triangle where a linear function is positive.
fn add_triangle(
    corners: &[(Point, f64); 3],
    distance: &impl Fn(Point) -> f64,
    out: &mut Vec<Weighted>,
) {
    if corners.iter().all(|(_, d)| d.abs() <= ON_OUTLINE) {
        // The triangle fills a corner of the outline, on one side or the other.
        let middle = [0, 1].map(|c| corners.iter().map(|(p, _)| p[c] / 3.0).sum());
        if distance(middle) < 0.0 {
            return;
        }
    }
    let mut free: Vec<Point> = Vec::with_capacity(4);
    for k in 0..3 {
        let ((p, dp), (q, dq)) = (corners[k], corners[(k + 1) % 3]);
        if dp >= 0.0 {
            free.push(p);
        }
        if (dp >= 0.0) != (dq >= 0.0) {
            let t = dp / (dp - dq);
            free.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
        }
    }
    for k in 1..free.len().saturating_sub(1) {
        let [a, b, c] = [free[0], free[k], free[k + 1]];
        let twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if twice == 0.0 {
            continue;
        }
        for (near, weight) in DUNAVANT {
            for [p, q, r] in [[a, b, c], [b, c, a], [c, a, b]] {
                let at = |i: usize| (1.0 - 2.0 * near) * p[i] + near * (q[i] + r[i]);
                // The reference cell has the area 4.
                out.push(([at(0), at(1)], weight * twice.abs() / 8.0));
            }
        }
    }
}

/// Nine points of a rule, or fewer, with weights that integrate the biquadratic functions as the
/// whole rule does.
pub fn reduced(rule: Vec<Weighted>) -> Vec<Weighted> {
    let total: f64 = rule.iter().map(|(_, w)| w).sum();
    let centre = [0, 1].map(|c| rule.iter().map(|(r, w)| w * r[c]).sum::<f64>() / total);
    let spread = [0, 1].map(|c| {
        let square: f64 = rule.iter().map(|(r, w)| w * (r[c] - centre[c]).powi(2)).sum();
        (square / total).sqrt().max(f64::MIN_POSITIVE)
    });
    let moments = |r: &Point| -> [f64; NODES] {
        let [x, y] = [0, 1].map(|c| (r[c] - centre[c]) / spread[c]);
        std::array::from_fn(|k| x.powi((k % 3) as i32) * y.powi((k / 3) as i32))
    };
    let mut kept: Vec<Weighted> = Vec::with_capacity(NODES + 1);
    for point in rule {
        kept.push(point);
        if kept.len() <= NODES {
            continue;
        }
        let columns: [[f64; NODES]; NODES + 1] = std::array::from_fn(|k| moments(&kept[k].0));
        let along = null_vector(&columns);
        // The largest step along which all weights stay positive removes one point.
        let step = |k: usize| kept[k].1 / along[k];
        let gone = (0..kept.len())
            .filter(|&k| along[k] > 0.0)
            .min_by(|&a, &b| step(a).total_cmp(&step(b)));
        let Some(gone) = gone else { continue };
        let length = step(gone);
        for (point, along) in kept.iter_mut().zip(along) {
            point.1 = (point.1 - length * along).max(0.0);
        }
        kept.remove(gone);
    }
    kept
}

/// A vector that a matrix of nine rows, given by its ten columns, maps to zero; its largest entry is
/// one. Gaussian elimination with complete pivoting.
fn null_vector(columns: &[[f64; NODES]; NODES + 1]) -> [f64; NODES + 1] {
    let mut a = *columns;
    let mut order: [usize; NODES + 1] = std::array::from_fn(|k| k);
    let mut rank = 0;
    while rank < NODES {
        let mut best = (0.0, rank, rank);
        for k in rank..=NODES {
            for row in rank..NODES {
                let size = a[order[k]][row].abs();
                if size > best.0 {
                    best = (size, k, row);
                }
            }
        }
        let (size, k, row) = best;
        if size <= 1e-13 {
            break;
        }
        order.swap(rank, k);
        a.iter_mut().for_each(|column| column.swap(rank, row));
        for row in rank + 1..NODES {
            let factor = a[order[rank]][row] / a[order[rank]][rank];
            for &k in &order[rank..] {
                a[k][row] -= factor * a[k][rank];
            }
        }
        rank += 1;
    }
    let mut out = [0.0; NODES + 1];
    out[order[rank]] = 1.0;
    for row in (0..rank).rev() {
        let sum: f64 = order[row + 1..=rank].iter().map(|&k| a[k][row] * out[k]).sum();
        out[order[row]] = -sum / a[order[row]][row];
    }
    let largest = out.iter().fold(0.0, |a: f64, &b| if b.abs() > a.abs() { b } else { a });
    out.map(|v| v / largest)
}
