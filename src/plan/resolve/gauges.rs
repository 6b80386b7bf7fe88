//! This module resolves `[[gauges]]` and checks `[interest]`, which may name a gauge.

use super::materials::material_index;
use super::values::Result;
use super::walls::line;
use crate::plan::{Gauge, Units};
use crate::scene::{self, Direction, Interesting, Moment, Scene, SceneError, Scope, closest};
use crate::space::mesh::Mesh;
use crate::space::segment::Line;

/// A gauge in SI coordinates.
pub(super) struct SiGauge {
    pub(super) name: String,
    pub(super) line: Line,
    direction: Direction,
    material: u8,
}

impl SiGauge {
    /// The gauge in the plan's units, moved to the nearest mesh lines if it is along them.
    pub(super) fn scaled(self, mesh: &Mesh, units: &Units) -> Gauge {
        Gauge {
            name: self.name,
            line: self.line.on_mesh(mesh, units.length),
            sign: along(self.direction, &self.line).signum(),
            material: self.material,
        }
    }
}

/// Component of the normal of a line along a direction.
fn along(direction: Direction, line: &Line) -> f64 {
    let [x, y] = line.normal();
    match direction {
        Direction::Right => x,
        Direction::Left => -x,
        Direction::Up => y,
        Direction::Down => -y,
    }
}

/// Name of a gauge of a force, and what carries the force.
pub(in crate::plan) type Wanted = (String, String);

/// The gauges of a scene: those of flows, and those of forces with what carries them; `supports` are the
/// names of all that may.
pub(super) fn gauges(
    scene: &Scene,
    scope: &Scope,
    domain: [[f64; 2]; 2],
    supports: &[String],
) -> Result<(Vec<SiGauge>, Vec<Wanted>)> {
    let (mut flows, mut forces) = (Vec::new(), Vec::new());
    for (k, g) in scene.gauges.iter().enumerate() {
        let what = format!("gauge `{}`", g.name);
        if scene.gauges[..k].iter().any(|o| o.name == g.name) {
            return Err(SceneError::of_key(
                format!("gauges[{k}].name"),
                format!("two gauges are named `{}`", g.name),
                "rename one",
            ));
        }
        match &g.on {
            Some(on) => forces.push((g.name.clone(), force(g, k, on, supports)?)),
            None => flows.push(flow(scene, scope, domain, (g, k), &what)?),
        }
    }
    Ok((flows, forces))
}

/// A gauge of the flow across a segment.
fn flow(
    scene: &Scene,
    scope: &Scope,
    domain: [[f64; 2]; 2],
    (g, k): (&scene::Gauge, usize),
    what: &str,
) -> Result<SiGauge> {
    let missing = |key: &str| {
        SceneError::of_key(
            format!("gauges[{k}]"),
            format!("key `{key}` is missing in {what}"),
            format!("add `{key} = ...`, or measure the force on a wall with `on = ...`"),
        )
    };
    let from = g.from.as_ref().ok_or_else(|| missing("from"))?;
    let to = g.to.as_ref().ok_or_else(|| missing("to"))?;
    let direction = g.direction.ok_or_else(|| missing("direction"))?;
    let name = g.material.as_ref().ok_or_else(|| missing("material"))?;
    let line = line(what, from, to, scope, domain)?;
    if along(direction, &line) == 0.0 {
        return Err(SceneError::of_key(
            format!("gauges[{k}].direction"),
            format!("{what}: its direction runs along the gauge"),
            "a horizontal gauge counts `up` or `down`, a vertical one `left` or `right`, a slanted one \
             any of these",
        ));
    }
    let material = material_index(&scene.materials, name, what, &format!("gauges[{k}].material"))?;
    Ok(SiGauge { name: g.name.clone(), line, direction, material })
}

/// What carries the force of a gauge.
fn force(g: &scene::Gauge, k: usize, on: &str, supports: &[String]) -> Result<String> {
    let excluded = [
        ("from", g.from.is_some()),
        ("to", g.to.is_some()),
        ("direction", g.direction.is_some()),
        ("material", g.material.is_some()),
    ];
    if let Some((key, _)) = excluded.into_iter().find(|(_, given)| *given) {
        return Err(SceneError::of_key(
            format!("gauges[{k}].{key}"),
            format!("gauge `{}` has both `on` and `{key}`", g.name),
            "`on` measures the force of all materials: remove one of the two",
        ));
    }
    match supports.iter().filter(|name| *name == on).count() {
        0 => {
            let help = closest(on, supports.iter().map(String::as_str))
                .map_or(String::new(), |name| format!("did you mean `{name}`? "));
            Err(SceneError::of_key(
                format!("gauges[{k}].on"),
                format!("gauge `{}`: there is no side, wall or block `{on}`", g.name),
                format!("{help}choices: {}", supports.join(", ")),
            ))
        }
        1 => Ok(on.to_string()),
        _ => Err(SceneError::of_key(
            format!("gauges[{k}].on"),
            format!("gauge `{}`: several sides, walls or blocks are named `{on}`", g.name),
            "rename walls and blocks: left, right, bottom and top are the sides",
        )),
    }
}

/// Checks that the scene has the quantity named in `[interest]`.
pub(super) fn interest(scene: &Scene) -> Result<()> {
    let Some(i) = &scene.interest else { return Ok(()) };
    let fault = |what: String, help: &str| {
        Err(SceneError::of_key("interest", format!("interest: {what}"), help))
    };
    if let Interesting::Gauge(name) | Interesting::Rate(name) = &i.quantity
        && !scene.gauges.iter().any(|g| g.name == *name && g.on.is_none())
    {
        let flows = scene.gauges.iter().filter(|g| g.on.is_none());
        let names: Vec<&str> = flows.map(|g| g.name.as_str()).collect();
        let meant = closest(name, names.iter().copied());
        let help = match meant {
            Some(meant) => format!("did you mean `{meant}`?"),
            None => format!("gauges of this scene: {}", names.join(", ")),
        };
        return fault(format!("there is no gauge `{name}`"), &help);
    }
    let field =
        matches!(i.quantity, Interesting::Velocity | Interesting::Rotation | Interesting::Pressure);
    if field && i.at == Moment::Peak {
        return fault("a field has no peak".into(), "give at = \"start\" or at = \"end\"");
    }
    if i.quantity == Interesting::Alignment
        && !scene.materials.values().any(|m| m.layer_viscosity.is_some())
    {
        return fault(
            "nothing has directors whose alignment could be read".into(),
            "give a material a layer_viscosity, or be interested in something else",
        );
    }
    Ok(())
}
