//! Verifies the Rayleigh-Taylor instability: growth rates against linear theory, and the benchmark
//! of van Keken et al. (1997).

use super::Effort;
use super::report::{Bound, Figure, Section, Table, number};
use crate::cases::rayleigh_taylor::{Undulation, growth_ratio};
use crate::cases::{CaseError, start};
use crate::scene::presets;

/// Verifies growth rates and the van Keken benchmark.
pub fn section(effort: Effort) -> Result<Section, CaseError> {
    let mut out = Section {
        title: "Rayleigh-Taylor",
        about: "A light layer below a heavy one. *Growth rates*: first Fourier mode of the \
                velocity along an interface undulated by 1e-4 of the height, over the rate of \
                linear theory (Ramberg 1968); at 64 cells the interface at 0.2 lies inside \
                cells. *Benchmark*: rms speed of the isoviscous box of van Keken et al. (1997), \
                preset `rayleigh_taylor`; published peaks: 3.0916e-3 at 208.99 (HS, 81^2), \
                3.0943e-3 at 208.5 (CND, 48^2), 3.091e-3 at 207.05 (PvK, 80^2), 3.102e-3 at 209.2 \
                (Tackley and King, 128^2 with 40 particles per cell)."
            .into(),
        ..Section::default()
    };
    growth(effort, &mut out)?;
    if effort == Effort::Full {
        benchmark(&mut out)?;
    }
    Ok(out)
}

/// Growth rates for several wavelengths and viscosity ratios.
fn growth(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    const WAVELENGTHS: [f64; 4] = [0.5, 1.0, 1.8284, 3.0];
    const CELLS: u32 = 64;
    let mut table = Table::new(
        "Growth rate over that of linear theory",
        &["viscosity ratio", "0.5", "1", "1.8284", "3"],
    );
    let mut worst: f64 = 0.0;
    for viscosity in effort.take(&[1.0, 0.01, 0.1, 10.0, 100.0]) {
        let mut row = vec![number(*viscosity)];
        for wavelength in WAVELENGTHS {
            let u = Undulation { wavelength, viscosity: *viscosity, amplitude: 1e-4 };
            let ratio = growth_ratio(u, CELLS, &[])?;
            worst = worst.max((ratio - 1.0).abs());
            row.push(format!("{ratio:.4}"));
        }
        table.rows.push(row);
    }
    out.tables.push(table);
    out.check("largest error of a growth rate", worst, Bound::AtMost(0.01));
    Ok(())
}

/// First peak of the rms speed in the van Keken benchmark.
fn benchmark(out: &mut Section) -> Result<(), CaseError> {
    let sets = ["accuracy.cells=64".into(), "time.end=300".into(), "recording.frames=1".into()];
    let source = presets::find("rayleigh_taylor")?.with_sets(&sets)?;
    let mut run = start(&source)?;
    let mut curve = vec![(run.row().time, run.row().rms_speed)];
    while !run.is_finished() {
        run.step()?;
        curve.push((run.row().time, run.row().rms_speed));
    }
    let (time, speed) = peak(&curve);
    let mut table = Table::new("van Keken et al., 64 cells", &["", "rms speed", "time"]);
    table.rows.push(vec!["first peak".into(), format!("{speed:.4e}"), format!("{time:.2}")]);
    out.tables.push(table);
    out.figures.push(Figure {
        name: "rayleigh_taylor".into(),
        title: "Rayleigh-Taylor, van Keken et al. 1997".into(),
        x: "time",
        y: "rms speed",
        logarithmic: false,
        curves: vec![("64 cells".into(), curve)],
    });
    out.check("rms speed of the first peak", speed, Bound::Within(3.09e-3, 3.09e-5));
    out.check("time of the first peak", time, Bound::Within(208.5, 1.5));
    Ok(())
}

/// Position and value of the maximum, on the parabola through the largest point and its neighbours.
fn peak(curve: &[(f64, f64)]) -> (f64, f64) {
    let best =
        (1..curve.len().saturating_sub(1)).max_by(|&a, &b| curve[a].1.total_cmp(&curve[b].1));
    let Some(k) = best else { return (f64::NAN, f64::NAN) };
    let [(x0, y0), (x1, y1), (x2, y2)] = [curve[k - 1], curve[k], curve[k + 1]];
    let (s, t) = ((y1 - y0) / (x1 - x0), (y2 - y1) / (x2 - x1));
    let bend = (t - s) / (x2 - x0);
    if bend >= 0.0 {
        return (x1, y1);
    }
    let x = 0.5 * (x0 + x1 - s / bend);
    (x, y0 + (x - x0) * (s + bend * (x - x1)))
}
