//! This module holds steady unidirectional flows of generalised fluids, whose speed and discharge are
//! known in closed form.

use super::{CaseError, start};
use crate::scene::SceneSource;
use crate::sim::Run;

/// Grains of all cases, with `rho = 1` and `g = 1`: `mu_s`, `mu_2`, `I_0`, `d`, `rho_s`.
const AT_REST: f64 = 0.38;
const FAST: f64 = 0.64;
const INERTIAL_NUMBER: f64 = 0.279;
const DIAMETER: f64 = 0.04;
const GRAIN_DENSITY: f64 = 1.0 / 0.6;

/// Largest speed and discharge of a flow.
#[derive(Clone, Copy, Debug)]
pub struct Stream {
    /// Largest speed, m/s.
    pub speed: f64,
    /// Discharge, m2/s.
    pub discharge: f64,
}

/// A flow that varies across a layer or channel of length scale 1.
pub struct Unidirectional {
    /// Text of the scene without `accuracy.cells`; `{period}` stands for the length of four cells and
    /// `{middle}` for that of two.
    text: String,
    /// Where the flow is fastest.
    fastest: [f64; 2],
    /// The exact flow.
    pub exact: Stream,
}

impl Unidirectional {
    /// Solves for the flow with a number of cells per length.
    ///
    /// # Errors
    /// The scene is invalid, or the flow cannot be solved for.
    pub fn solve(&self, cells: u32) -> Result<Box<dyn Run>, CaseError> {
        let text = self
            .text
            .replace("{period}", &format!("\"4/{cells}\""))
            .replace("{middle}", &format!("\"2/{cells}\""));
        let source = SceneSource::new("stream", text);
        start(&source.with_sets(&[format!("accuracy.cells={cells}")])?)
    }

    /// The computed flow.
    ///
    /// # Errors
    /// The scene is invalid, or the flow cannot be solved for.
    pub fn measure(&self, cells: u32) -> Result<Stream, CaseError> {
        let run = self.solve(cells)?;
        let [u, v, _] = run.velocity_at(self.fastest);
        Ok(Stream { speed: u.hypot(v), discharge: run.row().gauges[0].rate })
    }

    /// Relative errors of the computed flow.
    ///
    /// # Errors
    /// The scene is invalid, or the flow cannot be solved for.
    pub fn errors(&self, cells: u32) -> Result<Stream, CaseError> {
        let (found, exact) = (self.measure(cells)?, self.exact);
        Ok(Stream {
            speed: found.speed / exact.speed - 1.0,
            discharge: found.discharge / exact.discharge - 1.0,
        })
    }
}

/// Start of all scenes, with the lines of the material and the ranges along x and y.
fn scene(material: &str, x: &str, y: &str) -> String {
    format!(
        "schema = 1\nname = \"stream\"\n[domain]\nx = {x}\ny = {y}\nlength_scale = 1\n\
         [accuracy]\nnonlinear_tolerance = 1e-7\n[time]\nend = 1e-4\n[recording]\nframes = 1\n\
         [[regions]]\nmaterial = \"fluid\"\n[materials.fluid]\n{material}\n"
    )
}

/// Lines of the grains.
fn grains() -> String {
    format!(
        "density = 1\nfriction = {{ static = {AT_REST}, dynamic = {FAST}, \
         inertial_number = {INERTIAL_NUMBER}, grain_diameter = {DIAMETER}, \
         grain_density = {GRAIN_DENSITY:?} }}\n"
    )
}

/// The sides of a channel along x between y = 0 and 1, and its gauge.
fn along_x(top: &str) -> String {
    format!(
        "[boundaries]\nleft.kind = \"periodic\"\nright.kind = \"periodic\"\n\
         bottom.kind = \"no_slip\"\ntop.kind = \"{top}\"\n[[gauges]]\nname = \"q\"\nfrom = [0, 0]\n\
         to = [0, 1]\ndirection = \"right\"\nmaterial = \"fluid\"\n"
    )
}

/// Grains that flow down a rough incline in a layer of thickness `H = 1` (Bagnold):
///
/// ```text
/// I = I_0 (tan th - mu_s)/(mu_2 - tan th),   du/dy = A sqrt(H - y),   A = (I/d) sqrt(rho g cos th/rho_s)
/// u(H) = (2/3) A H^(3/2),   Q = (2/5) A H^(5/2)
/// ```
pub fn bagnold(degrees: f64) -> Unidirectional {
    let (s, c) = degrees.to_radians().sin_cos();
    let i = INERTIAL_NUMBER * (s / c - AT_REST) / (FAST - s / c);
    let a = i / DIAMETER * (c / GRAIN_DENSITY).sqrt();
    let body = scene(&grains(), "[0, {period}]", "[0, 1]") + &along_x("open");
    Unidirectional {
        text: body.replace("[domain]", &format!("gravity = [{s:?}, {:?}]\n[domain]", -c)),
        fastest: [0.0, 1.0],
        exact: Stream { speed: a * 2.0 / 3.0, discharge: a * 2.0 / 5.0 },
    }
}

/// Grains that fall between rough vertical walls at x = -1 and 1 under the pressure `p0`:
///
/// ```text
/// m = rho g x/p0,   du/dx = -(I_0/d) sqrt(p0/rho_s) (m - mu_s)/(mu_2 - m) for m > mu_s, else 0
/// ```
/// The discharge is that of both halves. The largest viscosity is 1e4, since its default follows from
/// the height of the material, here that of four cells.
/// `internal_length` above zero: a Cosserat material with
/// `eta_c = eta` and no rotation at the walls; its exact flow is not known in closed form, and `exact`
/// is that without internal length.
pub fn chute(p0: f64, internal_length: f64) -> Unidirectional {
    let wall = 1.0 / p0;
    let (rise, log) = (FAST - AT_REST, ((FAST - AT_REST) / (FAST - wall)).ln());
    let rate = INERTIAL_NUMBER / DIAMETER * (p0 / GRAIN_DENSITY).sqrt();
    // Integrals over m from mu_s to the wall of (m - mu_s)/(mu_2 - m), and of m times it.
    let zeroth = rise * log - (wall - AT_REST);
    let first =
        FAST * rise * log - 0.5 * (wall * wall - AT_REST * AT_REST) - rise * (wall - AT_REST);
    let body = scene(
        &format!("{}largest_viscosity = 1e4\ninternal_length = {internal_length:?}", grains()),
        "[-1, 1]",
        "[0, {period}]",
    );
    let text = format!(
        "{body}[pressure_reference]\nat = [0, {{middle}}]\nvalue = {p0:?}\n[boundaries]\n\
         bottom.kind = \"periodic\"\ntop.kind = \"periodic\"\n\
         left = {{ kind = \"no_slip\", rotation = 0 }}\n\
         right = {{ kind = \"no_slip\", rotation = 0 }}\n[[gauges]]\nname = \"q\"\n\
         from = [-1, {{middle}}]\nto = [1, {{middle}}]\ndirection = \"down\"\nmaterial = \"fluid\"\n"
    );
    Unidirectional {
        text: text.replace("[domain]", "gravity = [0, -1]\n[domain]"),
        fastest: [0.0, 0.0],
        exact: Stream { speed: rate * p0 * zeroth, discharge: 2.0 * rate * p0 * p0 * first },
    }
}

/// A fluid with `tau = tau_y + K g^n`, `K = 1`, between walls at y = 0 and 1.
#[derive(Clone, Copy, Debug)]
pub struct Channel {
    /// Yield stress, Pa.
    pub yield_stress: f64,
    /// Flow index n.
    pub index: f64,
    /// Force per volume along the channel, N/m3.
    pub force: f64,
    /// Largest viscosity, Pa s.
    pub largest: f64,
}

/// Flow of Herschel and Bulkley's fluid, with `T = f/2` the stress at the walls and `N = 1 + 1/n`:
///
/// ```text
/// u_plug = (T - tau_y)^N / (f N),   Q = u_plug - 2 (T - tau_y)^(N + 1) / (f^2 N (N + 1))
/// ```
/// At or below the yield stress the fluid is at rest: the exact flow given here is then that of a
/// fluid with the largest viscosity.
pub fn channel(c: Channel) -> Unidirectional {
    let Channel { yield_stress, index, force, largest } = c;
    let above = 0.5 * force - yield_stress;
    let exact = if above > 0.0 {
        let n = 1.0 + 1.0 / index;
        let speed = above.powf(n) / (force * n);
        let lag = 2.0 * above.powf(n + 1.0) / (force * force * n * (n + 1.0));
        Stream { speed, discharge: speed - lag }
    } else {
        Stream { speed: force / (8.0 * largest), discharge: force / (12.0 * largest) }
    };
    let material = format!(
        "shear_viscosity = 1\nyield_stress = {yield_stress:?}\nflow_index = {index:?}\n\
         largest_viscosity = {largest:?}\nsmallest_viscosity = 1e-6"
    );
    let body = scene(&material, "[0, {period}]", "[0, 1]") + &along_x("no_slip");
    Unidirectional {
        text: format!("{body}[body_force]\nx = {force:?}\n"),
        fastest: [0.0, 0.5],
        exact,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_streams_are_met() {
        let fluid = |yield_stress, index, force| {
            channel(Channel { yield_stress, index, force, largest: 1e6 }).exact
        };
        for (found, [speed, discharge]) in [
            (bagnold(24.0).exact, [1.152942, 0.691765]),
            (bagnold(28.0).exact, [4.741524, 2.844915]),
            (chute(1.7, 0.0).exact, [2.531591, 4.625965]),
            (fluid(1.0, 1.0, 4.0), [0.125, 0.10416667]),
            (fluid(1.0, 1.0, 20.0), [2.025, 1.4175]),
            (fluid(0.0, 0.5, 10.0), [4.1666667, 3.125]),
            (fluid(0.0, 1.5, 10.0), [0.8772053, 0.5482533]),
        ] {
            assert!((found.speed / speed - 1.0).abs() < 1e-6, "{found:?} {speed}");
            assert!((found.discharge / discharge - 1.0).abs() < 1e-6, "{found:?} {discharge}");
        }
    }
}
