//! This module holds the case SolKz: a viscosity that grows exponentially (Revenaugh and Parsons
//! 1987; Duretz et al. 2011).
//!
//! The unit box has free slip, viscosity `exp(2 B y)` and force `f_y = sin(m y) cos(k x)`. With
//! `v = V(y) cos kx`, `u = -V'/k sin kx`, `p = P(y) cos kx`:
//!
//! ```text
//! V'''' + 4B V''' + (4B^2 - 2k^2) V'' - 4B k^2 V' + (k^4 + 4B^2 k^2) V = k^2 e^(-2By) sin my
//! ```
//! whose characteristic polynomial is `(r^2 + 2Br - k^2)^2 + 4B^2 k^2`, so that
//! `r = -B +- sqrt(B^2 + k^2 +- 2iBk)`; four constants follow from `V = V'' = 0` at both walls.
//! With `T = V'' + k^2 V` (the shear stress is `-eta T/k sin kx`) the pressure is
//! `P = [eta (T' + 2B T) / k - 2 eta V' k] / k`.

use super::solcx::Drive;
use super::{Case, Exact, Rates};
use crate::scene::{SceneError, SceneSource};
use nalgebra::{Complex, SMatrix, SVector};
use std::f64::consts::PI;
use std::sync::Arc;

type C = Complex<f64>;

const K: f64 = PI;

/// The solution `V`.
struct Solution {
    b: f64,
    /// Roots of the characteristic polynomial.
    roots: [C; 4],
    /// Constants of the homogeneous solutions.
    constants: [C; 4],
    /// Exponent and factor of the particular solution `Im(factor e^(exponent y))`.
    particular: (C, C),
}

impl Solution {
    fn new(b: f64, m: f64) -> Self {
        let i = C::new(0.0, 1.0);
        let root = |sign: f64, branch: f64| {
            let s = (C::from(b * b + K * K) + i * (branch * 2.0 * b * K)).sqrt();
            C::from(-b) + s * sign
        };
        let roots = [root(1.0, 1.0), root(1.0, -1.0), root(-1.0, 1.0), root(-1.0, -1.0)];
        let exponent = C::new(-2.0 * b, m);
        let q = exponent * exponent + exponent * (2.0 * b) - K * K;
        let factor = C::from(K * K) / (q * q + 4.0 * b * b * K * K);
        let mut solution =
            Solution { b, roots, constants: [C::from(0.0); 4], particular: (exponent, factor) };
        let mut a = SMatrix::<C, 4, 4>::zeros();
        let mut rhs = SVector::<C, 4>::zeros();
        for (row, (y, order)) in [(0.0, 0), (0.0, 2), (1.0, 0), (1.0, 2)].into_iter().enumerate() {
            for k in 0..4 {
                a[(row, k)] = solution.homogeneous(k, y) * roots[k].powi(order);
            }
            rhs[row] = -C::from(solution.particular(y, order));
        }
        // The matrix is regular because the four exponents differ for every nonzero b.
        let c = a.full_piv_lu().solve(&rhs).unwrap_or_else(SVector::zeros);
        solution.constants = std::array::from_fn(|k| c[k]);
        solution
    }

    /// Homogeneous solution `k`; growing ones are scaled to 1 at the upper wall, decaying ones at
    /// the lower wall.
    fn homogeneous(&self, k: usize, y: f64) -> C {
        let r = self.roots[k];
        if r.re > 0.0 { (r * (y - 1.0)).exp() } else { (r * y).exp() }
    }

    /// Derivative of the particular solution.
    fn particular(&self, y: f64, order: i32) -> f64 {
        let (exponent, factor) = self.particular;
        (factor * exponent.powi(order) * (exponent * y).exp()).im
    }

    /// `V` and its first three derivatives.
    fn derivatives(&self, y: f64) -> [f64; 4] {
        std::array::from_fn(|n| {
            let sum: C = (0..4)
                .map(|k| self.constants[k] * self.homogeneous(k, y) * self.roots[k].powi(n as i32))
                .sum();
            sum.re + self.particular(y, n as i32)
        })
    }

    fn velocity(&self, x: f64, y: f64) -> [f64; 3] {
        let [v, dv, ..] = self.derivatives(y);
        [-dv / K * (K * x).sin(), v * (K * x).cos(), 0.0]
    }

    fn pressure(&self, x: f64, y: f64) -> f64 {
        let [v, v1, v2, v3] = self.derivatives(y);
        let eta = (2.0 * self.b * y).exp();
        let (t, dt) = (v2 + K * K * v, v3 + K * K * v1);
        (eta * (dt + 2.0 * self.b * t) / (K * K) - 2.0 * eta * v1) * (K * x).cos()
    }
}

/// The case SolKz for a viscosity that grows by the factor `contrast` from bottom to top, and the
/// force `sin(n pi y) cos(pi x)`.
///
/// # Errors
/// The scene does not accept the parameters.
pub fn solkz(contrast: f64, n: u32, drive: Drive) -> Result<Case, SceneError> {
    let b = 0.5 * contrast.ln();
    let force = format!("sin({n}*pi*y) * cos(pi*x)");
    let text = format!(
        "schema = 1\nname = \"solkz\"\n[domain]\nx = [0, 1]\ny = [0, 1]\n[time]\nend = 1\n\
         [materials.fluid]\nshear_viscosity = \"exp({:?}*y)\"\n[[regions]]\n\
         material = \"fluid\"\n[body_force]\ny = \"{force}\"\n",
        2.0 * b
    );
    let solution = Arc::new(Solution::new(b, f64::from(n) * PI));
    let other = solution.clone();
    Ok(Case {
        name: "solkz".into(),
        title: "viscosity that grows smoothly by a factor of a million",
        source: "Revenaugh and Parsons 1987; Duretz et al. 2011",
        scene: SceneSource::new("solkz", text).with_sets(&drive.sets(&force, &["fluid"]))?,
        exact: Exact {
            velocity: Box::new(move |x, y| solution.velocity(x, y)),
            pressure: Box::new(move |x, y| other.pressure(x, y)),
        },
        rates: Rates { velocity: 2.9, rotation: None, pressure: Some(1.9) },
    })
}
