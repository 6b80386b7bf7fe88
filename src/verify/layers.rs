//! Verifies that the layered law is the limit of a resolved stack of thin layers, and that layers bend
//! with their own internal length.

use super::Effort;
use super::report::{Bound, Figure, Section, Table, number, rate};
use crate::cases::{
    CaseError, CoupleWave, Layered, Wave, couple_wave, layer_stack, layered_channel, poiseuille,
};

/// Numbers of pairs of layers; each layer in the middle of the box has at least four cells.
const PAIRS: [u32; 4] = [2, 4, 8, 16];
/// Ratio of the viscosities of hard and soft layers.
const CONTRAST: f64 = 10.0;
/// Numbers of cells per side of the cases of bending layers.
const CELLS: [u32; 4] = [16, 32, 64, 128];
/// Layers that bend. With this coupling viscosity, all of it acts at every point.
const BENDING: Layered = Layered {
    shear: 1.0,
    layer: 0.5,
    coupling: 0.5,
    internal_length: 0.1,
    layer_internal_length: 0.3,
};

/// Verifies the layered law against resolved stacks.
pub fn section(effort: Effort) -> Result<Section, CaseError> {
    let mut out = Section {
        title: "Layers: a resolved stack against the layered law",
        about: format!(
            "A body force drives the flow in a box with 2 to 16 pairs of hard and soft layers \
             (contrast {CONTRAST}), each layer resolved by at least four cells. It is compared \
             with the exact flow of a single layered fluid whose viscosity is the arithmetic mean \
             and whose layer viscosity is the harmonic mean of those of the stack (sections \
             2.3-2.4 of the source). Where the flow with two half waves across the layers shears \
             along them, the flow with two half waves along the layers stretches them, and vice \
             versa. The difference falls with the thickness of the layers: the law is the limit of \
             the stack.\n\nLayers that bend have an internal length of their own \
             (`layer_internal_length`). Along and across a channel they flow as the isotropic Cosserat \
             fluid of the length that belongs to the direction; in a periodic box the answer turns with \
             the layers."
        ),
        ..Section::default()
    };
    let mut table = Table::new("", &["half waves x, y", "pairs", "cells", "velocity", "rate"]);
    let mut figure = Figure {
        name: "layers".into(),
        title: "Stack of layers against the layered law".into(),
        x: "pairs of layers",
        y: "relative difference of velocity",
        logarithmic: true,
        curves: vec![],
    };
    for wave in [Wave { x: 1, y: 2 }, Wave { x: 2, y: 1 }] {
        let name = format!("{}, {}", wave.x, wave.y);
        let mut results: Vec<(u32, f64)> = vec![];
        for &pairs in effort.take(&PAIRS) {
            let cells = 8 * pairs.max(4);
            let e = layer_stack(wave, pairs, CONTRAST)?.errors(cells, &[])?;
            let slope = results
                .last()
                .map_or(String::new(), |&c| format!("{:.2}", rate(c, (pairs, e.velocity))));
            table.rows.push(vec![
                name.clone(),
                pairs.to_string(),
                cells.to_string(),
                number(e.velocity),
                slope,
            ]);
            results.push((pairs, e.velocity));
        }
        if let (Some(first), Some(last)) = (results.first(), results.last()) {
            let share = last.1 / first.1;
            out.check(
                format!(
                    "half waves {name}: difference at {} pairs over difference at {}",
                    last.0, first.0
                ),
                share,
                Bound::AtMost(0.8),
            );
        }
        // A few thick layers are far from the limit.
        if let ([.., coarse, fine], Effort::Full) = (&results[..], effort) {
            out.check(
                format!("half waves {name}: last rate in the thickness of a layer"),
                rate(*coarse, *fine),
                Bound::AtLeast(0.9),
            );
        }
        figure.curves.push((
            format!("half waves {name}"),
            results.into_iter().map(|(n, e)| (f64::from(n), e)).collect(),
        ));
    }
    out.tables.push(table);
    out.figures.push(figure);
    channels(effort, &mut out)?;
    waves(effort, &mut out)?;
    Ok(out)
}

/// Compares the channel flow of bending layers with that of isotropic Cosserat fluids.
fn channels(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let mut table = Table::new(
        "Plane Poiseuille flow of bending layers (eta = 1, eta_s = eta_c = 0.5, R = 0.1, R_l = 0.3), \
         relative errors against the isotropic Cosserat fluid of viscosity eta_s whose length is R \
         (layers along the channel) or R_l (across it). *Isotropic*: error of this fluid, computed.",
        &["layers", "cells", "velocity", "rotation", "isotropic: velocity", "rotation"],
    );
    for (across, name) in [(false, "along"), (true, "across")] {
        let case = layered_channel(BENDING, across, 1.0);
        let plain = poiseuille(BENDING.in_channel(across), 1.0);
        let (mut results, mut apart) = (vec![], 0.0_f64);
        for &n in effort.take(&CELLS) {
            let (e, isotropic) = (case.errors(n, &[])?, plain.errors(n, &[])?);
            let difference = (e.velocity - isotropic.velocity).abs();
            apart = apart.max(difference).max((e.rotation - isotropic.rotation).abs());
            let errors = [e.velocity, e.rotation, isotropic.velocity, isotropic.rotation];
            let row = [name.into(), n.to_string()].into_iter().chain(errors.map(number));
            table.rows.push(row.collect());
            results.push((n, e));
        }
        let what = |text: &str| format!("layers {name} the channel: {text}");
        out.check(what("largest difference from the isotropic fluid"), apart, Bound::AtMost(1e-9));
        if let [.., (m, coarse), (n, fine)] = &results[..] {
            let last = rate((*m, coarse.velocity), (*n, fine.velocity));
            out.check(what("last rate, velocity"), last, Bound::AtLeast(case.rates.velocity));
        }
    }
    out.tables.push(table);
    Ok(())
}

/// Compares waves of couples in different directions of the mesh with their exact solution.
fn waves(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let mut table = Table::new(
        "Waves of body couples in a periodic box of bending layers, five periods long in two \
         directions 53 degrees apart; th is the angle from the wave to the normal of the layers. Exact \
         power: `integral c w = b/2`, the same in both directions.",
        &["th", "wave", "cells", "velocity", "rotation", "power/exact - 1"],
    );
    let cells = effort.take(&[32, 64]);
    for director in [0.0, 30.0, 90.0] {
        let mut powers = vec![];
        for waves in [[5, 0], [3, 4]] {
            let case = couple_wave(BENDING, CoupleWave { waves, director });
            // Where the wave is at its largest, w = b.
            let k = f64::from(waves[0] + waves[1]);
            let exact = 0.5 * (case.exact.velocity)(0.25 / k, 0.25 / k)[2];
            for &n in cells {
                let run = case.solve(n, &[])?;
                let e = crate::cases::Errors::of(run.as_ref(), &case.exact);
                let power = run.row().dissipation;
                table.rows.push(vec![
                    format!("{director}"),
                    format!("{}, {}", waves[0], waves[1]),
                    n.to_string(),
                    number(e.velocity),
                    number(e.rotation),
                    number(power / exact - 1.0),
                ]);
                powers.push(power);
            }
        }
        let (first, turned) = (powers[cells.len() - 1], powers[2 * cells.len() - 1]);
        out.check(
            format!("layers at {director} degrees: relative difference of the powers"),
            (turned / first - 1.0).abs(),
            Bound::AtMost(2e-3),
        );
    }
    out.tables.push(table);
    Ok(())
}
