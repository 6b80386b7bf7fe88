//! Makes the figures of the discharge of grains: an hour-glass beside a water clock, and the rate against the
//! aperture.

use super::Args;
use super::runs::{self, Job};
use crate::commands::Failure;
use crate::record::number::short;
use crate::record::plots::{Axis, Curve, PlotSpec, line_plot, panels_plot};
use crate::scene::presets;
use crate::sim::Run;
use std::path::Path;

/// Width of the vessel of both presets, and level of its filling at the start, m.
const VESSEL: f64 = 5.0;
const FILLED: f64 = 4.5;
/// Apertures of the figures of Beverloo's law, m.
const APERTURES: [&str; 5] = ["0.5", "0.7", "0.9", "1.1", "1.3"];
/// Time between which the rate of discharge is averaged, s: after the start, while the level is high.
const STEADY: [f64; 2] = [1.5, 3.5];
/// Levels between which the rates of the hour-glass and the water clock are averaged, m.
const LEVELS: [[f64; 2]; 2] = [[4.0, 3.5], [3.0, 2.5]];

/// Time (s), volume that has left (m2) and rate (m2/s) of each step of a run.
#[derive(Default)]
struct Discharge(Vec<[f64; 3]>);

impl Discharge {
    fn gather(&mut self, run: &dyn Run) {
        let row = run.row();
        self.0.extend(row.gauges.first().map(|g| [row.time, g.volume, g.rate]));
    }

    /// Mean level, m: that of the volume left in the vessel.
    fn level(volume: f64) -> f64 {
        FILLED - volume / VESSEL
    }

    /// Time and volume at which a quantity of the steps first reaches `value`, interpolated.
    fn when(&self, value: f64, of: impl Fn(&[f64; 3]) -> f64) -> Option<[f64; 2]> {
        let pair = self.0.windows(2).find(|w| of(&w[0]) <= value && of(&w[1]) >= value)?;
        let ([t, v, _], [s, w, _]) = (pair[0], pair[1]);
        let rise = of(&pair[1]) - of(&pair[0]);
        let share = if rise > 0.0 { (value - of(&pair[0])) / rise } else { 0.0 };
        Some([t + share * (s - t), v + share * (w - v)])
    }

    /// Mean rate between two values of a quantity of the steps that does not fall.
    fn mean_rate(&self, [from, to]: [f64; 2], of: impl Fn(&[f64; 3]) -> f64) -> Option<f64> {
        let ([t, v], [s, w]) = (self.when(from, &of)?, self.when(to, &of)?);
        (s > t).then(|| (w - v) / (s - t))
    }

    fn curve(&self, name: &str, y: impl Fn(&[f64; 3]) -> f64) -> Curve {
        let points = self.0.iter().map(|step| (step[0], y(step))).collect();
        Curve { name: name.into(), points, marks: false }
    }
}

/// Settings of the runs: the mesh of a quick or a full figure, and few frames.
fn sets(args: &Args, more: &[String]) -> Vec<String> {
    let cells = if args.quick { 10 } else { 32 };
    let own = [format!("accuracy.cells={cells}"), "recording.frames=20".into()];
    own.into_iter().chain(more.iter().cloned()).collect()
}

/// Level and discharge rate over time of the presets `hourglass` and `clepsydra`.
pub(super) fn hourglass(args: &Args, out: &Path) -> Result<String, Failure> {
    const NAMES: [(&str, &str); 2] = [("hourglass", "grains"), ("clepsydra", "water")];
    let mut jobs = vec![];
    for (preset, name) in NAMES {
        let source = presets::find(preset)?;
        let run = (name.to_string(), preset.to_string(), sets(args, &[]));
        jobs.push(Job::new(&source, run, (args, out))?);
    }
    let found = runs::run_all(&jobs, Discharge::gather)?;
    let curves = |y: fn(&[f64; 3]) -> f64| {
        found.iter().zip(NAMES).map(|(d, (_, name))| d.curve(name, y)).collect::<Vec<_>>()
    };
    let time = || Axis::new("time", "s");
    let stem = out.join("hourglass_discharge");
    let plot = |title: &str, y, curves| PlotSpec { title: title.into(), x: time(), y, curves };
    panels_plot(
        &stem,
        &[
            plot("Mean level", Axis::new("level", "m"), curves(|s| Discharge::level(s[1]))),
            plot("Discharge rate", Axis::new("rate", "m²/s"), curves(|s| s[2])),
        ],
    )?;
    let mut said = String::new();
    for (d, (_, name)) in found.iter().zip(NAMES) {
        // Volumes of these levels.
        let rate = |[high, low]: [f64; 2]| {
            d.mean_rate([high, low].map(|level| VESSEL * (FILLED - level)), |s| s[1])
        };
        let rates = LEVELS.map(rate);
        let text = |k: usize| {
            let [high, low] = LEVELS[k];
            let rate = rates[k].map_or("not reached".into(), |r| format!("{} m2/s", short(r)));
            format!("level {high} to {low} m: {rate}")
        };
        said += &format!("{name}: {}; {}", text(0), text(1));
        if let [Some(first), Some(second)] = rates {
            said += &format!("; ratio {:.3}", second / first);
        }
        said += "\n";
    }
    let [first, second] = LEVELS.map(|[high, low]| 0.5 * (high + low));
    said += &format!(
        "ratio of a constant rate: 1; of one like the root of the level: {:.3}\n",
        (second / first).sqrt()
    );
    Ok(said + &super::files(&stem) + &runs::list(&jobs))
}

/// An hour-glass whose discharge rate is measured against its aperture.
pub(super) struct Aperture {
    /// Preset.
    preset: &'static str,
    /// Name and symbol of the size of the aperture.
    size: [&'static str; 2],
    /// Exponent of the size in Beverloo's law, and the text of its inverse.
    exponent: f64,
    inverse: &'static str,
    /// One over the diameter of the grains, 1/m.
    grains: u32,
    /// Unit of the rate.
    unit: &'static str,
    /// Name of the picture.
    picture: &'static str,
}

/// A slit.
pub(super) const SLIT: Aperture = Aperture {
    preset: "hourglass",
    size: ["aperture", "W"],
    exponent: 1.5,
    inverse: "2/3",
    grains: 30,
    unit: "m²/s",
    picture: "beverloo_rates",
};
/// A round hole.
pub(super) const HOLE: Aperture = Aperture {
    preset: "round_hourglass",
    size: ["diameter", "D"],
    exponent: 2.5,
    inverse: "2/5",
    // The plain exponent is that of the size less a diameter: grains are half as large as in the plane.
    grains: 60,
    unit: "m³/s",
    picture: "round_beverloo_rates",
};

/// Discharge rate `Q` of an hour-glass against the size `W` of its aperture, with the fitted line
///
/// ```text
/// Q^(1/n) = s (W - W0)        n = 3/2 for a slit, 5/2 for a round hole
/// ```
/// (W. A. Beverloo, H. A. Leniger, J. van de Velde, Chem. Eng. Sci. 15 (1961) 260).
pub(super) fn beverloo(of: &Aperture, args: &Args, out: &Path) -> Result<String, Failure> {
    let source = presets::find(of.preset)?;
    let mut jobs = vec![];
    let [size, letter] = of.size;
    for aperture in APERTURES {
        let more = [
            format!("aperture={aperture}"),
            format!("diameter=1/{}", of.grains),
            format!("time.end={}", STEADY[1] + 0.1),
        ];
        let folder = format!("aperture_{aperture}");
        let run = (format!("{letter} = {aperture}"), folder, sets(args, &more));
        jobs.push(Job::new(&source, run, (args, out))?);
    }
    let found = runs::run_all(&jobs, Discharge::gather)?;
    let rates = APERTURES.iter().zip(&found).filter_map(|(w, d)| {
        Some((w.parse::<f64>().ok()?, d.mean_rate(STEADY, |s| s[0]).filter(|&q| q > 0.0)?))
    });
    let rates: Vec<(f64, f64)> = rates.collect();
    let measured: Vec<(f64, f64)> =
        rates.iter().map(|&(w, q)| (w, q.powf(1.0 / of.exponent))).collect();
    let [slope, offset] = line(&measured);
    let least = -offset / slope;
    let logarithms: Vec<_> = rates.iter().map(|&(w, q)| (w.ln(), q.ln())).collect();
    let exponent = line(&logarithms)[0];
    let Aperture { inverse, unit, .. } = of;
    let fit = format!(
        "Q^({inverse}) = {} ({letter} - {letter}0), {letter}0 = {} m, plain exponent {}",
        short(slope),
        short(least),
        short(exponent)
    );
    let end = measured.last().map_or(1.0, |p| p.0);
    let ends = [least.min(measured.first().map_or(0.0, |p| p.0)), end];
    let stem = out.join(of.picture);
    line_plot(
        &stem,
        &PlotSpec {
            title: format!("Discharge of grains: {fit}"),
            x: Axis::new(format!("{size} {letter}"), "m"),
            y: Axis::new(format!("Q^({inverse})"), format!("({unit})^({inverse})")),
            curves: vec![
                Curve { name: "measured".into(), points: measured.clone(), marks: true },
                Curve {
                    name: "fitted line".into(),
                    points: ends.map(|w| (w, slope * w + offset)).to_vec(),
                    marks: false,
                },
            ],
        },
    )?;
    let mut said = String::new();
    for ((w, q), (_, y)) in rates.iter().zip(&measured) {
        let off = 100.0 * (y / (slope * w + offset) - 1.0);
        said += &format!(
            "{letter} = {w} m: Q = {q:.4} {unit}, Q^({inverse}) off the line by {off:+.2} %\n"
        );
    }
    said +=
        &format!("{fit}; {letter}0 is {} grain diameters\n", short(least * f64::from(of.grains)));
    Ok(said + &super::files(&stem) + &runs::list(&jobs))
}

/// Slope and offset of the line of least squares through points.
fn line(points: &[(f64, f64)]) -> [f64; 2] {
    let n = points.len() as f64;
    let mean = |f: fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let sum = |f: &dyn Fn(f64, f64) -> f64| points.iter().map(|p| f(p.0 - x, p.1 - y)).sum::<f64>();
    let slope = sum(&|a, b| a * b) / sum(&|a, _| a * a);
    [slope, y - slope * x]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_fitted() {
        let [slope, offset] = line(&[(1.0, 2.5), (2.0, 4.5), (4.0, 8.5)]);
        assert!((slope - 2.0).abs() < 1e-12 && (offset - 0.5).abs() < 1e-12);
    }

    #[test]
    fn rates_are_means_between_times_and_between_volumes() {
        // The volume is t^2.
        let steps = (0..=10).map(|k| [f64::from(k), f64::from(k * k), 2.0 * f64::from(k)]);
        let d = Discharge(steps.collect());
        assert_eq!(d.mean_rate([2.0, 4.0], |s| s[0]), Some(6.0));
        assert_eq!(d.mean_rate([4.0, 16.0], |s| s[1]), Some(6.0));
        assert_eq!(d.mean_rate([4.0, 160.0], |s| s[1]), None);
    }
}
