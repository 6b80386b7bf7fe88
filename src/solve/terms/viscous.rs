//! This module computes the viscous term: the stresses of the materials at the integration points
//! of a cell.
//!
//! Per volume, with `d = (D_xx - D_yy, 2 D_xy)` and the spin `o = (v,x - u,y)/2`,
//!
//! ```text
//! d.S d~ + beta tr(D) tr(D~) + 4 eta_c (o - w)(o~ - w~) + grad w.(M I + N) grad w~
//! ```
//! The coupling viscosity is integrated point by point only up to the shear viscosity;
//! [`rotation`](super::rotation) adds the excess. The forces of cells with the points of the Gauss
//! rule are computed for eight cells at a time by sum factorisation.

use super::rotation::RotationModes;
use super::stress::Stress;
use crate::composition::Content;
use crate::laws::point::{PointLaw, Sym2};
use crate::laws::rates::Rates;
use crate::simd::{Simd, dispatch, multiply_add};
use crate::solve::element::{Gradient, Matrix, Nodal, PointShape, rates};
use crate::solve::points::{CutStiffness, IntegrationPoint};
use crate::solve::quadrature::Quadrature;
use crate::space::measure::CellMeasure;
use crate::space::shape::{GAUSS_3, GAUSS_3_WEIGHTS, NODES, SLOPES_AT_GAUSS, VALUES_AT_GAUSS};

/// Internal forces of a cell, with its dissipation and strain.
#[derive(Clone, Copy)]
pub struct Internal<const D: usize> {
    /// Internal forces on the nodes.
    pub force: Nodal<D>,
    /// Viscous dissipation.
    pub dissipation: f64,
    /// `integral D:D`.
    pub strain: f64,
}

impl<const D: usize> Internal<D> {
    const NONE: Self = Internal { force: [[0.0; D]; NODES], dissipation: 0.0, strain: 0.0 };

    /// Computes the internal forces of up to [`TOGETHER`] cells. `rotation` holds the modes of all
    /// cells of the mesh. `of(cell)` returns the measure and the nodal values of a cell, `None` for
    /// a solid cell.
    pub fn of_cells(
        simd: Simd,
        quadrature: &Quadrature,
        rotation: &[Option<Box<RotationModes>>],
        cells: std::ops::Range<usize>,
        of: impl Fn(usize) -> Option<(CellMeasure, Nodal<D>)>,
    ) -> [Self; TOGETHER] {
        let mut out = [Internal::NONE; TOGETHER];
        let mut together = Together::<D>::EMPTY;
        let mut any = false;
        for (k, cell) in cells.clone().enumerate() {
            let Some((measure, u)) = of(cell) else { continue };
            let Some(points) = quadrature.gauss_points(cell) else {
                out[k] = Internal::at_any_points(quadrature, cell, measure, &u);
                continue;
            };
            any = true;
            if let Content::Uniform { .. } = quadrature.content(cell) {
                let law = points[0].law.without_excess();
                together.set(k, measure, &u, |_| law);
                continue;
            }
            let rest = quadrature.cut(cell).map(|cut| cut.rest);
            together.set(k, measure, &u, |g| {
                let law = points[g].law.without_excess();
                rest.map_or(law, |rest| law.with_viscosity_scaled(rest))
            });
        }
        if any && together.ring {
            stresses::<D, true>(simd, &mut together);
        } else if any {
            stresses::<D, false>(simd, &mut together);
        }
        for (k, cell) in cells.enumerate() {
            if quadrature.gauss_points(cell).is_some() {
                out[k] = together.internal(k);
            }
            let (cut, modes) = (quadrature.cut(cell), &rotation[cell]);
            if cut.is_none() && modes.is_none() {
                continue;
            }
            let Some((_, u)) = of(cell) else { continue };
            cut.iter().for_each(|cut| out[k].add_cut(cut, &u));
            if let Some(modes) = modes {
                out[k].dissipation += modes.add_force(&u, &mut out[k].force);
            }
        }
        out
    }

    /// Adds the forces of the stiffness of a cut cell.
    fn add_cut(&mut self, cut: &CutStiffness, u: &Nodal<D>) {
        let flat: [f64; 2 * NODES] = std::array::from_fn(|j| u[j % NODES][j / NODES]);
        for (i, row) in cut.matrix.iter().enumerate() {
            let force: f64 = row.iter().zip(&flat).map(|(k, u)| k * u).sum();
            self.force[i % NODES][i / NODES] += force;
            self.dissipation += force * flat[i];
        }
    }

    /// Internal forces of a cell whose points are not those of the Gauss rule.
    fn at_any_points(
        quadrature: &Quadrature,
        cell: usize,
        measure: CellMeasure,
        u: &Nodal<D>,
    ) -> Self {
        let mut out = Internal::NONE;
        quadrature.for_points(cell, |p, shape| {
            let s = PointShape::new(shape, measure, p.r[0]);
            let p = IntegrationPoint { law: p.law.without_excess(), ..*p };
            out.stress(&p, &rates(&s, u), measure).add_force(&s, &mut out.force);
        });
        out
    }

    /// Stress at a point; adds its dissipation and strain to the sums.
    #[inline(always)]
    fn stress(&mut self, p: &IntegrationPoint, r: &Rates, measure: CellMeasure) -> Stress<D> {
        let volume = measure.times(p.weight);
        self.dissipation += volume * p.law.power(r);
        self.strain += volume * r.strain_squared();
        Stress::new(&p.law, r, volume)
    }
}

/// Number of cells whose stresses are computed together, one per lane of a vector.
pub const TOGETHER: usize = 8;

/// One number for each of these cells.
type Lanes = [f64; TOGETHER];

/// Cells with the points of the Gauss rule: nodal values at first, nodal forces afterwards.
struct Together<const D: usize> {
    /// Whether x is a radius.
    ring: bool,
    /// See [`CellMeasure::tilt`].
    tilt: Lanes,
    /// Values by component and node.
    nodal: [[Lanes; NODES]; D],
    /// Laws at the nine points.
    laws: [LawLanes; 9],
    /// Reference coordinates per length, along x and y.
    per_length: [Lanes; 2],
    volume: Lanes,
    dissipation: Lanes,
    strain: Lanes,
}

/// One [`PointLaw`] for each cell: its ten coefficients in the order of its fields.
#[derive(Clone, Copy)]
struct LawLanes([Lanes; 10]);

const ZERO: Lanes = [0.0; TOGETHER];

impl LawLanes {
    #[inline(always)]
    fn set(&mut self, k: usize, law: &PointLaw) {
        let (s, b) = (law.shear, law.bending);
        let list = [s.a, s.b, s.c, law.dilation, law.coupling, law.couple, b.a, b.b, b.c, law.hoop];
        self.0.iter_mut().zip(list).for_each(|(lane, v)| lane[k] = v);
    }

    /// The law of lane `k`; without rotation, bending is left out.
    #[inline(always)]
    fn get<const D: usize, const RING: bool>(&self, k: usize) -> PointLaw {
        let used = |c: usize| if c == 9 { RING } else { D == 3 || c < 6 };
        let v = |c: usize| if used(c) { self.0[c][k] } else { 0.0 };
        PointLaw {
            shear: Sym2 { a: v(0), b: v(1), c: v(2) },
            dilation: v(3),
            coupling: v(4),
            couple: v(5),
            bending: Sym2 { a: v(6), b: v(7), c: v(8) },
            hoop: v(9),
        }
    }
}

impl<const D: usize> Together<D> {
    /// Lanes without a cell have no stiffness.
    const EMPTY: Self = Together {
        ring: false,
        tilt: ZERO,
        nodal: [[ZERO; NODES]; D],
        laws: [LawLanes([ZERO; 10]); 9],
        per_length: [ZERO; 2],
        volume: ZERO,
        dissipation: ZERO,
        strain: ZERO,
    };

    /// Sets the cell of lane `k`; `law(g)` is its law at Gauss point `g`.
    fn set(&mut self, k: usize, cell: CellMeasure, u: &Nodal<D>, law: impl Fn(usize) -> PointLaw) {
        for a in 0..NODES {
            for c in 0..D {
                self.nodal[c][a][k] = u[a][c];
            }
        }
        (self.ring, self.tilt[k]) = (cell.is_ring(), cell.tilt());
        self.volume[k] = cell.volume();
        for c in 0..2 {
            self.per_length[c][k] = 2.0 / cell.size[c];
        }
        self.laws.iter_mut().enumerate().for_each(|(g, place)| place.set(k, &law(g)));
    }

    /// Internal forces of the cell of lane `k`.
    fn internal(&self, k: usize) -> Internal<D> {
        let mut out =
            Internal { dissipation: self.dissipation[k], strain: self.strain[k], ..Internal::NONE };
        for a in 0..NODES {
            for c in 0..D {
                out.force[a][c] = self.nodal[c][a][k];
            }
        }
        out
    }
}

dispatch! {
    /// Computes the forces and powers of the cells.
    fn stresses<const D: usize, const RING: bool>(cells: &mut Together<D>) = stresses_kernel
}

#[inline(always)]
fn stresses_kernel<const LENGTH: usize, const FMA: bool, const D: usize, const RING: bool>(
    cells: &mut Together<D>,
) {
    let (mut x, mut y, mut w) = ([[ZERO; 9]; D], [[ZERO; 9]; D], [ZERO; 9]);
    // Radial velocity, later the hoop stress over the radius.
    let mut radial = [ZERO; 9];
    for c in 0..D {
        let (values, slopes) = up::<FMA>(&cells.nodal[c]);
        x[c] = across::<FMA>(&SLOPES_AT_GAUSS, &values);
        y[c] = across::<FMA>(&VALUES_AT_GAUSS, &slopes);
        if c == 2 {
            w = across::<FMA>(&VALUES_AT_GAUSS, &values);
        }
        if RING && c == 0 {
            radial = across::<FMA>(&VALUES_AT_GAUSS, &values);
        }
    }
    let [px, py] = cells.per_length;
    for g in 0..9 {
        let weight = GAUSS_3_WEIGHTS[g % 3] * GAUSS_3_WEIGHTS[g / 3];
        for k in 0..TOGETHER {
            let mut gradient = Gradient { x: [0.0; D], y: [0.0; D], w: w[g][k], hoop: None };
            for c in 0..D {
                gradient.x[c] = x[c][g][k] * px[k];
                gradient.y[c] = y[c][g][k] * py[k];
            }
            let (mut volume, mut per_radius) = (weight * cells.volume[k], 0.0);
            if RING {
                let thickness = 1.0 + cells.tilt[k] * GAUSS_3[g % 3];
                volume *= thickness;
                per_radius = cells.tilt[k] * px[k] / thickness;
                gradient.hoop = Some([radial[g][k] * per_radius, w[g][k] * per_radius]);
            }
            let (rates, law) = (gradient.rates(), cells.laws[g].get::<D, RING>(k));
            cells.dissipation[k] += volume * law.power_in_plane(&rates);
            cells.strain[k] += volume * rates.strain_squared();
            let mut all = law.stress(&rates, volume);
            if RING {
                cells.dissipation[k] += volume * law.power_around_axis(&rates);
            } else {
                (all.hoop, all.hoop_couple) = (0.0, 0.0);
            }
            let stress = Stress::<D>::of(all);
            for c in 0..D {
                x[c][g][k] = stress.x[c] * px[k];
                y[c][g][k] = stress.y[c] * py[k];
            }
            w[g][k] = stress.w;
            if RING {
                radial[g][k] = stress.hoop[0] * per_radius;
                w[g][k] += stress.hoop[1] * per_radius;
            }
        }
    }
    for c in 0..D {
        let along = across::<FMA>(&transposed(&SLOPES_AT_GAUSS), &x[c]);
        let other = across::<FMA>(&transposed(&VALUES_AT_GAUSS), &y[c]);
        cells.nodal[c] = down::<FMA>(&along, &other);
        if RING && c == 0 {
            let value = across::<FMA>(&transposed(&VALUES_AT_GAUSS), &radial);
            add_rows::<FMA>(&mut cells.nodal[c], &transposed(&VALUES_AT_GAUSS), &value);
        }
        if c == 2 {
            let value = across::<FMA>(&transposed(&VALUES_AT_GAUSS), &w);
            add_rows::<FMA>(&mut cells.nodal[c], &transposed(&VALUES_AT_GAUSS), &value);
        }
    }
}

/// A 3 x 3 table of one-dimensional values or slopes.
type Rows = [[f64; 3]; 3];

const fn transposed(t: &Rows) -> Rows {
    let [[a, b, c], [d, e, f], [g, h, i]] = *t;
    [[a, d, g], [b, e, h], [c, f, i]]
}

/// Contraction of each row: `out[3 j + i] = sum_a table[i][a] v[3 j + a]`.
#[inline(always)]
fn across<const FMA: bool>(table: &Rows, v: &[Lanes; 9]) -> [Lanes; 9] {
    let mut out = [ZERO; 9];
    for j in 0..3 {
        for i in 0..3 {
            for a in 0..3 {
                for k in 0..TOGETHER {
                    let sum = out[3 * j + i][k];
                    out[3 * j + i][k] = multiply_add::<FMA>(table[i][a], v[3 * j + a][k], sum);
                }
            }
        }
    }
    out
}

/// Adds the contraction of each column: `out[3 j + i] += sum_b table[j][b] v[3 b + i]`.
#[inline(always)]
fn add_rows<const FMA: bool>(out: &mut [Lanes; 9], table: &Rows, v: &[Lanes; 9]) {
    for j in 0..3 {
        for b in 0..3 {
            for i in 0..3 {
                for k in 0..TOGETHER {
                    let sum = out[3 * j + i][k];
                    out[3 * j + i][k] = multiply_add::<FMA>(table[j][b], v[3 * b + i][k], sum);
                }
            }
        }
    }
}

/// Interpolates nodal values in the vertical direction: values and slopes at the rows of Gauss
/// points.
#[inline(always)]
fn up<const FMA: bool>(v: &[Lanes; 9]) -> ([Lanes; 9], [Lanes; 9]) {
    let (mut values, mut slopes) = ([ZERO; 9], [ZERO; 9]);
    add_rows::<FMA>(&mut values, &VALUES_AT_GAUSS, v);
    add_rows::<FMA>(&mut slopes, &SLOPES_AT_GAUSS, v);
    (values, slopes)
}

/// Transpose of [`up`].
#[inline(always)]
fn down<const FMA: bool>(values: &[Lanes; 9], slopes: &[Lanes; 9]) -> [Lanes; 9] {
    let mut out = [ZERO; 9];
    add_rows::<FMA>(&mut out, &transposed(&VALUES_AT_GAUSS), values);
    add_rows::<FMA>(&mut out, &transposed(&SLOPES_AT_GAUSS), slopes);
    out
}

/// Adds the stiffness of a cut cell, in the blocks of components on and below the diagonal.
pub fn add_cut_stiffness(k: &mut Matrix, cut: &CutStiffness) {
    for (i, row) in cut.matrix.iter().enumerate() {
        for j in 0..NODES * (i / NODES + 1) {
            k[i][j] += row[j];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solve::element::{LOCAL, mirror};
    use crate::solve::terms::stress::add_stiffness;
    use crate::space::measure::Measure;
    use crate::space::shape::{GAUSS_3X3, GaussPoint, Shape};

    const SIZE: [f64; 2] = [0.7, 1.3];

    /// A cell in the plane, one away from the axis and one at it.
    fn measures() -> [CellMeasure; 3] {
        let ring = |x| Measure::RING.of_cell(SIZE, x);
        [Measure::PLANE.of_cell(SIZE, 0.4), ring(0.9), ring(0.35)]
    }

    /// Nine points with different anisotropic laws in which every coefficient is nonzero.
    fn points() -> [IntegrationPoint; 9] {
        std::array::from_fn(|g| {
            let t = g as f64;
            let law = PointLaw {
                shear: Sym2 { a: 2.0 + 0.3 * t, b: 1.0 + 0.1 * t, c: 0.4 - 0.1 * t },
                dilation: 1.5 + 0.2 * t,
                coupling: 0.8 + 0.05 * t,
                couple: 0.3 + 0.02 * t,
                bending: Sym2 { a: 0.2 + 0.01 * t, b: 0.1, c: -0.05 + 0.01 * t },
                hoop: 2.5 - 0.1 * t,
            };
            let GaussPoint { weight, r, .. } = GAUSS_3X3[g];
            IntegrationPoint { law, density: 1.0, weight, r }
        })
    }

    fn stiffness<const D: usize>(cell: CellMeasure) -> Matrix {
        let mut k: Matrix = [[0.0; LOCAL]; LOCAL];
        for (p, g) in points().iter().zip(GAUSS_3X3.iter()) {
            let volume = cell.of_point(p.weight, p.r[0]);
            add_stiffness::<D>(&mut k, &PointShape::new(&g.shape, cell, p.r[0]), &p.law, volume);
        }
        mirror::<D>(&mut k);
        k
    }

    fn some_values<const D: usize>() -> Nodal<D> {
        std::array::from_fn(|a| std::array::from_fn(|c| ((3 * a + 7 * c) as f64).sin()))
    }

    /// Internal forces of one lane of the cells that are computed together.
    fn internal_at<const D: usize>(
        cell: CellMeasure,
        (simd, lane): (Simd, usize),
        u: &Nodal<D>,
    ) -> Internal<D> {
        let mut cells = Together::<D>::EMPTY;
        let points = points();
        cells.set(lane, cell, u, |g| points[g].law);
        if cells.ring {
            stresses::<D, true>(simd, &mut cells);
        } else {
            stresses::<D, false>(simd, &mut cells);
        }
        let none = cells.internal((lane + 1) % TOGETHER);
        assert!(none.force.iter().flatten().all(|&f| f == 0.0));
        cells.internal(lane)
    }

    /// Forces by a loop over points, the reference for [`Together`].
    fn force_point_by_point<const D: usize>(cell: CellMeasure, u: &Nodal<D>) -> Nodal<D> {
        let mut f = [[0.0; D]; NODES];
        for p in points() {
            let s = PointShape::new(&Shape::at(p.r), cell, p.r[0]);
            let volume = cell.of_point(p.weight, p.r[0]);
            Stress::new(&p.law, &rates(&s, u), volume).add_force(&s, &mut f);
        }
        f
    }

    fn stiffness_times_vector_is_the_internal_force<const D: usize>() {
        for cell in measures() {
            let (k, u) = (stiffness::<D>(cell), some_values::<D>());
            for simd in crate::simd::all() {
                for lane in [0, 5] {
                    let internal = internal_at(cell, (simd, lane), &u);
                    internal_force_is_that_of_the_stiffness(cell, &k, &u, &internal);
                }
            }
        }
    }

    fn internal_force_is_that_of_the_stiffness<const D: usize>(
        cell: CellMeasure,
        k: &Matrix,
        u: &Nodal<D>,
        internal: &Internal<D>,
    ) {
        let by_point = force_point_by_point(cell, u);
        let mut power = 0.0;
        for a in 0..NODES {
            for c in 0..D {
                let row = &k[NODES * c + a];
                let ku: f64 = (0..NODES * D).map(|j| row[j] * u[j % NODES][j / NODES]).sum();
                assert!((ku - internal.force[a][c]).abs() < 1e-11, "node {a}, component {c}");
                assert!((ku - by_point[a][c]).abs() < 1e-11, "node {a}, component {c}");
                power += ku * u[a][c];
            }
        }
        assert!((power - internal.dissipation).abs() < 1e-12 * power);
    }

    #[test]
    fn stiffness_and_internal_force_agree() {
        stiffness_times_vector_is_the_internal_force::<2>();
        stiffness_times_vector_is_the_internal_force::<3>();
    }

    #[test]
    fn stiffness_is_symmetric() {
        for k in measures().map(stiffness::<3>) {
            for i in 0..LOCAL {
                for j in 0..i {
                    assert!((k[i][j] - k[j][i]).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn a_rigid_rotation_with_matching_w_makes_no_force() {
        let u: Nodal<3> = std::array::from_fn(|a| {
            let (x, y) = ((a % 3) as f64 * 0.5 * SIZE[0], (a / 3) as f64 * 0.5 * SIZE[1]);
            [-0.9 * y + 0.2, 0.9 * x - 0.1, 0.9]
        });
        let internal = internal_at(measures()[0], (Simd::detect(), 0), &u);
        assert!(internal.force.iter().flatten().all(|f| f.abs() < 1e-13));
        assert!(internal.dissipation < 1e-25);
    }
}
