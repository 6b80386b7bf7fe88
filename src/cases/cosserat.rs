//! This module holds cases with exact solutions of the Cosserat equations.

use super::{Case, Exact, Rates};
use crate::scene::SceneSource;
use std::f64::consts::PI;

/// Viscosities and internal length of a Cosserat fluid.
#[derive(Clone, Copy, Debug)]
pub struct Fluid {
    /// Shear viscosity eta, Pa s.
    pub shear: f64,
    /// Coupling viscosity eta_c, Pa s.
    pub coupling: f64,
    /// Internal length R, m.
    pub internal_length: f64,
}

impl Fluid {
    /// `k^2 = 4 eta eta_c / (M (eta + eta_c))`, the inverse thickness of boundary layers.
    pub(super) fn k(&self) -> f64 {
        let m = 2.0 * self.coupling * self.internal_length.powi(2);
        (4.0 * self.shear * self.coupling / (m * (self.shear + self.coupling))).sqrt()
    }

    pub(super) fn toml(&self) -> String {
        format!(
            "[materials.fluid]\nshear_viscosity = {:?}\ncoupling_viscosity = {:?}\n\
             internal_length = {:?}\n[[regions]]\nmaterial = \"fluid\"\n",
            self.shear, self.coupling, self.internal_length
        )
    }
}

const LAYER: &str = "schema = 1\nname = \"case\"\n[domain]\nx = [0, 0.25]\ny = [-0.5, 0.5]\n\
                     length_scale = 1\n[time]\nend = 1\n";

/// Plane Couette flow with shear stress `tau` between walls at y = +-1/2 that prevent rotation:
///
/// ```text
/// w = -(tau/2 eta) (1 - cosh ky / cosh kh)
/// u = (tau/eta) [y - eta_c sinh ky / ((eta + eta_c) k cosh kh)]
/// ```
pub fn couette(fluid: Fluid, tau: f64) -> Case {
    let (h, k) = (0.5, fluid.k());
    let (eta, eta_c) = (fluid.shear, fluid.coupling);
    Case {
        name: "couette".into(),
        title: "plane Couette flow of a Cosserat fluid",
        source: "closed form, theory of Dufour, Muehlhaus and Moresi",
        scene: SceneSource::new(
            "couette",
            format!(
                "{LAYER}{}[boundaries]\nleft.kind = \"periodic\"\nright.kind = \"periodic\"\n\
             bottom = {{ traction_x = {:?}, rotation = 0 }}\n\
             top = {{ traction_x = {tau:?}, rotation = 0 }}\n",
                fluid.toml(),
                -tau
            ),
        ),
        exact: Exact {
            velocity: Box::new(move |_, y| {
                let u =
                    tau / eta * (y - eta_c * (k * y).sinh() / ((eta + eta_c) * k * (k * h).cosh()));
                [u, 0.0, -tau / (2.0 * eta) * (1.0 - (k * y).cosh() / (k * h).cosh())]
            }),
            pressure: Box::new(|_, _| 0.0),
        },
        rates: Rates { velocity: 2.9, rotation: Some(2.9), pressure: None },
    }
}

/// Plane Poiseuille flow with the pressure gradient `g` (`G` below) between walls at y = +-1/2
/// without slip or rotation:
///
/// ```text
/// w = (G/2 eta) (y - h sinh ky / sinh kh)
/// u = (G/2 eta) (h^2 - y^2) - [G eta_c h / (eta (eta + eta_c) k)] (cosh kh - cosh ky)/sinh kh
/// ```
pub fn poiseuille(fluid: Fluid, g: f64) -> Case {
    let (h, k) = (0.5, fluid.k());
    let (eta, eta_c) = (fluid.shear, fluid.coupling);
    Case {
        name: "poiseuille".into(),
        title: "plane Poiseuille flow of a Cosserat fluid",
        source: "closed form, theory of Dufour, Muehlhaus and Moresi",
        scene: SceneSource::new(
            "poiseuille",
            format!(
                "{LAYER}{}[body_force]\nx = {g:?}\n[boundaries]\nleft.kind = \"periodic\"\n\
             right.kind = \"periodic\"\nbottom = {{ kind = \"no_slip\", rotation = 0 }}\n\
             top = {{ kind = \"no_slip\", rotation = 0 }}\n",
                fluid.toml()
            ),
        ),
        exact: Exact {
            velocity: Box::new(move |_, y| {
                let lag = g * eta_c * h / (eta * (eta + eta_c) * k);
                let u = g / (2.0 * eta) * (h * h - y * y)
                    - lag * ((k * h).cosh() - (k * y).cosh()) / (k * h).sinh();
                [u, 0.0, g / (2.0 * eta) * (y - h * (k * y).sinh() / (k * h).sinh())]
            }),
            pressure: Box::new(|_, _| 0.0),
        },
        rates: Rates { velocity: 2.9, rotation: Some(2.9), pressure: None },
    }
}

/// Cellular flow in the unit box with the streamfunction `psi = sin kx x sin ky y`, free slip and
/// w = 0 on the walls, `kx = m pi`, `ky = n pi`:
///
/// ```text
/// u = psi,y   v = -psi,x   w = beta K^2 psi / 2   beta = 2/(2 + R^2 K^2)   K^2 = kx^2 + ky^2
/// f = K^2 [eta + eta_c R^2 K^2 / (2 + R^2 K^2)] (u, v) + grad p
/// ```
/// The added pressure `p = P cos kx x cos ky y` is of the size of the viscous stress, so that its
/// relative error is defined.
pub fn coupled_cell(fluid: Fluid, m: u32, n: u32) -> Case {
    let (kx, ky) = (f64::from(m) * PI, f64::from(n) * PI);
    let k2 = kx * kx + ky * ky;
    let r2k2 = fluid.internal_length.powi(2) * k2;
    let beta = 2.0 / (2.0 + r2k2);
    let drag = k2 * (fluid.shear + fluid.coupling * r2k2 / (2.0 + r2k2));
    let p0 = fluid.shear * k2;
    Case {
        name: "coupled_cell".into(),
        title: "stirred cell of a Cosserat fluid",
        source: "manufactured",
        scene: SceneSource::new(
            "coupled_cell",
            format!(
                "schema = 1\nname = \"case\"\n[domain]\nx = [0, 1]\ny = [0, 1]\n[time]\nend = 1\n{}\
             [body_force]\n\
             x = \"{a:e} * sin({kx:?}*x) * cos({ky:?}*y) - {b:e} * sin({kx:?}*x) * cos({ky:?}*y)\"\n\
             y = \"-{c:e} * cos({kx:?}*x) * sin({ky:?}*y) - {d:e} * cos({kx:?}*x) * sin({ky:?}*y)\"\n\
             [boundaries]\nleft.rotation = 0\nright.rotation = 0\nbottom.rotation = 0\ntop.rotation = 0\n",
                fluid.toml(),
                a = drag * ky,
                b = p0 * kx,
                c = drag * kx,
                d = p0 * ky,
            ),
        ),
        exact: Exact {
            velocity: Box::new(move |x, y| {
                let (sx, cx) = (kx * x).sin_cos();
                let (sy, cy) = (ky * y).sin_cos();
                [ky * sx * cy, -kx * cx * sy, 0.5 * beta * k2 * sx * sy]
            }),
            pressure: Box::new(move |x, y| p0 * (kx * x).cos() * (ky * y).cos()),
        },
        rates: Rates { velocity: 2.9, rotation: Some(2.9), pressure: Some(1.9) },
    }
}
