//! This module finds the stresses along the surfaces whose forces are measured.

use super::super::simulation::Simulation;
use crate::frame::{SurfacePoint, SurfaceStress};
use crate::plan::ForceGauge;
use crate::solve::last_flow::Iterate;
use crate::space::outline_rule::OutlinePoint;
use crate::space::shape::{side_end, side_normal};

/// Smallest cosine of the angle between normals in a cell that belong to one edge of an outline.
const ONE_EDGE: f64 = 0.8;

/// A place on a surface, in the plan's units: cell, reference coordinates, normal into the material, and
/// length along the surface.
type Spot = (usize, [f64; 2], [f64; 2], f64);

impl<const D: usize> Simulation<D> {
    /// Normal and shear stress along each surface with a gauge of its force.
    pub(super) fn stresses(&self) -> Vec<SurfaceStress> {
        let of = |gauge: &ForceGauge| {
            let mut spots = self.spots(gauge);
            spots.sort_by(|a, b| a.3.total_cmp(&b.3));
            let points = spots.into_iter().filter_map(|spot| self.stress(spot)).collect();
            SurfaceStress { name: gauge.name.clone(), points }
        };
        self.plan.forces.iter().map(of).collect()
    }

    /// One place for each cell and edge of a surface.
    fn spots(&self, gauge: &ForceGauge) -> Vec<Spot> {
        let mesh = &self.plan.mesh;
        let mut out = Vec::new();
        let mut passed = 0.0;
        for segment in &gauge.faces {
            for (cell, side) in segment.free_faces(mesh) {
                let c = side_normal(side);
                let edge = side_end(side);
                let (mut r, mut n) = ([0.0; 2], [0.0; 2]);
                (r[c], n[c]) = (edge, -edge);
                let along = mesh.cell_centre(cell)[1 - c] - segment.from;
                out.push((cell, r, n, passed + along));
            }
            passed += segment.to - segment.from;
        }
        let Some(solid) = gauge.solid else { return out };
        for cell in 0..mesh.cells() {
            let mut points: Vec<OutlinePoint> = mesh.outline_points(cell);
            points.retain(|p| p.solid == solid);
            while let Some(&first) = points.first() {
                let alike = |p: &OutlinePoint| {
                    first.normal[0] * p.normal[0] + first.normal[1] * p.normal[1] > ONE_EDGE
                };
                let edge: Vec<_> = points.iter().copied().filter(alike).collect();
                points.retain(|p| !alike(p));
                let area: f64 = edge.iter().map(|p| p.area).sum();
                let mean: f64 = edge.iter().map(|p| p.area * p.along).sum::<f64>() / area;
                let off = |p: &OutlinePoint| (p.along - mean).abs();
                let middle = edge.into_iter().min_by(|a, b| off(a).total_cmp(&off(b)));
                out.extend(middle.map(|p| (cell, p.r, p.normal, p.along)));
            }
        }
        out
    }

    fn stress(&self, (cell, r, n, along): Spot) -> Option<SurfacePoint> {
        let (plan, mesh) = (&self.plan, &self.plan.mesh);
        let flow = Iterate { mesh, velocity: &self.flow.velocity, pressure: &self.flow.pressure };
        let known = self.stokes.determines_pressure(cell);
        let traction = self.quadrature.traction(mesh, (cell, r), n, (&flow, known))?;
        let [x, y] = traction.map(|t| t * plan.units.stress());
        Some(SurfacePoint {
            along: (along * plan.units.length) as f32,
            at: plan.si(mesh.from_reference(cell, r)).map(|c| c as f32),
            normal: n.map(|c| c as f32),
            pressing: -(x * n[0] + y * n[1]) as f32,
            shear: (y * n[0] - x * n[1]) as f32,
        })
    }
}
