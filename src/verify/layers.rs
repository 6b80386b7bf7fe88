//! The layered law is the limit of a stack of thin layers.

use super::Effort;
use super::report::{Bound, Figure, Section, Table, number, rate};
use crate::cases::{CaseError, Wave, layer_stack};

/// Pairs of layers, each with at least four cells to a layer in the middle of the box.
const PAIRS: [u32; 4] = [2, 4, 8, 16];
const CONTRAST: f64 = 10.0;

pub fn section(effort: Effort) -> Result<Section, CaseError> {
    let mut out = Section {
        title: "Layers: a resolved stack against the layered law",
        about: format!(
            "A box with 2 to 16 pairs of hard and soft layers (contrast {CONTRAST}), each resolved \
             by at least four cells, is stirred; beside it the exact flow of one layered fluid \
             whose viscosity is the arithmetic mean and whose layer viscosity is the harmonic mean \
             of the stack's (sections 2.3-2.4 of the source). The flow with two half waves \
             across the layers shears along them where the one with two half waves along them \
             stretches them, and the other way round. The stack differs from its law by a share that falls with the \
             thickness of the layers: the law is its limit."
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
                    "half waves {name}: difference at {} pairs over that at {}",
                    last.0, first.0
                ),
                share,
                Bound::AtMost(0.8),
            );
        }
        // Few thick layers are far from the limit.
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
    Ok(out)
}
