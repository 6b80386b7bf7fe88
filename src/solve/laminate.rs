//! This module computes the stiffness of a cell cut by an interface, as a laminate: the two sides
//! are in series in shear along the interface and in parallel in stretching along it.
//!
//! A biquadratic velocity cannot have a kink inside a cell. Integrated directly, it locks: the soft
//! part cannot move where the stiff part does not. With the normal `n` and the tangent `t` of the
//! interface, `e = -2 D_tt` and `g = 2 D_nt`, the true flow has
//!
//! ```text
//! D_tt continuous, its stress discontinuous;   sigma_nt continuous, its rate g discontinuous;
//! sigma_nn = -p + ... continuous.
//! ```
//! Every law is `a e^2 + b (g + k e)^2` with `b = S_gg`, `k = S_eg / b`, `a = S_ee - S_eg^2 / b`
//! (`a = b = eta`, `k = 0` if isotropic). The power of the cell is a sum of squares,
//!
//! ```text
//! max over s in P1 of  2 int s (g + k e) - int s^2 / b      shear stress s along the interface
//! + int a (R e)^2       R e: least squares fit of e by 1 and t.x, weighted by a
//! + c b_h int |(1 - P)(g + k e)|^2 + c a_h int |(1 - R) e|^2 + d beta_h int tr(D)^2
//! ```
//! with integrals of a, b, k over the true shape of either side, `P` the L2 projection on P1, and
//! harmonic means `b_h`, `a_h`, `beta_h`: the softer part resists the remainders of the fits. Around an
//! axis the hoop rate `D_hoop = u/x` is continuous too: `e` is `-2 D_tt - D_hoop` (with `-tr D` instead of
//! `D_nn`, and the whole trace), and `int c (D_hoop - r^2 tr(D)/3)^2` is added with the mean of the hoop
//! viscosities `c`. All terms are squares with positive weights. For any positions of the particles the matrix is
//! therefore positive semi-definite, and its null space contains only rigid motions.
//!
//! **Pressure.** An incompressible flow has `D_nn - D_tt = -2 D_tt`, yet the choice determines the
//! meaning of the multiplier of `div u`. With `D_nn - D_tt` it is the mean stress, which jumps with
//! the viscosity, and a linear pressure cannot jump inside a cell; with `-2 D_tt` it is
//! `-sigma_nn`, which is continuous. With exact geometry, the error of layers of contrast 1e3
//! stretched along themselves is 0.2e-3 instead of 20e-3 at 64 cells.
//!
//! **Uniform limit.** With the contrast `r = min(a_h / a_mean, b_h / b_mean)`, `e` is
//! `D_nn - D_tt - (1 - r^2) tr D`, `c = 0.3 + 0.7 r`, `d = 3 - 2 r`: equal laws give the standard
//! matrix, term by term. If a side has a finite bulk viscosity, `e` is `D_nn - D_tt` and `d = 1`.
//!
//! Relative velocity error x 1e-3 at 64 cells with 16 jittered particles each, mean of three seeds
//! (in brackets: local harmonic mixture): wall in a cell 1e6 2.3 (4.9), inclusions of 1e3 and 1e6
//! 2.0 and 2.1 (2.1, 2.3), of 0.1, 0.01, 1e-3 and 1e-8 0.7, 2.1, 12 and 20 (4.9, 11, 15 and 17),
//! layers of 1e3 sheared 1.2 (1.2), stretched along themselves 7.3 (3.0). In the last case, and in
//! nearly empty holes, the noise of the geometry makes the mixture more accurate. `c = 1` makes the
//! errors of strong inclusions 1.7 times as large, `d = 10` 1.5 times (exact geometry).
//!
//! **Sheets** of 0.25, 0.5 and 0.8 cells, 1e3 times as stiff, stretched along themselves keep 0.52,
//! 0.94 and 0.83 of their strength along the mesh, 0.67, 0.71 and 0.63 at 30 degrees to it. Strips
//! of neighbouring cells that do not meet weaken the sheet: a share distributed evenly over each
//! cell keeps 0.95, 0.91 and 0.81 along the mesh, but 0.04 at 30 degrees.

use super::element::PointShape;
use crate::composition::interface::Interface;
use crate::laws::point::{PointLaw, Sym2};
use crate::space::measure::CellMeasure;
use crate::space::shape::{GAUSS_3X3, GAUSS_6X6, NODES, SUBPOINTS};

/// Number of velocity unknowns of a cell, ordered component by component.
const N: usize = 2 * NODES;
/// A linear form of the velocity unknowns.
type Row = [f64; N];
/// Stiffness matrix on the velocities of a cell.
pub type VelocityMatrix = [[f64; N]; N];

/// Coefficient `c` at infinite contrast.
const LOOSE: f64 = 0.3;
/// Coefficient `d` at infinite contrast.
const DILATION: f64 = 3.0;

/// Largest `a` in units of the harmonic means. In a chain of cut cells whose soft side is far
/// softer, only the tension of the stiff side resists, and its thickness, measured from particles,
/// is noisy. Without a limit the error of layers of contrast 1e3 stretched along themselves is
/// 13e-3 at 64 cells and that of a hole of 1e-8 is 0.19; with 100, 7e-3 and 0.02; with 10, 4e-3 and
/// 0.016, but then the error of holes of 0.01 is 8e-3 instead of 2e-3. If the limit applies to
/// convex soft sides alone, the error of holes of 1e-3 is 12.5e-3 instead of 10.2e-3 with both 1000
/// and 30. Stiff sheets thinner than a cell have no limit: with it they keep a hundredth to a
/// quarter of their strength.
const TENSION: f64 = 100.0;

/// A cell cut into two sides.
pub struct Cut<'a> {
    /// The interface in the cell.
    pub interface: &'a Interface,
    /// Laws of the two sides at the points of [`GAUSS_6X6`].
    pub sides: &'a [[PointLaw; SUBPOINTS]; 2],
    /// Measure of the cell.
    pub cell: CellMeasure,
}

/// Directions of `e` and `g` in the space of `(D_xx - D_yy, 2 D_xy)`.
struct Frame {
    e: [f64; 2],
    g: [f64; 2],
    /// Tangent.
    t: [f64; 2],
    /// `1 - r^2`, the factor of the trace in `e`.
    lack: f64,
}

impl Frame {
    fn new([nx, ny]: [f64; 2]) -> Self {
        let (c, s) = (nx * nx - ny * ny, 2.0 * nx * ny);
        Frame { e: [c, s], g: [-s, c], t: [-ny, nx], lack: 0.0 }
    }

    /// The coefficients `(a, 1/b, k)` of a law.
    fn coefficients(&self, s: &Sym2) -> (f64, f64, f64) {
        let bilinear = |x: &[f64; 2], y: &[f64; 2]| {
            s.a * x[0] * y[0] + s.b * x[1] * y[1] + s.c * (x[0] * y[1] + x[1] * y[0])
        };
        let (ee, eg, gg) =
            (bilinear(&self.e, &self.e), bilinear(&self.e, &self.g), bilinear(&self.g, &self.g));
        (ee - eg * eg / gg, 1.0 / gg, eg / gg)
    }

    /// The rate `x (D_xx - D_yy) + y (2 D_xy) + z tr D` as a linear form of the nodal velocities.
    fn row(s: &PointShape, [x, y]: [f64; 2], z: f64) -> Row {
        let mut row = [0.0; N];
        for a in 0..NODES {
            row[a] = (z + x) * s.gx[a] + y * s.gy[a];
            row[NODES + a] = (z - x) * s.gy[a] + y * s.gx[a];
        }
        if s.per_radius != 0.0 {
            for a in 0..NODES {
                row[a] += z * s.per_radius * s.n[a];
            }
        }
        row
    }

    /// The hoop rate less a third of the part of the trace that `e` has.
    fn hoop(&self, s: &PointShape) -> Row {
        let mut row = Frame::row(s, [0.0; 2], (self.lack - 1.0) / 3.0);
        for a in 0..NODES {
            row[a] += s.per_radius * s.n[a];
        }
        row
    }

    fn stretch(&self, s: &PointShape) -> Row {
        Frame::row(s, self.e, -self.lack)
    }

    fn shear(&self, s: &PointShape) -> Row {
        Frame::row(s, self.g, 0.0)
    }

    /// `t.x`, in half cells.
    fn along(&self, r: [f64; 2], [hx, hy]: [f64; 2]) -> f64 {
        (self.t[0] * r[0] * hx + self.t[1] * r[1] * hy) / (hx * hy).sqrt()
    }
}

/// Means of the laws over the cell.
#[derive(Default)]
struct Means {
    a: f64,
    a_inverse: f64,
    b: f64,
    b_inverse: f64,
    k: f64,
    dilation_share: f64,
    dilation_inverse: f64,
}

impl Means {
    /// `beta_h`, and whether both sides are incompressible.
    fn dilation(&self) -> (f64, bool) {
        if self.dilation_share == 0.0 {
            return (0.0, false);
        }
        let mean = self.dilation_share * self.dilation_share / self.dilation_inverse;
        (mean, self.dilation_share > 1.0 - 1e-9)
    }
}

/// Replaces the mixed `a` by a mean in which neither side exceeds `limit`.
fn limit_tension(cut: &Cut, frame: &Frame, limit: f64, at: &mut [[f64; 3]; SUBPOINTS]) {
    for (q, at) in at.iter_mut().enumerate() {
        let share = cut.interface.share[q];
        let [a, b] = cut.sides.each_ref().map(|s| frame.coefficients(&s[q].shear).0.min(limit));
        at[0] = (1.0 - share) * a + share * b;
    }
}

/// The mixed coefficients `(a, 1/b, k)` at every point, and their means.
fn coefficients(cut: &Cut, frame: &Frame) -> ([[f64; 3]; SUBPOINTS], Means) {
    let mut at = [[0.0; 3]; SUBPOINTS];
    let mut means = Means::default();
    for (q, (at, g)) in at.iter_mut().zip(GAUSS_6X6.iter()).enumerate() {
        let share = cut.interface.share[q];
        for (side, phi) in cut.sides.iter().zip([1.0 - share, share]) {
            if phi == 0.0 {
                continue;
            }
            let law = &side[q];
            let (a, b_inverse, k) = frame.coefficients(&law.shear);
            for (sum, v) in at.iter_mut().zip([a, b_inverse, k]) {
                *sum += phi * v;
            }
            let w = cut.cell.share(g.weight, g.r[0]) * phi;
            means.a += w * a;
            means.a_inverse += w / a;
            means.b += w / b_inverse;
            means.b_inverse += w * b_inverse;
            means.k += w * k;
            if law.dilation > 0.0 {
                means.dilation_share += w;
                means.dilation_inverse += w / law.dilation;
            }
        }
    }
    (at, means)
}

/// Stiffness matrix of a cut cell.
pub fn matrix(cut: &Cut) -> VelocityMatrix {
    let mut frame = Frame::new(cut.interface.normal);
    let (mut at, means) = coefficients(cut, &frame);
    let (a_h, b_h) = (1.0 / means.a_inverse, 1.0 / means.b_inverse);
    // The limit is relative to the softest response of the cell, so equal layered laws are not
    // limited.
    let limit = TENSION * a_h.max(b_h);
    if means.a > 0.01 * limit && !cut.interface.sheet {
        limit_tension(cut, &frame, limit, &mut at);
    }
    let r = (a_h / means.a).min(b_h / means.b).min(1.0);
    let (dilation, incompressible) = means.dilation();
    let mut stiffening = 1.0;
    if incompressible {
        frame.lack = 1.0 - r * r;
        stiffening = DILATION + (1.0 - DILATION) * r;
    }
    let loose = LOOSE + (1.0 - LOOSE) * r;

    // Integrals over the two sides.
    let (cell, volume) = (cut.cell, cut.cell.volume());
    let mut k = [[0.0; N]; N];
    let mut compliance = [[0.0; 3]; 3];
    let mut tension = [[0.0; 2]; 2];
    let mut stretch = [[0.0; N]; 2];
    let mut shear = [[0.0; N]; 3];
    for (q, (g, [a, b_inverse, slant])) in GAUSS_6X6.iter().zip(at).enumerate() {
        let s = PointShape::new(&g.shape, cell, g.r[0]);
        let weight = cell.share(g.weight, g.r[0]);
        let e = frame.stretch(&s);
        let v = cell.pressure_basis(g.r);
        let u = [1.0, frame.along(g.r, cut.cell.size)];
        for i in 0..3 {
            for j in 0..=i {
                compliance[i][j] += weight * b_inverse * v[i] * v[j];
            }
            if slant != 0.0 {
                add_row(&mut shear[i], weight * slant * v[i], &e);
            }
        }
        for i in 0..2 {
            for j in 0..=i {
                tension[i][j] += weight * a * u[i] * u[j];
            }
            add_row(&mut stretch[i], weight * a * u[i], &e);
        }
        if cell.is_ring() {
            let share = cut.interface.share[q];
            let hoop = (1.0 - share) * cut.sides[0][q].hoop + share * cut.sides[1][q].hoop;
            add_square(&mut k, volume * weight * hoop, &frame.hoop(&s));
        }
    }
    // Integrals over the whole cell, for which the 3 x 3 rule is exact.
    let mut fitted = [[0.0; N]; 3];
    let shape = GAUSS_3X3.each_ref().map(|g| PointShape::new(&g.shape, cell, g.r[0]));
    let sheared = shape.each_ref().map(|s| {
        let mut row = frame.shear(s);
        add_row(&mut row, means.k, &frame.stretch(s));
        row
    });
    let squares = cell.pressure_squares();
    for ((g, s), row) in GAUSS_3X3.iter().zip(&shape).zip(&sheared) {
        let along = frame.shear(s);
        let weight = cell.share(g.weight, g.r[0]);
        for (i, v) in cell.pressure_basis(g.r).into_iter().enumerate() {
            add_row(&mut shear[i], weight * v, &along);
            add_row(&mut fitted[i], weight * v / squares[i], row);
        }
    }

    lower_solve(&mut compliance, &mut shear);
    shear.iter().for_each(|row| add_square(&mut k, volume, row));
    lower_solve(&mut tension, &mut stretch);
    stretch.iter().for_each(|row| add_square(&mut k, volume, row));
    upper_solve(&tension, &mut stretch);
    for ((g, s), mut row) in GAUSS_3X3.iter().zip(&shape).zip(sheared) {
        let w = volume * cell.share(g.weight, g.r[0]);
        for (fit, v) in fitted.iter().zip(cell.pressure_basis(g.r)) {
            add_row(&mut row, -v, fit);
        }
        add_square(&mut k, w * loose * b_h, &row);
        let mut row = frame.stretch(s);
        add_row(&mut row, -1.0, &stretch[0]);
        add_row(&mut row, -frame.along(g.r, cut.cell.size), &stretch[1]);
        add_square(&mut k, w * loose * a_h, &row);
        let dilation = if cell.is_ring() { dilation / 1.5 } else { dilation };
        add_square(&mut k, w * stiffening * dilation, &Frame::row(s, [0.0; 2], 1.0));
    }
    for i in 0..N {
        for j in 0..i {
            k[j][i] = k[i][j];
        }
    }
    k
}

#[inline(always)]
fn add_row(sum: &mut Row, f: f64, row: &Row) {
    for (s, v) in sum.iter_mut().zip(row) {
        *s += f * v;
    }
}

/// Adds `w row^T row` to `k`, of which only the lower triangle is used.
#[inline(always)]
fn add_square(k: &mut VelocityMatrix, w: f64, row: &Row) {
    for (i, (line, r)) in k.iter_mut().zip(row).enumerate() {
        // Loops over whole halves of a row vectorise; they contain the lower triangle.
        let length = if i < NODES { NODES } else { N };
        for (s, v) in line[..length].iter_mut().zip(&row[..length]) {
            *s += w * r * v;
        }
    }
}

/// Replaces the lower triangle of a small positive definite matrix by its Cholesky factor, and the
/// rows by `L^-1 rows`. A pivot lost to rounding is replaced by a small positive one.
fn lower_solve<const R: usize>(m: &mut [[f64; R]; R], rows: &mut [Row; R]) {
    for i in 0..R {
        for j in 0..=i {
            let s: f64 = m[i][j] - (0..j).map(|q| m[i][q] * m[j][q]).sum::<f64>();
            m[i][j] = if i == j { s.max(1e-14 * m[i][i]).sqrt() } else { s / m[j][j] };
        }
        for j in 0..i {
            let (before, after) = rows.split_at_mut(i);
            add_row(&mut after[0], -m[i][j], &before[j]);
        }
        rows[i].iter_mut().for_each(|v| *v /= m[i][i]);
    }
}

/// Replaces the rows by `L^-T rows`.
fn upper_solve<const R: usize>(l: &[[f64; R]; R], rows: &mut [Row; R]) {
    for i in (0..R).rev() {
        for j in i + 1..R {
            let (before, after) = rows.split_at_mut(j);
            add_row(&mut before[i], -l[j][i], &after[0]);
        }
        rows[i].iter_mut().for_each(|v| *v /= l[i][i]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::composition::features::Strip;
    use crate::composition::interface::Surroundings;
    use crate::laws::{director::Orientation, layered};
    use crate::scene::Placement;
    use crate::solve::element::{LOCAL, Matrix, mirror};
    use crate::solve::terms::stress::add_stiffness;
    use crate::space::measure::Measure;
    use crate::space::mesh::{Axis, Mesh};
    use crate::space::particles::Particles;
    use crate::space::seeding::Seeding;
    use crate::space::shape::GaussPoint;
    use nalgebra::SMatrix;

    const SIZE: [f64; 2] = [0.7, 1.3];

    fn isotropic(eta: f64) -> PointLaw {
        let shear = Sym2::isotropic(eta);
        PointLaw { shear, dilation: eta, hoop: 3.0 * eta, ..PointLaw::default() }
    }

    fn layered(eta: f64, eta_s: f64, angle: f64) -> PointLaw {
        let shear = layered::shear(eta, eta_s, &Orientation::of([angle.cos(), angle.sin()]));
        PointLaw { shear, dilation: eta, hoop: 3.0 * eta, ..PointLaw::default() }
    }

    const PLANE: Measure = Measure::PLANE;

    fn of(interface: &Interface, a: PointLaw, b: PointLaw) -> VelocityMatrix {
        in_cell(PLANE.of_cell(SIZE, 0.0), interface, a, b)
    }

    fn in_cell(
        cell: CellMeasure,
        interface: &Interface,
        a: PointLaw,
        b: PointLaw,
    ) -> VelocityMatrix {
        matrix(&Cut { interface, sides: &[[a; SUBPOINTS], [b; SUBPOINTS]], cell })
    }

    /// A straight interface through the cell, with the second material above it.
    fn straight(angle: f64, offset: f64) -> Interface {
        let normal = [-angle.sin(), angle.cos()];
        let share = std::array::from_fn(|q| {
            let r = GAUSS_6X6[q].r;
            let d = 0.5 * (normal[0] * r[0] * SIZE[0] + normal[1] * r[1] * SIZE[1]);
            if d > offset { 1.0 } else { 0.0 }
        });
        Interface { share, normal, sheet: false, trust: 1.0 }
    }

    /// With the points of the laminate: hoop rates are not polynomials.
    fn standard(cell: CellMeasure, law: &PointLaw) -> Matrix {
        let mut k: Matrix = [[0.0; LOCAL]; LOCAL];
        let mut add = |g: &GaussPoint, law: &PointLaw| {
            let volume = cell.of_point(g.weight, g.r[0]);
            add_stiffness::<2>(&mut k, &PointShape::new(&g.shape, cell, g.r[0]), law, volume);
        };
        GAUSS_3X3.iter().for_each(|g| add(g, &PointLaw { hoop: 0.0, ..*law }));
        let hoop = PointLaw { hoop: law.hoop, ..PointLaw::default() };
        GAUSS_6X6.iter().for_each(|g| add(g, &hoop));
        mirror::<2>(&mut k);
        k
    }

    fn power(k: &VelocityMatrix, l: [[f64; 2]; 2]) -> f64 {
        let u: Row = std::array::from_fn(|j| {
            let a = j % NODES;
            let (x, y) = ((a % 3) as f64 * 0.5 * SIZE[0], (a / 3) as f64 * 0.5 * SIZE[1]);
            l[j / NODES][0] * x + l[j / NODES][1] * y
        });
        (0..N).map(|i| u[i] * (0..N).map(|j| k[i][j] * u[j]).sum::<f64>()).sum()
    }

    #[test]
    fn equal_laws_give_the_standard_matrix() {
        let compressible = PointLaw { dilation: 0.0, ..isotropic(2.0) };
        for law in [isotropic(2.5), layered(3.0, 0.2, 0.4), compressible] {
            for cell in [PLANE.of_cell(SIZE, 0.0), Measure::RING.of_cell(SIZE, 0.8)] {
                let expected = standard(cell, &law);
                for (angle, offset) in [(0.3, 0.1), (1.5, -0.2), (-0.8, 0.0)] {
                    let k = in_cell(cell, &straight(angle, offset), law, law);
                    for i in 0..N {
                        for j in 0..N {
                            assert!((k[i][j] - expected[i][j]).abs() < 1e-10, "{i}, {j}");
                        }
                    }
                }
            }
        }
    }

    /// Velocity gradient of a stretch along the interface (`s = 1`) or a shear along it (`s = 0`).
    fn along(angle: f64, s: f64) -> [[f64; 2]; 2] {
        let (t, n) = ([angle.cos(), angle.sin()], [-angle.sin(), angle.cos()]);
        std::array::from_fn(|i| {
            std::array::from_fn(|j| s * (t[i] * t[j] - n[i] * n[j]) + (1.0 - s) * t[i] * n[j])
        })
    }

    #[test]
    fn stretch_is_in_parallel_and_shear_in_series() {
        for contrast in [1e-6, 1e-2, 30.0, 1e6] {
            for angle in [0.0, 0.4, 1.2] {
                let interface = straight(angle, 0.05);
                let k = of(&interface, isotropic(1.0), isotropic(contrast));
                let phi: f64 =
                    GAUSS_6X6.iter().zip(interface.share).map(|(g, s)| g.weight * s).sum();
                let area = SIZE[0] * SIZE[1];
                // Beyond the limit only a part of the strength of the stiff side acts.
                let limit = TENSION / (1.0 - phi + phi / contrast);
                let mean = (1.0 - phi) * limit.min(1.0) + phi * contrast.min(limit);
                let stretched = power(&k, along(angle, 1.0)) / (4.0 * mean * area);
                assert!((stretched - 1.0).abs() < 1e-8, "{contrast} {angle}: {stretched}");
                let series = 1.0 / (1.0 - phi + phi / contrast);
                let sheared = power(&k, along(angle, 0.0)) / area;
                assert!(sheared > 0.999 * series, "{contrast} {angle}: {sheared}");
                assert!(sheared < 6.0 * series, "{contrast} {angle}: {sheared} {series}");
            }
        }
    }

    /// Interface in the central one of three by three cells of random particles. The second
    /// material is beyond a random line or, with `few`, only the first `few` particles of the
    /// central cell.
    fn random_interface(seed: u64, few: Option<usize>) -> Option<Interface> {
        let axis = |h: f64| Axis::new((0..4).map(|k| k as f64 * h).collect(), false);
        let mesh = Mesh::new(axis(SIZE[0]), axis(SIZE[1]));
        let seeding = Seeding { side: 3, placement: Placement::Random, seed };
        let mut particles = Particles::default();
        let (angle, offset) = (seed as f64 * 0.7, 0.4 * (seed as f64 * 1.3).sin());
        for cell in 0..mesh.cells() {
            let mut random = seeding.random(cell);
            for (k, p) in seeding.positions(&mesh, cell, &mut random).into_iter().enumerate() {
                let d = angle.cos() * (p[0] - 1.5 * SIZE[0]) + angle.sin() * (p[1] - 1.5 * SIZE[1]);
                let second = match few {
                    Some(few) => cell == 4 && k < few,
                    None => d > offset,
                };
                particles.position.push(p);
                particles.volume.push(1.0);
                particles.material.push(u8::from(second));
            }
        }
        particles.sort(&mesh);
        let held = particles.of_cell(4).filter(|&p| particles.material[p] == 1).count();
        let wanted = held as f64 / 9.0;
        let mut around = Surroundings::default();
        around.gather(&mesh, &particles, 4, [0, 1]);
        around.interface(wanted)
    }

    #[test]
    fn definite_whatever_the_particles_do() {
        for seed in 0..40 {
            let angle = 0.7 * seed as f64;
            let strip = |width| Strip {
                normal: [angle.cos(), angle.sin()],
                offset: 0.7 * (1.3 * angle).sin(),
                width,
            };
            let of_sheet = |w, second| Some(Interface::of_sheet(&strip(w), second, SIZE, 0.3));
            let few = [None, Some(1), Some(2), Some(8)];
            let interfaces = few.map(|few| (few, random_interface(seed, few)));
            let sheets = [(None, of_sheet(0.1, true)), (None, of_sheet(0.8, false))];
            for (few, interface) in interfaces.into_iter().chain(sheets) {
                let Some(interface) = interface else { continue };
                for exponent in [-8, -3, 0, 4, 8] {
                    let eta = 10f64.powi(exponent);
                    let soft = eta.min(1.0);
                    for (a, b) in [
                        (isotropic(1.0), isotropic(eta)),
                        (layered(1.0, 0.1, 0.3), isotropic(eta)),
                        (layered(1.0, 0.01, 0.9), layered(eta, 0.1 * eta, 2.0)),
                    ] {
                        let k = of(&interface, a, b);
                        let m = SMatrix::<f64, N, N>::from_fn(|i, j| k[i][j]);
                        assert!((m - m.transpose()).abs().max() == 0.0);
                        let mut values: Vec<f64> =
                            m.symmetric_eigenvalues().iter().copied().collect();
                        values.sort_by(f64::total_cmp);
                        let rounding = 1e-12 * values[N - 1];
                        assert!(values[0] > -rounding, "{seed} {few:?} {exponent}: {values:?}");
                        // Only the three rigid motions have zero power.
                        assert!(values[2] < rounding, "{seed} {few:?} {exponent}: {values:?}");
                        assert!(values[3] > 1e-4 * soft, "{seed} {few:?} {exponent}: {values:?}");
                    }
                }
            }
        }
    }
}
