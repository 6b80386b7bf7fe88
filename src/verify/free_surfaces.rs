//! Verifies sloping free surfaces of a heavy fluid under a light, thin one, which cut cells at any
//! height and angle.

use super::Effort;
use super::report::{Bound, Figure, Section, Table, number};
use crate::cases::{CaseError, start};
use crate::scene::SceneSource;

/// Values of `accuracy.quadrature` that are compared.
const RULES: [&str; 3] = ["sides", "laminate", "particles"];
/// The rule for free surfaces.
const RULE: &str = "sides";

/// A unit box whose lower half is heavy, up to a surface of the given slope.
struct Tilt {
    slope: f64,
    /// Viscosity of the heavy fluid over that of the light one.
    contrast: f64,
    /// Power of the weight at the start, `rho^2 g^2 a^4/eta` (per unit depth): Q2-P1 elements on a
    /// mesh that follows the surface, extrapolated from 16, 32 and 64 cells per side.
    power: f64,
}

const TILTS: [Tilt; 6] = [
    Tilt { slope: 0.1, contrast: 1e2, power: 3.812e-5 },
    Tilt { slope: 0.1, contrast: 1e4, power: 3.903e-5 },
    Tilt { slope: 0.1, contrast: 1e6, power: 3.904e-5 },
    Tilt { slope: 0.4, contrast: 1e2, power: 6.119e-4 },
    Tilt { slope: 0.4, contrast: 1e4, power: 6.308e-4 },
    Tilt { slope: 0.4, contrast: 1e6, power: 6.310e-4 },
];

/// Verifies tilted surfaces and a slump.
pub fn section(effort: Effort) -> Result<Section, CaseError> {
    let mut out = Section {
        title: "Sloping free surfaces",
        about:
            "A heavy fluid under a light one a hundred to a million times thinner, with no slip \
                on all walls. `sides` (default): where materials of different weight share a cell, \
                each has its own stiffness and weight on its side of a straight line. `laminate`: \
                the materials act in series in shear, so a cell that is mostly heavy is as weak as \
                the light fluid, and its weight drives the light fluid. `particles`: particles as \
                integration points (the source)."
                .into(),
        ..Section::default()
    };
    tilts(effort, &mut out)?;
    slump(effort, &mut out)?;
    Ok(out)
}

/// Error of the power of the weight of tilted surfaces, and the largest speed.
fn tilts(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let mut header = vec!["slope", "contrast", "cells"];
    header.extend(RULES);
    let title = "Relative error of the power of the weight at the start (in brackets: largest speed, \
                 which is that of the light fluid, in rho g a^2/eta)";
    let mut table = Table::new(title, &header);
    let mut figure = Figure {
        name: "free_surfaces".into(),
        title: "Error of the power of a surface of slope 0.4, contrast 1e6".into(),
        x: "cells per side",
        y: "relative error",
        logarithmic: true,
        curves: RULES.map(|rule| (rule.into(), vec![])).to_vec(),
    };
    let (mut coarse, mut fine): (f64, f64) = (0.0, 0.0);
    for tilt in &TILTS {
        let Tilt { slope, contrast, power } = *tilt;
        for &cells in effort.take(&[8, 16, 32, 64]) {
            let mut row = vec![number(slope), number(contrast), cells.to_string()];
            for (rule, curve) in RULES.iter().zip(&mut figure.curves) {
                let run = start(&tilted(tilt, cells, rule)?)?;
                let error = (run.row().power_in / power - 1.0).abs();
                row.push(format!("{} ({})", number(error), number(run.row().max_speed)));
                if slope == 0.4 && contrast == 1e6 {
                    curve.1.push((f64::from(cells), error));
                }
                if *rule == RULE && cells == 16 {
                    coarse = coarse.max(error);
                }
                if *rule == RULE && cells == 64 {
                    fine = fine.max(error);
                }
            }
            table.rows.push(row);
        }
    }
    out.tables.push(table);
    out.figures.push(figure);
    out.check("tilted surfaces, 16 cells: error of the power", coarse, Bound::AtMost(0.025));
    if effort == Effort::Full {
        out.check("tilted surfaces, 64 cells: error of the power", fine, Bound::AtMost(0.007));
    }
    Ok(())
}

fn tilted(tilt: &Tilt, cells: u32, rule: &str) -> Result<SceneSource, CaseError> {
    let Tilt { slope, contrast, .. } = tilt;
    let text = format!(
        "schema = 1\nname = \"tilt\"\ngravity = [0, -1]\n[domain]\nx = [0, 1]\ny = [0, 1]\n\
         length_scale = 1\n[accuracy]\ncells = {cells}\nquadrature = \"{rule}\"\n[time]\nend = 1\n\
         [boundaries]\nleft.kind = \"no_slip\"\nright.kind = \"no_slip\"\n\
         bottom.kind = \"no_slip\"\ntop.kind = \"no_slip\"\n\
         [materials.heavy]\ndensity = 1\nshear_viscosity = 1\n\
         [materials.light]\nshear_viscosity = \"1/{contrast}\"\n\
         [[regions]]\nmaterial = \"light\"\n[[regions]]\nmaterial = \"heavy\"\n\
         shape.where = \"y < 0.5 + {slope}*(x - 0.5)\"\n"
    );
    Ok(SceneSource::new("tilt", text))
}

/// Energy balance of a block of mud that slumps in air.
fn slump(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let header = [
        "contrast",
        "cells",
        "rule",
        "steps",
        "energy lost, J/m",
        "dissipated, J/m",
        "rms speed, m/s",
    ];
    let title = "A block of mud of 1 m (1000 kg/m3, 1000 Pa s) slumps in air: t = 5 s";
    let mut table = Table::new(title, &header);
    let mut worst: f64 = 0.0;
    let mut lost_at = vec![];
    for &(contrast, cells, rule) in effort.take(&[
        (1e4, 8, "sides"),
        (1e4, 16, "sides"),
        (1e6, 16, "sides"),
        (1e4, 32, "sides"),
        (1e4, 16, "laminate"),
        (1e4, 16, "particles"),
    ]) {
        let mut run = start(&slumping(contrast, cells, rule))?;
        let first = run.row().potential_energy;
        while !run.is_finished() {
            run.step()?;
        }
        let row = run.row();
        let lost = first - row.potential_energy;
        if rule == RULE {
            worst = worst.max((lost - row.dissipated).abs() / lost);
            lost_at.push(lost);
        }
        table.rows.push(vec![
            number(contrast),
            cells.to_string(),
            rule.into(),
            row.step.to_string(),
            format!("{lost:.0}"),
            format!("{:.0}", row.dissipated),
            number(row.rms_speed),
        ]);
    }
    out.tables.push(table);
    let last = lost_at[lost_at.len() - 1];
    let spread = lost_at.iter().map(|l| (l / last - 1.0).abs()).fold(0.0, f64::max);
    out.check("slump: difference of the energy lost and dissipated", worst, Bound::AtMost(0.035));
    out.check("slump: energy lost, difference from the finest mesh", spread, Bound::AtMost(0.01));
    Ok(())
}

fn slumping(contrast: f64, cells: u32, rule: &str) -> SceneSource {
    let text = format!(
        "schema = 1\nname = \"slump\"\ngravity = [0, -10]\n[domain]\nx = [0, 4]\ny = [0, 1.5]\n\
         length_scale = 1\n[accuracy]\ncells = {cells}\nquadrature = \"{rule}\"\n\
         [time]\nend = 5\n[boundaries]\nleft.kind = \"no_slip\"\n\
         right.kind = \"no_slip\"\nbottom.kind = \"no_slip\"\n\
         [materials.mud]\ndensity = 1000\nshear_viscosity = 1000\n\
         [materials.air]\nshear_viscosity = \"1000/{contrast}\"\n\
         [[regions]]\nmaterial = \"air\"\n[[regions]]\nmaterial = \"mud\"\n\
         shape.rectangle = {{ x = [0, 1], y = [0, 1] }}\n"
    );
    SceneSource::new("slump", text)
}
