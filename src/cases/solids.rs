//! This module holds cases with solids of any shape, whose walls lie across the mesh.
//!
//! ```text
//! channel    eta u = t (y - H) + (G/2)(H^2 - y^2)  with the shear stress t at the wall y = 0
//!            t = G H/2  at rest,  t = 0  free slip,  t = (G H/2) H/(H + b)  with the slip length b,
//!            t = mu p  where it slides with the friction mu under the pressure p
//! Cosserat   w = (G/2 eta) (y - B sinh ky),  y from the middle of a channel of width 2 h
//!            u = (G/2 eta) (h^2 - y^2) - [G eta_c B/(eta (eta + eta_c) k)] (cosh kh - cosh ky)
//!            B = 1/(k cosh kh)  without a couple on the walls,  B = h/sinh kh  without rotation on them
//! circle     u_theta = A r + C/r,   A a + C/a = -2 b C/a^2
//! wedge      v_r = -(Q/r)(cos 2 theta - cos 2 alpha)/(sin 2 alpha - 2 alpha cos 2 alpha)
//! cylinders  F = mu U K, with the mean velocity U of a square array
//! ```
//! Channel: force `G` per volume along it. Circle: radius `a`, slip length `b`. Wedge: half-angle `alpha`; converging flow of G. B. Jeffery
//! (1915) and G. Hamel (1917) without inertia. Cylinders: A. S. Sangani, A. Acrivos, "Slow flow past
//! periodic arrays of cylinders with application to heat transfer", Int. J. Multiphase Flow 8 (1982)
//! 193.

use super::{Case, CaseError, Exact, Fluid, Rates, start};
use crate::scene::SceneSource;

/// The lower wall of a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LowerWall {
    /// Zero velocity.
    NoSlip,
    /// No friction.
    FreeSlip,
    /// Navier's law with this slip length.
    Slip(f64),
    /// Coulomb's law with the coefficient and the pressure in the channel; small enough to slide.
    Friction(f64, f64),
}

/// A channel across the mesh of a unit box.
#[derive(Clone, Copy, Debug)]
pub struct SlantedChannel {
    /// Angle to the x axis, degrees; at most 45.
    pub degrees: f64,
    /// Width; at most 0.4.
    pub width: f64,
    /// Its lower wall.
    pub lower: LowerWall,
}

/// Flow along a channel. The exact velocity is prescribed on the sides of the box.
pub fn slanted_channel(channel: SlantedChannel) -> Case {
    let SlantedChannel { degrees, width, lower } = channel;
    let (s, c) = degrees.to_radians().sin_cos();
    // Shear stress at the lower wall.
    let stress = match lower {
        LowerWall::NoSlip => 0.5 * width,
        LowerWall::FreeSlip => 0.0,
        LowerWall::Slip(b) => 0.5 * width * width / (width + b),
        LowerWall::Friction(mu, pressure) => mu * pressure,
    };
    // Distance from the lower wall.
    let y = format!("({} + {:?})", across(degrees), 0.5 * width);
    let speed = format!("({stress:?}*({y} - {width:?}) + 0.5*({width:?}^2 - {y}^2))");
    let no_slip = "kind = \"no_slip\"";
    let (mut law, mut reference) = (no_slip.to_string(), String::new());
    match lower {
        LowerWall::NoSlip => {}
        LowerWall::FreeSlip => law = "kind = \"free_slip\"".into(),
        LowerWall::Slip(b) => law = format!("slip_length = {b:?}"),
        LowerWall::Friction(mu, p) => {
            law = format!("wall_friction = {mu:?}");
            reference = format!("[pressure_reference]\nat = [0.5, 0.5]\nvalue = {p:?}\n");
        }
    }
    let text = format!(
        "{}[body_force]\nx = {c:?}\ny = {s:?}\n{reference}{}{}",
        open_box(
            "slanted_channel",
            FLUID,
            &[("velocity_x", format!("{c:?}*{speed}")), ("velocity_y", format!("{s:?}*{speed}"))]
        ),
        bank("lower", &law, (degrees, -0.5 * width)),
        bank("upper", no_slip, (degrees, 0.5 * width)),
    );
    let pressure = if let LowerWall::Friction(_, p) = lower { p } else { 0.0 };
    Case {
        name: "slanted_channel".into(),
        title: "flow along a channel across the mesh",
        source: "parabola",
        scene: SceneSource::new("slanted_channel", text),
        exact: Exact {
            velocity: Box::new(move |x, y| {
                let y = c * (y - 0.5) - s * (x - 0.5) + 0.5 * width;
                let u = stress * (y - width) + 0.5 * (width * width - y * y);
                [c * u, s * u, 0.0]
            }),
            pressure: Box::new(move |_, _| pressure),
        },
        rates: Rates { velocity: 2.0, rotation: None, pressure: None },
    }
}

/// Flow around a circle along which it slips, with the slip length `b`. The exact velocity is prescribed
/// on the sides of the box.
pub fn slipping_circle(b: f64) -> Case {
    const CENTRE: [f64; 2] = [0.52, 0.47];
    const RADIUS: f64 = 0.21;
    let c = -1.0 / (1.0 / (RADIUS * RADIUS) + 2.0 * b / RADIUS.powi(3));
    let [x, y] = [format!("(x - {:?})", CENTRE[0]), format!("(y - {:?})", CENTRE[1])];
    let turning = format!("(1 + {c:?}/({x}^2 + {y}^2))");
    let text = format!(
        "{}[[blocks]]\nname = \"circle\"\nslip_length = {b:?}\n\
         shape.circle = {{ centre = [{:?}, {:?}], radius = {RADIUS:?} }}\n",
        open_box(
            "slipping_circle",
            FLUID,
            &[("velocity_x", format!("-{y}*{turning}")), ("velocity_y", format!("{x}*{turning}"))]
        ),
        CENTRE[0],
        CENTRE[1]
    );
    Case {
        name: "slipping_circle".into(),
        title: "flow around a circle along which it slips",
        source: "circular Couette flow",
        scene: SceneSource::new("slipping_circle", text),
        exact: Exact {
            velocity: Box::new(move |x, y| {
                let [x, y] = [x - CENTRE[0], y - CENTRE[1]];
                let turning = 1.0 + c / (x * x + y * y);
                [-y * turning, x * turning, 0.0]
            }),
            pressure: Box::new(|_, _| 0.0),
        },
        // Lower than along straight walls: measured 1.4 to 1.9 between 16 and 128 cells.
        rates: Rates { velocity: 1.4, rotation: None, pressure: None },
    }
}

/// A fluid of viscosity one.
const FLUID: &str = "[materials.fluid]\nshear_viscosity = 1\n[[regions]]\nmaterial = \"fluid\"\n";

/// Scene of a unit box with a fluid and the given conditions on all its sides.
fn open_box(name: &str, fluid: &str, conditions: &[(&str, String)]) -> String {
    let conditions: Vec<String> =
        conditions.iter().map(|(key, value)| format!("{key} = \"{value}\"")).collect();
    let conditions = conditions.join(", ");
    let sides = ["left", "right", "bottom", "top"].map(|s| format!("{s} = {{ {conditions} }}\n"));
    format!(
        "schema = 1\nname = \"{name}\"\n[domain]\nx = [0, 1]\ny = [0, 1]\n[time]\nend = 1\n\
         {fluid}[boundaries]\n{}",
        sides.concat()
    )
}

/// Distance from the line through the middle of the box at an angle to the x axis, as an expression.
fn across(degrees: f64) -> String {
    let (s, c) = degrees.to_radians().sin_cos();
    format!("({c:?}*(y - 0.5) - {s:?}*(x - 0.5))")
}

/// A block on one side of a channel at an angle to the x axis, whose wall has the given distance from the
/// middle of the box.
fn bank(name: &str, law: &str, (degrees, distance): (f64, f64)) -> String {
    let (s, c) = degrees.to_radians().sin_cos();
    let corner = |along: f64, across: f64| {
        format!("[{:?}, {:?}]", 0.5 + along * c - across * s, 0.5 + along * s + across * c)
    };
    let far = 3.0 * distance.signum();
    let corners = [(-2.0, distance), (2.0, distance), (2.0, far), (-2.0, far)];
    let corners: Vec<String> = corners.map(|(a, b)| corner(a, b)).into();
    format!("[[blocks]]\nname = \"{name}\"\n{law}\nshape.polygon = [{}]\n", corners.join(", "))
}

/// Flow of a Cosserat fluid along a channel across the mesh, driven by a unit force, without a couple on the
/// walls or, `held`, without rotation on them. Exact velocity and rotation are prescribed on the sides of the
/// box.
pub fn slanted_cosserat(fluid: Fluid, degrees: f64, width: f64, held: bool) -> Case {
    let (s, c) = degrees.to_radians().sin_cos();
    let (h, k) = (0.5 * width, fluid.k());
    let (eta, eta_c) = (fluid.shear, fluid.coupling);
    let end = (k * h).cosh();
    let b = if held { h / (k * h).sinh() } else { 1.0 / (k * end) };
    let [half, lag] = [0.5 / eta, eta_c * b / (eta * (eta + eta_c) * k)];
    let y = across(degrees);
    let speed = format!("({half:?}*({h:?}^2 - {y}^2) - {lag:?}*({end:?} - cosh({k:?}*{y})))");
    let rotation = format!("{half:?}*({y} - {b:?}*sinh({k:?}*{y}))");
    let conditions = [
        ("velocity_x", format!("{c:?}*{speed}")),
        ("velocity_y", format!("{s:?}*{speed}")),
        ("rotation", rotation),
    ];
    let no_slip = if held { "kind = \"no_slip\"\nrotation = 0" } else { "kind = \"no_slip\"" };
    let text = format!(
        "{}[body_force]\nx = {c:?}\ny = {s:?}\n{}{}",
        open_box("slanted_cosserat", &fluid.toml(), &conditions),
        bank("lower", no_slip, (degrees, -h)),
        bank("upper", no_slip, (degrees, h)),
    );
    Case {
        name: "slanted_cosserat".into(),
        title: "flow of a Cosserat fluid along a channel across the mesh",
        source: "closed form, theory of Dufour, Muehlhaus and Moresi",
        scene: SceneSource::new("slanted_cosserat", text),
        exact: Exact {
            velocity: Box::new(move |x, y| {
                let y = c * (y - 0.5) - s * (x - 0.5);
                let u = half * (h * h - y * y) - lag * (end - (k * y).cosh());
                [c * u, s * u, half * (y - b * (k * y).sinh())]
            }),
            pressure: Box::new(|_, _| 0.0),
        },
        rates: Rates { velocity: 2.0, rotation: Some(2.0), pressure: None },
    }
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
        open_box("wedge", FLUID, &[("velocity_x", part(&x)), ("velocity_y", part(&y))]),
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
