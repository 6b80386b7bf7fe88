//! This module resolves `[pressure_reference]`, which determines the pressure of a closed scene.
//!
//! The pressure of a closed scene is determined only up to a constant. Its mean is zero unless
//! friction, of grains or at walls, for which the zero of the pressure matters, or the scene gives it at a
//! point.

use super::values::{Result, point};
use crate::plan::{BoundaryPlan, Region, Units};
use crate::scene::{Scene, SceneError, Scope};
use crate::space::constraints::PressurePoint;
use crate::space::mesh::Mesh;

/// The point at which the pressure is given; `None` if the boundaries determine the pressure, or
/// if its mean is to be zero.
pub(super) fn reference(
    scene: &Scene,
    scope: &Scope,
    (mesh, units): (&Mesh, &Units),
    (boundary, regions): (&BoundaryPlan, &[Region]),
) -> Result<Option<PressurePoint>> {
    if let Some(given) = &scene.pressure_reference {
        let (at, value) = (point(&given.at, scope)?, given.value.eval(scope)?);
        if !boundary.closed {
            return Err(SceneError::at(
                &given.at[0],
                "pressure_reference is given, but the boundaries determine the pressure",
                "remove it: a side is open, or a bulk_viscosity is finite",
            ));
        }
        let at = at.map(|c| c / units.length);
        let inside =
            [&mesh.x, &mesh.y].iter().zip(at).all(|(axis, c)| c >= axis.start() && c <= axis.end());
        if !inside || mesh.solid[mesh.locate(at)] {
            return Err(SceneError::at(
                &given.at[0],
                "the point of pressure_reference lies outside the material",
                "give a point inside the domain and outside its blocks",
            ));
        }
        return Ok(Some(PressurePoint { at, value: value / units.stress() }));
    }
    if scene.background.is_some() {
        // The surface of the materials determines the pressure.
        return Ok(None);
    }
    let grains = scene.materials.iter().find(|(_, m)| m.friction.is_some());
    let (key, what, whose) = match grains {
        _ if !boundary.closed => return Ok(None),
        Some((name, _)) => {
            (format!("materials.{name}.friction"), format!("`{name}` has"), "its pressure")
        }
        None if boundary.has_wall_friction() => {
            ("boundaries".into(), "a wall has".into(), "the pressure on it")
        }
        None => return Ok(None),
    };
    let Some(at) = highest_background(scene, scope, (mesh, units), regions)? else {
        return Err(SceneError::of_key(
            key,
            format!(
                "{what} friction, but nothing determines {whose}: the domain is closed, and no \
                 background touches the grains"
            ),
            "give [pressure_reference] with at = [x, y] and value = <Pa>, open a side, or give \
             a background",
        ));
    };
    Ok(Some(PressurePoint { at, value: 0.0 }))
}

/// Centre of the highest cell, against gravity, that is background at the start.
fn highest_background(
    scene: &Scene,
    scope: &Scope,
    (mesh, units): (&Mesh, &Units),
    regions: &[Region],
) -> Result<Option<[f64; 2]>> {
    if !scene.materials.values().any(|m| m.background) {
        return Ok(None);
    }
    let g = [scene.gravity[0].eval(scope)?, scene.gravity[1].eval(scope)?];
    let height = |p: [f64; 2]| -(g[0] * p[0] + g[1] * p[1]);
    let free = |p: [f64; 2]| {
        let si = p.map(|c| c * units.length);
        !regions.iter().any(|r| r.shape.contains(si))
    };
    let cells = (0..mesh.cells()).filter(|&c| !mesh.solid[c]).map(|c| mesh.cell_centre(c));
    Ok(cells.filter(|&p| free(p)).fold(None, |best: Option<[f64; 2]>, p| match best {
        Some(b) if height(b) >= height(p) => Some(b),
        _ => Some(p),
    }))
}
