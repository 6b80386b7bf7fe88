//! Writes the three-dimensional view of a round flow: the section in the plane of the mesh on both faces
//! of a wedge that is left open, with walls and dyed lines swept around the axis in between, and rings of
//! rotation all around it.
//!
//! ```text
//! point (x, y) at the azimuth f:   (x cos f, y, -x sin f),   f = 0 to 270 degrees
//! ```
//! Particles are those of the flat view. Dyed lines become surfaces of few points; their triangles are
//! recorded again only when the number of lines changes.

use super::pictures::{Look, on_scale, with_look};
use super::*;
use crate::frame::{Outline, Ring, Snapshot};
use crate::plan::boundary::SIDES;
use rerun::archetypes;
use rerun::components::Radius;
use std::f32::consts::TAU;

/// Angle that is swept, rad.
const SWEPT: f32 = 1.5 * std::f32::consts::PI;
/// Number of azimuths of a swept wall.
const WALL_STEPS: usize = 37;
/// Number of azimuths of a ring.
const RING_STEPS: usize = 49;
/// Number of azimuths of a swept dyed line.
const DYE_STEPS: usize = 13;
/// Number of points of a dyed line that are swept.
const DYE_POINTS: usize = 12;
/// Radius of the ring of the largest rotation, as a share of the longer side of the domain.
const RING: f32 = 0.005;
/// Colour of swept walls, with its opacity.
const SWEPT_WALL: [u8; 4] = [120, 124, 132, 110];
/// Colour of swept dyed lines, with its opacity.
const SWEPT_DYE: [u8; 4] = [60, 70, 90, 120];

/// A point at an azimuth.
fn turned([x, y]: [f32; 2], azimuth: f32) -> [f32; 3] {
    let (s, c) = azimuth.sin_cos();
    [x * c, y, -x * s]
}

/// Azimuths of `steps` copies of a line, from 0 to an angle.
fn azimuths(angle: f32, steps: usize) -> impl Iterator<Item = f32> + Clone {
    (0..steps).map(move |k| angle * k as f32 / (steps - 1) as f32)
}

/// Points of swept lines, azimuth by azimuth for each line.
fn swept(lines: &[Vec<[f32; 2]>], steps: usize) -> Vec<[f32; 3]> {
    let of = |line: &Vec<[f32; 2]>| -> Vec<[f32; 3]> {
        azimuths(SWEPT, steps).flat_map(|f| line.iter().map(move |&p| turned(p, f))).collect()
    };
    lines.iter().flat_map(of).collect()
}

/// Triangles between these points.
fn triangles(lines: &[Vec<[f32; 2]>], steps: usize) -> Vec<[u32; 3]> {
    let (mut out, mut first) = (vec![], 0);
    for line in lines {
        let length = line.len() as u32;
        for step in 0..steps as u32 - 1 {
            for k in 0..length.saturating_sub(1) {
                let [a, b] = [step, step + 1].map(|s| first + s * length + k);
                out.extend([[a, a + 1, b], [a + 1, b + 1, b]]);
            }
        }
        first += length * steps as u32;
    }
    out
}

/// Some points of a line, with both ends.
fn few(line: &[[f32; 2]]) -> Vec<[f32; 2]> {
    let (last, count) = (line.len().saturating_sub(1), DYE_POINTS - 1);
    (0..=count).filter_map(|k| line.get(k * last / count).copied()).collect()
}

fn colour([r, g, b, a]: [u8; 4]) -> rerun::components::AlbedoFactor {
    rerun::Rgba32::from_unmultiplied_rgba(r, g, b, a).into()
}

impl RerunLog {
    /// Records walls.
    pub(super) fn round_world(&mut self, info: &RunInfo) -> Result<(), RecordError> {
        self.rec
            .log_static(self.paths.at("round"), &archetypes::ViewCoordinates::RIGHT_HAND_Y_UP())?;
        self.rec.log_static(self.paths.at("round"), &super::world::classes(info))?;
        // The sides of the domain would hide what is inside.
        let inner = |o: &&Outline| !SIDES.contains(&o.name.as_str());
        let walls: Vec<_> = info.walls.iter().filter(inner).map(|o| o.points.clone()).collect();
        if !walls.is_empty() {
            self.rec.log_static(
                self.paths.at("round/walls"),
                &archetypes::Mesh3D::new(swept(&walls, WALL_STEPS))
                    .with_triangle_indices(triangles(&walls, WALL_STEPS))
                    .with_albedo_factor(colour(SWEPT_WALL)),
            )?;
        }
        let outlines: Vec<Vec<[f32; 3]>> = info
            .walls
            .iter()
            .flat_map(|o| [0.0, SWEPT].map(|f| o.points.iter().map(|&p| turned(p, f)).collect()))
            .collect();
        self.rec.log_static(
            self.paths.at("round/outlines"),
            &archetypes::LineStrips3D::new(outlines)
                .with_colors([rgb(WALL)])
                .with_radii([Radius::new_ui_points(1.5)]),
        )?;
        Ok(())
    }

    /// Records the particles on both faces, the dyed surfaces, and the rings of rotation.
    pub(super) fn round_picture(
        &mut self,
        snapshot: &Snapshot,
        look: &Look,
    ) -> Result<(), RecordError> {
        for (name, azimuth) in ["round/first", "round/second"].into_iter().zip([0.0, SWEPT]) {
            let places = snapshot.particles.positions.iter().map(|&p| turned(p, azimuth));
            let points = archetypes::Points3D::update_fields().with_positions(places);
            self.rec.log(self.paths.at(name), &with_look!(points, look))?;
        }
        self.round_dye(&snapshot.dye_lines)?;
        self.round_rotation(&snapshot.rings)
    }

    fn round_dye(&mut self, dye: &[Vec<[f32; 2]>]) -> Result<(), RecordError> {
        let lines: Vec<Vec<[f32; 2]>> = dye.iter().map(|line| few(line)).collect();
        if lines.is_empty() && self.round_lines == 0 {
            return Ok(());
        }
        let mut mesh =
            archetypes::Mesh3D::update_fields().with_vertex_positions(swept(&lines, DYE_STEPS));
        if self.round_lines != lines.len() {
            self.round_lines = lines.len();
            mesh = mesh
                .with_triangle_indices(triangles(&lines, DYE_STEPS))
                .with_albedo_factor(colour(SWEPT_DYE));
        }
        self.rec.log(self.paths.at("round/dye"), &mesh)?;
        Ok(())
    }

    /// Records the rotation as rings about the axis. Rotation is about the direction of a ring; its colour
    /// shows the sign, its thickness the magnitude.
    fn round_rotation(&mut self, rings: &[Ring]) -> Result<(), RecordError> {
        if rings.is_empty() && self.round_rings.is_empty() {
            return Ok(());
        }
        let largest = rings.iter().map(|r| r.rotation.abs()).fold(0.0, f32::max);
        let scale = ColourScale::new([-largest, largest], true);
        let thickest = RING * self.domain.size().into_iter().fold(0.0, f32::max);
        let share = |r: &Ring| if largest > 0.0 { r.rotation.abs() / largest } else { 0.0 };
        let mut lines = archetypes::LineStrips3D::update_fields()
            .with_colors(rings.iter().map(|r| on_scale(scale, r.rotation)))
            .with_radii(rings.iter().map(|r| Radius::new_scene_units(thickest * share(r))));
        let places: Vec<[f32; 2]> = rings.iter().map(|r| r.at).collect();
        if self.round_rings != places {
            let ring = |&at: &[f32; 2]| azimuths(TAU, RING_STEPS).map(move |f| turned(at, f));
            let strips = places.iter().map(|at| ring(at).collect::<Vec<_>>());
            lines = lines.with_strips(strips);
            self.round_rings = places;
        }
        self.rec.log(self.paths.at("round/rings"), &lines)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn swept_lines_are_closed_surfaces_of_triangles() {
        let lines = vec![vec![[1.0, 0.0], [1.0, 2.0]], vec![[0.5, 1.0], [1.0, 1.0], [2.0, 1.0]]];
        let points = swept(&lines, 5);
        assert_eq!(points.len(), 5 * (2 + 3));
        for (k, p) in points.iter().enumerate() {
            let line = usize::from(k >= 10);
            let of = if line == 0 { lines[0][k % 2] } else { lines[1][(k - 10) % 3] };
            assert!((p[0].hypot(p[2]) - of[0]).abs() < 1e-6 && p[1] == of[1]);
        }
        let list = triangles(&lines, 5);
        assert_eq!(list.len(), 2 * 4 * (1 + 2));
        assert!(list.iter().flatten().all(|&k| (k as usize) < points.len()));
    }
}
