//! This module defines the biquadratic (Q2) shape functions on the reference cell `[-1, 1]^2` and
//! its Gauss points.
//!
//! Node `a` is in column `a % 3` and row `a / 3`; node 4 is the centre. The pressure basis of a
//! cell is `1, xi, eta` (discontinuous linear, P1disc), orthogonal on a rectangle:
//! `integral q_i q_j = area diag(1, 1/3, 1/3)`.

use std::sync::LazyLock;

/// Number of nodes of the element.
pub const NODES: usize = 9;
/// Local nodes on the left, right, lower and upper side of a cell, ascending along the side.
pub const SIDE_NODES: [[usize; 3]; 4] = [[0, 3, 6], [2, 5, 8], [0, 1, 2], [6, 7, 8]];
/// Index of the node at the centre, which no other cell shares.
pub const CENTRE: usize = 4;

/// Direction of the normal of a side: 0 for x, 1 for y.
pub fn side_normal(side: usize) -> usize {
    side / 2
}

/// Reference coordinate of a side along its normal, which is also the sign of the normal that points out of
/// the cell.
pub fn side_end(side: usize) -> f64 {
    if side.is_multiple_of(2) { -1.0 } else { 1.0 }
}

/// Reference coordinates of the point of a side with the coordinate `t` along it.
pub fn side_point(side: usize, t: f64) -> [f64; 2] {
    let end = side_end(side);
    if side_normal(side) == 0 { [end, t] } else { [t, end] }
}

/// Quadratic Lagrange functions at -1, 0, 1 and their derivatives.
const fn quadratic(t: f64) -> ([f64; 3], [f64; 3]) {
    ([0.5 * t * (t - 1.0), 1.0 - t * t, 0.5 * t * (t + 1.0)], [t - 0.5, -2.0 * t, t + 0.5])
}

/// Values and reference derivatives of the nine shape functions at a point.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// Values.
    pub n: [f64; NODES],
    /// Derivatives along xi.
    pub d_xi: [f64; NODES],
    /// Derivatives along eta.
    pub d_eta: [f64; NODES],
}

impl Shape {
    /// Shape functions at a point (reference coordinates).
    pub fn at(r: [f64; 2]) -> Self {
        let (fx, dx) = quadratic(r[0]);
        let (fy, dy) = quadratic(r[1]);
        let mut s = Shape { n: [0.0; NODES], d_xi: [0.0; NODES], d_eta: [0.0; NODES] };
        for b in 0..3 {
            for a in 0..3 {
                let k = 3 * b + a;
                s.n[k] = fx[a] * fy[b];
                s.d_xi[k] = dx[a] * fy[b];
                s.d_eta[k] = fx[a] * dy[b];
            }
        }
        s
    }

    /// Values of the three quadratic functions of one direction at the reference coordinate `t`.
    pub fn line(t: f64) -> [f64; 3] {
        quadratic(t).0
    }

    /// Values of the nine shape functions at a point, for interpolation.
    pub fn values(r: [f64; 2]) -> [f64; NODES] {
        let (fx, _) = quadratic(r[0]);
        let (fy, _) = quadratic(r[1]);
        std::array::from_fn(|k| fx[k % 3] * fy[k / 3])
    }
}

/// A Gauss point of the reference cell.
#[derive(Clone, Copy, Debug)]
pub struct GaussPoint {
    /// Reference coordinates.
    pub r: [f64; 2],
    /// Weight; the weights of a rule add up to 1 and are multiplied by the area of the cell.
    pub weight: f64,
    /// Shape functions at the point.
    pub shape: Shape,
}

/// Abscissae of the three-point rule.
pub const GAUSS_3: [f64; 3] = [-0.774_596_669_241_483_4, 0.0, 0.774_596_669_241_483_4];
/// Weights of the three-point rule.
pub const GAUSS_3_WEIGHTS: [f64; 3] = [5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0];

/// Points of the 3 x 3 Gauss rule, exact to degree five in each direction, row by row from below.
pub static GAUSS_3X3: LazyLock<[GaussPoint; 9]> = LazyLock::new(|| {
    std::array::from_fn(|g| {
        let r = [GAUSS_3[g % 3], GAUSS_3[g / 3]];
        let weight = GAUSS_3_WEIGHTS[g % 3] * GAUSS_3_WEIGHTS[g / 3];
        GaussPoint { r, weight, shape: Shape::at(r) }
    })
});

/// Number of points of [`GAUSS_6X6`].
pub const SUBPOINTS: usize = 36;

/// Four-point Gauss rule `(abscissa, weight)` on `[-1, 1]` with weights that add up to 1, ascending.
pub const GAUSS_4: [(f64, f64); 4] = {
    const A: [f64; 2] = [0.339_981_043_584_856_3, 0.861_136_311_594_052_6];
    const W: [f64; 2] = [0.326_072_577_431_273_1, 0.173_927_422_568_726_9];
    [(-A[1], W[1]), (-A[0], W[0]), (A[0], W[0]), (A[1], W[1])]
};

/// Six-point Gauss rule `(abscissa, weight)` on `[-1, 1]` with weights that add up to 1, ascending.
pub const GAUSS_6: [(f64, f64); 6] = {
    const A: [f64; 3] = [0.238_619_186_083_196_9, 0.661_209_386_466_264_5, 0.932_469_514_203_152];
    const W: [f64; 3] = [0.233_956_967_286_345_5, 0.180_380_786_524_069_3, 0.085_662_246_189_585_2];
    [(-A[2], W[2]), (-A[1], W[1]), (-A[0], W[0]), (A[0], W[0]), (A[1], W[1]), (A[2], W[2])]
};

/// The six Lagrange polynomials of the points of [`GAUSS_6`] at `t`.
pub fn lagrange_6(t: f64) -> [f64; 6] {
    std::array::from_fn(|i| {
        let others = (0..6).filter(|&k| k != i);
        others.map(|k| (t - GAUSS_6[k].0) / (GAUSS_6[i].0 - GAUSS_6[k].0)).product()
    })
}

/// Points of the 6 x 6 Gauss rule, used for cells that contain an interface.
pub static GAUSS_6X6: LazyLock<[GaussPoint; SUBPOINTS]> = LazyLock::new(|| {
    std::array::from_fn(|g| {
        let ((x, wx), (y, wy)) = (GAUSS_6[g % 6], GAUSS_6[g / 6]);
        GaussPoint { r: [x, y], weight: wx * wy, shape: Shape::at([x, y]) }
    })
});

/// Values or derivatives of the nine shape functions at the nine points of [`GAUSS_3X3`],
/// `[point][node]`.
pub type Table = [[f64; NODES]; 9];

/// Table of products of the factors `x` and `y` of the two directions, `[Gauss abscissa][node]`.
const fn product(x: &[[f64; 3]; 3], y: &[[f64; 3]; 3]) -> Table {
    let mut t = [[0.0; NODES]; 9];
    let mut k = 0;
    while k < 81 {
        let (g, a) = (k / 9, k % 9);
        t[g][a] = x[g % 3][a % 3] * y[g / 3][a / 3];
        k += 1;
    }
    t
}

const AT_GAUSS: [([f64; 3], [f64; 3]); 3] =
    [quadratic(GAUSS_3[0]), quadratic(GAUSS_3[1]), quadratic(GAUSS_3[2])];
/// The quadratic functions of one direction at the three points of [`GAUSS_3`], `[point][node]`.
pub const VALUES_AT_GAUSS: [[f64; 3]; 3] = [AT_GAUSS[0].0, AT_GAUSS[1].0, AT_GAUSS[2].0];
/// Derivatives of the quadratic functions of one direction at the points of [`GAUSS_3`],
/// `[point][node]`.
pub const SLOPES_AT_GAUSS: [[f64; 3]; 3] = [AT_GAUSS[0].1, AT_GAUSS[1].1, AT_GAUSS[2].1];
/// Derivatives along xi at the Gauss points.
pub static D_XI_AT_GAUSS: Table = product(&SLOPES_AT_GAUSS, &VALUES_AT_GAUSS);
/// Derivatives along eta at the Gauss points.
pub static D_ETA_AT_GAUSS: Table = product(&VALUES_AT_GAUSS, &SLOPES_AT_GAUSS);

/// Five-point Gauss rule `(abscissa, weight)` on `[-1, 1]` with weights that add up to 1, for loads
/// and error norms, for which the error of the 3 x 3 rule would dominate.
pub const GAUSS_5: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.118_463_442_528_094_55),
    (-0.538_469_310_105_683, 0.239_314_335_249_683_23),
    (0.0, 0.284_444_444_444_444_43),
    (0.538_469_310_105_683, 0.239_314_335_249_683_23),
    (0.906_179_845_938_664, 0.118_463_442_528_094_55),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shape_functions_reproduce_quadratics_and_their_gradients() {
        let f = |x: f64, y: f64| 1.0 + 2.0 * x - y + 3.0 * x * x * y - x * y * y + x * x * y * y;
        let fx = |x: f64, y: f64| 2.0 + 6.0 * x * y - y * y + 2.0 * x * y * y;
        let r = [0.37, -0.81];
        let s = Shape::at(r);
        let nodal: [f64; 9] =
            std::array::from_fn(|k| f((k % 3) as f64 - 1.0, (k / 3) as f64 - 1.0));
        let value: f64 = (0..9).map(|k| s.n[k] * nodal[k]).sum();
        let slope: f64 = (0..9).map(|k| s.d_xi[k] * nodal[k]).sum();
        assert!((value - f(r[0], r[1])).abs() < 1e-14);
        assert!((slope - fx(r[0], r[1])).abs() < 1e-14);
    }

    #[test]
    fn tables_hold_the_shape_functions_at_the_gauss_points() {
        for (p, g) in GAUSS_3X3.iter().enumerate() {
            assert_eq!(D_XI_AT_GAUSS[p], g.shape.d_xi);
            assert_eq!(D_ETA_AT_GAUSS[p], g.shape.d_eta);
        }
    }

    #[test]
    fn gauss_rules_are_exact_to_their_degree() {
        for degree in 0..=9 {
            let exact = if degree % 2 == 0 { 1.0 / (degree as f64 + 1.0) } else { 0.0 };
            let five: f64 = GAUSS_5.iter().map(|(x, w)| w * x.powi(degree)).sum();
            assert!((five - exact).abs() < 1e-14, "degree {degree}");
            if degree <= 5 {
                let three: f64 = GAUSS_3X3.iter().map(|g| g.weight * g.r[0].powi(degree)).sum();
                assert!((three - exact).abs() < 1e-14, "degree {degree}");
            }
            let six: f64 = GAUSS_6X6.iter().map(|g| g.weight * g.r[0].powi(degree)).sum();
            assert!((six - exact).abs() < 1e-14, "degree {degree}");
        }
    }
}
