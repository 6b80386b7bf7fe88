//! This module holds axisymmetric cases with exact solutions. `r` is the distance from the axis, `z` the
//! position along it.
//!
//! ```text
//! pipe       w = -[A I_1(k r) + G r/(4 eta)]
//!            v = G (a^2 - r^2)/(4 eta) + 2 eta_c A [I_0(k a) - I_0(k r)]/[k (eta + eta_c)]
//!            k^2 = 4 eta eta_c/[M (eta + eta_c)]
//! ring       v = (G/4 eta) [b^2 - r^2 - (b^2 - a^2) ln(b/r)/ln(b/a)]
//! stirred    u = -psi,z   v = (r psi),r/r   with polynomials of r times sin or cos of pi z
//! squeeze    F = 3 pi eta a^2 V/h for discs that slip, 3 pi eta a^4 V/(2 h^3) without slip and a >> h
//! hole       Q = a^3 dp/(3 eta): R. A. Sampson, Phil. Trans. R. Soc. A 182 (1891) 449
//! drop       U = (2/3)(a^2 g drho/eta)(eta + eta')/(2 eta + 3 eta'): J. Hadamard, C. R. Acad. Sci. 152
//!            (1911) 1735; W. Rybczynski, Bull. Acad. Sci. Cracovie A (1911) 40
//! ```

use super::cosserat::Fluid;
use super::{Case, CaseError, Exact, Rates, start};
use crate::scene::SceneSource;
use std::f64::consts::PI;

/// Modified Bessel function `I_n(x)` by its power series.
pub fn bessel_i(n: u32, x: f64) -> f64 {
    let square = 0.25 * x * x;
    let mut term = (1..=n).fold(1.0, |t, k| t * 0.5 * x / f64::from(k));
    let mut sum = term;
    let mut k = 1.0;
    while term > 1e-18 * sum {
        term *= square / (k * (k + f64::from(n)));
        sum += term;
        k += 1.0;
    }
    sum
}

/// What holds the rotation at the wall of a pipe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wall {
    /// The rotation is zero.
    Held,
    /// The couple stress is zero.
    Free,
}

/// Head of a scene of a unit of length of a pipe.
fn pipe_scene(x: [f64; 2], fluid: &str, sides: &str) -> String {
    format!(
        "schema = 1\nname = \"case\"\n[domain]\ngeometry = \"axisymmetric\"\nx = {x:?}\ny = [0, 0.25]\n\
         length_scale = 1\n[time]\nend = 1\n{fluid}[body_force]\ny = 1\n[boundaries]\n\
         bottom.kind = \"periodic\"\ntop.kind = \"periodic\"\n{sides}"
    )
}

/// Flow of a Cosserat fluid through a pipe of unit radius, which a unit pressure gradient drives.
pub fn pipe(fluid: Fluid, wall: Wall) -> Case {
    let (eta, eta_c) = (fluid.shear, fluid.coupling);
    let k = fluid.k();
    let a = match wall {
        Wall::Held => -1.0 / (4.0 * eta * bessel_i(1, k)),
        Wall::Free => -1.0 / (4.0 * eta * (k * bessel_i(0, k) - bessel_i(1, k))),
    };
    let held = if wall == Wall::Held { ", rotation = 0" } else { "" };
    Case {
        name: "pipe".into(),
        title: "flow of a Cosserat fluid through a pipe",
        source: "closed form",
        scene: SceneSource::new(
            "pipe",
            pipe_scene(
                [0.0, 1.0],
                &fluid.toml(),
                &format!("right = {{ kind = \"no_slip\"{held} }}\n"),
            ),
        ),
        exact: Exact {
            velocity: Box::new(move |r, _| {
                let lag = 2.0 * eta_c * a / (k * (eta + eta_c));
                let v = (1.0 - r * r) / (4.0 * eta) + lag * (bessel_i(0, k) - bessel_i(0, k * r));
                [0.0, v, -(a * bessel_i(1, k * r) + r / (4.0 * eta))]
            }),
            pressure: Box::new(|_, _| 0.0),
        },
        rates: Rates { velocity: 2.9, rotation: Some(2.9), pressure: None },
    }
}

/// Volume flow through the pipe of [`pipe`] at a number of cells per radius, from the numerical flow.
///
/// # Errors
/// The flow cannot be solved for.
pub fn discharge(case: &Case, cells: u32) -> Result<f64, CaseError> {
    let run = case.solve(cells, &[])?;
    let along = |k: u32| (f64::from(k) + 0.5) / f64::from(64 * cells);
    let ring = |r: f64| 2.0 * PI * r * run.velocity_at([r, 0.1])[1];
    Ok((0..64 * cells).map(|k| ring(along(k))).sum::<f64>() / f64::from(64 * cells))
}

/// Flow through the gap between two pipes of radius 0.5 and 1.
pub fn ring() -> Case {
    let (a, b): (f64, f64) = (0.5, 1.0);
    let fluid = "[materials.fluid]\nshear_viscosity = 1\n[[regions]]\nmaterial = \"fluid\"\n";
    let sides = "left.kind = \"no_slip\"\nright.kind = \"no_slip\"\n";
    Case {
        name: "ring".into(),
        title: "flow between two pipes",
        source: "closed form",
        scene: SceneSource::new("ring", pipe_scene([a, b], fluid, sides)),
        exact: Exact {
            velocity: Box::new(move |r, _| {
                let logarithm = (b * b - a * a) * (b / r).ln() / (b / a).ln();
                [0.0, 0.25 * (b * b - r * r - logarithm), 0.0]
            }),
            pressure: Box::new(|_, _| 0.0),
        },
        rates: Rates { velocity: 2.9, rotation: None, pressure: None },
    }
}

/// A flow of a Cosserat fluid in a vessel of unit radius and height with
///
/// ```text
/// psi = (b_1 r + b_3 r^3) sin pi z   w = (a_1 r + a_3 r^3) sin pi z   p = p_0 (r^2 - 1/2) cos pi z
/// f = grad p - curl[(eta D psi + 2 eta_c s) e]   c = -M D w - 4 eta_c s   s = D psi/2 - w
/// ```
/// where `D = d^2/dr^2 + (1/r) d/dr - 1/r^2 + d^2/dz^2` and `e` points around the axis.
pub fn stirred(fluid: Fluid) -> Case {
    let Fluid { shear: eta, coupling: eta_c, internal_length } = fluid;
    let m = 2.0 * eta_c * internal_length.powi(2);
    let (b1, b3, a1, a3, p0) = (0.7, -1.1, 0.9, -0.6, 4.0 * eta);
    let square = PI * PI;
    // Coefficients of r and r^3 of D psi, s, and D w.
    let d = [8.0 * b3 - square * b1, -square * b3];
    let s = [0.5 * d[0] - a1, 0.5 * d[1] - a3];
    let dw = [8.0 * a3 - square * a1, -square * a3];
    let g = [0, 1].map(|k| eta * d[k] + 2.0 * eta_c * s[k]);
    let c = [0, 1].map(|k| -m * dw[k] - 4.0 * eta_c * s[k]);
    let odd = |c: [f64; 2]| format!("({:?}*x + ({:?})*x^3)", c[0], c[1]);
    let even = |c: [f64; 2]| format!("({:?} + ({:?})*x^2)", 2.0 * c[0], 4.0 * c[1]);
    let (sine, cosine) = ("sin(pi*y)", "cos(pi*y)");
    let fx = format!("({:?})*x*{cosine} + {PI:?}*{}*{cosine}", 2.0 * p0, odd(g));
    let fy = format!("-({:?})*(x^2 - 0.5)*{sine} - {}*{sine}", p0 * PI, even(g));
    let couple = format!("{}*{sine}", odd(c));
    let [u, v, w] = [
        format!("-{PI:?}*{}*{cosine}", odd([b1, b3])),
        format!("{}*{sine}", even([b1, b3])),
        format!("{}*{sine}", odd([a1, a3])),
    ];
    let side = |name: &str| {
        format!("{name} = {{ velocity_x = \"{u}\", velocity_y = \"{v}\", rotation = \"{w}\" }}\n")
    };
    let text = format!(
        "schema = 1\nname = \"case\"\n[domain]\ngeometry = \"axisymmetric\"\nx = [0, 1]\ny = [0, 1]\n\
         [time]\nend = 1\n{}[body_force]\nx = \"{fx}\"\ny = \"{fy}\"\ncouple = \"{couple}\"\n\
         [boundaries]\n{}{}{}",
        fluid.toml(),
        side("right"),
        side("bottom"),
        side("top"),
    );
    Case {
        name: "stirred".into(),
        title: "stirred vessel of a Cosserat fluid",
        source: "manufactured",
        scene: SceneSource::new("stirred", text),
        exact: Exact {
            velocity: Box::new(move |r, z| {
                let (sz, cz) = (PI * z).sin_cos();
                let psi = b1 * r + b3 * r.powi(3);
                let [v, w] = [2.0 * b1 + 4.0 * b3 * r * r, a1 * r + a3 * r.powi(3)];
                [-PI * psi * cz, v * sz, w * sz]
            }),
            pressure: Box::new(move |r, z| p0 * (r * r - 0.5) * (PI * z).cos()),
        },
        rates: Rates { velocity: 2.9, rotation: Some(2.9), pressure: Some(1.9) },
    }
}

/// Force on discs of unit radius that approach each other with unit speed, with a fluid of unit
/// viscosity in the gap `h` between them, over that of the theory.
///
/// # Errors
/// The flow cannot be solved for.
pub fn squeeze(h: f64, slips: bool, cells: u32) -> Result<f64, CaseError> {
    let along = if slips { "" } else { ", velocity_x = 0" };
    let text = format!(
        "schema = 1\nname = \"squeeze\"\n[domain]\ngeometry = \"axisymmetric\"\nx = [0, 1]\ny = [0, {h:?}]\n\
         [accuracy]\ncells = {cells}\n[time]\nend = 1\n[materials.fluid]\nshear_viscosity = 1\n\
         [[regions]]\nmaterial = \"fluid\"\n[boundaries]\nright.kind = \"open\"\n\
         bottom = {{ velocity_y = 0{along} }}\ntop = {{ velocity_y = -1{along} }}\n\
         [[gauges]]\nname = \"disc\"\non = \"top\"\n"
    );
    let run = start(&SceneSource::new("squeeze", text))?;
    let theory = if slips { 3.0 * PI / h } else { 1.5 * PI / h.powi(3) };
    Ok(run.row().forces[0].y / theory)
}

/// Volume flow through a round hole of unit radius in a thin plate under a unit difference of pressure,
/// over Sampson's, in a vessel of radius `b` whose side slips. `cells`: cells per diameter.
///
/// # Errors
/// The flow cannot be solved for.
pub fn hole(b: f64, cells: u32) -> Result<f64, CaseError> {
    let text = format!(
        "schema = 1\nname = \"hole\"\n[domain]\ngeometry = \"axisymmetric\"\nx = [0, {b:?}]\n\
         y = [{:?}, {b:?}]\nlength_scale = 2\n[accuracy]\ncells = {cells}\n\
         [mesh]\ngrading = [{{ towards = \"apertures\", factor = 16 }}]\n[time]\nend = 1\n\
         [materials.fluid]\nshear_viscosity = 1\n[[regions]]\nmaterial = \"fluid\"\n[boundaries]\n\
         bottom = {{ kind = \"open\" }}\ntop = {{ kind = \"open\", traction_y = -1 }}\n\
         [[walls]]\nname = \"plate\"\nfrom = [1, 0]\nto = [{b:?}, 0]\nkind = \"no_slip\"\n\
         [[gauges]]\nname = \"hole\"\nfrom = [0, 0]\nto = [1, 0]\ndirection = \"down\"\n\
         material = \"fluid\"\n",
        -b
    );
    let run = start(&SceneSource::new("hole", text))?;
    // The flux through the hole is that through a plane below it, where the flow is smooth.
    let pieces = 4000;
    let at = |k: usize| b * (k as f64 + 0.5) / pieces as f64;
    let through = |r: f64| -2.0 * PI * r * run.velocity_at([r, -0.5 * b])[1];
    let flux: f64 = (0..pieces).map(|k| through(at(k))).sum::<f64>() * b / pieces as f64;
    Ok(3.0 * flux)
}

/// Speed of a drop of unit radius, whose viscosity is `contrast` times that of the fluid around it, over
/// that of the theory, in a vessel of radius `b` and height `2 b` whose walls slip. `cells`: cells per
/// radius.
///
/// # Errors
/// The flow cannot be solved for.
pub fn drop(contrast: f64, b: f64, cells: u32) -> Result<f64, CaseError> {
    /// Cells per radius of the vessel where nothing is refined.
    const COARSE: u32 = 8;
    let factor = f64::from(cells) * b / f64::from(COARSE);
    let refined = |axis: &str, from: i32, to: i32| -> String {
        (from..=to)
            .map(|k| {
                let at = 0.25 * f64::from(k);
                format!("{{ towards.{axis} = {at:?}, factor = {factor:?} }}, ")
            })
            .collect()
    };
    let text = format!(
        "schema = 1\nname = \"drop\"\ngravity = [0, -1]\n[domain]\ngeometry = \"axisymmetric\"\n\
         x = [0, {b:?}]\ny = [{:?}, {b:?}]\nlength_scale = {b:?}\n[accuracy]\ncells = {COARSE}\n\
         [mesh]\ngrowth = 1.2\ngrading = [{}{}]\n[time]\nend = 1\n\
         [materials.drop]\nshear_viscosity = {contrast:?}\ndensity = 1\n\
         [materials.fluid]\nshear_viscosity = 1\nbackground = true\n\
         [[regions]]\nmaterial = \"drop\"\nshape.circle = {{ centre = [0, 0], radius = 1 }}\n",
        -b,
        refined("x", 0, 5),
        refined("y", -5, 5),
    );
    let run = start(&SceneSource::new("drop", text))?;
    let n = 80;
    let (mut sum, mut volume) = (0.0, 0.0);
    for i in 0..n {
        let radius = (f64::from(i) + 0.5) / f64::from(n);
        for j in 0..n {
            let (s, c) = (PI * (f64::from(j) + 0.5) / f64::from(n)).sin_cos();
            let weight = radius * radius * s;
            sum -= weight * run.velocity_at([radius * s, radius * c])[1];
            volume += weight;
        }
    }
    let theory = 2.0 / 3.0 * (1.0 + contrast) / (2.0 + 3.0 * contrast);
    Ok(sum / volume / theory)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bessel_functions_are_those_of_tables() {
        // M. Abramowitz, I. A. Stegun, Handbook of Mathematical Functions, table 9.8
        let table = [(0, 1.0, 1.266_065_878), (1, 1.0, 0.565_159_104), (0, 5.0, 27.239_871_82)];
        for (n, x, value) in table {
            assert!((bessel_i(n, x) / value - 1.0).abs() < 1e-9);
        }
    }
}
