//! This module draws sheets of snapshots as SVG and PNG: one row per run, one column per time.
//!
//! The sheet shows the area that particles cover, not single particles: an SVG of all particles
//! would have tens of megabytes.

use super::number::short;
use super::plots::{Drawing, Drawn, INK, Pen, PlotError, write};
use crate::frame::{ParticleSnapshot, Rect, RunInfo, Snapshot};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::path::Path;

/// Maximum width of the sheet (pixels).
const WIDTH: f64 = 1200.0;
/// Maximum width of a snapshot (pixels).
const SNAPSHOT: f64 = 380.0;
/// Maximum height of a snapshot if the sheet has several rows (pixels); twice this for one row.
const HEIGHT: f64 = 380.0;
/// Height of the title and the column headings (pixels).
const HEAD: f64 = 86.0;
/// Width of the row names (pixels).
const SIDE: f64 = 128.0;
/// Space between snapshots, and margin of the sheet (pixels).
const GAP: f64 = 14.0;

/// Side of the square that a particle covers, relative to the particle spacing. It exceeds 1 so
/// that the background does not show between particles.
const OVERLAP: f32 = 1.35;

/// Widest gap between particles that is filled, relative to the width of a snapshot. Wider gaps are
/// gaps in the material.
const WIDEST_GAP: f64 = 0.035;

/// Shortest isoline that is drawn, relative to the domain. Shorter ones are noise from few
/// particles.
const SMALLEST_LINE: f32 = 0.06;

const LEVEL: RGBColor = RGBColor(0, 90, 150);
const STROKE: RGBColor = RGBColor(150, 150, 155);

/// Content of a sheet.
pub struct Sheet {
    /// Title above the sheet.
    pub title: String,
    /// Headings of the columns.
    pub columns: Vec<String>,
    /// Rows of the sheet, from the top.
    pub rows: Vec<Row>,
}

/// One row of the sheet: the snapshots of one run.
pub struct Row {
    /// Name of the run, written at the left.
    pub name: String,
    /// Constant part of the recording of the run.
    pub info: RunInfo,
    /// Snapshots of the run, one per column.
    pub pictures: Vec<Snapshot>,
}

/// Writes the sheet to `<stem>.svg` and `<stem>.png`.
pub fn sheet(stem: &Path, sheet: &Sheet) -> Result<(), PlotError> {
    let (_, height) = sheet.snapshot();
    let full = HEAD + (height + GAP) * sheet.rows.len() as f64 + GAP;
    write(stem, sheet, (sheet.width().ceil() as u32, full.ceil() as u32))
}

impl Sheet {
    /// Width of the row names (pixels). A single row has no name.
    fn side(&self) -> f64 {
        if self.rows.len() > 1 { SIDE } else { GAP }
    }

    /// Width and height of a snapshot (pixels).
    fn snapshot(&self) -> (f64, f64) {
        let columns = self.columns.len().max(1) as f64;
        let width = ((WIDTH - self.side() - GAP * columns) / columns).min(SNAPSHOT);
        let domains = self.rows.iter().map(|row| row.info.domain).reduce(Rect::around);
        let [w, h] = domains.unwrap_or_default().size();
        let ratio = if w > 0.0 { f64::from(h / w) } else { 1.0 };
        // Several rows fit on a screen only if each is low.
        let most = if self.rows.len() > 1 { HEIGHT } else { 2.0 * HEIGHT };
        let width = if width * ratio > most { most / ratio } else { width };
        (width, width * ratio)
    }

    /// Width of the sheet (pixels).
    fn width(&self) -> f64 {
        self.side() + (self.snapshot().0 + GAP) * self.columns.len().max(1) as f64
    }
}

impl Drawing for Sheet {
    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>, pen: Pen) -> Drawn<B> {
        root.fill(&WHITE)?;
        let centre = Pos::new(HPos::Center, VPos::Center);
        let middle = pen.px(self.width() / 2.0);
        pen.text(root, &self.title, 24.0, (middle, pen.px(26.0)), centre)?;
        let (width, height) = self.snapshot();
        let left = |k: usize| self.side() + k as f64 * (width + GAP);
        for (k, head) in self.columns.iter().enumerate() {
            let at = (pen.px(left(k) + width / 2.0), pen.px(HEAD - 20.0));
            pen.text(root, head, 19.0, at, centre)?;
        }
        for (j, row) in self.rows.iter().enumerate() {
            let top = HEAD + j as f64 * (height + GAP);
            if self.rows.len() > 1 {
                let at = (pen.px(self.side() / 2.0), pen.px(top + height / 2.0));
                pen.text(root, &row.name, 19.0, at, centre)?;
            }
            for (k, snapshot) in row.pictures.iter().take(self.columns.len()).enumerate() {
                let place = [left(k), top, width, height];
                Cell { root, pen, info: &row.info, place }.draw(snapshot)?;
            }
        }
        Ok(())
    }
}

/// A snapshot and the part of the sheet that it fills.
struct Cell<'a, B: DrawingBackend> {
    root: &'a DrawingArea<B, Shift>,
    pen: Pen,
    info: &'a RunInfo,
    /// Left, top, width and height (pixels of the figure).
    place: [f64; 4],
}

impl<B: DrawingBackend> Cell<'_, B> {
    fn draw(&self, snapshot: &Snapshot) -> Drawn<B> {
        let marked = |class: u16| {
            self.info.materials.get(usize::from(class)).is_some_and(|m| m.name == "marked")
        };
        self.area(&snapshot.particles)?;
        for [a, b] in &snapshot.glyphs {
            self.line(&[*a, *b], STROKE, 1.0)?;
        }
        for line in &snapshot.dye_lines {
            self.line(line, INK, 0.8)?;
        }
        for isoline in &snapshot.isolines {
            for strip in isoline.strips.iter().filter(|strip| self.is_seen(strip)) {
                self.line(strip, LEVEL, 1.6)?;
            }
        }
        let particles = snapshot.particles.positions.iter().zip(&snapshot.particles.class);
        for (position, _) in particles.filter(|(_, class)| marked(**class)) {
            let dot = Circle::new(self.at(*position), self.pen.px(1.7), INK.filled());
            self.root.draw(&dot)?;
        }
        for isoline in &snapshot.isolines {
            self.level(isoline.level, &isoline.strips)?;
        }
        for wall in &self.info.walls {
            self.line(&wall.points, INK, 2.0)?;
        }
        self.frame()
    }

    fn at(&self, [x, y]: [f32; 2]) -> (i32, i32) {
        let [left, top, width, height] = self.place;
        let domain = self.info.domain;
        let [w, h] = domain.size();
        let u = f64::from((x - domain.min[0]) / w);
        let v = f64::from((domain.max[1] - y) / h);
        (self.pen.px(left + u * width), self.pen.px(top + v * height))
    }

    fn frame(&self) -> Drawn<B> {
        let Rect { min: [x0, y0], max: [x1, y1] } = self.info.domain;
        let corners = [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]];
        self.line(&corners, INK, 1.0)
    }

    fn line(&self, points: &[[f32; 2]], color: RGBColor, width: f64) -> Drawn<B> {
        // Points closer than a pixel are dropped: they are not visible, and the file grows.
        let near = self.pen.px(1.0);
        let mut places: Vec<(i32, i32)> = vec![];
        for (k, point) in points.iter().enumerate() {
            let at = self.at(*point);
            let far = |last: &(i32, i32)| (at.0 - last.0).abs().max((at.1 - last.1).abs()) >= near;
            if places.last().is_none_or(far) || k + 1 == points.len() {
                places.push(at);
            }
        }
        self.pen.polyline(self.root, places, self.pen.stroke(color, width))
    }

    /// Whether an isoline is long enough to be drawn.
    fn is_seen(&self, strip: &[[f32; 2]]) -> bool {
        let [w, h] = self.info.domain.size();
        let extent = |c: usize| {
            let values = strip.iter().map(|p| p[c]);
            values.clone().fold(f32::MIN, f32::max) - values.fold(f32::MAX, f32::min)
        };
        extent(0).max(extent(1)) > SMALLEST_LINE * w.max(h)
    }

    /// Distance of a point from the frame, relative to the domain and at most 0.2. The bound keeps
    /// the labels of all levels from meeting in the middle.
    fn depth(&self, [x, y]: &[f32; 2]) -> f32 {
        let Rect { min, max } = self.info.domain;
        let [w, h] = self.info.domain.size();
        let of = |v: f32, low: f32, high: f32, size: f32| ((v - low).min(high - v) / size).min(0.2);
        of(*x, min[0], max[0], w).min(of(*y, min[1], max[1], h))
    }

    /// Writes the value of a level onto its longest isoline, on a white rectangle.
    fn level(&self, level: f32, strips: &[Vec<[f32; 2]>]) -> Drawn<B> {
        let Some(longest) = strips.iter().max_by_key(|strip| strip.len()) else { return Ok(()) };
        let Some(point) = longest.iter().max_by(|a, b| self.depth(a).total_cmp(&self.depth(b)))
        else {
            return Ok(());
        };
        let (x, y) = self.at(*point);
        let (dx, dy) = (self.pen.px(17.0), self.pen.px(9.0));
        let patch = Rectangle::new([(x - dx, y - dy), (x + dx, y + dy)], WHITE.filled());
        self.root.draw(&patch)?;
        let centre = Pos::new(HPos::Center, VPos::Center);
        self.pen.text(self.root, &short(f64::from(level)), 15.0, (x, y), centre)
    }

    /// Fills the area that particles cover with the colours of their materials. Nothing is drawn if
    /// one material fills the whole domain.
    fn area(&self, particles: &ParticleSnapshot) -> Drawn<B> {
        let drawn = self.info.materials.iter().filter(|m| m.drawn && m.name != "marked").count();
        if drawn == self.info.materials.iter().filter(|m| m.name != "marked").count() && drawn < 2 {
            return Ok(());
        }
        let [_, _, width, height] = self.place;
        let cover = Cover::new(
            particles,
            self.info.domain,
            [width.round() as usize, height.round() as usize],
            OVERLAP * self.info.particle_radius,
        );
        for (class, [i0, j0, i1, j1]) in cover.rectangles() {
            let rgb = self.info.materials.get(usize::from(class)).map_or([200; 3], |m| m.rgb);
            let [r, g, b] = rgb.map(|c| ((f64::from(c) + 1.2 * 255.0) / 2.2).round() as u8);
            let corner = |i: usize, j: usize| self.at(cover.point(i, j));
            let (low, high) = (corner(i0, j0), corner(i1, j1));
            let rectangle =
                Rectangle::new([(low.0, high.1), (high.0, low.1)], RGBColor(r, g, b).filled());
            self.root.draw(&rectangle)?;
        }
        Ok(())
    }
}

/// Raster of the material that covers each pixel.
struct Cover {
    domain: Rect,
    n: [usize; 2],
    /// Class plus one; zero where no particle is.
    pixels: Vec<u16>,
}

impl Cover {
    fn new(particles: &ParticleSnapshot, domain: Rect, n: [usize; 2], radius: f32) -> Cover {
        let n = n.map(|n| n.max(1));
        let mut cover = Cover { domain, n, pixels: vec![0; n[0] * n[1]] };
        let size = domain.size();
        for (position, &class) in particles.positions.iter().zip(&particles.class) {
            let span = |c: usize| {
                let place = |p: f32| (p - domain.min[c]) / size[c] * n[c] as f32;
                let low = place(position[c] - radius).round().max(0.0) as usize;
                let high = place(position[c] + radius).round().max(0.0) as usize;
                (low, high.max(low + 1).min(n[c]))
            };
            let ((i0, i1), (j0, j1)) = (span(0), span(1));
            for j in j0..j1 {
                for i in i0..i1 {
                    cover.pixels[j * n[0] + i] = class + 1;
                }
            }
        }
        cover.close();
        cover
    }

    /// Fills gaps of a few pixels along rows and columns. Particles leave such gaps where the flow
    /// stretches.
    fn close(&mut self) {
        let [nx, ny] = self.n;
        let before = self.pixels.clone();
        let widest = (WIDEST_GAP * nx as f64).ceil() as usize;
        let rows = (0..ny).map(|j| (j * nx, 1, nx));
        let columns = (0..nx).map(|i| (i, nx, ny));
        for (start, stride, count) in rows.chain(columns) {
            let mut last: Option<usize> = None;
            for k in 0..count {
                let class = before[start + k * stride];
                if class == 0 {
                    continue;
                }
                if let Some(last) = last.filter(|last| (2..=widest + 1).contains(&(k - last))) {
                    (last + 1..k).for_each(|k| self.pixels[start + k * stride] = class);
                }
                last = Some(k);
            }
        }
    }

    /// Lower left corner of a pixel (m).
    fn point(&self, i: usize, j: usize) -> [f32; 2] {
        let size = self.domain.size();
        let at = |c: usize, k: usize| self.domain.min[c] + size[c] * k as f32 / self.n[c] as f32;
        [at(0, i), at(1, j)]
    }

    /// Rectangles of one class, as class and `[i0, j0, i1, j1]`: runs of pixels in a row, merged
    /// with equal runs in the rows above.
    fn rectangles(&self) -> Vec<(u16, [usize; 4])> {
        let mut done: Vec<(u16, [usize; 4])> = vec![];
        let mut open: Vec<(u16, [usize; 4])> = vec![];
        for (j, row) in self.pixels.chunks(self.n[0]).enumerate() {
            let mut next = vec![];
            let mut i = 0;
            for run in row.chunk_by(|a, b| a == b) {
                let (from, to) = (i, i + run.len());
                i = to;
                if run[0] == 0 {
                    continue;
                }
                let class = run[0] - 1;
                let below =
                    open.iter().position(|(c, [a, _, b, _])| (*c, *a, *b) == (class, from, to));
                let bottom = below.map_or(j, |k| open.swap_remove(k).1[1]);
                next.push((class, [from, bottom, to, j + 1]));
            }
            done.append(&mut open);
            open = next;
        }
        done.append(&mut open);
        done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles_cover_the_particles() {
        let domain = Rect { min: [0.0, 0.0], max: [4.0, 4.0] };
        let positions = vec![[0.5, 0.5], [1.5, 0.5], [0.5, 1.5], [1.5, 1.5], [3.5, 3.5]];
        let particles = ParticleSnapshot {
            positions,
            class: vec![0, 0, 0, 0, 1],
            ..ParticleSnapshot::default()
        };
        let cover = Cover::new(&particles, domain, [4, 4], 0.5);
        let mut found = cover.rectangles();
        found.sort();
        assert_eq!(found, [(0, [0, 0, 2, 2]), (1, [3, 3, 4, 4])]);
    }
}
