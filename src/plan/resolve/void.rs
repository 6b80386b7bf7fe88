//! This module resolves `background = "void"`: nothing is around the materials.
//!
//! The void is a material without particles. It takes the place of the material with
//! `background = true`, if the scene has one.

use super::values::Result;
use crate::plan::MAX_MATERIALS;
use crate::scene::{Field, Geometry, Material, Quadrature, Quantity, Scene, SceneError};

/// Name of the void where no material has `background = true`.
const NAME: &str = "void";

/// The scene with a material that stands for the void, if there is one.
///
/// # Errors
/// The scene has an effect that is not solved with a void.
pub(super) fn with_void(scene: &Scene) -> Result<Scene> {
    let mut scene = scene.clone();
    if scene.background.is_none() {
        return Ok(scene);
    }
    check(&scene)?;
    if !scene.materials.values().any(|m| m.background) {
        if scene.materials.contains_key(NAME) || scene.materials.len() == MAX_MATERIALS {
            return Err(SceneError::of_key(
                "background",
                "there is no place for the void among the materials",
                format!("rename the material `{NAME}`, or remove one of {MAX_MATERIALS} materials"),
            ));
        }
        scene.materials.insert(NAME.into(), Material::nothing());
    }
    Ok(scene)
}

/// Refuses what is not solved with a void.
fn check(scene: &Scene) -> Result<()> {
    let void = scene.materials.iter().find(|(_, m)| m.background).map(|(name, _)| name);
    let places = scene.regions.iter().enumerate();
    let placed = places.filter(|(_, r)| Some(&r.material) == void).map(|(k, _)| k).next();
    let b = &scene.boundaries;
    let given = || b.sides().into_iter().flat_map(|side| side.all_given());
    let refusals = [
        (
            placed.is_some(),
            format!("regions[{}].material", placed.unwrap_or(0)),
            "a region of the background",
        ),
        (scene.domain.geometry != Geometry::Plane, "domain.geometry".into(), "a round domain"),
        (
            scene.accuracy.quadrature != Quadrature::Sides,
            "accuracy.quadrature".into(),
            "a quadrature other than \"sides\"",
        ),
        (
            scene.pressure_reference.is_some(),
            "pressure_reference".into(),
            "a pressure_reference: the surface of the materials determines the pressure",
        ),
        (scene.body_force.is_some(), "body_force".into(), "a body force per volume"),
        (
            scene.materials.values().any(|m| m.bulk_viscosity.is_some()),
            "materials".into(),
            "a finite bulk_viscosity",
        ),
        (
            given().any(|g| g.traction.iter().any(Option::is_some)),
            "boundaries".into(),
            "a given traction",
        ),
        (
            given().any(|g| g.wall.slip_length.is_some() || g.wall.wall_friction.is_some())
                || scene.walls.iter().any(|w| w.slip_length.is_some() || w.wall_friction.is_some())
                || scene
                    .blocks
                    .iter()
                    .any(|b| b.slip_length.is_some() || b.wall_friction.is_some()),
            "boundaries".into(),
            "slip_length or wall_friction",
        ),
        (
            scene.blocks.iter().any(|b| b.shape.is_some() || b.velocity.is_some())
                || scene.walls.iter().any(|w| w.thickness.is_some()),
            "blocks".into(),
            "solids of any shape",
        ),
    ];
    match refusals.into_iter().find(|(refused, ..)| *refused) {
        Some((_, key, what)) => Err(SceneError::of_key(
            key,
            format!("`background = \"void\"` is not solved with {what} yet"),
            "remove `background = \"void\"` and give a material `background = true`, or remove this",
        )),
        None => Ok(()),
    }
}

impl Material {
    /// A material without properties.
    fn nothing() -> Material {
        Material {
            density: Field::from(Quantity::number(0.0)),
            shear_viscosity: Some(Field::from(Quantity::number(1.0))),
            bulk_viscosity: None,
            coupling_viscosity: None,
            internal_length: None,
            layer_internal_length: None,
            couple_viscosity: None,
            micro_inertia: None,
            layer_viscosity: None,
            coupling_ratio: None,
            layer_ratio: None,
            friction: None,
            cohesion: None,
            yield_stress: None,
            flow_index: None,
            largest_viscosity: None,
            smallest_viscosity: None,
            granular: None,
            background: true,
            colour: None,
        }
    }
}
