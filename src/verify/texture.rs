//! Verifies directors in uniform shear against closed-form solutions.

use super::Effort;
use super::report::{Bound, Section, Table};
use crate::cases::{CaseError, start};
use crate::scene::presets;

/// Viscosity, Pa s.
const ETA: f64 = 1000.0;
/// Layer viscosity, Pa s.
const ETA_S: f64 = 500.0;
/// Shear stress, Pa.
const TAU: f64 = 1e4;

/// Time `t` at which a layer under constant shear stress reaches the shear `g`, s:
/// `tau t = eta_s g + 2 (eta - eta_s) [atan(g/2) - g/(g^2 + 4)]`.
fn time_of(g: f64) -> f64 {
    (ETA_S * g + 2.0 * (ETA - ETA_S) * ((0.5 * g).atan() - g / (g * g + 4.0))) / TAU
}

/// Mean viscosity after a shear `g`, Pa s: `eta - (eta - eta_s)/2 [1 + g^2 (g^2 - 4)/(g^2 + 4)^2]`
fn viscosity_of(g: f64) -> f64 {
    let q = g * g;
    ETA - 0.5 * (ETA - ETA_S) * (1.0 + q * (q - 4.0) / (q + 4.0).powi(2))
}

/// Mean |n_x| of uniformly random directors after a shear `g`, by the midpoint rule over angles.
fn alignment_of(g: f64) -> f64 {
    const N: usize = 4000;
    (0..N)
        .map(|k| {
            let a = std::f64::consts::PI * ((k as f64 + 0.5) / N as f64 - 0.5);
            let (x, y) = (a.cos(), a.sin() - g * a.cos());
            x.abs() / x.hypot(y) / N as f64
        })
        .sum()
}

/// Verifies the evolution of random directors in uniform shear.
pub fn section(effort: Effort) -> Result<Section, CaseError> {
    const SHEARS: [f64; 6] = [0.0, 0.5, 1.0, 2.0, 4.0, 8.0];
    let shears = effort.take(&SHEARS);
    let mut out = Section {
        title: "Texture: random directors in uniform shear",
        about: "The preset `shear_alignment` without internal length, under a constant shear \
                stress. The layer shears uniformly, and closed forms exist for mean |n_x|, the \
                mean viscosity and the time at which a shear is reached. The viscosity rises \
                before it falls. For the Cosserat layer the physics tests compare velocity, \
                rotation and |n_x| with an accurate one-dimensional solution."
            .into(),
        ..Section::default()
    };
    let times: Vec<f64> = shears.iter().map(|&g| time_of(g)).collect();
    let end = times.last().copied().unwrap_or(0.0);
    let sets = [
        "internal_length=0".to_string(),
        "accuracy.cells=16".into(),
        format!("time.end={end:?}"),
        format!("recording.times={:?}", times),
    ];
    let source = presets::find("shear_alignment")?.with_sets(&sets)?;
    let mut run = start(&source)?;
    let mut table = Table::new(
        "",
        &["shear", "time, s", "mean abs n_x", "closed form", "viscosity, Pa s", "closed form"],
    );
    for (&g, &time) in shears.iter().zip(&times) {
        while run.row().time < time * (1.0 - 1e-9) {
            run.step()?;
        }
        let alignment = run.row().mean_alignment.unwrap_or(f64::NAN);
        let rate = run.velocity_at([0.1, 0.9])[0] - run.velocity_at([0.1, 0.1])[0];
        let viscosity = TAU * 0.8 / rate;
        table.rows.push(vec![
            format!("{g}"),
            format!("{time:.5}"),
            format!("{alignment:.4}"),
            format!("{:.4}", alignment_of(g)),
            format!("{viscosity:.1}"),
            format!("{:.1}", viscosity_of(g)),
        ]);
        out.check(
            format!("mean |n_x| at shear {g}"),
            alignment,
            Bound::Within(alignment_of(g), 5e-3),
        );
        out.check(
            format!("viscosity at shear {g}, Pa s"),
            viscosity,
            // Slightly softer, because the directors within a cell differ.
            Bound::Within(viscosity_of(g), 8.0),
        );
    }
    out.tables.push(table);
    Ok(out)
}
