//! The corner of an aperture: initial discharge of the silo, uniform and graded meshes.

use super::Effort;
use super::report::{Bound, Section, Table, number};
use crate::cases::{CaseError, start};
use crate::scene::presets;

/// Cells of the uniform mesh at the preset's resolution: 8 per aperture, 6 x 8 apertures.
const UNIFORM_CELLS: f64 = 48.0 * 64.0;

/// Initial discharge in `rho g a^3/eta`, and cells of the mesh.
fn discharge(sets: &[&str]) -> Result<(f64, [usize; 2]), CaseError> {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    let source = presets::find("silo")?.with_sets(&sets)?;
    let run = start(&source)?;
    let mesh = &run.plan().mesh;
    let cells = [mesh.x.cells(), mesh.y.cells()];
    Ok((run.row().gauges[0].rate / 1e4, cells))
}

pub fn section(effort: Effort) -> Result<Section, CaseError> {
    let mut out = Section {
        title: "Corners: the silo's initial discharge",
        about: "Outflow through the aperture at the first instant, in rho g a^3/eta. The lips of \
                the aperture are singular, so uniform meshes converge at first order only; the \
                limit is extrapolated from the two finest uniform meshes. Cells that shrink \
                towards the lips do better with fewer."
            .into(),
        ..Section::default()
    };
    for alpha in effort.take(&["0", "1/3"]) {
        let alpha_set = format!("alpha={alpha}");
        let mut table = Table::new(
            format!("alpha = {alpha}"),
            &["mesh", "cells", "discharge", "off the limit"],
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
        rows.push(("the preset's default".into(), mesh, q));
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
                format!("alpha = {alpha}: default mesh off the limit"),
                (q / limit - 1.0).abs(),
                Bound::AtMost(3e-3),
            );
        }
        out.check(
            format!("alpha = {alpha}: cells of the default mesh over the uniform one's"),
            (mesh[0] * mesh[1]) as f64 / UNIFORM_CELLS,
            Bound::AtMost(1.0),
        );
        out.about += &format!(" Limit at alpha = {alpha}: {}.", number(limit));
    }
    Ok(out)
}
