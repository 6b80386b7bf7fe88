//! This module finds what can be dragged in the picture of a scene, and moves it in the text.

use super::super::protocol::Answer;
use crate::record::number::nice_step;
use crate::scene::{self, Quantity, Scene, SceneSource, Scope, Shape};
use serde::{Deserialize, Serialize};
use toml_edit::{Array, DocumentMut, Item, Value};

/// Relative difference below which a coordinate counts as not moved.
const SAME: f64 = 1e-9;
/// Steps of the domain's size to which dragged coordinates are rounded.
const ROUNDING: f64 = 500.0;
/// Number of ticks of an axis, of which [`nice_step`] gives the spacing.
const STEPS_OF_AXIS: f64 = 10.0;

/// Something that can be dragged: a segment between two points, or a rectangle between its lower
/// left and upper right corner.
#[derive(Clone, Debug, Serialize)]
pub struct Handle {
    /// Name shown to the user.
    pub name: String,
    #[serde(flatten)]
    place: Place,
}

/// Which part of the scene, and where it is.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Place {
    key: Key,
    /// Number in the list; 0 for the domain.
    index: usize,
    /// Two points (m).
    points: [[f64; 2]; 2],
}

/// Parts of a scene that can be dragged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Key {
    Domain,
    Regions,
    Blocks,
    Walls,
    Gauges,
}

impl Key {
    fn name(self) -> &'static str {
        match self {
            Key::Domain => "domain",
            Key::Regions => "regions",
            Key::Blocks => "blocks",
            Key::Walls => "walls",
            Key::Gauges => "gauges",
        }
    }

    /// Path, below the part, and component of the two points' coordinates.
    fn coordinates(self) -> [[(&'static [&'static str], usize); 2]; 2] {
        match self {
            Key::Walls | Key::Gauges => {
                [[(&["from"], 0), (&["from"], 1)], [(&["to"], 0), (&["to"], 1)]]
            }
            Key::Domain | Key::Blocks => [[(&["x"], 0), (&["y"], 0)], [(&["x"], 1), (&["y"], 1)]],
            Key::Regions => {
                const X: &[&str] = &["shape", "rectangle", "x"];
                const Y: &[&str] = &["shape", "rectangle", "y"];
                [[(X, 0), (Y, 0)], [(X, 1), (Y, 1)]]
            }
        }
    }
}

/// Everything in a scene that can be dragged, with its place.
pub fn handles(scene: &Scene) -> Vec<Handle> {
    let Ok(scope) = Scope::new(scene) else { return vec![] };
    let pair = |q: &[Quantity; 2]| Some([q[0].eval(&scope).ok()?, q[1].eval(&scope).ok()?]);
    let segment = |key, index, name: &str, from, to| {
        let points = [pair(from)?, pair(to)?];
        Some(Handle { name: name.into(), place: Place { key, index, points } })
    };
    let rectangle = |key, index, name: &str, x, y| {
        let ([x0, x1], [y0, y1]) = (pair(x)?, pair(y)?);
        let points = [[x0, y0], [x1, y1]];
        Some(Handle { name: name.into(), place: Place { key, index, points } })
    };
    let domain = rectangle(Key::Domain, 0, "domain", &scene.domain.x, &scene.domain.y);
    let regions = scene.regions.iter().enumerate().filter_map(|(k, r)| match &r.shape {
        Shape::Rectangle { x, y } => rectangle(Key::Regions, k, &r.material, x, y),
        _ => None,
    });
    let blocks = scene.blocks.iter().enumerate();
    let blocks = blocks
        .filter_map(|(k, b)| rectangle(Key::Blocks, k, &b.name, b.x.as_ref()?, b.y.as_ref()?));
    let walls = scene.walls.iter().enumerate();
    let walls = walls.filter_map(|(k, w)| segment(Key::Walls, k, &w.name, &w.from, &w.to));
    let gauges = scene.gauges.iter().enumerate();
    let gauges = gauges
        .filter_map(|(k, g)| segment(Key::Gauges, k, &g.name, g.from.as_ref()?, g.to.as_ref()?));
    domain.into_iter().chain(regions).chain(blocks).chain(walls).chain(gauges).collect()
}

/// The text with a part at another place, and what was done. Only the coordinates that differ are
/// written; comments and order are kept.
pub fn moved(text: &str, to: &Place) -> Result<(String, String), Answer> {
    let refuse = |why: String| Answer::no(why, "correct the errors of the text first");
    let scene =
        scene::parse(&SceneSource::new("the text", text)).map_err(|e| refuse(e.headline()))?;
    let all = handles(&scene);
    let same = |h: &&Handle| h.place.key == to.key && h.place.index == to.index;
    let handle = all.iter().find(same).ok_or_else(|| refuse("there is no such part".into()))?;
    let before = handle.place.points;
    let size = all.first().map_or(1.0, |domain| {
        let [low, high] = domain.place.points;
        (high[0] - low[0]).max(high[1] - low[1])
    });
    let mut doc: DocumentMut =
        text.parse().map_err(|e: toml_edit::TomlError| refuse(e.to_string()))?;
    let mut changes = vec![];
    for (p, coordinates) in to.key.coordinates().iter().enumerate() {
        for (c, (path, component)) in coordinates.iter().enumerate() {
            let (wanted, now) = (to.points[p][c], before[p][c]);
            if !wanted.is_finite() || (wanted - now).abs() <= SAME * size {
                continue;
            }
            let value = rounded(wanted, size);
            let array = part(&mut doc, to.key, to.index)
                .and_then(|item| path.iter().try_fold(item, |item, key| item.get_mut(key)))
                .and_then(Item::as_array_mut)
                .ok_or_else(|| {
                    refuse(format!("`{}` is not written in the text", path.join(".")))
                })?;
            changes.push(format!("{}[{component}] = {value}", path.join(".")));
            set(array, *component, value);
        }
    }
    let said = match changes.is_empty() {
        true => format!("{} is where it was", handle.name),
        false => format!("{} of {}: {}", to.key.name(), handle.name, changes.join(", ")),
    };
    Ok((doc.to_string(), said))
}

/// Rounds to a step of 1, 2 or 5 times a power of ten below the size of the domain.
fn rounded(value: f64, size: f64) -> f64 {
    let step = nice_step(size * STEPS_OF_AXIS / ROUNDING);
    let steps = (value / step).round();
    // Divided by a whole number where possible, so that decimals are short.
    let inverse = (1.0 / step).round();
    if step < 1.0 && (inverse * step - 1.0).abs() < 1e-9 { steps / inverse } else { steps * step }
}

/// The table of a part.
fn part(doc: &mut DocumentMut, key: Key, index: usize) -> Option<&mut Item> {
    let item = doc.get_mut(key.name())?;
    match key {
        Key::Domain => Some(item),
        _ => item.get_mut(index),
    }
}

/// Replaces a number or expression in an array; the spaces around it are kept.
fn set(array: &mut Array, k: usize, value: f64) {
    if let Some(old) = array.get_mut(k) {
        let decor = old.decor().clone();
        let whole = value.fract() == 0.0 && value.abs() < 1e15;
        *old = if whole { Value::from(value as i64) } else { Value::from(value) };
        *old.decor_mut() = decor;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::presets;

    fn handle(text: &str, name: &str) -> Place {
        let scene = scene::parse(&SceneSource::new("x", text)).expect("a scene");
        handles(&scene).into_iter().find(|h| h.name == name).expect("a handle").place
    }

    #[test]
    fn a_dragged_gauge_changes_its_own_numbers_only() {
        let silo = presets::find("silo").expect("a preset");
        let mut to = handle(silo.text(), "outflow");
        assert_eq!(to.points, [[-0.5, 3.0], [0.5, 3.0]]);
        to.points[1][0] = 0.80312;
        let (text, said) = moved(silo.text(), &to).expect("moved");
        let differ: Vec<_> =
            silo.text().lines().zip(text.lines()).filter(|(a, b)| a != b).collect();
        assert_eq!(
            differ,
            [(r#"to = ["aperture/2", "3*aperture"]"#, r#"to = [0.8, "3*aperture"]"#)]
        );
        assert_eq!(said, "gauges of outflow: to[0] = 0.8");
        assert_eq!(handle(&text, "outflow").points[1], [0.8, 3.0]);
    }

    #[test]
    fn what_is_not_dragged_is_not_rounded() {
        let silo = presets::find("silo").expect("a preset");
        let text = silo.text().replace(r#""fill_height*aperture""#, r#""20/3""#);
        let mut to = handle(&text, "grains");
        to.points[0][0] = -1.5;
        let (moved, _) = moved(&text, &to).expect("moved");
        assert!(moved.contains(r#""20/3""#), "{moved}");
    }

    #[test]
    fn rectangles_and_the_domain_move_too() {
        let silo = presets::find("silo").expect("a preset");
        for (name, at) in [("grains", [-1.5, 3.0]), ("domain", [-4.0, 0.0])] {
            let mut to = handle(silo.text(), name);
            to.points[0] = at;
            let (text, _) = moved(silo.text(), &to).expect("moved");
            assert_eq!(handle(&text, name).points[0], at, "{text}");
        }
    }

    #[test]
    fn dragged_coordinates_are_short_numbers() {
        assert_eq!(rounded(0.123456, 8.0), 0.12);
        assert_eq!(rounded(1234.4, 50_000.0), 1200.0);
    }
}
