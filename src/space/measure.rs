//! This module defines the measure of integration: volumes of cells and integration points, areas
//! of faces, the rates around the axis, and the pressure basis.
//!
//! All integrals use [`Measure`] through [`Mesh`](super::mesh::Mesh); no other code depends on the
//! geometry of the scene. A measure is the thickness of the domain at right angles to the plane of the
//! mesh, and it is linear in x:
//!
//! ```text
//! plane     1          volume of a cell hx hy (m2, per unit depth)
//! ring      2 pi x     volume of a cell 2 pi x_c hx hy (m3), with the radius x_c of its centre
//! ```
//! In a cell, the thickness is that at its centre times `1 + t xi`, with the *tilt* `t` (`hx/2` over
//! the radius of the centre): 1 for a cell at the axis, 0 in the plane. The pressure basis
//! `1, xi - t/3, eta` is orthogonal in this measure, with the mass `volume diag(1, 1/3 - t^2/9, 1/3)`. In
//! a ring the flow has the hoop rate `u/x` and the hoop curvature `w/x`; their factor `1/x` is
//! [`CellMeasure::per_radius`]. In the plane it is zero, and all factors are exact.

use std::f64::consts::TAU;

/// Smallest relative thickness at which rates around the axis are evaluated.
const ON_AXIS: f64 = 1e-7;

/// Measure of integration of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measure {
    /// Thickness at x = 0.
    depth: f64,
    /// Change of the thickness per length along x.
    per_radius: f64,
}

impl Measure {
    /// A slab of unit depth.
    pub const PLANE: Measure = Measure { depth: 1.0, per_radius: 0.0 };
    /// A ring around the axis x = 0, where x is the radius.
    pub const RING: Measure = Measure { depth: 0.0, per_radius: TAU };

    /// A slab of another depth.
    pub fn slab(depth: f64) -> Measure {
        Measure { depth, per_radius: 0.0 }
    }

    /// Whether x is a radius.
    pub fn is_ring(self) -> bool {
        self.per_radius != 0.0
    }

    /// Thickness at x.
    #[inline(always)]
    pub fn depth_at(self, x: f64) -> f64 {
        self.depth + self.per_radius * x
    }

    /// Measure of a cell with the given size and the given x of its centre.
    #[inline(always)]
    pub fn of_cell(self, size: [f64; 2], x: f64) -> CellMeasure {
        let depth = self.depth_at(x);
        CellMeasure { size, depth, tilt: 0.5 * size[0] * self.per_radius / depth }
    }
}

/// Measure of one cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CellMeasure {
    /// Size of the cell along x and y.
    pub size: [f64; 2],
    /// Thickness at the centre.
    depth: f64,
    /// Relative change of the thickness from the centre to the right side.
    tilt: f64,
}

impl CellMeasure {
    /// Measure of a part of the cell.
    pub fn part(self, fraction: f64) -> CellMeasure {
        CellMeasure { depth: self.depth * fraction, ..self }
    }

    /// Relative change of the thickness from the centre to the right side; 0 in the plane, 1 at the
    /// axis.
    #[inline(always)]
    pub fn tilt(&self) -> f64 {
        self.tilt
    }

    /// Whether x is a radius.
    #[inline(always)]
    pub fn is_ring(&self) -> bool {
        self.tilt != 0.0
    }

    /// Thickness at the reference coordinate `xi` over that at the centre.
    #[inline(always)]
    pub fn thickness(&self, xi: f64) -> f64 {
        1.0 + self.tilt * xi
    }

    /// One over the radius at the reference coordinate `xi`; 0 in the plane. On the axis it is that very
    /// close to it.
    #[inline(always)]
    pub fn per_radius(&self, xi: f64) -> f64 {
        2.0 * self.tilt / (self.size[0] * self.thickness(xi).max(ON_AXIS))
    }

    /// Thickness at the centre, which is the volume over the area of the cell in the plane of the
    /// mesh.
    #[inline(always)]
    pub fn depth(&self) -> f64 {
        self.depth
    }

    /// Volume of the cell.
    #[inline(always)]
    pub fn volume(&self) -> f64 {
        self.size[0] * self.size[1] * self.depth
    }

    /// Area of a side, an index into [`SIDE_NODES`](super::shape::SIDE_NODES).
    pub fn of_side(&self, side: usize) -> FaceMeasure {
        match side {
            0 | 1 => {
                let xi = if side == 0 { -1.0 } else { 1.0 };
                let area = self.size[1] * self.depth * self.thickness(xi);
                FaceMeasure { area, tilt: 0.0 }
            }
            _ => FaceMeasure { area: self.size[0] * self.depth, tilt: self.tilt },
        }
    }

    /// Share of an integration point of the plane in the volume of the cell; the weights of a cell
    /// add up to 1, and so do the shares.
    #[inline(always)]
    pub fn share(&self, weight: f64, xi: f64) -> f64 {
        weight * self.thickness(xi)
    }

    /// Volume of an integration point with the given share of the cell.
    #[inline(always)]
    pub fn of_share(&self, share: f64) -> f64 {
        share * self.volume()
    }

    /// Volume of an integration point of the plane with the given weight and reference coordinate
    /// `xi`.
    #[inline(always)]
    pub fn of_point(&self, weight: f64, xi: f64) -> f64 {
        self.of_share(self.share(weight, xi))
    }

    /// A value per volume times the volume, factor by factor.
    #[inline(always)]
    pub fn times(&self, value: f64) -> f64 {
        value * self.size[0] * self.size[1] * self.depth
    }

    /// Values of the pressure basis at reference coordinates.
    #[inline(always)]
    pub fn pressure_basis(&self, [xi, eta]: [f64; 2]) -> [f64; 3] {
        [1.0, xi - self.tilt / 3.0, eta]
    }

    /// Mean square of the pressure basis.
    #[inline(always)]
    pub fn pressure_squares(&self) -> [f64; 3] {
        [1.0, 1.0 / 3.0 - self.tilt * self.tilt / 9.0, 1.0 / 3.0]
    }

    /// Mass of the pressure basis, `integral q_i^2`.
    #[inline(always)]
    pub fn pressure_mass(&self) -> [f64; 3] {
        self.pressure_squares().map(|m| m * self.volume())
    }

    /// Factors of the divergence matrices of the reference cell (divided by its area) for `d/dx`
    /// and `d/dy`.
    #[inline(always)]
    pub fn divergence_scales(&self) -> [f64; 2] {
        [2.0 * self.size[1] * self.depth, 2.0 * self.size[0] * self.depth]
    }
}

/// Measure of a side of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaceMeasure {
    /// Area.
    pub area: f64,
    /// Relative change of the thickness from the centre to the end of the side.
    tilt: f64,
}

impl FaceMeasure {
    /// Thickness at the reference coordinate `t` along the side over that at its centre.
    #[inline(always)]
    pub fn thickness(&self, t: f64) -> f64 {
        1.0 + self.tilt * t
    }

    /// Area of an integration point with the given weight and the reference coordinate `t` along the
    /// side.
    #[inline(always)]
    pub fn of_point(&self, weight: f64, t: f64) -> f64 {
        weight * self.area * self.thickness(t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::shape::GAUSS_3X3;

    /// A cell between the radii 0.6 and 1.
    fn cell() -> CellMeasure {
        Measure::RING.of_cell([0.4, 0.3], 0.8)
    }

    #[test]
    fn volumes_and_areas_are_those_of_rings() {
        let pi = std::f64::consts::PI;
        assert!((cell().volume() - pi * 0.3 * (1.0 - 0.36)).abs() < 1e-15);
        let areas = [TAU * 0.6 * 0.3, TAU * 0.3, pi * 0.64, pi * 0.64];
        for (side, area) in areas.into_iter().enumerate() {
            assert!((cell().of_side(side).area - area).abs() < 1e-15, "side {side}");
        }
        let sum: f64 = GAUSS_3X3.iter().map(|g| cell().of_point(g.weight, g.r[0])).sum();
        assert!((sum - cell().volume()).abs() < 1e-15);
        assert!((cell().per_radius(-1.0) - 1.0 / 0.6).abs() < 1e-14);
    }

    #[test]
    fn the_pressure_basis_is_orthogonal() {
        for i in 0..3 {
            for j in 0..3 {
                let product = GAUSS_3X3.iter().map(|g| {
                    let q = cell().pressure_basis(g.r);
                    cell().of_point(g.weight, g.r[0]) * q[i] * q[j]
                });
                let expected = if i == j { cell().pressure_mass()[i] } else { 0.0 };
                assert!((product.sum::<f64>() - expected).abs() < 1e-15, "{i} {j}");
            }
        }
    }
}
