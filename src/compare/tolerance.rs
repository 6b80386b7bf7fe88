//! This module checks tolerances: the largest allowed difference of a value from the first run.

use super::{Value, short};
use crate::results::{Member, ResultsError};
use crate::scene::closest;
use serde::Serialize;

/// Largest allowed difference of a value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Amount {
    /// Fraction of the magnitude in the first run.
    Relative(f64),
    /// Absolute difference in the unit of the value.
    Absolute(f64),
}

/// A quantity and its largest allowed difference.
#[derive(Clone, Debug, PartialEq)]
pub struct Tolerance {
    /// Name of the quantity.
    pub key: String,
    /// Largest allowed difference.
    pub amount: Amount,
}

impl std::str::FromStr for Tolerance {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let help = "write KEY=1% (of the first run's value) or KEY=1e-3 (in its unit)";
        let (key, amount) = text.split_once('=').ok_or(help)?;
        let number = |text: &str| {
            let value: f64 =
                text.trim().parse().map_err(|_| format!("{text:?} is not a number; {help}"))?;
            if value >= 0.0 && value.is_finite() {
                Ok(value)
            } else {
                Err(format!("{value} is not a tolerance: give a finite number, 0 or more"))
            }
        };
        let amount = match amount.trim().strip_suffix('%') {
            Some(percent) => Amount::Relative(number(percent)? / 100.0),
            None => Amount::Absolute(number(amount)?),
        };
        Ok(Tolerance { key: key.trim().to_owned(), amount })
    }
}

impl std::fmt::Display for Amount {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Amount::Relative(share) => write!(f, "{} %", short(100.0 * share)),
            Amount::Absolute(value) => write!(f, "{}", short(*value)),
        }
    }
}

/// Result of checking one tolerance on one run.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// Name of the quantity.
    pub key: String,
    /// Name of the run.
    pub run: String,
    /// Largest allowed difference.
    pub tolerance: Amount,
    /// Value in the first run and in this one; `None` if unknown.
    pub values: [Option<f64>; 2],
    /// Difference, relative or absolute like the tolerance; `None` if a value is unknown.
    pub difference: Option<f64>,
    /// Whether the difference is within the tolerance.
    pub within: bool,
    /// The result as a sentence.
    pub text: String,
}

/// Checks every run but the first. Unknown keys are an error.
pub fn judge(
    tolerances: &[Tolerance],
    members: &[Member],
    values: &[Value],
) -> Result<Vec<Verdict>, ResultsError> {
    let mut list = vec![];
    for tolerance in tolerances {
        let keys = || values.iter().map(|v| v.key.as_str());
        let Some(value) = values.iter().find(|v| v.key == tolerance.key) else {
            let meant = closest(&tolerance.key, keys());
            let meant = meant.map_or(String::new(), |k| format!("; did you mean {k}?"));
            return Err(ResultsError::Usage(format!(
                "--tolerance {}: there is no such value{meant} These can be compared: {}",
                tolerance.key,
                keys().collect::<Vec<_>>().join(", ")
            )));
        };
        for (k, member) in members.iter().enumerate().skip(1) {
            list.push(verdict(tolerance, value, &members[0], member, k));
        }
    }
    Ok(list)
}

fn verdict(
    tolerance: &Tolerance,
    value: &Value,
    first: &Member,
    member: &Member,
    k: usize,
) -> Verdict {
    let (key, amount) = (&tolerance.key, tolerance.amount);
    let pair = [value.values[0], value.values[k]];
    let mut verdict = Verdict {
        key: key.clone(),
        run: member.name.clone(),
        tolerance: amount,
        values: pair,
        difference: None,
        within: false,
        text: format!("{key} of {} cannot be compared with {}", member.name, first.name),
    };
    let [Some(a), Some(b)] = pair else { return verdict };
    let distance = (b - a).abs();
    let difference = match amount {
        Amount::Absolute(_) => distance,
        Amount::Relative(_) if distance == 0.0 => 0.0,
        Amount::Relative(_) => distance / a.abs(),
    };
    let (Amount::Relative(most) | Amount::Absolute(most)) = amount;
    verdict.within = difference <= most;
    verdict.difference = difference.is_finite().then_some(difference);
    let far = match amount {
        Amount::Relative(_) if !difference.is_finite() => "infinitely far".to_owned(),
        Amount::Relative(_) => format!("{} %", short(100.0 * difference)),
        Amount::Absolute(_) => short(difference),
    };
    verdict.text = format!(
        "{key} of {} is {}, {far} from {} of {}; the tolerance is {amount}",
        member.name,
        digits(b),
        digits(a),
        first.name
    );
    verdict
}

/// Formats with six significant digits.
fn digits(value: f64) -> String {
    let text = format!("{value:.5e}");
    text.parse::<f64>().map_or(text.clone(), |v| {
        if (1e-3..1e6).contains(&v.abs()) || v == 0.0 { v.to_string() } else { text }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerances_are_read() {
        let read = |text: &str| text.parse::<Tolerance>();
        let expected = Tolerance { key: "outflow_volume".into(), amount: Amount::Relative(0.01) };
        assert_eq!(read("outflow_volume=1%"), Ok(expected));
        assert_eq!(read("a.b = 1e-3 ").map(|t| t.amount), Ok(Amount::Absolute(1e-3)));
        for wrong in ["outflow_volume", "a=", "a=x%", "a=-1", "a=inf", "a=NaN%"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
