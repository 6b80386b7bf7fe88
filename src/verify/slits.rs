//! Verifies the discharge of water and of grains through a slit in the floor of a vessel.

use super::Effort;
use super::report::{Bound, Section, Table, number};
use crate::cases::{CaseError, start};
use crate::scene::presets;
use std::f64::consts::FRAC_PI_4;

/// Height of the filling and width of the vessel in both presets, m.
const FILLING: [f64; 2] = [4.5, 5.0];

/// Verifies the presets `clepsydra` and `hourglass`.
pub fn section(effort: Effort) -> Result<Section, CaseError> {
    let mut out = Section {
        title: "Discharge through a slit",
        about: "Presets `clepsydra` (water, 0.001 Pa s) and `hourglass` (grains). *Water*: if the pressure \
                is zero across a slit of width L, an inviscid fluid at the height H leaves at the rate \
                (pi/4) L sqrt(2 g H): the speed is sqrt(2 g H) all along the slit, and the velocity lies \
                along the floor beside it, so with the complex velocity w = u - i v and a = L/2 it is \
                w = -sqrt(2 g H) a/(z + sqrt(z^2 - a^2)). *Grains*: the rate converges with the mesh, and \
                grains whose friction rises with the rate (0.32 to 0.6) leave more slowly than grains \
                whose friction is always 0.32 (`diameter=0`)."
            .into(),
        ..Section::default()
    };
    water(effort, &mut out)?;
    grains(effort, &mut out)?;
    Ok(out)
}

/// Rate at the end and volume discharged so far.
fn discharge(preset: &str, sets: &[String]) -> Result<[f64; 2], CaseError> {
    let mut run = start(&presets::find(preset)?.with_sets(sets)?)?;
    while !run.is_finished() {
        run.step()?;
    }
    let gauge = &run.row().gauges[0];
    Ok([gauge.rate, gauge.volume])
}

fn water(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let title = "Water after 1.5 s: rate over (pi/4) L sqrt(2 g H)";
    let mut table = Table::new(title, &["slit, m", "cells", "rate, m2/s", "over the exact"]);
    for aperture in [0.4, 0.8] {
        let (mut last, mut bound) = (f64::NAN, 0.0);
        for &cells in effort.take(&[16, 32]) {
            let sets = [
                format!("aperture={aperture}"),
                format!("accuracy.cells={cells}"),
                "viscosity=0.001".into(),
                "time.end=1.5".into(),
            ];
            let [rate, volume] = discharge("clepsydra", &sets)?;
            let height = FILLING[0] - volume / FILLING[1];
            bound = if cells < 32 { 0.04 } else { 0.03 };
            last = rate / (FRAC_PI_4 * aperture * (2.0 * height).sqrt());
            table.rows.push(vec![
                number(aperture),
                cells.to_string(),
                number(rate),
                format!("{last:.4}"),
            ]);
        }
        out.check(format!("water, slit of {aperture} m: rate"), last, Bound::Within(1.0, bound));
    }
    out.tables.push(table);
    Ok(())
}

fn grains(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let title = "Grains after 2 s: rate, m2/s";
    let (apertures, cells): (&[f64], &[u32]) = match effort {
        Effort::Quick => (&[0.314], &[16]),
        Effort::Full => (&[0.314, 0.6265, 0.939], &[16, 32, 64]),
    };
    let mut header = vec!["slit, m".to_string(), "grain diameter, m".into()];
    header.extend(cells.iter().map(|n| format!("{n} cells")));
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let mut table = Table::new(title, &header);
    for aperture in apertures {
        let mut finest = vec![];
        for diameter in ["1/30", "0"] {
            let rates = cells.iter().map(|cells| {
                let sets = [
                    format!("aperture={aperture}"),
                    format!("diameter={diameter}"),
                    format!("accuracy.cells={cells}"),
                    "time.end=2".into(),
                ];
                Ok(discharge("hourglass", &sets)?[0])
            });
            let rates = rates.collect::<Result<Vec<f64>, CaseError>>()?;
            let mut row = vec![number(*aperture), diameter.to_string()];
            row.extend(rates.iter().map(|rate| format!("{rate:.4}")));
            table.rows.push(row);
            if let [.., before, last] = rates[..] {
                let what = format!(
                    "grains of {diameter} m, slit of {aperture} m: change of the last halving"
                );
                out.check(what, (last / before - 1.0).abs(), Bound::AtMost(0.02));
            }
            finest.extend(rates.last().copied());
        }
        let what = format!("grains, slit of {aperture} m: rate over that at the lowest friction");
        out.check(what, finest[0] / finest[1], Bound::AtMost(1.0));
    }
    out.tables.push(table);
    Ok(())
}
