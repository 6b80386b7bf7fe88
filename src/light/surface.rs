//! This module is the surface of films: an image on which the scripts of the light view draw.

use ab_glyph::{Font, FontRef, PxScale, ScaleFont, point};
use std::str::FromStr;
use tiny_skia::{
    Color, FillRule, FilterQuality, LineCap, LineJoin, Mask, Paint, PathBuilder, Pixmap,
    PixmapPaint, PremultipliedColorU8, Rect, Stroke, Transform,
};

/// Radii to which gaps between discs are filled: the mean radius, or that of the disc if it is larger.
const GROWTH: f32 = 2.4;

/// An image, and the rectangle to which drawing is restricted.
pub struct Surface {
    image: Pixmap,
    /// Left, top, right and bottom end (pixels), and the mask of this rectangle.
    clip: Option<([i32; 4], Mask)>,
    font: FontRef<'static>,
}

/// A colour of the scripts, `#rrggbb` or `rgb(r,g,b)`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rgb([u8; 3]);

impl FromStr for Rgb {
    type Err = ();

    fn from_str(text: &str) -> Result<Rgb, ()> {
        if let Some(hex) = text.strip_prefix('#') {
            let part = |k: usize| {
                u8::from_str_radix(hex.get(2 * k..2 * k + 2).ok_or(())?, 16).map_err(|_| ())
            };
            return Ok(Rgb([part(0)?, part(1)?, part(2)?]));
        }
        let inside = text.strip_prefix("rgb(").and_then(|t| t.strip_suffix(')')).ok_or(())?;
        let mut parts = inside.split(',').map(|p| p.trim().parse::<u8>().map_err(|_| ()));
        let mut next = || parts.next().ok_or(())?;
        Ok(Rgb([next()?, next()?, next()?]))
    }
}

/// The paint of a colour; black if the text is not a colour.
fn paint_of(colour: &str) -> Paint<'static> {
    let Rgb([r, g, b]) = colour.parse().unwrap_or(Rgb([0; 3]));
    let mut paint = Paint::default();
    paint.set_color(Color::from_rgba8(r, g, b, 255));
    paint
}

impl Surface {
    /// A black image of a size (pixels); `None` if it is empty or too large.
    pub fn new(width: u32, height: u32) -> Option<Surface> {
        let font = FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).ok()?;
        Some(Surface { image: Pixmap::new(width, height)?, clip: None, font })
    }

    /// The image: red, green, blue and opacity of each pixel, rows from the top. It is opaque where
    /// something was filled.
    pub fn rgba(&self) -> &[u8] {
        self.image.data()
    }

    /// Fills a rectangle.
    pub fn fill(&mut self, x: f32, y: f32, w: f32, h: f32, colour: &str) {
        let Some(rect) = Rect::from_xywh(x, y, w.max(0.0), h.max(0.0)) else { return };
        let mask = self.clip.as_ref().map(|c| &c.1);
        self.image.fill_rect(rect, &paint_of(colour), Transform::identity(), mask);
    }

    /// Restricts drawing to a rectangle.
    pub fn clip(&mut self, x: f32, y: f32, w: f32, h: f32) {
        let Some(rect) = Rect::from_xywh(x, y, w.max(0.0), h.max(0.0)) else { return };
        let Some(mut mask) = Mask::new(self.image.width(), self.image.height()) else { return };
        let path = PathBuilder::from_rect(rect);
        mask.fill_path(&path, FillRule::Winding, true, Transform::identity());
        let ends = [x.floor(), y.floor(), (x + w).ceil(), (y + h).ceil()].map(|v| v as i32);
        self.clip = Some((ends, mask));
    }

    /// Ends the restriction.
    pub fn unclip(&mut self) {
        self.clip = None;
    }

    /// Draws discs with the gaps between neighbours filled: what is nearer to a disc than [`GROWTH`]
    /// radii, less what is then nearer to the outside than this.
    pub fn cover(&mut self, x: &[f32], y: &[f32], radius: &[f32], paint: &[u8], colours: &[u8]) {
        let Some(mut drawn) = Surface::new(self.image.width(), self.image.height()) else { return };
        drawn.clip = self.clip.clone();
        drawn.discs(x, y, radius, paint, colours);
        let (width, ends) = (self.image.width(), drawn.ends());
        let [nx, ny] = [0, 1].map(|c| (ends[c + 2] - ends[c]).max(0) as usize);
        let at =
            |k: usize| (ends[1] as usize + k / nx) * width as usize + ends[0] as usize + k % nx;
        let mean = radius.iter().sum::<f32>() / radius.len().max(1) as f32;
        let mut depth = vec![0f32; drawn.image.pixels().len()];
        for ((&x, &y), &r) in x.iter().zip(y).zip(radius) {
            disc(width, ends, [x, y], r, |at, cover| {
                if cover > 0.0 {
                    depth[at] = GROWTH * r.max(mean);
                }
            });
        }
        // The nearest pixel of a disc, and whether its disc reaches so far when it grows.
        let pixels = drawn.image.pixels_mut();
        let filled = |k: usize| pixels[at(k)].alpha() >= 128;
        let mut far: Vec<u16> = (0..nx * ny).map(|k| if filled(k) { 0 } else { FAR }).collect();
        let mut source: Vec<usize> = (0..nx * ny).collect();
        spread(nx, &mut far, &mut source);
        let reach: Vec<f32> = source.iter().map(|&k| 3.0 * depth[at(k)]).collect();
        let within = |k: usize| far[k] != FAR && f32::from(far[k]) <= reach[k];
        let mut inside: Vec<u16> = (0..nx * ny).map(|k| if within(k) { FAR } else { 0 }).collect();
        spread(nx, &mut inside, &mut (0..nx * ny).collect::<Vec<_>>());
        let opaque = |pixel: PremultipliedColorU8| {
            let c = pixel.demultiply();
            tiny_skia::ColorU8::from_rgba(c.red(), c.green(), c.blue(), 255).premultiply()
        };
        for k in 0..nx * ny {
            if f32::from(inside[k]) > reach[k] {
                pixels[at(k)] = opaque(pixels[at(source[k])]);
            } else if far[k] > 0 {
                pixels[at(k)] = PremultipliedColorU8::TRANSPARENT;
            }
        }
        let mask = self.clip.as_ref().map(|c| &c.1);
        let paint = PixmapPaint::default();
        self.image.draw_pixmap(0, 0, drawn.image.as_ref(), &paint, Transform::identity(), mask);
    }

    /// Draws discs; disc `k` has the colour `colours[3 paint[k]..]`.
    pub fn discs(&mut self, x: &[f32], y: &[f32], radius: &[f32], paint: &[u8], colours: &[u8]) {
        let (width, ends) = (self.image.width(), self.ends());
        let pixels = self.image.pixels_mut();
        for (((&x, &y), &r), &paint) in x.iter().zip(y).zip(radius).zip(paint) {
            let paint = 3 * usize::from(paint);
            let Some(colour) = colours.get(paint..paint + 3) else { continue };
            disc(width, ends, [x, y], r, |at, cover| blend(&mut pixels[at], colour, cover));
        }
    }

    /// Left, top, right and bottom end (pixels) of the part of the image to which drawing is restricted.
    fn ends(&self) -> [i32; 4] {
        let (width, height) = (self.image.width() as i32, self.image.height() as i32);
        let ends = self.clip.as_ref().map_or([0, 0, width, height], |c| c.0);
        [ends[0].max(0), ends[1].max(0), ends[2].min(width), ends[3].min(height)]
    }

    /// Draws an image of `nx` times `ny` pixels, smoothly scaled into a rectangle.
    pub fn image(&mut self, rgba: &[u8], [nx, ny]: [u32; 2], [x, y, w, h]: [f32; 4]) {
        let Some(mut part) = Pixmap::new(nx, ny) else { return };
        if rgba.len() != part.data().len() {
            return;
        }
        for (pixel, from) in part.pixels_mut().iter_mut().zip(rgba.as_chunks::<4>().0) {
            let [r, g, b, a] = *from;
            *pixel = tiny_skia::ColorU8::from_rgba(r, g, b, a).premultiply();
        }
        let paint = PixmapPaint { quality: FilterQuality::Bilinear, ..PixmapPaint::default() };
        let place = Transform::from_row(w / nx as f32, 0.0, 0.0, h / ny as f32, x, y);
        let mask = self.clip.as_ref().map(|c| &c.1);
        self.image.draw_pixmap(0, 0, part.as_ref(), &paint, place, mask);
    }

    /// Draws a polyline.
    pub fn line(&mut self, points: &[f32], width: f32, colour: &str) {
        let mut path = PathBuilder::new();
        for (k, [x, y]) in points.as_chunks::<2>().0.iter().enumerate() {
            if k == 0 { path.move_to(*x, *y) } else { path.line_to(*x, *y) }
        }
        self.stroke(path, width, colour, LineCap::Round);
    }

    /// Draws lines between pairs of points.
    pub fn segments(&mut self, points: &[f32], width: f32, colour: &str) {
        let mut path = PathBuilder::new();
        for [x0, y0, x1, y1] in points.as_chunks::<4>().0 {
            path.move_to(*x0, *y0);
            path.line_to(*x1, *y1);
        }
        self.stroke(path, width, colour, LineCap::Butt);
    }

    fn stroke(&mut self, path: PathBuilder, width: f32, colour: &str, line_cap: LineCap) {
        let Some(path) = path.finish() else { return };
        let stroke = Stroke { width, line_cap, line_join: LineJoin::Round, ..Stroke::default() };
        let mask = self.clip.as_ref().map(|c| &c.1);
        self.image.stroke_path(&path, &paint_of(colour), &stroke, Transform::identity(), mask);
    }

    /// Writes a text with its base line at `y`; `anchor` is `start`, `middle` or `end`.
    pub fn text(&mut self, text: &str, x: f32, y: f32, size: f32, colour: &str, anchor: &str) {
        let width = self.measure(text, size);
        let mut pen = match anchor {
            "middle" => x - 0.5 * width,
            "end" => x - width,
            _ => x,
        };
        let Rgb(rgb) = colour.parse().unwrap_or(Rgb([0; 3]));
        let (columns, rows) = (self.image.width(), self.image.height());
        let font = self.font.as_scaled(scale(&self.font, size));
        for character in text.chars() {
            let id = font.glyph_id(character);
            let glyph = id.with_scale_and_position(font.scale(), point(pen, y));
            pen += font.h_advance(id);
            let Some(outline) = font.outline_glyph(glyph) else { continue };
            let corner = outline.px_bounds().min;
            let pixels = self.image.pixels_mut();
            outline.draw(|i, j, cover| {
                let (i, j) = (corner.x as i64 + i64::from(i), corner.y as i64 + i64::from(j));
                if (0..i64::from(columns)).contains(&i) && (0..i64::from(rows)).contains(&j) {
                    blend(&mut pixels[(j * i64::from(columns) + i) as usize], &rgb, cover);
                }
            });
        }
    }

    /// Width of a text (pixels).
    pub fn measure(&self, text: &str, size: f32) -> f32 {
        let font = self.font.as_scaled(scale(&self.font, size));
        text.chars().map(|c| font.h_advance(font.glyph_id(c))).sum()
    }
}

/// The scale of a font size: the size of its em square (pixels).
fn scale(font: &FontRef, size: f32) -> PxScale {
    let em = font.units_per_em().unwrap_or(1000.0);
    PxScale::from(size * font.height_unscaled() / em)
}

/// Calls `visit` for the pixels of a disc within a part of an image of the given width, with the number
/// of the pixel and the fraction of it that the disc covers.
fn disc(width: u32, ends: [i32; 4], [x, y]: [f32; 2], r: f32, mut visit: impl FnMut(usize, f32)) {
    let r = r.max(0.5);
    let from = |v: f32, end: i32| ((v - r - 1.0).floor() as i32).max(end);
    let to = |v: f32, end: i32| ((v + r + 1.0).ceil() as i32).min(end);
    for j in from(y, ends[1])..to(y, ends[3]) {
        for i in from(x, ends[0])..to(x, ends[2]) {
            let apart = (i as f32 + 0.5 - x).hypot(j as f32 + 0.5 - y);
            visit((j * width as i32 + i) as usize, (r + 0.5 - apart).clamp(0.0, 1.0));
        }
    }
}

/// Distance of pixels for which none is known.
const FAR: u16 = 30_000;

/// Spreads distances, and the pixels from which they are measured, in an image of rows of `nx` pixels.
/// Distances are sums of steps to neighbours, of length 3 along the axes and 4 along diagonals, in thirds
/// of a pixel.
fn spread(nx: usize, far: &mut [u16], source: &mut [usize]) {
    let ny = far.len() / nx.max(1);
    let mut visit = |i: usize, j: usize, sign: i64| {
        let k = j * nx + i;
        for (dx, dy, step) in [(sign, 0, 3), (0, sign, 3), (-1, sign, 4), (1, sign, 4)] {
            let (x, y) = (i as i64 + dx, j as i64 + dy);
            if (0..nx as i64).contains(&x) && (0..ny as i64).contains(&y) {
                let near = y as usize * nx + x as usize;
                if far[near] + step < far[k] {
                    (far[k], source[k]) = (far[near] + step, source[near]);
                }
            }
        }
    };
    for j in 0..ny {
        (0..nx).for_each(|i| visit(i, j, -1));
    }
    for j in (0..ny).rev() {
        (0..nx).rev().for_each(|i| visit(i, j, 1));
    }
}

/// Mixes a colour into a pixel; `cover` is its fraction, 0 to 1.
fn blend(pixel: &mut PremultipliedColorU8, colour: &[u8], cover: f32) {
    if cover <= 0.0 {
        return;
    }
    let cover = cover.min(1.0);
    let mix = |old: u8, new: u8| {
        (f32::from(old) + cover * (f32::from(new) - f32::from(old))).round() as u8
    };
    let alpha = mix(pixel.alpha(), 255);
    let part = |old: u8, new: u8| mix(old, new).min(alpha);
    let (r, g, b) = (pixel.red(), pixel.green(), pixel.blue());
    let [nr, ng, nb] = [colour[0], colour[1], colour[2]];
    if let Some(mixed) =
        PremultipliedColorU8::from_rgba(part(r, nr), part(g, ng), part(b, nb), alpha)
    {
        *pixel = mixed;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pixel(surface: &Surface, x: usize, y: usize) -> [u8; 4] {
        let at = 4 * (y * surface.image.width() as usize + x);
        surface.rgba()[at..at + 4].try_into().unwrap()
    }

    #[test]
    fn colours_are_read() {
        assert_eq!("#10ff00".parse(), Ok(Rgb([16, 255, 0])));
        assert_eq!("rgb(1,2,3)".parse(), Ok(Rgb([1, 2, 3])));
        for text in ["", "#12", "rgb(1,2)", "red", "#gg0000"] {
            assert_eq!(text.parse::<Rgb>(), Err(()), "{text}");
        }
    }

    #[test]
    fn the_area_of_a_disc_is_right() {
        let mut surface = Surface::new(100, 100).unwrap();
        surface.fill(0.0, 0.0, 100.0, 100.0, "#000000");
        surface.discs(&[50.3], &[49.6], &[20.0], &[1], &[0, 0, 0, 255, 0, 0]);
        let sum: f64 = surface.rgba().as_chunks::<4>().0.iter().map(|p| f64::from(p[0])).sum();
        let area = std::f64::consts::PI * 400.0;
        assert!((sum / 255.0 / area - 1.0).abs() < 2e-3, "{sum}");
    }

    #[test]
    fn gaps_between_neighbours_are_filled_and_ends_stay() {
        let mut surface = Surface::new(120, 60).unwrap();
        let x: Vec<f32> = (0..5).map(|k| 20.0 + 15.0 * k as f32).collect();
        surface.cover(&x, &[30.0; 5], &[5.0; 5], &[0; 5], &[255, 0, 0]);
        let filled = |x: usize, y: usize| pixel(&surface, x, y)[3] > 0;
        // Discs of radius 5 at a distance of 15 leave gaps of 5.
        assert!((18..82).all(|x| filled(x, 30)));
        assert!(!filled(12, 30) && !filled(88, 30) && !filled(50, 22) && !filled(50, 38));
    }

    #[test]
    fn nothing_is_drawn_outside_the_clip() {
        let mut surface = Surface::new(40, 40).unwrap();
        surface.fill(0.0, 0.0, 40.0, 40.0, "#ffffff");
        surface.clip(10.0, 10.0, 20.0, 20.0);
        surface.discs(&[20.0], &[20.0], &[30.0], &[0], &[255, 0, 0]);
        surface.line(&[0.0, 20.0, 40.0, 20.0], 4.0, "#0000ff");
        surface.unclip();
        assert_eq!(pixel(&surface, 5, 20), [255, 255, 255, 255]);
        assert_eq!(pixel(&surface, 12, 12), [255, 0, 0, 255]);
        assert_eq!(pixel(&surface, 20, 20), [0, 0, 255, 255]);
    }

    #[test]
    fn texts_are_anchored() {
        let inked = |anchor: &str| {
            let mut surface = Surface::new(200, 40).unwrap();
            surface.fill(0.0, 0.0, 200.0, 40.0, "#ffffff");
            surface.text("time 12 ms", 100.0, 25.0, 14.0, "#000000", anchor);
            let dark = |x: usize| (0..40).any(|y| pixel(&surface, x, y)[0] < 128);
            ((0..100).filter(|&x| dark(x)).count(), (100..200).filter(|&x| dark(x)).count())
        };
        let ((a, b), (c, d), (e, f)) = (inked("start"), inked("middle"), inked("end"));
        assert!(a == 0 && b > 20 && c > 10 && d > 10 && e > 20 && f == 0);
    }
}
