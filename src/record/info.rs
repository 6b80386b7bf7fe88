//! This module derives the constant part of a recording, and the scalars of each step.

use crate::frame::{
    Frame, Material, Outline, Plot, Quantity, Rect, RunInfo, Scalar, Series, Snapshot,
};
use crate::plan::Plan;
use crate::plan::boundary::SIDES;
use crate::scene::{Block, ColourBy, FieldName, SolidShape, scene_hash, to_toml};
use crate::sim::row::{Panel, Place, Row, places};

/// Name of the last class of materials: particles marked by dye.
const MARKED: &str = "marked";

/// The constant part of a recording of `plan`, under the name `name`.
pub fn run_info(plan: &Plan, name: &str) -> RunInfo {
    let f = |v: f64| (v * plan.units.length) as f32;
    let (x, y) = (&plan.mesh.x, &plan.mesh.y);
    let domain = Rect { min: [f(x.start()), f(y.start())], max: [f(x.end()), f(y.end())] };
    let round = plan.scene.domain.geometry.is_round();
    let drawn = |ends: [[f64; 2]; 2]| ends.map(|p| p.map(f)).to_vec();
    // Openings in a side are gaps in its line; a side without parts is drawn whole, open or not.
    let mut walls: Vec<Outline> = plan
        .boundary
        .pieces()
        .filter(|(s, piece)| plan.boundary.sides[*s].pieces.len() == 1 || !piece.open)
        .filter(|(s, _)| !(round && *s == 0 && x.start() == 0.0))
        .map(|(s, piece)| Outline { name: SIDES[s].into(), points: drawn(piece.segment.ends()) })
        .collect();
    let aligned = |b: &&Block| {
        matches!(b.shape, None | Some(SolidShape::Rectangle { .. }))
            && !plan.moving.iter().any(|m| m.name == b.name)
    };
    let blocks = plan.scene.blocks.iter().filter(aligned);
    let names = plan
        .scene
        .walls
        .iter()
        .filter(|w| w.thickness.is_none())
        .map(|w| w.name.clone())
        .chain(blocks.flat_map(|b| vec![b.name.clone(); 4]))
        .chain(plan.boundary.sources.iter().flat_map(|s| vec![s.name.clone(); 4]));
    walls.extend(
        plan.enclosure
            .obstacles
            .iter()
            .zip(names)
            .map(|(o, name)| Outline { name, points: drawn(o.ends()) }),
    );
    let moves = |name: &str| plan.moving.iter().any(|m| m.name == name);
    let solids = plan.mesh.parts().into_iter().flat_map(|parts| &parts.solids);
    let solids = solids.filter(|s| !moves(&s.name));
    walls.extend(solids.map(|s| {
        let points = s.outline.line().into_iter().map(|p| p.map(f)).collect();
        Outline { name: s.name.clone(), points }
    }));
    let undrawn = plan.background().map(|b| &plan.state.materials[b as usize].name);
    let materials: Vec<Material> = plan
        .state
        .materials
        .iter()
        .map(|m| m.name.clone())
        .chain((!plan.marks.is_empty()).then(|| MARKED.to_string()))
        .zip(&plan.content.colours)
        .map(|(name, &rgb)| Material { drawn: Some(&name) != undrawn, name, rgb })
        .collect();
    let side = plan.method.seeding.side as f64;
    let sizes = |a: &crate::space::mesh::Axis| a.length() / a.cells() as f64;
    let hash = scene_hash(&plan.scene);
    RunInfo {
        name: name.into(),
        recording_id: format!("{name}-{}", &hash[..hash.len().min(12)]),
        domain,
        round,
        walls,
        gauges: plan
            .gauges
            .iter()
            .map(|g| Outline { name: g.name.clone(), points: drawn(g.line.ends()) })
            .collect(),
        materials,
        particle_radius: f(0.5 * sizes(x).min(sizes(y)) / side),
        particle_quantity: particle_quantity(plan.content.colour_by),
        fields: plan.content.fields.iter().filter_map(|&name| field_quantity(plan, name)).collect(),
        plots: plots(plan),
        scene_toml: to_toml(&plan.scene),
        plan_markdown: super::text::plan_markdown(&plan.describe()),
    }
}

fn quantity(name: &str, unit: &str, signed: bool) -> Quantity {
    Quantity { name: name.into(), unit: unit.into(), signed, ends: None }
}

/// A dimensionless quantity with fixed ends of its colour scale.
fn bounded(name: &str, ends: [f32; 2]) -> Quantity {
    Quantity { ends: Some(ends), ..quantity(name, "", false) }
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
        ColourBy::InertialNumber => quantity("inertial number", "", false),
        ColourBy::Yielded => quantity("yielded", "", false),
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
        FieldName::InertialNumber => {
            bounded("inertial_number", [0.0, plan.halfway_inertial_number()? as f32])
        }
        FieldName::Yielded if !plan.effects.flow_curves => return None,
        FieldName::Yielded => bounded("yielded", [0.0, 1.0]),
    })
}

/// The panels of curves with the columns of a plan.
fn plots(plan: &Plan) -> Vec<Plot> {
    let places = places(plan);
    let curves = |panel: Panel| -> Vec<Series> {
        if panel == Panel::Seconds {
            let shown = ["assemble", "factor", "solve", "motion"];
            return shown.map(|name| Series::new(format!("seconds/{name}"), name)).to_vec();
        }
        // Powers are of little interest beside an outflow.
        if panel == Panel::Power && !plan.gauges.is_empty() {
            return vec![];
        }
        let of_panel = places.iter().filter(|p| p.column.panel == Some(panel));
        of_panel.map(|p| Series::new(p.path.clone(), p.curve.clone())).collect()
    };
    let plot = |panel: Panel| {
        let (title, log10) = panel.heading(plan.scene.domain.geometry);
        let series = curves(panel);
        (!series.is_empty()).then_some(Plot { title, log10, series })
    };
    Panel::ALL.into_iter().filter_map(plot).collect()
}

/// The frame of a row, with a picture on the steps that have one.
pub fn frame(
    plan: &Plan,
    row: &Row,
    wall_s: f64,
    snapshot: Option<Snapshot>,
    warnings: Vec<String>,
) -> Frame {
    let recorded = |p: &Place| {
        let known = match p.column.panel {
            Some(Panel::TimeStep) => row.step > 0,
            Some(Panel::Alignment) => row.mean_alignment.is_some(),
            _ => true,
        };
        known && !p.path.is_empty()
    };
    let mut scalars: Vec<Scalar> = places(plan)
        .into_iter()
        .filter(recorded)
        .map(|p| Scalar::new(p.path.clone(), p.number(row)))
        .collect();
    scalars.extend(row.seconds.list().map(|(name, s)| Scalar::new(format!("seconds/{name}"), s)));
    Frame { step: row.step, time_s: row.time, wall_s, snapshot, scalars, warnings }
}
