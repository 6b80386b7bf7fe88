//! This module lists the values that can be changed on the page: parameters, gravity, effects and
//! accuracy.

use super::draft::Draft;
use crate::cost::{List, list};
use crate::plan::{EffectSet, Plan};
use crate::scene::{Scene, Scope};
use indexmap::IndexMap;
use serde::Serialize;

/// Exponent of the growth of the step time with the number of unknowns, between those of assembly
/// and factorisation.
const STEP_GROWTH: f64 = 1.3;

/// Expected step time (s) with `unknowns` unknowns, if it is `seconds` with `known` of them.
pub fn step_time(seconds: f64, known: usize, unknowns: usize) -> f64 {
    seconds * (unknowns as f64 / known as f64).powf(STEP_GROWTH)
}

/// A number of the scene that can be set with a slider.
#[derive(Clone, Debug, Serialize)]
pub struct Knob {
    /// Key in the scene.
    pub key: String,
    /// Label on the page.
    pub label: String,
    /// Unit; empty for pure numbers.
    pub unit: String,
    /// Present value.
    pub value: f64,
    /// Lower bound; `None` if there is none.
    pub min: Option<f64>,
    /// Upper bound; `None` if there is none.
    pub max: Option<f64>,
    /// Default value of the scene.
    pub default: f64,
    /// Part of the plan for which a small change restarts the run; `None` if it takes effect at
    /// once.
    pub restarts: Option<&'static str>,
}

/// An effect that is solved unless a parameter is zero.
#[derive(Clone, Debug)]
pub struct Switch {
    /// Name of the effect.
    pub effect: &'static str,
    /// Key of the parameter.
    pub key: String,
    /// Whether the effect is solved.
    pub on: bool,
    /// Value of the parameter that switches the effect.
    pub other: String,
    /// Number of unknowns with and without the effect.
    pub unknowns: [usize; 2],
    /// Identifier of the computation with and without the effect, see [`kind`].
    pub kinds: [String; 2],
}

/// A position of the accuracy dial.
#[derive(Clone, Debug)]
pub struct Stop {
    /// Value of `accuracy.cells`.
    pub cells: u32,
    /// Number of unknowns.
    pub unknowns: usize,
    /// Identifier of the computation, see [`kind`].
    pub kind: String,
    /// Relative error from the cost table; `None` if there is none.
    pub error: Option<f64>,
}

/// Key that the accuracy dial sets.
pub const CELLS: &str = "accuracy.cells";

/// Number of cells of each dial position relative to that of the scene file, in twelfths.
const DIAL: [u32; 7] = [4, 6, 8, 12, 16, 24, 36];

/// Largest mesh of the dial (unknowns): with a larger one, a step would take minutes.
const MOST_UNKNOWNS: usize = 1_000_000;

/// Values that can be changed in the scene of `draft`, whose plan is `plan`.
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
        // A zero component of gravity is left out.
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

/// Updates the values of the knobs after one of them has changed.
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

/// A value close to the present one, within the range and with the same sign.
fn nearby(knob: &Knob) -> Option<f64> {
    let v = knob.value;
    let step = if v == 0.0 { knob.default.abs().max(1.0) } else { v };
    let inside =
        |x: f64| knob.min.is_none_or(|m| x >= m) && knob.max.is_none_or(|m| x <= m) && x != v;
    [v + 1e-2 * step, v - 1e-2 * step].into_iter().find(|&x| inside(x))
}

/// Effects that can be switched off by setting a knob to zero. `last` has the last value of each
/// knob that was not zero.
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
        // If several knobs switch the same effect, only the first one is listed.
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

/// The effect in `with` that is not in `without`.
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

/// Number of velocity, rotation and pressure unknowns.
pub fn unknowns(plan: &Plan) -> usize {
    plan.unknowns_per_node() * plan.mesh.nodes() + 3 * plan.mesh.cells()
}

/// Positions of the accuracy dial, from coarse to fine, around `own`, the number of cells in the
/// scene file.
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

/// The cost table that `grainscope cost` has made for a scene with its own number of cells.
fn price_list(scene: &Scene, own: u32) -> Option<List> {
    let mut scene = scene.clone();
    scene.accuracy.cells = own;
    list::kept(&scene, false).or_else(|| list::kept(&scene, true))
}

/// Error that a cost table states for a number of cells, with the fewest other settings.
fn price(list: &List, cells: u32, own: u32) -> Option<f64> {
    let of = |sets: &[String]| {
        let set = sets.iter().find_map(|s| s.strip_prefix(CELLS)?.strip_prefix('='));
        set.map_or(Some(own), |v| v.trim().parse().ok())
    };
    let same = list.entries.iter().filter(|e| of(&e.sets) == Some(cells));
    same.min_by_key(|e| e.sets.len()).map(|e| e.promised)
}

/// Identifier of a computation, under which the time of a step is remembered.
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
    fn knobs_state_why_a_change_restarts_the_run() {
        let (draft, plan) = silo();
        let knobs = knobs(&draft, &plan);
        let of = |key: &str| knobs.iter().find(|k| k.key == key).expect("a knob");
        assert_eq!(of("alpha").restarts, None);
        assert_eq!(of("contrast").restarts, None);
        assert_eq!(of("gravity[1]").restarts, None);
        assert_eq!(of("aperture").restarts, Some("the mesh"));
        assert_eq!(of("fill_height").restarts, Some("the initial regions"));
        assert_eq!((of("alpha").min, of("alpha").max), (Some(0.0), Some(100.0)));
    }

    #[test]
    fn a_parameter_of_friction_takes_effect_at_once() {
        let text = presets::find("rayleigh_taylor").expect("a preset").text().replace(
            "\nshear_viscosity = 1\n",
            "\nfriction = { static = \"mu\", grain_diameter = 0.01 }\n",
        );
        let text = text.replacen(
            "[domain]",
            "[parameters.mu]\ndefault = 0.3\nmin = 0.1\nmax = 0.5\n\n\
             [pressure_reference]\nat = [0.1, 1]\n\n[domain]",
            1,
        );
        let draft = Draft::new(crate::scene::SceneSource::new("grains.toml", text));
        let plan = draft.plan().expect("valid");
        let knobs = knobs(&draft, &plan);
        let mu = knobs.iter().find(|k| k.key == "mu").expect("a knob");
        assert_eq!((mu.value, mu.min, mu.max, mu.restarts), (0.3, Some(0.1), Some(0.5), None));
        let changed = draft.with("mu", "0.4").and_then(|d| d.plan()).expect("valid");
        assert!(changed.state != plan.state);
    }

    #[test]
    fn zero_parameters_switch_effects_off() {
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
