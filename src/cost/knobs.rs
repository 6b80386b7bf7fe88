//! The settings that affect accuracy (knobs), and the values (levels) that are tried for each.

use crate::plan::{Plan, resolve};
use crate::scene::{Integrator, Moment, Quadrature, Scene, SceneError, Scope};
use crate::words::count;

/// All knobs: name, scene keys, and description of the levels that are tried.
pub const KNOBS: [(&str, &str, &str); 10] = [
    ("cells", "accuracy.cells", "fewer and more cells, by factors of sqrt 2"),
    ("grading", "mesh.grading", "none, and smaller or larger cells where the mesh is graded"),
    ("particles", "accuracy.particles_per_cell", "square numbers from 4"),
    ("quadrature", "accuracy.quadrature", "particles, mixture, laminate, sides: the cut-cell rule"),
    (
        "time step",
        "time.courant, time.strain, time.max_step, time.tolerance",
        "by one factor, the tolerance by its cube",
    ),
    ("integrator", "accuracy.integrator", "euler, extrapolated, midpoint"),
    ("tolerance", "accuracy.tolerance", "1e-5, 1e-8 and the scene's own"),
    (
        "largest viscosity",
        "materials.<name>.largest_viscosity",
        "by factors of 0.01, 0.1 and 10, of all materials with a flow curve",
    ),
    (
        "smallest viscosity",
        "materials.<name>.smallest_viscosity",
        "by factors of 100, 10 and 0.1, of all materials with a flow curve",
    ),
    (
        "nonlinear tolerance",
        "accuracy.nonlinear_tolerance",
        "1e-1, 1e-2, 1e-3, 1e-4 and the scene's own, with a flow curve",
    ),
];

/// A value of a knob.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Name, such as `cells 8`.
    pub label: String,
    /// `--set` assignments that select it; empty for the scene's own setting.
    pub sets: Vec<String>,
    /// Size relative to the scene's own setting; smaller is finer. `None` for a choice.
    pub size: Option<f64>,
}

/// A knob and its levels, coarse to fine where they have sizes.
#[derive(Clone, Debug)]
pub struct Knob {
    /// Name, as in [`KNOBS`].
    pub name: &'static str,
    /// Levels that are tried.
    pub levels: Vec<Level>,
    /// Index of the scene's own level.
    pub base: usize,
    /// Convergence rate assumed if too few levels were run to measure it.
    pub expected: f64,
}

/// The knobs of a scene and their levels.
#[derive(Clone, Debug)]
pub struct Design {
    /// Knobs in the order of [`KNOBS`].
    pub knobs: Vec<Knob>,
}

/// A level with a size.
fn sized(label: String, size: f64, sets: Vec<String>) -> Level {
    let sets = if size == 1.0 { vec![] } else { sets };
    Level { label, sets, size: Some(size) }
}

impl Knob {
    /// A knob from its levels. `None` if it has only one, or none of the scene itself.
    fn new(name: &'static str, mut levels: Vec<Level>, expected: f64) -> Option<Knob> {
        levels.sort_by(|a, b| b.size.unwrap_or(0.0).total_cmp(&a.size.unwrap_or(0.0)));
        levels.dedup_by(|a, b| a.label == b.label);
        let base = levels.iter().position(|l| l.sets.is_empty())?;
        (levels.len() > 1).then_some(Knob { name, levels, base, expected })
    }
}

/// Whole number near `n * factor`. It is even if `n` is even, so that an interface on a mesh line
/// of the scene's own mesh stays on a mesh line.
pub(super) fn cells_near(n: u32, factor: f64) -> u32 {
    let wanted = f64::from(n) * factor;
    let even = 2.0 * (0.5 * wanted).round();
    // For few cells the nearest even number may be too far off.
    let near = (even - wanted).abs() <= 0.05 * wanted;
    let cells = if n.is_multiple_of(2) && near { even } else { wanted.round() };
    (cells as u32).max(2)
}

/// The number of cells.
fn cells(scene: &Scene, factors: &[f64]) -> Option<Knob> {
    let n = scene.accuracy.cells;
    let levels = factors
        .iter()
        .map(|&f| cells_near(n, f))
        .map(|c| {
            let size = f64::from(n) / f64::from(c);
            sized(format!("cells {c}"), size, vec![format!("accuracy.cells={c}")])
        })
        .collect();
    // Discharges converge at first order, smooth fields at third. Measured rates replace this one.
    Knob::new("cells", levels, 1.5)
}

/// Factor of the default grading, the same as in `plan`.
const DEFAULT_GRADING: f64 = 12.0;

/// `--set` assignments that multiply all grading factors; `None` if the mesh is not graded.
fn graded(scene: &Scene, scope: &Scope, factor: f64) -> Result<Option<Vec<String>>, SceneError> {
    match &scene.mesh.grading {
        None => {
            let mut even = scene.clone();
            even.mesh.grading = Some(vec![]);
            let count = |s: &Scene| resolve(s).map(|p: Plan| p.mesh.cells());
            let graded = count(scene)? != count(&even)?;
            let value = DEFAULT_GRADING * factor;
            Ok(graded.then(|| {
                vec![format!("mesh.grading=[{{ towards = \"apertures\", factor = {value} }}]")]
            }))
        }
        Some(list) if list.is_empty() => Ok(None),
        Some(list) => {
            let mut sets = vec![];
            for (i, g) in list.iter().enumerate() {
                // Cells must not grow towards the place of refinement.
                let value = (g.factor.eval(scope)? * factor).max(1.0);
                sets.push(format!("mesh.grading[{i}].factor={value}"));
            }
            Ok(Some(sets))
        }
    }
}

/// The grading factors of the mesh.
fn grading(scene: &Scene, scope: &Scope) -> Result<Option<Knob>, SceneError> {
    if graded(scene, scope, 1.0)?.is_none() {
        return Ok(None);
    }
    let own = match &scene.mesh.grading {
        Some(list) => list[0].factor.eval(scope)?,
        None => DEFAULT_GRADING,
    };
    let mut levels =
        vec![sized("no grading".into(), own.max(1.0001), vec!["mesh.grading=[]".into()])];
    for factor in [1.0 / 3.0, 1.0, 1.4] {
        if own * factor > 1.0
            && let Some(sets) = graded(scene, scope, factor)?
        {
            let label = format!("grading {}", (10.0 * own * factor).round() / 10.0);
            levels.push(sized(label, 1.0 / factor, sets));
        }
    }
    Ok(Knob::new("grading", levels, 1.0))
}

/// The number of particles per cell.
fn particles(scene: &Scene) -> Option<Knob> {
    let n = scene.accuracy.particles_per_cell;
    let mut counts = vec![4, 9, 16, 25];
    counts.push(n);
    let levels = counts
        .into_iter()
        .map(|c| {
            let size = (f64::from(n) / f64::from(c)).sqrt();
            let set = format!("accuracy.particles_per_cell={c}");
            sized(format!("{} a cell", count(c, "particle")), size, vec![set])
        })
        .collect();
    Knob::new("particles", levels, 1.0)
}

/// A choice without size, its levels in the order given.
fn choice<T: PartialEq + Copy>(
    name: &'static str,
    key: &str,
    own: T,
    words: &[(T, &str)],
) -> Option<Knob> {
    let level = |&(value, word): &(T, &str)| Level {
        label: word.to_string(),
        sets: if value == own { vec![] } else { vec![format!("{key}={word}")] },
        size: None,
    };
    Knob::new(name, words.iter().map(level).collect(), 1.0)
}

/// The quadrature rule; `None` if all particles have the same properties.
fn quadrature(scene: &Scene, plan: &Plan) -> Option<Knob> {
    let varied = plan.state.materials.len() > 1
        || plan.effects.directors
        || plan.effects.carried_viscosity
        || plan.effects.carried_density;
    if !varied {
        return None;
    }
    let words = [
        (Quadrature::Particles, "particles"),
        (Quadrature::Mixture, "mixture"),
        (Quadrature::Laminate, "laminate"),
        (Quadrature::Sides, "sides"),
    ];
    choice("quadrature", "accuracy.quadrature", scene.accuracy.quadrature, &words)
}

/// `--set` assignments that multiply the limits of the time step.
fn stepped(scene: &Scene, scope: &Scope, factor: f64) -> Result<Vec<String>, SceneError> {
    let mut sets = vec![
        format!("time.courant={}", scene.time.courant * factor),
        format!("time.strain={}", scene.time.strain * factor),
        // The error of a step is of third order in its length.
        format!("time.tolerance={}", (scene.time.tolerance * factor.powi(3)).min(1.0)),
    ];
    if let Some(dt) = &scene.time.max_step {
        sets.push(format!("time.max_step={:e}", dt.eval(scope)? * factor));
    }
    Ok(sets)
}

/// The limits of the time step.
fn step(scene: &Scene, scope: &Scope) -> Result<Option<Knob>, SceneError> {
    let mut levels = vec![];
    for factor in [4.0, 2.0, 1.0, std::f64::consts::FRAC_1_SQRT_2] {
        let label = if factor == 1.0 {
            "time step x 1".into()
        } else {
            format!("time step x {}", (100.0 * factor).round() / 100.0)
        };
        levels.push(sized(label, factor, stepped(scene, scope, factor)?));
    }
    Ok(Knob::new("time step", levels, 2.0))
}

/// The tolerance of the solver.
fn tolerance(scene: &Scene) -> Option<Knob> {
    let own = scene.accuracy.tolerance;
    let levels = [1e-5, 1e-8, own]
        .into_iter()
        .filter(|&t| t >= own)
        .map(|t| Level {
            label: format!("tolerance {t:e}"),
            sets: if t == own { vec![] } else { vec![format!("accuracy.tolerance={t:e}")] },
            size: None,
        })
        .collect();
    Knob::new("tolerance", levels, 1.0)
}

/// A bound of the viscosities of all materials with a flow curve, times each of the factors; `None`
/// if there are no such materials. Factors with which a smallest viscosity would be above a largest one
/// are left out.
fn bound(plan: &Plan, largest: bool, factors: [f64; 4]) -> Option<Knob> {
    let curves: Vec<_> =
        plan.state.materials.iter().filter_map(|m| Some((m, m.law.curve?))).collect();
    if curves.is_empty() {
        return None;
    }
    let (name, key) = if largest {
        ("largest viscosity", "largest_viscosity")
    } else {
        ("smallest viscosity", "smallest_viscosity")
    };
    let fits = |factor: f64| {
        curves.iter().all(|(_, c)| {
            let ratio = if largest { factor } else { 1.0 / factor };
            c.smallest < ratio * c.largest
        })
    };
    let levels = factors.into_iter().filter(|&f| fits(f)).map(|factor| {
        let mut sets = vec![];
        for (m, c) in curves.iter().filter(|_| factor != 1.0) {
            let own = if largest { c.largest } else { c.smallest };
            let value = factor * own * plan.units.viscosity;
            sets.push(format!("materials.{}.{key}={value:e}", m.name));
        }
        Level { label: format!("{name} x {factor}"), sets, size: None }
    });
    Knob::new(name, levels.collect(), 1.0)
}

/// The tolerance of the iteration for flow curves; `None` without them.
fn nonlinear_tolerance(scene: &Scene, plan: &Plan) -> Option<Knob> {
    if !plan.effects.flow_curves {
        return None;
    }
    let own = scene.accuracy.nonlinear_tolerance;
    let mut tried = vec![1e-1, 1e-2, 1e-3, 1e-4];
    if !tried.contains(&own) {
        tried.push(own);
        tried.sort_by(|a, b| b.total_cmp(a));
    }
    let level = |t: f64| Level {
        label: format!("nonlinear tolerance {t:e}"),
        sets: if t == own { vec![] } else { vec![format!("accuracy.nonlinear_tolerance={t:e}")] },
        size: None,
    };
    Knob::new("nonlinear tolerance", tried.into_iter().map(level).collect(), 1.0)
}

/// `--set` assignments that refine every knob with a size by a ratio (coarsen if below 1).
pub fn rung(scene: &Scene, ratio: f64, at: Moment) -> Result<Vec<String>, SceneError> {
    let scope = Scope::new(scene)?;
    let mut sets = vec![format!("accuracy.cells={}", cells_near(scene.accuracy.cells, ratio))];
    let side = f64::from(scene.accuracy.particles_per_cell).sqrt();
    // One particle more or less along a side, since particles are refined with the cells.
    let side = (side + (ratio - 1.0).signum()).max(2.0).round();
    sets.push(format!("accuracy.particles_per_cell={}", side * side));
    if let Some(more) = graded(scene, &scope, ratio)? {
        sets.extend(more);
    }
    if at != Moment::Start {
        sets.extend(stepped(scene, &scope, 1.0 / ratio)?);
    }
    Ok(sets)
}

impl Design {
    /// The knobs that affect a scene's quantity of interest at time `at`. `factors` are the numbers
    /// of cells to try, relative to that of the scene.
    pub fn new(
        scene: &Scene,
        plan: &Plan,
        at: Moment,
        factors: &[f64],
    ) -> Result<Design, SceneError> {
        let scope = Scope::new(scene)?;
        let mut knobs = vec![cells(scene, factors), grading(scene, &scope)?, particles(scene)];
        knobs.push(quadrature(scene, plan));
        if at != Moment::Start {
            knobs.push(step(scene, &scope)?);
            let words = [
                (Integrator::Euler, "euler"),
                (Integrator::Extrapolated, "extrapolated"),
                (Integrator::Midpoint, "midpoint"),
            ];
            let own = scene.accuracy.integrator;
            knobs.push(choice("integrator", "accuracy.integrator", own, &words));
        }
        knobs.push(tolerance(scene));
        knobs.push(bound(plan, true, [0.01, 0.1, 1.0, 10.0]));
        knobs.push(bound(plan, false, [100.0, 10.0, 1.0, 0.1]));
        knobs.push(nonlinear_tolerance(scene, plan));
        Ok(Design { knobs: knobs.into_iter().flatten().collect() })
    }

    /// The scene's own settings: the index of the level of each knob.
    pub fn base(&self) -> Vec<usize> {
        self.knobs.iter().map(|k| k.base).collect()
    }

    /// The scene's own settings, except for one knob.
    pub fn one(&self, knob: usize, level: usize) -> Vec<usize> {
        let mut settings = self.base();
        settings[knob] = level;
        settings
    }

    /// `--set` assignments of some settings.
    pub fn sets(&self, settings: &[usize]) -> Vec<String> {
        self.knobs.iter().zip(settings).flat_map(|(k, &i)| k.levels[i].sets.clone()).collect()
    }

    /// Levels that differ from the scene's own settings, in words.
    pub fn label(&self, settings: &[usize]) -> String {
        let other = self.knobs.iter().zip(settings).filter(|(k, i)| k.base != **i);
        let words: Vec<&str> = other.map(|(k, &i)| k.levels[i].label.as_str()).collect();
        if words.is_empty() { "scene settings".into() } else { words.join(", ") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{parse, presets};

    fn design(name: &str, at: Moment) -> (Scene, Design) {
        let scene = parse(&presets::find(name).expect("listed")).expect("valid");
        let plan = resolve(&scene).expect("valid");
        let design = Design::new(&scene, &plan, at, &[0.5, 1.0, 1.25]).expect("a design");
        (scene, design)
    }

    #[test]
    fn only_knobs_with_an_effect_are_varied() {
        let names = |d: &Design| d.knobs.iter().map(|k| k.name).collect::<Vec<_>>();
        let (_, silo) = design("silo", Moment::End);
        let (plain, of_curves) = KNOBS.split_at(7);
        assert_eq!(names(&silo), plain.iter().map(|k| k.0).collect::<Vec<_>>());
        let (_, couette) = design("couette_cosserat", Moment::Start);
        assert_eq!(names(&couette), ["cells", "grading", "particles", "tolerance"]);
        let mud = presets::find("rayleigh_taylor")
            .and_then(|s| s.with_sets(&["materials.heavy.yield_stress=0.01".into()]))
            .expect("a preset");
        let scene = parse(&mud).expect("valid");
        let plan = resolve(&scene).expect("valid");
        let mud = Design::new(&scene, &plan, Moment::Start, &[1.0]).expect("a design");
        assert_eq!(
            names(&mud)[names(&mud).len() - 3..],
            of_curves.iter().map(|k| k.0).collect::<Vec<_>>()
        );
    }

    #[test]
    fn every_setting_of_every_preset_is_a_valid_scene() {
        for (name, _) in presets::list() {
            let source = presets::find(name).expect("listed");
            let (scene, design) = design(name, Moment::End);
            assert!(design.sets(&design.base()).is_empty(), "{name}");
            for (k, knob) in design.knobs.iter().enumerate() {
                for level in 0..knob.levels.len() {
                    let sets = design.sets(&design.one(k, level));
                    let source = source.with_sets(&sets).unwrap_or_else(|e| panic!("{e:?}"));
                    let scene = parse(&source).unwrap_or_else(|e| panic!("{name} {sets:?} {e:?}"));
                    resolve(&scene).unwrap_or_else(|e| panic!("{name} {sets:?}: {e:?}"));
                }
            }
            for ratio in [1.0 / 1.5, 1.5] {
                let sets = rung(&scene, ratio, Moment::End).expect("sets");
                let scene = parse(&source.with_sets(&sets).expect("sets")).expect("valid");
                resolve(&scene).unwrap_or_else(|e| panic!("{name} {sets:?}: {e:?}"));
            }
        }
    }

    #[test]
    fn even_numbers_of_cells_stay_even() {
        assert_eq!([0.5, 0.71, 1.0, 1.42].map(|f| cells_near(32, f)), [16, 22, 32, 46]);
        assert_eq!(cells_near(33, 0.71), 23);
        assert_eq!([0.5, 1.2, 1.5].map(|f| cells_near(6, f)), [3, 7, 9]);
    }
}
