//! This module draws line plots: the same figure as SVG and as PNG.
//!
//! The axes are drawn here and not by the chart builder of plotters, which places the legend over
//! the data, labels logarithms badly and has no engineering notation. Empty, constant or infinite
//! data cause no panic.

mod panel;
mod scale;

use panel::Panel;
use scale::Scale;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use super::replace::{self, Kind, may_replace};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::FontStyle;
use plotters::style::text_anchor::Pos;

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
    replace::write(path, text, Kind::Svg).map_err(|e| e.to_string())
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
    may_replace(path, Kind::Png).map_err(|e| e.to_string())?;
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

#[cfg(test)]
mod tests {
    use super::scale::axis_label;
    use super::*;
    use crate::record::number::nice_step;

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
