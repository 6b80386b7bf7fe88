//! The same scene without particles: the plan's own fields at the Gauss points.

use super::Case;
use super::measure::{CaseError, Errors, Solved};
use crate::plan::boundary::add_body_force;
use crate::plan::material::{Material, Texture};
use crate::plan::{InitialDirector, Plan};
use crate::sim::SimError;
use crate::solve::buoyancy::Restoring;
use crate::solve::quadrature::Quadrature;
use crate::solve::stokes::{Loads, Stokes, Stopping};
use crate::space::flow::Flow;

impl Case {
    /// Errors of the first instant when materials and densities are integrated by Gauss points
    /// that know the scene's fields, instead of by particles: what the elements alone can do. Only
    /// for incompressible scenes.
    pub fn errors_without_particles(&self, cells: u32) -> Result<Errors, CaseError> {
        let plan = self.plan(cells, &[])?;
        if plan.effects.rotation {
            Ok(Errors::of(&solve::<3>(&plan)?, &self.exact))
        } else {
            Ok(Errors::of(&solve::<2>(&plan)?, &self.exact))
        }
    }
}

/// The material at a point of the plan.
fn material_at(plan: &Plan, si: [f64; 2]) -> Option<(usize, Option<&InitialDirector>)> {
    let region = plan.regions.iter().rev().find(|r| r.shape.contains(si));
    let index = region.map(|r| r.material).or(plan.background())?;
    Some((index as usize, region.and_then(|r| r.director.as_ref())))
}

/// Viscosity, density of a material at a point, in the plan's units.
fn values(plan: &Plan, index: usize, material: &Material, [x, y]: [f64; 2]) -> (f64, f64) {
    let fields = &plan.initial[index];
    let eta = fields.viscosity.as_ref().map(|f| f.at(x, y) / plan.units.viscosity);
    let density = fields.density.as_ref().map(|f| f.at(x, y) / plan.units.density);
    (eta.unwrap_or(material.viscosity), density.unwrap_or(material.density))
}

fn solve<const D: usize>(plan: &Plan) -> Result<Solved<'_, D>, SimError> {
    let mesh = &plan.mesh;
    let materials = &plan.state.materials;
    let quadrature = Quadrature::from_fields(mesh, materials.len(), |_, p| {
        let si = plan.si(p);
        let Some((index, director)) = material_at(plan, si) else { return Default::default() };
        let material = &materials[index];
        let (eta, density) = values(plan, index, material, si);
        let mut texture = Texture::default();
        if let Some(InitialDirector::Angle(f)) = director {
            let (s, c) = f.at(si[0], si[1]).to_radians().sin_cos();
            texture.add(1.0, [c, s]);
        }
        (material.law(eta, &texture), density, eta)
    });
    let mut load = vec![[0.0; D]; mesh.nodes()];
    plan.boundary.add_tractions(mesh, &plan.units, &mut load);
    if let Some(f) = &plan.body_force {
        add_body_force(mesh, &plan.units, f, &mut load);
    }
    let g = plan.state.gravity;
    for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
        let nodes = mesh.cell_nodes(cell);
        quadrature.for_points(cell, |p, shape| {
            let si = plan.si(mesh.from_reference(cell, p.r));
            for c in 0..2 {
                let more = plan.acceleration.as_ref().map_or(0.0, |a| a[c].at(si[0], si[1]));
                let acceleration = g[c] + more / plan.units.acceleration();
                let f = mesh.cell_area(cell) * p.weight * p.density * acceleration;
                for a in 0..nodes.len() {
                    load[nodes[a]][c] += f * shape.n[a];
                }
            }
        });
    }
    let constraints = plan.boundary.constraints::<D>(mesh, &plan.units);
    let mut stokes = Stokes::new(mesh.clone(), constraints);
    let stopping =
        Stopping { tolerance: plan.method.tolerance, max_corrections: plan.method.max_corrections };
    let loads = Loads { nodal: &load, restoring: &Restoring::default() };
    let mut flow = Flow::zero(mesh);
    stokes.solve(&quadrature, loads, stopping, &mut flow).map_err(|source| SimError::Solve {
        step: 0,
        time: 0.0,
        source,
    })?;
    Ok(Solved { plan, flow })
}
