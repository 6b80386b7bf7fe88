//! Verifies that particles stay evenly distributed in long runs and that their volume is conserved.

use super::Effort;
use super::report::{Bound, Section, Table, number};
use crate::cases::{CaseError, start};
use crate::scene::SceneSource;

/// A box with a moving lid. At the corners of the lid particles accumulate and thin out most.
const LID: &str = "schema = 1\nname = \"lid\"\n[domain]\nx = [0, 1]\ny = [0, 1]\n[accuracy]\n\
                   cells = 16\n[time]\nend = 1e9\ncourant = 0.5\n[recording]\nframes = 0\n[materials.fluid]\n\
                   shear_viscosity = 1\n[[regions]]\nmaterial = \"fluid\"\n[boundaries]\n\
                   left.kind = \"no_slip\"\nright.kind = \"no_slip\"\nbottom.kind = \"no_slip\"\n\
                   top = { velocity_x = \"16*x^2*(1-x)^2\", velocity_y = 0 }\n";

/// Verifies the distribution of particles in a long run.
pub fn section(effort: Effort) -> Result<Section, CaseError> {
    let steps: u64 = if effort == Effort::Full { 10_000 } else { 500 };
    let mut out = Section {
        title: "Transport over long runs",
        about: "A steady vortex under a moving lid, 16 x 16 cells, Courant number 0.5. Particles \
                move with a velocity corrected to be divergence-free inside cells \
                (`motion/current.rs`). Without particle redistribution, the rms difference between \
                the particle volume in a cell and the cell volume after 10,000 steps is 4 without \
                the correction and 0.24 with it. The orders in time of particles, directors and \
                dye are tested in the physics tests `order`."
            .into(),
        ..Section::default()
    };
    let source = SceneSource::new("lid", LID);
    let mut run = start(&source)?;
    let start: f64 = run.particles().volume.iter().sum();
    let mut table = Table::new(
        "",
        &[
            "step",
            "rms error of cell volumes",
            "fewest per cell",
            "most per cell",
            "splits",
            "merges",
        ],
    );
    let mut next = 1;
    for step in 1..=steps {
        run.step()?;
        if step == next || step == steps {
            let particles = run.particles();
            let counts = || (0..run.plan().mesh.cells()).map(|c| particles.of_cell(c).len());
            let row = run.row();
            table.rows.push(vec![
                step.to_string(),
                number(row.volume_error),
                counts().min().unwrap_or(0).to_string(),
                counts().max().unwrap_or(0).to_string(),
                row.splits.to_string(),
                row.merges.to_string(),
            ]);
            next *= 10;
        }
    }
    let least = (0..run.plan().mesh.cells()).map(|c| run.particles().of_cell(c).len()).min();
    out.tables.push(table);
    out.check("rms error of cell volumes", run.row().volume_error, Bound::AtMost(0.3));
    // A quarter of the nominal number, the lower bound where one material carries nothing.
    out.check("fewest particles in a cell", least.unwrap_or(0) as f64, Bound::AtLeast(4.0));
    let volume: f64 = run.particles().volume.iter().sum();
    out.check("change of the total volume", (volume / start - 1.0).abs(), Bound::AtMost(1e-12));
    Ok(out)
}
