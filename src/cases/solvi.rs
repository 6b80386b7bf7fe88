//! This module holds the case SolVi: a circular inclusion in pure shear (Schmid and Podladchikov
//! 2003; Deubelbeiss and Kaus 2008).
//!
//! With `z = x + iy`, viscosity `eta` outside and `eta_i` inside a disc of radius `r`, and strain
//! rate 1 far away:
//!
//! ```text
//! inside    u + iv = 2 eta/(eta + eta_i) conj z,   p = 0
//! outside   2 eta (u + iv) = a/z + a z/conj z^2 - a r^2/conj z^3 + 2 eta conj z,
//!           p = 2 a Re 1/z^2
//!           a = 2 eta r^2 (eta - eta_i)/(eta + eta_i)
//! ```

use super::{Case, Exact, Rates};
use crate::scene::{SceneError, presets};

/// The case SolVi for an inclusion of radius 0.2 in a unit box; `contrast`: inner over outer
/// viscosity.
///
/// # Errors
/// The preset does not accept the parameters.
pub fn solvi(contrast: f64) -> Result<Case, SceneError> {
    const RADIUS: f64 = 0.2;
    let r2 = RADIUS * RADIUS;
    let half_a = r2 * (1.0 - contrast) / (1.0 + contrast);
    let inside = 2.0 / (1.0 + contrast);
    Ok(Case {
        name: "solvi".into(),
        title: "round inclusion in pure shear",
        source: "Schmid and Podladchikov 2003",
        scene: presets::find("solvi")?
            .with_sets(&[format!("contrast={contrast:e}"), format!("radius={RADIUS}")])?,
        exact: Exact {
            velocity: Box::new(move |x, y| {
                let q = x * x + y * y;
                if q < r2 {
                    return [inside * x, -inside * y, 0.0];
                }
                // Real and imaginary parts of z^3.
                let (c, s) = (x * x * x - 3.0 * x * y * y, 3.0 * x * x * y - y * y * y);
                let far = (1.0 - r2 / q) / (q * q);
                [x + half_a * (x / q + c * far), -y + half_a * (-y / q + s * far), 0.0]
            }),
            pressure: Box::new(move |x, y| {
                let q = x * x + y * y;
                if q < r2 { 0.0 } else { 4.0 * half_a * (x * x - y * y) / (q * q) }
            }),
        },
        rates: Rates { velocity: 0.9, rotation: None, pressure: None },
    })
}
