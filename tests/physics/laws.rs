//! A conformance suite for the laws that assembly calls: symmetric, positive, frame-indifferent, equal
//! to the source's equations, right in the limits.

use grainscope::laws::cosserat::{Cosserat, couple_viscosity};
use grainscope::laws::director::{self, Orientation};
use grainscope::laws::flow_curve::{FlowCurve, Friction, Strength};
use grainscope::laws::mixture::Mixture;
use grainscope::laws::point::{PointLaw, Sym2};
use grainscope::laws::rates::{Rates, Stress};
use grainscope::laws::{Here, Law, LocalFlow, Shear, granular};
use nalgebra::{Matrix2, Matrix6, Rotation2, Vector2, Vector6};

const ETA: f64 = 1000.0;
const ANGLES: [f64; 7] =
    [-1.4, -0.7, 0.0, 0.3, std::f64::consts::FRAC_PI_4, 1.1, std::f64::consts::FRAC_PI_2];

fn unit(angle: f64) -> Vector2<f64> {
    Vector2::new(angle.cos(), angle.sin())
}

/// No rotation, one with a single internal length, and those of layers with a length of their own: a
/// larger one, a smaller one, and one without the other.
fn rotations() -> [Option<Cosserat>; 5] {
    let length = |couple, layer_couple| Some(Cosserat { coupling: 300.0, couple, layer_couple });
    [None, length(12.0, 12.0), length(12.0, 70.0), length(12.0, 0.0), length(0.0, 12.0)]
}

/// Every kind of law, classical and Cosserat, incompressible and not.
fn laws() -> Vec<Law> {
    let mut list = Vec::new();
    for shear in [
        Shear::Newtonian,
        Shear::Layered { layer_viscosity: 1.0 },
        Shear::Layered { layer_viscosity: 3.0 * ETA },
    ] {
        for rotation in rotations() {
            for compliance in [0.0, 1e-4] {
                list.push(Law { shear, rotation, compliance, curve: None });
            }
        }
    }
    list
}

/// The law of a material whose layers have their normal at an angle.
fn at(law: &Law, angle: f64) -> PointLaw {
    let orientation = Orientation::of([angle.cos(), angle.sin()]);
    law.at(&Here::without_flow(ETA, &orientation))
}

fn rates(l: &Matrix2<f64>, w: f64, kappa: Vector2<f64>) -> Rates {
    Rates::cosserat([[l.m11, l.m12], [l.m21, l.m22]], w, [kappa.x, kappa.y])
}

/// The viscous stress tensor and the couple stresses.
fn tensors(s: &Stress) -> (Matrix2<f64>, Vector2<f64>) {
    let [a, b] = s.deviator;
    let skew = 0.5 * s.skew;
    (Matrix2::new(s.mean + a, b - skew, b + skew, s.mean - a), Vector2::from(s.couple))
}

fn vector(r: &Rates) -> Vector6<f64> {
    Vector6::from([r.d[0], r.d[1], r.trace, r.relative_spin, r.kappa[0], r.kappa[1]])
}

fn rates_of(v: &Vector6<f64>) -> Rates {
    let (d, kappa) = ([v[0], v[1]], [v[4], v[5]]);
    Rates { d, trace: v[2], relative_spin: v[3], kappa, ..Rates::default() }
}

fn stress_vector(law: &PointLaw, v: &Vector6<f64>) -> Vector6<f64> {
    let s = law.stress(&rates_of(v), 1.0);
    Vector6::from([s.deviator[0], s.deviator[1], s.mean, s.skew, s.couple[0], s.couple[1]])
}

const SOME: [f64; 6] = [0.3, -0.7, 0.2, 1.1, -0.4, 0.9];

#[test]
fn stresses_have_a_symmetric_positive_derivative_and_do_positive_work() {
    for law in laws() {
        for angle in ANGLES {
            let law = at(&law, angle);
            let here = Vector6::from(SOME);
            let mut tangent = Matrix6::zeros();
            for k in 0..6 {
                let h = 1e-3;
                let mut there = here;
                there[k] += h;
                let change = (stress_vector(&law, &there) - stress_vector(&law, &here)) / h;
                tangent.set_column(k, &change);
            }
            assert!((tangent - tangent.transpose()).norm() < 1e-7 * ETA);
            assert!(tangent.symmetric_eigenvalues().min() > -1e-7 * ETA);
            // A linear law is its own derivative.
            assert!((tangent * here - stress_vector(&law, &here)).norm() < 1e-7 * ETA);
            let work = stress_vector(&law, &here).dot(&here);
            assert!(work > 0.0 && (work - law.power(&rates_of(&here))).abs() < 1e-12 * work);
        }
    }
}

#[test]
fn laws_are_frame_indifferent() {
    let l = Matrix2::new(0.3, -0.7, 1.1, 0.2);
    let (w, kappa) = (0.4, Vector2::new(0.5, -0.8));
    for law in laws() {
        for angle in ANGLES {
            for turn in ANGLES {
                let q = *Rotation2::new(turn).matrix();
                let (stress, couple) = tensors(&at(&law, angle).stress(&rates(&l, w, kappa), 1.0));
                let turned = rates(&(q * l * q.transpose()), w, q * kappa);
                let (other, couple_other) = tensors(&at(&law, angle + turn).stress(&turned, 1.0));
                assert!((q * stress * q.transpose() - other).norm() < 1e-9 * ETA, "{turn}");
                assert!((q * couple - couple_other).norm() < 1e-9 * ETA, "{turn}");
            }
        }
    }
}

#[test]
fn stresses_are_those_of_the_source() {
    // (10)-(13) and (19)-(20), index by index; `-p` replaces the trace's part where incompressible.
    let l = Matrix2::new(0.4, 0.9, -0.1, -0.4);
    let (w, kappa) = (0.35, Vector2::new(0.5, -0.8));
    let (coupling, couple, eta_s) = (300.0, 12.0, 50.0);
    for angle in ANGLES {
        let n = unit(angle);
        let d: Matrix2<f64> = 0.5 * (l + l.transpose());
        let delta = |i: usize, j: usize| if i == j { 1.0_f64 } else { 0.0 };
        let a = |i: usize, j: usize, k: usize, m: usize| {
            0.5 * (n[i] * n[k] * delta(m, j)
                + n[j] * n[k] * delta(i, m)
                + n[i] * n[m] * delta(k, j)
                + n[j] * n[m] * delta(i, k))
                - 2.0 * n[i] * n[j] * n[k] * n[m]
        };
        let mut expected = 2.0 * ETA * d;
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            for (k, m) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                expected[(i, j)] -= 2.0 * (ETA - eta_s) * a(i, j, k, m) * d[(k, m)];
            }
        }
        // sigma_yx - sigma_xy = 4 eta_c (o - w)
        let spin = 0.5 * (l[(1, 0)] - l[(0, 1)]);
        let skew = 2.0 * coupling * (spin - w);
        expected += Matrix2::new(0.0, -skew, skew, 0.0);
        let law = Law {
            shear: Shear::Layered { layer_viscosity: eta_s },
            rotation: Some(Cosserat::isotropic(coupling, couple)),
            compliance: 0.0,
            curve: None,
        };
        let (stress, couples) = tensors(&at(&law, angle).stress(&rates(&l, w, kappa), 1.0));
        assert!((stress - expected).norm() < 1e-9 * ETA, "{angle}: {stress} {expected}");
        assert!((couples - couple * kappa).norm() < 1e-9);
    }
}

#[test]
fn laws_have_their_limits() {
    let shear = |layer_viscosity, angle| {
        let law = Law { shear: Shear::Layered { layer_viscosity }, ..Law::default() };
        at(&law, angle).shear
    };
    for angle in ANGLES {
        // Layers as viscous as the rest are isotropic, and directors are axes.
        assert_eq!(shear(ETA, angle), at(&Law::default(), 0.0).shear);
        let (s, t) = (shear(10.0, angle), shear(10.0, angle + std::f64::consts::PI));
        assert!((s.a - t.a).abs() + (s.b - t.b).abs() + (s.c - t.c).abs() < 1e-9);
        // One orientation has the viscosity of its angle in simple shear.
        let viscosity = shear(500.0, angle).quadratic([0.0, 1.0]);
        assert!((viscosity - 500.0 - 500.0 * (2.0 * angle).sin().powi(2)).abs() < 1e-9);
        // The eigenvalues are eta and eta_s.
        let s = shear(50.0, angle);
        let m = Matrix2::new(s.a, s.c, s.c, s.b).symmetric_eigenvalues();
        assert!((m.max() - ETA).abs() < 1e-9 && (m.min() - 50.0).abs() < 1e-9);
    }
    // A finite bulk viscosity takes the trace out of the viscous part.
    let compressible = Law { compliance: 1e-3, ..Law::default() };
    assert_eq!(at(&compressible, 0.0).dilation, 0.0);
    // A classical fluid feels no rotation.
    let classical = at(&Law::default(), 0.0).stress(&rates_of(&Vector6::from(SOME)), 1.0);
    assert_eq!((classical.skew, classical.couple), (0.0, [0.0; 2]));
}

#[test]
fn layers_bend_with_their_own_length() {
    // mu = 2 eta_c (R^2 1 + (R_l^2 - R^2) t t^T) grad w, also as a mean over directors.
    let (coupling, r, r_l) = (300.0, 0.2, 0.7);
    let law = |layer_viscosity| Law {
        shear: Shear::Layered { layer_viscosity },
        rotation: Some(Cosserat {
            coupling,
            couple: couple_viscosity(coupling, r),
            layer_couple: couple_viscosity(coupling, r_l),
        }),
        ..Law::default()
    };
    let kappa = Vector2::new(0.5, -0.8);
    let rates = Rates { kappa: [kappa.x, kappa.y], ..Rates::default() };
    let mut orientation = Orientation::default();
    let mut matrix = Matrix2::identity() * (2.0 * coupling * r * r);
    for (k, angle) in ANGLES.into_iter().enumerate() {
        let t = Vector2::new(-angle.sin(), angle.cos());
        let weight = 1.0 + k as f64;
        orientation.add(weight, [angle.cos(), angle.sin()]);
        matrix += t * t.transpose() * (2.0 * coupling * (r_l * r_l - r * r) * weight / 28.0);
        let single = law(50.0).at(&Here::without_flow(ETA, &Orientation::of([-t.y, t.x])));
        let along = single.stress(&Rates { kappa: [t.x, t.y], ..Rates::default() }, 1.0).couple;
        let across = single.stress(&Rates { kappa: [-t.y, t.x], ..Rates::default() }, 1.0).couple;
        assert!((Vector2::from(along) - 2.0 * coupling * r_l * r_l * t).norm() < 1e-9);
        let n = Vector2::new(-t.y, t.x);
        assert!((Vector2::from(across) - 2.0 * coupling * r * r * n).norm() < 1e-9);
    }
    // Layers that only bend have the viscosity of an isotropic fluid.
    for layer_viscosity in [50.0, ETA] {
        let found = law(layer_viscosity).at(&Here::without_flow(ETA, &orientation));
        let couple = Vector2::from(found.stress(&rates, 1.0).couple);
        assert!((couple - matrix * kappa).norm() < 1e-9, "{couple} {}", matrix * kappa);
        assert!((found.power(&rates) - kappa.dot(&(matrix * kappa))).abs() < 1e-9);
    }
    // Materials that share a cell have the mean of their couple stresses.
    let here = Here::without_flow(ETA, &orientation);
    let (layers, plain) = (law(50.0).at(&here), Law::default().at(&here));
    for mut mixture in [Mixture::default(), Mixture::parallel(), Mixture::around_drops(3.0)] {
        mixture.add(0.3, &layers);
        mixture.add(0.7, &plain);
        let couple = Vector2::from(mixture.law().stress(&rates, 1.0).couple);
        assert!((couple - 0.3 * matrix * kappa).norm() < 1e-9);
    }
    // With a flow curve, the square of the rate has the power of the bending.
    let strength = Strength::HerschelBulkley { yield_stress: 1.0, consistency: 1.0, index: 1.0 };
    let curve = Some(FlowCurve { strength, smallest: 1e-6, largest: 1e6 });
    let g = Law { curve, ..law(0.1) }.rate(&rates, &orientation);
    assert!((g * g - kappa.dot(&(matrix * kappa))).abs() < 1e-9);
}

#[test]
fn laws_depend_on_nothing_that_they_do_not_declare() {
    let orientation = Orientation::of([0.6, 0.8]);
    for law in laws() {
        let declared = law.depends_on();
        let rest = Here::without_flow(ETA, &orientation);
        let flow = LocalFlow { rates: rates_of(&Vector6::from(SOME)), pressure: 7.0 };
        let here = Here { flow: Some(flow), ..rest };
        assert!(declared.needs_flow() || law.at(&here) == law.at(&rest));
        let other = Orientation::of([0.8, -0.6]);
        let turned = Here { orientation: &other, ..rest };
        assert!(declared.history || law.at(&turned) == law.at(&rest));
    }
}

#[test]
fn a_rigid_rotation_with_matching_spin_gives_exactly_zero() {
    for w in [1.0, -0.37, 1e6] {
        let l = Matrix2::new(0.0, -w, w, 0.0);
        assert_eq!(vector(&rates(&l, w, Vector2::zeros())), Vector6::zeros());
    }
}

#[test]
fn equal_dashpots_give_equal_viscosities() {
    let v = granular::viscosities(&granular::Contacts {
        porosity: 0.4,
        coordination: 5.0,
        normal_dashpot: 7.0,
        tangential_dashpot: 7.0,
    });
    assert!((v.shear - v.coupling).abs() < 1e-12 && (v.shear - v.bulk).abs() < 1e-12);
    assert!((v.shear - 0.6 * 5.0 * 14.0 / (4.0 * std::f64::consts::PI)).abs() < 1e-12);
}

#[test]
fn the_director_follows_the_exact_map_in_shear_strain_and_rotation() {
    // Simple shear g: n ~ (N_x, N_y - g N_x).
    for a in ANGLES {
        let mut n = unit(a);
        let l = Matrix2::new(0.0, 1.0, 0.0, 0.0);
        for _ in 0..50 {
            n = director::advance(&n, &l, 0.08);
        }
        let expected = Vector2::new(a.cos(), a.sin() - 4.0 * a.cos()).normalize();
        assert!((n - expected).norm() < 1e-12 && (n.norm() - 1.0).abs() < 1e-15);
        // A rigid rotation rotates it with the body.
        let n = director::advance(&unit(a), &Matrix2::new(0.0, -1.0, 1.0, 0.0), 0.4);
        assert!((n - unit(a + 0.4)).norm() < 1e-12);
        // After a large step of pure strain it is still a unit vector.
        let n = director::advance(&unit(a), &Matrix2::new(1.0, 0.0, 0.0, -1.0), 30.0);
        assert!((n.norm() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn exponential_equals_its_series() {
    for l in [
        Matrix2::new(0.3, -1.2, 0.4, 0.1),
        Matrix2::new(0.0, 1.0, 0.0, 0.0),
        Matrix2::new(1e-6, 2e-6, -3e-6, 1e-6),
    ] {
        let mut term = Matrix2::identity();
        let mut sum = Matrix2::identity();
        for k in 1..40 {
            term = term * l / f64::from(k);
            sum += term;
        }
        assert!((director::exponential(&l) - sum).norm() < 1e-13);
    }
}

#[test]
fn mixtures_are_exact_for_one_law_and_between_the_bounds_for_two() {
    let law = |eta: f64| PointLaw {
        shear: Sym2 { a: eta, b: 0.6 * eta, c: 0.1 * eta },
        dilation: eta,
        coupling: eta,
        couple: 0.1 * eta,
        ..PointLaw::default()
    };
    for (eta, other) in [(1.0, 1e8), (1e8, 1.0), (3.0, 3.0)] {
        for phi in [0.0, 1e-9, 0.3, 0.5, 1.0] {
            let mut m = Mixture::default();
            m.add(phi, &law(eta));
            m.add(1.0 - phi, &law(other));
            let s = m.law().shear;
            let det = s.a * s.b - s.c * s.c;
            assert!(s.a > 0.0 && det > 0.0);
            let harmonic = 1.0 / (phi / eta + (1.0 - phi) / other);
            assert!((s.a / harmonic - 1.0).abs() < 1e-9, "{} {harmonic}", s.a);
        }
    }
}

/// Laws with a flow curve: isotropic, Cosserat and layered, with a yield stress and with friction.
fn generalised() -> Vec<Law> {
    let friction = Friction {
        at_rest: 0.38,
        fast: 0.64,
        inertial_number: 0.279,
        diameter: 0.04,
        grain_density: 1.7,
        cohesion: 0.1,
    };
    let mud = Strength::HerschelBulkley { yield_stress: 2.0, consistency: 3.0, index: 0.6 };
    // A larger coupling than the mean shear viscosity is integrated otherwise.
    let rotation = Some(Cosserat::isotropic(0.5, 0.3));
    let bending = Some(Cosserat { coupling: 0.5, couple: 0.3, layer_couple: 2.0 });
    let mut list = Vec::new();
    for strength in [mud, Strength::Friction(friction)] {
        for shear in [Shear::Newtonian, Shear::Layered { layer_viscosity: 0.2 }] {
            for rotation in [None, rotation, bending] {
                let curve = Some(FlowCurve { strength, smallest: 1e-6, largest: 1e6 });
                list.push(Law { shear, rotation, compliance: 0.0, curve });
            }
        }
    }
    list
}

/// The stress of a law at given rates, as a vector.
fn stress_at(
    law: &Law,
    orientation: &Orientation,
    r: &Vector6<f64>,
    pressure: f64,
) -> Vector6<f64> {
    let flow = LocalFlow { rates: rates_of(r), pressure };
    let here = Here { flow: Some(flow), ..Here::without_flow(1.0, orientation) };
    let s = law.at(&here).stress(&rates_of(r), 1.0);
    Vector6::from([s.deviator[0], s.deviator[1], s.mean, s.skew, s.couple[0], s.couple[1]])
}

#[test]
fn the_derivative_of_a_flow_curve_is_that_of_the_stress_and_is_positive() {
    for law in generalised() {
        for angle in ANGLES {
            let orientation = Orientation::of([angle.cos(), angle.sin()]);
            let (r, pressure) = (Vector6::from(SOME), 5.0);
            let flow = Some(LocalFlow { rates: rates_of(&r), pressure });
            let here = Here { flow, ..Here::without_flow(1.0, &orientation) };
            let (point, softening) = law.with_softening(&here);
            let softening = softening.expect("it flows");
            let e = softening.unit.stress(&rates_of(&r), 1.0);
            let factor = softening.slope / softening.rate;
            let e = [e.deviator[0], e.deviator[1], e.mean, e.skew, e.couple[0], e.couple[1]];
            let e = Vector6::from(e);
            let mut tangent = Matrix6::zeros();
            for k in 0..6 {
                let mut unit = Vector6::zeros();
                unit[k] = 1.0;
                let s = point.stress(&rates_of(&unit), 1.0);
                let linear =
                    [s.deviator[0], s.deviator[1], s.mean, s.skew, s.couple[0], s.couple[1]];
                let column = Vector6::from(linear) + factor * e[k] * e;
                tangent.set_column(k, &column);
                let step = 1e-5 * unit;
                let [low, high] =
                    [r - step, r + step].map(|r| stress_at(&law, &orientation, &r, pressure));
                let found = (high - low) / 2e-5;
                assert!((column - found).norm() < 1e-6 * found.norm().max(1.0), "{law:?}");
            }
            // Rates without resistance (the rotation of a classical fluid) have the value zero.
            let least = tangent.symmetric_eigenvalues().min();
            assert!(least > -1e-9 * tangent.norm(), "{law:?}: {least}");
        }
    }
}

#[test]
fn a_flow_curve_turns_with_the_flow() {
    for law in generalised() {
        let rates = rates_of(&Vector6::from(SOME));
        let power = |turn: f64| {
            let orientation = Orientation::of([(0.3 + turn).cos(), (0.3 + turn).sin()]);
            let (s, c) = (2.0 * turn).sin_cos();
            let [a, b] = rates.d;
            let (sk, ck) = turn.sin_cos();
            let [x, y] = rates.kappa;
            let kappa = [ck * x - sk * y, sk * x + ck * y];
            let turned = Rates { d: [c * a - s * b, s * a + c * b], kappa, ..rates };
            let flow = Some(LocalFlow { rates: turned, pressure: 3.0 });
            let here = Here { flow, ..Here::without_flow(1.0, &orientation) };
            law.at(&here).power(&turned)
        };
        for turn in [0.4, 1.9, -2.2] {
            assert!((power(turn) / power(0.0) - 1.0).abs() < 1e-12, "{law:?}");
        }
    }
}

#[test]
fn a_flow_curve_without_yield_is_the_linear_law() {
    let strength = Strength::HerschelBulkley { yield_stress: 0.0, consistency: ETA, index: 1.0 };
    let curve = Some(FlowCurve { strength, smallest: 1e-9 * ETA, largest: 1e9 * ETA });
    let (coupling, couple) = (0.7, 0.3);
    let relative =
        Law { rotation: Some(Cosserat::isotropic(coupling, couple)), curve, ..Law::default() };
    let rotation = Some(Cosserat::isotropic(ETA * coupling, ETA * couple));
    let linear = Law { rotation, ..Law::default() };
    let orientation = Orientation::default();
    let r = Vector6::from(SOME);
    let found = stress_at(&relative, &orientation, &r, 0.0);
    let here = Here::without_flow(ETA, &orientation);
    let s = linear.at(&here).stress(&rates_of(&r), 1.0);
    let s = Vector6::from([s.deviator[0], s.deviator[1], s.mean, s.skew, s.couple[0], s.couple[1]]);
    assert!((found - s).norm() < 1e-12 * s.norm());
}
