//! This module defines what enters through sides and nozzles.

use super::Plan;
use crate::scene::FieldFn;
use crate::space::constraints::Constraints;
use crate::space::mesh::Mesh;
use crate::space::population::Surrounding;
use crate::space::segment::Segment;

/// Times that differ by less than this share of the run are one, as in the plan's stops.
const TINY: f64 = 2e-9;

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
    /// The cells at its mouth, with the side of each that is on it (left, right, lower, upper).
    pub fn faces<'a>(&self, mesh: &'a Mesh) -> impl Iterator<Item = (usize, usize)> + use<'a> {
        let forwards = self.velocity > 0.0;
        let side = 2 * self.segment.normal + usize::from(!forwards);
        self.segment.cells_beside(mesh, forwards).map(move |cell| (cell, side))
    }

    /// Whether material enters after the time `now`; times that differ by less than `tiny` are one.
    pub fn is_on(&self, now: f64, tiny: f64) -> bool {
        let [from, to] = self.times;
        now >= from - tiny && now < to - tiny
    }
}

impl Plan {
    /// Whether particles may enter, or leave through sides.
    pub fn exchanges_volume(&self) -> bool {
        self.enclosure.is_open() || !self.boundary.sources.is_empty()
    }

    /// Index of the background material, which fills the part of the domain outside all regions.
    pub fn background(&self) -> Option<u8> {
        self.state.materials.iter().position(|m| m.background).map(|m| m as u8)
    }

    /// Index of the material that stands for a void around the materials, if there is one.
    pub fn void(&self) -> Option<u8> {
        self.background().filter(|_| self.effects.void)
    }

    /// What fills cells without particles.
    pub fn around(&self) -> Surrounding {
        match self.void() {
            Some(_) => Surrounding::Void,
            None => Surrounding::Material(self.background()),
        }
    }

    /// Which sources are on after a time, in the plan's units.
    pub fn sources_on(&self, time: f64) -> Vec<bool> {
        self.boundary.sources.iter().map(|s| s.is_on(time, TINY * self.clock.end)).collect()
    }

    /// Prescribed nodal values while the given sources are on.
    pub fn constraints_while<const D: usize>(&self, on: &[bool]) -> Constraints<D> {
        let all = &self.boundary.sources;
        let is_on = |s: &_| all.iter().zip(on).any(|(other, &on)| on && std::ptr::eq(other, s));
        let mut out = self.boundary.constraints_with::<D>(&self.mesh, &self.units, is_on);
        out.refer(self.pressure_reference);
        out
    }
}
