//! This module writes VTK unstructured grids (XML, binary data in base64), and the `.pvd` index
//! that ParaView opens.

use super::{ExportError, Frames, Instant, write_file};
use crate::frame::{GridField, ParticleSnapshot};
use crate::record::text::escape;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::path::Path;

/// VTK cell type of a single point.
const VERTEX: u8 = 1;
/// VTK cell type of a quadrilateral.
const QUAD: u8 = 9;
/// VTK cell type of a hexahedron.
const HEXAHEDRON: u8 = 12;
/// Azimuths of the two faces of the wedge that stands for the fields of a round flow, rad.
const WEDGE: [f32; 2] = [-0.05, 0.05];

/// An unstructured grid with data at its points or cells.
#[derive(Default)]
struct Grid {
    points: Vec<[f32; 3]>,
    /// Point indices of all cells; each cell has `points_per_cell`.
    cells: Vec<i64>,
    points_per_cell: usize,
    kind: u8,
    point_data: String,
    cell_data: String,
}

/// Writes `particles_<n>.vtu` and `fields_<n>.vtu`, a `.pvd` index with the times for each, and
/// `materials.csv`. The fields of a round flow fill a thin wedge. Returns the number of files.
pub(super) fn write(frames: &Frames, folder: &Path) -> Result<usize, ExportError> {
    let particles = |i: &Instant| i.particles.as_ref().map(particles);
    let grid = if frames.round { wedge } else { fields };
    let fields = |i: &Instant| (!i.fields.is_empty()).then(|| grid(&i.fields));
    let numbered = frames.materials.iter().enumerate();
    let names: String = numbered.map(|(n, name)| format!("{n},{name}\n")).collect();
    write_file(folder.join("materials.csv"), format!("number,name\n{names}"))?;
    Ok(1 + series(frames, folder, "particles", particles)?
        + series(frames, folder, "fields", fields)?)
}

fn series(
    frames: &Frames,
    folder: &Path,
    name: &str,
    grid: impl Fn(&Instant) -> Option<Grid>,
) -> Result<usize, ExportError> {
    let mut sets = String::new();
    let mut files = 0;
    for (n, instant) in frames.instants.iter().enumerate() {
        let Some(grid) = grid(instant) else { continue };
        let file = format!("{name}_{n:05}.vtu");
        sets +=
            &format!("    <DataSet timestep=\"{}\" part=\"0\" file=\"{file}\"/>\n", instant.time_s);
        write_file(folder.join(file), grid.xml())?;
        files += 1;
    }
    if files == 0 {
        return Ok(0);
    }
    let text = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" \
         byte_order=\"LittleEndian\">\n  <Collection>\n{sets}  </Collection>\n</VTKFile>\n"
    );
    write_file(folder.join(format!("{name}.pvd")), text)?;
    Ok(files + 1)
}

fn particles(particles: &ParticleSnapshot) -> Grid {
    let class = particles.class.iter().flat_map(|c| i32::from(*c).to_le_bytes()).collect();
    Grid {
        points: particles.positions.iter().map(|&[x, y]| [x, y, 0.0]).collect(),
        cells: (0..particles.positions.len() as i64).collect(),
        points_per_cell: 1,
        kind: VERTEX,
        point_data: array("material", "Int32", 1, class),
        ..Grid::default()
    }
}

fn fields(fields: &[GridField]) -> Grid {
    let GridField { origin, cell, nx, ny, .. } = fields[0];
    let corner =
        |i: usize, j: usize| [origin[0] + i as f32 * cell[0], origin[1] + j as f32 * cell[1]];
    let number = |i: usize, j: usize| (j * (nx + 1) + i) as i64;
    let corners = (0..=ny).flat_map(|j| (0..=nx).map(move |i| corner(i, j)));
    let quads = (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j)));
    let around = |(i, j)| [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)];
    Grid {
        points: corners.map(|[x, y]| [x, y, 0.0]).collect(),
        cells: quads.flat_map(around).collect(),
        points_per_cell: 4,
        kind: QUAD,
        cell_data: fields.iter().map(data).collect(),
        ..Grid::default()
    }
}

/// Values of a field in cells.
fn data(field: &GridField) -> String {
    let bytes = field.values.iter().flat_map(|v| v.to_le_bytes());
    array(&field.name, "Float32", 1, bytes.collect())
}

/// The fields of a round flow in a wedge around the half-plane that is computed.
fn wedge(fields: &[GridField]) -> Grid {
    let flat = self::fields(fields);
    let count = flat.points.len() as i64;
    let turned = |azimuth: f32| {
        let (s, c) = azimuth.sin_cos();
        flat.points.iter().map(move |[x, y, _]| [x * c, *y, x * s])
    };
    let both = |quad: &[i64]| [quad.to_vec(), quad.iter().map(|k| k + count).collect()].concat();
    Grid {
        points: WEDGE.into_iter().flat_map(turned).collect(),
        cells: flat.cells.chunks(4).flat_map(both).collect(),
        points_per_cell: 8,
        kind: HEXAHEDRON,
        cell_data: flat.cell_data.clone(),
        ..Grid::default()
    }
}

/// A data array: base64 of the length in bytes (u64) followed by the data, as VTK requires.
fn array(name: &str, kind: &str, components: usize, bytes: Vec<u8>) -> String {
    let mut block = (bytes.len() as u64).to_le_bytes().to_vec();
    block.extend(bytes);
    let name = escape(name);
    format!(
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" \
         format=\"binary\">{}</DataArray>\n",
        STANDARD.encode(block)
    )
}

impl Grid {
    fn xml(&self) -> String {
        let count = self.cells.len() / self.points_per_cell.max(1);
        let points = self.points.iter().flatten().copied();
        let points = array("Points", "Float32", 3, points.flat_map(f32::to_le_bytes).collect());
        let cells = self.cells.iter().flat_map(|p| p.to_le_bytes()).collect();
        let ends = (1..=count).flat_map(|n| ((n * self.points_per_cell) as i64).to_le_bytes());
        format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" \
             byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<UnstructuredGrid>\n<Piece \
             NumberOfPoints=\"{}\" NumberOfCells=\"{count}\">\n<PointData>\n{}</PointData>\n\
             <CellData>\n{}</CellData>\n<Points>\n{points}</Points>\n<Cells>\n{}{}{}</Cells>\n\
             </Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
            self.points.len(),
            self.point_data,
            self.cell_data,
            array("connectivity", "Int64", 1, cells),
            array("offsets", "Int64", 1, ends.collect()),
            array("types", "UInt8", 1, vec![self.kind; count]),
        )
    }
}
