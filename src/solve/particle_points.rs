//! This module lists the particles of a cell as its integration points, for the rule `particles`.

use super::last_flow::LastFlow;
use super::points::IntegrationPoint;
use super::quadrature::Quadrature;
use crate::composition::Content;
use crate::laws::point::PointLaw;
use crate::plan::material::Material;
use crate::space::mesh::Mesh;
use crate::space::particles::Particles;
use crate::space::shape::GAUSS_3X3;

impl Quadrature {
    /// Fills the points of a cell whose particles are the integration points.
    pub(super) fn list(
        &mut self,
        mesh: &Mesh,
        cell: usize,
        particles: &Particles,
        materials: &[Material],
        flow: &dyn LastFlow,
    ) {
        let count = materials.len();
        let content = self.composition.content(cell);
        let range = particles.of_cell(cell);
        let fractions = &mut self.composition.fractions[cell * count..][..count];
        if let Content::Uniform { material, .. } = content {
            let m = &materials[material as usize];
            self.mean_viscosity[cell] = m.viscosity;
            self.compliance[cell] = m.law.compliance;
            fractions.fill(0.0);
            fractions[material as usize] = 1.0;
            if range.is_empty() {
                let (law, density) = (super::evaluate::uniform(m), m.density);
                let measure = mesh.whole_measure(cell);
                self.points.extend(GAUSS_3X3.iter().map(|g| IntegrationPoint {
                    law,
                    density,
                    weight: measure.share(g.weight, g.r[0]),
                    r: g.r,
                }));
            }
        }
        let total: f64 = particles.volume[range.clone()].iter().sum();
        if !range.is_empty() {
            fractions.fill(0.0);
            self.mean_viscosity[cell] = 0.0;
            self.compliance[cell] = 0.0;
        }
        for p in range {
            let index = particles.material[p] as usize;
            let m = &materials[index];
            let point =
                super::evaluate::particle_point((mesh, cell), (particles, p), m, total, flow);
            let (eta, weight) = (point.0, point.1.weight);
            fractions[index] += weight;
            self.mean_viscosity[cell] += weight * eta;
            self.compliance[cell] += weight * m.law.compliance;
            self.points.push(point.1);
        }
        self.hold_rotation(cell, materials);
        self.start[cell + 1] = self.points.len() as u32;
    }

    /// Adds a billionth of the law of each Cosserat material at the Gauss points of a mixed cell: a
    /// few particles of such a material leave the rotation undetermined.
    fn hold_rotation(&mut self, cell: usize, materials: &[Material]) {
        const HOLD: f64 = 1e-9;
        if self.composition.content(cell) != Content::Mixed {
            return;
        }
        for (m, material) in materials.iter().enumerate() {
            let Some(rotation) = material.law.rotation else { continue };
            if self.composition.fraction(cell, m) > 0.0 {
                let law = PointLaw {
                    coupling: HOLD * rotation.coupling,
                    couple: HOLD * rotation.couple.max(rotation.layer_couple),
                    ..PointLaw::default()
                };
                self.points.extend(GAUSS_3X3.iter().map(|g| IntegrationPoint {
                    law,
                    density: 0.0,
                    weight: g.weight,
                    r: g.r,
                }));
            }
        }
    }
}
