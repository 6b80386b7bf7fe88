//! This module resolves `[[regions]]`, the materials that fill the parts of the domain at the
//! start.

use super::materials::{SiMatter, material_index};
use super::outlines;
use super::values::{Result, finite_range, point, positive, ranges};
use crate::plan::{Area, InitialDirector, Region, Warning};
use crate::scene::{self, Scene, SceneError, Scope, Shape};

/// The regions that are filled with materials at the start.
pub(super) fn regions(
    scene: &Scene,
    scope: &Scope,
    domain: [[f64; 2]; 2],
    si: &SiMatter,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<Region>> {
    let mut out = Vec::new();
    for (index, r) in scene.regions.iter().enumerate() {
        let what = format!("regions[{index}]");
        let material =
            material_index(&scene.materials, &r.material, &what, &format!("{what}.material"))?;
        let shape = match &r.shape {
            Shape::Everywhere => Area::Everywhere,
            Shape::Rectangle { x, y } => {
                let [rx, ry] = ranges(x, y, scope)?;
                for (c, (range, q)) in [(rx, x), (ry, y)].into_iter().enumerate() {
                    let tiny = 1e-9 * (domain[c][1] - domain[c][0]);
                    if range[1] < range[0] {
                        return Err(SceneError::at(
                            &q[1],
                            format!("{what} is empty: [{}, {}]", range[0], range[1]),
                            "the second number must not be below the first",
                        ));
                    }
                    if range[0] < domain[c][0] - tiny || range[1] > domain[c][1] + tiny {
                        return Err(SceneError::at(
                            &q[0],
                            format!(
                                "{what}: material `{}` reaches outside the domain: {} = {} to {}",
                                r.material,
                                ["x", "y"][c],
                                range[0],
                                range[1]
                            ),
                            format!("the domain is {} to {}", domain[c][0], domain[c][1]),
                        ));
                    }
                }
                Area::Rectangle { x: rx, y: ry }
            }
            Shape::Circle { centre, radius } => {
                let (c, radius_m) = (point(centre, scope)?, positive(radius, scope, "radius")?);
                for k in 0..2 {
                    if c[k] + radius_m < domain[k][0] || c[k] - radius_m > domain[k][1] {
                        return Err(SceneError::at(
                            &centre[k],
                            format!("{what}: the circle lies outside the domain"),
                            "move its centre",
                        ));
                    }
                }
                Area::Circle { centre: c, radius: radius_m }
            }
            Shape::Polygon(corners) => {
                let outline = outlines::polygon(corners, &format!("{what}.shape"), scope)?;
                outlines::touches(&outline, domain, &corners[0][0], &what)?;
                Area::Polygon(outline)
            }
            Shape::Where(f) => {
                let compiled = f.compile(scope)?;
                finite_range(f, &compiled, domain, "this shape")?;
                Area::Where(compiled)
            }
        };
        let layered = si.materials[material as usize].layer_viscosity.is_some();
        let director = match &r.director {
            Some(_) if !layered => {
                warnings.push(Warning::DirectorUnused { material: r.material.clone() });
                None
            }
            Some(scene::Director::AngleDegrees(f)) => {
                let compiled = f.compile(scope)?;
                finite_range(f, &compiled, domain, "the director's angle")?;
                Some(InitialDirector::Angle(compiled))
            }
            Some(scene::Director::Random) => Some(InitialDirector::Random),
            None if layered => {
                return Err(SceneError::of_key(
                    &what,
                    format!("{what}: the layered material `{}` has no directors", r.material),
                    "give director = \"random\" or director = { angle_degrees = 90 }",
                ));
            }
            None => None,
        };
        out.push(Region { material, shape, director });
    }
    Ok(out)
}

/// The scene without the regions below a later one with the shape `everywhere`, and without
/// materials that then fill no part of the domain, enter nowhere and are measured by no
/// gauge, so that no effect is solved for absent materials.
pub(super) fn placed(scene: &Scene) -> Scene {
    let mut s = scene.clone();
    let everywhere = s.regions.iter().rposition(|r| matches!(r.shape, Shape::Everywhere));
    s.regions.drain(..everywhere.unwrap_or(0));
    let (regions, gauges) = (&s.regions, &s.gauges);
    let (sides, sources) = (s.boundaries.sides(), &s.sources);
    let enters = |name: &str| {
        sides.iter().flat_map(|b| b.all_given()).any(|g| g.inflow == Some(name))
            || sources.iter().any(|s| s.material == name)
    };
    s.materials.retain(|name, m| {
        m.background && everywhere.is_none()
            || enters(name)
            || regions.iter().any(|r| r.material == *name)
            || gauges.iter().any(|g| g.material.as_ref() == Some(name))
    });
    s
}
