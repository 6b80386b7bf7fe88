//! This module finds what can be dragged in the picture of a scene, and moves it in the text.

use super::super::protocol::Answer;
use crate::plan::boundary::SIDES;
use crate::record::number::nice_step;
use crate::scene::{self, Quantity, Scene, SceneSource, Scope, Shape, SolidShape};
use serde::{Deserialize, Serialize};
use toml_edit::{DocumentMut, Item, Value};

/// Relative difference below which a coordinate counts as not moved.
const SAME: f64 = 1e-9;
/// Steps of the domain's size to which dragged coordinates are rounded.
const ROUNDING: f64 = 500.0;
/// Number of ticks of an axis, of which [`nice_step`] gives the spacing.
const STEPS_OF_AXIS: f64 = 10.0;

/// Something that can be dragged.
#[derive(Clone, Debug, Serialize)]
pub struct Handle {
    /// Name shown to the user.
    pub name: String,
    /// What it is, such as `gauge`.
    what: &'static str,
    /// What the user takes hold of.
    grips: Vec<Grip>,
    #[serde(flatten)]
    place: Place,
}

/// Which part of the scene, and where it is.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Place {
    /// Path of the part in the text, such as `gauges[0]`.
    id: String,
    /// Points (m) from which its numbers follow.
    points: Vec<[f64; 2]>,
}

/// A place in the picture that moves some points of a part.
#[derive(Clone, Debug, Serialize)]
struct Grip {
    /// Name shown to the user.
    name: String,
    /// Points that move; the grip is at the first.
    moves: Vec<usize>,
    /// Component along which it moves; `None`: both. It is then in the middle of all points along the
    /// other.
    along: Option<usize>,
}

/// A step of the path of a number in the text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    Key(&'static str),
    Index(usize),
}

/// A number of the text, and how it follows from the points of its part.
struct Slot {
    /// Path below the part.
    path: Vec<Step>,
    number: Number,
}

/// How a number follows from the points of a part.
#[derive(Clone, Copy)]
enum Number {
    /// A component of a point.
    Coordinate(usize, usize),
    /// The distance of the second point from the first, along x.
    Radius,
}

impl Number {
    fn of(self, points: &[[f64; 2]]) -> f64 {
        match self {
            Number::Coordinate(point, c) => points[point][c],
            Number::Radius => points[1][0] - points[0][0],
        }
    }
}

/// A part with its numbers.
struct Part {
    handle: Handle,
    path: Vec<Step>,
    slots: Vec<Slot>,
}

/// A path as it is written.
fn written(path: &[Step]) -> String {
    let mut text = String::new();
    for step in path {
        match step {
            Step::Key(key) if text.is_empty() => text += key,
            Step::Key(key) => text += &format!(".{key}"),
            Step::Index(k) => text += &format!("[{k}]"),
        }
    }
    text
}

fn grip(name: impl Into<String>, moves: &[usize], along: Option<usize>) -> Grip {
    Grip { name: name.into(), moves: moves.to_vec(), along }
}

/// The slot of a component of a point that is written as an array at `keys`.
fn component(keys: &[Step], k: usize, point: usize, c: usize) -> Slot {
    let path = keys.iter().copied().chain([Step::Index(k)]).collect();
    Slot { path, number: Number::Coordinate(point, c) }
}

/// Points, grips and numbers of a part.
type Form = (Vec<[f64; 2]>, Vec<Grip>, Vec<Slot>);

/// Evaluates what parts consist of.
struct Forms<'a> {
    scope: &'a Scope,
}

impl Forms<'_> {
    fn pair(&self, q: &[Quantity; 2]) -> Option<[f64; 2]> {
        Some([q[0].eval(self.scope).ok()?, q[1].eval(self.scope).ok()?])
    }

    fn segment(&self, from: &[Quantity; 2], to: &[Quantity; 2]) -> Option<Form> {
        let grips = vec![grip("first end", &[0], None), grip("second end", &[1], None)];
        let slots = (0..4).map(|k| {
            let (point, c) = (k / 2, k % 2);
            component(&[Step::Key(["from", "to"][point])], c, point, c)
        });
        Some((vec![self.pair(from)?, self.pair(to)?], grips, slots.collect()))
    }

    fn rectangle(&self, keys: &[Step], x: &[Quantity; 2], y: &[Quantity; 2]) -> Option<Form> {
        let ([x0, x1], [y0, y1]) = (self.pair(x)?, self.pair(y)?);
        let grips = vec![
            grip("left side", &[0], Some(0)),
            grip("right side", &[1], Some(0)),
            grip("lower side", &[0], Some(1)),
            grip("upper side", &[1], Some(1)),
        ];
        let slots = (0..4).map(|k| {
            let (point, c) = (k / 2, k % 2);
            let key = Step::Key(["x", "y"][c]);
            component(&[keys, &[key]].concat(), point, point, c)
        });
        Some((vec![[x0, y0], [x1, y1]], grips, slots.collect()))
    }

    fn polygon(&self, corners: &[[Quantity; 2]]) -> Option<Form> {
        let points = corners.iter().map(|p| self.pair(p)).collect::<Option<Vec<_>>>()?;
        let count = points.len();
        let grips = (0..count).map(|k| grip(format!("corner {}", k + 1), &[k], None));
        let slots = (0..2 * count).map(|k| {
            let keys = [Step::Key("shape"), Step::Key("polygon"), Step::Index(k / 2)];
            component(&keys, k % 2, k / 2, k % 2)
        });
        Some((points, grips.collect(), slots.collect()))
    }

    fn circle(&self, centre: &[Quantity; 2], radius: &Quantity) -> Option<Form> {
        let [x, y] = self.pair(centre)?;
        let points = vec![[x, y], [x + radius.eval(self.scope).ok()?, y]];
        let grips = vec![grip("centre", &[0, 1], None), grip("rim", &[1], Some(0))];
        let circle = [Step::Key("shape"), Step::Key("circle")];
        let centre = [&circle[..], &[Step::Key("centre")]].concat();
        let mut slots = vec![component(&centre, 0, 0, 0), component(&centre, 1, 0, 1)];
        let path = [&circle[..], &[Step::Key("radius")]].concat();
        slots.push(Slot { path, number: Number::Radius });
        Some((points, grips, slots))
    }

    /// A part of a side of the domain, given by its range along the side.
    fn range(&self, side: usize, domain: &[[f64; 2]; 2], ends: [&Quantity; 2]) -> Option<Form> {
        let (normal, along) = (side / 2, 1 - side / 2);
        let at = domain[normal][side % 2];
        let place = |q: &Quantity| {
            let v = q.eval(self.scope).ok()?;
            Some(if along == 0 { [v, at] } else { [at, v] })
        };
        let names = ["first end", "second end"];
        let grips = names.iter().enumerate().map(|(k, name)| grip(*name, &[k], Some(along)));
        let slots = ["from", "to"].into_iter().enumerate().map(|(k, key)| Slot {
            path: vec![Step::Key(key)],
            number: Number::Coordinate(k, along),
        });
        Some((vec![place(ends[0])?, place(ends[1])?], grips.collect(), slots.collect()))
    }
}

/// Everything in a scene that can be dragged, the domain first.
fn parts(scene: &Scene) -> Vec<Part> {
    let Ok(scope) = Scope::new(scene) else { return vec![] };
    let forms = Forms { scope: &scope };
    let mut all = vec![];
    let mut add = |what: &'static str, name: &str, path: Vec<Step>, form: Option<Form>| {
        let Some((points, grips, slots)) = form else { return };
        let place = Place { id: written(&path), points };
        all.push(Part { handle: Handle { name: name.into(), what, grips, place }, path, slots });
    };
    let item = |list: &'static str, k: usize| vec![Step::Key(list), Step::Index(k)];
    let rectangle = [Step::Key("shape"), Step::Key("rectangle")];
    let d = &scene.domain;
    add("domain", "domain", vec![Step::Key("domain")], forms.rectangle(&[], &d.x, &d.y));
    for (k, r) in scene.regions.iter().enumerate() {
        let form = match &r.shape {
            Shape::Rectangle { x, y } => forms.rectangle(&rectangle, x, y),
            Shape::Polygon(corners) => forms.polygon(corners),
            Shape::Circle { centre, radius } => forms.circle(centre, radius),
            _ => None,
        };
        add("region", &r.material, item("regions", k), form);
    }
    for (k, b) in scene.blocks.iter().enumerate() {
        let form = match (&b.shape, &b.x, &b.y) {
            (Some(SolidShape::Rectangle { x, y }), ..) => forms.rectangle(&rectangle, x, y),
            (Some(SolidShape::Polygon(corners)), ..) => forms.polygon(corners),
            (Some(SolidShape::Circle { centre, radius }), ..) => forms.circle(centre, radius),
            (None, Some(x), Some(y)) => forms.rectangle(&[], x, y),
            _ => None,
        };
        add("block", &b.name, item("blocks", k), form);
    }
    for (k, w) in scene.walls.iter().enumerate() {
        add("wall", &w.name, item("walls", k), forms.segment(&w.from, &w.to));
    }
    for (k, s) in scene.sources.iter().enumerate() {
        add("source", &s.name, item("sources", k), forms.segment(&s.from, &s.to));
    }
    if let (Some(x), Some(y)) = (forms.pair(&d.x), forms.pair(&d.y)) {
        for (side, boundary) in scene.boundaries.sides().into_iter().enumerate() {
            for (k, part) in boundary.parts.iter().enumerate() {
                let path = [Step::Key("boundaries"), Step::Key(SIDES[side]), Step::Key("parts")];
                let path = path.into_iter().chain([Step::Index(k)]).collect();
                let form = forms.range(side, &[x, y], [&part.from, &part.to]);
                add("part of side", SIDES[side], path, form);
            }
        }
    }
    for (k, g) in scene.gauges.iter().enumerate() {
        let form = g.from.as_ref().zip(g.to.as_ref()).and_then(|(a, b)| forms.segment(a, b));
        add("gauge", &g.name, item("gauges", k), form);
    }
    all
}

/// Everything in a scene that can be dragged, with its place.
pub fn handles(scene: &Scene) -> Vec<Handle> {
    parts(scene).into_iter().map(|part| part.handle).collect()
}

/// The text with a part at another place, and what was done. Only the numbers that differ are written;
/// comments and order are kept. Where the text names a parameter, its default is changed instead.
pub fn moved(text: &str, to: &Place) -> Result<(String, String), Answer> {
    let refuse = |why: String| Answer::no(why, "correct the errors of the text first");
    let scene =
        scene::parse(&SceneSource::new("the text", text)).map_err(|e| refuse(e.headline()))?;
    let all = parts(&scene);
    let part = (all.iter())
        .find(|p| p.handle.place.id == to.id && p.handle.place.points.len() == to.points.len())
        .ok_or_else(|| refuse("there is no such part".into()))?;
    let size = all.first().map_or(1.0, |domain| {
        let points = &domain.handle.place.points;
        (points[1][0] - points[0][0]).max(points[1][1] - points[0][1])
    });
    let mut doc: DocumentMut =
        text.parse().map_err(|e: toml_edit::TomlError| refuse(e.to_string()))?;
    let mut changes = vec![];
    for slot in &part.slots {
        let (wanted, now) = (slot.number.of(&to.points), slot.number.of(&part.handle.place.points));
        if !wanted.is_finite() || (wanted - now).abs() <= SAME * size {
            continue;
        }
        let value = rounded(wanted, size);
        let path = [&part.path[..], &slot.path].concat();
        let missing = || refuse(format!("`{}` is not written in the text", written(&path)));
        let item = path.iter().try_fold(doc.as_item_mut(), |item, step| match step {
            Step::Key(key) => item.get_mut(key),
            Step::Index(k) => item.get_mut(k),
        });
        let item = item.ok_or_else(missing)?;
        let named = item.as_str().filter(|name| scene.parameters.contains_key(*name));
        let Some(name) = named.map(str::to_owned) else {
            changes.push(format!("{} = {value}", written(&slot.path)));
            set(item, value).ok_or_else(missing)?;
            continue;
        };
        changes.push(format!("parameter {name} = {value}"));
        let default =
            doc.get_mut("parameters").and_then(|all| all.get_mut(&name)?.get_mut("default"));
        default.and_then(|item| set(item, value)).ok_or_else(|| {
            refuse(format!("`parameters.{name}.default` is not written in the text"))
        })?;
    }
    let Handle { name, what, .. } = &part.handle;
    let said = match changes.is_empty() {
        true => format!("{name} is where it was"),
        false => format!("{what} {name}: {}", changes.join(", ")),
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

/// Replaces a number or expression; the spaces around it are kept. `None` if it is neither.
fn set(item: &mut Item, value: f64) -> Option<()> {
    let old = item.as_value_mut()?;
    let decor = old.decor().clone();
    let whole = value.fract() == 0.0 && value.abs() < 1e15;
    *old = if whole { Value::from(value as i64) } else { Value::from(value) };
    *old.decor_mut() = decor;
    Some(())
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
        assert_eq!(said, "gauge outflow: to[0] = 0.8");
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
    fn corners_circles_and_parts_of_sides_move_too() {
        let text = r#"schema = 1
name = "shapes"
[time]
end = 1
[parameters.lip]
default = 0.5 # half the aperture
[domain]
x = [0, 4]
y = [0, 4]
[materials.mud]
shear_viscosity = 1
[[regions]]
material = "mud"
shape.circle = { centre = [1, 1], radius = 0.5 }
[[blocks]]
name = "funnel"
shape.polygon = [[2, 2], ["lip", 1], [2, 1]] # three corners
[[boundaries.bottom.parts]]
from = 1
to = 2
kind = "outflow"
"#;
        let drag = |name: &str, change: &dyn Fn(&mut Vec<[f64; 2]>)| {
            let mut to = handle(text, name);
            change(&mut to.points);
            moved(text, &to).expect("moved")
        };
        let (circle, _) = drag("mud", &|p| p.iter_mut().for_each(|p| p[1] += 1.0));
        assert!(circle.contains("{ centre = [1, 2], radius = 0.5 }"), "{circle}");
        let (rim, said) = drag("mud", &|p| p[1][0] = 1.75);
        assert!(rim.contains("{ centre = [1, 1], radius = 0.75 }"), "{rim}");
        assert_eq!(said, "region mud: shape.circle.radius = 0.75");
        let (corner, _) = drag("funnel", &|p| p[0] = [2.5, 2.25]);
        assert!(corner.contains(r#"[[2.5, 2.25], ["lip", 1], [2, 1]] # three"#), "{corner}");
        let (lip, said) = drag("funnel", &|p| p[1][0] = 0.25);
        assert!(lip.contains("default = 0.25 # half") && lip.contains(r#"["lip", 1]"#), "{lip}");
        assert_eq!(said, "block funnel: parameter lip = 0.25");
        let (part, _) = drag("bottom", &|p| p[1] = [3.0, 0.0]);
        assert!(part.contains("from = 1\nto = 3\n"), "{part}");
    }

    #[test]
    fn dragged_coordinates_are_short_numbers() {
        assert_eq!(rounded(0.123456, 8.0), 0.12);
        assert_eq!(rounded(1234.4, 50_000.0), 1200.0);
    }
}
