//! What can be turned: parameters, gravity, effects, accuracy.

use super::draft::Draft;
use crate::cost::{List, list};
use crate::plan::{EffectSet, Plan};
use crate::scene::{Scene, Scope};
use indexmap::IndexMap;
use serde::Serialize;

/// A number of the scene with what a slider needs to know.
#[derive(Clone, Debug, Serialize)]
pub struct Knob {
    pub key: String,
    pub label: String,
    pub unit: String,
    pub value: f64,
    pub min: Option<f64>,
    pub max: Option<f64>,
    pub default: f64,
    /// What a small change of it would restart the run for; `None` takes effect at once.
    pub restarts: Option<&'static str>,
}

/// An effect that is there or not as a parameter is zero or not.
#[derive(Clone, Debug)]
pub struct Switch {
    pub effect: &'static str,
    pub key: String,
    pub on: bool,
    /// Value that turns it over.
    pub other: String,
    /// Unknowns with and without.
    pub unknowns: [usize; 2],
    /// What is computed with and without.
    pub kinds: [String; 2],
}

/// A stop of the accuracy dial.
#[derive(Clone, Debug)]
pub struct Stop {
    pub cells: u32,
    pub unknowns: usize,
    pub kind: String,
    pub error: Option<f64>,
}

/// The key of the accuracy dial.
pub const CELLS: &str = "accuracy.cells";

/// Cells of the dial over those of the scene's file, in twelfths.
const DIAL: [u32; 7] = [4, 6, 8, 12, 16, 24, 36];

/// Meshes beyond this are not offered by the dial: a step would take minutes.
const MOST_UNKNOWNS: usize = 1_000_000;

/// Everything that can be turned in a scene whose knobs stand as `draft` says, which is `plan`.
pub fn knobs(draft: &Draft, plan: &Plan) -> Vec<Knob> {
    let scene = &plan.scene;
    let Ok(scope) = Scope::new(scene) else { return vec![] };
    let mut list: Vec<Knob> = scene
        .parameters
        .iter()
        .map(|(key, p)| {
            let eval = |q: &Option<_>| {
                let q: &crate::scene::Quantity = q.as_ref()?;
                q.eval(&scope).ok()
            };
            let value = scope.get(key).unwrap_or(f64::NAN);
            Knob {
                key: key.clone(),
                label: if p.label.is_empty() { key.clone() } else { p.label.clone() },
                unit: p.unit.clone(),
                value,
                min: eval(&p.min),
                max: eval(&p.max),
                default: p.default.eval(&scope).unwrap_or(value),
                restarts: None,
            }
        })
        .collect();
    for (c, name) in ["x", "y"].into_iter().enumerate() {
        // A direction that does not pull and does not depend on anything is left out.
        let Ok(value) = scene.gravity[c].eval(&scope) else { continue };
        if value != 0.0 {
            list.push(Knob {
                key: format!("gravity[{c}]"),
                label: format!("gravity along {name}"),
                unit: "m/s²".into(),
                value,
                min: Some(-2.0 * value.abs()),
                max: Some(2.0 * value.abs()),
                default: value,
                restarts: None,
            });
        }
    }
    for knob in &mut list {
        knob.restarts = nearby(knob)
            .and_then(|value| draft.with(&knob.key, &value.to_string()).ok())
            .and_then(|d| d.plan().ok())
            .and_then(|other| plan.beyond_matter(&other));
    }
    list
}

/// The values of knobs after one of them was turned.
pub fn refresh(knobs: &mut [Knob], plan: &Plan) {
    let Ok(scope) = Scope::new(&plan.scene) else { return };
    for knob in knobs {
        let gravity = ["gravity[0]", "gravity[1]"].iter().position(|key| *key == knob.key);
        let value = match gravity {
            Some(c) => plan.scene.gravity[c].eval(&scope).ok(),
            None => scope.get(&knob.key),
        };
        knob.value = value.unwrap_or(knob.value);
    }
}

/// A value close to a knob's own, within its range and on the same side of zero.
fn nearby(knob: &Knob) -> Option<f64> {
    let v = knob.value;
    let step = if v == 0.0 { knob.default.abs().max(1.0) } else { v };
    let inside =
        |x: f64| knob.min.is_none_or(|m| x >= m) && knob.max.is_none_or(|m| x <= m) && x != v;
    [v + 1e-2 * step, v - 1e-2 * step].into_iter().find(|&x| inside(x))
}

/// Effects that a knob at zero leaves out.
pub fn switches(
    draft: &Draft,
    plan: &Plan,
    knobs: &[Knob],
    last: &IndexMap<String, String>,
) -> Vec<Switch> {
    let mut list: Vec<Switch> = vec![];
    for knob in knobs {
        let zero = knob.min.is_none_or(|m| m <= 0.0) && knob.max.is_none_or(|m| m >= 0.0);
        if !zero {
            continue;
        }
        let on = knob.value != 0.0;
        let other = if on {
            "0".to_string()
        } else if let Some(value) = last.get(&knob.key) {
            value.clone()
        } else if knob.default != 0.0 {
            knob.default.to_string()
        } else {
            continue;
        };
        let Some(Ok(changed)) = draft.with(&knob.key, &other).ok().map(|d| d.plan()) else {
            continue;
        };
        let (with, without) = if on { (plan, &changed) } else { (&changed, plan) };
        let Some(effect) = one_more(&with.effects, &without.effects) else { continue };
        // Several knobs at zero may do the same; the first one is enough.
        if list.iter().all(|s| s.effect != effect) {
            list.push(Switch {
                effect,
                key: knob.key.clone(),
                on,
                other,
                unknowns: [unknowns(with), unknowns(without)],
                kinds: [kind(with), kind(without)],
            });
        }
    }
    list
}

/// The effect that one set has and the other lacks.
fn one_more(with: &EffectSet, without: &EffectSet) -> Option<&'static str> {
    [
        (with.rotation, without.rotation, "Cosserat rotation"),
        (with.directors, without.directors, "directors"),
        (with.gravity, without.gravity, "gravity"),
        (with.volume_change, without.volume_change, "volume change"),
    ]
    .into_iter()
    .find_map(|(a, b, name)| (a && !b).then_some(name))
}

/// Velocity, rotation and pressure.
pub fn unknowns(plan: &Plan) -> usize {
    plan.unknowns_per_node() * plan.mesh.nodes() + 3 * plan.mesh.cells()
}

/// The accuracy dial, coarse to fine, around the cells that the scene's file asks for.
pub fn dial(draft: &Draft, plan: &Plan, own: u32) -> Vec<Stop> {
    let mut cells: Vec<u32> = DIAL.iter().map(|k| (own * k).div_ceil(12).max(1)).collect();
    cells.push(plan.scene.accuracy.cells);
    cells.sort_unstable();
    cells.dedup();
    let prices = price_list(&plan.scene, own);
    cells
        .into_iter()
        .filter_map(|cells| {
            let guess = unknowns(plan) as f64
                * (f64::from(cells) / f64::from(plan.scene.accuracy.cells)).powi(2);
            if guess > 2.0 * MOST_UNKNOWNS as f64 {
                return None;
            }
            let other = draft.with(CELLS, &cells.to_string()).ok()?.plan().ok()?;
            let unknowns = unknowns(&other);
            let error = prices.as_ref().and_then(|list| price(list, cells, own));
            (unknowns <= MOST_UNKNOWNS).then_some(Stop {
                cells,
                unknowns,
                kind: kind(&other),
                error,
            })
        })
        .collect()
}

/// The price list that `grainscope cost` has made of a scene with its own number of cells.
fn price_list(scene: &Scene, own: u32) -> Option<List> {
    let mut scene = scene.clone();
    scene.accuracy.cells = own;
    list::kept(&scene, false).or_else(|| list::kept(&scene, true))
}

/// What a list promises of a number of cells, other settings as near to the scene's as there are.
fn price(list: &List, cells: u32, own: u32) -> Option<f64> {
    let of = |sets: &[String]| {
        let set = sets.iter().find_map(|s| s.strip_prefix(CELLS)?.strip_prefix('='));
        set.map_or(Some(own), |v| v.trim().parse().ok())
    };
    let same = list.entries.iter().filter(|e| of(&e.sets) == Some(cells));
    same.min_by_key(|e| e.sets.len()).map(|e| e.promised)
}

/// Identity of what is computed, for remembering what a step of it took.
pub fn kind(plan: &Plan) -> String {
    format!("{} {} {:?}", plan.scene.name, unknowns(plan), plan.effects)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::presets;

    fn silo() -> (Draft, Plan) {
        let draft = Draft::new(presets::find("silo").expect("a preset"));
        let plan = draft.plan().expect("valid");
        (draft, plan)
    }

    #[test]
    fn knobs_say_what_they_would_restart() {
        let (draft, plan) = silo();
        let knobs = knobs(&draft, &plan);
        let of = |key: &str| knobs.iter().find(|k| k.key == key).expect("a knob");
        assert_eq!(of("alpha").restarts, None);
        assert_eq!(of("contrast").restarts, None);
        assert_eq!(of("gravity[1]").restarts, None);
        assert_eq!(of("aperture").restarts, Some("the mesh"));
        assert_eq!(of("fill_height").restarts, Some("what fills the domain at first"));
        assert_eq!((of("alpha").min, of("alpha").max), (Some(0.0), Some(100.0)));
    }

    #[test]
    fn zeros_switch_effects() {
        let (draft, plan) = silo();
        let knobs = knobs(&draft, &plan);
        let list = switches(&draft, &plan, &knobs, &IndexMap::new());
        let names: Vec<_> = list.iter().map(|s| (s.effect, s.key.as_str(), s.on)).collect();
        assert_eq!(names, [("Cosserat rotation", "alpha", true), ("gravity", "gravity[1]", true)]);
        assert!(list[0].unknowns[0] > list[0].unknowns[1]);
    }

    #[test]
    fn the_dial_goes_from_coarse_to_fine() {
        let (draft, plan) = silo();
        let dial = dial(&draft, &plan, 6);
        assert!(dial.len() >= 4);
        assert!(dial.windows(2).all(|w| w[0].cells < w[1].cells && w[0].unknowns < w[1].unknowns));
        assert!(dial.iter().any(|s| s.cells == 6));
    }
}
