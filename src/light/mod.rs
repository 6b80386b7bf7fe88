//! This module makes the light view: a picture of the flow that the program's own scripts draw, in
//! the page of the explorer, in reports and in films.
//!
//! All of them get the same data, a [`Description`] of the run and packed frames ([`pack`]), and
//! the same scripts (`assets/light`): `frame.js` decodes, `painter.js` draws on an abstract surface.
//! In pages the surface is a canvas; in [`film`] it is [`surface`], and the scripts run in QuickJS.

mod columns;
mod describe;
pub mod film;
pub mod pack;
pub mod reel;
pub mod report;
mod surface;

pub use describe::Description;

/// Scripts that decode and draw, in the order in which they are loaded.
pub const DRAWING: [&str; 2] =
    [include_str!("../../assets/light/frame.js"), include_str!("../../assets/light/painter.js")];

/// Script of the surface of a page: a canvas, with WebGL for the particles.
pub const CANVAS: &str = include_str!("../../assets/light/canvas.js");
/// Script of the controls of the view.
pub const VIEW: &str = include_str!("../../assets/light/view.js");
/// Colours, controls and curves of all pages.
pub const BASE_STYLE: &str = include_str!("../../assets/light/base.css");
/// Style of the view.
pub const STYLE: &str = include_str!("../../assets/light/light.css");
