//! This module writes CSV tables: a row for each particle, and for each sample of the fields.

use super::{ExportError, Frames, Instant, write_file};
use std::fmt::Write;
use std::path::Path;

/// Writes `particles_<n>.csv`, `fields_<n>.csv` and `stresses_<n>.csv`, and `frames.csv` with their times. Returns the
/// number of files.
pub(super) fn write(frames: &Frames, folder: &Path) -> Result<usize, ExportError> {
    let mut table = String::from("frame,time\n");
    let mut files = 1;
    for (n, instant) in frames.instants.iter().enumerate() {
        let _ = writeln!(table, "{n},{}", instant.time_s);
        let all = [
            ("particles", particles(instant, frames)),
            ("fields", fields(instant)),
            ("stresses", stresses(instant)),
        ];
        for (name, text) in all.into_iter().filter_map(|(name, text)| Some((name, text?))) {
            write_file(folder.join(format!("{name}_{n:05}.csv")), text)?;
            files += 1;
        }
    }
    write_file(folder.join("frames.csv"), table)?;
    Ok(files)
}

// Writing to a string cannot fail.
fn particles(instant: &Instant, frames: &Frames) -> Option<String> {
    let particles = instant.particles.as_ref()?;
    let mut text = String::from("x,y,material\n");
    for ([x, y], class) in particles.positions.iter().zip(&particles.class) {
        let name = frames.materials.get(usize::from(*class)).map_or("", String::as_str);
        let _ = writeln!(text, "{x},{y},{name}");
    }
    Some(text)
}

/// Stresses along surfaces, one row for each place: position along the surface and in space (m), normal and
/// shear stress (Pa).
fn stresses(instant: &Instant) -> Option<String> {
    instant.stresses.first()?;
    let mut text = String::from("surface,along,x,y,normal_x,normal_y,normal_stress,shear_stress\n");
    for surface in &instant.stresses {
        for p in &surface.points {
            let ([x, y], [nx, ny]) = (p.at, p.normal);
            let (name, along) = (&surface.name, p.along);
            let _ = writeln!(text, "{name},{along},{x},{y},{nx},{ny},{},{}", p.pressing, p.shear);
        }
    }
    Some(text)
}

fn fields(instant: &Instant) -> Option<String> {
    let first = instant.fields.first()?;
    let names: Vec<&str> = instant.fields.iter().map(|f| f.name.as_str()).collect();
    let mut text = format!("x,y,{}\n", names.join(","));
    for k in 0..first.nx * first.ny {
        let [x, y] = first.centre(k);
        let _ = write!(text, "{x},{y}");
        for field in &instant.fields {
            let _ = write!(text, ",{}", field.values[k]);
        }
        text.push('\n');
    }
    Some(text)
}
