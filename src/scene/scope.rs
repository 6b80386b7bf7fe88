//! The values of parameters that expressions may use.

use indexmap::IndexMap;

/// Values of the parameters that expressions may use, in the order of the scene file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scope {
    pub(super) values: IndexMap<Box<str>, f64>,
}

impl Scope {
    /// A scope with the given names and values.
    pub fn from_values<'a>(values: impl IntoIterator<Item = (&'a str, f64)>) -> Scope {
        Scope { values: values.into_iter().map(|(name, value)| (name.into(), value)).collect() }
    }

    /// The value of a parameter; `None` if there is no such parameter.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.values.get(name).copied()
    }

    /// Names and values of the parameters, in the order of the scene file.
    pub fn iter(&self) -> impl Iterator<Item = (&str, f64)> {
        self.values.iter().map(|(name, value)| (&**name, *value))
    }
}
