//! This module resolves the flow curve of a generalised fluid: friction or a yield stress, with the
//! bounds of its viscosity.

use super::values::{Result, not_negative, point, positive, ranges};
use crate::laws::flow_curve::{FlowCurve, Friction, Strength};
use crate::laws::granular::Viscosities;
use crate::plan::Units;
use crate::scene::{self, Quantity, Scene, SceneError, Scope, Shape};

/// Default of `largest_viscosity` in units of `rho sqrt(g H^3)` or of the consistency.
const LARGEST: f64 = 1e4;
/// Default of `smallest_viscosity` in units of the largest, without a background.
const SMALLEST: f64 = 1e-8;
/// Viscosity of grains in the first iterate, in units of `rho sqrt(g H^3)`.
const NOMINAL: f64 = 0.1;

/// Values of a scene that determine the default bounds of a viscosity, SI.
pub(super) struct Surroundings {
    gravity: f64,
    /// Viscosity of the background.
    background: Option<f64>,
    domain: [[f64; 2]; 2],
    /// Axis that is closest to the direction of gravity.
    vertical: usize,
}

/// A generalised fluid, SI.
pub(super) struct Generalised {
    pub(super) curve: FlowCurve,
    /// Viscosity where no flow is known, Pa s.
    pub(super) nominal: f64,
    /// Coupling viscosity over shear viscosity.
    pub(super) coupling_ratio: f64,
    /// Viscosity of shear along the layers over shear viscosity, if it is given.
    pub(super) layer_ratio: Option<f64>,
}

impl Surroundings {
    pub(super) fn new(scene: &Scene, scope: &Scope, gravity: [f64; 2]) -> Result<Self> {
        let domain = ranges(&scene.domain.x, &scene.domain.y, scope)?;
        let around = scene.materials.values().find(|m| m.background);
        let background = around.filter(|_| scene.background.is_none());
        let background = match background.and_then(|m| m.shear_viscosity.as_ref()) {
            Some(q) => q.compile(scope)?.constant().filter(|&v| v > 0.0),
            None => None,
        };
        let vertical = usize::from(gravity[1].abs() >= gravity[0].abs());
        Ok(Surroundings { gravity: gravity[0].hypot(gravity[1]), background, domain, vertical })
    }

    /// Height of the regions of a material along gravity.
    fn height(&self, scene: &Scene, scope: &Scope, name: &str) -> Result<f64> {
        let [bottom, top] = self.domain[self.vertical];
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for r in scene.regions.iter().filter(|r| r.material == name) {
            let [low, high] = match &r.shape {
                Shape::Everywhere | Shape::Where(_) => [bottom, top],
                Shape::Rectangle { x, y } => ranges(x, y, scope)?[self.vertical],
                Shape::Circle { centre, radius } => {
                    let (c, r) = (point(centre, scope)?[self.vertical], radius.eval(scope)?);
                    [c - r, c + r]
                }
                Shape::Polygon(corners) => {
                    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
                    for corner in corners {
                        let c = point(corner, scope)?[self.vertical];
                        range = [range[0].min(c), range[1].max(c)];
                    }
                    range
                }
            };
            range = [range[0].min(low.max(bottom)), range[1].max(high.min(top))];
        }
        Ok(if range[1] > range[0] { range[1] - range[0] } else { top - bottom })
    }
}

/// Whether a key that only generalised fluids have is given.
fn is_generalised(m: &scene::Material) -> bool {
    m.friction.is_some() || m.yield_stress.is_some() || m.flow_index.is_some()
}

/// The flow curve of a material with friction, a yield stress or a flow index; `None` for other
/// materials. `density`: its largest density, kg/m3; `contacts`: viscosities of a granular closure.
pub(super) fn generalised(
    (name, m): (&str, &scene::Material),
    (scene, scope): (&Scene, &Scope),
    around: &Surroundings,
    density: f64,
    contacts: Option<Viscosities>,
) -> Result<Option<Generalised>> {
    check_keys(name, m)?;
    if !is_generalised(m) {
        return Ok(None);
    }
    let fall = density * (around.gravity * around.height(scene, scope, name)?.powi(3)).sqrt();
    let (strength, nominal, by_consistency) = match &m.friction {
        Some(f) => (Strength::Friction(friction(name, m, f, scope, density)?), NOMINAL * fall, 0.0),
        None => {
            let (strength, consistency) = herschel_bulkley(name, m, scope)?;
            (strength, consistency, LARGEST * consistency)
        }
    };
    let largest = match &m.largest_viscosity {
        Some(q) => positive(q, scope, "largest_viscosity")?,
        None if fall.max(by_consistency) > 0.0 => (LARGEST * fall).max(by_consistency),
        None => {
            return Err(SceneError::of_key(
                format!("materials.{name}.friction"),
                format!("material `{name}`: largest_viscosity has no default without weight"),
                "give largest_viscosity = <Pa s>, the viscosity of grains at rest",
            ));
        }
    };
    let smallest = match &m.smallest_viscosity {
        Some(q) => positive(q, scope, "smallest_viscosity")?,
        None => around.background.unwrap_or(SMALLEST * largest).min(largest),
    };
    if smallest > largest {
        let place = m.smallest_viscosity.as_ref().or(m.largest_viscosity.as_ref());
        let message = format!(
            "material `{name}`: smallest_viscosity {smallest} is above largest_viscosity {largest}"
        );
        let remedy = "the viscosity of a generalised fluid lies between the two";
        return Err(place.map_or_else(
            || SceneError::of_key(format!("materials.{name}"), &message, remedy),
            |q| SceneError::at(q, &message, remedy),
        ));
    }
    let coupling_ratio = match (&m.coupling_ratio, contacts, &m.internal_length) {
        (Some(q), ..) => not_negative(q, scope, "coupling_ratio")?,
        (None, Some(c), Some(_)) => c.coupling / c.shear,
        (None, None, Some(_)) => 1.0,
        (None, _, None) => 0.0,
    };
    let ratio = |q: &Quantity| positive(q, scope, "layer_ratio");
    let nominal = if nominal > 0.0 { nominal } else { (smallest * largest).sqrt() };
    Ok(Some(Generalised {
        curve: FlowCurve { strength, smallest, largest },
        nominal: nominal.clamp(smallest, largest),
        coupling_ratio,
        layer_ratio: m.layer_ratio.as_ref().map(ratio).transpose()?,
    }))
}

/// Refuses keys that exclude each other or lack another one.
fn check_keys(name: &str, m: &scene::Material) -> Result<()> {
    let error = |q: &Quantity, what: &str, remedy: &str| {
        Err(SceneError::at(q, format!("material `{name}` has {what}"), remedy))
    };
    let generalised = is_generalised(m);
    if m.coupling_ratio.is_some() || generalised {
        for (key, q) in [
            ("coupling_viscosity", &m.coupling_viscosity),
            ("couple_viscosity", &m.couple_viscosity),
        ] {
            if let Some(q) = q {
                let with = if generalised { "a flow curve" } else { "coupling_ratio" };
                return error(
                    q,
                    &format!("both {key} and {with}"),
                    "give coupling_ratio = eta_c/eta and internal_length: both viscosities of the \
                     rotation then follow the shear viscosity",
                );
            }
        }
    }
    if generalised && let Some(q) = &m.layer_viscosity {
        return error(
            q,
            "both layer_viscosity and a flow curve",
            "give layer_ratio, the viscosity along the layers over the shear viscosity",
        );
    }
    if !generalised && let Some(q) = &m.layer_ratio {
        return error(q, "layer_ratio but no flow curve", "give layer_viscosity = <Pa s> instead");
    }
    if m.background && generalised {
        return Err(SceneError::of_key(
            format!("materials.{name}"),
            format!("the background `{name}` has a flow curve"),
            "a background has a constant viscosity: remove friction, yield_stress and flow_index, \
             or set background = false",
        ));
    }
    let Some(friction) = &m.friction else {
        for (key, q) in [
            ("cohesion", &m.cohesion),
            ("largest_viscosity", &m.largest_viscosity),
            ("smallest_viscosity", &m.smallest_viscosity),
        ] {
            if let Some(q) = q
                && (key == "cohesion" || !generalised)
            {
                const FRICTION: &str =
                    "give friction = { static, dynamic, inertial_number, grain_diameter }";
                let (lacks, other) = match key {
                    "cohesion" => ("friction", ""),
                    _ => ("friction or yield_stress", ", or yield_stress = <Pa>"),
                };
                return error(
                    q,
                    &format!("{key} but no {lacks}"),
                    &format!("{FRICTION}{other}, or remove the key"),
                );
            }
        }
        return Ok(());
    };
    for (key, q) in [("yield_stress", &m.yield_stress), ("flow_index", &m.flow_index)] {
        if let Some(q) = q {
            return error(
                q,
                &format!("both friction and {key}"),
                "grains yield by friction and cohesion; give one of the two laws",
            );
        }
    }
    if m.shear_viscosity.is_some() {
        return error(
            &friction.at_rest,
            "both friction and shear_viscosity",
            "the viscosity of grains follows from friction; give one of the two",
        );
    }
    Ok(())
}

/// Friction of a material.
fn friction(
    name: &str,
    m: &scene::Material,
    f: &scene::Friction,
    scope: &Scope,
    density: f64,
) -> Result<Friction> {
    let at_rest = not_negative(&f.at_rest, scope, "friction.static")?;
    let fast = match &f.dynamic {
        Some(q) => not_negative(q, scope, "friction.dynamic")?,
        None => at_rest,
    };
    if fast < at_rest {
        let q = f.dynamic.as_ref().unwrap_or(&f.at_rest);
        return Err(SceneError::at(
            q,
            format!(
                "material `{name}`: friction.dynamic {fast} is below friction.static {at_rest}"
            ),
            "friction rises with the inertial number; a falling law is not solved",
        ));
    }
    let grain_density = match &f.grain_density {
        Some(q) => positive(q, scope, "friction.grain_density")?,
        None => density,
    };
    Ok(Friction {
        at_rest,
        fast,
        inertial_number: positive(&f.inertial_number, scope, "friction.inertial_number")?,
        diameter: not_negative(&f.grain_diameter, scope, "friction.grain_diameter")?,
        grain_density,
        cohesion: match &m.cohesion {
            Some(q) => not_negative(q, scope, "cohesion")?,
            None => 0.0,
        },
    })
}

/// Yield stress, consistency and flow index of a material; and the consistency.
fn herschel_bulkley(name: &str, m: &scene::Material, scope: &Scope) -> Result<(Strength, f64)> {
    let Some(q) = &m.shear_viscosity else {
        return Err(SceneError::of_key(
            format!("materials.{name}"),
            format!("material `{name}` has a yield stress or a flow index, but no shear_viscosity"),
            "give shear_viscosity = <Pa s^n>, the consistency K of tau = tau_y + K g^n",
        ));
    };
    let consistency = match q.compile(scope)?.constant() {
        Some(k) if k > 0.0 && k.is_finite() => k,
        found => {
            let what = found.map_or("not a constant".to_string(), |k| k.to_string());
            return Err(SceneError::at(
                q,
                format!("material `{name}`: shear_viscosity is {what}"),
                "with yield_stress or flow_index it is the consistency: a number above zero",
            ));
        }
    };
    let yield_stress = match &m.yield_stress {
        Some(q) => not_negative(q, scope, "yield_stress")?,
        None => 0.0,
    };
    let index = match &m.flow_index {
        Some(q) => positive(q, scope, "flow_index")?,
        None => 1.0,
    };
    if let Some(q) = &m.flow_index
        && !(0.05..=5.0).contains(&index)
    {
        return Err(SceneError::at(
            q,
            format!("material `{name}`: flow_index is {index}"),
            "give 0.05 to 5; 1 is a Bingham fluid, below 1 it thins with the rate",
        ));
    }
    Ok((Strength::HerschelBulkley { yield_stress, consistency, index }, consistency))
}

/// The flow curve in the units of a plan.
pub(super) fn scaled(curve: &FlowCurve, u: &Units) -> FlowCurve {
    let strength = match curve.strength {
        Strength::HerschelBulkley { yield_stress, consistency, index } => {
            Strength::HerschelBulkley {
                yield_stress: yield_stress / u.stress(),
                consistency: consistency / (u.stress() * u.time.powf(index)),
                index,
            }
        }
        Strength::Friction(f) => Strength::Friction(Friction {
            diameter: f.diameter / u.length,
            grain_density: f.grain_density / u.inertial_density(),
            cohesion: f.cohesion / u.stress(),
            ..f
        }),
    };
    let [smallest, largest] = [curve.smallest, curve.largest].map(|v| v / u.viscosity);
    FlowCurve { strength, smallest, largest }
}
