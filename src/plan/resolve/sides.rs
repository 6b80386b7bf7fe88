//! This module resolves `[boundaries]`: the conditions at the sides of the domain and their parts.

use super::inflow::Candidates;
use super::slip::wall_law;
use super::values::{Result, coordinate, edge, finite_range};
use crate::plan::boundary::{Conditions, Piece, SIDES, Side};
use crate::plan::slip::Slip;
use crate::scene::{
    Boundary, BoundaryKind, BoundaryPart, Field, FieldFn, Given, Scene, SceneError, Scope,
};
use crate::space::segment::Segment;
use crate::space::shape::side_normal;

/// Distance, as a fraction of the length of a side, below which two coordinates count as equal.
const SAME: f64 = 1e-9;

/// A side of the domain whose table is resolved.
struct Resolver<'a> {
    scope: &'a Scope,
    candidates: Candidates<'a>,
    /// Number of the side.
    side: usize,
    /// Name such as `boundaries.left`.
    name: String,
    /// The side itself (m).
    segment: Segment,
    /// Ranges of x and y of the side, m.
    place: [[f64; 2]; 2],
}

/// Boundary conditions at the four sides of the domain; segments are in m.
pub(in crate::plan) fn sides(
    scene: &Scene,
    scope: &Scope,
    domain: [[f64; 2]; 2],
    candidates: Candidates,
) -> Result<[Side; 4]> {
    let mut out: [Side; 4] = Default::default();
    for (s, boundary) in scene.boundaries.sides().into_iter().enumerate() {
        let place = edge(domain, s);
        let normal = side_normal(s);
        let [from, to] = place[1 - normal];
        let segment = Segment { normal, at: place[normal][0], from, to };
        let name = format!("boundaries.{}", SIDES[s]);
        out[s] = Resolver { scope, candidates, side: s, name, segment, place }.side(boundary)?;
    }
    Ok(out)
}

impl Resolver<'_> {
    fn side(&self, boundary: &Boundary) -> Result<Side> {
        let name = &self.name;
        let rest = self.conditions(boundary.given(), name)?;
        let periodic = boundary.kind == Some(BoundaryKind::Periodic);
        if periodic && !boundary.parts.is_empty() {
            return Err(SceneError::of_key(
                format!("{name}.parts"),
                format!("{name} is periodic and has parts"),
                "a periodic side has no boundary: remove the parts or give another kind",
            ));
        }
        let mut parts = Vec::new();
        let mut errors = Vec::new();
        for (k, part) in boundary.parts.iter().enumerate() {
            match self.part(part, k) {
                Ok(piece) => parts.push(piece),
                Err(e) => errors.push(e),
            }
        }
        SceneError::join(errors)?;
        parts.sort_by(|a, b| a.segment.from.total_cmp(&b.segment.from));
        self.refuse_overlaps(boundary, &parts)?;
        Ok(Side { periodic, pieces: self.with_rest(parts, rest, boundary)? })
    }

    /// A part of the side.
    fn part(&self, part: &BoundaryPart, k: usize) -> Result<Piece> {
        let name = format!("{}.parts[{k}]", self.name);
        if part.kind.is_none() && part.slip_length.is_none() && part.wall_friction.is_none() {
            return Err(SceneError::at(
                &part.from,
                format!("{name}: key `kind` is missing"),
                "give it, such as kind = \"outflow\", or slip_length = <m>, or wall_friction",
            ));
        }
        if part.kind == Some(BoundaryKind::Periodic) {
            return Err(SceneError::of_key(
                format!("{name}.kind"),
                format!("{name} is periodic, but only whole sides can be"),
                "give it another kind, such as \"outflow\"",
            ));
        }
        let along = 1 - self.segment.normal;
        let [low, high] = self.place[along];
        let tiny = SAME * (high - low);
        let ends = [("from", &part.from), ("to", &part.to)];
        let mut at = [0.0; 2];
        for (at, (key, q)) in at.iter_mut().zip(ends) {
            let v = coordinate(q, along, self.scope)?;
            if v < low - tiny || v > high + tiny {
                return Err(SceneError::at(
                    q,
                    format!("{name}.{key} is {v}, outside the side"),
                    format!(
                        "{} is at {} = {low} to {high}: choose a value in this range",
                        self.name,
                        ["x", "y"][along]
                    ),
                ));
            }
            *at = v.clamp(low, high);
        }
        let [from, to] = at;
        if to - from <= tiny {
            return Err(SceneError::at(
                &part.to,
                format!("{name} has no length: from {from} to {to}"),
                "`to` must be above `from`",
            ));
        }
        let conditions = self.conditions(part.given(), &name)?;
        let segment = Segment { from, to, ..self.segment };
        self.piece(Some(k), segment, part.given(), conditions)
    }

    /// A piece of the side with its conditions, which are resolved from `given`.
    fn piece(
        &self,
        part: Option<usize>,
        segment: Segment,
        given: Given,
        conditions: Conditions,
    ) -> Result<Piece> {
        let open = self.open(given.kind(), &conditions);
        let mut piece = Piece { part, segment, conditions, open, enters: None };
        piece.enters = self.candidates.through(self.side, &piece, given)?;
        Ok(piece)
    }

    /// `parts` are in ascending order.
    fn refuse_overlaps(&self, boundary: &Boundary, parts: &[Piece]) -> Result<()> {
        let tiny = SAME * (self.segment.to - self.segment.from);
        for pair in parts.windows(2) {
            let [a, b] = [&pair[0], &pair[1]];
            if b.segment.from < a.segment.to - tiny
                && let (Some(first), Some(second)) = (a.part, b.part)
            {
                let name = &self.name;
                return Err(SceneError::at(
                    &boundary.parts[second].from,
                    format!(
                        "{name}.parts[{second}] begins at {}, inside {name}.parts[{first}], which \
                         reaches from {} to {}",
                        b.segment.from, a.segment.from, a.segment.to
                    ),
                    "parts of a side must not overlap: move one, or join them",
                ));
            }
        }
        Ok(())
    }

    /// The parts, which are in ascending order, and the rest of the side between them.
    fn with_rest(
        &self,
        parts: Vec<Piece>,
        rest: Conditions,
        boundary: &Boundary,
    ) -> Result<Vec<Piece>> {
        let tiny = SAME * (self.segment.to - self.segment.from);
        let between = |from: f64, to: f64| {
            let segment = Segment { from, to, ..self.segment };
            self.piece(None, segment, boundary.given(), rest.clone())
        };
        let mut pieces = Vec::new();
        let mut from = self.segment.from;
        for part in parts {
            if part.segment.from - from > tiny {
                pieces.push(between(from, part.segment.from)?);
            }
            from = part.segment.to;
            pieces.push(part);
        }
        if self.segment.to - from > tiny {
            pieces.push(between(from, self.segment.to)?);
        }
        Ok(pieces)
    }

    /// The conditions that are written for the side or for a part of it, which is called `name`.
    fn conditions(&self, given: Given, name: &str) -> Result<Conditions> {
        let Given { velocity, traction, rotation, .. } = given;
        let law = wall_law(given.wall, given.kind.is_some(), name, self.scope)?;
        let kind = given.kind();
        if kind == BoundaryKind::Periodic {
            return match velocity.into_iter().chain(traction).chain([rotation]).flatten().next() {
                None => Ok(Conditions::default()),
                Some(f) => Err(SceneError::at(
                    f,
                    format!("{name} is periodic and prescribes a value"),
                    "a periodic side has no boundary: remove the value or the kind",
                )),
            };
        }
        let compile = |f: &Field| -> Result<FieldFn> {
            let compiled = f.compile(self.scope)?;
            finite_range(f, &compiled, self.place, name)?;
            Ok(compiled)
        };
        let mut out = Conditions::default();
        for c in 0..2 {
            let along_normal = c == side_normal(self.side);
            let held = match kind {
                BoundaryKind::NoSlip => true,
                BoundaryKind::FreeSlip => along_normal,
                BoundaryKind::Outflow => !along_normal,
                BoundaryKind::Open | BoundaryKind::Periodic => false,
            };
            let letter = ["x", "y"][c];
            if let (Some(law), false) = (law, along_normal) {
                if let Some(t) = traction[c] {
                    return Err(SceneError::at(
                        t,
                        format!("{name} gives both a law of the wall and traction_{letter}"),
                        "give one of them: the wall determines the traction along it",
                    ));
                }
                let velocity = velocity[c].map(compile).transpose()?;
                out.slip = Some(Slip { law, velocity });
                continue;
            }
            out.velocity[c] = match (velocity[c], traction[c]) {
                (Some(v), None) => Some(compile(v)?),
                (None, Some(_)) => None,
                (Some(v), Some(_)) => {
                    return Err(SceneError::at(
                        v,
                        format!("{name} gives both velocity_{letter} and traction_{letter}"),
                        "give one of them",
                    ));
                }
                (None, None) => held.then_some(FieldFn::Constant(0.0)),
            };
            out.traction[c] = traction[c].map(compile).transpose()?;
        }
        out.rotation = rotation.map(compile).transpose()?;
        Ok(out)
    }

    /// Whether particles leave through a piece of the side.
    fn open(&self, kind: BoundaryKind, conditions: &Conditions) -> bool {
        matches!(kind, BoundaryKind::Open | BoundaryKind::Outflow)
            || conditions.passes_through(self.segment.normal)
    }
}
