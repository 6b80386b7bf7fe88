//! This module holds cases with solids of any shape, whose walls lie across the mesh.
//!
//! ```text
//! channel    u = G y (H - y)/(2 eta)  or, with a wall at y = 0 that slips,  u = G (H^2 - y^2)/(2 eta)
//! wedge      v_r = -(Q/r)(cos 2 theta - cos 2 alpha)/(sin 2 alpha - 2 alpha cos 2 alpha)
//! cylinders  F = mu U K, with the mean velocity U of a square array
//! ```
//! Channel: force `G` per volume along it. Wedge: half-angle `alpha`; converging flow of G. B. Jeffery
//! (1915) and G. Hamel (1917) without inertia. Cylinders: A. S. Sangani, A. Acrivos, "Slow flow past
//! periodic arrays of cylinders with application to heat transfer", Int. J. Multiphase Flow 8 (1982)
//! 193.

use super::{Case, CaseError, Exact, Rates, start};
use crate::scene::SceneSource;

/// A channel across the mesh of a unit box.
#[derive(Clone, Copy, Debug)]
pub struct SlantedChannel {
    /// Angle to the x axis, degrees; at most 45.
    pub degrees: f64,
    /// Width; at most 0.4.
    pub width: f64,
    /// Whether its lower wall slips.
    pub slips: bool,
}

/// Flow along a channel. The exact velocity is prescribed on the sides of the box.
pub fn slanted_channel(channel: SlantedChannel) -> Case {
    let SlantedChannel { degrees, width, slips } = channel;
    let (s, c) = degrees.to_radians().sin_cos();
    // Distance from the lower wall.
    let y = format!("({c:?}*(y - 0.5) - {s:?}*(x - 0.5) + {:?})", 0.5 * width);
    let speed = if slips {
        format!("0.5*({width:?}^2 - {y}^2)")
    } else {
        format!("0.5*{y}*({width:?} - {y})")
    };
    let corner = |along: f64, across: f64| {
        format!("[{:?}, {:?}]", 0.5 + along * c - across * s, 0.5 + along * s + across * c)
    };
    let (near, far) = (0.5 * width, 3.0);
    let block = |name: &str, kind: &str, sign: f64| {
        let corners = [(-2.0, near), (2.0, near), (2.0, far), (-2.0, far)];
        let corners: Vec<String> = corners.map(|(a, b)| corner(a, sign * b)).into();
        format!(
            "[[blocks]]\nname = \"{name}\"\nkind = \"{kind}\"\nshape.polygon = [{}]\n",
            corners.join(", ")
        )
    };
    let lower = if slips { "free_slip" } else { "no_slip" };
    let text = format!(
        "{}[body_force]\nx = {c:?}\ny = {s:?}\n{}{}",
        open_box("slanted_channel", &format!("{c:?}*{speed}"), &format!("{s:?}*{speed}")),
        block("lower", lower, -1.0),
        block("upper", "no_slip", 1.0),
    );
    Case {
        name: "slanted_channel".into(),
        title: "flow along a channel across the mesh",
        source: "parabola",
        scene: SceneSource::new("slanted_channel", text),
        exact: Exact {
            velocity: Box::new(move |x, y| {
                let y = c * (y - 0.5) - s * (x - 0.5) + 0.5 * width;
                let u = if slips { width * width - y * y } else { y * (width - y) };
                [0.5 * c * u, 0.5 * s * u, 0.0]
            }),
            pressure: Box::new(|_, _| 0.0),
        },
        rates: Rates { velocity: 2.0, rotation: None, pressure: None },
    }
}

/// Scene of a unit box with a fluid of viscosity one and the given velocity on its sides.
fn open_box(name: &str, u: &str, v: &str) -> String {
    let sides = ["left", "right", "bottom", "top"]
        .map(|side| format!("{side} = {{ velocity_x = \"{u}\", velocity_y = \"{v}\" }}\n"));
    format!(
        "schema = 1\nname = \"{name}\"\n[domain]\nx = [0, 1]\ny = [0, 1]\n[time]\nend = 1\n\
         [materials.fluid]\nshear_viscosity = 1\n[[regions]]\nmaterial = \"fluid\"\n\
         [boundaries]\n{}",
        sides.concat()
    )
}

/// Converging flow in a wedge with the half-angle `degrees` whose apex is below the unit box. The exact
/// velocity is prescribed on the sides of the box.
pub fn wedge(degrees: f64) -> Case {
    const APEX: [f64; 2] = [0.5137, -0.3];
    let alpha = degrees.to_radians();
    let scale = 1.0 / ((2.0 * alpha).sin() - 2.0 * alpha * (2.0 * alpha).cos());
    let far = (2.0 * alpha).cos();
    let [x, y] = [format!("(x - {:?})", APEX[0]), format!("(y + {:?})", -APEX[1])];
    let square = format!("({x}^2 + {y}^2)");
    let part = |c: &str| format!("-{c}*{scale:?}*(({y}^2 - {x}^2)/{square} - ({far:?}))/{square}");
    // The walls leave the apex at the half-angle from the y axis.
    let wall = |sign: f64| {
        let (s, c) = alpha.sin_cos();
        let at = |r: f64| format!("[{:?}, {:?}]", APEX[0] + sign * r * s, APEX[1] + r * c);
        let out = |r: f64| {
            let far = [APEX[0] + sign * (r * s + 4.0 * c), APEX[1] + r * c - 4.0 * s];
            format!("[{:?}, {:?}]", far[0], far[1])
        };
        format!("[{}, {}, {}, {}]", at(0.0), at(4.0), out(4.0), out(0.0))
    };
    let text = format!(
        "{}[[blocks]]\nname = \"left\"\nkind = \"no_slip\"\nshape.polygon = {}\n\
         [[blocks]]\nname = \"right\"\nkind = \"no_slip\"\nshape.polygon = {}\n",
        open_box("wedge", &part(&x), &part(&y)),
        wall(-1.0),
        wall(1.0),
    );
    Case {
        name: "wedge".into(),
        title: "converging flow in a wedge",
        source: "Jeffery (1915), Hamel (1917), creeping",
        scene: SceneSource::new("wedge", text),
        exact: Exact {
            velocity: Box::new(move |x, y| {
                let [x, y] = [x - APEX[0], y - APEX[1]];
                let square = x * x + y * y;
                let f = -scale * ((y * y - x * x) / square - far) / square;
                [f * x, f * y, 0.0]
            }),
            pressure: Box::new(|_, _| 0.0),
        },
        rates: Rates { velocity: 2.0, rotation: None, pressure: None },
    }
}

/// Published drag `K` of a square array of cylinders, by their volume fraction.
pub const ARRAY_DRAG: [(f64, f64); 2] = [(0.2, 51.53), (0.4, 217.9)];

/// Drag `K` of a square array of cylinders with the given volume fraction, from the mean velocity that a
/// unit pressure gradient drives through a cell of unit size.
///
/// # Errors
/// The flow cannot be solved for.
pub fn array_drag(fraction: f64, cells: u32) -> Result<f64, CaseError> {
    let text = format!(
        "schema = 1\nname = \"cylinders\"\n[domain]\nx = [0, 1]\ny = [0, 1]\n[accuracy]\n\
         cells = {cells}\n[time]\nend = 1\n[materials.fluid]\nshear_viscosity = 1\n[[regions]]\n\
         material = \"fluid\"\n[body_force]\nx = 1\n[boundaries]\nleft.kind = \"periodic\"\n\
         right.kind = \"periodic\"\nbottom.kind = \"periodic\"\ntop.kind = \"periodic\"\n\
         [[blocks]]\nname = \"cylinder\"\nkind = \"no_slip\"\n\
         shape.circle = {{ centre = [0.5, 0.5], radius = {:?} }}\n[[gauges]]\nname = \"seam\"\n\
         from = [0, 0]\nto = [0, 1]\ndirection = \"right\"\nmaterial = \"fluid\"\n",
        (fraction / std::f64::consts::PI).sqrt()
    );
    let run = start(&SceneSource::new("cylinders", text))?;
    Ok(1.0 / run.row().gauges[0].rate)
}
