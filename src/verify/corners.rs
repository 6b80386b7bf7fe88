//! Verifies flow around the corners of an aperture: initial discharge of the silo on uniform and
//! graded meshes.

use super::Effort;
use super::report::{Bound, Section, Table, number};
use crate::cases::{CaseError, start};
use crate::scene::presets;

/// Number of cells of the uniform mesh at the preset's resolution: 8 per aperture, in a domain of
/// 6 x 8 apertures.
const UNIFORM_CELLS: f64 = 48.0 * 64.0;

/// Initial discharge in `rho g a^3/eta`, and number of cells of the mesh along x and y.
fn discharge(sets: &[&str]) -> Result<(f64, [usize; 2]), CaseError> {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    let source = presets::find("silo")?.with_sets(&sets)?;
    let run = start(&source)?;
    let mesh = &run.plan().mesh;
    let cells = [mesh.x.cells(), mesh.y.cells()];
    Ok((run.row().gauges[0].rate / 1e4, cells))
}

/// Verifies the initial discharge of the silo.
pub fn section(effort: Effort) -> Result<Section, CaseError> {
    let mut out = Section {
        title: "Corners: the silo's initial discharge",
        about: "Outflow rate through the aperture at the start, in rho g a^3/eta. The solution is \
                singular at the edges of the aperture, so uniform meshes converge only at first \
                order; the limit is extrapolated from the two finest uniform meshes. Meshes graded \
                towards the edges are more accurate with fewer cells."
            .into(),
        ..Section::default()
    };
    for alpha in effort.take(&["0", "1/3"]) {
        let alpha_set = format!("alpha={alpha}");
        let mut table = Table::new(
            format!("alpha = {alpha}"),
            &["mesh", "cells", "discharge", "difference from the limit"],
        );
        let mut rows = vec![];
        for n in effort.take(&[4, 8, 16, 32]) {
            let cells = format!("accuracy.cells={n}");
            let (q, mesh) = discharge(&[&alpha_set, "mesh.grading=[]", &cells])?;
            rows.push((format!("uniform, {n} per aperture"), mesh, q));
        }
        let [.., (_, _, coarse), (_, _, fine)] = &rows[..] else { continue };
        let limit = 2.0 * fine - coarse;
        let (q, mesh) = discharge(&[&alpha_set])?;
        rows.push(("graded, default of the preset".into(), mesh, q));
        for (name, [nx, ny], q) in &rows {
            table.rows.push(vec![
                name.clone(),
                format!("{nx} x {ny} = {}", nx * ny),
                format!("{q:.4}"),
                format!("{:.2} %", 100.0 * (q / limit - 1.0)),
            ]);
        }
        table.rows.push(vec![
            "extrapolated".into(),
            String::new(),
            format!("{limit:.4}"),
            String::new(),
        ]);
        out.tables.push(table);
        if effort == Effort::Full {
            out.check(
                format!("alpha = {alpha}: relative difference of the default mesh from the limit"),
                (q / limit - 1.0).abs(),
                Bound::AtMost(3e-3),
            );
        }
        out.check(
            format!("alpha = {alpha}: cells of the default mesh over those of the uniform mesh"),
            (mesh[0] * mesh[1]) as f64 / UNIFORM_CELLS,
            Bound::AtMost(1.0),
        );
        out.about += &format!(" Limit at alpha = {alpha}: {}.", number(limit));
    }
    Ok(out)
}
