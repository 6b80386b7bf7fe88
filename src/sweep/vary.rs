//! This module parses `--vary name=values` and `--sample` and computes the values of the
//! parameters.

use super::SweepError;
use crate::scene::{Quantity, Scope};

/// Significant digits of computed values: enough for any study, and readable.
const DIGITS: usize = 12;
/// Significant digits of sampled values; their generator has 24 bits.
const SAMPLED_DIGITS: usize = 7;
/// Maximum number of values of one range.
const MOST: usize = 100_000;
/// Seed of the Sobol sequence. It gives the same points on every machine.
const SEQUENCE: u32 = 1;

/// Values of one parameter.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Vary {
    /// Name of the parameter.
    pub name: String,
    /// Its values.
    pub values: Values,
}

/// Values of a parameter: listed, or a range to be sampled.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Values {
    /// Listed values, as they are set.
    List(Vec<String>),
    /// A range to be sampled.
    Range(Range),
}

/// A range of values, linear or logarithmic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range {
    from: f64,
    to: f64,
    log: bool,
}

impl Range {
    /// The value at a fraction `share` of the range, as text with `digits` significant digits.
    fn at(&self, share: f64, digits: usize) -> String {
        let Range { from, to, log } = *self;
        let value = match (share, log) {
            (0.0, _) => from,
            (1.0, _) => to,
            (s, true) => from * (to / from).powf(s),
            (s, false) => from + s * (to - from),
        };
        let rounded = format!("{value:.*e}", digits - 1);
        rounded.parse::<f64>().unwrap_or(value).to_string()
    }
}

/// Sampling of ranges that have no count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sample {
    /// This number of points of a scrambled Sobol sequence, which fill all ranges jointly and
    /// evenly.
    Sobol(u32),
}

impl std::str::FromStr for Sample {
    type Err = String;

    fn from_str(text: &str) -> Result<Sample, String> {
        let count = text.strip_prefix("sobol:").and_then(|n| n.parse().ok());
        match count {
            Some(n @ 1..=65_536) => Ok(Sample::Sobol(n)),
            _ => Err("write sobol:N with N from 1 to 65536, such as sobol:64".into()),
        }
    }
}

impl Sample {
    /// Points of the sample: one value for each range.
    pub(super) fn points(self, ranges: &[Range]) -> Vec<Vec<String>> {
        let Sample::Sobol(count) = self;
        let coordinate = |i: u32, k: usize| {
            f64::from(sobol_burley::sample(i, u32::try_from(k).unwrap_or(0), SEQUENCE))
        };
        (0..count)
            .map(|i| {
                let along = ranges.iter().enumerate();
                along.map(|(k, r)| r.at(coordinate(i, k), SAMPLED_DIGITS)).collect()
            })
            .collect()
    }
}

const FORMS: &str = "write name=a,b,c or name=from..to:count or name=log:from..to:count; numbers \
                     may be fractions and expressions: alpha=0,1/3,log:1..100:5";

fn fault(text: &str, message: impl std::fmt::Display, help: &str) -> SweepError {
    SweepError::Usage(format!("--vary {text}: {message}\n  help: {help}"))
}

/// Parses one `--vary`. Its numbers may use the parameters of the scene.
pub(super) fn read(text: &str, scope: &Scope) -> Result<Vary, SweepError> {
    let Some((name, written)) = text.split_once('=') else {
        return Err(fault(text, "there is no `=`", FORMS));
    };
    let name = name.trim().to_owned();
    let items = split(written);
    if name.is_empty() || items.iter().any(|item| item.is_empty()) {
        let what = if name.is_empty() { "there is no name" } else { "a value is missing" };
        return Err(fault(text, what, FORMS));
    }
    let mut list = vec![];
    for item in &items {
        match range(item, scope).map_err(|(message, help)| fault(text, message, help))? {
            Item::One => list.push(item.to_string()),
            Item::Counted(range, count) => {
                let last = (count - 1).max(1) as f64;
                list.extend((0..count).map(|k| range.at(k as f64 / last, DIGITS)));
            }
            Item::Open(range) if items.len() == 1 => {
                return Ok(Vary { name, values: Values::Range(range) });
            }
            Item::Open(_) => {
                let message = format!("`{item}` has no number of values");
                return Err(fault(text, message, "add it: from..to:count"));
            }
        }
    }
    Ok(Vary { name, values: Values::List(list) })
}

enum Item {
    /// A single value, used as it is written.
    One,
    Counted(Range, usize),
    Open(Range),
}

/// Parses `[log:]from..to[:count]`. The error is a message and a help text.
fn range(item: &str, scope: &Scope) -> Result<Item, (String, &'static str)> {
    const COUNT: &str = "the count of a range is a whole number, 2 or more: 0..1:5";
    let (log, rest) = match item.strip_prefix("log:") {
        Some(rest) => (true, rest),
        None => (false, item),
    };
    let quoted = item.starts_with(['"', '\'', '[', '{']);
    let Some((from, rest)) = rest.split_once("..").filter(|_| !quoted) else {
        return if log {
            Err((format!("`{item}` is not a range"), "write log:from..to:count: log:1..1e6:7"))
        } else {
            Ok(Item::One)
        };
    };
    let (to, count) = match rest.split_once(':') {
        Some((to, count)) => (to, Some(count)),
        None => (rest, None),
    };
    let end = |text: &str| {
        let value = Quantity::expression(text).eval(scope);
        value.map_err(|e| (format!("`{text}`: {}", e.message()), FORMS))
    };
    let range = Range { from: end(from)?, to: end(to)?, log };
    if range.from == range.to {
        return Err((format!("the range `{item}` is empty"), "its ends must differ"));
    }
    if log && !(range.from > 0.0 && range.to > 0.0) {
        let help = "a logarithmic range needs ends above zero; list zero beside it: 0,log:1..10:3";
        return Err((format!("the range `{item}` reaches zero"), help));
    }
    match count.map(|c| c.trim().parse::<usize>()) {
        None => Ok(Item::Open(range)),
        Some(Ok(n)) if (2..=MOST).contains(&n) => Ok(Item::Counted(range, n)),
        Some(_) => Err((format!("`{item}` has an invalid count"), COUNT)),
    }
}

/// Splits at commas outside brackets and quotes.
fn split(text: &str) -> Vec<&str> {
    let (mut depth, mut quote, mut start) = (0i32, None, 0);
    let mut items = vec![];
    for (at, c) in text.char_indices() {
        match (quote, c) {
            (Some(q), _) if q == c => quote = None,
            (Some(_), _) => {}
            (None, '"' | '\'') => quote = Some(c),
            (None, '(' | '[' | '{') => depth += 1,
            (None, ')' | ']' | '}') => depth -= 1,
            (None, ',') if depth == 0 => {
                items.push(text[start..at].trim());
                start = at + 1;
            }
            _ => {}
        }
    }
    items.push(text[start..].trim());
    items
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(text: &str) -> Vec<String> {
        let scope = Scope::from_values([("a", 2.0)]);
        match read(text, &scope).expect(text).values {
            Values::List(list) => list,
            Values::Range(_) => panic!("{text} is a range"),
        }
    }

    #[test]
    fn values_are_listed_and_counted() {
        assert_eq!(list("alpha=0, 1/3,2/3"), ["0", "1/3", "2/3"]);
        assert_eq!(list("x=0..1:5"), ["0", "0.25", "0.5", "0.75", "1"]);
        assert_eq!(list("x=8..2:4"), ["8", "6", "4", "2"]);
        assert_eq!(list("c=log:1e1..1e6:6"), ["10", "100", "1000", "10000", "100000", "1000000"]);
        assert_eq!(list("x=0,log:0.1..10:3,a^2..2*a^2:2"), ["0", "0.1", "1", "10", "4", "8"]);
        assert_eq!(list("x=[1,2],min(1,2),\"a,b\""), ["[1,2]", "min(1,2)", "\"a,b\""]);
    }

    #[test]
    fn invalid_values_are_rejected_with_help() {
        for (text, message, help) in [
            ("alpha", "there is no `=`", "from..to:count"),
            ("=1", "there is no name", "name=a,b,c"),
            ("a=1,,2", "a value is missing", "name=a,b,c"),
            ("a=0..1:x", "invalid count", "whole number"),
            ("a=0..1:1", "invalid count", "2 or more"),
            ("a=log:0..1:3", "reaches zero", "0,log:1..10:3"),
            ("a=log:5", "not a range", "log:from..to:count"),
            ("a=1..1:3", "is empty", "must differ"),
            ("a=1,0..1", "has no number of values", "from..to:count"),
            ("a=0..b:3", "unknown name `b`", ""),
        ] {
            let scope = Scope::from_values([("a", 2.0)]);
            let said = read(text, &scope).expect_err(text).to_string();
            assert!(said.starts_with(&format!("--vary {text}: ")), "{said}");
            assert!(said.contains(message) && said.contains(help), "{text}: {said}");
        }
    }

    #[test]
    fn sampled_points_fill_the_box_evenly() {
        let range = |from, to, log| Range { from, to, log };
        let ranges = [range(0.0, 1.0, false), range(1.0, 1e4, true)];
        let points = Sample::Sobol(64).points(&ranges);
        // Every cell of an 8 by 8 grid has one point, wherever the scrambling put it.
        let mut cells: Vec<_> = points
            .iter()
            .map(|p| {
                let number = |k: usize| p[k].parse::<f64>().expect("a number");
                ((number(0) * 8.0) as u32, (number(1).log10() * 2.0) as u32)
            })
            .collect();
        cells.sort();
        cells.dedup();
        assert_eq!(cells.len(), 64);
        assert_eq!(points[..8], Sample::Sobol(8).points(&ranges));
        assert!("sobol:0".parse::<Sample>().is_err() && "grid:3".parse::<Sample>().is_err());
    }
}
