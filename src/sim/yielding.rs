//! This module finds where materials with a flow curve yield, and where grains flow at inertial
//! numbers at which the equations of a flow without internal length are ill-posed.

use super::simulation::Simulation;
use crate::laws::director::Orientation;
use crate::laws::flow_curve::FlowCurve;
use crate::solve::last_flow::{Iterate, LastFlow};
use crate::space::flow::Flow;
use crate::threads;

/// Largest inertial number in pictures, in units of that at which friction is halfway between its
/// limits. Above it, friction is within a tenth of its upper limit. Grains without pressure have an
/// infinite inertial number.
const LARGEST: f64 = 10.0;

/// State of a material with a flow curve at a point, in the plan's units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Local {
    /// Shear viscosity.
    pub(super) viscosity: f64,
    /// Whether the viscosity is below the largest one.
    pub(super) yields: bool,
    /// Inertial number; `None` without friction. No more than [`LARGEST`].
    pub(super) inertial_number: Option<f64>,
    /// Whether grains flow at an inertial number outside the well-posed range, and neither bound of
    /// the viscosity holds.
    pub(super) ill_posed: bool,
}

impl<const D: usize> Simulation<D> {
    /// State of the material of a particle at the reference coordinates `r` of a cell; `None` if the
    /// material has no flow curve.
    pub(super) fn local(&self, p: usize, cell: usize, r: [f64; 2]) -> Option<Local> {
        let particles = &self.particles;
        let material = &self.matter.materials[usize::from(particles.material[p])];
        let curve = material.law.curve.as_ref()?;
        let director = particles.director.as_ref().filter(|_| material.law.is_layered());
        let orientation = director.map_or(Orientation::default(), |d| Orientation::of(d[p]));
        let Flow { velocity, pressure } = &self.flow;
        let flow = Iterate { mesh: &self.plan.mesh, velocity, pressure }.at(cell, r)?;
        let (g, p) = (material.law.rate(&flow.rates, &orientation), flow.pressure);
        let (viscosity, yields) = (curve.viscosity(g, p).value, curve.yields(g, p));
        let friction = curve.friction();
        let number = friction.map(|f| if g > 0.0 { f.inertial_number(g, p) } else { 0.0 });
        Some(Local {
            viscosity,
            yields,
            inertial_number: friction.zip(number).map(|(f, i)| i.min(LARGEST * f.inertial_number)),
            ill_posed: yields
                && viscosity > curve.smallest
                && friction.zip(number).is_some_and(|(f, i)| !f.is_well_posed(i)),
        })
    }

    /// State of the material at the reference coordinates `r` of a cell: that of the nearest
    /// particle of the cell; `None` if it has no flow curve.
    pub(super) fn local_at(&self, cell: usize, r: [f64; 2]) -> Option<Local> {
        let mesh = &self.plan.mesh;
        let [hx, hy] = mesh.cell_size(cell);
        let distance = |p: usize| {
            let at = mesh.to_reference(cell, self.particles.position[p]);
            (hx * (at[0] - r[0])).hypot(hy * (at[1] - r[1]))
        };
        let mut near = None;
        for p in self.particles.of_cell(cell) {
            let now = distance(p);
            if near.is_none_or(|(_, least)| now < least) {
                near = Some((p, now));
            }
        }
        self.local(near?.0, cell, r)
    }

    /// Volume of flowing grains; of those whose inertial number lies outside the well-posed range; and
    /// of the latter without an internal length.
    pub(super) fn ill_posed_volumes(&self) -> [f64; 3] {
        let (mesh, particles) = (&self.plan.mesh, &self.particles);
        threads::sum(0..mesh.cells(), |cell| {
            let mut sums = [0.0; 3];
            for p in particles.of_cell(cell) {
                let law = &self.matter.materials[usize::from(particles.material[p])].law;
                if law.curve.as_ref().and_then(FlowCurve::friction).is_none() {
                    continue;
                }
                let r = mesh.to_reference(cell, particles.position[p]);
                let Some(local) = self.local(p, cell, r).filter(|l| l.yields) else { continue };
                let volume = particles.volume[p];
                sums[0] += volume;
                if local.ill_posed {
                    sums[1] += volume;
                    sums[2] += if law.rotation.is_none() { volume } else { 0.0 };
                }
            }
            sums
        })
    }
}
