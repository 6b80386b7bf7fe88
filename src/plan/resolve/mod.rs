//! This module resolves a scene into a plan. It applies all defaults and checks, with one file per
//! table of the scene.

mod accuracy;
mod axis;
mod corners;
mod drafts;
mod dye;
mod flow_curves;
mod gaps;
mod gauges;
mod inflow;
mod materials;
mod mesh;
mod null_spaces;
mod outlines;
mod posed;
mod pressure;
mod recording;
mod regions;
mod rotation;
mod scales;
mod schedule;
mod sides;
pub(super) mod slip;
mod sources;
mod time;
pub(super) mod values;
mod void;
pub(super) mod walls;

pub(super) use posed::posed;
pub use schedule::resolve;

use super::{EffectSet, InitialFields, Method, Plan, Pose, Warning};
use super::{boundary, forces};
use crate::scene::{Field, FieldFn, Scene, SceneError, Scope, WallKind, is_folder_name};
use materials::{SiMatter, thin_fluid};
use regions::{placed, regions};
use std::sync::Arc;
use values::{Result, finite_range, middle, positive, ranges};
use walls::{SiBlock, Walls};

/// Resolves a scene as if its schedule were empty. `poses`: where the blocks are that move, if not at
/// their start.
fn without_schedule(scene: &Scene, poses: Option<&[Pose]>) -> Result<Plan> {
    let scene = &void::with_void(scene)?;
    if !is_folder_name(&scene.name) {
        return Err(SceneError::of_key(
            "name",
            format!("the scene's name is {:?}", scene.name),
            "it names folders: use 1 to 100 letters, digits, `_` and `-`",
        ));
    }
    let scope = &Scope::new(scene)?;
    let [x, y] = ranges(&scene.domain.x, &scene.domain.y, scope)?;
    for (name, range, q) in [("x", x, &scene.domain.x), ("y", y, &scene.domain.y)] {
        if range[1] <= range[0] {
            return Err(SceneError::at(
                &q[1],
                format!("domain.{name} is empty: [{}, {}]", range[0], range[1]),
                "the second number must be above the first",
            ));
        }
    }
    let domain = [x, y];
    let length = match &scene.domain.length_scale {
        Some(q) => positive(q, scope, "length_scale")?,
        None => (x[1] - x[0]).min(y[1] - y[0]),
    };
    // All materials and regions are checked, including those that fill no part of the domain.
    let mut warnings = Vec::new();
    let origin = scope.origin();
    if origin != [0.0; 2] {
        warnings.push(Warning::FarDomain { corner: origin });
    }
    regions(scene, scope, domain, &SiMatter::new(scene, scope)?, &mut warnings)?;
    let (whole, scene) = (scene, &placed(scene));
    for name in whole.materials.keys().filter(|name| !scene.materials.contains_key(*name)) {
        if !whole.materials[name].background {
            warnings.push(Warning::MaterialUnused { material: name.clone() });
        }
    }
    let si = SiMatter::new(scene, scope)?;
    axis::check(scene, x, si.gravity)?;
    axis::check_moving(scene, scope)?;
    let units = scales::choose_units(scene, scope, &si, domain, length)?;
    let mut state = si.matter(&units);
    warnings.extend(si.warnings.iter().cloned());

    let mut walls = Walls::new(scene, scope, domain, poses)?;
    posed::check(scene, &walls.moving)?;
    let slips = slip::Slips::new(scene, scope)?;
    let supports = forces::names(&walls);
    let (gauges, wanted) = gauges::gauges(scene, scope, domain, &supports)?;
    gauges::interest(scene)?;
    let candidates = inflow::Candidates { scene, scope, materials: &si.materials };
    let mut sides = sides::sides(scene, scope, domain, candidates)?;
    if axis::is_axis(scene, x) {
        axis::hold(&mut sides[0], si.materials.iter().any(|m| m.rotation.is_some()));
    }
    let size = length / f64::from(scene.accuracy.cells.max(1));
    let sources = sources::sources(candidates, domain, size)?;
    walls.blocks.extend(sources.iter().map(|s| SiBlock {
        index: usize::MAX,
        name: s.name.clone(),
        range: s.block,
        kind: WallKind::NoSlip,
        rotation: None,
    }));
    let lines = mesh::Lines { walls: &walls, gauges: &gauges, sides: &sides, sources: &sources };
    let mesh = Arc::new(mesh::mesh(scene, scope, domain, length, &lines, &units)?);
    state.relaxation = schedule::relaxation(&state, &mesh, schedule::inertial(scene, &units));
    warnings.extend(gaps::narrow(&walls, (domain, origin), &mesh, &units));
    let sources: Vec<_> = sources.into_iter().map(|s| s.scaled(&mesh, &units)).collect();
    let mut clock = time::clock(scene, scope, &units)?;
    sources::add_stops(&sources, &mut clock);
    let held = (&state, scene.inertia);
    let boundary = boundary::boundary(sides, (&walls, &slips), &mesh, &units, held, sources)?;
    let enclosure = walls.enclosure(&boundary, &mesh, &units);
    let forces = forces::force_gauges(&wanted, (&walls, &boundary), &mesh, &units);

    let regions = regions(scene, scope, domain, &si, &mut Vec::new())?;
    let has_density = si.materials.iter().any(|m| m.density > 0.0 || m.density_field.is_some());
    let effects = EffectSet {
        rotation: si.materials.iter().any(|m| m.rotation.is_some()),
        directors: si.materials.iter().any(|m| m.layer_viscosity.is_some()),
        carried_viscosity: si.materials.iter().any(|m| m.viscosity_field.is_some()),
        carried_density: si.materials.iter().any(|m| m.density_field.is_some()),
        volume_change: si.materials.iter().any(|m| m.compliance > 0.0),
        gravity: si.gravity != [0.0; 2] && has_density,
        flow_curves: si.materials.iter().any(|m| m.curve.is_some()),
        inertia: scene.inertia && has_density,
        void: scene.background.is_some(),
        micro_inertia: si.materials.iter().any(|m| m.micro_inertia > 0.0),
    };
    if !effects.rotation {
        for (s, piece) in boundary.pieces() {
            if piece.conditions.rotation.is_some() {
                warnings.push(Warning::RotationUnused { place: boundary::place_of(s, piece) });
            }
        }
    }
    let density = si.materials.iter().map(|m| m.density).fold(0.0, f64::max);
    let viscosity = si.materials.iter().map(|m| m.viscosity).fold(0.0, f64::max);
    let reynolds = density / units.time * length * length / viscosity;
    if reynolds > 1.0 && !scene.inertia {
        warnings.push(Warning::Inertia { reynolds });
    }
    if effects.gravity {
        warnings.extend(thin_fluid(&si.materials).filter(|_| !effects.void));
        warnings.extend(drafts::drafts(scene, &si, domain, &boundary));
    }
    let body_force = scene
        .body_force
        .as_ref()
        .map(|f| {
            Ok::<_, SceneError>([
                f.x.compile(scope)?,
                f.y.compile(scope)?,
                f.couple.compile(scope)?,
            ])
        })
        .transpose()?;
    let acceleration = scene
        .acceleration
        .as_ref()
        .map(|a| {
            let compile = |f: &Field| -> Result<FieldFn> {
                let compiled = f.compile(scope)?;
                finite_range(f, &compiled, middle(domain), "acceleration")?;
                Ok(compiled)
            };
            Ok::<_, SceneError>([compile(&a.x)?, compile(&a.y)?])
        })
        .transpose()?
        .filter(|_| has_density);
    null_spaces::check_null_spaces(scene, &boundary, &mesh, &units, &effects, body_force.as_ref())?;

    let pressure_reference =
        pressure::reference(scene, scope, (&mesh, &units), (&boundary, &regions))?;
    let initial_velocity = initial_velocity(scene, scope, domain)?;
    let initial = si
        .materials
        .iter()
        .map(|m| InitialFields {
            viscosity: m.viscosity_field.clone(),
            density: m.density_field.clone(),
        })
        .collect();
    let gauges = gauges.into_iter().map(|g| g.scaled(&mesh, &units)).collect();
    let (tracers, marks) = dye::dye(scene, scope, length, &units, (&mesh, &enclosure))?;
    let tracers = tracers.map(|t| dye::outside(t, &mesh));
    Ok(Plan {
        scene: whole.clone(),
        origin,
        units,
        enclosure,
        boundary,
        moving: walls.moving,
        poses: walls.poses,
        pressure_reference,
        state,
        changes: vec![],
        regions,
        initial,
        initial_velocity,
        body_force,
        acceleration,
        gauges,
        forces,
        tracers,
        marks,
        method: Method {
            stabilisation: Some(scene.accuracy.stabilisation)
                .filter(|&share| share > 0.0 && effects.gravity && !effects.inertia),
            ..accuracy::method(scene)?
        },
        clock,
        content: recording::content(scene, &mesh)?,
        effects,
        warnings,
        mesh,
    })
}

/// Velocity at the start, as functions of SI coordinates.
fn initial_velocity(
    scene: &Scene,
    scope: &Scope,
    domain: [[f64; 2]; 2],
) -> Result<Option<[FieldFn; 2]>> {
    let Some(v) = &scene.initial_velocity else { return Ok(None) };
    if !scene.inertia {
        return Err(SceneError::at(
            &v.x,
            "initial_velocity is given, but a flow without inertia has no memory of it",
            "set `inertia = true`, or remove it",
        ));
    }
    let compile = |f: &Field| -> Result<FieldFn> {
        let compiled = f.compile(scope)?;
        finite_range(f, &compiled, domain, "initial_velocity")?;
        Ok(compiled)
    };
    Ok(Some([compile(&v.x)?, compile(&v.y)?]))
}
