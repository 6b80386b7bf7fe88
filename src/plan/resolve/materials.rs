//! This module resolves the `[materials]` tables and gravity into checked values in SI units.

use super::flow_curves::{self, Generalised, Surroundings, generalised};
use super::rotation::{micro_inertia, rotation};
use super::values::{Result, finite_range, not_negative, positive, ranges};
use crate::laws::cosserat::Cosserat;
use crate::laws::flow_curve::FlowCurve;
use crate::laws::{Law, Shear, granular};
use crate::plan::material::Material;
use crate::plan::{MAX_MATERIALS, Matter, Units, Warning};
use crate::scene::{self, FieldFn, Scene, SceneError, Scope, closest};
use indexmap::IndexMap;

/// Smallest ratio of viscosities that causes a warning about drops in a thin fluid. At a ratio of
/// 1e5 the steps of the silo were a tenth of the usual.
const THIN: f64 = 1e5;

/// Warns of a dense material together with a lighter one that is far less viscous; of several
/// pairs, the one with the largest ratio of viscosities.
pub(super) fn thin_fluid(materials: &[SiMaterial]) -> Option<Warning> {
    let pairs = materials.iter().flat_map(|a| materials.iter().map(move |b| (a, b)));
    let ratio = |a: &SiMaterial, b: &SiMaterial| a.viscosity / b.viscosity;
    pairs
        .filter(|(a, b)| a.density > b.density && ratio(a, b) >= THIN)
        .max_by(|(a, b), (c, d)| ratio(a, b).total_cmp(&ratio(c, d)))
        .map(|(a, b)| Warning::ThinFluid {
            dense: a.name.clone(),
            thin: b.name.clone(),
            ratio: ratio(a, b),
        })
}

/// Materials and gravity in SI units, checked.
pub(super) struct SiMatter {
    pub(super) materials: Vec<SiMaterial>,
    pub(super) gravity: [f64; 2],
    pub(super) warnings: Vec<Warning>,
}

pub(super) struct SiMaterial {
    pub(super) name: String,
    pub(super) viscosity: f64,
    pub(super) viscosity_field: Option<FieldFn>,
    pub(super) density: f64,
    pub(super) density_field: Option<FieldFn>,
    pub(super) compliance: f64,
    /// Viscosities of the rotation; relative to the shear viscosity if there is a flow curve.
    pub(super) rotation: Option<Cosserat>,
    pub(super) micro_inertia: f64,
    /// Viscosity of shear along the layers; relative to the shear viscosity if there is a flow curve.
    pub(super) layer_viscosity: Option<f64>,
    pub(super) curve: Option<FlowCurve>,
    pub(super) background: bool,
}

impl SiMatter {
    pub(super) fn new(scene: &Scene, scope: &Scope) -> Result<SiMatter> {
        let gravity = [scene.gravity[0].eval(scope)?, scene.gravity[1].eval(scope)?];
        let [x, y] = ranges(&scene.domain.x, &scene.domain.y, scope)?;
        if scene.materials.is_empty() || scene.materials.len() > MAX_MATERIALS {
            return Err(SceneError::of_key(
                "materials",
                format!("the scene has {} materials", scene.materials.len()),
                format!("give 1 to {MAX_MATERIALS} [materials.<name>] tables"),
            ));
        }
        let mut warnings = Vec::new();
        let mut materials = Vec::new();
        let mut errors = Vec::new();
        let around = Surroundings::new(scene, scope, gravity)?;
        for (name, m) in &scene.materials {
            match SiMaterial::new((name, m), (scene, scope), &around, [x, y], &mut warnings) {
                Ok(m) => materials.push(m),
                Err(e) => errors.push(e),
            }
        }
        SceneError::join(errors)?;
        if scene.background.is_some() {
            empty(&mut materials);
        }
        let backgrounds: Vec<_> =
            materials.iter().filter(|m| m.background).map(|m| m.name.as_str()).collect();
        if backgrounds.len() > 1 {
            return Err(SceneError::of_key(
                format!("materials.{}.background", backgrounds[1]),
                format!("more than one background material: {}", backgrounds.join(", ")),
                "set `background = true` on one of them only",
            ));
        }
        Ok(SiMatter { materials, gravity, warnings })
    }

    pub(super) fn matter(&self, u: &Units) -> Matter {
        let materials = self
            .materials
            .iter()
            .map(|m| {
                // With a flow curve, the viscosities of the law are relative.
                let viscosity = if m.curve.is_some() { 1.0 } else { u.viscosity };
                Material {
                    name: m.name.clone(),
                    viscosity: m.viscosity / u.viscosity,
                    carries_viscosity: m.viscosity_field.is_some(),
                    density: m.density / u.density,
                    carries_density: m.density_field.is_some(),
                    micro_inertia: m.micro_inertia / (u.length * u.length),
                    law: Law {
                        shear: m.layer_viscosity.map_or(Shear::Newtonian, |v| Shear::Layered {
                            layer_viscosity: v / viscosity,
                        }),
                        rotation: m.rotation.map(|r| Cosserat {
                            coupling: r.coupling / viscosity,
                            couple: r.couple / (viscosity * u.length * u.length),
                            layer_couple: r.layer_couple / (viscosity * u.length * u.length),
                        }),
                        compliance: m.compliance * u.viscosity,
                        curve: m.curve.map(|c| flow_curves::scaled(&c, u)),
                    },
                    background: m.background,
                }
            })
            .collect();
        let gravity = self.gravity.map(|g| g / u.acceleration());
        Matter { materials, gravity, relaxation: None }
    }
}

impl SiMaterial {
    fn new(
        (name, m): (&str, &scene::Material),
        (scene, scope): (&Scene, &Scope),
        around: &Surroundings,
        domain: [[f64; 2]; 2],
        warnings: &mut Vec<Warning>,
    ) -> Result<SiMaterial> {
        let density = m.density.compile(scope)?;
        let density_range = finite_range(&m.density, &density, domain, "density")?;
        if density.constant().is_some_and(|d| d < 0.0) {
            return Err(SceneError::at(
                &m.density,
                format!("material `{name}`: density is {}", density_range[0]),
                "density must be zero or more",
            ));
        }
        let contacts = m
            .granular
            .as_ref()
            .map(|g| -> Result<_> {
                let porosity = g.porosity.eval(scope)?;
                if !(0.0..1.0).contains(&porosity) {
                    return Err(SceneError::at(
                        &g.porosity,
                        format!("porosity is {porosity}"),
                        "porosity is the void share: 0 or more, below 1",
                    ));
                }
                Ok(granular::viscosities(&granular::Contacts {
                    porosity,
                    coordination: positive(&g.coordination, scope, "coordination")?,
                    normal_dashpot: positive(&g.normal_dashpot, scope, "normal_dashpot")?,
                    tangential_dashpot: not_negative(
                        &g.tangential_dashpot,
                        scope,
                        "tangential_dashpot",
                    )?,
                }))
            })
            .transpose()?;
        let most = density_range[1].max(0.0);
        let curve = generalised((name, m), (scene, scope), around, most, contacts)?;
        let (shear, range) = match (&m.shear_viscosity, contacts) {
            _ if let Some(g) = &curve => (FieldFn::Constant(g.nominal), [g.nominal; 2]),
            (Some(q), None) => {
                let f = q.compile(scope)?;
                let range = finite_range(q, &f, domain, "shear_viscosity")?;
                if range[0] <= 0.0 {
                    return Err(SceneError::at(
                        q,
                        format!("material `{name}`: shear_viscosity is {}", range[0]),
                        "shear_viscosity must be above zero everywhere",
                    ));
                }
                (f, range)
            }
            (None, Some(c)) => (FieldFn::Constant(c.shear), [c.shear; 2]),
            (Some(q), Some(_)) => {
                return Err(SceneError::at(
                    q,
                    format!("material `{name}` has both shear_viscosity and granular"),
                    "give one of them",
                ));
            }
            (None, None) => {
                return Err(SceneError::of_key(
                    format!("materials.{name}"),
                    format!("material `{name}` has no viscosity"),
                    "give shear_viscosity = <Pa s>, or a friction or granular table",
                ));
            }
        };
        let coupling = match (&m.coupling_viscosity, contacts) {
            _ if let Some(g) = &curve => g.coupling_ratio,
            _ if let Some(q) = &m.coupling_ratio => {
                let Some(eta) = shear.constant() else {
                    return Err(SceneError::at(
                        q,
                        format!("material `{name}`: shear_viscosity is not a constant"),
                        "coupling_ratio needs a constant viscosity; give coupling_viscosity",
                    ));
                };
                not_negative(q, scope, "coupling_ratio")? * eta
            }
            (Some(q), _) => not_negative(q, scope, "coupling_viscosity")?,
            (None, Some(c)) => c.coupling,
            (None, None) => 0.0,
        };
        let rotation = rotation((name, m), scope, coupling, warnings)?;
        let micro_inertia = micro_inertia((name, m), (scene, scope), rotation.is_some())?;
        let bends = rotation.is_some_and(|r| r.bending() != 0.0);
        let bulk = match (&m.bulk_viscosity, contacts, &m.granular) {
            (Some(q), ..) => Some(positive(q, scope, "bulk_viscosity")?),
            (None, Some(c), Some(g)) if !g.incompressible => Some(c.bulk),
            _ => None,
        };
        let layer = m
            .layer_viscosity
            .as_ref()
            .map(|q| positive(q, scope, "layer_viscosity"))
            .transpose()?
            .filter(|&eta_s| bends || shear.constant() != Some(eta_s));
        let layer_ratio = |g: &Generalised| g.layer_ratio.filter(|&r| bends || r != 1.0);
        let layer = curve.as_ref().map_or(layer, layer_ratio);
        if let Some(eta_s) = layer
            && eta_s > if curve.is_some() { 1.0 } else { range[0] }
        {
            warnings.push(Warning::StiffLayers { material: name.into(), ratio: eta_s / range[0] });
        }
        let varying = |f: FieldFn| f.constant().is_none().then_some(f);
        // A particle whose volume changes keeps its mass, so it carries its own density.
        let density_field = if bulk.is_some() && density_range != [0.0; 2] {
            Some(density)
        } else {
            varying(density)
        };
        let out = SiMaterial {
            name: name.into(),
            viscosity: range[1],
            density: density_range[1].max(0.0),
            viscosity_field: varying(shear),
            density_field,
            compliance: bulk.map_or(0.0, |b| 1.0 / b),
            rotation,
            micro_inertia,
            layer_viscosity: layer,
            curve: curve.map(|g: Generalised| g.curve),
            background: m.background,
        };
        if out.background
            && (out.viscosity_field.is_some()
                || out.density_field.is_some()
                || out.layer_viscosity.is_some()
                || out.rotation.is_some()
                || out.compliance > 0.0)
        {
            return Err(SceneError::of_key(
                format!("materials.{name}"),
                format!("the background `{name}` carries a history"),
                "a background has no history: constant density and viscosity, incompressible, no \
                 layers, no internal length; else set background = false",
            ));
        }
        Ok(out)
    }
}

/// Gives the material that stands for a void the properties of nothing; its viscosity, which nothing uses, is
/// the largest of the others.
fn empty(materials: &mut [SiMaterial]) {
    let others = materials.iter().filter(|m| !m.background).map(|m| m.viscosity);
    let viscosity = others.fold(0.0, f64::max);
    for m in materials.iter_mut().filter(|m| m.background) {
        *m = SiMaterial {
            name: std::mem::take(&mut m.name),
            viscosity: if viscosity > 0.0 { viscosity } else { 1.0 },
            viscosity_field: None,
            density: 0.0,
            density_field: None,
            compliance: 0.0,
            rotation: None,
            micro_inertia: 0.0,
            layer_viscosity: None,
            curve: None,
            background: true,
        };
    }
}

pub(super) fn material_index<'a>(
    materials: &'a IndexMap<String, scene::Material>,
    name: &str,
    user: &str,
    key: &str,
) -> Result<u8> {
    materials.get_index_of(name).map(|i| i as u8).ok_or_else(|| {
        let known: Vec<&'a str> = materials.keys().map(String::as_str).collect();
        let guess = closest(name, known.iter().copied())
            .map_or(String::new(), |g| format!("did you mean `{g}`? "));
        SceneError::of_key(
            key,
            format!("{user} names the material `{name}`, which does not exist"),
            format!("{guess}materials: {}", known.join(", ")),
        )
    })
}
