//! What a recording says of a run as a whole, and the scalars of each step.

use crate::frame::{
    Frame, Material, Outline, Picture, Plot, Quantity, Rect, RunInfo, Scalar, Series,
};
use crate::plan::Plan;
use crate::scene::{ColourBy, FieldName, scene_hash, to_toml};
use crate::sim::row::Row;

/// Name of the materials' last class: particles marked by dye.
const MARKED: &str = "marked";

/// The constant part of a recording of `plan` under the name `name`.
pub fn run_info(plan: &Plan, name: &str) -> RunInfo {
    let f = |v: f64| (v * plan.units.length) as f32;
    let (x, y) = (&plan.mesh.x, &plan.mesh.y);
    let domain = Rect { min: [f(x.start()), f(y.start())], max: [f(x.end()), f(y.end())] };
    let segment = |normal: usize, at: f64, from: f64, to: f64| {
        [from, to].map(|v| if normal == 0 { [f(at), f(v)] } else { [f(v), f(at)] }).to_vec()
    };
    let [[x0, y0], [x1, y1]] = [domain.min, domain.max];
    let outlines = [
        ("left", [[x0, y0], [x0, y1]]),
        ("right", [[x1, y0], [x1, y1]]),
        ("bottom", [[x0, y0], [x1, y0]]),
        ("top", [[x0, y1], [x1, y1]]),
    ];
    let mut walls: Vec<Outline> = outlines
        .into_iter()
        .zip(&plan.boundary.sides)
        .filter(|((_, _), side)| !side.periodic)
        .map(|((name, points), _)| Outline { name: name.into(), points: points.to_vec() })
        .collect();
    let names = plan
        .scene
        .walls
        .iter()
        .map(|w| w.name.clone())
        .chain(plan.scene.blocks.iter().flat_map(|b| vec![b.name.clone(); 4]));
    walls.extend(
        plan.enclosure
            .obstacles
            .iter()
            .zip(names)
            .map(|(o, name)| Outline { name, points: segment(o.normal, o.at, o.from, o.to) }),
    );
    let undrawn = plan.background().map(|b| &plan.state.materials[b as usize].name);
    let materials: Vec<Material> = plan
        .state
        .materials
        .iter()
        .map(|m| m.name.clone())
        .chain((!plan.marks.is_empty()).then(|| MARKED.to_string()))
        .zip(&plan.picture.colours)
        .map(|(name, &rgb)| Material { drawn: Some(&name) != undrawn, name, rgb })
        .collect();
    let side = plan.method.seeding.side as f64;
    let sizes = |a: &crate::space::mesh::Axis| a.length() / a.cells() as f64;
    let hash = scene_hash(&plan.scene);
    RunInfo {
        name: name.into(),
        recording_id: format!("{name}-{}", &hash[..hash.len().min(12)]),
        domain,
        walls,
        gauges: plan
            .gauges
            .iter()
            .map(|g| Outline {
                name: g.name.clone(),
                points: segment(g.normal, g.at, g.from, g.to),
            })
            .collect(),
        materials,
        particle_radius: f(0.5 * sizes(x).min(sizes(y)) / side),
        particle_quantity: particle_quantity(plan.picture.colour_by),
        fields: plan.picture.fields.iter().filter_map(|&name| field_quantity(plan, name)).collect(),
        plots: plots(plan),
        scene_toml: to_toml(&plan.scene),
        plan_markdown: super::text::plan_markdown(&plan.describe()),
    }
}

fn quantity(name: &str, unit: &str, signed: bool) -> Quantity {
    Quantity { name: name.into(), unit: unit.into(), signed }
}

fn particle_quantity(colour_by: ColourBy) -> Option<Quantity> {
    Some(match colour_by {
        ColourBy::Material => return None,
        ColourBy::Speed => quantity("speed", "m/s", false),
        ColourBy::Rotation => quantity("rotation", "1/s", true),
        ColourBy::Pressure => quantity("pressure", "Pa", false),
        ColourBy::StrainRate => quantity("strain rate", "1/s", false),
        ColourBy::Viscosity => quantity("viscosity", "Pa s", false),
        ColourBy::Alignment => quantity("|n_x|", "", false),
    })
}

fn field_quantity(plan: &Plan, name: FieldName) -> Option<Quantity> {
    Some(match name {
        FieldName::Speed => quantity("speed", "m/s", false),
        FieldName::Rotation if !plan.effects.rotation => return None,
        FieldName::Rotation => quantity("rotation", "1/s", true),
        FieldName::Pressure => quantity("pressure", "Pa", false),
        FieldName::Alignment if !plan.effects.directors => return None,
        FieldName::Alignment => quantity("alignment", "", false),
    })
}

fn plots(plan: &Plan) -> Vec<Plot> {
    let mut list = Vec::new();
    let plot = |title: &str, log10, series| Plot { title: title.into(), log10, series };
    if !plan.gauges.is_empty() {
        let of = |what: &str| {
            plan.gauges
                .iter()
                .map(|g| Series::new(format!("gauges/{}/{what}", g.name), g.name.clone()))
                .collect()
        };
        list.push(plot("Outflow volume (m²)", false, of("volume")));
        list.push(plot("Outflow rate (m²/s)", false, of("rate")));
    }
    if plan.effects.directors {
        list.push(plot(
            "Mean alignment |n_x|",
            false,
            vec![Series::new("texture/alignment", "mean |n_x|")],
        ));
    }
    if plan.gauges.is_empty() {
        list.push(plot(
            "Power (W/m)",
            false,
            vec![
                Series::new("diagnostics/power_in", "loads"),
                Series::new("diagnostics/dissipation", "dissipation"),
            ],
        ));
    }
    list.push(plot(
        "Balances (log10)",
        true,
        vec![
            Series::new("diagnostics/power_error", "power error"),
            Series::new("diagnostics/divergence_error", "divergence error"),
            Series::new("diagnostics/volume_error", "volume error"),
        ],
    ));
    list.push(plot(
        "Seconds per step",
        false,
        vec![
            Series::new("seconds/assemble", "assemble"),
            Series::new("seconds/factor", "factor"),
            Series::new("seconds/solve", "solve"),
            Series::new("seconds/motion", "motion"),
        ],
    ));
    list.push(plot("Time step (log10 s)", true, vec![Series::new("time/dt", "dt")]));
    list
}

/// A frame of a row, with a picture on the steps that show one.
pub fn frame(
    plan: &Plan,
    row: &Row,
    wall_s: f64,
    picture: Option<Picture>,
    warnings: Vec<String>,
) -> Frame {
    let mut scalars = vec![
        Scalar::new("diagnostics/power_in", row.power_in),
        Scalar::new("diagnostics/dissipation", row.dissipation),
        Scalar::new("diagnostics/power_error", row.power_error),
        Scalar::new("diagnostics/divergence_error", row.divergence_error),
        Scalar::new("diagnostics/volume_error", row.volume_error),
        Scalar::new("diagnostics/max_speed", row.max_speed),
        Scalar::new("diagnostics/rms_speed", row.rms_speed),
    ];
    for (g, plan) in row.gauges.iter().zip(&plan.gauges) {
        scalars.push(Scalar::new(format!("gauges/{}/volume", plan.name), g.volume));
        scalars.push(Scalar::new(format!("gauges/{}/rate", plan.name), g.rate));
    }
    scalars.extend(row.seconds.list().map(|(name, s)| Scalar::new(format!("seconds/{name}"), s)));
    for (drift, material) in row.drift.iter().zip(&plan.state.materials) {
        scalars.push(Scalar::new(format!("volume_drift/{}", material.name), *drift));
    }
    scalars.extend(row.alignment.map(|a| Scalar::new("texture/alignment", a)));
    if row.step > 0 {
        scalars.push(Scalar::new("time/dt", row.dt));
    }
    Frame { step: row.step, time_s: row.time, wall_s, picture, scalars, warnings }
}
