//! Chooses combinations of settings, runs them, and lists what was found.

use super::super::CostError;
use super::super::list::{Entry, KnobLine};
use super::super::measure::Sample;
use super::super::pareto::{self, Offer, Power};
use super::super::planning::ROUNDING;
use super::super::reference::{Kind, Reference};
use super::*;

impl Survey<'_> {
    /// The result of a candidate, if it was run.
    pub(super) fn ran(&self, settings: &[usize]) -> Option<&Sample> {
        self.ran.iter().find(|r| r.settings == settings).map(|r| &r.sample)
    }

    /// Relative error of a run against the reference.
    pub(super) fn error(&self, sample: &Sample, reference: &Reference) -> f64 {
        let error = self.target.distance(&sample.value, &reference.value, reference.scale);
        if error < ROUNDING { 0.0 } else { error }
    }

    /// Error that each level of a knob adds, and the power law fitted to it.
    pub(super) fn adds(
        &self,
        knob: usize,
        reference: &Reference,
    ) -> (Vec<Option<f64>>, Option<Power>) {
        let k = &self.design.knobs[knob];
        let at = |l: usize| self.ran(&self.design.one(knob, l));
        let between = |a: &Sample, b: &Sample| {
            let d = self.target.distance(&a.value, &b.value, reference.scale);
            if d < ROUNDING { 0.0 } else { d }
        };
        let measured: Vec<usize> = (0..k.levels.len()).filter(|&l| at(l).is_some()).collect();
        let sized = k.levels.iter().all(|l| l.size.is_some());
        if sized {
            let size = |l: usize| k.levels[l].size.unwrap_or(1.0);
            let finest = measured.iter().copied().min_by(|&a, &b| size(a).total_cmp(&size(b)));
            let Some((finest, best)) = finest.and_then(|f| Some((f, at(f)?))) else {
                return (vec![None; k.levels.len()], None);
            };
            let differences: Vec<(f64, f64)> =
                measured.iter().filter_map(|&l| Some((size(l), between(at(l)?, best)))).collect();
            let power = pareto::fit(size(finest), &differences, k.expected);
            let adds = (0..k.levels.len())
                .map(|l| {
                    let found = at(l)?;
                    // The measured difference is used; the fit only adds the error of the finest
                    // level.
                    let rest = power.map_or(0.0, |p| p.at(size(finest)));
                    Some(between(found, best) + rest)
                })
                .collect();
            return (adds, power);
        }
        // A choice: the level with the smallest error adds nothing.
        let best = match k.name {
            // The scene's own tolerance is the smallest one tried.
            "tolerance" => Some(k.base),
            _ => measured.iter().copied().min_by(|&a, &b| {
                let error = |l| at(l).map_or(f64::INFINITY, |s| self.error(s, reference));
                error(a).total_cmp(&error(b))
            }),
        };
        let best = best.and_then(at);
        let adds = (0..k.levels.len()).map(|l| Some(between(at(l)?, best?))).collect();
        (adds, None)
    }

    /// Runs combinations on the Pareto front of the model of errors and times.
    pub(super) fn combine(&mut self, reference: &Reference) -> Result<(), CostError> {
        let base = self.ran[0].sample.took;
        let mut offers: Vec<Vec<Offer>> = vec![];
        // Levels that were run: indices of the model differ from those of the design.
        let mut known: Vec<Vec<usize>> = vec![];
        for (k, knob) in self.design.knobs.iter().enumerate() {
            let (adds, _) = self.adds(k, reference);
            let mut offer = vec![];
            let mut levels = vec![];
            for l in 0..knob.levels.len() {
                let ran = self.ran(&self.design.one(k, l));
                if let (Some(add), Some(sample)) = (adds[l], ran) {
                    offer.push((add, sample.took.cpu / base.cpu.max(1e-9)));
                    levels.push(l);
                }
            }
            offers.push(offer);
            known.push(levels);
        }
        let proposed: Vec<Vec<usize>> = pareto::model_front(&offers)
            .into_iter()
            .map(|m| m.iter().enumerate().map(|(k, &i)| known[k][i]).collect::<Vec<_>>())
            .filter(|s| self.ran(s).is_none())
            .collect();
        for settings in pareto::spread(&proposed, self.limits.combinations) {
            let ratio: f64 = settings
                .iter()
                .enumerate()
                .filter_map(|(k, l)| known[k].iter().position(|m| m == l).map(|i| offers[k][i].1))
                .product();
            self.candidate(settings, base.wall * ratio)?;
        }
        Ok(())
    }

    /// Contribution of each knob to the error of a candidate, largest first.
    pub(super) fn split(
        &self,
        settings: &[usize],
        adds: &[Vec<Option<f64>>],
    ) -> Vec<(String, f64)> {
        let mut split: Vec<(String, f64)> = (self.design.knobs.iter().enumerate())
            .map(|(k, knob)| (knob.name.to_string(), adds[k][settings[k]].unwrap_or(0.0)))
            .collect();
        split.sort_by(|a, b| b.1.total_cmp(&a.1));
        split
    }

    /// Knobs, entries and Pareto front of the table.
    pub(super) fn entries(
        &self,
        reference: &Reference,
        gauges: &[Reference],
    ) -> (Vec<KnobLine>, Vec<Entry>, Vec<usize>) {
        let found: Vec<_> = (0..self.design.knobs.len()).map(|k| self.adds(k, reference)).collect();
        let knobs = self
            .design
            .knobs
            .iter()
            .zip(&found)
            .map(|(knob, (adds, power))| KnobLine {
                name: knob.name.into(),
                adds: (knob.levels.iter().zip(adds))
                    .filter_map(|(l, a)| Some((l.label.clone(), (*a)?)))
                    .collect(),
                rate: power.filter(|p| p.seen).map(|p| p.p),
                misfit: power.filter(|p| p.seen).map(|p| p.misfit),
            })
            .collect();
        let adds: Vec<Vec<Option<f64>>> = found.into_iter().map(|f| f.0).collect();
        let growth = self.growth.map_or(1.0, |g| g.of_promises());
        let mut entries: Vec<Entry> = self
            .ran
            .iter()
            .map(|r| {
                let s = &r.sample;
                let error = self.error(s, reference);
                let split = self.split(&r.settings, &adds);
                let trusted = match reference.kind {
                    Kind::Exact => error,
                    _ => split.iter().map(|s| s.1 * s.1).sum::<f64>().sqrt(),
                };
                Entry {
                    label: self.design.label(&r.settings),
                    sets: self.design.sets(&r.settings),
                    error,
                    promised: growth * (error.max(trusted) + reference.uncertainty),
                    lucky: error < 0.4 * trusted,
                    cpu: s.took.cpu,
                    wall: s.took.wall,
                    repeats: r.repeats,
                    steps: s.steps,
                    unknowns: s.unknowns,
                    particles: s.particles,
                    phases: s.phases.list().map(|(n, t)| (n.to_string(), t)).to_vec(),
                    split,
                    gauge_errors: (gauges.iter().zip(&s.gauges))
                        .map(|(g, v)| self.target.distance(&[*v], &g.value, g.scale))
                        .collect(),
                    next_halving: None,
                }
            })
            .collect();
        let points: Vec<(f64, f64)> = entries.iter().map(|e| (e.promised, e.cpu)).collect();
        let front = pareto::front(&points);
        let line: Vec<(f64, f64)> = front.iter().map(|&i| points[i]).collect();
        for (&i, more) in front.iter().zip(pareto::next_halving(&line)) {
            entries[i].next_halving = more;
        }
        (knobs, entries, front)
    }
}
