//! This module defines what enters through sides and nozzles.

use crate::scene::FieldFn;
use crate::space::segment::Segment;

/// What enters through a piece of a side or through a nozzle.
#[derive(Clone, Debug, PartialEq)]
pub struct Entering {
    /// Index of the material.
    pub material: u8,
    /// Angle between its directors and the x axis, degrees, as a function of SI coordinates.
    pub director: Option<FieldFn>,
}

/// A nozzle inside the domain, in the plan's units. It is the face of a solid block on which a
/// normal velocity is given.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// Name of the source.
    pub name: String,
    /// Its mouth; it lies on mesh lines.
    pub segment: Segment,
    /// Velocity along the normal of the segment: along x or y.
    pub velocity: f64,
    /// What enters.
    pub entering: Entering,
    /// Times at which it begins and ends; the end may be infinite.
    pub times: [f64; 2],
}

impl Source {
    /// Whether material enters after the time `now`; times that differ by less than `tiny` are one.
    pub fn is_on(&self, now: f64, tiny: f64) -> bool {
        let [from, to] = self.times;
        now >= from - tiny && now < to - tiny
    }
}
