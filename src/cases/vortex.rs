//! A steady vortex driven by a density that particles carry around with it: "rigid shear" of
//! Gassmoeller, Lokavarapu, Bangerth and Puckett (2019).
//!
//! ```text
//! u = (sin pi x cos pi y, -cos pi x sin pi y),   p = 2 pi cos pi x cos pi y,   eta = 1
//! density = sin pi x sin pi y,   acceleration along y = -4 pi^2 cos(pi x) / sin(pi x)
//! ```
//! The density is constant along streamlines, so nothing should change, while the particles that
//! carry it go around.

use super::{Case, Exact, Rates};
use crate::scene::SceneSource;
use std::f64::consts::PI;

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

/// The force comes from the particles' density.
pub fn steady_vortex() -> Case {
    case(
        "steady_vortex",
        "density = \"sin(pi*x) * sin(pi*y)\"",
        "[acceleration]\ny = \"-4 * pi^2 * cos(pi*x) / sin(pi*x)\"",
        Rates { velocity: 2.8, rotation: None, pressure: Some(1.9) },
    )
}

/// The same force, fixed in space: what the elements alone can do.
pub fn steady_vortex_without_particles() -> Case {
    case(
        "steady_vortex_fixed",
        "",
        "[body_force]\ny = \"-4 * pi^2 * cos(pi*x) * sin(pi*y)\"",
        Rates { velocity: 2.9, rotation: None, pressure: Some(1.9) },
    )
}
