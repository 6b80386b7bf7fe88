//! The way from a scene to a plan: every default, every check.

use super::boundary::{SIDES, add_body_force, side_normal};
use super::change;
use super::material::{CosseratLaw, Material};
use super::meshing::{Line, Refinement, Sizing};
use super::units::power_of_two;
use super::*;
use crate::laws::{cosserat, granular};
use crate::scene::{
    self, BoundaryKind, Direction, Field, GradingTarget, Interesting, Moment, Quantity, SceneError,
    Scope, Shape, WallKind, closest,
};
use crate::space::mesh::Axis;
use crate::space::walls::Obstacle;
use indexmap::IndexMap;

/// Most materials a scene may have.
pub const MAX_MATERIALS: usize = 16;
/// Most cells along a side: beyond it a scene needs more memory than any machine here has.
const MAX_CELLS: usize = 4096;
/// Most cells in all: about 10 kB each with the factor.
const MAX_TOTAL_CELLS: usize = 1_000_000;
/// Okabe-Ito colours, told apart by colour-blind readers; first the usual background grey.
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

type Result<T> = std::result::Result<T, SceneError>;

/// Checks a scene and decides what will be solved.
pub fn resolve(scene: &Scene) -> Result<Plan> {
    let mut plan = resolve_without_schedule(scene)?;
    let mut current = scene.clone();
    current.schedule.clear();
    for (index, change) in scene.schedule.iter().enumerate() {
        change::apply(&mut current, change, index)?;
        let scope = Scope::new(&current)?;
        let when = match (&change.time, change.step) {
            (Some(t), None) => When::Time(t.eval(&scope)? / plan.units.time),
            (None, Some(step)) => When::Step(step),
            _ => {
                return Err(SceneError::new(
                    format!("schedule[{index}]: give either `time` or `step`"),
                    "one of them says when the change takes effect",
                ));
            }
        };
        let other = resolve_without_schedule(&current)?;
        if let Some(what) = plan.beyond_matter(&other) {
            return Err(SceneError::new(
                format!(
                    "schedule[{index}] changes {what}; only constant material values and gravity \
                     may change"
                ),
                "such a change needs a run of its own",
            ));
        }
        if !follows(&plan.changes, when) {
            return Err(SceneError::new(
                format!("schedule[{index}] does not come after the entries above it"),
                "order the entries of [[schedule]] that have a time, and those that have a step",
            ));
        }
        let mut state = Si::new(&current, &scope)?.matter(&plan.units);
        state.relaxation = relaxation(&state, &plan.mesh);
        let label =
            change.set.iter().map(|(k, v)| format!("{k} = {v}")).collect::<Vec<_>>().join(", ");
        plan.changes.push(PlannedChange { when, state, label });
    }
    for change in &plan.changes {
        if let When::Time(t) = change.when
            && t < plan.clock.end
        {
            plan.clock.stops.push(t);
        }
    }
    plan.clock.stops.sort_by(f64::total_cmp);
    let least = 1e-9 * plan.clock.end;
    plan.clock.stops.dedup_by(|b, a| *b - *a < least);
    Ok(plan)
}

/// Whether a change comes after those before it, as far as their kind of instant tells: which step
/// a time will be in is not known yet.
fn follows(before: &[PlannedChange], when: When) -> bool {
    before.iter().all(|c| match (c.when, when) {
        (When::Time(before), When::Time(now)) => before <= now,
        (When::Step(before), When::Step(now)) => before <= now,
        _ => true,
    })
}

/// Steps are at most this many times the relaxation time of a stratification. At rest the solver
/// leaves speeds of its tolerance times the scene's own, and a step moves every particle that
/// far times its number of relaxation times.
const RELAXATIONS: f64 = 1e4;

/// Longest step, some `eta/(rho g L)` with the largest viscosity, for densities that differ.
fn relaxation(matter: &Matter, mesh: &Mesh) -> Option<f64> {
    let largest = |f: fn(&Material) -> f64| matter.materials.iter().map(f).fold(0.0, f64::max);
    let extent = (mesh.x.end() - mesh.x.start()).max(mesh.y.end() - mesh.y.start());
    let weight = largest(|m| m.density) * matter.gravity[0].hypot(matter.gravity[1]) * extent;
    (weight > 0.0 && matter.is_stratified())
        .then(|| RELAXATIONS * largest(|m| m.viscosity) / weight)
}

/// Ratio of viscosities from which on drops in a thin fluid are worth a warning: the silo took
/// steps of a tenth of the usual at 1e5.
const THIN: f64 = 1e5;

/// A dense material beside a lighter one that is far thinner, the farthest apart.
fn thin_fluid(materials: &[SiMaterial]) -> Option<Warning> {
    let pairs = materials.iter().flat_map(|a| materials.iter().map(move |b| (a, b)));
    let ratio = |a: &SiMaterial, b: &SiMaterial| a.viscosity / b.viscosity;
    pairs
        .filter(|(a, b)| a.density > b.density && ratio(a, b) >= THIN)
        .max_by(|(a, b), (c, d)| ratio(a, b).total_cmp(&ratio(c, d)))
        .map(|(a, b)| Warning::ThinFluid {
            dense: a.name.clone(),
            thin: b.name.clone(),
            ratio: ratio(a, b),
        })
}

/// Materials and gravity in SI units, checked.
struct Si {
    materials: Vec<SiMaterial>,
    gravity: [f64; 2],
    warnings: Vec<Warning>,
}

struct SiMaterial {
    name: String,
    viscosity: f64,
    viscosity_field: Option<FieldFn>,
    density: f64,
    density_field: Option<FieldFn>,
    compliance: f64,
    rotation: Option<CosseratLaw>,
    layer_viscosity: Option<f64>,
    background: bool,
}

impl Si {
    fn new(scene: &Scene, scope: &Scope) -> Result<Si> {
        let gravity = [scene.gravity[0].eval(scope)?, scene.gravity[1].eval(scope)?];
        let corner = |q: &[Quantity; 2]| -> Result<[f64; 2]> { pair(q, scope) };
        let (x, y) = (corner(&scene.domain.x)?, corner(&scene.domain.y)?);
        if scene.materials.is_empty() || scene.materials.len() > MAX_MATERIALS {
            return Err(SceneError::new(
                format!("the scene has {} materials", scene.materials.len()),
                format!("give 1 to {MAX_MATERIALS} [materials.<name>] tables"),
            ));
        }
        let mut warnings = Vec::new();
        let mut materials = Vec::new();
        let mut errors = Vec::new();
        for (name, m) in &scene.materials {
            match SiMaterial::new(name, m, scope, [x, y], &mut warnings) {
                Ok(m) => materials.push(m),
                Err(e) => errors.push(e),
            }
        }
        SceneError::join(errors)?;
        let backgrounds: Vec<_> =
            materials.iter().filter(|m| m.background).map(|m| m.name.as_str()).collect();
        if backgrounds.len() > 1 {
            return Err(SceneError::new(
                format!("more than one background material: {}", backgrounds.join(", ")),
                "set `background = true` on one of them only",
            ));
        }
        Ok(Si { materials, gravity, warnings })
    }

    fn matter(&self, u: &Units) -> Matter {
        let materials = self
            .materials
            .iter()
            .map(|m| Material {
                name: m.name.clone(),
                viscosity: m.viscosity / u.viscosity,
                carries_viscosity: m.viscosity_field.is_some(),
                density: m.density / u.density,
                carries_density: m.density_field.is_some(),
                compliance: m.compliance * u.viscosity,
                rotation: m.rotation.map(|r| CosseratLaw {
                    coupling: r.coupling / u.viscosity,
                    couple: r.couple / u.couple_viscosity(),
                }),
                layer_viscosity: m.layer_viscosity.map(|v| v / u.viscosity),
                background: m.background,
            })
            .collect();
        let gravity = self.gravity.map(|g| g / u.acceleration());
        Matter { materials, gravity, relaxation: None }
    }
}

/// A viscosity must be above zero.
fn positive(q: &Quantity, scope: &Scope, what: &str) -> Result<f64> {
    let v = q.eval(scope)?;
    if v > 0.0 {
        return Ok(v);
    }
    Err(SceneError::at(q, format!("{what} is {v}"), format!("{what} must be above zero")))
}

fn not_negative(q: &Quantity, scope: &Scope, what: &str) -> Result<f64> {
    let v = q.eval(scope)?;
    if v >= 0.0 {
        return Ok(v);
    }
    Err(SceneError::at(q, format!("{what} is {v}"), format!("{what} must be zero or more")))
}

fn pair(q: &[Quantity; 2], scope: &Scope) -> Result<[f64; 2]> {
    Ok([q[0].eval(scope)?, q[1].eval(scope)?])
}

/// A side of the domain.
fn edge(mut domain: [[f64; 2]; 2], side: usize) -> [[f64; 2]; 2] {
    domain[side_normal(side)] = [domain[side_normal(side)][side % 2]; 2];
    domain
}

/// The domain without its rim, where an acceleration may be infinite: no mass lies on it.
fn middle(domain: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    domain.map(|[a, b]| [a + (b - a) / 128.0, b - (b - a) / 128.0])
}

/// Smallest and largest value of a field on a 65 x 65 grid over the domain.
fn range_of(f: &FieldFn, [x, y]: [[f64; 2]; 2]) -> [f64; 2] {
    if let Some(v) = f.constant() {
        return [v, v];
    }
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for j in 0..=64 {
        for i in 0..=64 {
            let at = |[a, b]: [f64; 2], k: usize| a + (b - a) * k as f64 / 64.0;
            let v = f.at(at(x, i), at(y, j));
            if !v.is_finite() {
                return [f64::NAN, f64::NAN];
            }
            range = [range[0].min(v), range[1].max(v)];
        }
    }
    range
}

fn finite_range(q: &Field, f: &FieldFn, domain: [[f64; 2]; 2], what: &str) -> Result<[f64; 2]> {
    let range = range_of(f, domain);
    if range[0].is_finite() {
        return Ok(range);
    }
    Err(SceneError::at(
        q,
        format!("{what} is not finite everywhere in the domain"),
        "look for a division by zero, a root or logarithm of a negative number",
    ))
}

impl SiMaterial {
    fn new(
        name: &str,
        m: &scene::Material,
        scope: &Scope,
        domain: [[f64; 2]; 2],
        warnings: &mut Vec<Warning>,
    ) -> Result<SiMaterial> {
        let density = m.density.compile(scope)?;
        let density_range = finite_range(&m.density, &density, domain, "density")?;
        if density.constant().is_some_and(|d| d < 0.0) {
            return Err(SceneError::at(
                &m.density,
                format!("material `{name}`: density is {}", density_range[0]),
                "density must be zero or more",
            ));
        }
        let contacts = m
            .granular
            .as_ref()
            .map(|g| -> Result<_> {
                let porosity = g.porosity.eval(scope)?;
                if !(0.0..1.0).contains(&porosity) {
                    return Err(SceneError::at(
                        &g.porosity,
                        format!("porosity is {porosity}"),
                        "porosity is the void share: 0 or more, below 1",
                    ));
                }
                Ok(granular::viscosities(&granular::Contacts {
                    porosity,
                    coordination: positive(&g.coordination, scope, "coordination")?,
                    normal_dashpot: positive(&g.normal_dashpot, scope, "normal_dashpot")?,
                    tangential_dashpot: not_negative(
                        &g.tangential_dashpot,
                        scope,
                        "tangential_dashpot",
                    )?,
                }))
            })
            .transpose()?;
        let (shear, range) = match (&m.shear_viscosity, contacts) {
            (Some(q), None) => {
                let f = q.compile(scope)?;
                let range = finite_range(q, &f, domain, "shear_viscosity")?;
                if range[0] <= 0.0 {
                    return Err(SceneError::at(
                        q,
                        format!("material `{name}`: shear_viscosity is {}", range[0]),
                        "shear_viscosity must be above zero everywhere",
                    ));
                }
                (f, range)
            }
            (None, Some(c)) => (FieldFn::Constant(c.shear), [c.shear; 2]),
            (Some(q), Some(_)) => {
                return Err(SceneError::at(
                    q,
                    format!("material `{name}` has both shear_viscosity and granular"),
                    "give one of them",
                ));
            }
            (None, None) => {
                return Err(SceneError::new(
                    format!("material `{name}` has no viscosity"),
                    "give shear_viscosity = <Pa s>, or a granular table",
                ));
            }
        };
        let coupling = match (&m.coupling_viscosity, contacts) {
            (Some(q), _) => not_negative(q, scope, "coupling_viscosity")?,
            (None, Some(c)) => c.coupling,
            (None, None) => 0.0,
        };
        let couple = match (&m.internal_length, &m.couple_viscosity) {
            (Some(r), None) => {
                cosserat::couple_viscosity(coupling, not_negative(r, scope, "internal_length")?)
            }
            (None, Some(q)) => not_negative(q, scope, "couple_viscosity")?,
            (None, None) => 0.0,
            (Some(q), Some(_)) => {
                return Err(SceneError::at(
                    q,
                    format!("material `{name}` has both internal_length and couple_viscosity"),
                    "give one of them: couple_viscosity = 2 coupling_viscosity internal_length^2",
                ));
            }
        };
        let rotation = (coupling > 0.0 && couple > 0.0).then_some(CosseratLaw { coupling, couple });
        let length_alone =
            coupling == 0.0 && m.internal_length.is_some() && m.coupling_viscosity.is_none();
        if length_alone || coupling > 0.0 && couple == 0.0 && m.internal_length.is_none() {
            warnings.push(Warning::NoInternalLength { material: name.into() });
        }
        let bulk = match (&m.bulk_viscosity, contacts, &m.granular) {
            (Some(q), ..) => Some(positive(q, scope, "bulk_viscosity")?),
            (None, Some(c), Some(g)) if !g.incompressible => Some(c.bulk),
            _ => None,
        };
        let layer = m
            .layer_viscosity
            .as_ref()
            .map(|q| positive(q, scope, "layer_viscosity"))
            .transpose()?
            .filter(|&eta_s| shear.constant() != Some(eta_s));
        if let Some(eta_s) = layer
            && eta_s > range[0]
        {
            warnings.push(Warning::StiffLayers { material: name.into(), ratio: eta_s / range[0] });
        }
        let varying = |f: FieldFn| f.constant().is_none().then_some(f);
        // A particle that changes its volume keeps its mass: it carries its own density.
        let density_field = if bulk.is_some() && density_range != [0.0; 2] {
            Some(density)
        } else {
            varying(density)
        };
        let out = SiMaterial {
            name: name.into(),
            viscosity: range[1],
            density: density_range[1].max(0.0),
            viscosity_field: varying(shear),
            density_field,
            compliance: bulk.map_or(0.0, |b| 1.0 / b),
            rotation,
            layer_viscosity: layer,
            background: m.background,
        };
        if out.background
            && (out.viscosity_field.is_some()
                || out.density_field.is_some()
                || out.layer_viscosity.is_some()
                || out.rotation.is_some()
                || out.compliance > 0.0)
        {
            return Err(SceneError::new(
                format!("the background `{name}` carries a history"),
                "a background has no history: constant density and viscosity, incompressible, no \
                 layers, no internal length; else set background = false",
            ));
        }
        Ok(out)
    }
}

/// What the scene's own numbers say of length, viscosity, time and density.
fn choose_units(
    scene: &Scene,
    scope: &Scope,
    si: &Si,
    domain: [[f64; 2]; 2],
    length: f64,
) -> Result<Units> {
    let viscosity = si.materials.iter().map(|m| m.viscosity).fold(0.0, f64::max);
    let density = si.materials.iter().map(|m| m.density).fold(0.0, f64::max);
    let gravity = si.gravity[0].hypot(si.gravity[1]);
    let mut rate = density * gravity * length / viscosity;
    let largest = |f: &Field, place: [[f64; 2]; 2]| -> Result<f64> {
        let range = finite_range(f, &f.compile(scope)?, place, "this value")?;
        Ok(range[0].abs().max(range[1].abs()))
    };
    let b = &scene.boundaries;
    for (s, side) in [&b.left, &b.right, &b.bottom, &b.top].into_iter().enumerate() {
        let largest = |f: &Field| largest(f, edge(domain, s));
        for v in [&side.velocity_x, &side.velocity_y].into_iter().flatten() {
            rate = rate.max(largest(v)? / length);
        }
        for t in [&side.traction_x, &side.traction_y].into_iter().flatten() {
            rate = rate.max(largest(t)? / viscosity);
        }
        if let Some(w) = &side.rotation {
            rate = rate.max(largest(w)?);
        }
    }
    if let Some(f) = &scene.body_force {
        rate = rate.max(largest(&f.x, domain)?.max(largest(&f.y, domain)?) * length / viscosity);
        rate = rate.max(largest(&f.couple, domain)? / viscosity);
    }
    if let Some(a) = &scene.acceleration {
        let inside = middle(domain);
        let size = largest(&a.x, inside)?.max(largest(&a.y, inside)?);
        rate = rate.max(density * size * length / viscosity);
    }
    let end = scene.time.end.eval(scope)?;
    let time = if rate > 0.0 { 1.0 / rate } else { end };
    Ok(Units {
        length: power_of_two(length),
        viscosity: power_of_two(viscosity),
        time: power_of_two(time),
        density: power_of_two(density),
    })
}

fn resolve_without_schedule(scene: &Scene) -> Result<Plan> {
    let ordinary = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if scene.name.is_empty() || scene.name.len() > 100 || !scene.name.chars().all(ordinary) {
        return Err(SceneError::new(
            format!("the scene's name is {:?}", scene.name),
            "it names folders: use 1 to 100 letters, digits, `_` and `-`",
        ));
    }
    let scope = &Scope::new(scene)?;
    let (x, y) = (pair(&scene.domain.x, scope)?, pair(&scene.domain.y, scope)?);
    for (name, range, q) in [("x", x, &scene.domain.x), ("y", y, &scene.domain.y)] {
        if range[1] <= range[0] {
            return Err(SceneError::at(
                &q[1],
                format!("domain.{name} is empty: [{}, {}]", range[0], range[1]),
                "the second number must be above the first",
            ));
        }
    }
    let domain = [x, y];
    let length = match &scene.domain.length_scale {
        Some(q) => positive(q, scope, "length_scale")?,
        None => (x[1] - x[0]).min(y[1] - y[0]),
    };
    // Every material and region is checked, also those that are nowhere to be seen.
    let mut warnings = Vec::new();
    regions(scene, scope, domain, &Si::new(scene, scope)?, &mut warnings)?;
    let (whole, scene) = (scene, &placed(scene));
    for name in whole.materials.keys().filter(|name| !scene.materials.contains_key(*name)) {
        if !whole.materials[name].background {
            warnings.push(Warning::MaterialUnused { material: name.clone() });
        }
    }
    let si = Si::new(scene, scope)?;
    let units = choose_units(scene, scope, &si, domain, length)?;
    let mut state = si.matter(&units);
    warnings.extend(si.warnings.iter().cloned());

    let walls = Walls::new(scene, scope, domain)?;
    let gauges = gauges(scene, scope, domain)?;
    interest(scene)?;
    let mesh = Arc::new(mesh(scene, scope, domain, length, &walls, &gauges, &units)?);
    state.relaxation = relaxation(&state, &mesh);
    let sides = sides(scene, scope, domain)?;
    let boundary = boundary(sides, &walls, &mesh, &units, &state)?;
    let mut enclosure = walls.enclosure(scene, &mesh, &units);
    for (s, side) in boundary.sides.iter().enumerate() {
        let through =
            side.velocity[side_normal(s)].as_ref().is_some_and(|f| f.constant() != Some(0.0));
        // What flows out takes its particles along.
        enclosure.open[s] |= through;
        if through {
            warnings.push(Warning::ThroughFlow { place: format!("boundaries.{}", SIDES[s]) });
        }
    }

    let regions = regions(scene, scope, domain, &si, &mut Vec::new())?;
    let has_density = si.materials.iter().any(|m| m.density > 0.0 || m.density_field.is_some());
    let effects = EffectSet {
        rotation: si.materials.iter().any(|m| m.rotation.is_some()),
        directors: si.materials.iter().any(|m| m.layer_viscosity.is_some()),
        carried_viscosity: si.materials.iter().any(|m| m.viscosity_field.is_some()),
        carried_density: si.materials.iter().any(|m| m.density_field.is_some()),
        volume_change: si.materials.iter().any(|m| m.compliance > 0.0),
        gravity: si.gravity != [0.0; 2] && has_density,
    };
    if !effects.rotation {
        for (name, side) in SIDES.iter().zip(&boundary.sides) {
            if side.rotation.is_some() {
                warnings.push(Warning::RotationUnused { place: format!("boundaries.{name}") });
            }
        }
    }
    let density = si.materials.iter().map(|m| m.density).fold(0.0, f64::max);
    let viscosity = si.materials.iter().map(|m| m.viscosity).fold(0.0, f64::max);
    let reynolds = density / units.time * length * length / viscosity;
    if reynolds > 1.0 {
        warnings.push(Warning::Inertia { reynolds });
    }
    if effects.gravity {
        warnings.extend(thin_fluid(&si.materials));
    }
    let body_force = scene
        .body_force
        .as_ref()
        .map(|f| {
            Ok::<_, SceneError>([
                f.x.compile(scope)?,
                f.y.compile(scope)?,
                f.couple.compile(scope)?,
            ])
        })
        .transpose()?;
    let acceleration = scene
        .acceleration
        .as_ref()
        .map(|a| {
            let compile = |f: &Field| -> Result<FieldFn> {
                let compiled = f.compile(scope)?;
                finite_range(f, &compiled, middle(domain), "acceleration")?;
                Ok(compiled)
            };
            Ok::<_, SceneError>([compile(&a.x)?, compile(&a.y)?])
        })
        .transpose()?
        .filter(|_| has_density);
    check_null_spaces(scene, &boundary, &mesh, &units, &effects, body_force.as_ref())?;

    let initial = si
        .materials
        .iter()
        .map(|m| InitialFields {
            viscosity: m.viscosity_field.clone(),
            density: m.density_field.clone(),
        })
        .collect();
    let gauges = gauges.into_iter().map(|g| g.scaled(&mesh, &units)).collect();
    let (tracers, marks) = dye(scene, scope, length, &units)?;
    Ok(Plan {
        scene: whole.clone(),
        units,
        enclosure,
        boundary,
        state,
        changes: vec![],
        regions,
        initial,
        body_force,
        acceleration,
        gauges,
        tracers,
        marks,
        method: Method {
            stabilisation: Some(scene.accuracy.stabilisation)
                .filter(|&share| share > 0.0 && effects.gravity),
            ..method(scene)?
        },
        clock: clock(scene, scope, &units)?,
        picture: picture(scene)?,
        effects,
        warnings,
        mesh,
    })
}

/// Walls and blocks in SI coordinates.
struct Walls {
    walls: Vec<SiWall>,
    blocks: Vec<([[f64; 2]; 2], WallKind)>,
}

struct SiWall {
    name: String,
    normal: usize,
    at: f64,
    along: [f64; 2],
    /// Which ends are free, inside the domain and on no other wall.
    kind: WallKind,
    rotation: Option<f64>,
}

/// A segment along a coordinate direction: (normal, at, along), or what is wrong with it.
fn axis_segment(
    what: &str,
    from: &[Quantity; 2],
    to: &[Quantity; 2],
    scope: &Scope,
    [x, y]: [[f64; 2]; 2],
) -> Result<(usize, f64, [f64; 2])> {
    let (a, b) = (pair(from, scope)?, pair(to, scope)?);
    let size = (x[1] - x[0]).max(y[1] - y[0]);
    let tiny = 1e-9 * size;
    for (p, q) in [(a, from), (b, to)] {
        if p[0] < x[0] - tiny || p[0] > x[1] + tiny || p[1] < y[0] - tiny || p[1] > y[1] + tiny {
            return Err(SceneError::at(
                &q[0],
                format!("{what} reaches ({}, {}), outside the domain", p[0], p[1]),
                format!("the domain is x = {} to {}, y = {} to {}", x[0], x[1], y[0], y[1]),
            ));
        }
    }
    let (dx, dy) = ((a[0] - b[0]).abs(), (a[1] - b[1]).abs());
    if dx > tiny && dy > tiny {
        return Err(SceneError::at(
            &to[0],
            format!("{what} is slanted: from ({}, {}) to ({}, {})", a[0], a[1], b[0], b[1]),
            "walls and gauges follow mesh lines: make both x or both y equal",
        ));
    }
    if dx <= tiny && dy <= tiny {
        return Err(SceneError::at(
            &to[0],
            format!("{what} has no length"),
            "`from` and `to` must differ in x or in y",
        ));
    }
    let normal = usize::from(dx > dy);
    let (s, t) = (a[1 - normal], b[1 - normal]);
    Ok((normal, a[normal], [s.min(t), s.max(t)]))
}

impl Walls {
    fn new(scene: &Scene, scope: &Scope, domain: [[f64; 2]; 2]) -> Result<Walls> {
        let mut errors = Vec::new();
        let mut walls = Vec::new();
        for w in &scene.walls {
            let rotation = w.rotation.as_ref().map(|q| q.eval(scope)).transpose();
            match (
                axis_segment(&format!("wall `{}`", w.name), &w.from, &w.to, scope, domain),
                rotation,
            ) {
                (Ok((normal, at, along)), Ok(rotation)) => {
                    walls.push(SiWall {
                        name: w.name.clone(),
                        normal,
                        at,
                        along,
                        kind: w.kind,
                        rotation,
                    });
                }
                (Err(e), _) | (_, Err(e)) => errors.push(e),
            }
        }
        let mut blocks = Vec::new();
        for b in &scene.blocks {
            let (bx, by) = (pair(&b.x, scope)?, pair(&b.y, scope)?);
            for (c, r) in [bx, by].into_iter().enumerate() {
                if r[0] >= r[1] || r[0] < domain[c][0] || r[1] > domain[c][1] {
                    errors.push(SceneError::at(
                        if c == 0 { &b.x[0] } else { &b.y[0] },
                        format!("block `{}` is empty or reaches outside the domain", b.name),
                        "give [low, high] inside the domain",
                    ));
                }
            }
            blocks.push(([bx, by], b.kind));
        }
        SceneError::join(errors)?;
        Ok(Walls { walls, blocks })
    }

    /// The lips of apertures: ends of walls that face each other across a gap. (Grading towards
    /// the upper ends of the silo's side walls too takes 1.6 times the cells and changes the
    /// initial discharge by 1e-5.)
    fn lips(&self, domain: [[f64; 2]; 2]) -> Vec<[f64; 2]> {
        let tips = self.tips(domain);
        tips.iter().filter(|t| tips.iter().any(|o| t.faces(o))).map(|t| t.at).collect()
    }

    /// Ends of walls that stop inside the domain and on no other wall.
    fn tips(&self, [x, y]: [[f64; 2]; 2]) -> Vec<Tip> {
        let mut tips = Vec::new();
        for (k, w) in self.walls.iter().enumerate() {
            for (end, up) in w.along.into_iter().zip([false, true]) {
                let p = if w.normal == 0 { [w.at, end] } else { [end, w.at] };
                let tiny = 1e-9 * (x[1] - x[0]).max(y[1] - y[0]);
                let inside = p[0] > x[0] + tiny
                    && p[0] < x[1] - tiny
                    && p[1] > y[0] + tiny
                    && p[1] < y[1] - tiny;
                let on_other = self.walls.iter().enumerate().any(|(m, o)| {
                    m != k
                        && (p[o.normal] - o.at).abs() <= tiny
                        && p[1 - o.normal] >= o.along[0] - tiny
                        && p[1 - o.normal] <= o.along[1] + tiny
                });
                if inside && !on_other {
                    tips.push(Tip { at: p, normal: w.normal, up });
                }
            }
        }
        tips
    }

    fn enclosure(&self, scene: &Scene, mesh: &Mesh, units: &Units) -> Enclosure {
        let l = units.length;
        let mut obstacles: Vec<Obstacle> = self
            .walls
            .iter()
            .map(|w| {
                let (across, along) =
                    if w.normal == 0 { (&mesh.x, &mesh.y) } else { (&mesh.y, &mesh.x) };
                let on = |axis: &Axis, v: f64| axis.lines()[axis.nearest_line(v / l)];
                Obstacle {
                    normal: w.normal,
                    at: on(across, w.at),
                    from: on(along, w.along[0]),
                    to: on(along, w.along[1]),
                }
            })
            .collect();
        for (range, _) in &self.blocks {
            for normal in 0..2 {
                for at in range[normal] {
                    let [from, to] = range[1 - normal].map(|v| v / l);
                    obstacles.push(Obstacle { normal, at: at / l, from, to });
                }
            }
        }
        let b = &scene.boundaries;
        let open = [&b.left, &b.right, &b.bottom, &b.top].map(|s| s.kind == BoundaryKind::Open);
        Enclosure { obstacles, open }
    }
}

/// A gauge in SI coordinates.
struct SiGauge {
    name: String,
    normal: usize,
    at: f64,
    along: [f64; 2],
    direction: Direction,
    material: u8,
}

impl SiGauge {
    fn scaled(self, mesh: &Mesh, units: &Units) -> Gauge {
        let l = units.length;
        let (across, along) =
            if self.normal == 0 { (&mesh.x, &mesh.y) } else { (&mesh.y, &mesh.x) };
        let on = |axis: &Axis, v: f64| axis.lines()[axis.nearest_line(v / l)];
        Gauge {
            name: self.name,
            normal: self.normal,
            at: on(across, self.at),
            from: on(along, self.along[0]),
            to: on(along, self.along[1]),
            sign: match self.direction {
                Direction::Right | Direction::Up => 1.0,
                Direction::Left | Direction::Down => -1.0,
            },
            material: self.material,
        }
    }
}

fn material_index<'a>(
    materials: &'a IndexMap<String, scene::Material>,
    name: &str,
    user: &str,
) -> Result<u8> {
    materials.get_index_of(name).map(|i| i as u8).ok_or_else(|| {
        let known: Vec<&'a str> = materials.keys().map(String::as_str).collect();
        let guess = closest(name, known.iter().copied())
            .map_or(String::new(), |g| format!("did you mean `{g}`? "));
        SceneError::new(
            format!("{user} names the material `{name}`, which does not exist"),
            format!("{guess}materials: {}", known.join(", ")),
        )
    })
}

fn gauges(scene: &Scene, scope: &Scope, domain: [[f64; 2]; 2]) -> Result<Vec<SiGauge>> {
    let mut list: Vec<SiGauge> = Vec::new();
    for g in &scene.gauges {
        let what = format!("gauge `{}`", g.name);
        let (normal, at, along) = axis_segment(&what, &g.from, &g.to, scope, domain)?;
        let wanted = usize::from(matches!(g.direction, Direction::Up | Direction::Down));
        if normal != wanted {
            return Err(SceneError::at(
                &g.from[0],
                format!("{what}: its direction runs along the segment"),
                "a horizontal gauge counts `up` or `down`, a vertical one `left` or `right`",
            ));
        }
        if list.iter().any(|o| o.name == g.name) {
            return Err(SceneError::new(
                format!("two gauges are named `{}`", g.name),
                "rename one",
            ));
        }
        let material = material_index(&scene.materials, &g.material, &what)?;
        list.push(SiGauge {
            name: g.name.clone(),
            normal,
            at,
            along,
            direction: g.direction,
            material,
        });
    }
    Ok(list)
}

/// Checks what the scene is made for against what it has.
fn interest(scene: &Scene) -> Result<()> {
    let Some(i) = &scene.interest else { return Ok(()) };
    let fault = |what: String, help: &str| Err(SceneError::new(format!("interest: {what}"), help));
    if let Interesting::Gauge(name) | Interesting::Rate(name) = &i.quantity
        && !scene.gauges.iter().any(|g| g.name == *name)
    {
        let names: Vec<&str> = scene.gauges.iter().map(|g| g.name.as_str()).collect();
        let meant = closest(name, names.iter().copied());
        let help = match meant {
            Some(meant) => format!("did you mean `{meant}`?"),
            None => format!("gauges of this scene: {}", names.join(", ")),
        };
        return fault(format!("there is no gauge `{name}`"), &help);
    }
    let field =
        matches!(i.quantity, Interesting::Velocity | Interesting::Rotation | Interesting::Pressure);
    if field && i.at == Moment::Peak {
        return fault("a field has no peak".into(), "give at = \"start\" or at = \"end\"");
    }
    if i.quantity == Interesting::Alignment
        && !scene.materials.values().any(|m| m.layer_viscosity.is_some())
    {
        return fault(
            "nothing has directors whose alignment could be read".into(),
            "give a material a layer_viscosity, or be interested in something else",
        );
    }
    Ok(())
}

fn mesh(
    scene: &Scene,
    scope: &Scope,
    domain: [[f64; 2]; 2],
    length: f64,
    walls: &Walls,
    gauges: &[SiGauge],
    units: &Units,
) -> Result<Mesh> {
    if scene.accuracy.cells == 0 {
        return Err(SceneError::new(
            "accuracy.cells is 0",
            "give 1 or more cells per length_scale",
        ));
    }
    let size = length / f64::from(scene.accuracy.cells);
    let growth = scene.mesh.growth;
    if !(growth > 1.0 && growth <= 2.0) {
        return Err(SceneError::new(
            format!("mesh.growth is {growth}"),
            "neighbouring cells may differ by a ratio above 1, at most 2; 1.5 is usual",
        ));
    }
    let mut lines: [Vec<Line>; 2] = [vec![], vec![]];
    let mut demand = |c: usize, at: f64, owner: &str, explicit: bool| {
        lines[c].push(Line { at, owner: owner.into(), explicit });
    };
    for (c, range) in domain.into_iter().enumerate() {
        demand(c, range[0], SIDES[2 * c], false);
        demand(c, range[1], SIDES[2 * c + 1], false);
    }
    for w in &walls.walls {
        let owner = format!("wall `{}`", w.name);
        demand(w.normal, w.at, &owner, false);
        w.along.iter().for_each(|&v| demand(1 - w.normal, v, &owner, false));
    }
    for (b, s) in walls.blocks.iter().zip(&scene.blocks) {
        for c in 0..2 {
            b.0[c].iter().for_each(|&v| demand(c, v, &format!("block `{}`", s.name), false));
        }
    }
    for g in gauges {
        let owner = format!("gauge `{}`", g.name);
        demand(g.normal, g.at, &owner, false);
        g.along.iter().for_each(|&v| demand(1 - g.normal, v, &owner, false));
    }
    for (c, list) in [&scene.mesh.lines_x, &scene.mesh.lines_y].into_iter().enumerate() {
        for q in list {
            let v = q.eval(scope)?;
            if v < domain[c][0] || v > domain[c][1] {
                return Err(SceneError::at(
                    q,
                    format!("the mesh line at {v} is outside the domain"),
                    format!("choose {} to {}", domain[c][0], domain[c][1]),
                ));
            }
            demand(c, v, "mesh", true);
        }
    }
    let refinements = refinements(scene, scope, domain, walls)?;
    let periodic = periodic(scene)?;
    let mut axes = Vec::new();
    for (c, demanded) in lines.into_iter().enumerate() {
        let sizing = Sizing { size, refinements: refinements[c].clone(), growth };
        let estimate = (domain[c][1] - domain[c][0]) / size;
        if estimate > MAX_CELLS as f64 {
            return Err(SceneError::new(
                format!("the mesh would have {estimate:.0} cells along {}", ["x", "y"][c]),
                format!("lower accuracy.cells; at most {MAX_CELLS} cells per side are allowed"),
            ));
        }
        let out = sizing.lines(demanded).map_err(|e| {
            let gap = e.second.at - e.first.at;
            SceneError::new(
                format!(
                    "{} at {} = {:.6} and {} at {:.6} are closer than a cell ({:.3e} < {:.3e} m)",
                    e.first.owner,
                    ["x", "y"][c],
                    e.first.at,
                    e.second.owner,
                    e.second.at,
                    gap,
                    e.size
                ),
                format!(
                    "move them apart or together, or raise accuracy.cells to at least {:.0}",
                    (f64::from(scene.accuracy.cells) * e.size / gap).ceil()
                ),
            )
        })?;
        if out.len() - 1 > MAX_CELLS {
            return Err(SceneError::new(
                format!("the mesh would have {} cells along {}", out.len() - 1, ["x", "y"][c]),
                format!(
                    "lower accuracy.cells or the grading (mesh.grading = [] for none); at most {MAX_CELLS}"
                ),
            ));
        }
        // A periodic axis needs two cells, or a node would be its own neighbour.
        if periodic[c] && out.len() < 3 {
            return Err(SceneError::new(
                format!("a periodic domain one cell wide along {}", ["x", "y"][c]),
                "raise accuracy.cells so that it has at least two",
            ));
        }
        axes.push(Axis::new(out.into_iter().map(|v| v / units.length).collect(), periodic[c]));
    }
    let y = axes.pop();
    let x = axes.pop();
    let (Some(x), Some(y)) = (x, y) else { unreachable!("two axes were made") };
    if x.cells() * y.cells() > MAX_TOTAL_CELLS {
        return Err(SceneError::new(
            format!("the mesh would have {} x {} cells", x.cells(), y.cells()),
            format!(
                "lower accuracy.cells or the grading (mesh.grading = [] for none): at most \
                 {MAX_TOTAL_CELLS} cells fit into memory"
            ),
        ));
    }
    let mut mesh = Mesh::new(x, y);
    for cell in 0..mesh.cells() {
        let [px, py] = mesh.cell_centre(cell).map(|v| v * units.length);
        mesh.solid[cell] =
            walls.blocks.iter().any(|([x, y], _)| px > x[0] && px < x[1] && py > y[0] && py < y[1]);
    }
    if mesh.solid.iter().all(|&s| s) {
        return Err(SceneError::new("blocks fill the whole domain", "leave room for a material"));
    }
    Ok(mesh)
}

/// By how much cells shrink towards the lips of apertures unless the scene says otherwise.
///
/// The flow there goes as the square root of the distance, so the error of the discharge is of the
/// size of the lip's cells. Initial discharge of the silo at 6 cells per aperture, over its limit,
/// for alpha = 0 and 1/3: 0.9817, 0.9773 uniform, 0.9975, 0.9968 with 8, 0.9985 (alpha = 0) with
/// 16, where the particles of the cells around are larger than a cell at the lip and its filling
/// becomes noise. With 12 both are within 0.3 %.
const LIP_FACTOR: f64 = 12.0;

/// A free end of a wall.
struct Tip {
    at: [f64; 2],
    /// Of its wall.
    normal: usize,
    /// It is the upper or right end.
    up: bool,
}

impl Tip {
    /// The two are on one line and point at each other.
    fn faces(&self, o: &Tip) -> bool {
        let (n, t) = (self.normal, 1 - self.normal);
        let distance = o.at[t] - self.at[t];
        n == o.normal
            && (o.at[n] - self.at[n]).abs() <= 1e-9 * distance.abs()
            && self.up != o.up
            && self.up == (distance > 0.0)
    }
}

fn refinements(
    scene: &Scene,
    scope: &Scope,
    domain: [[f64; 2]; 2],
    walls: &Walls,
) -> Result<[Vec<Refinement>; 2]> {
    let mut out = [vec![], vec![]];
    let Some(grading) = &scene.mesh.grading else {
        for lip in walls.lips(domain) {
            for c in 0..2 {
                out[c].push(Refinement { at: lip[c], factor: LIP_FACTOR });
            }
        }
        return Ok(out);
    };
    for g in grading {
        let factor = g.factor.eval(scope)?;
        if !(1.0..=1000.0).contains(&factor) {
            return Err(SceneError::at(
                &g.factor,
                format!("grading factor is {factor}"),
                "cells become smaller by this factor: 1 to 1000",
            ));
        }
        match &g.towards {
            GradingTarget::Apertures => {
                let lips = walls.lips(domain);
                let ends = || walls.tips(domain).iter().map(|t| t.at).collect();
                for tip in if lips.is_empty() { ends() } else { lips } {
                    for c in 0..2 {
                        out[c].push(Refinement { at: tip[c], factor });
                    }
                }
            }
            GradingTarget::Walls => {
                let b = &scene.boundaries;
                for (s, side) in [&b.left, &b.right, &b.bottom, &b.top].into_iter().enumerate() {
                    let tangential = if s < 2 { &side.velocity_y } else { &side.velocity_x };
                    if side.kind == BoundaryKind::NoSlip
                        || tangential.is_some()
                        || side.rotation.is_some()
                    {
                        out[s / 2].push(Refinement { at: domain[s / 2][s % 2], factor });
                    }
                }
                for w in walls.walls.iter().filter(|w| w.kind == WallKind::NoSlip) {
                    out[w.normal].push(Refinement { at: w.at, factor });
                }
            }
            GradingTarget::X(q) => out[0].push(Refinement { at: q.eval(scope)?, factor }),
            GradingTarget::Y(q) => out[1].push(Refinement { at: q.eval(scope)?, factor }),
        }
    }
    Ok(out)
}

fn periodic(scene: &Scene) -> Result<[bool; 2]> {
    let b = &scene.boundaries;
    let mut out = [false; 2];
    for (c, (low, high)) in [(&b.left, &b.right), (&b.bottom, &b.top)].into_iter().enumerate() {
        let kinds = [low.kind, high.kind].map(|k| k == BoundaryKind::Periodic);
        if kinds[0] != kinds[1] {
            return Err(SceneError::new(
                format!(
                    "only one of boundaries.{} and boundaries.{} is periodic",
                    SIDES[2 * c],
                    SIDES[2 * c + 1]
                ),
                "periodic sides come in pairs: set kind = \"periodic\" on both",
            ));
        }
        out[c] = kinds[0];
    }
    Ok(out)
}

fn sides(scene: &Scene, scope: &Scope, domain: [[f64; 2]; 2]) -> Result<[Side; 4]> {
    let b = &scene.boundaries;
    let mut out: [Side; 4] = Default::default();
    for (s, side) in [&b.left, &b.right, &b.bottom, &b.top].into_iter().enumerate() {
        let name = format!("boundaries.{}", SIDES[s]);
        let normal = side_normal(s);
        let velocity = [&side.velocity_x, &side.velocity_y];
        let traction = [&side.traction_x, &side.traction_y];
        if side.kind == BoundaryKind::Periodic {
            if let Some(f) =
                velocity.into_iter().chain(traction).chain([&side.rotation]).flatten().next()
            {
                return Err(SceneError::at(
                    f,
                    format!("{name} is periodic and prescribes a value"),
                    "a periodic side has no boundary: remove the value or the kind",
                ));
            }
            out[s].periodic = true;
            continue;
        }
        let compile = |f: &Field| -> Result<FieldFn> {
            let compiled = f.compile(scope)?;
            finite_range(f, &compiled, edge(domain, s), &name)?;
            Ok(compiled)
        };
        for c in 0..2 {
            let held = match side.kind {
                BoundaryKind::NoSlip => true,
                BoundaryKind::FreeSlip => c == normal,
                BoundaryKind::Open | BoundaryKind::Periodic => false,
            };
            let letter = ["x", "y"][c];
            out[s].velocity[c] = match (velocity[c], traction[c]) {
                (Some(v), None) => Some(compile(v)?),
                (None, Some(_)) => None,
                (Some(v), Some(_)) => {
                    return Err(SceneError::at(
                        v,
                        format!("{name} gives both velocity_{letter} and traction_{letter}"),
                        "give one of them",
                    ));
                }
                (None, None) => held.then_some(FieldFn::Constant(0.0)),
            };
            out[s].traction[c] = traction[c].as_ref().map(compile).transpose()?;
        }
        out[s].rotation = side.rotation.as_ref().map(compile).transpose()?;
    }
    Ok(out)
}

fn boundary(
    sides: [Side; 4],
    walls: &Walls,
    mesh: &Mesh,
    units: &Units,
    state: &Matter,
) -> Result<BoundaryPlan> {
    let l = units.length;
    let node = |axis: &Axis, v: f64| 2 * axis.nearest_line(v / l);
    let mut lines = Vec::new();
    let mut add = |normal: usize, at: f64, along: [f64; 2], kind: WallKind, rotation| {
        let (across, axis) = if normal == 0 { (&mesh.x, &mesh.y) } else { (&mesh.y, &mesh.x) };
        let wrap = |axis: &Axis, n: usize| if axis.periodic() && n >= axis.nodes() { 0 } else { n };
        lines.push(WallLine {
            normal,
            line: wrap(across, node(across, at)),
            from: node(axis, along[0]),
            to: node(axis, along[1]),
            no_slip: kind == WallKind::NoSlip,
            rotation,
        });
    };
    for w in &walls.walls {
        add(w.normal, w.at, w.along, w.kind, w.rotation);
    }
    for (range, kind) in &walls.blocks {
        for normal in 0..2 {
            for at in range[normal] {
                add(normal, at, range[1 - normal], *kind, None);
            }
        }
    }
    let held = |c: usize| {
        sides.iter().any(|s| s.velocity[c].is_some())
            || lines.iter().any(|w| w.normal == c || w.no_slip)
    };
    let free_translation = [!held(0), !held(1)];
    let compressible = state.materials.iter().any(|m| m.compliance > 0.0);
    let closed = !compressible
        && sides
            .iter()
            .enumerate()
            .all(|(s, b)| b.periodic || b.velocity[side_normal(s)].is_some());
    let plan = BoundaryPlan { sides, walls: lines, free_translation, closed };
    if closed {
        let (net, total) = plan.net_outflow(mesh, &plan.constraints::<2>(mesh, units));
        if net.abs() > 1e-9 * total {
            return Err(SceneError::new(
                format!(
                    "the given normal velocities let {:.3e} m2/s of incompressible fluid out",
                    net * units.area_rate()
                ),
                "make them balance, open a side (kind = \"open\"), or give a bulk_viscosity",
            ));
        }
    }
    Ok(plan)
}

/// Refuses loads on motions that nothing resists, and scenes that may turn as a whole.
fn check_null_spaces(
    scene: &Scene,
    boundary: &BoundaryPlan,
    mesh: &Mesh,
    units: &Units,
    effects: &EffectSet,
    body_force: Option<&[FieldFn; 3]>,
) -> Result<()> {
    let free = boundary.free_translation;
    if free == [false; 2] {
        return Ok(());
    }
    if free == [true; 2] && !mesh.x.periodic() && !mesh.y.periodic() {
        return Err(SceneError::new(
            "nothing holds the scene: every side is open",
            "give some boundary a velocity, or make sides periodic",
        ));
    }
    let mut load = vec![[0.0; 2]; mesh.nodes()];
    boundary.add_tractions(mesh, units, &mut load);
    if let Some(f) = body_force {
        add_body_force(mesh, units, f, &mut load);
    }
    for c in (0..2).filter(|&c| free[c]) {
        let name = ["x", "y"][c];
        let total: f64 = load.iter().map(|f| f[c].abs()).sum();
        let net: f64 = load.iter().map(|f| f[c]).sum();
        let gravity =
            if effects.gravity { scene.gravity[c].clone() } else { Quantity::number(0.0) };
        let pulled = effects.gravity && gravity.eval(&Scope::new(scene)?)? != 0.0;
        if pulled || net.abs() > 1e-9 * total {
            return Err(SceneError::at(
                &gravity,
                format!("nothing holds the scene along {name}, and a net force acts there"),
                format!(
                    "a steady answer does not exist: balance the loads, or hold a side \
                     (velocity_{name})"
                ),
            ));
        }
    }
    Ok(())
}

fn regions(
    scene: &Scene,
    scope: &Scope,
    domain: [[f64; 2]; 2],
    si: &Si,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<Region>> {
    let mut out = Vec::new();
    for (index, r) in scene.regions.iter().enumerate() {
        let what = format!("regions[{index}]");
        let material = material_index(&scene.materials, &r.material, &what)?;
        let shape = match &r.shape {
            Shape::Everywhere => Area::Everywhere,
            Shape::Rectangle { x, y } => {
                let (rx, ry) = (pair(x, scope)?, pair(y, scope)?);
                for (c, (range, q)) in [(rx, x), (ry, y)].into_iter().enumerate() {
                    let tiny = 1e-9 * (domain[c][1] - domain[c][0]);
                    if range[1] < range[0] {
                        return Err(SceneError::at(
                            &q[1],
                            format!("{what} is empty: [{}, {}]", range[0], range[1]),
                            "the second number must not be below the first",
                        ));
                    }
                    if range[0] < domain[c][0] - tiny || range[1] > domain[c][1] + tiny {
                        return Err(SceneError::at(
                            &q[0],
                            format!(
                                "{what}: material `{}` reaches outside the domain: {} = {} to {}",
                                r.material,
                                ["x", "y"][c],
                                range[0],
                                range[1]
                            ),
                            format!("the domain is {} to {}", domain[c][0], domain[c][1]),
                        ));
                    }
                }
                Area::Rectangle { x: rx, y: ry }
            }
            Shape::Circle { centre, radius } => {
                let (c, radius_m) = (pair(centre, scope)?, positive(radius, scope, "radius")?);
                for k in 0..2 {
                    if c[k] + radius_m < domain[k][0] || c[k] - radius_m > domain[k][1] {
                        return Err(SceneError::at(
                            &centre[k],
                            format!("{what}: the circle lies outside the domain"),
                            "move its centre",
                        ));
                    }
                }
                Area::Circle { centre: c, radius: radius_m }
            }
            Shape::Where(f) => {
                let compiled = f.compile(scope)?;
                finite_range(f, &compiled, domain, "this shape")?;
                Area::Where(compiled)
            }
        };
        let layered = si.materials[material as usize].layer_viscosity.is_some();
        let director = match &r.director {
            Some(_) if !layered => {
                warnings.push(Warning::DirectorUnused { material: r.material.clone() });
                None
            }
            Some(scene::Director::AngleDegrees(f)) => {
                let compiled = f.compile(scope)?;
                finite_range(f, &compiled, domain, "the director's angle")?;
                Some(InitialDirector::Angle(compiled))
            }
            Some(scene::Director::Random) => Some(InitialDirector::Random),
            None if layered => {
                return Err(SceneError::new(
                    format!("{what}: the layered material `{}` has no directors", r.material),
                    "give director = \"random\" or director = { angle_degrees = 90 }",
                ));
            }
            None => None,
        };
        out.push(Region { material, shape, director });
    }
    Ok(out)
}

/// The scene without regions that a later one covers everywhere, and without materials that then
/// fill nothing and that no gauge counts: what is not there must not be solved for.
fn placed(scene: &Scene) -> Scene {
    let mut s = scene.clone();
    let everywhere = s.regions.iter().rposition(|r| matches!(r.shape, Shape::Everywhere));
    s.regions.drain(..everywhere.unwrap_or(0));
    let (regions, gauges) = (&s.regions, &s.gauges);
    s.materials.retain(|name, m| {
        m.background && everywhere.is_none()
            || regions.iter().any(|r| r.material == *name)
            || gauges.iter().any(|g| g.material == *name)
    });
    s
}

fn dye(
    scene: &Scene,
    scope: &Scope,
    length: f64,
    units: &Units,
) -> Result<(Option<Tracers>, Vec<Mark>)> {
    let Some(dye) = &scene.dye else { return Ok((None, vec![])) };
    let l = units.length;
    let spacing = length / f64::from(scene.accuracy.cells) / l * 0.5;
    let mut lines = Vec::new();
    let mut add = |points: &[[f64; 2]]| {
        let mut line: Vec<[f64; 2]> = vec![points[0].map(|v| v / l)];
        for pair in points.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|p| p.map(|v| v / l));
            let n = ((b[0] - a[0]).hypot(b[1] - a[1]) / spacing).ceil().clamp(1.0, 1e5) as usize;
            line.extend((1..=n).map(|k| {
                let t = k as f64 / n as f64;
                [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]
            }));
        }
        lines.push(line);
    };
    if let Some(g) = &dye.grid {
        let (x, y) = (pair(&g.x, scope)?, pair(&g.y, scope)?);
        let step = positive(&g.spacing, scope, "dye.grid.spacing")?;
        let counts = [x, y].map(|[a, b]| ((b - a) / step + 1e-9).floor());
        if counts.iter().any(|&n| n > 1000.0) {
            return Err(SceneError::at(
                &g.spacing,
                format!("the dye grid would have {} lines", counts[0] + counts[1]),
                "widen the spacing: at most 1000 lines each way",
            ));
        }
        for i in 0..=counts[0].max(-1.0) as i64 {
            let at = x[0] + step * i as f64;
            add(&[[at, y[0]], [at, y[1]]]);
        }
        for j in 0..=counts[1].max(-1.0) as i64 {
            let at = y[0] + step * j as f64;
            add(&[[x[0], at], [x[1], at]]);
        }
    }
    for line in &dye.lines {
        let points = line.iter().map(|p| pair(p, scope)).collect::<Result<Vec<_>>>()?;
        if points.len() < 2 {
            return Err(SceneError::new(
                "a dye line has fewer than two points",
                "give two or more",
            ));
        }
        add(&points);
    }
    let marks = dye
        .marks
        .iter()
        .map(|m| {
            Ok(Mark {
                from: pair(&m.from, scope)?.map(|v| v / l),
                to: pair(&m.to, scope)?.map(|v| v / l),
                half_width: 0.5 * positive(&m.width, scope, "the width of a mark")? / l,
            })
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(((!lines.is_empty()).then_some(Tracers { lines, spacing }), marks))
}

fn method(scene: &Scene) -> Result<Method> {
    let a = &scene.accuracy;
    let side = f64::from(a.particles_per_cell).sqrt().round() as usize;
    if side == 0 || side * side != a.particles_per_cell as usize || side > 32 {
        return Err(SceneError::new(
            format!("accuracy.particles_per_cell is {}", a.particles_per_cell),
            "give a square number from 1 to 1024: 9, 16, 25, ...",
        ));
    }
    if !(a.tolerance >= 1e-14 && a.tolerance <= 1e-2) {
        return Err(SceneError::new(
            format!("accuracy.tolerance is {}", a.tolerance),
            "give 1e-14 to 1e-2; 1e-12 is the floor that double precision allows in stiff scenes",
        ));
    }
    if !(0.0..=2.0).contains(&a.stabilisation) {
        return Err(SceneError::new(
            format!("accuracy.stabilisation is {}", a.stabilisation),
            "give a share of a step, 0.6 to 1, or 0 to switch it off; 0.75 is usual",
        ));
    }
    if a.max_corrections == 0 {
        return Err(SceneError::new(
            "accuracy.max_corrections is 0",
            "give 1 or more; 40 is usual",
        ));
    }
    Ok(Method {
        seeding: Seeding { side, placement: a.placement, seed: a.seed },
        quadrature: a.quadrature,
        integrator: a.integrator,
        stabilisation: None,
        tolerance: a.tolerance,
        max_corrections: a.max_corrections,
    })
}

fn clock(scene: &Scene, scope: &Scope, units: &Units) -> Result<ClockPlan> {
    let t = &scene.time;
    let end = positive(&t.end, scope, "time.end")?;
    let max_step = t.max_step.as_ref().map(|q| positive(q, scope, "time.max_step")).transpose()?;
    if !(t.courant > 0.0 && t.courant <= 50.0) {
        return Err(SceneError::new(
            format!("time.courant is {}", t.courant),
            "cells crossed per step: above 0, at most 50; 0.5 is usual",
        ));
    }
    if !(t.strain > 0.0 && t.strain <= 10.0) {
        return Err(SceneError::new(
            format!("time.strain is {}", t.strain),
            "strain per step: above 0, at most 10; 0.25 is usual",
        ));
    }
    let r = &scene.recording;
    let mut frames: Vec<f64> =
        (0..=r.frames).map(|k| end * f64::from(k) / f64::from(r.frames.max(1))).collect();
    for q in &r.times {
        let v = q.eval(scope)?;
        if !(0.0..=end * (1.0 + 1e-12)).contains(&v) {
            return Err(SceneError::at(
                q,
                format!("recording time {v} is outside the run"),
                format!("choose 0 to {end} s"),
            ));
        }
        frames.push(v.min(end));
    }
    frames.sort_by(f64::total_cmp);
    // Times that differ by less than anybody can see are one frame.
    let least = end * 1e-6;
    frames.dedup_by(|b, a| *b - *a < least);
    let frames: Vec<f64> = frames.into_iter().map(|v| v / units.time).collect();
    let end = end / units.time;
    let mut stops: Vec<f64> = frames.iter().copied().filter(|&v| v > 0.0 && v < end).collect();
    stops.push(end);
    Ok(ClockPlan {
        end,
        max_step: max_step.map(|v| v / units.time),
        courant: t.courant,
        strain: t.strain,
        stops,
        frames,
    })
}

fn picture(scene: &Scene) -> Result<Picture> {
    let mut colours = Vec::new();
    let mut free = PALETTE.iter().cycle();
    for (name, m) in &scene.materials {
        colours.push(match &m.colour {
            Some(text) => hex_colour(text).ok_or_else(|| {
                SceneError::new(
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
    Ok(Picture {
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
