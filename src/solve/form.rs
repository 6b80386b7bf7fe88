//! This module finds how the materials of a cell are arranged: which rule of mixture it needs.

use super::local_laws::Evaluation;
use crate::composition::Gathered;
use crate::composition::centroids::Centroids;
use crate::composition::interface::Interface;
use crate::composition::straight::StraightCut;
use crate::plan::material::Material;
use crate::scene::Quadrature as Rule;

/// Relative difference up to which densities are equal.
const SAME_DENSITY: f64 = 1e-12;

/// Logarithm to base 10 of the contrast up to which a film of thin fluid on a wall is a layer.
const LAYER: f64 = 5.0;
/// Logarithm to base 10 of the contrast from which such a film is nothing.
const NOTHING: f64 = 6.0;
/// Rounding error of such a logarithm.
const ROUNDING: f64 = 1e-9;

/// Arrangement of the materials of a cell.
pub enum Form {
    /// Two materials separated by an interface.
    Cut { interface: Interface, between: [usize; 2] },
    /// Two materials of different weight separated by a straight line. Where the thinner one may be a
    /// film on a wall, the line is trusted less, and the rest has the law of the material `alone`.
    Sides { cut: StraightCut, between: [usize; 2], alone: Option<usize> },
    /// A thin film between a wall and the material `alone`, which touches the wall.
    Film { alone: usize },
    /// Materials that fill a cell evenly.
    Even,
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
            let with_void = scratch.void().is_some();
            let viscosity = self.materials.iter().map(|m| m.viscosity);
            let centroids =
                scratch.centroids((self.mesh, cell), self.particles, self.factors, viscosity);
            let film = self.film(cell, between, centroids);
            let alone = film.map(|(alone, _)| alone);
            match film {
                Some((_, 1.0)) if with_void => return Form::Even,
                Some((alone, 1.0)) => return Form::Film { alone },
                _ => {}
            }
            let [_, b] = between;
            let (share, centroid) = centroids.in_section(b);
            return match StraightCut::new(share, centroid) {
                Some(mut cut) => {
                    cut.trust *= 1.0 - film.map_or(0.0, |(_, degree)| degree);
                    Form::Sides { cut, between, alone }
                }
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

    /// The material that touches a wall although a film of thin fluid lies between, and the degree from 0
    /// to 1 to which it does.
    ///
    /// A side along which the velocity is prescribed is a rough wall; where gravity does not pull away from
    /// it, material may lie on it (a gap below a ceiling is no film). Material that advances along it rolls
    /// over what was there before, since nothing moves at the wall itself. The film that remains in
    /// less than half of the row of cells at the wall would let the material glide. Real films are thinner by
    /// orders of magnitude, and break. So in such a cell the material has its own law, and the film has its
    /// volume only. This holds
    /// - for grains with friction: with the mean of both laws, the farthest forty particles of a collapsing
    ///   column come to 4.6 column heights instead of 4.2 (front in simulations of single grains: 3.9);
    /// - for a heavier fluid at a contrast of 1e6 and more, where the film stands for nothing at all
    ///   (a [void](super::filled) has no films): a gravity current is otherwise ahead of its similarity
    ///   solution by 5.5 and 7.4 % at 8 and 16 cells per metre, instead of 4.3 and 4.2 %. Below a contrast of
    ///   1e5 the film is a layer like any other.
    fn film(
        &self,
        cell: usize,
        between: [usize; 2],
        centroids: &Centroids,
    ) -> Option<(usize, f64)> {
        if !(0..4).any(|side| self.walls.carries(cell, side)) {
            return None;
        }
        let [from, to] = between.map(|m| &self.materials[m]);
        let rubs = |m: &Material| m.law.curve.as_ref().is_some_and(|c| c.friction().is_some());
        let (alone, degree) = match [rubs(from), rubs(to)] {
            [true, false] => (0, 1.0),
            [false, true] => (1, 1.0),
            _ => {
                let alone = usize::from(to.viscosity > from.viscosity);
                let [stiff, thin] = if alone == 0 { [from, to] } else { [to, from] };
                if self.fill.is_some() || stiff.density <= thin.density {
                    return None;
                }
                let decades = (stiff.viscosity / thin.viscosity).log10();
                let degree = ((decades - LAYER) / (NOTHING - LAYER)).clamp(0.0, 1.0);
                (alone, if decades > NOTHING - ROUNDING { 1.0 } else { degree })
            }
        };
        let [material, film] = [between[alone], between[1 - alone]];
        let [from, to] = [material, film].map(|m| centroids.centroid(m));
        let way = [to[0] - from[0], to[1] - from[1]];
        // The side that the film lies on, if it lies on one.
        let normal = usize::from(way[0].abs() < way[1].abs());
        let side = 2 * normal + usize::from(way[normal] > 0.0);
        let is_film = degree > 0.0 && self.walls.carries(cell, side) && centroids.share(film) < 0.5;
        is_film.then_some((material, degree))
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
