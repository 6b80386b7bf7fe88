//! Makes the figure of the width of a shear band of grains against the mesh size, with and without internal
//! length.
//!
//! The flow is the first one of the scene `bands.toml`. Its rate, in terms of the gradients of velocity `u`
//! and rotation `w` with the spin `o`,
//!
//! ```text
//! g^2 = 2 D:D + 4 (o - w)^2 + 2 R^2 |grad w|^2   (coupling ratio 1; without R: 2 D:D)
//! ```
//! is averaged along the band, which lies along the diagonal of the square, in cuts across it. The width is
//! that at half of the largest mean rate.

use super::Args;
use crate::cases::start;
use crate::commands::Failure;
use crate::record::number::short;
use crate::record::plots::{Axis, Curve, PlotSpec, line_plot};
use crate::record::replace::{self, Kind};
use crate::record::text::duration;
use crate::scene::SceneSource;
use crate::sim::{Run, SimError};
use std::f64::consts::FRAC_1_SQRT_2;
use std::path::Path;
use std::time::Instant;

/// The scene, and its file in the folder of the figure.
const SCENE: &str = include_str!("bands.toml");
const FILE: &str = "bands.toml";
/// Internal length, m: two cells of the coarsest mesh with an internal length.
const INTERNAL_LENGTH: f64 = 1.0 / 16.0;
/// Numbers of cells over the width with and without internal length.
const CELLS: [u32; 3] = [32, 64, 128];
const PLAIN_CELLS: [u32; 4] = [16, 32, 64, 128];
const QUICK: [u32; 2] = [16, 32];
/// Half of the distance across the band, and of that along it, over which the rate is averaged, m.
const ACROSS: f64 = 0.55;
const ALONG: f64 = 0.15;
/// Numbers of points across the band, and of cuts along it.
const POINTS: usize = 2001;
const CUTS: usize = 61;

/// A band: its width at half of the largest rate (m), and this rate (1/s).
#[derive(Clone, Copy)]
struct Band {
    width: f64,
    rate: f64,
}

/// Makes the figure in the folder `out`. Returns the text to print.
pub(super) fn make(args: &Args, out: &Path) -> Result<String, Failure> {
    keep_scene(&out.join(FILE), args.force)?;
    let (mut said, mut curves) = (String::new(), vec![]);
    for (r, cells) in [(INTERNAL_LENGTH, &CELLS[..]), (0.0, &PLAIN_CELLS)] {
        let cells = if args.quick { &QUICK } else { cells };
        let mut bands = vec![];
        for &n in cells {
            let clock = Instant::now();
            let found = band(r, n)?;
            let text = match &found {
                Ok(b) => format!("width {} m, largest rate {} 1/s", short(b.width), short(b.rate)),
                Err(e) => e.to_string(),
            };
            let took = duration(clock.elapsed().as_secs_f64());
            said += &format!("R = {r} m, {n} cells: {text}\n");
            eprintln!("R = {r} m, {n} cells: {took}");
            bands.extend(found.ok().map(|b| (n, b)));
        }
        if let ([(m, coarse), ..], Some((n, fine))) = (&bands[..], bands.last()) {
            let change = 100.0 * (fine.width / coarse.width - 1.0);
            said +=
                &format!("R = {r} m: from {m} to {n} cells the width changes by {change:+.2} %\n");
        }
        let points = bands.iter().map(|(n, b)| (1.0 / f64::from(*n), b.width)).collect();
        let name =
            if r > 0.0 { format!("R = {} m", short(r)) } else { "no internal length".into() };
        curves.push(Curve { name, points, marks: true });
    }
    let stem = out.join("bands_width");
    line_plot(
        &stem,
        &PlotSpec {
            title: "Width of a shear band".into(),
            x: Axis::new("cell size", "m").log(),
            y: Axis::new("width at half of the largest rate", "m").log(),
            curves,
        },
    )?;
    let scene = format!("wrote {}\n", out.join(FILE).display());
    Ok(said + &super::files(&stem) + &scene)
}

/// Writes the scene, so that it can be run. A changed scene is not replaced unless `force` is given.
fn keep_scene(path: &Path, force: bool) -> Result<(), Failure> {
    if !force && std::fs::read(path).is_ok_and(|text| text != SCENE.as_bytes()) {
        return Err(Failure::Environment(format!(
            "{} exists and differs from the scene of the figure: move it away, or give --force",
            path.display()
        )));
    }
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|e| {
            Failure::Environment(format!("cannot make the folder {}: {e}", folder.display()))
        })?;
    }
    Ok(replace::write(path, SCENE, Kind::Checked)?)
}

/// The band for an internal length and a number of cells, or why the flow did not converge.
fn band(r: f64, cells: u32) -> Result<Result<Band, SimError>, Failure> {
    let sets = [format!("internal_length={r:?}"), format!("accuracy.cells={cells}")];
    let source = SceneSource::new(FILE, SCENE).with_sets(&sets)?;
    match start(&source) {
        Ok(run) => Ok(Ok(measure(run.as_ref(), r, 1.0 / f64::from(cells)))),
        Err(crate::cases::CaseError::Sim(e @ SimError::Solve { .. })) => Ok(Err(e)),
        Err(e) => Err(e.into()),
    }
}

/// Measures the band of a flow with the internal length `r` and the cell size `h`.
fn measure(run: &dyn Run, r: f64, h: f64) -> Band {
    let place = |k: usize, n: usize, half: f64| half * (2.0 * k as f64 / (n - 1) as f64 - 1.0);
    let profile: Vec<(f64, f64)> = (0..POINTS)
        .map(|k| {
            let s = place(k, POINTS, ACROSS);
            let rates = (0..CUTS).map(|c| {
                let l = place(c, CUTS, ALONG);
                let p = [0.5 + FRAC_1_SQRT_2 * (l - s), 0.5 + FRAC_1_SQRT_2 * (l + s)];
                rate(run, r, h, p)
            });
            (s, rates.sum::<f64>() / CUTS as f64)
        })
        .collect();
    width(&profile)
}

/// The rate `g` at a point.
fn rate(run: &dyn Run, r: f64, h: f64, [x, y]: [f64; 2]) -> f64 {
    // Within a cell, central differences of the biquadratic flow are exact.
    let d = 1e-3 * h;
    let slope = |a: [f64; 2], b: [f64; 2]| {
        let (a, b) = (run.velocity_at(a), run.velocity_at(b));
        [0, 1, 2].map(|c| (b[c] - a[c]) / (2.0 * d))
    };
    let ([ux, vx, wx], [uy, vy, wy]) =
        (slope([x - d, y], [x + d, y]), slope([x, y - d], [x, y + d]));
    let strain = 2.0 * (ux * ux + vy * vy) + (uy + vx).powi(2);
    if r == 0.0 {
        return strain.sqrt();
    }
    let spin = 0.5 * (vx - uy) - run.velocity_at([x, y])[2];
    (strain + 4.0 * spin * spin + 2.0 * r * r * (wx * wx + wy * wy)).sqrt()
}

/// The largest value of a profile, and its width at half of this value.
fn width(profile: &[(f64, f64)]) -> Band {
    let mut top = 0;
    for k in 0..profile.len() {
        if profile[k].1 > profile[top].1 {
            top = k;
        }
    }
    let half = 0.5 * profile[top].1;
    // The first crossing from the largest value outwards, interpolated; the end if there is none.
    let crossing = |mut pairs: Box<dyn Iterator<Item = [(f64, f64); 2]> + '_>, end: f64| {
        let found = pairs.find(|[_, outer]| outer.1 < half);
        found.map_or(end, |[(s, a), (t, b)]| s + (t - s) * (a - half) / (a - b))
    };
    let right = crossing(
        Box::new(profile[top..].windows(2).map(|w| [w[0], w[1]])),
        profile[profile.len() - 1].0,
    );
    let left =
        crossing(Box::new(profile[..=top].windows(2).rev().map(|w| [w[1], w[0]])), profile[0].0);
    Band { width: right - left, rate: profile[top].1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_width_is_that_at_half_height() {
        let profile: Vec<(f64, f64)> = (0..=100)
            .map(|k| f64::from(k) / 100.0 - 0.4)
            .map(|s| (s, 2.0 - 5.0 * s.abs()))
            .collect();
        let band = width(&profile);
        assert!((band.rate - 2.0).abs() < 1e-12 && (band.width - 0.4).abs() < 1e-9);
    }
}
