//! This module writes Parquet tables: particles and fields of all frames, and the series.

use super::{ExportError, Frames, Instant};
use crate::frame::SurfacePoint;
use crate::record::replace::{self, Kind};
use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, FloatType, Int32Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use std::path::Path;
use std::sync::Arc;

/// A column of a table.
enum Column {
    Whole(Vec<i32>),
    Single(Vec<f32>),
    Double(Vec<f64>),
    /// Texts, by number.
    Text(Vec<u16>, Vec<String>),
}

/// Rows of a table that are written together: named columns of the same length.
type Group = Vec<(String, Column)>;

/// Writes `particles.parquet`, `fields.parquet`, `stresses.parquet` and `series.parquet`; all but the last
/// have the columns
/// `frame` and `time` and one row group per frame. Returns the number of files.
pub(super) fn write(frames: &Frames, folder: &Path) -> Result<usize, ExportError> {
    let of = |group: &dyn Fn(usize, &Instant) -> Option<Group>| -> Vec<Group> {
        frames.instants.iter().enumerate().filter_map(|(n, i)| group(n, i)).collect()
    };
    let series = frames.series.iter().map(|table| {
        let column =
            |(name, values): (&String, &Vec<f64>)| (name.clone(), Column::Double(values.clone()));
        table.columns.iter().map(column).collect()
    });
    let tables = [
        ("particles", of(&|n, i| particles(n, i, &frames.materials))),
        ("fields", of(&fields)),
        ("stresses", of(&stresses)),
        ("series", series.collect()),
    ];
    let mut files = 0;
    for (name, groups) in tables.into_iter().filter(|(_, groups)| !groups.is_empty()) {
        let path = folder.join(format!("{name}.parquet"));
        let bytes =
            encode(&groups).map_err(|source| ExportError::Encode { path: path.clone(), source })?;
        replace::write(&path, bytes, Kind::Parquet)?;
        files += 1;
    }
    Ok(files)
}

/// Columns of the number and the time (s) of a frame.
fn stamp(n: usize, instant: &Instant, rows: usize) -> Group {
    let number = i32::try_from(n).unwrap_or(i32::MAX);
    vec![
        ("frame".into(), Column::Whole(vec![number; rows])),
        ("time".into(), Column::Double(vec![instant.time_s; rows])),
    ]
}

fn particles(n: usize, instant: &Instant, materials: &[String]) -> Option<Group> {
    let particles = instant.particles.as_ref()?;
    let mut group = stamp(n, instant, particles.positions.len());
    for (c, name) in ["x", "y"].into_iter().enumerate() {
        let values = particles.positions.iter().map(|p| p[c]).collect();
        group.push((name.into(), Column::Single(values)));
    }
    group.push(("material".into(), Column::Text(particles.class.clone(), materials.to_vec())));
    Some(group)
}

fn fields(n: usize, instant: &Instant) -> Option<Group> {
    let first = instant.fields.first()?;
    let rows = first.nx * first.ny;
    let mut group = stamp(n, instant, rows);
    for (c, name) in ["x", "y"].into_iter().enumerate() {
        let values = (0..rows).map(|k| first.centre(k)[c]).collect();
        group.push((name.into(), Column::Single(values)));
    }
    let values = |f: &crate::frame::GridField| (f.name.clone(), Column::Single(f.values.clone()));
    group.extend(instant.fields.iter().map(values));
    Some(group)
}

fn stresses(n: usize, instant: &Instant) -> Option<Group> {
    instant.stresses.first()?;
    let points = || instant.stresses.iter().flat_map(|s| &s.points);
    let mut group = stamp(n, instant, points().count());
    let names: Vec<String> = instant.stresses.iter().map(|s| s.name.clone()).collect();
    let indices = instant.stresses.iter().enumerate();
    let indices = indices.flat_map(|(k, s)| vec![k as u16; s.points.len()]);
    group.push(("surface".into(), Column::Text(indices.collect(), names)));
    type Value = fn(&SurfacePoint) -> f32;
    let columns: [(&str, Value); 7] = [
        ("along", |p| p.along),
        ("x", |p| p.at[0]),
        ("y", |p| p.at[1]),
        ("normal_x", |p| p.normal[0]),
        ("normal_y", |p| p.normal[1]),
        ("normal_stress", |p| p.pressing),
        ("shear_stress", |p| p.shear),
    ];
    for (name, of) in columns {
        group.push((name.into(), Column::Single(points().map(of).collect())));
    }
    Some(group)
}

/// Encodes groups of rows with the same columns.
fn encode(groups: &[Group]) -> Result<Vec<u8>, ParquetError> {
    let columns = groups.first().map_or(&[][..], Vec::as_slice);
    let kinds = columns.iter().map(|(name, column)| kind(name, column).map(Arc::new));
    let schema = Type::group_type_builder("table").with_fields(kinds.collect::<Result<_, _>>()?);
    let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
    let mut bytes = vec![];
    let schema = Arc::new(schema.build()?);
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, Arc::new(properties))?;
    for group in groups {
        let mut rows = writer.next_row_group()?;
        for (_, column) in group {
            let Some(mut out) = rows.next_column()? else { break };
            match column {
                Column::Whole(values) => {
                    out.typed::<Int32Type>().write_batch(values, None, None)?;
                }
                Column::Single(values) => {
                    out.typed::<FloatType>().write_batch(values, None, None)?;
                }
                Column::Double(values) => {
                    out.typed::<DoubleType>().write_batch(values, None, None)?;
                }
                Column::Text(numbers, names) => {
                    let names: Vec<ByteArray> =
                        names.iter().map(|n| ByteArray::from(n.as_str())).collect();
                    let text = |k: &u16| names.get(usize::from(*k)).cloned().unwrap_or_default();
                    let values: Vec<ByteArray> = numbers.iter().map(text).collect();
                    out.typed::<ByteArrayType>().write_batch(&values, None, None)?;
                }
            }
            out.close()?;
        }
        rows.close()?;
    }
    writer.close()?;
    Ok(bytes)
}

/// Type of a column.
fn kind(name: &str, column: &Column) -> Result<Type, ParquetError> {
    let physical = match column {
        Column::Whole(_) => Physical::INT32,
        Column::Single(_) => Physical::FLOAT,
        Column::Double(_) => Physical::DOUBLE,
        Column::Text(..) => Physical::BYTE_ARRAY,
    };
    let text = matches!(column, Column::Text(..)).then_some(LogicalType::String);
    Type::primitive_type_builder(name, physical)
        .with_repetition(Repetition::REQUIRED)
        .with_logical_type(text)
        .build()
}
