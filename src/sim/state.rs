//! The state of a run as plain columns of numbers: everything that the next step depends on.
//!
//! A run that takes back its state goes on to the last bit as if it had never stopped. So whatever
//! a simulation carries from one step to the next belongs here; what it can work out from that
//! (integration points, matrices, loads) does not. A new field is a new column: readers ask for
//! columns by name.

use super::phases::Phases;
use std::collections::BTreeMap;

/// Values of one kind.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    Floats(Vec<f64>),
    Counts(Vec<u64>),
    Bytes(Vec<u8>),
}

/// Named columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    columns: BTreeMap<String, Column>,
}

/// Why a run cannot go on from a state.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StateError {
    #[error("the state has no `{0}`")]
    Missing(String),
    #[error("`{name}` of the state has {found} values, where {expected} belong")]
    Length { name: String, found: usize, expected: usize },
    #[error("`{name}` of the state is out of range: {value}")]
    Range { name: &'static str, value: String },
}

impl State {
    pub fn columns(&self) -> impl Iterator<Item = (&str, &Column)> {
        self.columns.iter().map(|(name, column)| (name.as_str(), column))
    }

    pub fn insert(&mut self, name: impl Into<String>, column: Column) {
        self.columns.insert(name.into(), column);
    }

    /// Writes a column of numbers; where there was one its room is used again.
    pub fn put_floats(&mut self, name: &str, values: impl IntoIterator<Item = f64>) {
        match self.columns.get_mut(name) {
            Some(Column::Floats(kept)) => refill(kept, values),
            _ => self.insert(name, Column::Floats(values.into_iter().collect())),
        }
    }

    /// As [`State::put_floats`], of counts.
    pub fn put_counts(&mut self, name: &str, values: impl IntoIterator<Item = u64>) {
        match self.columns.get_mut(name) {
            Some(Column::Counts(kept)) => refill(kept, values),
            _ => self.insert(name, Column::Counts(values.into_iter().collect())),
        }
    }

    /// As [`State::put_floats`], of bytes.
    pub fn put_bytes(&mut self, name: &str, values: impl IntoIterator<Item = u8>) {
        match self.columns.get_mut(name) {
            Some(Column::Bytes(kept)) => refill(kept, values),
            _ => self.insert(name, Column::Bytes(values.into_iter().collect())),
        }
    }

    /// Takes a column out.
    pub fn remove(&mut self, name: &str) {
        self.columns.remove(name);
    }

    /// A column that only some runs have.
    pub fn try_floats(&self, name: &str) -> Option<&[f64]> {
        match self.columns.get(name) {
            Some(Column::Floats(values)) => Some(values),
            _ => None,
        }
    }

    pub fn floats(&self, name: &str) -> Result<&[f64], StateError> {
        self.try_floats(name).ok_or_else(|| StateError::Missing(name.into()))
    }

    pub fn counts(&self, name: &str) -> Result<&[u64], StateError> {
        match self.columns.get(name) {
            Some(Column::Counts(values)) => Ok(values),
            _ => Err(StateError::Missing(name.into())),
        }
    }

    pub fn try_bytes(&self, name: &str) -> Option<&[u8]> {
        match self.columns.get(name) {
            Some(Column::Bytes(values)) => Some(values),
            _ => None,
        }
    }

    pub fn bytes(&self, name: &str) -> Result<&[u8], StateError> {
        self.try_bytes(name).ok_or_else(|| StateError::Missing(name.into()))
    }

    /// A text column.
    pub fn text(&self, name: &str) -> Result<&str, StateError> {
        std::str::from_utf8(self.bytes(name)?).map_err(|_| StateError::Missing(name.into()))
    }

    /// Exactly `N` numbers.
    pub fn numbers<const N: usize>(&self, name: &str) -> Result<[f64; N], StateError> {
        let values = self.floats(name)?;
        values.try_into().map_err(|_| wrong_length(name, values.len(), N))
    }

    /// Exactly `N` counts.
    pub fn tally<const N: usize>(&self, name: &str) -> Result<[u64; N], StateError> {
        let values = self.counts(name)?;
        values.try_into().map_err(|_| wrong_length(name, values.len(), N))
    }

    /// `count` numbers.
    pub(super) fn exactly(&self, name: &str, count: usize) -> Result<&[f64], StateError> {
        let values = self.floats(name)?;
        if values.len() == count {
            Ok(values)
        } else {
            Err(wrong_length(name, values.len(), count))
        }
    }

    /// `count` tuples of numbers.
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

/// Writes seconds by phase.
pub fn save_phases(name: &str, phases: &Phases, s: &mut State) {
    s.put_floats(name, phases.list().map(|(_, seconds)| seconds));
}

/// Reads what [`save_phases`] wrote.
pub fn load_phases(name: &str, s: &State) -> Result<Phases, StateError> {
    let [quadrature, weight, assemble, factor, solve, motion, dye, population, diagnostics] =
        s.numbers(name)?;
    Ok(Phases { quadrature, weight, assemble, factor, solve, motion, dye, population, diagnostics })
}
