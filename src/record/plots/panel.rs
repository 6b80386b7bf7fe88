//! Draws one panel: frame, axes, legend, curves and bars.

use super::super::colour::OKABE_ITO;
use super::*;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// A plot and the part of the figure that it fills.
pub(super) struct Panel<'a, B: DrawingBackend> {
    pub(super) area: &'a DrawingArea<B, Shift>,
    pub(super) plot: &'a PlotSpec,
    pub(super) bars: &'a [Vec<f64>],
    pub(super) pen: Pen,
    /// Left, top, right and bottom of the frame (pixels of the backend).
    pub(super) frame: [i32; 4],
    /// Rows of the legend: index of each curve and width of its name (pixels of the backend).
    pub(super) legend: Vec<Vec<(usize, i32)>>,
}

/// Height of a row of the legend (pixels).
pub(super) const LEGEND_ROW: f64 = 30.0;

impl<'a, B: DrawingBackend> Panel<'a, B> {
    pub(super) fn new(
        area: &'a DrawingArea<B, Shift>,
        plot: &'a PlotSpec,
        bars: &'a [Vec<f64>],
        pen: Pen,
    ) -> Self {
        let (width, height) = area.dim_in_pixel();
        let (left, right) =
            (pen.px(105.0), i32::try_from(width).unwrap_or(i32::MAX) - pen.px(35.0));
        let legend = Self::legend_rows(area, plot, pen, right - left);
        let frame = [
            left,
            pen.px(58.0 + LEGEND_ROW * legend.len() as f64),
            right,
            i32::try_from(height).unwrap_or(i32::MAX) - pen.px(68.0),
        ];
        Self { area, plot, bars, pen, frame, legend }
    }

    /// Arranges the curve names in as many rows as they need. A single curve has no legend.
    pub(super) fn legend_rows(
        area: &DrawingArea<B, Shift>,
        plot: &PlotSpec,
        pen: Pen,
        room: i32,
    ) -> Vec<Vec<(usize, i32)>> {
        let mut rows: Vec<Vec<(usize, i32)>> = vec![];
        if plot.curves.len() < 2 {
            return rows;
        }
        let style = (FONT, 18.0 * pen.scale).into_text_style(area);
        let mut full = 0;
        for (k, curve) in plot.curves.iter().enumerate() {
            let size = area.estimate_text_size(&curve.name, &style);
            let name = size.map_or(0, |(width, _)| i32::try_from(width).unwrap_or(0));
            let width = name + Self::swatch(pen);
            match rows.last_mut() {
                Some(row) if full + width <= room => row.push((k, name)),
                _ => {
                    full = 0;
                    rows.push(vec![(k, name)]);
                }
            }
            full += width;
        }
        rows
    }

    /// Width of a legend entry besides the name: line sample and gaps (pixels of the backend).
    pub(super) fn swatch(pen: Pen) -> i32 {
        pen.px(28.0) + pen.px(8.0) + pen.px(26.0)
    }

    pub(super) fn px(&self, n: f64) -> i32 {
        self.pen.px(n)
    }

    pub(super) fn line(&self, color: RGBColor, width: f64) -> ShapeStyle {
        self.pen.stroke(color, width)
    }

    pub(super) fn text(&self, text: &str, size: f64, at: (i32, i32), pos: Pos) -> Drawn<B> {
        self.pen.text(self.area, text, size, at, pos)
    }

    pub(super) fn draw(&self) -> Drawn<B> {
        let [left, top, right, bottom] = self.frame;
        if right <= left || bottom <= top {
            return Ok(());
        }
        let middle = (left + right) / 2;
        let centre = Pos::new(HPos::Center, VPos::Center);
        self.text(&self.plot.title, 24.0, (middle, self.px(28.0)), centre)?;
        self.legend()?;

        let usable = |&&(x, y): &&(f64, f64)| {
            let fits = |value: f64, log: bool| value.is_finite() && (!log || value > 0.0);
            fits(x, self.plot.x.log) && fits(y, self.plot.y.log)
        };
        let ends: Vec<(f64, f64)> = self.bar_ends().into_iter().flatten().collect();
        let points = self.plot.curves.iter().flat_map(|curve| &curve.points);
        let points = points.chain(&ends).filter(usable);
        let scales = (
            Scale::new(&self.plot.x, points.clone().map(|p| p.0)),
            Scale::new(&self.plot.y, points.map(|p| p.1)),
        );
        if let (Some(x), Some(y)) = scales {
            let marked = self.plot.curves.iter().any(|curve| curve.marks);
            let (x, y) = (x.widen(if marked { 0.03 } else { 0.0 }), y.widen(0.05));
            self.axes(&x, &y)?;
            for (curve, color) in self.plot.curves.iter().zip(OKABE_ITO.iter().cycle()) {
                self.curve(curve, *color, &x, &y)?;
            }
            for (ends, color) in self.bar_ends().iter().zip(OKABE_ITO.iter().cycle()) {
                self.bars_of(ends, *color, &x, &y)?;
            }
        } else {
            let at = (middle, (top + bottom) / 2);
            self.text("no data", 22.0, at, centre)?;
        }
        let frame = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top)];
        self.area.draw(&PathElement::new(frame, self.line(INK, 1.0)))
    }

    pub(super) fn axes(&self, x: &Scale, y: &Scale) -> Drawn<B> {
        let [left, top, right, bottom] = self.frame;
        let (width, height) = (f64::from(right - left), f64::from(bottom - top));
        for (tick, text) in &x.ticks {
            let at = left + (x.place_of_tick(*tick) * width).round() as i32;
            if !(left..=right).contains(&at) {
                continue;
            }
            let line = [(at, top), (at, bottom)];
            self.area.draw(&PathElement::new(line, self.line(GRID, 1.0)))?;
            let below = (at, bottom + self.px(8.0));
            self.text(text, 17.0, below, Pos::new(HPos::Center, VPos::Top))?;
        }
        for (tick, text) in &y.ticks {
            let at = bottom - (y.place_of_tick(*tick) * height).round() as i32;
            if !(top..=bottom).contains(&at) {
                continue;
            }
            let line = [(left, at), (right, at)];
            self.area.draw(&PathElement::new(line, self.line(GRID, 1.0)))?;
            let beside = (left - self.px(9.0), at);
            self.text(text, 17.0, beside, Pos::new(HPos::Right, VPos::Center))?;
        }
        let below = ((left + right) / 2, bottom + self.px(34.0));
        self.text(&x.label, 19.0, below, Pos::new(HPos::Center, VPos::Top))?;
        let style = (FONT, 19.0 * self.pen.scale)
            .into_text_style(self.area)
            .color(&INK)
            .transform(FontTransform::Rotate270)
            .pos(Pos::new(HPos::Center, VPos::Top));
        let beside = (self.px(14.0), (top + bottom) / 2);
        self.area.draw_text(&y.label, &style, beside)
    }

    /// Draws the legend in rows above the frame.
    pub(super) fn legend(&self) -> Drawn<B> {
        let [left, _, right, _] = self.frame;
        let (line, gap, space) = (self.px(28.0), self.px(8.0), self.px(26.0));
        for (row, y) in self.legend.iter().zip(0..) {
            let y = self.px(64.0 + LEGEND_ROW * f64::from(y));
            let full: i32 = row.iter().map(|(_, width)| width + Self::swatch(self.pen)).sum();
            let mut at = ((left + right - full + space) / 2).max(left);
            for &(k, width) in row {
                let [r, g, b] = OKABE_ITO[k % OKABE_ITO.len()];
                let style = self.line(RGBColor(r, g, b), 3.0);
                self.area.draw(&PathElement::new([(at, y), (at + line, y)], style))?;
                let pos = Pos::new(HPos::Left, VPos::Center);
                self.text(&self.plot.curves[k].name, 18.0, (at + line + gap, y), pos)?;
                at += width + Self::swatch(self.pen);
            }
        }
        Ok(())
    }

    /// Lower and upper ends of the bars of each curve, alternating.
    pub(super) fn bar_ends(&self) -> Vec<Vec<(f64, f64)>> {
        let ends = |(curve, bars): (&Curve, &Vec<f64>)| {
            let both = |(&(x, y), bar): (&(f64, f64), &f64)| [(x, y - bar), (x, y + bar)];
            let seen = curve.points.iter().zip(bars).filter(|(_, bar)| **bar > 0.0);
            seen.flat_map(both).collect()
        };
        self.plot.curves.iter().zip(self.bars).map(ends).collect()
    }

    /// Pixel at the fractions `u` and `v` of the frame, from its lower left corner.
    fn pixel(&self, u: f64, v: f64) -> (i32, i32) {
        let [left, top, right, bottom] = self.frame;
        let (width, height) = (f64::from(right - left), f64::from(bottom - top));
        (left + (u * width).round() as i32, bottom - (v * height).round() as i32)
    }

    pub(super) fn bars_of(
        &self,
        ends: &[(f64, f64)],
        [r, g, b]: [u8; 3],
        x: &Scale,
        y: &Scale,
    ) -> Drawn<B> {
        let style = self.line(RGBColor(r, g, b), 2.0);
        let half = self.px(6.0);
        for pair in ends.chunks_exact(2) {
            let place = |(px, py): (f64, f64)| {
                // A lower end that is not positive is drawn at the frame on a logarithmic axis.
                let (u, v) = (x.place(px)?, y.place(py).unwrap_or(0.0));
                Some(self.pixel(u, v))
            };
            let (Some(low), Some(high)) = (place(pair[0]), place(pair[1])) else { continue };
            self.area.draw(&PathElement::new([low, high], style))?;
            for (at, y) in [low, high] {
                self.area.draw(&PathElement::new([(at - half, y), (at + half, y)], style))?;
            }
        }
        Ok(())
    }

    pub(super) fn curve(
        &self,
        curve: &Curve,
        [r, g, b]: [u8; 3],
        x: &Scale,
        y: &Scale,
    ) -> Drawn<B> {
        let place = |&(px, py): &(f64, f64)| {
            let (u, v) = (x.place(px)?, y.place(py)?);
            Some(self.pixel(u, v))
        };
        let color = RGBColor(r, g, b);
        let places: Vec<Option<(i32, i32)>> = curve.points.iter().map(place).collect();
        for piece in places.split(Option::is_none) {
            let piece: Vec<(i32, i32)> = piece.iter().flatten().copied().collect();
            let piece = if piece.len() > MOST_POINTS { extremes(&piece) } else { piece };
            // A single point has no line and would be invisible.
            if curve.marks || piece.len() == 1 {
                for &at in &piece {
                    self.area.draw(&Circle::new(at, self.px(4.5), color.filled()))?;
                }
            }
            self.pen.polyline(self.area, piece, self.line(color, 2.0))?;
        }
        Ok(())
    }
}

/// Keeps the first, lowest, highest and last point of each pixel column.
pub(super) fn extremes(points: &[(i32, i32)]) -> Vec<(i32, i32)> {
    let mut thin: Vec<(i32, i32)> = Vec::new();
    for column in points.chunk_by(|a, b| a.0 == b.0) {
        let low = column.iter().min_by_key(|point| point.1);
        let high = column.iter().max_by_key(|point| point.1);
        let kept = [column.first(), low, high, column.last()];
        thin.extend(kept.into_iter().flatten());
    }
    thin.dedup();
    thin
}
