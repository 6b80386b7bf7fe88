//! This module describes a run for the light view: everything that is constant during the run.

use crate::frame::{Outline, Quantity, RunInfo};
use crate::record::colour::ColourScale;
use serde::Serialize;

/// Constant data of a run, as JSON for the scripts. Lengths are in metres.
#[derive(Clone, Debug, Serialize)]
pub struct Description {
    /// Name of the run.
    pub name: String,
    /// Lower left and upper right corner of the domain.
    domain: [[f32; 2]; 2],
    /// Whether x is the distance from the axis; pictures then show the mirror image too.
    round: bool,
    walls: Vec<Line>,
    gauges: Vec<Line>,
    materials: Vec<Material>,
    /// Fields, in the order of the numbers in packed frames.
    fields: Vec<Field>,
    /// Colours of a scale from 0 to 255, as red, green and blue in turn.
    palette: Vec<u8>,
    /// The same of a scale that is symmetric about zero.
    signed_palette: Vec<u8>,
}

#[derive(Clone, Debug, Serialize)]
struct Line {
    name: String,
    points: Vec<[f32; 2]>,
}

#[derive(Clone, Debug, Serialize)]
struct Material {
    name: String,
    rgb: [u8; 3],
    drawn: bool,
}

#[derive(Clone, Debug, Serialize)]
struct Field {
    name: String,
    unit: String,
    signed: bool,
}

impl Description {
    /// Describes a run.
    pub fn new(info: &RunInfo) -> Description {
        let lines = |list: &[Outline]| {
            let line = |o: &Outline| Line { name: o.name.clone(), points: o.points.clone() };
            list.iter().map(line).collect()
        };
        let field =
            |q: &Quantity| Field { name: q.name.clone(), unit: q.unit.clone(), signed: q.signed };
        Description {
            name: info.name.clone(),
            domain: [info.domain.min, info.domain.max],
            round: info.round,
            walls: lines(&info.walls),
            gauges: lines(&info.gauges),
            materials: info
                .materials
                .iter()
                .map(|m| Material { name: m.name.clone(), rgb: m.rgb, drawn: m.drawn })
                .collect(),
            fields: info.fields.iter().map(field).collect(),
            palette: palette(ColourScale::new([0.0, 255.0], false), 0.0, 1.0),
            signed_palette: palette(ColourScale::new([-1.0, 1.0], true), -1.0, 2.0 / 255.0),
        }
    }

    /// Height over width of a picture.
    pub fn shape(&self) -> f64 {
        let [low, high] = self.domain;
        let width = if self.round { 2.0 * high[0] } else { high[0] - low[0] };
        f64::from((high[1] - low[1]) / width)
    }

    /// Distance of two neighbouring packed positions (m), along the longer side.
    pub fn resolution(&self) -> f32 {
        let [low, high] = self.domain;
        (high[0] - low[0]).max(high[1] - low[1]) / f32::from(u16::MAX)
    }
}

/// 256 colours of a scale, at `low + k step`.
fn palette(scale: ColourScale, low: f32, step: f32) -> Vec<u8> {
    (0..256).flat_map(|k| scale.color(low + step * k as f32)[..3].to_vec()).collect()
}
