//! This module finds how the materials of a cell are arranged: which rule of mixture it needs.

use super::local_laws::Evaluation;
use crate::composition::Gathered;
use crate::composition::centroids::Centroids;
use crate::composition::interface::Interface;
use crate::composition::straight::StraightCut;
use crate::scene::Quadrature as Rule;

/// Relative difference up to which densities are equal.
const SAME_DENSITY: f64 = 1e-12;

/// Arrangement of the materials of a cell.
pub enum Form {
    /// Two materials separated by an interface.
    Cut { interface: Interface, between: [usize; 2] },
    /// Two materials of different weight separated by a straight line.
    Sides { cut: StraightCut, between: [usize; 2] },
    /// A thin film between grains and a rough wall.
    Film,
    /// Materials of different weight in no known arrangement.
    Weights,
    /// Drops in a material of the viscosity `around`.
    Drops { around: f64 },
    /// No known arrangement.
    Mixture,
}

impl Evaluation<'_> {
    /// Arrangement of the materials in a gathered cell.
    pub(super) fn form(&self, cell: usize, scratch: &mut Gathered) -> Form {
        if self.rule == Rule::Sides
            && (scratch.void().is_some() || self.densities_differ(scratch.volumes()))
        {
            let Some(between) = present(scratch.volumes()) else { return Form::Weights };
            let viscosity = self.materials.iter().map(|m| m.viscosity);
            let centroids =
                scratch.centroids((self.mesh, cell), self.particles, self.factors, viscosity);
            if self.is_film(cell, between, centroids) {
                return Form::Film;
            }
            let [_, b] = between;
            let (share, centroid) = centroids.in_section(b);
            return match StraightCut::new(share, centroid) {
                Some(cut) => Form::Sides { cut, between },
                None => Form::Weights,
            };
        }
        let viscosity: [f64; 2] = match present(scratch.volumes()) {
            Some(between) => between.map(|m| self.law_at_centre(cell, m, scratch).shear.mean()),
            None => return Form::Mixture,
        };
        let Some(mut around) = scratch.neighbourhood(self.mesh, cell, self.particles) else {
            return Form::Mixture;
        };
        for drop in [false, true] {
            if around.is_drop(drop) {
                return Form::Drops { around: viscosity[usize::from(!drop)] };
            }
        }
        let between = around.between;
        let sheet = around.sheet(viscosity[1] > viscosity[0]);
        match sheet.or_else(|| around.interface()) {
            Some(interface) => Form::Cut { interface, between },
            None => Form::Mixture,
        }
    }

    /// Whether the materials with a nonzero volume differ in density.
    fn densities_differ(&self, volumes: &[f64]) -> bool {
        let present = || volumes.iter().zip(self.materials).filter(|(v, _)| **v > 0.0);
        let Some((_, first)) = present().next() else { return false };
        present().skip(1).any(|(_, m)| {
            m.carries_density
                || first.carries_density
                || (m.density - first.density).abs()
                    > SAME_DENSITY * m.density.abs().max(first.density.abs())
        })
    }

    /// Whether a thin fluid lies between grains with friction and a side along which the velocity is
    /// prescribed, and fills less than half of the cell.
    ///
    /// Such a side is a rough wall. Grains that advance along it roll over what was there before, since
    /// nothing moves at the wall itself, and the film that remains is thinner than a grain. As a layer
    /// of its own it would let the grains glide: the front of a collapsing column then reaches 5.0
    /// instead of 4.6 column heights (3.9 in simulations of single grains).
    fn is_film(&self, cell: usize, between: [usize; 2], centroids: &Centroids) -> bool {
        let held = self.walls[cell].along;
        let rubs =
            |m: usize| self.materials[m].law.curve.as_ref().is_some_and(|c| c.friction().is_some());
        let [grains, film] = match between.map(rubs) {
            [true, false] => between,
            [false, true] => [between[1], between[0]],
            _ => return false,
        };
        if held == [false; 4] {
            return false;
        }
        let [from, to] = [grains, film].map(|m| centroids.centroid(m));
        let way = [to[0] - from[0], to[1] - from[1]];
        // The side that the film lies on, if it lies on one.
        let normal = usize::from(way[0].abs() < way[1].abs());
        let side = 2 * normal + usize::from(way[normal] > 0.0);
        held[side] && centroids.share(film) < 0.5
    }
}

/// The two materials with a nonzero volume; `None` if there are more or fewer.
fn present(volumes: &[f64]) -> Option<[usize; 2]> {
    let mut present = (0..volumes.len()).filter(|&m| volumes[m] > 0.0);
    match (present.next(), present.next(), present.next()) {
        (Some(first), Some(second), None) => Some([first, second]),
        _ => None,
    }
}
