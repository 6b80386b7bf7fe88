//! This module creates the list of all cases of a sweep, with their ids and values: `cases.json`.

use super::vary::{self, Range, Values, Vary};
use super::{Spec, SweepError};
use crate::plan;
use crate::plan::memory::Memory;
use crate::scene::{Placement, Quantity, Scene, SceneError, SceneSource, Scope, parse, scene_hash};
use indexmap::{IndexMap, IndexSet};
use serde::{Deserialize, Serialize};

/// Version of the format of `cases.json`.
const SCHEMA: u32 = 1;

/// Number of digits of the scene hash that form the id of a case.
const ID: usize = 12;

/// Maximum number of cases: every case reads the whole `cases.json`.
const MOST: usize = 100_000;

/// All cases of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct List {
    /// Version of the format.
    pub schema: u32,
    /// Version of the program.
    pub version: String,
    /// The sweep.
    pub spec: Spec,
    /// Names of the varied parameters.
    pub parameters: Vec<String>,
    /// All cases, in the order of their numbers.
    pub cases: Vec<Case>,
}

/// One run of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Case {
    /// First digits of the hash of the resolved scene. The id does not depend on the order of
    /// parameters or cases, and is the same in every sweep that contains the run.
    pub id: String,
    /// Number of the case, from 1, in the order of the list.
    pub number: usize,
    /// Values of the varied parameters, as they are set.
    pub values: IndexMap<String, String>,
    /// Values of the varied parameters that are numbers (SI units).
    pub numbers: IndexMap<String, f64>,
    /// Seed of the particle placement and of random directors, if it varies.
    pub seed: Option<u64>,
    /// All settings of the case, in the form of `--set`.
    pub sets: Vec<String>,
    /// Simulated end time (s).
    pub end: f64,
    /// Number of unknowns: velocity, rotation and pressure.
    pub unknowns: usize,
    /// Estimated memory (bytes).
    pub memory: u64,
}

impl Case {
    /// Description of the case: its values and seed.
    pub fn label(&self) -> String {
        let seed = self.seed.map(|s| format!("seed = {s}"));
        let values = self.values.iter().map(|(name, value)| format!("{name} = {value}"));
        let all: Vec<String> = values.chain(seed).collect();
        if all.is_empty() { self.id.clone() } else { all.join(", ") }
    }

    /// Resolves the plan of the case; `source` is the scene of the sweep. Fails if the scene has
    /// changed.
    pub fn plan(&self, source: &SceneSource) -> Result<plan::Plan, SweepError> {
        let (scene, plan) = resolve(source, &self.sets)?;
        match id_of(&scene) == self.id {
            true => Ok(plan),
            false => Err(SweepError::Engine(format!(
                "case {} is not the one that was listed: the scene of the sweep has changed since; \
                 start the sweep again",
                self.id
            ))),
        }
    }
}

fn id_of(scene: &Scene) -> String {
    scene_hash(scene).chars().take(ID).collect()
}

fn resolve(source: &SceneSource, sets: &[String]) -> Result<(Scene, plan::Plan), SceneError> {
    let source = source.with_sets(sets)?;
    let scene = parse(&source)?;
    let plan = plan::resolve(&scene).map_err(|e| e.with_source(&source))?;
    Ok((scene, plan))
}

/// Settings of one point of the sweep: name and value.
type Point = Vec<(String, String)>;

impl List {
    /// Lists all cases of a sweep of the scene `source`. Every case is resolved, so that errors are
    /// reported before anything runs.
    pub fn new(source: &SceneSource, spec: &Spec) -> Result<List, SweepError> {
        let base = parse(&source.with_sets(&spec.set)?)?;
        let scope = Scope::new(&base).map_err(|e| e.with_source(source))?;
        let varied: Vec<Vary> =
            spec.vary.iter().map(|v| vary::read(v, &scope)).collect::<Result<_, _>>()?;
        let mut parameters = IndexSet::new();
        if let Some(twice) = varied.iter().find(|v| !parameters.insert(v.name.clone())) {
            return Err(SweepError::Usage(format!(
                "--vary {}: it is varied twice; list all its values once: {}=a,b,c",
                twice.name, twice.name
            )));
        }
        let points = points(&varied, spec)?;
        let seeds = seeds(&base, spec)?;
        if points.len() * seeds.len() > MOST {
            return Err(SweepError::Usage(format!(
                "{} cases are more than {MOST}, the most of one sweep; split it over several \
                 folders (--out)",
                points.len() * seeds.len()
            )));
        }
        let mut list = List {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION").into(),
            spec: spec.clone(),
            parameters: parameters.into_iter().collect(),
            cases: vec![],
        };
        let mut known = IndexSet::new();
        for point in &points {
            for &seed in &seeds {
                let case = case(source, spec, &base, point, seed)?;
                // A value that is listed twice is run only once.
                if known.insert(case.id.clone()) {
                    list.cases.push(Case { number: list.cases.len() + 1, ..case });
                }
            }
        }
        Ok(list)
    }

    /// Finds a case by its id or number.
    pub fn case(&self, name: &str) -> Result<&Case, SweepError> {
        let number = name.parse::<usize>().ok();
        let found = self.cases.iter().find(|c| c.id == name || Some(c.number) == number);
        found.ok_or_else(|| {
            SweepError::Usage(format!(
                "there is no case {name}; give an id, or a number from 1 to {}: `grainscope sweep \
                 list` shows them",
                self.cases.len()
            ))
        })
    }
}

/// Every combination of the values.
fn points(varied: &[Vary], spec: &Spec) -> Result<Vec<Point>, SweepError> {
    let ranges: Vec<(&String, Range)> = varied
        .iter()
        .filter_map(|v| match v.values {
            Values::Range(range) => Some((&v.name, range)),
            Values::List(_) => None,
        })
        .collect();
    let sampled: Vec<Point> = match (spec.sampling()?, ranges.first()) {
        (None, None) => vec![vec![]],
        (None, Some((name, _))) => {
            return Err(SweepError::Usage(format!(
                "--vary {name}: the range has no number of values; add it, as in \
                 {name}=from..to:count, or --sample sobol:64 to sample it"
            )));
        }
        (Some(_), None) => {
            return Err(SweepError::Usage(
                "--sample: there is nothing to sample; vary a range without a count, such as \
                 --vary alpha=0..10"
                    .into(),
            ));
        }
        (Some(sample), Some(_)) => {
            let bounds: Vec<Range> = ranges.iter().map(|(_, range)| *range).collect();
            let named = |values: Vec<String>| {
                ranges.iter().map(|(name, _)| name.to_string()).zip(values).collect()
            };
            sample.points(&bounds).into_iter().map(named).collect()
        }
    };
    let lists = varied.iter().filter_map(|v| match &v.values {
        Values::List(list) => Some((&v.name, list)),
        Values::Range(_) => None,
    });
    let mut points = vec![vec![]];
    for (name, list) in lists {
        let with = |point: &Point| -> Vec<Point> {
            let longer = |value: &String| {
                let pair = (name.clone(), value.clone());
                point.iter().cloned().chain([pair]).collect()
            };
            list.iter().map(longer).collect()
        };
        points = points.iter().flat_map(with).collect();
        if points.len() > MOST {
            break;
        }
    }
    let joined = |point: &Point| -> Vec<Point> {
        sampled.iter().map(|s| point.iter().chain(s).cloned().collect()).collect()
    };
    Ok(points.iter().flat_map(joined).collect())
}

/// Seeds of each point; `None` keeps the seed of the scene.
fn seeds(base: &Scene, spec: &Spec) -> Result<Vec<Option<u64>>, SweepError> {
    match spec.repeat_seeds {
        0 => Err(SweepError::Usage("--repeat-seeds 0: every case must run at least once".into())),
        1 => Ok(vec![None]),
        n => Ok((0..u64::from(n)).map(|k| Some(base.accuracy.seed + k)).collect()),
    }
}

fn case(
    source: &SceneSource,
    spec: &Spec,
    base: &Scene,
    point: &Point,
    seed: Option<u64>,
) -> Result<Case, SweepError> {
    let mut sets = spec.set.clone();
    sets.extend(point.iter().map(|(name, value)| format!("{name}={value}")));
    if let Some(seed) = seed {
        sets.push(format!("accuracy.seed={seed}"));
        // With regular placement, all seeds would give the same run.
        let chosen = point.iter().any(|(name, _)| name == "accuracy.placement");
        if base.accuracy.placement == Placement::Regular && !chosen {
            sets.push("accuracy.placement=jittered".into());
        }
    }
    let (scene, plan) = resolve(source, &sets).map_err(|e| blame(&e, point))?;
    let scope = Scope::new(&scene)?;
    let number = |(name, value): &(String, String)| {
        let known = scope.get(name);
        let value = known.or_else(|| Quantity::expression(value.as_str()).eval(&scope).ok())?;
        Some((name.clone(), value))
    };
    let plan_of = &plan;
    Ok(Case {
        id: id_of(&scene),
        number: 0,
        values: point.iter().cloned().collect(),
        numbers: point.iter().filter_map(number).collect(),
        seed,
        sets,
        end: plan_of.clock.end * plan_of.units.time,
        unknowns: plan.unknowns_per_node() * plan.mesh.nodes() + 3 * plan.mesh.cells(),
        memory: Memory::of(&plan).total() as u64,
    })
}

/// Turns an error of a scene into one that names the varied values.
fn blame(error: &SceneError, point: &Point) -> SweepError {
    let message = error.message().replacen("--set ", "--vary ", 1);
    let at: Vec<String> = point.iter().map(|(name, value)| format!("{name}={value}")).collect();
    let at = if at.is_empty() { "the scene".to_owned() } else { format!("case {}", at.join(" ")) };
    SweepError::Scene(SceneError::new(
        format!("{at}: {message}"),
        error.remedy().unwrap_or_default(),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::presets;

    fn list(vary: &[&str], change: impl Fn(&mut Spec)) -> Result<List, SweepError> {
        let mut spec = Spec {
            name: "test".into(),
            scene: "silo".into(),
            set: vec!["accuracy.cells=2".into()],
            vary: vary.iter().map(|v| v.to_string()).collect(),
            repeat_seeds: 1,
            ..Spec::default()
        };
        change(&mut spec);
        List::new(&presets::find("silo").expect("listed"), &spec)
    }

    fn ids(list: &List) -> Vec<&str> {
        list.cases.iter().map(|c| c.id.as_str()).collect()
    }

    #[test]
    fn ids_do_not_depend_on_the_order() {
        let one = list(&["alpha=0,1/3", "contrast=10,100"], |_| ()).expect("valid");
        let other = list(&["contrast=100,10", "alpha=1/3,0"], |_| ()).expect("valid");
        let (mut a, mut b) = (ids(&one), ids(&other));
        assert_ne!(a, b);
        a.sort();
        b.sort();
        assert_eq!(a, b);
        assert_eq!(a.len(), 4);
        // A setting that repeats a value of the scene does not change the ids.
        let same =
            list(&["alpha=0,1/3", "contrast=10,100"], |s| s.set.push("gravity=[0, -10]".into()));
        assert_eq!(ids(&same.expect("valid")), ids(&one));
        assert_eq!(list(&["alpha=1,1,2"], |_| ()).expect("valid").cases.len(), 2);
    }

    #[test]
    fn cases_know_their_numbers_and_seeds() {
        let list = list(&["alpha=0,5/3"], |s| s.repeat_seeds = 3).expect("valid");
        assert_eq!(list.cases.len(), 6);
        let last = &list.cases[5];
        assert_eq!((last.number, last.seed, last.values["alpha"].as_str()), (6, Some(3), "5/3"));
        assert!((last.numbers["alpha"] - 5.0 / 3.0).abs() < 1e-15);
        assert_eq!(last.label(), "alpha = 5/3, seed = 3");
        assert!(last.memory > 60_000_000 && last.end == 3.8e-3);
        let source = presets::find("silo").expect("listed");
        assert!(last.plan(&source).is_ok());
        let other = source.with_sets(&["contrast=7".into()]).expect("valid");
        assert!(last.plan(&other).expect_err("changed").to_string().contains("has changed"));
        assert_eq!(list.case("2").expect("there").seed, Some(2));
        assert_eq!(list.case(&last.id).expect("there"), last);
        assert!(list.case("7").expect_err("six").to_string().contains("from 1 to 6"));
    }

    #[test]
    fn invalid_sweeps_are_rejected_with_a_reason() {
        for (vary, sample, message) in [
            (&["alpha=0..1"][..], None, "--sample sobol:64"),
            (&["alpha=0,1"], Some("sobol:4"), "nothing to sample"),
            (&["alpha=0", "alpha=1"], None, "varied twice"),
            (&["alhpa=0,1"], None, "case alhpa=0: --vary alhpa=0: there is no parameter `alhpa`"),
            (
                &["alpha=0,200"],
                None,
                "case alpha=200: --vary alpha=200: parameter `alpha` is 200, outside",
            ),
            (&["alpha=0..1:400", "contrast=1..2:400"], None, "more than 100000"),
        ] {
            let set = |spec: &mut Spec| spec.sample = sample.map(String::from);
            let said = match list(vary, set).expect_err(message) {
                SweepError::Scene(e) => e.one_line(),
                other => other.to_string(),
            };
            assert!(said.contains(message), "{vary:?}: {said}");
        }
        let sampled = list(&["alpha=0..10", "contrast=log:1..1e4", "coupling=1,2"], |s| {
            s.sample = Some("sobol:4".into());
        });
        assert_eq!(sampled.expect("valid").cases.len(), 8);
    }
}
