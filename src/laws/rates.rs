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
//!
//! Where x is the radius of an axisymmetric flow, there are besides the hoop rate `D_tt = u/x`, which
//! is part of the trace, and the hoop curvature `w/x`. The laws use the hoop deviator `D_tt - tr(D)/3`;
//! in the plane both are zero. With them,
//!
//! ```text
//! D':D' = d.d/2 + (3/2) (D_tt - tr(D)/3)^2,   D' = D - tr(D)/3 I
//! ```

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
    /// Hoop deviator `D_tt - tr(D)/3`, 1/s; zero in the plane.
    pub hoop: f64,
    /// Hoop curvature `w/x`, 1/(m s); zero in the plane.
    pub hoop_kappa: f64,
    /// `tr(D)/3`, 1/s; zero in the plane.
    pub third: f64,
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
            + self.hoop * r.hoop
            + self.hoop_couple * r.hoop_kappa
    }

    /// The stresses `[[sigma_xx, sigma_xy], [sigma_yx, sigma_yy]]` and the hoop stress, conjugate to the
    /// velocity gradient `u_j,i` and to `u/x`.
    #[inline(always)]
    pub fn components(&self) -> ([[f64; 2]; 2], f64) {
        let [d0, d1] = self.deviator;
        let mean = self.mean - self.hoop / 3.0;
        let half = 0.5 * self.skew;
        ([[mean + d0, d1 - half], [d1 + half, mean - d0]], self.mean + self.hoop / 1.5)
    }
}

impl Rates {
    /// Rates of a classical continuum, from the velocity gradient `[[u,x, u,y], [v,x, v,y]]`.
    #[inline(always)]
    pub fn classical([[ux, uy], [vx, vy]]: [[f64; 2]; 2]) -> Self {
        Rates { d: [ux - vy, uy + vx], trace: ux + vy, ..Rates::default() }
    }

    /// Rates of a Cosserat continuum with the rotation rate `w` and its gradient `kappa`.
    #[inline(always)]
    pub fn cosserat(gradient: [[f64; 2]; 2], w: f64, kappa: [f64; 2]) -> Self {
        let [[_, uy], [vx, _]] = gradient;
        Rates { relative_spin: 0.5 * (vx - uy) - w, kappa, ..Rates::classical(gradient) }
    }

    /// The rates of a flow around the axis, with the hoop rate `u/x` and the hoop curvature `w/x` in
    /// addition.
    #[inline(always)]
    pub fn around_axis(self, hoop: f64, hoop_kappa: f64) -> Self {
        let trace = self.trace + hoop;
        let third = trace / 3.0;
        Rates { trace, hoop: hoop - third, hoop_kappa, third, ..self }
    }

    /// Hoop rate `u/x`, 1/s, of a flow around the axis.
    pub fn hoop_rate(&self) -> f64 {
        self.hoop + self.third
    }

    /// Adds `f` times other rates.
    pub fn add_scaled(&mut self, f: f64, o: &Rates) {
        for c in 0..2 {
            self.d[c] += f * o.d[c];
            self.kappa[c] += f * o.kappa[c];
        }
        self.trace += f * o.trace;
        self.relative_spin += f * o.relative_spin;
        self.hoop += f * o.hoop;
        self.hoop_kappa += f * o.hoop_kappa;
        self.third += f * o.third;
    }

    /// Square of the strain rate, `D:D`, 1/s2.
    #[inline(always)]
    pub fn strain_squared(&self) -> f64 {
        let dilation = self.trace * (self.trace - self.third);
        0.5 * (self.d[0] * self.d[0] + self.d[1] * self.d[1] + dilation)
            + 1.5 * self.hoop * self.hoop
    }
}

/// Stresses conjugate to [`Rates`]; their power is
/// `deviator.d + mean trace + skew relative_spin + couple.kappa`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stress {
    /// Deviatoric stresses `(sigma_xx - sigma_yy)/2` and `(sigma_xy + sigma_yx)/2`.
    pub deviator: [f64; 2],
    /// Viscous part of the mean stress: `(sigma_xx + sigma_yy)/2` in the plane, a third of the trace
    /// around an axis.
    pub mean: f64,
    /// Skew part `sigma_yx - sigma_xy`.
    pub skew: f64,
    /// Couple stresses `mu_x` and `mu_y`.
    pub couple: [f64; 2],
    /// Hoop stress less the mean of the stresses in the plane; zero in the plane.
    pub hoop: f64,
    /// Couple stress conjugate to the hoop curvature; zero in the plane.
    pub hoop_couple: f64,
}
