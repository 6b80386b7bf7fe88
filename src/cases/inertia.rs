//! This module holds scenes with inertia whose motion is known.

use crate::scene::SceneSource;
use std::f64::consts::PI;

/// Start of all scenes, with the lines of the domain, of the time and of `[accuracy]`.
fn scene(name: &str, domain: &str, [cells, end, max_step]: [f64; 3], rest: &str) -> SceneSource {
    let text = format!(
        "schema = 1\nname = \"{name}\"\ninertia = true\n{domain}\n[accuracy]\ncells = {cells}\n\
         [time]\nend = {end:?}\nmax_step = {max_step:?}\ntolerance = 1\ncourant = 10\n[recording]\n\
         frames = 1\n{rest}"
    );
    SceneSource::new(name, text)
}

/// Cells per length and largest step of a run.
#[derive(Clone, Copy, Debug)]
pub struct Resolution {
    /// Cells per length scale.
    pub cells: u32,
    /// Largest step, s.
    pub max_step: f64,
}

impl Resolution {
    /// The values of a scene that ends at a time.
    fn until(self, end: f64) -> [f64; 3] {
        [f64::from(self.cells), end, self.max_step]
    }
}

/// Taylor and Green's decaying vortex in a unit box with free slip, `nu = 1/(1000 k)`, `k = pi`, up
/// to t = 2, one turn:
///
/// ```text
/// u = (sin kx cos ky, -cos kx sin ky) exp(-2 nu k^2 t)
/// ```
pub fn decaying_vortex(resolution: Resolution) -> SceneSource {
    scene(
        "decaying_vortex",
        "[domain]\nx = [0, 1]\ny = [0, 1]",
        resolution.until(2.0),
        "[materials.fluid]\ndensity = 1\nshear_viscosity = \"1/(1000*pi)\"\n[[regions]]\n\
         material = \"fluid\"\n[initial_velocity]\nx = \"sin(pi*x)*cos(pi*y)\"\n\
         y = \"-cos(pi*x)*sin(pi*y)\"\n",
    )
}

/// Share of its kinetic energy that the vortex has lost at the end, `1 - exp(-4 nu k^2 t)`.
pub fn energy_lost_by_vortex() -> f64 {
    1.0 - (-4.0 * PI / 1000.0 * 2.0).exp()
}

/// Radius of the drop of [`falling_drop`], m.
const RADIUS: f64 = 0.2;

/// A drop that falls in thin air from rest up to t = 1, with gravity 1. Its viscosity is 0.01.
pub fn falling_drop(resolution: Resolution, air_viscosity: f64) -> SceneSource {
    scene(
        "falling_drop",
        "gravity = [0, -1]\n[domain]\nx = [0, 1]\ny = [0, 2]",
        resolution.until(1.0),
        &format!(
            "[materials.drop]\ndensity = 1\nshear_viscosity = 0.01\n[materials.air]\ndensity = 1e-5\n\
             shear_viscosity = {air_viscosity:?}\nbackground = true\n[[regions]]\n\
             material = \"drop\"\nshape.circle = {{ centre = [0.5, 1.5], radius = {RADIUS} }}\n\
             [boundaries]\ntop.kind = \"open\"\nbottom.kind = \"open\"\n"
        ),
    )
}

/// Kinematic viscosity of [`plate`], m2/s.
const NU: f64 = 0.01;

/// Fluid at rest over a plate that moves with unit speed from t = 0 (Rayleigh), up to t = 1.
pub fn plate(resolution: Resolution) -> SceneSource {
    let period = 4.0 / f64::from(resolution.cells);
    scene(
        "plate",
        &format!("[domain]\nx = [0, {period:?}]\ny = [0, 1]\nlength_scale = 1"),
        resolution.until(1.0),
        &format!(
            "[materials.fluid]\ndensity = 1\nshear_viscosity = {NU}\n[[regions]]\n\
             material = \"fluid\"\n[boundaries]\nleft.kind = \"periodic\"\nright.kind = \"periodic\"\n\
             bottom = {{ kind = \"no_slip\", velocity_x = 1 }}\n"
        ),
    )
}

/// Speed of the fluid at a height over the plate, `erfc(y / (2 sqrt(nu t)))`.
pub fn speed_over_plate(y: f64, t: f64) -> f64 {
    const PARTS: u32 = 200;
    let end = y / (2.0 * (NU * t).sqrt());
    let h = end / f64::from(PARTS);
    // Simpson's rule.
    let integral: f64 = (0..=PARTS)
        .map(|k| {
            let s = h * f64::from(k);
            let weight = if k == 0 || k == PARTS { 1.0 } else { f64::from(2 + 2 * (k % 2)) };
            weight * (-s * s).exp()
        })
        .sum();
    1.0 - 2.0 / PI.sqrt() * integral * h / 3.0
}

/// Densities, viscosities and micro-inertia of [`turning_wave`]: eta, eta_c, M and j, with a density of 1.
const TURNING: [f64; 4] = [0.05, 0.1, 2e-3, 0.2];

/// A wave of shear and rotation that decays, up to t = 2: `u = u(t) cos ky`, `w = w(t) sin ky` with
/// `k = pi` between walls without friction on which the rotation is zero, in a Cosserat fluid whose
/// rotation has inertia. It starts with the rotation of its spin.
pub fn turning_wave(resolution: Resolution) -> SceneSource {
    let [eta, coupling, couple, j] = TURNING;
    let period = 4.0 / f64::from(resolution.cells);
    scene(
        "turning_wave",
        &format!("[domain]\nx = [0, {period:?}]\ny = [0, 1]\nlength_scale = 1"),
        resolution.until(2.0),
        &format!(
            "[materials.grains]\ndensity = 1\nshear_viscosity = {eta:?}\ncoupling_viscosity = \
             {coupling:?}\ncouple_viscosity = {couple:?}\nmicro_inertia = {j:?}\n[[regions]]\nmaterial = \
             \"grains\"\n[initial_velocity]\nx = \"cos(pi*y)\"\ny = 0\n[boundaries]\nleft.kind = \
             \"periodic\"\nright.kind = \"periodic\"\nbottom.rotation = 0\ntop.rotation = 0\n"
        ),
    )
}

/// Velocity and rotation of [`turning_wave`] at a time, `u(t)` and `w(t)`, from
///
/// ```text
/// rho u' = -(eta + eta_c) k^2 u + 2 eta_c k w
/// rho j w' = 2 eta_c k u - (M k^2 + 4 eta_c) w,   u(0) = 1, w(0) = k/2
/// ```
pub fn motion_of_turning_wave(t: f64) -> [f64; 2] {
    let [eta, coupling, couple, j] = TURNING;
    let a = -(eta + coupling) * PI * PI;
    let b = 2.0 * coupling * PI;
    let d = -(couple * PI * PI + 4.0 * coupling) / j;
    // Both rates of decay are real: the product of the couplings is positive.
    let (mean, half) = (0.5 * (a + d), (0.25 * (a - d).powi(2) + b * b / j).sqrt());
    let start = [1.0, 0.5 * PI];
    // exp(A t) = exp(mean t) (cosh(half t) + (A - mean) sinh(half t)/half).
    let [c, s] = [(half * t).cosh(), (half * t).sinh() / half];
    let of = [a * start[0] + b * start[1], b / j * start[0] + d * start[1]];
    [0, 1].map(|k| (mean * t).exp() * (c * start[k] + s * (of[k] - mean * start[k])))
}

/// A standing wave of wavelength 1 and amplitude 0.01 on water of depth 0.5 under air, with gravity
/// 1, half a wavelength wide, over a free-slip floor. `resolution`: cells per half wavelength.
pub fn standing_wave(resolution: Resolution) -> SceneSource {
    scene(
        "standing_wave",
        "gravity = [0, -1]\n[domain]\nx = [0, 0.5]\ny = [0, 0.75]",
        resolution.until(1.05 * wave_period()),
        "[materials.water]\ndensity = 1\nshear_viscosity = 1e-4\n[materials.air]\ndensity = 1e-3\n\
         shear_viscosity = 1e-4\nbackground = true\n[[regions]]\nmaterial = \"water\"\n\
         shape.where = \"y < 0.5 + 0.01*cos(2*pi*x)\"\n[boundaries]\ntop.kind = \"open\"\n",
    )
}

/// Period of the standing wave, `2 pi / sqrt(g k tanh kh)`.
pub fn wave_period() -> f64 {
    let k = 2.0 * PI;
    2.0 * PI / (k * (0.5 * k).tanh()).sqrt()
}

/// Kinetic energy of the standing wave after half a period, over that before, `exp(-4 nu k^2 T/2)`.
pub fn wave_decay() -> f64 {
    (-4.0 * 1e-4 * 4.0 * PI * PI * 0.5 * wave_period()).exp()
}

/// The lid-driven cavity at Re = 1000, from rest up to t = 60, with steps of up to two cells.
pub fn cavity(cells: u32) -> SceneSource {
    let text = format!(
        "schema = 1\nname = \"cavity\"\ninertia = true\n[domain]\nx = [0, 1]\ny = [0, 1]\n\
         [accuracy]\ncells = {cells}\n[time]\nend = 60\ntolerance = 1\ncourant = 2\n[recording]\n\
         frames = 1\n[materials.fluid]\ndensity = 1\nshear_viscosity = 1e-3\n[[regions]]\n\
         material = \"fluid\"\n[boundaries]\nleft.kind = \"no_slip\"\nright.kind = \"no_slip\"\n\
         bottom.kind = \"no_slip\"\ntop = {{ kind = \"no_slip\", velocity_x = 1 }}\n"
    );
    SceneSource::new("cavity", text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_motion_of_the_turning_wave_follows_its_equations() {
        let [eta, coupling, couple, j] = TURNING;
        let h = 1e-5;
        for t in [0.0, 0.3, 1.7] {
            let [u, w] = motion_of_turning_wave(t);
            let [before, after] = [t - h, t + h].map(motion_of_turning_wave);
            let [du, dw] = [0, 1].map(|c| (after[c] - before[c]) / (2.0 * h));
            let force = -(eta + coupling) * PI * PI * u + 2.0 * coupling * PI * w;
            let torque = 2.0 * coupling * PI * u - (couple * PI * PI + 4.0 * coupling) * w;
            assert!((du - force).abs() < 1e-8 && (j * dw - torque).abs() < 1e-8, "{t}");
        }
        assert_eq!(motion_of_turning_wave(0.0), [1.0, 0.5 * PI]);
    }

    #[test]
    fn the_speed_over_the_plate_is_that_of_the_error_function() {
        // erfc(0.5) and erfc(1).
        for (y, speed) in [(0.1, 0.4795001222), (0.2, 0.1572992071)] {
            assert!((speed_over_plate(y, 1.0) - speed).abs() < 1e-9);
        }
    }
}
