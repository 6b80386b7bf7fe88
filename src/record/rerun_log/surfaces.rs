//! Writes and reads the stresses along surfaces.

use super::read::{Recorded, seconds};
use super::*;
use crate::frame::{SurfacePoint, SurfaceStress};
use crate::record::colour::of_gauge;
use rerun::components::Radius;
use rerun::{archetypes, components};

/// Folder of the stresses.
const STRESS: &str = "stress";

/// Numbers of each place: position along the surface, x, y, normal, normal and shear stress.
const COLUMNS: usize = 7;

/// Length of the longest arrow, relative to the longer side of the domain.
const LONGEST: f32 = 0.12;

fn one(name: &str) -> EntityPath {
    EntityPath::new(vec![EntityPathPart::new(name.to_owned())])
}

impl RerunLog {
    /// Draws the force per area along a surface, and records its values, which no view shows.
    pub(super) fn stresses(&self, surface: &SurfaceStress) -> Result<(), RecordError> {
        let path = self.paths.at(&format!("world/{STRESS}")).join(&one(&surface.name));
        let tractions: Vec<[f32; 2]> = surface.points.iter().map(SurfacePoint::traction).collect();
        let largest = tractions.iter().map(|[x, y]| x.hypot(*y)).fold(0.0, f32::max);
        let [w, h] = self.domain.size();
        let scale = if largest > 0.0 { LONGEST * w.max(h) / largest } else { 0.0 };
        let arrows = tractions.iter().map(|t| t.map(|v| v * scale));
        self.rec.log(
            path.clone(),
            &archetypes::Arrows2D::from_vectors(arrows)
                .with_origins(surface.points.iter().map(|p| p.at))
                .with_colors([rgb(of_gauge(0))])
                .with_radii([Radius::new_ui_points(0.8)])
                .with_draw_order(depth::GAUGES),
        )?;
        let rows = surface.points.iter().flat_map(|p| {
            let ([x, y], [nx, ny]) = (p.at, p.normal);
            [p.along, x, y, nx, ny, p.pressing, p.shear]
        });
        let shape = vec![surface.points.len() as u64, COLUMNS as u64];
        let buffer = rerun::datatypes::TensorBuffer::F32(rows.collect::<Vec<f32>>().into());
        let tensor = rerun::datatypes::TensorData::new(shape, buffer);
        self.rec.log(path.join(&"values".into()), &archetypes::Tensor::new(tensor))?;
        Ok(())
    }
}

impl Recorded {
    /// The stresses along surfaces of each snapshot, with its time (s), in order.
    pub fn stresses(&self) -> Vec<(f64, SurfaceStress)> {
        let component = archetypes::Tensor::descriptor_data().component;
        let mut out = vec![];
        for (chunk, path) in self.of_run() {
            let [world, folder, name, last] = path.as_slice() else { continue };
            if (world.as_str(), folder.as_str(), last.as_str()) != ("world", STRESS, "values") {
                continue;
            }
            let times = seconds(chunk, SIM_TIME, component);
            let batches = chunk.iter_component::<components::TensorData>(component);
            for (time, batch) in times.into_iter().zip(batches) {
                let surface = batch.as_slice().first().and_then(|t| surface(name, &t.0));
                out.extend(surface.map(|surface| (time, surface)));
            }
        }
        out.sort_by(|a: &(f64, SurfaceStress), b| {
            a.0.total_cmp(&b.0).then_with(|| a.1.name.cmp(&b.1.name))
        });
        out
    }
}

fn surface(name: &str, tensor: &rerun::datatypes::TensorData) -> Option<SurfaceStress> {
    let rerun::datatypes::TensorBuffer::F32(values) = &tensor.buffer else { return None };
    let (rows, rest) = values.as_chunks::<COLUMNS>();
    let point = |&[along, x, y, nx, ny, pressing, shear]: &[f32; COLUMNS]| SurfacePoint {
        along,
        at: [x, y],
        normal: [nx, ny],
        pressing,
        shear,
    };
    rest.is_empty()
        .then(|| SurfaceStress { name: name.to_owned(), points: rows.iter().map(point).collect() })
}
