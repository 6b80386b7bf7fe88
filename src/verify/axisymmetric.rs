//! Verifies axisymmetric flow.

use super::Effort;
use super::report::{Bound, Figure, Section, Table, number, rate};
use crate::cases::axisymmetric::{Wall, discharge, drop, hole, pipe, ring, squeeze, stirred};
use crate::cases::{Case, CaseError, Fluid};

/// Fluid of the pipes: `k = 5`.
const FLUID: Fluid = Fluid { shear: 1.0, coupling: 1.0, internal_length: 0.2 };
/// Volume flows through pipes of this fluid: without rotation of the wall, and without couples on it.
const DISCHARGE: [(Wall, &str, f64); 2] = [
    (Wall::Held, "no rotation at the wall", 0.279_705_33),
    (Wall::Free, "no couple at the wall", 0.368_117_6),
];

/// Verifies axisymmetric flow.
pub fn section(effort: Effort) -> Result<Section, CaseError> {
    let mut out = Section {
        title: "Axisymmetric flow",
        about: "Pipes with and without rotation, a stirred vessel, discs that approach each other, the \
                round hole in a thin plate, and drops. Volumes are those of rings, and the hoop rates \
                `u/r` and `w/r` enter all laws."
            .into(),
        ..Section::default()
    };
    smooth(effort, &mut out)?;
    numbers(effort, &mut out)?;
    drops(effort, &mut out)?;
    Ok(out)
}

/// Errors and rates of smooth flows.
fn smooth(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let mut figure = Figure {
        name: "axisymmetric".into(),
        title: "Errors of axisymmetric flows".into(),
        x: "cells per radius",
        y: "relative error of the velocity",
        logarithmic: true,
        curves: vec![],
    };
    let mut table = Table::new(
        "Relative errors.",
        &["flow", "cells", "velocity", "rate", "rotation", "rate", "pressure", "rate"],
    );
    let list: [(&str, Case); 4] = [
        ("pipe, no rotation at the wall", pipe(FLUID, Wall::Held)),
        ("pipe, no couple at the wall", pipe(FLUID, Wall::Free)),
        ("between two pipes", ring()),
        ("stirred vessel", stirred(FLUID)),
    ];
    for (name, case) in &list {
        let mut results: Vec<(u32, [f64; 3])> = vec![];
        for &n in effort.take(&[8, 16, 32, 64]) {
            let e = case.errors(n, &[])?;
            let now = [e.velocity, e.rotation, e.pressure];
            let used = [true, case.rates.rotation.is_some(), case.rates.pressure.is_some()];
            let mut row = vec![(*name).to_string(), n.to_string()];
            for k in 0..3 {
                let slope = |&(m, before): &(u32, [f64; 3])| rate((m, before[k]), (n, now[k]));
                let last = results.last().filter(|_| used[k]);
                row.push(if used[k] { number(now[k]) } else { String::new() });
                row.push(last.map_or(String::new(), |r| format!("{:.2}", slope(r))));
            }
            table.rows.push(row);
            results.push((n, now));
        }
        let (Some(&first), Some(&last)) = (results.first(), results.last()) else { continue };
        let wanted = [Some(case.rates.velocity), case.rates.rotation, case.rates.pressure];
        for (k, (what, wanted)) in
            ["velocity", "rotation", "pressure"].iter().zip(wanted).enumerate()
        {
            let Some(wanted) = wanted else { continue };
            let mean = rate((first.0, first.1[k]), (last.0, last.1[k]));
            out.check(format!("{name}: rate of the {what}"), mean, Bound::AtLeast(wanted));
        }
        let curve = results.into_iter().map(|(n, e)| (f64::from(n), e[0])).collect();
        figure.curves.push(((*name).into(), curve));
    }
    out.tables.push(table);
    out.figures.push(figure);
    Ok(())
}

/// Exact numbers.
fn numbers(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let mut table = Table::new(
        "Measured numbers over those of the theory, less 1.",
        &["flow", "cells", "error"],
    );
    let mut add = |out: &mut Section, name: String, n: u32, error: f64, bound: Option<f64>| {
        table.rows.push(vec![name.clone(), n.to_string(), number(error)]);
        if let Some(bound) = bound {
            out.check(name, error.abs(), Bound::AtMost(bound));
        }
    };
    for (wall, name, exact) in DISCHARGE {
        let error = discharge(&pipe(FLUID, wall), 16)? / exact - 1.0;
        add(out, format!("volume through a pipe, {name}"), 16, error, Some(1e-4));
    }
    let error = squeeze(0.5, true, 8)? - 1.0;
    add(out, "force on discs that slip".into(), 8, error, Some(1e-9));
    for &h in effort.take(&[0.05, 0.025]) {
        let error = squeeze(h, false, 8)? - 1.0;
        add(out, format!("force on discs without slip, gap {h}"), 8, error, Some(0.01));
    }
    for (&b, &cells) in effort.take(&[10.0, 20.0]).iter().zip(&[16, 16]) {
        let error = hole(b, cells)? - 1.0;
        let bound = (b == 20.0).then_some(0.005);
        add(out, format!("volume through a hole, vessel of {b} radii"), cells, error, bound);
    }
    out.tables.push(table);
    Ok(())
}

/// Drops in large vessels.
fn drops(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    const CELLS: u32 = 32;
    let mut table = Table::new(
        "Speed of a drop over that of the theory, less 1, in vessels of 8 and 16 radii, and extrapolated \
         to a large vessel.",
        &["viscosity of the drop over that of the fluid", "8 radii", "16 radii", "extrapolated"],
    );
    for &contrast in effort.take(&[0.01, 1.0, 100.0, 0.1, 10.0]) {
        let [small, large] = [drop(contrast, 8.0, CELLS)?, drop(contrast, 16.0, CELLS)?];
        let far = 2.0 * large - small;
        let row = [small, large, far].map(|v| format!("{:+.4}", v - 1.0));
        table.rows.push([vec![contrast.to_string()], row.into()].concat());
        let what = format!("drop of viscosity ratio {contrast}: speed over the theory, less 1");
        out.check(what, (far - 1.0).abs(), Bound::AtMost(0.01));
    }
    out.tables.push(table);
    Ok(())
}
