//! This module draws the frames of runs headless, with the scripts of the light view, and writes
//! them as images or films.

use super::DRAWING;
use super::reel::{Ranges, Reel, widen};
use super::surface::Surface;
use crate::record::replace::{self, Kind, ReplaceError, may_replace};
use crate::results::later;
use rquickjs::{CatchResultExt, Context, Ctx, Function, Object, Runtime, TypedArray};
use serde::Serialize;
use std::cell::RefCell;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::rc::Rc;

/// Error of drawing or writing a film.
#[derive(Debug, thiserror::Error)]
pub enum FilmError {
    /// The size of the image is zero or too large.
    #[error("an image of {0} x {1} pixels cannot be made; choose a --width from 160 to 4096")]
    Size(u32, u32),
    /// The scripts fail.
    #[error("the frame cannot be drawn: {0}")]
    Script(String),
    /// A file is in the way, or cannot be written.
    #[error(transparent)]
    Replace(#[from] ReplaceError),
    /// A file cannot be encoded or written.
    #[error("{} cannot be written: {cause}", path.display())]
    Write {
        /// Path of the file.
        path: PathBuf,
        /// Description of the error.
        cause: String,
    },
    /// FFmpeg is needed and not there.
    #[error(
        "MP4 needs the program `ffmpeg`, which was not found; install it, or write a .gif or .png"
    )]
    NoFfmpeg,
    /// The name of the file tells no known format.
    #[error("{}: the format is not known; expected a name that ends in .gif, .mp4 or .png", .0.display())]
    Format(PathBuf),
}

/// What is drawn. The scripts have the same names (`LOOK` in `painter.js`).
#[derive(Clone, Debug, Serialize)]
pub struct Look {
    /// Whether the background is dark.
    pub dark: bool,
    /// Whether particles are drawn.
    pub particles: bool,
    /// Colour of particles: `material` or the name of a field.
    pub colour: String,
    /// Field behind the particles; empty for none.
    pub field: String,
    /// Whether dye lines are drawn.
    pub dye: bool,
}

/// Draws frames of runs side by side.
pub struct Studio {
    /// Times (s) of the frames.
    pub times: Vec<f64>,
    surface: Rc<RefCell<Surface>>,
    size: [u32; 2],
    reels: Vec<Reel>,
    context: Context,
}

impl Studio {
    /// A studio for runs, of which the first has the times of the film; `size` in pixels.
    ///
    /// # Errors
    /// The size is not possible, or the scripts cannot be loaded.
    pub fn new(reels: Vec<Reel>, look: &Look, size: [u32; 2]) -> Result<Studio, FilmError> {
        let wrong_size = FilmError::Size(size[0], size[1]);
        let surface = Surface::new(size[0], size[1]).ok_or(wrong_size)?;
        let surface = Rc::new(RefCell::new(surface));
        let failed = |e: rquickjs::Error| FilmError::Script(e.to_string());
        let context = Context::full(&Runtime::new().map_err(failed)?).map_err(failed)?;
        let script = |e: serde_json::Error| FilmError::Script(e.to_string());
        let descriptions: Vec<_> = reels.iter().map(|r| &r.description).collect();
        let mut ranges = Ranges::new();
        for (name, range) in reels.iter().flat_map(|r| &r.ranges) {
            widen(&mut ranges, name, *range);
        }
        let setup = format!(
            "const runs = {}; const look = {{ ...LOOK, ...{}, range: {} }};\n\
             function drawFrame(frames, times, end) {{\n\
               const panels = runs.map((description, i) => ({{ description, end, time: times[i],\n\
                 frame: decodeFrame(new Uint8Array(frames[i]), description) }}));\n\
               paintPanels(surface, panels, look, [{}, {}], unit);\n\
             }}",
            serde_json::to_string(&descriptions).map_err(script)?,
            serde_json::to_string(look).map_err(script)?,
            serde_json::to_string(&ranges).map_err(script)?,
            size[0],
            size[1],
        );
        // Text has the size that it has in a picture of 720 pixels.
        let unit = f64::from(size[0].min(size[1])) / 720.0;
        context.with(|ctx| {
            let loaded = bind(&ctx, &surface)
                .and_then(|()| ctx.globals().set("unit", unit))
                .and_then(|()| ctx.eval::<(), _>(SURFACE))
                .and_then(|()| DRAWING.iter().try_for_each(|s| ctx.eval::<(), _>(*s)))
                .and_then(|()| ctx.eval::<(), _>(setup));
            loaded.catch(&ctx).map_err(|e| FilmError::Script(e.to_string()))
        })?;
        let times = reels.first().map(|r| r.frames.iter().map(|f| f.0).collect());
        Ok(Studio { times: times.unwrap_or_default(), surface, size, reels, context })
    }

    /// Draws frame `k` and passes the image on: red, green, blue and opacity of each pixel.
    ///
    /// # Errors
    /// The scripts fail.
    pub fn draw(&self, k: usize, mut take: impl FnMut(&[u8])) -> Result<(), FilmError> {
        let time = self.times[k];
        let end = self.times.last().copied().unwrap_or(time);
        self.context.with(|ctx| {
            let shown = || -> rquickjs::Result<()> {
                let (mut frames, mut times) = (vec![], vec![]);
                for reel in &self.reels {
                    let next = reel.frames.partition_point(|f| !later(f.0, time));
                    let (at, bytes) = &reel.frames[next.saturating_sub(1)];
                    frames.push(TypedArray::<u8>::new(ctx.clone(), bytes.as_slice())?);
                    times.push(*at);
                }
                let draw: Function = ctx.globals().get("drawFrame")?;
                draw.call((frames, times, end))
            };
            shown().catch(&ctx).map_err(|e| FilmError::Script(e.to_string()))
        })?;
        take(self.surface.borrow().rgba());
        Ok(())
    }

    /// Writes a film of all frames; the ending of the name tells the format. Returns the files.
    ///
    /// # Errors
    /// The format is unknown, FFmpeg is missing, or a file cannot be written.
    pub fn write(
        &self,
        path: &Path,
        fps: f64,
        each: &mut dyn FnMut(usize),
    ) -> Result<Vec<PathBuf>, FilmError> {
        match path.extension().and_then(|e| e.to_str()) {
            Some("png") => self.images(path, each),
            Some("gif") => self.gif(path, fps, each),
            Some("mp4") => self.mp4(path, fps, each),
            _ => Err(FilmError::Format(path.to_owned())),
        }
    }

    /// Writes one image per frame: `flow.png` gives `flow_00000.png`, ...
    fn images(&self, path: &Path, each: &mut dyn FnMut(usize)) -> Result<Vec<PathBuf>, FilmError> {
        let stem = path.with_extension("");
        let mut files = vec![];
        for k in 0..self.times.len() {
            let file = replace::beside(&stem, &format!("_{k:05}.png"));
            let mut encoded = Ok(vec![]);
            self.draw(k, |rgba| encoded = png(rgba, self.size))?;
            let bytes = encoded.map_err(|e| unwritten(&file, &e))?;
            replace::write(&file, bytes, Kind::Png)?;
            files.push(file);
            each(k);
        }
        Ok(files)
    }

    fn gif(
        &self,
        path: &Path,
        fps: f64,
        each: &mut dyn FnMut(usize),
    ) -> Result<Vec<PathBuf>, FilmError> {
        /// Effort of the choice of 256 colours, 1 (most) to 30.
        const SPEED: i32 = 10;
        may_replace(path, Kind::Gif)?;
        let side =
            |n: u32| u16::try_from(n).map_err(|_| FilmError::Size(self.size[0], self.size[1]));
        let [w, h] = [side(self.size[0])?, side(self.size[1])?];
        let mut bytes = vec![];
        let mut encoder =
            gif::Encoder::new(&mut bytes, w, h, &[]).map_err(|e| unwritten(path, &e))?;
        encoder.set_repeat(gif::Repeat::Infinite).map_err(|e| unwritten(path, &e))?;
        for k in 0..self.times.len() {
            let mut written = Ok(());
            self.draw(k, |rgba| {
                let mut frame = gif::Frame::from_rgba_speed(w, h, &mut rgba.to_vec(), SPEED);
                // In hundredths of a second; viewers do not go below two.
                frame.delay = (100.0 / fps).round().clamp(2.0, 1000.0) as u16;
                written = encoder.write_frame(&frame);
            })?;
            written.map_err(|e| unwritten(path, &e))?;
            each(k);
        }
        drop(encoder);
        replace::write(path, bytes, Kind::Gif)?;
        Ok(vec![path.to_owned()])
    }

    fn mp4(
        &self,
        path: &Path,
        fps: f64,
        each: &mut dyn FnMut(usize),
    ) -> Result<Vec<PathBuf>, FilmError> {
        replace::make(path, Kind::Mp4, |part| self.encode(part, fps, each))?;
        Ok(vec![path.to_owned()])
    }

    /// Sends all frames to FFmpeg.
    fn encode(&self, part: &Path, fps: f64, each: &mut dyn FnMut(usize)) -> Result<(), FilmError> {
        let [w, h] = self.size;
        let mut ffmpeg: Child = Command::new("ffmpeg")
            .args(["-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgba"])
            .args(["-s", &format!("{w}x{h}"), "-r", &fps.to_string(), "-i", "-"])
            // Players need an even size and this layout of colours.
            .args([
                "-vf",
                "pad=ceil(iw/2)*2:ceil(ih/2)*2",
                "-c:v",
                "libx264",
                "-pix_fmt",
                "yuv420p",
            ])
            .args(["-movflags", "+faststart", "-f", "mp4"])
            .arg(part)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|e| match e.kind() {
                std::io::ErrorKind::NotFound => FilmError::NoFfmpeg,
                _ => unwritten(part, &e),
            })?;
        let mut outcome = Ok(());
        if let Some(mut pipe) = ffmpeg.stdin.take() {
            for k in 0..self.times.len() {
                let mut sent = Ok(());
                outcome = self.draw(k, |rgba| sent = pipe.write_all(rgba));
                // If FFmpeg has ended, it says why.
                if outcome.is_err() || sent.is_err() {
                    break;
                }
                each(k);
            }
        }
        let ended = ffmpeg.wait_with_output().map_err(|e| unwritten(part, &e))?;
        outcome?;
        match ended.status.success() {
            true => Ok(()),
            false => Err(unwritten(part, &String::from_utf8_lossy(&ended.stderr).trim())),
        }
    }
}

fn unwritten(path: &Path, cause: &dyn std::fmt::Display) -> FilmError {
    FilmError::Write { path: path.to_owned(), cause: cause.to_string() }
}

/// Encodes an image.
fn png(rgba: &[u8], [w, h]: [u32; 2]) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = vec![];
    let mut encoder = png::Encoder::new(&mut bytes, w, h);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(rgba)?;
    Ok(bytes)
}

/// The surface as the scripts call it. The functions of this program take plain arrays.
const SURFACE: &str = "
    const plain = (f) => (...all) => f(...all.map((a) => (ArrayBuffer.isView(a) ? Array.from(a) : a)));
    const surface = Object.fromEntries(Object.entries(native).map(([name, f]) => [name, plain(f)]));";

/// Gives the scripts the object `native` with the functions that `painter.js` lists.
fn bind(ctx: &Ctx, surface: &Rc<RefCell<Surface>>) -> rquickjs::Result<()> {
    let object = Object::new(ctx.clone())?;
    let s = surface.clone();
    let fill = move |x, y, w, h, colour: String| s.borrow_mut().fill(x, y, w, h, &colour);
    object.set("fill", Function::new(ctx.clone(), fill)?)?;
    let s = surface.clone();
    let clip = move |x, y, w, h| s.borrow_mut().clip(x, y, w, h);
    object.set("clip", Function::new(ctx.clone(), clip)?)?;
    let s = surface.clone();
    object.set("unclip", Function::new(ctx.clone(), move || s.borrow_mut().unclip())?)?;
    let s = surface.clone();
    let cover = move |x: Vec<f32>, y: Vec<f32>, r: Vec<f32>, paint: Vec<u8>, colours: Vec<u8>| {
        s.borrow_mut().cover(&x, &y, &r, &paint, &colours);
    };
    object.set("cover", Function::new(ctx.clone(), cover)?)?;
    let s = surface.clone();
    let discs = move |x: Vec<f32>, y: Vec<f32>, r: Vec<f32>, paint: Vec<u8>, colours: Vec<u8>| {
        s.borrow_mut().discs(&x, &y, &r, &paint, &colours);
    };
    object.set("discs", Function::new(ctx.clone(), discs)?)?;
    let s = surface.clone();
    let image = move |rgba: Vec<u8>, nx, ny, x, y, w, h| {
        s.borrow_mut().image(&rgba, [nx, ny], [x, y, w, h]);
    };
    object.set("image", Function::new(ctx.clone(), image)?)?;
    let s = surface.clone();
    let line = move |points: Vec<f32>, width, colour: String| {
        s.borrow_mut().line(&points, width, &colour);
    };
    object.set("line", Function::new(ctx.clone(), line)?)?;
    let s = surface.clone();
    let segments = move |points: Vec<f32>, width, colour: String| {
        s.borrow_mut().segments(&points, width, &colour);
    };
    object.set("segments", Function::new(ctx.clone(), segments)?)?;
    let s = surface.clone();
    let text = move |text: String, x, y, size, colour: String, anchor: String| {
        s.borrow_mut().text(&text, x, y, size, &colour, &anchor);
    };
    object.set("text", Function::new(ctx.clone(), text)?)?;
    let s = surface.clone();
    let measure = move |text: String, size| s.borrow().measure(&text, size);
    object.set("measure", Function::new(ctx.clone(), measure)?)?;
    ctx.globals().set("native", object)
}
