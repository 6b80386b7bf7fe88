//! This module resolves `[boundaries]` and checks that the problem has a unique solution.

use super::values::{Result, edge, finite_range};
use super::walls::Walls;
use crate::plan::boundary::{SIDES, side_normal};
use crate::plan::loads::fixed_loads;
use crate::plan::{BoundaryPlan, EffectSet, Matter, Side, Units, WallLine};
use crate::scene::{BoundaryKind, Field, FieldFn, Quantity, Scene, SceneError, Scope, WallKind};
use crate::space::mesh::Mesh;
use crate::space::segment::Segment;

/// Boundary conditions at the four sides of the domain.
pub(super) fn sides(scene: &Scene, scope: &Scope, domain: [[f64; 2]; 2]) -> Result<[Side; 4]> {
    let mut out: [Side; 4] = Default::default();
    for (s, side) in scene.boundaries.sides().into_iter().enumerate() {
        let name = format!("boundaries.{}", SIDES[s]);
        let normal = side_normal(s);
        let velocity = [&side.velocity_x, &side.velocity_y];
        let traction = [&side.traction_x, &side.traction_y];
        if side.kind == BoundaryKind::Periodic {
            if let Some(f) =
                velocity.into_iter().chain(traction).chain([&side.rotation]).flatten().next()
            {
                return Err(SceneError::at(
                    f,
                    format!("{name} is periodic and prescribes a value"),
                    "a periodic side has no boundary: remove the value or the kind",
                ));
            }
            out[s].periodic = true;
            continue;
        }
        let compile = |f: &Field| -> Result<FieldFn> {
            let compiled = f.compile(scope)?;
            finite_range(f, &compiled, edge(domain, s), &name)?;
            Ok(compiled)
        };
        for c in 0..2 {
            let held = match side.kind {
                BoundaryKind::NoSlip => true,
                BoundaryKind::FreeSlip => c == normal,
                BoundaryKind::Open | BoundaryKind::Periodic => false,
            };
            let letter = ["x", "y"][c];
            out[s].velocity[c] = match (velocity[c], traction[c]) {
                (Some(v), None) => Some(compile(v)?),
                (None, Some(_)) => None,
                (Some(v), Some(_)) => {
                    return Err(SceneError::at(
                        v,
                        format!("{name} gives both velocity_{letter} and traction_{letter}"),
                        "give one of them",
                    ));
                }
                (None, None) => held.then_some(FieldFn::Constant(0.0)),
            };
            out[s].traction[c] = traction[c].as_ref().map(compile).transpose()?;
        }
        out[s].rotation = side.rotation.as_ref().map(compile).transpose()?;
    }
    Ok(out)
}

/// Boundary conditions of sides, walls and blocks on the mesh.
pub(super) fn boundary(
    sides: [Side; 4],
    walls: &Walls,
    mesh: &Mesh,
    units: &Units,
    state: &Matter,
) -> Result<BoundaryPlan> {
    let mut lines = Vec::new();
    let mut add = |segment: Segment, kind: WallKind, rotation| {
        let segment = segment.on_mesh(mesh, units.length);
        lines.push(WallLine { segment, no_slip: kind == WallKind::NoSlip, rotation });
    };
    for w in &walls.walls {
        add(w.segment, w.kind, w.rotation);
    }
    for (range, kind) in &walls.blocks {
        for normal in 0..2 {
            let [from, to] = range[1 - normal];
            for at in range[normal] {
                add(Segment { normal, at, from, to }, *kind, None);
            }
        }
    }
    let held = |c: usize| {
        sides.iter().any(|s| s.velocity[c].is_some())
            || lines.iter().any(|w| w.segment.normal == c || w.no_slip)
    };
    let free_translation = [!held(0), !held(1)];
    let compressible = state.materials.iter().any(|m| m.law.compliance > 0.0);
    let closed = !compressible
        && sides
            .iter()
            .enumerate()
            .all(|(s, b)| b.periodic || b.velocity[side_normal(s)].is_some());
    let plan = BoundaryPlan { sides, walls: lines, free_translation, closed };
    if closed {
        let (net, total) = plan.net_outflow(mesh, &plan.constraints::<2>(mesh, units));
        if net.abs() > 1e-9 * total {
            return Err(SceneError::new(
                format!(
                    "the given normal velocities let {:.3e} m2/s of incompressible fluid flow out",
                    net * units.area_rate()
                ),
                "make them balance, open a side (kind = \"open\"), or give a bulk_viscosity",
            ));
        }
    }
    Ok(plan)
}

/// Refuses scenes with a net load along a free rigid translation, and scenes that may rotate
/// rigidly.
pub(super) fn check_null_spaces(
    scene: &Scene,
    boundary: &BoundaryPlan,
    mesh: &Mesh,
    units: &Units,
    effects: &EffectSet,
    body_force: Option<&[FieldFn; 3]>,
) -> Result<()> {
    let free = boundary.free_translation;
    if free == [false; 2] {
        return Ok(());
    }
    if free == [true; 2] && !mesh.x.periodic() && !mesh.y.periodic() {
        return Err(SceneError::new(
            "nothing holds the scene: every side is open",
            "give some boundary a velocity, or make sides periodic",
        ));
    }
    let load = fixed_loads::<2>(boundary, body_force, mesh, units);
    for c in (0..2).filter(|&c| free[c]) {
        let name = ["x", "y"][c];
        let total: f64 = load.iter().map(|f| f[c].abs()).sum();
        let net: f64 = load.iter().map(|f| f[c]).sum();
        let gravity =
            if effects.gravity { scene.gravity[c].clone() } else { Quantity::number(0.0) };
        let pulled = effects.gravity && gravity.eval(&Scope::new(scene)?)? != 0.0;
        if pulled || net.abs() > 1e-9 * total {
            return Err(SceneError::at(
                &gravity,
                format!("nothing holds the scene along {name}, and a net force acts there"),
                format!(
                    "there is no steady solution: balance the loads, or hold a side \
                     (velocity_{name})"
                ),
            ));
        }
    }
    Ok(())
}
