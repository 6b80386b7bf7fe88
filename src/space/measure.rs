//! This module defines the measure of integration: volumes of cells and integration points, areas
//! of faces, and the pressure basis.
//!
//! All integrals use [`Measure`] through [`Mesh`](super::mesh::Mesh); no other code depends on the
//! geometry of the scene. In the plane the measure is that of a slab of unit depth: a cell of `h_x`
//! by `h_y` has the volume `h_x h_y` (m2, per unit depth), the pressure basis is `1, xi, eta`,
//! orthogonal on a rectangle with the mass `volume diag(1, 1/3, 1/3)`, and there are no hoop rates.
//! Multiplication by the depth of [`Measure::PLANE`] is exact.

/// Mass of the pressure basis divided by the volume of the cell.
const PRESSURE_MASS: [f64; 3] = [1.0, 1.0 / 3.0, 1.0 / 3.0];

/// Measure of integration of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measure {
    depth: f64,
}

impl Measure {
    /// A slab of unit depth.
    pub const PLANE: Measure = Measure { depth: 1.0 };

    /// A slab of another depth.
    pub fn slab(depth: f64) -> Measure {
        Measure { depth }
    }

    /// Measure of a cell with the given size along x and y.
    pub fn of_cell(self, size: [f64; 2]) -> CellMeasure {
        CellMeasure { size, depth: self.depth }
    }

    /// Area of a face with the given length.
    pub fn of_face(self, length: f64) -> f64 {
        length * self.depth
    }

    /// Values of the pressure basis at reference coordinates.
    pub fn pressure_basis(self, [xi, eta]: [f64; 2]) -> [f64; 3] {
        [1.0, xi, eta]
    }
}

/// Measure of one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellMeasure {
    /// Size of the cell along x and y.
    pub size: [f64; 2],
    depth: f64,
}

impl CellMeasure {
    /// Measure of a part of the cell.
    pub fn part(self, fraction: f64) -> CellMeasure {
        CellMeasure { depth: self.depth * fraction, ..self }
    }

    /// Volume of the cell over its area.
    #[inline(always)]
    pub fn depth(&self) -> f64 {
        self.depth
    }

    /// Volume of the cell.
    #[inline(always)]
    pub fn volume(&self) -> f64 {
        self.size[0] * self.size[1] * self.depth
    }

    /// Area of a side whose normal has the direction `c`.
    pub fn of_side(&self, c: usize) -> f64 {
        self.size[1 - c] * self.depth
    }

    /// Volume of an integration point with the given weight (the weights of a cell add up to 1).
    #[inline(always)]
    pub fn of_point(&self, weight: f64) -> f64 {
        weight * self.volume()
    }

    /// A value per volume times the volume, factor by factor.
    #[inline(always)]
    pub fn times(&self, value: f64) -> f64 {
        value * self.size[0] * self.size[1] * self.depth
    }

    /// Mass of the pressure basis, `integral q_i^2`.
    #[inline(always)]
    pub fn pressure_mass(&self) -> [f64; 3] {
        PRESSURE_MASS.map(|m| m * self.volume())
    }

    /// Factors of the divergence matrices of the reference cell (divided by its area) for `d/dx`
    /// and `d/dy`.
    #[inline(always)]
    pub fn divergence_scales(&self) -> [f64; 2] {
        [2.0 * self.size[1] * self.depth, 2.0 * self.size[0] * self.depth]
    }
}
