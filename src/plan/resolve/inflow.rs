//! This module finds the material that enters the domain through a piece of a side.

use super::materials::{SiMaterial, material_index};
use super::values::{Result, finite_range};
use crate::plan::Piece;
use crate::plan::boundary::place_of;
use crate::plan::sources::Entering;
use crate::scene::{FieldFn, Given, InflowDirector, Scene, SceneError, Scope};
use crate::space::segment::Segment;
use crate::space::shape::side_normal;

/// Number of intervals along a piece between points at which its velocity is evaluated.
const SAMPLES: u32 = 128;

/// The materials that may enter.
#[derive(Clone, Copy)]
pub(super) struct Candidates<'a> {
    pub(super) scene: &'a Scene,
    pub(super) scope: &'a Scope,
    pub(super) materials: &'a [SiMaterial],
}

impl Candidates<'_> {
    /// What enters through a piece of the side with number `side`; `given`: what the scene says
    /// there.
    ///
    /// # Errors
    /// The scene names a material that does not exist or cannot enter there; it names none although
    /// several could enter; or the material has layers and no directors are given.
    pub(super) fn through(
        &self,
        side: usize,
        piece: &Piece,
        given: Given,
    ) -> Result<Option<Entering>> {
        let name = place_of(side, piece);
        let normal = side_normal(side);
        let inwards = inward_velocity(side, piece);
        let Some(wanted) = given.inflow else {
            let outwards = inwards.is_some_and(|v| v < 0.0);
            if !piece.open || self.scene.time.steady || outwards {
                return Ok(None);
            }
            let pushed = given.velocity[normal].filter(|_| inwards.is_some_and(|v| v > 0.0));
            return match (self.default(), pushed) {
                (None, Some(v)) => Err(SceneError::at(
                    v,
                    format!("material enters through {name}, but it is not known which"),
                    format!("give inflow = \"<material>\" there; materials: {}", self.names()),
                )),
                (None, None) => Ok(None),
                // Without directors, layered material is split where nothing else can be done.
                (Some(m), None) if self.has_layers(m) && given.inflow_director.is_none() => {
                    Ok(None)
                }
                (Some(m), _) => self
                    .entering(m, &piece.segment, (&name, &name), given.inflow_director)
                    .map(Some),
            };
        };
        let place = format!("{name}.inflow");
        let letter = ["x", "y"][normal];
        let material = material_index(&self.scene.materials, wanted, &name, &place)?;
        if !piece.open && given.velocity[normal].is_none() {
            return Err(SceneError::of_key(
                &place,
                format!("{name} lets nothing in: its velocity_{letter} is zero"),
                format!("give velocity_{letter} = <m/s> or kind = \"open\", or remove inflow"),
            ));
        }
        if inwards.is_some_and(|v| v < 0.0) {
            return Err(SceneError::of_key(
                &place,
                format!("{name} lets nothing in: its velocity_{letter} points outwards"),
                format!("change the sign of velocity_{letter}, or remove inflow"),
            ));
        }
        self.entering(material, &piece.segment, (&name, &place), given.inflow_director).map(Some)
    }

    /// A material that enters through a segment (m). `what`: the name of the segment, and the key at
    /// which directors are missing.
    pub(super) fn entering(
        &self,
        material: u8,
        segment: &Segment,
        (what, key): (&str, &str),
        director: Option<&InflowDirector>,
    ) -> Result<Entering> {
        let [a, b] = segment.ends();
        let director = director.map(|d| -> Result<FieldFn> {
            let compiled = d.angle_degrees.compile(self.scope)?;
            let place = [[a[0], b[0]], [a[1], b[1]]];
            finite_range(&d.angle_degrees, &compiled, place, "the director's angle")?;
            Ok(compiled)
        });
        let director = director.transpose()?;
        if director.is_none() && self.has_layers(material) {
            let called = &self.materials[usize::from(material)].name;
            let word = if key.starts_with("sources") { "director" } else { "inflow_director" };
            return Err(SceneError::of_key(
                key,
                format!("{what} lets in the layered material `{called}` without directors"),
                format!("give {word} = {{ angle_degrees = 90 }} there"),
            ));
        }
        Ok(Entering { material, director: director.filter(|_| self.has_layers(material)) })
    }

    fn has_layers(&self, material: u8) -> bool {
        self.materials[usize::from(material)].layer_viscosity.is_some()
    }

    /// What enters where the scene does not say: the background, or the only material.
    fn default(&self) -> Option<u8> {
        let background = self.materials.iter().position(|m| m.background);
        let one = (self.materials.len() == 1).then_some(0);
        background.or(one).map(|m| m as u8)
    }

    fn names(&self) -> String {
        self.materials.iter().map(|m| m.name.as_str()).collect::<Vec<_>>().join(", ")
    }
}

/// The largest given velocity into the domain along a piece, m/s; `None` if none is given.
fn inward_velocity(side: usize, piece: &Piece) -> Option<f64> {
    let f: &FieldFn = piece.conditions.velocity[side_normal(side)].as_ref()?;
    let inwards = if side.is_multiple_of(2) { 1.0 } else { -1.0 };
    let s = &piece.segment;
    let at = (0..=SAMPLES).map(|k| {
        let [x, y] = s.point(s.from + (s.to - s.from) * f64::from(k) / f64::from(SAMPLES));
        inwards * f.at(x, y)
    });
    Some(at.fold(f64::NEG_INFINITY, f64::max))
}
