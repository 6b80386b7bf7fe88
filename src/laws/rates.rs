//! This module defines the deformation rates at a point, equations (1)-(6), and the stresses
//! conjugate to them.
//!
//! ```text
//! gamma_xx = u,x   gamma_yy = v,y   gamma_xy = u,y + w   gamma_yx = v,x - w
//! kappa_x = w,x    kappa_y = w,y
//! ```
//! The laws use these combinations: the deviatoric rates
//! `d = (D_xx - D_yy, 2 D_xy)`, the trace, the relative spin `o - w` with `o = (v,x - u,y)/2`, and
//! the curvature rates `kappa`. Units: 1/s, and 1/(m s) for `kappa`.

/// Deformation rates at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rates {
    /// Deviatoric rates `D_xx - D_yy` and `2 D_xy`, 1/s.
    pub d: [f64; 2],
    /// Trace `tr D`, 1/s.
    pub trace: f64,
    /// Spin of the continuum minus rotation rate, `(v,x - u,y)/2 - w`, 1/s.
    pub relative_spin: f64,
    /// Curvature rates `grad w`, 1/(m s).
    pub kappa: [f64; 2],
}

impl Stress {
    /// Power of the stress with the rates `r`.
    pub fn power(&self, r: &Rates) -> f64 {
        self.deviator[0] * r.d[0]
            + self.deviator[1] * r.d[1]
            + self.mean * r.trace
            + self.skew * r.relative_spin
            + self.couple[0] * r.kappa[0]
            + self.couple[1] * r.kappa[1]
    }
}

impl Rates {
    /// Rates of a classical continuum, from the velocity gradient `[[u,x, u,y], [v,x, v,y]]`.
    #[inline(always)]
    pub fn classical([[ux, uy], [vx, vy]]: [[f64; 2]; 2]) -> Self {
        Rates { d: [ux - vy, uy + vx], trace: ux + vy, relative_spin: 0.0, kappa: [0.0; 2] }
    }

    /// Rates of a Cosserat continuum with the rotation rate `w` and its gradient `kappa`.
    #[inline(always)]
    pub fn cosserat(gradient: [[f64; 2]; 2], w: f64, kappa: [f64; 2]) -> Self {
        let [[_, uy], [vx, _]] = gradient;
        Rates { relative_spin: 0.5 * (vx - uy) - w, kappa, ..Rates::classical(gradient) }
    }

    /// Adds `f` times other rates.
    pub fn add_scaled(&mut self, f: f64, o: &Rates) {
        for c in 0..2 {
            self.d[c] += f * o.d[c];
            self.kappa[c] += f * o.kappa[c];
        }
        self.trace += f * o.trace;
        self.relative_spin += f * o.relative_spin;
    }

    /// Square of the strain rate, `D:D`, 1/s2.
    #[inline(always)]
    pub fn strain_squared(&self) -> f64 {
        0.5 * (self.d[0] * self.d[0] + self.d[1] * self.d[1] + self.trace * self.trace)
    }
}

/// Stresses conjugate to [`Rates`]; their power is
/// `deviator.d + mean trace + skew relative_spin + couple.kappa`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stress {
    /// Deviatoric stresses `(sigma_xx - sigma_yy)/2` and `(sigma_xy + sigma_yx)/2`.
    pub deviator: [f64; 2],
    /// Viscous part of the mean stress `(sigma_xx + sigma_yy)/2`.
    pub mean: f64,
    /// Skew part `sigma_yx - sigma_xy`.
    pub skew: f64,
    /// Couple stresses `mu_x` and `mu_y`.
    pub couple: [f64; 2],
}
