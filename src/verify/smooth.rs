//! Verifies that smooth material properties on particles keep the accuracy of the elements.

use super::Effort;
use super::report::{Bound, Figure, Section, Table, number};
use crate::cases::{
    CaseError, Drive, SolCx, solcx, solkz, steady_vortex, steady_vortex_without_particles,
};

/// Numbers of cells per side.
const CELLS: [u32; 4] = [16, 32, 64, 128];
/// Assignment that places particles at random.
const RANDOM: &str = "accuracy.placement=random";

/// Verifies smooth material properties carried by particles.
pub fn section(effort: Effort) -> Result<Section, CaseError> {
    let mut out = Section {
        title: "Smooth material on particles",
        about: "Viscosity (SolKz: from 1 to 1e6 over the box) and density are known only at 16 \
                randomly placed particles per cell. *Without particles*: the same scene with its \
                fields evaluated at the Gauss points. *Plain*: particles as integration points, \
                the method of the source. The steady vortex (rigid shear of Gassmoeller et al. \
                2019) is measured after its particles have moved for 0.1 s, at least a twentieth \
                of a turn; its error without particles is that of the elements with the force \
                fixed in space. With particles as the only integration points the leading \
                particle-in-cell code reaches 1.3e-3, 4.5e-4, 2.6e-4 in velocity and 3.5e-2, \
                2.9e-2, 2.1e-2 in pressure on SolCx at 32, 64, 128 cells."
            .into(),
        ..Section::default()
    };
    let mut table = Table::new(
        "",
        &[
            "case",
            "cells",
            "velocity",
            "without particles",
            "ratio",
            "plain",
            "pressure",
            "without particles",
            "ratio",
            "plain",
        ],
    );
    let mut figure = Figure {
        name: "smooth".into(),
        title: "Velocity error of smooth material on random particles".into(),
        x: "cells per side",
        y: "relative error",
        logarithmic: true,
        curves: vec![],
    };
    let cases = [
        solcx(SolCx { contrast: 1e6, jump: 0.5 }, Drive::Density)?,
        solkz(1e6, 3, Drive::Density)?,
    ];
    for case in &cases {
        let mut worst: [f64; 2] = [0.0; 2];
        let mut curves = [vec![], vec![], vec![]];
        for &n in effort.take(&CELLS) {
            let ours = case.errors(n, &[RANDOM])?;
            let exact = case.errors_without_particles(n)?;
            let plain = case.errors(n, &[RANDOM, "accuracy.quadrature=particles"])?;
            let ratios = [ours.velocity / exact.velocity, ours.pressure / exact.pressure];
            worst = [worst[0].max(ratios[0]), worst[1].max(ratios[1])];
            table.rows.push(vec![
                case.name.clone(),
                n.to_string(),
                number(ours.velocity),
                number(exact.velocity),
                format!("{:.2}", ratios[0]),
                number(plain.velocity),
                number(ours.pressure),
                number(exact.pressure),
                format!("{:.2}", ratios[1]),
                number(plain.pressure),
            ]);
            for (curve, e) in curves.iter_mut().zip([ours, exact, plain]) {
                curve.push((f64::from(n), e.velocity));
            }
            out.check(
                format!("{} at {n}: velocity error of plain particles relative to ours", case.name),
                plain.velocity / ours.velocity,
                Bound::AtLeast(1.0),
            );
        }
        for (label, curve) in ["ours", "without particles", "plain particles"].iter().zip(curves) {
            figure.curves.push((format!("{}, {label}", case.name), curve));
        }
        for (name, worst) in ["velocity", "pressure"].iter().zip(worst) {
            out.check(
                format!("{}: largest {name} error relative to that without particles", case.name),
                worst,
                Bound::AtMost(1.5),
            );
        }
    }
    let (moving, fixed) = (steady_vortex(), steady_vortex_without_particles());
    for &n in effort.take(&[16, 32]) {
        let ours = moving.errors_at_end(n, &[])?;
        let exact = fixed.errors(n, &[])?;
        table.rows.push(vec![
            moving.name.clone(),
            n.to_string(),
            number(ours.velocity),
            number(exact.velocity),
            format!("{:.2}", ours.velocity / exact.velocity),
            String::new(),
            number(ours.pressure),
            number(exact.pressure),
            format!("{:.2}", ours.pressure / exact.pressure),
            String::new(),
        ]);
        out.check(
            format!("steady vortex at {n}: velocity error relative to that without particles"),
            ours.velocity / exact.velocity,
            Bound::AtMost(2.0),
        );
    }
    out.tables.push(table);
    out.figures.push(figure);
    Ok(out)
}
