//! This module holds the case of a steady vortex driven by a density that particles carry: "rigid
//! shear" of Gassmoeller, Lokavarapu, Bangerth and Puckett (2019).
//!
//! ```text
//! u = (sin pi x cos pi y, -cos pi x sin pi y),   p = 2 pi cos pi x cos pi y,   eta = 1
//! density = sin pi x sin pi y,   acceleration along y = -4 pi^2 cos(pi x) / sin(pi x)
//! ```
//! The density is constant along streamlines, so the exact flow is steady although the particles
//! move.

use super::{Case, Exact, Rates};
use crate::scene::SceneSource;
use std::f64::consts::PI;

/// The case with lines of a material and of a load.
fn case(name: &str, material: &str, load: &str, rates: Rates) -> Case {
    let text = format!(
        "schema = 1\nname = \"{name}\"\n[domain]\nx = [0, 1]\ny = [0, 1]\n[accuracy]\n\
         placement = \"random\"\n[time]\nend = 0.1\n[materials.fluid]\nshear_viscosity = 1\n\
         {material}\n[[regions]]\nmaterial = \"fluid\"\n{load}\n"
    );
    Case {
        name: name.into(),
        title: "steady vortex whose density is carried by moving particles",
        source: "Gassmoeller et al. 2019, rigid shear",
        scene: SceneSource::new(name, text),
        exact: Exact {
            velocity: Box::new(|x, y| {
                let ((sx, cx), (sy, cy)) = ((PI * x).sin_cos(), (PI * y).sin_cos());
                [sx * cy, -cx * sy, 0.0]
            }),
            pressure: Box::new(|x, y| 2.0 * PI * (PI * x).cos() * (PI * y).cos()),
        },
        rates,
    }
}

/// The vortex driven by the density of the particles.
pub fn steady_vortex() -> Case {
    case(
        "steady_vortex",
        "density = \"sin(pi*x) * sin(pi*y)\"",
        "[acceleration]\ny = \"-4 * pi^2 * cos(pi*x) / sin(pi*x)\"",
        Rates { velocity: 2.8, rotation: None, pressure: Some(1.9) },
    )
}

/// The vortex driven by the same force fixed in space, which shows the error of the elements alone.
pub fn steady_vortex_without_particles() -> Case {
    case(
        "steady_vortex_fixed",
        "",
        "[body_force]\ny = \"-4 * pi^2 * cos(pi*x) * sin(pi*y)\"",
        Rates { velocity: 2.9, rotation: None, pressure: Some(1.9) },
    )
}
