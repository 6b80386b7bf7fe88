//! This module resolves `[[gauges]]` and checks `[interest]`, which may name a gauge.

use super::materials::material_index;
use super::values::Result;
use super::walls::axis_segment;
use crate::plan::{Gauge, Units};
use crate::scene::{Direction, Interesting, Moment, Scene, SceneError, Scope, closest};
use crate::space::mesh::Mesh;
use crate::space::segment::Segment;

/// A gauge in SI coordinates.
pub(super) struct SiGauge {
    pub(super) name: String,
    pub(super) segment: Segment,
    direction: Direction,
    material: u8,
}

impl SiGauge {
    /// The gauge in the plan's units, moved to the nearest mesh lines.
    pub(super) fn scaled(self, mesh: &Mesh, units: &Units) -> Gauge {
        Gauge {
            name: self.name,
            segment: self.segment.on_mesh(mesh, units.length),
            sign: match self.direction {
                Direction::Right | Direction::Up => 1.0,
                Direction::Left | Direction::Down => -1.0,
            },
            material: self.material,
        }
    }
}

pub(super) fn gauges(scene: &Scene, scope: &Scope, domain: [[f64; 2]; 2]) -> Result<Vec<SiGauge>> {
    let mut list: Vec<SiGauge> = Vec::new();
    for (k, g) in scene.gauges.iter().enumerate() {
        let what = format!("gauge `{}`", g.name);
        let segment = axis_segment(&what, &g.from, &g.to, scope, domain)?;
        let wanted = usize::from(matches!(g.direction, Direction::Up | Direction::Down));
        if segment.normal != wanted {
            return Err(SceneError::at(
                &g.from[0],
                format!("{what}: its direction runs along the segment"),
                "a horizontal gauge counts `up` or `down`, a vertical one `left` or `right`",
            ));
        }
        if list.iter().any(|o| o.name == g.name) {
            return Err(SceneError::of_key(
                format!("gauges[{k}].name"),
                format!("two gauges are named `{}`", g.name),
                "rename one",
            ));
        }
        let material =
            material_index(&scene.materials, &g.material, &what, &format!("gauges[{k}].material"))?;
        list.push(SiGauge { name: g.name.clone(), segment, direction: g.direction, material });
    }
    Ok(list)
}

/// Checks that the scene has the quantity named in `[interest]`.
pub(super) fn interest(scene: &Scene) -> Result<()> {
    let Some(i) = &scene.interest else { return Ok(()) };
    let fault = |what: String, help: &str| {
        Err(SceneError::of_key("interest", format!("interest: {what}"), help))
    };
    if let Interesting::Gauge(name) | Interesting::Rate(name) = &i.quantity
        && !scene.gauges.iter().any(|g| g.name == *name)
    {
        let names: Vec<&str> = scene.gauges.iter().map(|g| g.name.as_str()).collect();
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
