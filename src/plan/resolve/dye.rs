//! This module resolves `[dye]`, the passive lines and the marked particles.

use super::values::{Result, point, positive, ranges};
use crate::plan::{Mark, Tracers, Units};
use crate::scene::{Scene, SceneError, Scope};
use crate::space::mesh::Mesh;
use crate::space::walls::{Enclosure, Landing};

/// Largest number of points of all lines.
const MOST_POINTS: f64 = 4e6;

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

/// The lines without their parts inside of solids of any shape.
pub(super) fn outside(tracers: Tracers, mesh: &Mesh) -> Tracers {
    let Some(parts) = mesh.parts() else { return tracers };
    let pieces = |line: Vec<[f64; 2]>| -> Vec<Vec<[f64; 2]>> {
        let pieces = line.split(|&p| parts.is_solid(p)).filter(|piece| piece.len() > 1);
        pieces.map(<[_]>::to_vec).collect()
    };
    Tracers { lines: tracers.lines.into_iter().flat_map(pieces).collect(), ..tracers }
}

/// The end of a short path that ends on a wall without thickness, moved by a rounding error to the side
/// of the wall on which the path begins. Other ends do not change.
fn beside((mesh, enclosure): (&Mesh, &Enclosure), from: [f64; 2], to: [f64; 2]) -> [f64; 2] {
    const SHIFT: f64 = 1e-6;
    match enclosure.follow(mesh, from, to) {
        Landing::Held(at) if distance(at, to) <= SHIFT * distance(from, to) => at,
        _ => to,
    }
}

/// The passive lines, and the segments whose particles are marked. Lines that end at a wall without
/// thickness, and outermost lines of the grid along one, are on the side of the rest of the lines.
pub(super) fn dye(
    scene: &Scene,
    scope: &Scope,
    length: f64,
    units: &Units,
    bounds: (&Mesh, &Enclosure),
) -> Result<(Option<Tracers>, Vec<Mark>)> {
    let Some(dye) = &scene.dye else { return Ok((None, vec![])) };
    let l = units.length;
    let spacing = length / f64::from(scene.accuracy.cells) / l * 0.5;
    let mut lines = Vec::new();
    let mut count = 0.0;
    let mut add = |points: &[[f64; 2]], inward: Option<[f64; 2]>, key: &str| -> Result<()> {
        let length: f64 = points.windows(2).map(|p| distance(p[0], p[1]) / l).sum();
        count += length / spacing + points.len() as f64;
        if count > MOST_POINTS {
            return Err(SceneError::of_key(
                key,
                format!("the lines of dye would have more than {MOST_POINTS:.0} points"),
                "they have two points per cell: give fewer or shorter lines, or lower \
                 accuracy.cells",
            ));
        }
        let mut line: Vec<[f64; 2]> = vec![points[0].map(|v| v / l)];
        for pair in points.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|p| p.map(|v| v / l));
            let n = (distance(a, b) / spacing).ceil().max(1.0) as usize;
            line.extend((1..=n).map(|k| {
                let t = k as f64 / n as f64;
                [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]
            }));
        }
        for p in line.iter_mut() {
            let from = inward.map(|d| [p[0] + d[0] / l, p[1] + d[1] / l]);
            *p = from.map_or(*p, |from| beside(bounds, from, *p));
        }
        let last = line.len() - 1;
        for (end, inner) in [(0, 1), (last, last - 1)] {
            line[end] = beside(bounds, line[inner], line[end]);
        }
        lines.push(line);
        Ok(())
    };
    if let Some(g) = &dye.grid {
        let [x, y] = ranges(&g.x, &g.y, scope)?;
        let step = positive(&g.spacing, scope, "dye.grid.spacing")?;
        let counts = [x, y].map(|[a, b]| ((b - a) / step + 1e-9).floor());
        if counts.iter().any(|&n| n > 1000.0) {
            return Err(SceneError::at(
                &g.spacing,
                format!("the dye grid would have {} lines", counts[0] + counts[1]),
                "widen the spacing: at most 1000 lines each way",
            ));
        }
        let inwards = |k: i64, count: f64| match k {
            _ if count < 1.0 => None,
            0 => Some(0.5 * step),
            _ => (k as f64 >= count).then_some(-0.5 * step),
        };
        for i in 0..=counts[0].max(-1.0) as i64 {
            let at = x[0] + step * i as f64;
            let inward = inwards(i, counts[0]).map(|d| [d, 0.0]);
            add(&[[at, y[0]], [at, y[1]]], inward, "dye.grid")?;
        }
        for j in 0..=counts[1].max(-1.0) as i64 {
            let at = y[0] + step * j as f64;
            let inward = inwards(j, counts[1]).map(|d| [0.0, d]);
            add(&[[x[0], at], [x[1], at]], inward, "dye.grid")?;
        }
    }
    for line in &dye.lines {
        let points = line.iter().map(|p| point(p, scope)).collect::<Result<Vec<_>>>()?;
        if points.len() < 2 {
            return Err(SceneError::of_key(
                "dye.lines",
                "a dye line has fewer than two points",
                "give two or more",
            ));
        }
        add(&points, None, "dye.lines")?;
    }
    let marks = dye
        .marks
        .iter()
        .map(|m| {
            Ok(Mark {
                from: point(&m.from, scope)?.map(|v| v / l),
                to: point(&m.to, scope)?.map(|v| v / l),
                half_width: 0.5 * positive(&m.width, scope, "the width of a mark")? / l,
            })
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(((!lines.is_empty()).then_some(Tracers { lines, spacing }), marks))
}

#[cfg(test)]
mod tests {
    use crate::plan::resolve;
    use crate::scene::{SceneSource, parse};

    /// Dye along walls without thickness marks what they enclose.
    #[test]
    fn dye_along_walls_is_inside_of_the_vessel() {
        let text = r#"
            schema = 1
            name = "vessel"
            domain = { x = [0, 4], y = [0, 4] }
            accuracy.cells = 8
            time.end = 1
            mesh.grading = []
            materials.mud.shear_viscosity = 1
            regions = [{ material = "mud", shape = "everywhere" }]
            dye.grid = { x = [1, 3], y = [1, 3], spacing = 0.5 }
            dye.lines = [[[2, 2], [3, 2]], [[1, 2.2], [2, 2.2]]]
            walls = [
                { name = "left", from = [1, 1], to = [1, 4] },
                { name = "right", from = [3, 1], to = [3, 4] },
                { name = "floor", from = [1, 1], to = [3, 1] },
                { name = "lid", from = [1, 3], to = [3, 3] },
            ]
        "#;
        let scene = parse(&SceneSource::new("s.toml", text)).expect("valid");
        let plan = resolve(&scene).expect("valid");
        let (mesh, tracers) = (&plan.mesh, plan.tracers.as_ref().expect("dye"));
        assert_eq!(tracers.lines.len(), 12);
        for &p in tracers.lines.iter().flatten() {
            let centre = plan.si(mesh.cell_centre(mesh.locate(p)));
            let p = plan.si(p);
            let inside = centre.iter().all(|&v| v > 1.0 && v < 3.0);
            let near = p.iter().all(|&v| (0.999_999..3.000_001).contains(&v));
            assert!(inside && near, "{p:?} in the cell at {centre:?}");
        }
    }
}
