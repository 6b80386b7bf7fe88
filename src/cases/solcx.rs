//! This module holds the case SolCx: a jump of the viscosity along a mesh direction (Zhong 1996;
//! Duretz, May, Gerya and Tackley 2011).
//!
//! The unit box has free slip and the force `f_y = sin(m y) cos(k x)`, `m = k = pi`. The viscosity
//! is `eta_1` left of the jump and `eta_2` right of it.
//! With `u = U(x) cos(m y)`, `v = -U'(x)/m sin(m y)`,
//! `p = P(x) cos(m y)` each side has
//!
//! ```text
//! U'''' - 2 m^2 U'' + m^4 U = -(k m / eta) sin kx
//! U = (a + b x) e^(m x) + (c + d x) e^(-m x) - k m sin kx / (eta (k^2 + m^2)^2)
//! P = -(eta/m) (m U' - U'''/m) - cos(kx)/m
//! ```
//! The eight constants follow from `U = U'' = 0` at both walls, and from `U`, `U'`, the shear
//! stress and the normal stress, which are continuous at the jump.

use super::{Case, Exact, Rates};
use crate::scene::{SceneError, presets};
use nalgebra::{SMatrix, SVector};
use std::f64::consts::PI;
use std::sync::Arc;

const M: f64 = PI;
const K: f64 = PI;

/// Parameters of SolCx.
#[derive(Clone, Copy, Debug)]
pub struct SolCx {
    /// Viscosity of the right part over the viscosity of the left part.
    pub contrast: f64,
    /// Position of the jump along x.
    pub jump: f64,
}

/// `U` and its first three derivatives as linear functions of the four constants of a side: row
/// `n` holds the derivatives of order `n` of the four homogeneous solutions.
fn homogeneous(x: f64) -> [[f64; 4]; 4] {
    let (e, d) = ((M * x).exp(), (-M * x).exp());
    std::array::from_fn(|n| {
        let (order, power, sign) = (n as f64, M.powi(n as i32), (-1f64).powi(n as i32));
        // d^n/dx^n of x e^(m x) is (m^n x + n m^(n-1)) e^(m x).
        let lower = if n > 0 { order * M.powi(n as i32 - 1) } else { 0.0 };
        [
            power * e,
            (power * x + lower) * e,
            sign * power * d,
            (sign * power * x - sign * lower) * d,
        ]
    })
}

/// The particular solution and its first three derivatives.
fn particular(x: f64, eta: f64) -> [f64; 4] {
    let a = -K * M / (eta * (K * K + M * M).powi(2));
    let (s, c) = (K * x).sin_cos();
    [a * s, a * K * c, -a * K * K * s, -a * K.powi(3) * c]
}

/// The solution `U` on both sides of the jump.
struct Solution {
    jump: f64,
    viscosity: [f64; 2],
    /// Constants `a, b, c, d` of each side.
    constants: [[f64; 4]; 2],
}

impl Solution {
    fn new(c: SolCx) -> Self {
        let viscosity = [1.0, c.contrast];
        let mut a = SMatrix::<f64, 8, 8>::zeros();
        let mut b = SVector::<f64, 8>::zeros();
        // The unknowns of the second side are scaled by its viscosity, so that the rows of the
        // matrix are of similar size.
        let scale = [1.0, 1.0 / c.contrast.max(1.0)];
        let mut row = 0;
        let mut demand = |terms: &[(usize, f64, [f64; 4])]| {
            // Each term: side, position, weights of U, U', U'', U'''.
            for &(side, x, weight) in terms {
                let h = homogeneous(x);
                let p = particular(x, viscosity[side]);
                for n in 0..4 {
                    for k in 0..4 {
                        a[(row, 4 * side + k)] += weight[n] * h[n][k] * scale[side];
                    }
                    b[row] -= weight[n] * p[n];
                }
            }
            row += 1;
        };
        for (side, x) in [(0, 0.0), (1, 1.0)] {
            demand(&[(side, x, [1.0, 0.0, 0.0, 0.0])]);
            demand(&[(side, x, [0.0, 0.0, 1.0, 0.0])]);
        }
        let x = c.jump;
        demand(&[(0, x, [1.0, 0.0, 0.0, 0.0]), (1, x, [-1.0, 0.0, 0.0, 0.0])]);
        demand(&[(0, x, [0.0, 1.0, 0.0, 0.0]), (1, x, [0.0, -1.0, 0.0, 0.0])]);
        // Shear stress: -eta (m U + U''/m).
        // Normal stress: -P + 2 eta U' = eta (3 U' - U'''/m^2) + ...
        let top = viscosity[0].max(viscosity[1]);
        let [e0, e1] = viscosity.map(|v| v / top);
        demand(&[(0, x, [e0 * M, 0.0, e0 / M, 0.0]), (1, x, [-e1 * M, 0.0, -e1 / M, 0.0])]);
        demand(&[
            (0, x, [0.0, 3.0 * e0, 0.0, -e0 / (M * M)]),
            (1, x, [0.0, -3.0 * e1, 0.0, e1 / (M * M)]),
        ]);
        // The matrix is regular for every contrast and every jump inside the box.
        let s = a.full_piv_lu().solve(&b).unwrap_or_else(SVector::zeros);
        let constants = [0, 1].map(|side| std::array::from_fn(|k| s[4 * side + k] * scale[side]));
        Solution { jump: c.jump, viscosity, constants }
    }

    fn side(&self, x: f64) -> usize {
        usize::from(x > self.jump)
    }

    /// `U` and its first three derivatives.
    fn derivatives(&self, x: f64) -> [f64; 4] {
        let side = self.side(x);
        let (h, p) = (homogeneous(x), particular(x, self.viscosity[side]));
        std::array::from_fn(|n| {
            p[n] + (0..4).map(|k| h[n][k] * self.constants[side][k]).sum::<f64>()
        })
    }

    fn velocity(&self, x: f64, y: f64) -> [f64; 3] {
        let [u, du, ..] = self.derivatives(x);
        [u * (M * y).cos(), -du / M * (M * y).sin(), 0.0]
    }

    fn pressure(&self, x: f64, y: f64) -> f64 {
        let [_, u1, _, u3] = self.derivatives(x);
        let eta = self.viscosity[self.side(x)];
        (-eta / M * (M * u1 - u3 / M) - (K * x).cos() / M) * (M * y).cos()
    }
}

/// The driving force of a flow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drive {
    /// A body force fixed in space.
    BodyForce,
    /// The weight of a density that particles carry.
    Density,
}

impl Drive {
    /// Assignments that replace the body force of a scene along y by a density of `materials`.
    pub(super) fn sets(self, force: &str, materials: &[&str]) -> Vec<String> {
        if self == Drive::BodyForce {
            return vec![];
        }
        let densities = materials.iter().map(|m| format!("materials.{m}.density={force}"));
        densities.chain(["gravity[1]=1".into(), "body_force.y=0".into()]).collect()
    }
}

/// The case SolCx.
///
/// # Errors
/// The preset does not accept the parameters.
pub fn solcx(c: SolCx, drive: Drive) -> Result<Case, SceneError> {
    let mut sets = drive.sets("sin(pi*y) * cos(pi*x)", &["left", "right"]);
    sets.extend([format!("contrast={:e}", c.contrast), format!("jump={}", c.jump)]);
    let solution = Arc::new(Solution::new(c));
    let other = solution.clone();
    Ok(Case {
        name: "solcx".into(),
        title: "viscosity jump along a mesh direction",
        source: "Zhong 1996; Duretz et al. 2011",
        scene: presets::find("solcx")?.with_sets(&sets)?,
        exact: Exact {
            velocity: Box::new(move |x, y| solution.velocity(x, y)),
            pressure: Box::new(move |x, y| other.pressure(x, y)),
        },
        rates: Rates { velocity: 2.9, rotation: None, pressure: Some(1.9) },
    })
}
