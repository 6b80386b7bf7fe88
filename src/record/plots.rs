//! This module draws line plots: the same figure as SVG and as PNG.
//!
//! The axes are drawn here and not by the chart builder of plotters, which places the legend over
//! the data, labels logarithms badly and has no engineering notation. Empty, constant or infinite
//! data cause no panic.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::FontStyle;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::color::OKABE_ITO;
use super::number::{engineering_exponent, trim_zeros};

/// Size of a figure with one plot (pixels).
const SIZE: (u32, u32) = (1200, 750);

/// Height of one panel of a stack (pixels).
const PANEL_HEIGHT: u32 = 380;

/// A PNG is drawn larger by this factor and averaged: plotters does not smooth thick lines.
const OVERSAMPLING: u32 = 2;

/// An SVG is drawn larger by this factor and scaled down by its view box: plotters rounds to whole
/// pixels, which would leave steps in smooth curves.
const SVG_GRAIN: u32 = 8;

/// Curves with more points than this are reduced to their extremes per pixel column.
const MOST_POINTS: usize = 5000;

/// Name under which the built-in font is registered.
pub(super) const FONT: &str = "sans-serif";
/// Colour of text and frames.
pub(super) const INK: RGBColor = RGBColor(34, 34, 38);
const GRID: RGBColor = RGBColor(225, 225, 228);

/// An axis of a plot.
#[derive(Debug, Clone, Default)]
pub struct Axis {
    /// Name of the quantity, such as `time`.
    pub name: String,
    /// Unit, such as `s` or `m²/s`; empty for pure numbers.
    pub unit: String,
    /// Whether the axis is logarithmic. Values that are not positive are then left out.
    pub log: bool,
}

impl Axis {
    /// A linear axis of a quantity `name` in `unit`.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into(), log: false }
    }

    /// The same axis with a logarithmic scale.
    pub fn log(self) -> Self {
        Self { log: true, ..self }
    }
}

/// A curve of a plot.
#[derive(Debug, Clone, Default)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// Points (x, y), in the units of the axes. A point that is not finite interrupts the line.
    pub points: Vec<(f64, f64)>,
    /// Whether the points are drawn as dots.
    pub marks: bool,
}

/// A plot: title, axes and curves.
#[derive(Debug, Clone, Default)]
pub struct PlotSpec {
    /// Title of the plot.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// Curves. Colours repeat after seven.
    pub curves: Vec<Curve>,
}

/// Error of writing a plot.
#[derive(Debug, thiserror::Error)]
#[error("the plot {} cannot be written: {cause}", path.display())]
pub struct PlotError {
    /// Path of the file.
    pub path: PathBuf,
    /// Cause, as reported by the system or the encoder.
    pub cause: String,
}

/// Writes a plot to `<stem>.svg` and `<stem>.png`.
pub fn line_plot(stem: &Path, plot: &PlotSpec) -> Result<(), PlotError> {
    write(stem, &Panels::of(std::slice::from_ref(plot)), SIZE)
}

/// Writes a plot with error bars to `<stem>.svg` and `<stem>.png`. `bars` has the half-length of
/// the bar for each point of each curve, in the unit of y.
pub fn spread_plot(stem: &Path, plot: &PlotSpec, bars: &[Vec<f64>]) -> Result<(), PlotError> {
    write(stem, &Panels { plots: std::slice::from_ref(plot), bars }, SIZE)
}

/// Writes a plot to `<stem>.svg` only.
pub fn svg_plot(stem: &Path, plot: &PlotSpec) -> Result<(), PlotError> {
    let path = with_suffix(stem, ".svg");
    let panels = Panels::of(std::slice::from_ref(plot));
    to_svg(&path, &panels, SIZE).map_err(|cause| PlotError { path, cause })
}

/// Writes several plots, one below the other, to `<stem>.svg` and `<stem>.png`.
pub fn panels_plot(stem: &Path, plots: &[PlotSpec]) -> Result<(), PlotError> {
    let count = u32::try_from(plots.len()).unwrap_or(1).max(1);
    write(stem, &Panels::of(plots), (SIZE.0, PANEL_HEIGHT * count))
}

/// Appends a suffix to a path. `with_extension` would replace part of a stem such as `dt_0.01`.
fn with_suffix(stem: &Path, suffix: &str) -> PathBuf {
    let mut name = stem.as_os_str().to_owned();
    name.push(suffix);
    PathBuf::from(name)
}

/// A figure that can be drawn on any backend.
pub(super) trait Drawing {
    /// Draws the figure.
    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>, pen: Pen) -> Drawn<B>;
}

/// Writes a figure of `size` pixels as `<stem>.svg` and `<stem>.png`.
pub(super) fn write(stem: &Path, figure: &impl Drawing, size: (u32, u32)) -> Result<(), PlotError> {
    let (svg, png) = (with_suffix(stem, ".svg"), with_suffix(stem, ".png"));
    to_svg(&svg, figure, size).map_err(|cause| PlotError { path: svg, cause })?;
    to_png(&png, figure, size).map_err(|cause| PlotError { path: png, cause })
}

fn to_svg(path: &Path, figure: &impl Drawing, size: (u32, u32)) -> Result<(), String> {
    font()?;
    let (width, height) = (size.0 * SVG_GRAIN, size.1 * SVG_GRAIN);
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
        let pen = Pen { scale: f64::from(SVG_GRAIN), joins: true };
        figure.draw(&root, pen).map_err(|e| e.to_string())?;
        root.present().map_err(|e| e.to_string())?;
    }
    // The view box, which follows in the text, keeps the larger size.
    let text = text.replacen(
        &format!("width=\"{width}\" height=\"{height}\""),
        &format!("width=\"{}\" height=\"{}\"", size.0, size.1),
        1,
    );
    std::fs::write(path, text).map_err(|e| e.to_string())
}

fn to_png(path: &Path, figure: &impl Drawing, size: (u32, u32)) -> Result<(), String> {
    font()?;
    let large = (size.0 * OVERSAMPLING, size.1 * OVERSAMPLING);
    let mut pixels = vec![0; 3 * large.0 as usize * large.1 as usize];
    {
        let root = BitMapBackend::with_buffer(&mut pixels, large).into_drawing_area();
        let pen = Pen { scale: f64::from(OVERSAMPLING), joins: false };
        figure.draw(&root, pen).map_err(|e| e.to_string())?;
        root.present().map_err(|e| e.to_string())?;
    }
    let small = average(&pixels, size);
    // The file is opened here first because the error of the encoder does not name its cause.
    std::fs::File::create(path).map_err(|e| e.to_string())?;
    let root = BitMapBackend::new(path, size).into_drawing_area();
    let image = BitMapElement::with_owned_buffer((0, 0), size, small)
        .ok_or("the image has a wrong size")?;
    root.draw(&image).map_err(|e| e.to_string())?;
    root.present().map_err(|e| e.to_string())
}

/// Averages blocks of `OVERSAMPLING` by `OVERSAMPLING` pixels.
fn average(pixels: &[u8], (width, height): (u32, u32)) -> Vec<u8> {
    let (width, height) = (width as usize, height as usize);
    let k = OVERSAMPLING as usize;
    let mut small = Vec::with_capacity(3 * width * height);
    for y in 0..height {
        for x in 0..width {
            for channel in 0..3 {
                let mut sum = 0;
                for dy in 0..k {
                    for dx in 0..k {
                        let at = ((y * k + dy) * width * k + x * k + dx) * 3 + channel;
                        sum += usize::from(pixels[at]);
                    }
                }
                small.push((sum / (k * k)) as u8);
            }
        }
    }
    small
}

/// Registers the built-in font, so that no system font is needed.
fn font() -> Result<(), String> {
    static FONT_IS_KNOWN: OnceLock<bool> = OnceLock::new();
    let known = FONT_IS_KNOWN.get_or_init(|| {
        let file = epaint_default_fonts::UBUNTU_LIGHT;
        plotters::style::register_font(FONT, FontStyle::Normal, file).is_ok()
    });
    known.then_some(()).ok_or_else(|| "the built-in font is broken".to_owned())
}

/// Scale and line style of a backend.
#[derive(Clone, Copy)]
pub(super) struct Pen {
    /// Pixels of the backend per pixel of the figure.
    pub(super) scale: f64,
    /// Whether the backend joins thick lines well. The bitmaps of plotters do not: at sharp turns
    /// their joints extend far beyond the line.
    joins: bool,
}

/// Result of drawing on a backend.
pub(super) type Drawn<B> = Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;

impl Pen {
    /// Converts pixels of the figure to pixels of the backend.
    pub(super) fn px(self, n: f64) -> i32 {
        (n * self.scale).round() as i32
    }

    /// Style of a line of `width` pixels of the figure.
    pub(super) fn stroke(self, color: RGBColor, width: f64) -> ShapeStyle {
        color.stroke_width(self.px(width).max(1) as u32)
    }

    /// Writes text of `size` pixels of the figure at a position of the backend.
    pub(super) fn text<B: DrawingBackend>(
        self,
        area: &DrawingArea<B, Shift>,
        text: &str,
        size: f64,
        at: (i32, i32),
        pos: Pos,
    ) -> Drawn<B> {
        let style = (FONT, size * self.scale).into_text_style(area);
        area.draw_text(text, &style.color(&INK).pos(pos), at)
    }

    /// Draws a line through points.
    pub(super) fn polyline<B: DrawingBackend>(
        self,
        area: &DrawingArea<B, Shift>,
        points: Vec<(i32, i32)>,
        style: ShapeStyle,
    ) -> Drawn<B> {
        if points.len() < 2 {
            return Ok(());
        }
        if self.joins {
            return area.draw(&PathElement::new(points, style));
        }
        for ends in points.windows(2) {
            area.draw(&PathElement::new([ends[0], ends[1]], style))?;
        }
        Ok(())
    }
}

/// Several plots, one below the other.
struct Panels<'a> {
    plots: &'a [PlotSpec],
    /// Half-lengths of the error bars of each curve; used for a single plot only.
    bars: &'a [Vec<f64>],
}

impl<'a> Panels<'a> {
    fn of(plots: &'a [PlotSpec]) -> Self {
        Panels { plots, bars: &[] }
    }
}

impl Drawing for Panels<'_> {
    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>, pen: Pen) -> Drawn<B> {
        root.fill(&WHITE)?;
        let areas = root.split_evenly((self.plots.len().max(1), 1));
        for (area, plot) in areas.iter().zip(self.plots) {
            Panel::new(area, plot, self.bars, pen).draw()?;
        }
        Ok(())
    }
}

/// An axis with its range and ticks, computed from the data.
struct Scale {
    /// Lower end; its decimal logarithm if `log`.
    low: f64,
    /// Upper end; its decimal logarithm if `log`.
    high: f64,
    log: bool,
    /// Positions and labels of the ticks.
    ticks: Vec<(f64, String)>,
    label: String,
}

impl Scale {
    fn new(axis: &Axis, values: impl Iterator<Item = f64>) -> Option<Self> {
        let (mut low, mut high) = values
            .map(|value| if axis.log { value.log10() } else { value })
            .filter(|value| value.is_finite())
            .fold(None, |ends: Option<(f64, f64)>, value| {
                Some(ends.map_or((value, value), |(l, h)| (l.min(value), h.max(value))))
            })?;
        if high - low <= 1e-12 * low.abs().max(high.abs()) {
            // A constant is drawn as a line in the middle.
            let room = match (axis.log, low == 0.0) {
                (true, _) => 0.5,
                (false, true) => 1.0,
                (false, false) => 0.5 * low.abs(),
            };
            (low, high) = (low - room, high + room);
        }
        Some(if axis.log {
            Self::logarithmic(axis, low, high)
        } else {
            Self::linear(axis, low, high)
        })
    }

    fn linear(axis: &Axis, low: f64, high: f64) -> Self {
        let step = nice_step(high - low);
        let first = (low / step).ceil() as i64;
        let last = (high / step).floor() as i64;
        // Numbers such as 0.2 or 1500 need no power of ten; others do.
        let reach = low.abs().max(high.abs());
        let exponent = if (0.1..1e4).contains(&reach) { 0 } else { engineering_exponent(reach) };
        let factor = 10f64.powi(exponent);
        let decimals = (-(step / factor).log10() - 1e-9).ceil().clamp(0.0, 12.0) as usize;
        let ticks = (first..=last)
            .map(|i| {
                let value = i as f64 * step;
                let text = format!("{:.decimals$}", value / factor);
                (value, text.replace('-', "−"))
            })
            .collect();
        Self { low, high, log: false, ticks, label: axis_label(axis, exponent) }
    }

    fn logarithmic(axis: &Axis, low: f64, high: f64) -> Self {
        // The axis spans at least half a decade.
        let short = (0.5 - (high - low)).max(0.0) / 2.0;
        let (low, high) = (low - short, high + short);
        let span = high - low;
        let ticks = if span > 2.0 {
            let step = (span / 8.0).ceil().max(1.0) as i64;
            let first = (low / step as f64).ceil() as i64;
            let last = (high / step as f64).floor() as i64;
            (first..=last).map(|i| ((i * step) as f64, decade(i * step))).collect()
        } else {
            let digits: &[f64] =
                if span > 1.0 { &[1.0, 2.0, 5.0] } else { &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0] };
            let (first, last) = (low.floor() as i64, high.floor() as i64);
            (first..=last)
                .flat_map(|e| digits.iter().map(move |d| (d.log10() + e as f64, *d, e)))
                .filter(|(place, ..)| (low..=high).contains(place))
                .map(|(place, digit, e)| (place, plain(digit, e)))
                .collect()
        };
        Self { low, high, log: true, ticks, label: axis_label(axis, 0) }
    }

    /// Extends both ends by `share` times the span.
    fn widen(mut self, share: f64) -> Self {
        let room = share * (self.high - self.low);
        self.low -= room;
        self.high += room;
        self
    }

    /// Position of a value, 0 at the lower end and 1 at the upper; `None` if it cannot be drawn.
    fn place(&self, value: f64) -> Option<f64> {
        let value = if self.log { value.log10() } else { value };
        let place = (value - self.low) / (self.high - self.low);
        place.is_finite().then_some(place)
    }

    fn place_of_tick(&self, tick: f64) -> f64 {
        (tick - self.low) / (self.high - self.low)
    }
}

/// Tick spacing of 1, 2 or 5 times a power of ten that gives about five to ten ticks.
fn nice_step(span: f64) -> f64 {
    let decade = 10f64.powf((span / 10.0).log10().floor());
    let share = span / 10.0 / decade;
    let digit = match share {
        s if s <= 1.0 => 1.0,
        s if s <= 2.0 => 2.0,
        s if s <= 5.0 => 5.0,
        _ => 10.0,
    };
    (digit * decade).max(f64::MIN_POSITIVE)
}

/// Formats a power of ten.
fn decade(exponent: i64) -> String {
    match exponent {
        -2..=3 => plain(1.0, exponent),
        _ => format!("1e{exponent}").replace('-', "−"),
    }
}

/// Formats a digit times a power of ten.
fn plain(digit: f64, exponent: i64) -> String {
    let exponent = i32::try_from(exponent).unwrap_or(0);
    if (-3..=4).contains(&exponent) {
        let value = digit * 10f64.powi(exponent);
        trim_zeros(&format!("{value:.4}")).to_owned()
    } else {
        format!("{}e{exponent}", trim_zeros(&format!("{digit:.1}"))).replace('-', "−")
    }
}

/// Label of an axis: name and unit, including the power of ten factored out of the tick labels.
fn axis_label(axis: &Axis, exponent: i32) -> String {
    let Axis { name, unit, .. } = axis;
    // Only simple units take prefixes: a millimetre squared is not 1e-3 m².
    let simple = matches!(unit.as_str(), "m" | "s" | "Pa" | "N" | "J" | "W" | "Hz");
    let prefix = match exponent {
        0 => Some(""),
        -9 => Some("n"),
        -6 => Some("µ"),
        -3 => Some("m"),
        // Kiloseconds are not in use.
        3 if unit != "s" => Some("k"),
        6 if unit != "s" => Some("M"),
        9 if unit != "s" => Some("G"),
        _ => None,
    };
    let power = format!("1e{exponent}").replace('-', "−");
    match (prefix, unit.is_empty()) {
        (Some(""), true) => name.clone(),
        (Some(""), false) => format!("{name} ({unit})"),
        (Some(prefix), false) if simple => format!("{name} ({prefix}{unit})"),
        (_, true) => format!("{name} ({power})"),
        (_, false) => format!("{name} ({power} {unit})"),
    }
}

/// A plot and the part of the figure that it fills.
struct Panel<'a, B: DrawingBackend> {
    area: &'a DrawingArea<B, Shift>,
    plot: &'a PlotSpec,
    bars: &'a [Vec<f64>],
    pen: Pen,
    /// Left, top, right and bottom of the frame (pixels of the backend).
    frame: [i32; 4],
    /// Rows of the legend: index of each curve and width of its name (pixels of the backend).
    legend: Vec<Vec<(usize, i32)>>,
}

/// Height of a row of the legend (pixels).
const LEGEND_ROW: f64 = 30.0;

impl<'a, B: DrawingBackend> Panel<'a, B> {
    fn new(
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
    fn legend_rows(
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
    fn swatch(pen: Pen) -> i32 {
        pen.px(28.0) + pen.px(8.0) + pen.px(26.0)
    }

    fn px(&self, n: f64) -> i32 {
        self.pen.px(n)
    }

    fn line(&self, color: RGBColor, width: f64) -> ShapeStyle {
        self.pen.stroke(color, width)
    }

    fn text(&self, text: &str, size: f64, at: (i32, i32), pos: Pos) -> Drawn<B> {
        self.pen.text(self.area, text, size, at, pos)
    }

    fn draw(&self) -> Drawn<B> {
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

    fn axes(&self, x: &Scale, y: &Scale) -> Drawn<B> {
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
    fn legend(&self) -> Drawn<B> {
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
    fn bar_ends(&self) -> Vec<Vec<(f64, f64)>> {
        let ends = |(curve, bars): (&Curve, &Vec<f64>)| {
            let both = |(&(x, y), bar): (&(f64, f64), &f64)| [(x, y - bar), (x, y + bar)];
            let seen = curve.points.iter().zip(bars).filter(|(_, bar)| **bar > 0.0);
            seen.flat_map(both).collect()
        };
        self.plot.curves.iter().zip(self.bars).map(ends).collect()
    }

    fn bars_of(&self, ends: &[(f64, f64)], [r, g, b]: [u8; 3], x: &Scale, y: &Scale) -> Drawn<B> {
        let [left, top, right, bottom] = self.frame;
        let (width, height) = (f64::from(right - left), f64::from(bottom - top));
        let style = self.line(RGBColor(r, g, b), 2.0);
        let half = self.px(6.0);
        for pair in ends.chunks_exact(2) {
            let place = |(px, py): (f64, f64)| {
                // A lower end that is not positive is drawn at the frame on a logarithmic axis.
                let (u, v) = (x.place(px)?, y.place(py).unwrap_or(0.0));
                Some((left + (u * width).round() as i32, bottom - (v * height).round() as i32))
            };
            let (Some(low), Some(high)) = (place(pair[0]), place(pair[1])) else { continue };
            self.area.draw(&PathElement::new([low, high], style))?;
            for (at, y) in [low, high] {
                self.area.draw(&PathElement::new([(at - half, y), (at + half, y)], style))?;
            }
        }
        Ok(())
    }

    fn curve(&self, curve: &Curve, [r, g, b]: [u8; 3], x: &Scale, y: &Scale) -> Drawn<B> {
        let [left, top, right, bottom] = self.frame;
        let (width, height) = (f64::from(right - left), f64::from(bottom - top));
        let place = |&(px, py): &(f64, f64)| {
            let (u, v) = (x.place(px)?, y.place(py)?);
            Some((left + (u * width).round() as i32, bottom - (v * height).round() as i32))
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
fn extremes(points: &[(i32, i32)]) -> Vec<(i32, i32)> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axis_labels_contain_the_power_of_ten() {
        let label = |name: &str, unit: &str, exponent| axis_label(&Axis::new(name, unit), exponent);
        assert_eq!(label("time", "s", -3), "time (ms)");
        assert_eq!(label("time", "s", 3), "time (1e3 s)");
        assert_eq!(label("pressure", "Pa", 3), "pressure (kPa)");
        assert_eq!(label("rate", "m²/s", -6), "rate (1e−6 m²/s)");
        assert_eq!(label("steps", "", 0), "steps");
    }

    #[test]
    fn steps_give_a_readable_number_of_ticks() {
        for span in [1e-9, 0.3, 1.0, 7.7, 12.0, 4.9e8] {
            let ticks = span / nice_step(span);
            assert!((4.0..=10.01).contains(&ticks), "{span}: {ticks}");
        }
    }

    #[test]
    fn degenerate_data_cause_no_error() {
        let folder = crate::testing::TempFolder::new().expect("a temporary folder");
        let curves: [&[(f64, f64)]; 6] = [
            &[],
            &[(0.0, 0.0)],
            &[(1.0, 5.0), (2.0, 5.0)],
            &[(f64::NAN, 1.0), (2.0, f64::INFINITY)],
            &[(0.0, -1.0), (1.0, 1e300), (2.0, -1e300)],
            &[(1e9, 1.0), (1e9 + 1e-7, 1.0 + 1e-16)],
        ];
        for (i, points) in curves.iter().enumerate() {
            for log in [false, true] {
                let axis = Axis { log, ..Axis::new("a", "s") };
                let curve = Curve { name: "c".to_owned(), points: points.to_vec(), marks: false };
                let plot = PlotSpec {
                    title: String::new(),
                    x: axis.clone(),
                    y: axis,
                    curves: vec![curve],
                };
                let stem = folder.path().join(format!("plot_{i}_{log}"));
                line_plot(&stem, &plot).expect("a plot");
            }
        }
        panels_plot(&folder.path().join("none"), &[]).expect("an empty figure");
    }
}
