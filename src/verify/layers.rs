//! Verifies that the layered law is the limit of a resolved stack of thin layers.

use super::Effort;
use super::report::{Bound, Figure, Section, Table, number, rate};
use crate::cases::{CaseError, Wave, layer_stack};

/// Numbers of pairs of layers; each layer in the middle of the box has at least four cells.
const PAIRS: [u32; 4] = [2, 4, 8, 16];
/// Ratio of the viscosities of hard and soft layers.
const CONTRAST: f64 = 10.0;

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
             the stack."
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
    Ok(out)
}
