//! This module holds a case of a flow that slips along a wall.

use super::{Case, Exact, Rates};
use crate::scene::SceneSource;
use std::f64::consts::PI;

/// Flow over a wall with the slip length `b`, periodic along x, with the streamfunction
/// `psi = f(y) cos kx`, `k = 2 pi`:
///
/// ```text
/// f = sin pi y + c (1 - cos pi y),   c = 1/(b pi),   so that f(0) = 0, f'(0) = b f''(0)
/// u = psi,y    v = -psi,x    body force = grad p - laplace (u, v)    p = P cos kx cos pi y
/// ```
/// The exact velocity is given on the upper side. The pressure `p` is of the size of the viscous
/// stress.
pub fn slip_cell(b: f64) -> Case {
    let (k, c) = (2.0 * PI, 1.0 / (b * PI));
    let scale = k * k;
    // f and its derivatives as text: f = sin + c - c cos, f' = pi cos + pi c sin, and so on.
    let wave = |sin: f64, cos: f64| format!("({sin:?}*sin(pi*y) + {cos:?}*cos(pi*y))");
    let f0 = format!("({} + {c:?})", wave(1.0, -c));
    let f1 = wave(PI * c, PI);
    let f2 = wave(-PI * PI, PI * PI * c);
    let f3 = wave(-PI.powi(3) * c, -PI.powi(3));
    let text = format!(
        "schema = 1\nname = \"case\"\n[domain]\nx = [0, 1]\ny = [0, 1]\n[time]\nsteady = true\n\
         [materials.fluid]\nshear_viscosity = 1\n[[regions]]\nmaterial = \"fluid\"\n[body_force]\n\
         x = \"cos({k:?}*x) * ({a:?}*{f1} - {f3}) - {px:?}*sin({k:?}*x)*cos(pi*y)\"\n\
         y = \"{k:?}*sin({k:?}*x) * ({a:?}*{f0} - {f2}) - {py:?}*cos({k:?}*x)*sin(pi*y)\"\n\
         [boundaries]\nleft.kind = \"periodic\"\nright.kind = \"periodic\"\n\
         bottom.slip_length = {b:?}\n\
         top = {{ velocity_x = \"{u:?}*cos({k:?}*x)\", velocity_y = \"{v:?}*sin({k:?}*x)\" }}\n",
        a = k * k,
        px = scale * k,
        py = scale * PI,
        u = -PI,
        v = 2.0 * k * c,
    );
    Case {
        name: "slip_cell".into(),
        title: "flow that slips along a wall",
        source: "manufactured",
        scene: SceneSource::new("slip_cell", text),
        exact: Exact {
            velocity: Box::new(move |x, y| {
                let ((sx, cx), (sy, cy)) = ((k * x).sin_cos(), (PI * y).sin_cos());
                [PI * (cy + c * sy) * cx, k * (sy + c * (1.0 - cy)) * sx, 0.0]
            }),
            pressure: Box::new(move |x, y| scale * (k * x).cos() * (PI * y).cos()),
        },
        rates: Rates { velocity: 2.9, rotation: None, pressure: Some(1.9) },
    }
}
