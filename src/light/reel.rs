//! This module reads the frames of a finished run and packs them for reports and films.

use super::Description;
use super::pack::{MOST_PARTICLES, pack};
use crate::frame::{GridField, RunInfo, Snapshot, extent};
use crate::results::{Member, SAME_TIME};
use indexmap::IndexMap;
use std::path::PathBuf;

/// Number of frames up to which all of a run are kept, unless more are asked for.
pub const MOST_FRAMES: usize = 200;

/// Error of reading the frames of a run.
#[derive(Debug, thiserror::Error)]
pub enum ReelError {
    /// The run has no recording.
    #[error("{}: has no recording, so there are no frames to show; run the scene again without --no-recording", .0.display())]
    NoRecording(PathBuf),
    /// The recording has no pictures.
    #[error("{}: its recording has no pictures", .0.display())]
    NoPictures(PathBuf),
}

/// Ends of the colour scales of fields, by name.
pub type Ranges = IndexMap<String, [f32; 2]>;

/// The packed frames of a run.
pub struct Reel {
    /// Constant data of the run.
    pub description: Description,
    /// Time (s) and packed frame, in order.
    pub frames: Vec<(f64, Vec<u8>)>,
    /// Ends of the colour scale of each field over all frames.
    pub ranges: Ranges,
    /// Number of frames of the recording that have a picture.
    pub pictures: usize,
    /// Largest number of particles in a frame of the recording.
    pub recorded: usize,
    /// Largest number of particles in a packed frame.
    pub kept: usize,
}

/// Size and detail of a reel.
#[derive(Clone, Copy, Debug)]
pub struct Detail {
    /// Number of frames at most.
    pub frames: usize,
    /// Number of particles in a frame at most.
    pub particles: usize,
    /// Number of samples of a field along the longer side at most.
    pub samples: usize,
}

impl Default for Detail {
    fn default() -> Self {
        Detail { frames: MOST_FRAMES, particles: MOST_PARTICLES, samples: 128 }
    }
}

impl Reel {
    /// Reads and packs the frames of a run.
    ///
    /// # Errors
    /// There is no recording, or it has no pictures.
    pub fn of(member: &Member, detail: Detail) -> Result<Reel, ReelError> {
        let (Some(recorded), Some(info)) = (&member.recorded, &member.info) else {
            return Err(ReelError::NoRecording(member.path.clone()));
        };
        let particles = recorded.particles();
        let (dye, glyphs) = (recorded.dye_lines(), recorded.glyphs());
        let moving = recorded.moving();
        let fields: Vec<_> = recorded.fields(info.domain).into_values().collect();
        let mut reel = Reel {
            description: Description::new(info),
            frames: vec![],
            ranges: Ranges::new(),
            pictures: particles.len(),
            recorded: particles.iter().map(|(_, p)| p.positions.len()).max().unwrap_or(0),
            kept: 0,
        };
        for k in evenly(particles.len(), detail.frames) {
            let (time, particles) = &particles[k];
            let snapshot = Snapshot {
                particles: particles.clone(),
                dye_lines: at(&dye, *time).cloned().unwrap_or_default(),
                glyphs: at(&glyphs, *time).cloned().unwrap_or_default(),
                fields: fields
                    .iter()
                    .filter_map(|list| at(list, *time))
                    .map(|field| coarse(field, detail.samples, info))
                    .collect(),
                moving: at(&moving, *time).cloned().unwrap_or_default(),
                ..Snapshot::default()
            };
            reel.kept = reel.kept.max(particles.positions.len().min(detail.particles));
            for field in &snapshot.fields {
                widen(&mut reel.ranges, &field.name, field.range);
            }
            reel.frames.push((*time, pack(&snapshot, info, detail.particles)));
        }
        match reel.frames.is_empty() {
            true => Err(ReelError::NoPictures(member.path.clone())),
            false => Ok(reel),
        }
    }
}

/// At most `most` numbers below `count`, evenly spaced, with the first and the last; of one number,
/// it is the last.
fn evenly(count: usize, most: usize) -> impl Iterator<Item = usize> {
    let kept = most.clamp(1, count.max(1)).min(count);
    (0..kept).map(move |i| match kept {
        1 => count - 1,
        _ => (i * (count - 1) + (kept - 1) / 2) / (kept - 1),
    })
}

/// The entry of a list at a time.
fn at<T>(list: &[(f64, T)], time: f64) -> Option<&T> {
    let k = list.partition_point(|(t, _)| *t < time - SAME_TIME * time.abs());
    list.get(k).filter(|(t, _)| *t <= time + SAME_TIME * time.abs()).map(|(_, value)| value)
}

/// Widens the ends of the colour scale of a field so that they contain a range.
pub fn widen(ranges: &mut Ranges, field: &str, range: [f32; 2]) {
    let ends = ranges.entry(field.into()).or_insert(range);
    *ends = [ends[0].min(range[0]), ends[1].max(range[1])];
}

/// A field on at most `samples` samples along its longer side. Its colour scale has the ends of its
/// values, unless its quantity has ends of its own; painters make the scale of a quantity with a sign
/// symmetric.
fn coarse(field: &GridField, samples: usize, info: &RunInfo) -> GridField {
    let every = field.nx.max(field.ny).div_ceil(samples.max(1)).max(1);
    let mut coarse = match every {
        1 => field.clone(),
        _ => field.on(field.rect(), field.nx.div_ceil(every), field.ny.div_ceil(every)),
    };
    let ends = info.fields.iter().find(|q| q.name == field.name).and_then(|q| q.ends);
    coarse.range = ends.or_else(|| extent(&coarse.values)).unwrap_or([0.0, 1.0]);
    coarse
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_evenly_spaced_with_both_ends() {
        let list = |count, most| evenly(count, most).collect::<Vec<_>>();
        assert_eq!(list(5, 200), [0, 1, 2, 3, 4]);
        assert_eq!(list(103, 4), [0, 34, 68, 102]);
        assert_eq!(list(10, 1), [9]);
        assert!(list(0, 5).is_empty());
        let many = list(1000, 200);
        assert_eq!((many.len(), many[0], many[199]), (200, 0, 999));
        assert!(many.windows(2).all(|w| (5..=6).contains(&(w[1] - w[0]))));
    }
}
