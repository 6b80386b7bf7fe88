//! This module resolves `[[sources]]`: nozzles, each a solid block one cell thick with a mouth.

use super::inflow::Candidates;
use super::materials::material_index;
use super::values::{Result, not_negative, positive};
use super::walls::axis_segment;
use crate::plan::sources::{Entering, Source};
use crate::plan::{ClockPlan, Units};
use crate::scene::{self, Direction, SceneError};
use crate::space::mesh::Mesh;
use crate::space::segment::Segment;

/// A nozzle in SI coordinates.
pub(super) struct SiSource {
    pub(super) name: String,
    pub(super) segment: Segment,
    /// Velocity along the normal of the segment, m/s.
    velocity: f64,
    entering: Entering,
    /// Times at which it begins and ends, s.
    times: [f64; 2],
    /// Ranges along x and y of its block, m.
    pub(super) block: [[f64; 2]; 2],
}

impl SiSource {
    /// The nozzle in the plan's units, moved to the nearest mesh lines.
    pub(super) fn scaled(self, mesh: &Mesh, units: &Units) -> Source {
        Source {
            name: self.name,
            segment: self.segment.on_mesh(mesh, units.length),
            velocity: self.velocity / units.velocity(),
            entering: self.entering,
            times: self.times.map(|t| t / units.time),
        }
    }
}

/// The nozzles of a scene. `size`: size of a cell, m.
pub(super) fn sources(
    candidates: Candidates,
    domain: [[f64; 2]; 2],
    size: f64,
) -> Result<Vec<SiSource>> {
    let mut list: Vec<SiSource> = Vec::new();
    for (k, s) in candidates.scene.sources.iter().enumerate() {
        let key = format!("sources[{k}]");
        if list.iter().any(|o| o.name == s.name) {
            return Err(SceneError::of_key(
                format!("{key}.name"),
                format!("two sources are named `{}`", s.name),
                "rename one",
            ));
        }
        list.push(source(candidates, (s, &key), domain, size)?);
    }
    Ok(list)
}

fn source(
    candidates: Candidates,
    (s, key): (&scene::Source, &str),
    domain: [[f64; 2]; 2],
    size: f64,
) -> Result<SiSource> {
    let Candidates { scene, scope, .. } = candidates;
    let what = format!("source `{}`", s.name);
    let segment = axis_segment(&what, &s.from, &s.to, scope, domain)?;
    let normal = segment.normal;
    let direction = s.direction.unwrap_or([Direction::Left, Direction::Down][normal]);
    let sign = match direction {
        Direction::Right | Direction::Up => 1.0,
        Direction::Left | Direction::Down => -1.0,
    };
    if normal != usize::from(matches!(direction, Direction::Up | Direction::Down)) {
        return Err(SceneError::of_key(
            format!("{key}.direction"),
            format!("{what}: its direction runs along its mouth"),
            "a horizontal mouth points `up` or `down`, a vertical one `left` or `right`",
        ));
    }
    // The block lies behind the mouth.
    let back = segment.at - sign * size;
    let [low, high] = domain[normal];
    let tiny = 1e-9 * (high - low);
    let room = [segment.at - low, high - segment.at];
    let [behind, before] = if sign > 0.0 { room } else { [room[1], room[0]] };
    if behind < size - tiny || before < size - tiny {
        let place = ["left", "right", "bottom", "top"];
        let side =
            2 * normal + usize::from(if behind < size - tiny { sign < 0.0 } else { sign > 0.0 });
        return Err(SceneError::at(
            &s.from[normal],
            format!(
                "{what}: there is less than a cell between its mouth and the {} side",
                place[side]
            ),
            format!(
                "move it by a cell, {size:.3e} m, or let a part of a side push material in: \
                 [[boundaries.{}.parts]] with velocity_{} and inflow",
                place[side],
                ["x", "y"][normal]
            ),
        ));
    }
    let from = not_negative(&s.from_time, scope, &format!("{what}: from_time"))?;
    let to = s.to_time.as_ref().map_or(Ok(f64::INFINITY), |q| q.eval(scope))?;
    if let Some(q) = s.to_time.as_ref().filter(|_| to <= from) {
        return Err(SceneError::at(
            q,
            format!("{what} ends at {to} s, before it begins at {from} s"),
            "to_time must be above from_time",
        ));
    }
    let speed = positive(&s.speed, scope, &format!("{what}: speed"))?;
    let material =
        material_index(&scene.materials, &s.material, &what, &format!("{key}.material"))?;
    let entering = candidates.entering(material, &segment, (&what, key), s.director.as_ref())?;
    let mut block = [[0.0; 2]; 2];
    block[normal] = [segment.at.min(back), segment.at.max(back)];
    block[1 - normal] = [segment.from, segment.to];
    Ok(SiSource {
        name: s.name.clone(),
        segment,
        velocity: sign * speed,
        entering,
        times: [from, to],
        block,
    })
}

/// Lets steps end at the times at which sources begin and end.
pub(super) fn add_stops(sources: &[Source], clock: &mut ClockPlan) {
    let times = sources.iter().flat_map(|s| s.times);
    clock.stops.extend(times.filter(|&t| t > 0.0 && t < clock.end));
    clock.stops.sort_by(f64::total_cmp);
    let least = 1e-9 * clock.end;
    clock.stops.dedup_by(|b, a| *b - *a < least);
}
