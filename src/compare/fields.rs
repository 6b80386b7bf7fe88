//! This module computes differences of fields. Particles of two runs have no one-to-one
//! correspondence, but fields can be compared on a common grid.

use crate::frame::{GridField, Quantity, Rect};
use crate::results::{Member, SAME_TIME, later};
use serde::Serialize;
use std::collections::BTreeMap;

/// Fraction of the differences inside the range of the colour scale. Peaks at corners would
/// otherwise determine the range.
const COVERED: f64 = 0.995;

/// Distance of a field from that of the first run.
#[derive(Clone, Debug, Serialize)]
pub struct FieldChange {
    /// Name of the field.
    pub field: String,
    /// Name of the run.
    pub run: String,
    /// Largest relative difference over time: root mean square of the difference over that of the
    /// first run's field.
    pub largest: f64,
    /// Time of the largest difference (s).
    pub at: f64,
    /// Relative difference at the last common time.
    pub last: f64,
}

/// Fields of one run minus those of the first run.
pub struct Pair {
    /// Indices of the first run and of the other run.
    pub runs: [usize; 2],
    /// Common part of both domains (m).
    pub domain: Rect,
    /// Quantities of the fields.
    pub quantities: Vec<Quantity>,
    /// Time (s) and differences at that time.
    pub frames: Vec<(f64, Vec<GridField>)>,
    /// Distance of each field from that of the first run.
    pub changes: Vec<FieldChange>,
}

type Pictures = Vec<(f64, GridField)>;

/// Differences of each run from the first one, at the picture times of the first run up to `until`.
pub fn differences(members: &[Member], until: f64, notes: &mut Vec<String>) -> Vec<Pair> {
    let fields: Vec<Option<BTreeMap<String, Pictures>>> = members
        .iter()
        .map(|m| Some(m.recorded.as_ref()?.fields(m.info.as_ref()?.domain)))
        .collect();
    let mut pairs = vec![];
    for k in 1..members.len() {
        let (Some(a), Some(b)) = (&fields[0], &fields[k]) else { continue };
        let (Some(info_a), Some(info_b)) = (&members[0].info, &members[k].info) else { continue };
        let names = || format!("{} and {}", members[0].name, members[k].name);
        let Some(domain) = info_a.domain.common(info_b.domain) else {
            notes.push(format!("the domains of {} do not overlap: no fields to compare", names()));
            continue;
        };
        let quantities: Vec<Quantity> = (info_a.fields.iter())
            .filter(|q| a.contains_key(&q.name) && b.contains_key(&q.name))
            .map(|q| Quantity { signed: true, ends: None, ..q.clone() })
            .collect();
        if quantities.is_empty() {
            notes.push(format!(
                "{} have no recorded field in common: no difference is shown",
                names()
            ));
            continue;
        }
        if info_a.domain != info_b.domain {
            notes.push(format!(
                "the domains of {} differ; fields are compared where they overlap",
                names()
            ));
        }
        pairs.push(pair(members, k, domain, quantities, [a, b], until));
    }
    pairs
}

fn pair(
    members: &[Member],
    k: usize,
    domain: Rect,
    quantities: Vec<Quantity>,
    [a, b]: [&BTreeMap<String, Pictures>; 2],
    until: f64,
) -> Pair {
    let mut frames: Vec<(f64, Vec<GridField>)> = vec![];
    let mut changes = vec![];
    for quantity in &quantities {
        let (a, b) = (&a[&quantity.name], &b[&quantity.name]);
        let mut list: Pictures = vec![];
        let mut change = FieldChange {
            field: quantity.name.clone(),
            run: members[k].name.clone(),
            largest: 0.0,
            at: 0.0,
            last: 0.0,
        };
        for (time, field) in a.iter().filter(|(t, _)| !later(*t, until)) {
            let Some(other) = at_time(b, *time) else { continue };
            let grid = [field.nx, field.ny];
            let (base, other) = (on_grid(field, domain, grid), on_grid(&other, domain, grid));
            let values: Vec<f32> =
                other.values.iter().zip(&base.values).map(|(b, a)| b - a).collect();
            let size = rms(&base.values);
            change.last = if size > 0.0 { rms(&values) / size } else { 0.0 };
            if change.last > change.largest {
                (change.largest, change.at) = (change.last, *time);
            }
            list.push((*time, GridField { values, ..base }));
        }
        let reach = reach(&list);
        for (time, mut field) in list {
            field.range = [-reach, reach];
            match frames.iter_mut().find(|(t, _)| *t == time) {
                Some((_, fields)) => fields.push(field),
                None => frames.push((time, vec![field])),
            }
        }
        changes.push(change);
    }
    Pair { runs: [0, k], domain, quantities, frames, changes }
}

/// The field on the common grid. It is not interpolated if it is on that grid already.
fn on_grid(field: &GridField, domain: Rect, [nx, ny]: [usize; 2]) -> GridField {
    let rect = field.rect();
    let near = |a: f32, b: f32, cell: f32| (a - b).abs() < 1e-3 * cell;
    let same = (field.nx, field.ny) == (nx, ny)
        && (0..2).all(|c| {
            near(rect.min[c], domain.min[c], field.cell[c])
                && near(rect.max[c], domain.max[c], field.cell[c])
        });
    if same { field.clone() } else { field.on(domain, nx, ny) }
}

/// The field at a time, interpolated between snapshots; `None` outside their time range.
fn at_time(pictures: &[(f64, GridField)], time: f64) -> Option<GridField> {
    let room = SAME_TIME * time.abs();
    let after = pictures.partition_point(|(t, _)| *t < time - room);
    let (t1, next) = pictures.get(after)?;
    if (t1 - time).abs() <= room {
        return Some(next.clone());
    }
    let (t0, last) = pictures.get(after.checked_sub(1)?)?;
    let share = ((time - t0) / (t1 - t0)) as f32;
    let mix = |(a, b): (&f32, &f32)| a + share * (b - a);
    (last.values.len() == next.values.len()).then(|| GridField {
        values: last.values.iter().zip(&next.values).map(mix).collect(),
        ..next.clone()
    })
}

fn rms(values: &[f32]) -> f64 {
    let finite = || values.iter().filter(|v| v.is_finite()).map(|&v| f64::from(v));
    (finite().map(|v| v * v).sum::<f64>() / finite().count().max(1) as f64).sqrt()
}

/// End of the colour scale for all times.
fn reach(pictures: &[(f64, GridField)]) -> f32 {
    let mut sizes: Vec<f32> = pictures
        .iter()
        .flat_map(|(_, f)| &f.values)
        .filter(|v| v.is_finite())
        .map(|v| v.abs())
        .collect();
    sizes.sort_by(f32::total_cmp);
    let place = (COVERED * sizes.len() as f64) as usize;
    let covered = sizes.get(place.min(sizes.len().saturating_sub(1))).copied().unwrap_or(0.0);
    // If differences are confined to a corner, the largest one is the end.
    let reach = if covered > 0.0 { covered } else { sizes.last().copied().unwrap_or(0.0) };
    if reach > 0.0 { reach } else { 1.0 }
}

/// Title of a difference: `<other run> − <first run>`.
pub fn title(members: &[Member], runs: [usize; 2]) -> String {
    let [a, b] = runs.map(|k| &members[k].name);
    format!("{b} − {a}")
}
