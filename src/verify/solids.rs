//! Verifies the flow around solids of any shape, whose walls cut through cells.

use super::Effort;
use super::report::{Bound, Figure, Section, Table, number, rate};
use crate::cases::solids::{
    ARRAY_DRAG, LowerWall, SlantedChannel, array_drag, slanted_channel, slanted_cosserat,
    slipping_circle, wedge,
};
use crate::cases::{Case, CaseError, Fluid};

/// Numbers of cells per side.
const CELLS: [u32; 4] = [16, 32, 64, 128];

/// The Cosserat fluid; its internal length is a fifth of the width of its channel.
const COSSERAT: Fluid = Fluid { shear: 1.0, coupling: 1.0, internal_length: 0.05 };

/// Verifies solids of any shape.
pub fn section(effort: Effort) -> Result<Section, CaseError> {
    let mut out = Section {
        title: "Solids of any shape",
        about: "Walls across the mesh: a channel (width 0.25 in a box of 1, so 4 to 32 cells across), \
                converging flow in a wedge, and a square array of cylinders. In cells that a solid \
                cuts, the velocity is a product of the distance from the wall and a bilinear function, \
                and the pressure has one unknown."
            .into(),
        ..Section::default()
    };
    let mut figure = Figure {
        name: "solids".into(),
        title: "Velocity error beside solids".into(),
        x: "cells per side",
        y: "relative error",
        logarithmic: true,
        curves: vec![],
    };
    let mut table = Table::new(
        "Relative errors in the fluid.",
        &["case", "cells", "velocity", "rate", "rotation"],
    );
    use LowerWall::{FreeSlip, Friction, NoSlip, Slip};
    let channel = |degrees, lower| slanted_channel(SlantedChannel { degrees, width: 0.25, lower });
    let cosserat = |degrees, held| slanted_cosserat(COSSERAT, degrees, 0.25, held);
    let list: [(&str, Case); 14] = [
        ("channel at 30 degrees", channel(30.0, NoSlip)),
        ("channel at 12 degrees, lower wall slips", channel(12.0, FreeSlip)),
        ("channel at 30 degrees, lower wall slips", channel(30.0, FreeSlip)),
        ("channel at 12 degrees, slip length 0.1", channel(12.0, Slip(0.1))),
        ("channel at 30 degrees, slip length 0.1", channel(30.0, Slip(0.1))),
        ("channel at 30 degrees, wall friction", channel(30.0, Friction(0.4, 0.2))),
        ("Cosserat channel at 12 degrees", cosserat(12.0, false)),
        ("Cosserat channel at 30 degrees", cosserat(30.0, false)),
        ("Cosserat channel at 12 degrees, no rotation on walls", cosserat(12.0, true)),
        ("Cosserat channel at 30 degrees, no rotation on walls", cosserat(30.0, true)),
        ("circle, slip length 0.1", slipping_circle(0.1)),
        ("circle, slip length 0.01", slipping_circle(0.01)),
        ("wedge of 20 degrees", wedge(20.0)),
        ("wedge of 30 degrees", wedge(30.0)),
    ];
    for (name, case) in &list {
        let mut results: Vec<(u32, f64)> = vec![];
        for &n in effort.take(&CELLS) {
            let errors = case.errors(n, &["accuracy.nonlinear_tolerance=1e-6"])?;
            let e = errors.velocity;
            let rotation = case.rates.rotation.map_or(String::new(), |_| number(errors.rotation));
            let last = results.last();
            let slope = last.map_or(String::new(), |&c| format!("{:.2}", rate(c, (n, e))));
            table.rows.push(vec![(*name).into(), n.to_string(), number(e), slope, rotation]);
            results.push((n, e));
        }
        let (Some(&first), Some(&last)) = (results.first(), results.last()) else { continue };
        out.check(format!("{name}: error at {} cells", last.0), last.1, Bound::AtMost(0.01));
        // Two coarse meshes do not tell a rate.
        if last.1 > 1e-5 && effort == Effort::Full {
            let mean = rate(first, last);
            out.check(format!("{name}: mean rate"), mean, Bound::AtLeast(case.rates.velocity));
        }
        let curve = results.into_iter().map(|(n, e)| (f64::from(n), e)).collect();
        figure.curves.push(((*name).into(), curve));
    }
    out.tables.push(table);
    out.figures.push(figure);
    let mut table = Table::new(
        "Drag K of a square array of cylinders over the published one, less 1.",
        &["volume fraction", "cells", "K", "K/published - 1"],
    );
    for (fraction, published) in ARRAY_DRAG {
        let mut last = 0.0;
        for &n in effort.take(&[16, 32, 64]) {
            let drag = array_drag(fraction, n)?;
            last = drag / published - 1.0;
            let row = [fraction.to_string(), n.to_string(), format!("{drag:.3}"), number(last)];
            table.rows.push(row.into());
        }
        let what = format!("cylinders, fraction {fraction}: drag over the published one, less 1");
        out.check(what, last.abs(), Bound::AtMost(0.003));
    }
    out.tables.push(table);
    Ok(out)
}
