//! This module holds the state of a run as columns of numbers: all quantities on which the next
//! step depends.
//!
//! A run restored from its state continues bit for bit as if it had not stopped. Every quantity
//! carried from step to step must therefore be saved in [`State`]. Quantities that can be computed
//! from the state (integration points, matrices, loads) are not saved. Each quantity has its own
//! column; readers ask for columns by name.

use super::phases::Phases;
use crate::words::count;
use std::collections::BTreeMap;

/// A column of values of one type.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    /// Floating-point numbers.
    Floats(Vec<f64>),
    /// Non-negative integers.
    Counts(Vec<u64>),
    /// Bytes, or text in UTF-8.
    Bytes(Vec<u8>),
}

/// The state of a run: columns by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    columns: BTreeMap<String, Column>,
}

/// Why a run cannot continue from a state.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StateError {
    /// A column is missing or has another type.
    #[error("the state has no column `{0}`")]
    Missing(String),
    /// A column has the wrong length.
    #[error("column `{name}` of the state has {} instead of {expected}", count(.found, "value"))]
    Length {
        /// Name of the column.
        name: String,
        /// Number of values found.
        found: usize,
        /// Number of values expected.
        expected: usize,
    },
    /// A value is out of range.
    #[error("`{name}` of the state is out of range: {value}")]
    Range {
        /// Name of the column, and of the value if the column holds several.
        name: &'static str,
        /// The value.
        value: String,
    },
}

impl State {
    /// All columns with their names, sorted by name.
    pub fn columns(&self) -> impl Iterator<Item = (&str, &Column)> {
        self.columns.iter().map(|(name, column)| (name.as_str(), column))
    }

    /// Inserts or replaces a column.
    pub fn insert(&mut self, name: impl Into<String>, column: Column) {
        self.columns.insert(name.into(), column);
    }

    /// Writes a column of numbers; an existing column is overwritten and its memory is reused.
    pub fn put_floats(&mut self, name: &str, values: impl IntoIterator<Item = f64>) {
        match self.columns.get_mut(name) {
            Some(Column::Floats(kept)) => refill(kept, values),
            _ => self.insert(name, Column::Floats(values.into_iter().collect())),
        }
    }

    /// Writes a column of counts; see [`State::put_floats`].
    pub fn put_counts(&mut self, name: &str, values: impl IntoIterator<Item = u64>) {
        match self.columns.get_mut(name) {
            Some(Column::Counts(kept)) => refill(kept, values),
            _ => self.insert(name, Column::Counts(values.into_iter().collect())),
        }
    }

    /// Writes a column of bytes; see [`State::put_floats`].
    pub fn put_bytes(&mut self, name: &str, values: impl IntoIterator<Item = u8>) {
        match self.columns.get_mut(name) {
            Some(Column::Bytes(kept)) => refill(kept, values),
            _ => self.insert(name, Column::Bytes(values.into_iter().collect())),
        }
    }

    /// Removes a column.
    pub fn remove(&mut self, name: &str) {
        self.columns.remove(name);
    }

    /// A column of numbers; `None` if the run has none of this name.
    pub fn try_floats(&self, name: &str) -> Option<&[f64]> {
        match self.columns.get(name) {
            Some(Column::Floats(values)) => Some(values),
            _ => None,
        }
    }

    /// A column of numbers.
    pub fn floats(&self, name: &str) -> Result<&[f64], StateError> {
        self.try_floats(name).ok_or_else(|| StateError::Missing(name.into()))
    }

    /// A column of counts.
    pub fn counts(&self, name: &str) -> Result<&[u64], StateError> {
        match self.columns.get(name) {
            Some(Column::Counts(values)) => Ok(values),
            _ => Err(StateError::Missing(name.into())),
        }
    }

    /// A column of bytes; `None` if the run has none of this name.
    pub fn try_bytes(&self, name: &str) -> Option<&[u8]> {
        match self.columns.get(name) {
            Some(Column::Bytes(values)) => Some(values),
            _ => None,
        }
    }

    /// A column of bytes.
    pub fn bytes(&self, name: &str) -> Result<&[u8], StateError> {
        self.try_bytes(name).ok_or_else(|| StateError::Missing(name.into()))
    }

    /// A column of text.
    pub fn text(&self, name: &str) -> Result<&str, StateError> {
        std::str::from_utf8(self.bytes(name)?).map_err(|_| StateError::Missing(name.into()))
    }

    /// A column of exactly `N` numbers.
    pub fn numbers<const N: usize>(&self, name: &str) -> Result<[f64; N], StateError> {
        let values = self.floats(name)?;
        values.try_into().map_err(|_| wrong_length(name, values.len(), N))
    }

    /// A column of exactly `N` numbers; `None` if the run has none of this name.
    pub fn try_numbers<const N: usize>(&self, name: &str) -> Result<Option<[f64; N]>, StateError> {
        self.try_floats(name).map(|_| self.numbers(name)).transpose()
    }

    /// A column of exactly `N` counts.
    pub fn tally<const N: usize>(&self, name: &str) -> Result<[u64; N], StateError> {
        let values = self.counts(name)?;
        values.try_into().map_err(|_| wrong_length(name, values.len(), N))
    }

    /// What a column holds; the default if the run has none of this name.
    pub(super) fn or_default<T: Default>(
        &self,
        name: &str,
        read: impl FnOnce(&Self, &str) -> Result<T, StateError>,
    ) -> Result<T, StateError> {
        if self.columns.contains_key(name) { read(self, name) } else { Ok(T::default()) }
    }

    /// A column of exactly `count` numbers.
    pub(super) fn exactly(&self, name: &str, count: usize) -> Result<&[f64], StateError> {
        let values = self.floats(name)?;
        if values.len() == count {
            Ok(values)
        } else {
            Err(wrong_length(name, values.len(), count))
        }
    }

    /// A column of exactly `count` tuples of `N` numbers.
    pub(super) fn tuples<const N: usize>(
        &self,
        name: &str,
        count: usize,
    ) -> Result<Vec<[f64; N]>, StateError> {
        Ok(self.exactly(name, N * count)?.as_chunks().0.to_vec())
    }
}

fn refill<T>(kept: &mut Vec<T>, values: impl IntoIterator<Item = T>) {
    kept.clear();
    kept.extend(values);
}

pub(super) fn wrong_length(name: &str, found: usize, expected: usize) -> StateError {
    StateError::Length { name: name.into(), found, expected }
}

pub(super) fn flat<const N: usize>(tuples: &[[f64; N]]) -> impl Iterator<Item = f64> + '_ {
    tuples.as_flattened().iter().copied()
}

/// Writes the wall time of each phase, s.
pub fn save_phases(name: &str, phases: &Phases, s: &mut State) {
    s.put_floats(name, phases.list().map(|(_, seconds)| seconds));
}

/// Reads the phases that [`save_phases`] wrote.
///
/// # Errors
/// The column is missing or has the wrong length.
pub fn load_phases(name: &str, s: &State) -> Result<Phases, StateError> {
    let [quadrature, weight, assemble, factor, solve, motion, dye, population, diagnostics] =
        s.numbers(name)?;
    Ok(Phases { quadrature, weight, assemble, factor, solve, motion, dye, population, diagnostics })
}
