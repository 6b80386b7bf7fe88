//! A conformance suite for the laws: symmetric, positive, frame-indifferent, right in the limits.

use grainscope::laws::point::{Mixture, PointLaw, Sym2};
use grainscope::laws::{cosserat, director, granular, layered};
use nalgebra::{Matrix2, Matrix4, Rotation2, Vector2, Vector4};

const ETA: f64 = 1000.0;
const ANGLES: [f64; 7] =
    [-1.4, -0.7, 0.0, 0.3, std::f64::consts::FRAC_PI_4, 1.1, std::f64::consts::FRAC_PI_2];

fn unit(angle: f64) -> Vector2<f64> {
    Vector2::new(angle.cos(), angle.sin())
}

/// Laws as matrices on the Cosserat measures, as functions of the frame's rotation.
fn laws() -> Vec<Box<dyn Fn(f64) -> Matrix4<f64>>> {
    let mut list: Vec<Box<dyn Fn(f64) -> Matrix4<f64>>> = vec![
        Box::new(|_| cosserat::viscosity(ETA, 300.0, 5.0 * ETA)),
        Box::new(|_| cosserat::viscosity(ETA, 0.0, 1e-2 * ETA)),
    ];
    for a in ANGLES {
        list.push(Box::new(move |turn| {
            cosserat::viscosity(ETA, 300.0, 2.0 * ETA)
                + layered::correction(ETA, 1.0, &unit(a + turn))
        }));
    }
    list
}

/// Measures as a 2x2 tensor and back.
fn tensor(g: &Vector4<f64>) -> Matrix2<f64> {
    Matrix2::new(g[0], g[2], g[3], g[1])
}
fn vector(m: &Matrix2<f64>) -> Vector4<f64> {
    Vector4::new(m[(0, 0)], m[(1, 1)], m[(0, 1)], m[(1, 0)])
}

#[test]
fn laws_are_symmetric_and_positive() {
    for law in laws() {
        let c = law(0.0);
        assert!((c - c.transpose()).norm() < 1e-9 * ETA);
        let lowest = c.symmetric_eigenvalues().min();
        assert!(lowest > -1e-9 * ETA, "{lowest}");
    }
}

#[test]
fn laws_are_frame_indifferent() {
    let gamma = Vector4::new(0.3, -0.7, 1.1, 0.2);
    for law in laws() {
        for turn in ANGLES {
            let q = *Rotation2::new(turn).matrix();
            let turned = vector(&(q * tensor(&gamma) * q.transpose()));
            let a = q * tensor(&(law(0.0) * gamma)) * q.transpose();
            let b = tensor(&(law(turn) * turned));
            assert!((a - b).norm() < 1e-9 * ETA, "{turn}: {a} {b}");
        }
    }
}

#[test]
fn layers_of_equal_viscosity_are_isotropic_and_directors_are_axes() {
    for a in ANGLES {
        assert_eq!(layered::correction(ETA, ETA, &unit(a)), Matrix4::zeros());
        let (n, m) = (unit(a), unit(a + std::f64::consts::PI));
        let difference = layered::correction(ETA, 10.0, &n) - layered::correction(ETA, 10.0, &m);
        assert!(difference.norm() < 1e-9);
    }
}

#[test]
fn deviatoric_form_agrees_with_the_matrix() {
    for a in ANGLES {
        let n = unit(a);
        let gamma = Vector4::new(0.4, -0.4, 0.9, -0.1);
        let c = cosserat::viscosity(ETA, 0.0, 0.0) + layered::correction(ETA, 50.0, &n);
        let sigma = c * gamma;
        let s = layered::deviatoric(ETA, 50.0, &n)
            * Vector2::new(gamma[0] - gamma[1], gamma[2] + gamma[3]);
        assert!((0.5 * (sigma[0] - sigma[1]) - s[0]).abs() < 1e-9);
        assert!((0.5 * (sigma[2] + sigma[3]) - s[1]).abs() < 1e-9);
        let e = layered::deviatoric(ETA, 50.0, &n).symmetric_eigenvalues();
        assert!((e.max() - ETA).abs() < 1e-9 && (e.min() - 50.0).abs() < 1e-9);
    }
}

#[test]
fn one_orientation_feels_the_viscosity_of_its_angle_in_simple_shear() {
    for a in ANGLES {
        let gamma = Vector4::new(0.0, 0.0, 1.0, 0.0);
        let c = cosserat::viscosity(ETA, 0.0, 0.0) + layered::correction(ETA, 500.0, &unit(a));
        let expected = 500.0 + 500.0 * (2.0 * a).sin().powi(2);
        assert!(((c * gamma)[2] - expected).abs() < 1e-9, "{a}");
    }
}

#[test]
fn a_rigid_rotation_with_matching_spin_gives_exactly_zero() {
    for w in [1.0, -0.37, 1e6] {
        let l = Matrix2::new(0.0, -w, w, 0.0);
        assert_eq!(cosserat::spin(&l), w);
        assert_eq!(cosserat::measures(&l, w), Vector4::zeros());
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
        // A rotation turns it with the body.
        let n = director::advance(&unit(a), &Matrix2::new(0.0, -1.0, 1.0, 0.0), 0.4);
        assert!((n - unit(a + 0.4)).norm() < 1e-12);
        // Pure strain, a huge step: still a unit vector, on the axis of compression.
        let n = director::advance(&unit(a), &Matrix2::new(1.0, 0.0, 0.0, -1.0), 30.0);
        assert!((n.norm() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn exponential_is_that_of_the_series() {
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
