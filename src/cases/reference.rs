//! This module solves a case without particles: the fields of the plan are evaluated at Gauss
//! points.

use super::Case;
use super::measure::{CaseError, Errors, Solved};
use crate::laws::Here;
use crate::laws::director::Orientation;
use crate::plan::material::Material;
use crate::plan::{InitialDirector, Plan};
use crate::sim::SimError;
use crate::solve::quadrature::Quadrature;
use crate::solve::report::Stopping;
use crate::solve::stokes::{Loads, Stokes};
use crate::solve::terms::Terms;
use crate::solve::terms::weight::{Masses, add_acceleration, add_gravity};
use crate::space::flow::Flow;

impl Case {
    /// Errors of the initial flow if materials and densities are integrated with the exact fields
    /// at Gauss points instead of particles. This is the discretisation error of the elements
    /// alone. Only for incompressible scenes.
    ///
    /// # Errors
    /// The scene is invalid, or the flow cannot be solved for.
    pub fn errors_without_particles(&self, cells: u32) -> Result<Errors, CaseError> {
        let plan = self.plan(cells, &[])?;
        if plan.effects.rotation {
            Ok(Errors::of(&solve::<3>(&plan)?, &self.exact))
        } else {
            Ok(Errors::of(&solve::<2>(&plan)?, &self.exact))
        }
    }
}

/// Index of the material at an SI point, and the initial director of its region.
fn material_at(plan: &Plan, si: [f64; 2]) -> Option<(usize, Option<&InitialDirector>)> {
    let region = plan.regions.iter().rev().find(|r| r.shape.contains(si));
    let index = region.map(|r| r.material).or(plan.background())?;
    Some((index as usize, region.and_then(|r| r.director.as_ref())))
}

/// Viscosity and density of a material at an SI point, in the plan's units.
fn values(plan: &Plan, index: usize, material: &Material, [x, y]: [f64; 2]) -> (f64, f64) {
    let fields = &plan.initial[index];
    let eta = fields.viscosity.as_ref().map(|f| f.at(x, y) / plan.units.viscosity);
    let density = fields.density.as_ref().map(|f| f.at(x, y) / plan.units.density);
    (eta.unwrap_or(material.viscosity), density.unwrap_or(material.density))
}

/// Solves for the initial flow of a plan without particles.
fn solve<const D: usize>(plan: &Plan) -> Result<Solved<'_, D>, SimError> {
    let mesh = &plan.mesh;
    let materials = &plan.state.materials;
    let mut quadrature = Quadrature::from_fields(mesh, materials.len(), |_, p| {
        let si = plan.si(p);
        let Some((index, director)) = material_at(plan, si) else { return Default::default() };
        let material = &materials[index];
        let (eta, density) = values(plan, index, material, si);
        let mut orientation = Orientation::default();
        if let Some(InitialDirector::Angle(f)) = director {
            let (s, c) = f.at(si[0], si[1]).to_radians().sin_cos();
            orientation.add(1.0, [c, s]);
        }
        (material.law.at(&Here::without_flow(eta, &orientation)), density, eta)
    });
    quadrature.bind_slip(mesh, &plan.boundary, &plan.units);
    let mut load = plan.fixed_loads::<D>();
    let masses = Masses::Points(&quadrature);
    add_acceleration(plan, masses, &mut load);
    add_gravity(plan, plan.state.gravity, masses, &mut load);
    let mut constraints = plan.boundary.constraints::<D>(mesh, &plan.units);
    constraints.refer(plan.pressure_reference);
    let mut stokes = Stokes::new(mesh.clone(), constraints);
    let stopping = Stopping::of(&plan.method);
    let loads = Loads { nodal: &load, terms: &Terms::default(), weight: &[] };
    let mut flow = Flow::zero(mesh);
    stokes.solve(&quadrature, loads, stopping, &mut flow).map_err(|source| SimError::Solve {
        step: 0,
        time: 0.0,
        source,
    })?;
    Ok(Solved { plan, flow })
}
