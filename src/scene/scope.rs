//! The values of parameters that expressions may use.

use indexmap::IndexMap;

/// Values of the parameters that expressions may use, in the order of the scene file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scope {
    pub(super) values: IndexMap<Box<str>, f64>,
    /// Point (m) relative to which positions are computed: zero, or the lower left corner of a
    /// domain that is far from zero, where coordinates have few digits for the flow.
    pub(super) origin: [f64; 2],
}

impl Scope {
    /// A scope with the given names and values.
    pub fn from_values<'a>(values: impl IntoIterator<Item = (&'a str, f64)>) -> Scope {
        let values = values.into_iter().map(|(name, value)| (name.into(), value)).collect();
        Scope { values, origin: [0.0; 2] }
    }

    /// The value of a parameter; `None` if there is no such parameter.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.values.get(name).copied()
    }

    /// Point (m) relative to which positions are computed.
    pub fn origin(&self) -> [f64; 2] {
        self.origin
    }

    /// Names and values of the parameters, in the order of the scene file.
    pub fn iter(&self) -> impl Iterator<Item = (&str, f64)> {
        self.values.iter().map(|(name, value)| (&**name, *value))
    }
}
