//! This module keeps the frames of a run, to show them again.

use crate::frame::{Frame, Snapshot};
use std::sync::Arc;

/// Maximum memory of the pictures of a run (bytes).
const BUDGET: usize = 192 << 20;

/// Frames in order. All scalars are kept. If the pictures exceed the memory limit, every second one
/// of those not requested by the scene is removed, and then every second one of all.
#[derive(Clone, Default)]
pub struct FrameBuffer {
    frames: Vec<Arc<Frame>>,
    /// Whether the scene requested the picture of each frame.
    wanted: Vec<bool>,
    /// Memory of the pictures (bytes, estimated).
    bytes: usize,
}

impl FrameBuffer {
    /// Appends a frame; `wanted` if the scene requested its snapshot.
    pub fn push(&mut self, frame: Arc<Frame>, wanted: bool) {
        self.bytes += size(&frame);
        self.frames.push(frame);
        self.wanted.push(wanted);
        if self.bytes > BUDGET {
            self.thin(false);
        }
        if self.bytes > BUDGET {
            self.thin(true);
        }
    }

    /// All frames in order.
    pub fn frames(&self) -> &[Arc<Frame>] {
        &self.frames
    }

    /// Whether the last frame has a snapshot.
    pub fn ends_in_a_picture(&self) -> bool {
        self.frames.last().is_some_and(|f| f.snapshot.is_some())
    }

    /// Number of frames that have a snapshot, and step and time (s) of the last one.
    pub fn pictures(&self) -> (usize, u64, f64) {
        let drawn = self.frames.iter().filter(|f| f.snapshot.is_some());
        drawn.fold((0, 0, 0.0), |(count, ..), f| (count + 1, f.step, f.time_s))
    }

    /// Removes every second snapshot, except the first and the last.
    fn thin(&mut self, wanted_too: bool) {
        let last = self.frames.len().saturating_sub(1);
        let mut out = true;
        for k in 1..last {
            if self.frames[k].snapshot.is_none() || (self.wanted[k] && !wanted_too) {
                continue;
            }
            out = !out;
            if !out {
                let frame = Frame { snapshot: None, ..Frame::clone(&self.frames[k]) };
                self.frames[k] = Arc::new(frame);
            }
        }
        self.bytes = self.frames.iter().map(|f| size(f)).sum();
    }
}

/// Approximate size of the picture of a frame (bytes).
fn size(frame: &Frame) -> usize {
    let Some(p) = &frame.snapshot else { return 0 };
    let Snapshot {
        particles,
        dye_lines,
        glyphs,
        fields,
        arrows,
        isolines,
        stresses,
        moving,
        rings,
    } = p;
    let arrows = arrows.as_ref().map_or(0, |a| 16 * a.origins.len());
    let strips = isolines.iter().flat_map(|i| &i.strips).chain(moving).map(Vec::len).sum::<usize>();
    14 * particles.positions.len()
        + particles.scalar.as_ref().map_or(0, |s| 4 * s.values.len())
        + 8 * dye_lines.iter().map(Vec::len).sum::<usize>()
        + 16 * glyphs.len()
        + 4 * fields.iter().map(|f| f.values.len()).sum::<usize>()
        + arrows
        + 12 * rings.len()
        + 28 * stresses.iter().map(|s| s.points.len()).sum::<usize>()
        + 8 * strips
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::ParticleSnapshot;

    #[test]
    fn memory_is_bounded_and_wanted_pictures_stay_longest() {
        let large = || Snapshot {
            particles: ParticleSnapshot {
                positions: vec![[0.0; 2]; BUDGET / 400],
                ..Default::default()
            },
            ..Default::default()
        };
        let mut frames = FrameBuffer::default();
        for step in 0..120 {
            let frame = Frame { step, snapshot: Some(large()), ..Default::default() };
            frames.push(Arc::new(frame), step % 10 == 0);
            assert!(frames.bytes <= BUDGET);
            assert!(frames.ends_in_a_picture());
        }
        assert_eq!(frames.frames().len(), 120);
        let kept: Vec<u64> =
            frames.frames().iter().filter(|f| f.snapshot.is_some()).map(|f| f.step).collect();
        assert!(kept.len() > 15 && kept.len() <= 41, "{kept:?}");
        assert!((0..12).all(|k| kept.contains(&(10 * k))), "{kept:?}");
    }
}
