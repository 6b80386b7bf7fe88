//! This module resolves `[recording]`, the contents and colours of frames.

use super::values::Result;
use crate::plan::FrameContent;
use crate::scene::{Scene, SceneError};
use crate::space::mesh::Mesh;

/// Okabe-Ito colours, which colour-blind readers can distinguish.
const PALETTE: [[u8; 3]; 8] = [
    [230, 159, 0],
    [86, 180, 233],
    [0, 158, 115],
    [213, 94, 0],
    [204, 121, 167],
    [0, 114, 178],
    [240, 228, 66],
    [120, 120, 120],
];
const BACKGROUND_COLOUR: [u8; 3] = [190, 196, 204];
const MARK_COLOUR: [u8; 3] = [0, 60, 200];

/// Largest number of glyphs along the longer side of the domain.
const MOST_GLYPHS: f64 = 2000.0;

/// Contents and colours of the frames of the recording.
pub(super) fn content(scene: &Scene, mesh: &Mesh) -> Result<FrameContent> {
    let mut colours = Vec::new();
    let mut free = PALETTE.iter().cycle();
    for (name, m) in &scene.materials {
        colours.push(match &m.colour {
            Some(text) => hex_colour(text).ok_or_else(|| {
                SceneError::of_key(
                    format!("materials.{name}.colour"),
                    format!("material `{name}`: colour is {text:?}"),
                    "give six hexadecimal digits: \"#e69f00\"",
                )
            })?,
            None if m.background => BACKGROUND_COLOUR,
            None => *free.next().unwrap_or(&PALETTE[0]),
        });
    }
    colours.push(MARK_COLOUR);
    let r = &scene.recording;
    let sizes = [mesh.x.length(), mesh.y.length()];
    let along = f64::from(r.glyphs) * (sizes[1] / sizes[0]).max(1.0);
    if along > MOST_GLYPHS {
        return Err(SceneError::of_key(
            "recording.glyphs",
            format!("recording.glyphs would give {along:.0} strokes along the longer side"),
            format!("give fewer: at most {MOST_GLYPHS}"),
        ));
    }
    Ok(FrameContent {
        colour_by: r.colour_by,
        max_particles: r.max_particles as usize,
        fields: r.fields.clone(),
        glyphs: r.glyphs,
        colours,
    })
}

fn hex_colour(text: &str) -> Option<[u8; 3]> {
    let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.is_ascii())?;
    let value = u32::from_str_radix(digits, 16).ok()?;
    Some([(value >> 16) as u8, (value >> 8) as u8, value as u8])
}
