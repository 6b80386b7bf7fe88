//! Verifies the convergence of the elements alone: third order in velocity and rotation, second
//! order in pressure.

use super::Effort;
use super::report::{Bound, Figure, Section, Table, number, rate};
use crate::cases::{
    Case, CaseError, Drive, Errors, Fluid, SolCx, Wave, couette, coupled_cell, layered_cell,
    poiseuille, slip_cell, solcx, steady_vortex_without_particles,
};

/// Numbers of cells per side.
const CELLS: [u32; 4] = [16, 32, 64, 128];
/// Fluid of the Cosserat cases.
const FLUID: Fluid = Fluid { shear: 1.0, coupling: 1.0, internal_length: 0.3 };

/// Verifies the convergence rates of the elements.
pub fn section(effort: Effort) -> Result<Section, CaseError> {
    let mut out = Section {
        title: "The elements",
        about: "Cases in which every cell holds one uniform material and forces are fixed in \
                space. Particles have no effect, so the error is that of the elements: Q2 velocity \
                and rotation, discontinuous linear pressure. Relative errors in the L2 norm. The \
                viscosity jump of 1e6 in SolCx lies on a mesh line; there, exact integration is \
                known to reach velocity 1.3e-3, 1.7e-4, 2.1e-5, 2.6e-6 and pressure 2.9e-3, \
                7.3e-4, 1.8e-4, 4.6e-5."
            .into(),
        ..Section::default()
    };
    let cases = [
        couette(FLUID, 1.0),
        poiseuille(FLUID, 1.0),
        coupled_cell(FLUID, 1, 1),
        solcx(SolCx { contrast: 1e6, jump: 0.5 }, Drive::BodyForce)?,
        layered_cell(Wave { x: 1, y: 2 }, 10.0),
        steady_vortex_without_particles(),
        slip_cell(0.2),
    ];
    let mut table = Table::new(
        "",
        &["case", "cells", "velocity", "rate", "rotation", "rate", "pressure", "rate"],
    );
    let mut figure = Figure {
        name: "elements".into(),
        title: "Velocity error of uniform cells".into(),
        x: "cells per side",
        y: "relative error",
        logarithmic: true,
        curves: vec![],
    };
    for case in &cases {
        let mut results = Vec::new();
        for &n in effort.take(&CELLS) {
            results.push((n, case.errors(n, &[])?));
        }
        tabulate(case, &results, &mut table);
        figure.curves.push((
            case.name.clone(),
            results.iter().map(|(n, e)| (f64::from(*n), e.velocity)).collect(),
        ));
        check(case, &results, &mut out);
    }
    out.tables.push(table);
    out.figures.push(figure);
    Ok(out)
}

/// A quantity with an expected convergence rate.
struct Quantity {
    name: &'static str,
    rate: f64,
    of: ErrorOf,
}

/// Function that selects the error of a quantity.
type ErrorOf = fn(&Errors) -> f64;

/// Quantities of a case that have an expected rate.
fn quantities(case: &Case) -> Vec<Quantity> {
    let rates = &case.rates;
    let all: [(_, _, ErrorOf); 3] = [
        ("velocity", Some(rates.velocity), |e| e.velocity),
        ("rotation", rates.rotation, |e| e.rotation),
        ("pressure", rates.pressure, |e| e.pressure),
    ];
    all.into_iter()
        .filter_map(|(name, rate, of)| Some(Quantity { name, rate: rate?, of }))
        .collect()
}

/// Adds the errors and rates of a case to the table.
fn tabulate(case: &Case, results: &[(u32, Errors)], table: &mut Table) {
    let known = quantities(case);
    for (k, (n, errors)) in results.iter().enumerate() {
        let mut row = vec![case.name.clone(), n.to_string()];
        for name in ["velocity", "rotation", "pressure"] {
            match known.iter().find(|q| q.name == name) {
                Some(Quantity { of: get, .. }) => {
                    row.push(number(get(errors)));
                    row.push(if k == 0 {
                        String::new()
                    } else {
                        let (m, coarse) = &results[k - 1];
                        format!("{:.2}", rate((*m, get(coarse)), (*n, get(errors))))
                    });
                }
                None => row.extend([String::new(), String::new()]),
            }
        }
        table.rows.push(row);
    }
}

/// Checks the lowest rate between neighbouring resolutions, ignoring errors at rounding level.
fn check(case: &Case, results: &[(u32, Errors)], out: &mut Section) {
    for Quantity { name, rate: expected, of: get } in quantities(case) {
        let rates = results
            .windows(2)
            .filter(|w| get(&w[1].1) > 1e-10)
            .map(|w| rate((w[0].0, get(&w[0].1)), (w[1].0, get(&w[1].1))));
        let lowest = rates.fold(f64::INFINITY, f64::min);
        out.check(format!("{}: lowest rate, {name}", case.name), lowest, Bound::AtLeast(expected));
    }
}
