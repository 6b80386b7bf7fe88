//! Compares shear alignment with an accurate one-dimensional solution.
//!
//! In a layer sheared along x all fields depend only on y. The mean viscosity of uniformly random
//! directors after a local shear `g` has a closed form, so with `g,t = u'`
//!
//! ```text
//! (eta_m(g) + eta_c) u' + 2 eta_c w = tau
//! M w'' - 4 eta_c w - 2 eta_c u' = 0,    w = 0 at the walls
//! eta_m(g) = eta - (eta - eta_s)/2 [1 + g^2 (g^2 - 4)/(g^2 + 4)^2]
//! ```

use crate::{finish, preset};
use grainscope::sim::Run;

/// The one-dimensional layer; SI units.
struct Layer {
    eta: f64,
    eta_s: f64,
    eta_c: f64,
    m: f64,
    tau: f64,
    height: f64,
    /// Shear at the grid points.
    shear: Vec<f64>,
}

impl Layer {
    fn viscosity(&self, g: f64) -> f64 {
        let q = g * g;
        self.eta - 0.5 * (self.eta - self.eta_s) * (1.0 + q * (q - 4.0) / (q + 4.0).powi(2))
    }

    /// Rotation and shear rate for given shears, from a tridiagonal system (Thomas algorithm).
    fn solve(&self, shear: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let n = shear.len();
        let h = self.height / (n - 1) as f64;
        let stiffness: Vec<f64> = shear.iter().map(|&g| self.viscosity(g) + self.eta_c).collect();
        // u' = (tau - 2 eta_c w)/stiffness is inserted into the balance of couples.
        let k = self.m / (h * h);
        let mut c = vec![0.0; n];
        let mut w = vec![0.0; n];
        for i in 1..n - 1 {
            let b = 2.0 * k + 4.0 * self.eta_c - 4.0 * self.eta_c.powi(2) / stiffness[i];
            let right = -2.0 * self.eta_c * self.tau / stiffness[i];
            let denominator = b - k * c[i - 1];
            c[i] = k / denominator;
            w[i] = (right + k * w[i - 1]) / denominator;
        }
        for i in (1..n - 1).rev() {
            w[i] += c[i] * w[i + 1];
        }
        let rate = (0..n).map(|i| (self.tau - 2.0 * self.eta_c * w[i]) / stiffness[i]).collect();
        (w, rate)
    }

    /// One step of the classical Runge-Kutta method.
    fn step(&mut self, dt: f64) {
        let ahead = |rate: &[f64], f: f64| -> Vec<f64> {
            self.shear.iter().zip(rate).map(|(g, r)| g + f * r).collect()
        };
        let k1 = self.solve(&self.shear).1;
        let k2 = self.solve(&ahead(&k1, 0.5 * dt)).1;
        let k3 = self.solve(&ahead(&k2, 0.5 * dt)).1;
        let k4 = self.solve(&ahead(&k3, dt)).1;
        for i in 0..self.shear.len() {
            self.shear[i] += dt / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
        }
    }
}

/// Mean |n_x| of uniformly random directors after a shear `g`:
/// `(2/pi) Im[artanh(s/z)/s]`, `z = g - i`, `s^2 = z^2 + 1`; here by quadrature.
fn alignment(g: f64) -> f64 {
    let n = 4000;
    (0..n)
        .map(|k| {
            let a = std::f64::consts::PI * ((k as f64 + 0.5) / n as f64 - 0.5);
            let (x, y) = (a.cos(), a.sin() - g * a.cos());
            x.abs() / x.hypot(y) / n as f64
        })
        .sum()
}

/// Half the height of a band: one row of cells on either side of a mesh line, since directors are
/// stratified in each cell.
const HALF_BAND: f64 = 1.0 / 16.0;

/// Mean |n_x| of the particles in a band around a height.
fn measured_alignment(run: &dyn Run, y: f64) -> f64 {
    let p = run.particles();
    let directors = p.director.as_ref().expect("directors");
    let (mut sum, mut volume) = (0.0, 0.0);
    for k in 0..p.len() {
        if (run.plan().si(p.position[k])[1] - y).abs() < HALF_BAND {
            sum += p.volume[k] * directors[k][0].abs();
            volume += p.volume[k];
        }
    }
    sum / volume
}

#[test]
fn mean_alignment_has_tabulated_values() {
    for (g, expected) in
        [(0.0, std::f64::consts::FRAC_2_PI), (1.0, 0.56512), (4.0, 0.26860), (16.0, 0.06822)]
    {
        assert!((alignment(g) - expected).abs() < 2e-5, "{g}");
    }
}

#[test]
fn the_layer_follows_the_one_dimensional_solution() {
    let sets = ["accuracy.cells=16", "time.end=1", "recording.frames=4", "domain.x=[-0.25, 0.25]"];
    let mut run = preset("shear_alignment", &sets);
    let n = 401;
    let mut layer = Layer {
        eta: 1000.0,
        eta_s: 500.0,
        eta_c: 1000.0,
        m: 2.0 * 1000.0 * 0.04,
        tau: 1e4,
        height: 1.0,
        shear: vec![0.0; n],
    };
    let mut time = 0.0;
    let mut compared = 0;
    finish(run.as_mut(), |run| {
        let target = run.row().time;
        if ((target * 4.0).round() / 4.0 - target).abs() > 1e-9 {
            return;
        }
        while time < target - 1e-12 {
            let dt = (target - time).min(1e-3);
            layer.step(dt);
            time += dt;
        }
        let (w, rate) = layer.solve(&layer.shear);
        let top: f64 = rate.windows(2).map(|r| 0.5 * (r[0] + r[1]) / (n - 1) as f64).sum();
        let measured = run.velocity_at([0.1, 1.0])[0] - run.velocity_at([0.1, 0.0])[0];
        println!("t = {target}: velocity {measured:.4} / {top:.4}");
        assert!((measured / top - 1.0).abs() < 0.01, "t = {target}: {measured} {top}");
        for i in [50, 100, 200, 300, 350] {
            let y = i as f64 / (n - 1) as f64;
            // Mean over the period, because the random directors of a cell differ from the mean.
            let mean: f64 =
                (0..20).map(|k| run.velocity_at([-0.25 + 0.025 * k as f64, y])[2] / 20.0).sum();
            assert!((mean / w[i] - 1.0).abs() < 0.01, "t = {target}, y = {y}: {mean} {}", w[i]);
            let (a, b) = (measured_alignment(run, y), {
                let near = (i - 25..i + 25)
                    .map(|j| alignment(0.5 * (layer.shear[j] + layer.shear[j + 1])));
                near.sum::<f64>() / 50.0
            });
            assert!((a - b).abs() < 0.01, "t = {target}, y = {y}: |n_x| {a} {b}");
            compared += 1;
        }
    });
    assert_eq!(compared, 25);
    assert!(run.row().director_error < 1e-14);
}

#[test]
fn without_internal_length_the_shear_has_a_closed_form() {
    // tau t = eta_s g + 2 (eta - eta_s) [atan(g/2) - g/(g^2 + 4)]
    let sets = ["internal_length=0", "accuracy.cells=8", "time.end=0.5", "domain.x=[-0.25, 0.25]"];
    let mut run = preset("shear_alignment", &sets);
    assert!(!run.plan().effects.rotation);
    // The initial mean viscosity is 750, the mean of 1000 and 500.
    let speed = |run: &dyn Run| {
        let mean = |y: f64| -> f64 {
            (0..20).map(|k| run.velocity_at([-0.25 + 0.025 * k as f64, y])[0] / 20.0).sum()
        };
        mean(1.0) - mean(0.0)
    };
    let first = 1e4 / speed(run.as_ref());
    assert!((first / 750.0 - 1.0).abs() < 0.01, "{first}");
    // There is no normal stress, so there is no flow across the layer.
    assert!(run.velocity_at([0.03, 0.47])[1].abs() < 0.02 * speed(run.as_ref()));
    finish(run.as_mut(), |_| {});
    let (mut low, mut high) = (0.0, 100.0);
    for _ in 0..60 {
        let g: f64 = 0.5 * (low + high);
        let time = (500.0 * g + 1000.0 * ((g / 2.0).atan() - g / (g * g + 4.0))) / 1e4;
        if time < 0.5 { low = g } else { high = g }
    }
    let q: f64 = low * low;
    let eta = 1000.0 - 250.0 * (1.0 + q * (q - 4.0) / (q + 4.0f64).powi(2));
    let measured = speed(run.as_ref());
    assert!((measured / (1e4 / eta) - 1.0).abs() < 0.01, "{measured} {}", 1e4 / eta);
    assert!((run.row().mean_alignment.unwrap() - alignment(low)).abs() < 0.01);
}
