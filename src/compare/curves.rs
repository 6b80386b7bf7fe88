//! This module computes the distances between the curves of two runs.

use super::CurveChange;
use crate::results::{Member, later, table};

/// The largest distance of each curve from that of the first run, up to the time `until` (s).
pub fn changes(members: &[Member], until: f64) -> Vec<CurveChange> {
    let Some((first, others)) = members.split_first() else { return vec![] };
    let Some(a) = &first.table else { return vec![] };
    let mut list = vec![];
    for (member, b) in others.iter().filter_map(|m| Some((m, m.table.as_ref()?))) {
        for (key, column) in a.columns.iter().filter(|(key, _)| table::has_curve(key)) {
            let Some(other) = b.columns.get(key) else { continue };
            let shared = || a.times().iter().zip(column).filter(|(t, _)| !later(**t, until));
            let scale = shared().map(|(_, v)| v.abs()).fold(0.0, f64::max);
            let mut worst = (0.0, 0.0);
            for (&time, value) in shared() {
                let Some(value_b) = b.at(other, time) else { continue };
                let distance = (value_b - value).abs();
                if distance > worst.0 {
                    worst = (distance, time);
                }
            }
            let largest = if worst.0 > 0.0 { worst.0 / scale } else { 0.0 };
            if largest.is_finite() {
                let run = member.name.clone();
                list.push(CurveChange { key: key.clone(), run, largest, at: worst.1 });
            }
        }
    }
    list
}
