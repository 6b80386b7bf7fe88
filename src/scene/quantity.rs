//! This module reads the values of a scene file: numbers, or expressions over the scene's
//! parameters.

use std::borrow::Cow;
use std::fmt;
use std::ops::Range;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Deserialize, Deserializer, Visitor};
use serde::ser::{Serialize, Serializer};
use toml::Spanned;

use super::error::{Place, SceneError};
use super::expr::{COORDINATES, Expr, ExprError, TIME, Variables};
use super::scope::Scope;

/// A number, or an expression over the scene's parameters such as `"alpha * aperture"`.
pub type Quantity = Value<false>;

/// A number, or an expression over the scene's parameters and the coordinates `x` and `y`.
pub type Field = Value<true>;

/// A number or an expression; `XY` states whether it may use the coordinates.
///
/// Two values are equal if they are written the same; their place in the file does not matter.
#[derive(Clone, Debug)]
pub struct Value<const XY: bool> {
    raw: Raw,
    span: Option<Range<usize>>,
}

#[derive(Clone, Debug, PartialEq)]
enum Raw {
    Number(f64),
    Text(Box<str>),
}

impl<const XY: bool> Value<XY> {
    /// A number that comes from no scene file.
    pub fn number(value: f64) -> Self {
        Value { raw: Raw::Number(value), span: None }
    }

    /// An expression that comes from no scene file.
    pub fn expression(text: impl Into<Box<str>>) -> Self {
        Value { raw: Raw::Text(text.into()), span: None }
    }

    /// Byte range of the value in the scene's text, quotes included; `None` if it comes from no
    /// file.
    pub fn span(&self) -> Option<Range<usize>> {
        self.span.clone()
    }

    /// Compiles the expression with the values of the parameters.
    fn read(&self, text: &str, scope: &Scope, variables: Variables) -> Result<Expr, SceneError> {
        let known = || scope.iter().map(|(name, _)| name).collect();
        Expr::parse(text, &|name| scope.get(name), &known, variables)
            .map_err(|error| self.fault(text, &error))
    }

    /// The error with the position of the faulty part of the expression, or of the whole value if
    /// it contains escape sequences.
    fn fault(&self, text: &str, error: &ExprError) -> SceneError {
        let exact = self.span().filter(|s| s.len() == text.len() + 2);
        let place = match exact {
            Some(s) => Some(s.start + 1 + error.at.start..s.start + 1 + error.at.end),
            None => self.span(),
        };
        SceneError::at(&place, format!("{} in {}", error.message, self.shown()), &error.help)
    }

    /// The value as written, shortened to fit into a message.
    fn shown(&self) -> String {
        let text = self.to_string();
        match text.char_indices().nth(80) {
            Some((end, _)) => format!("{}...", &text[..end]),
            None => text,
        }
    }

    fn finite(&self, value: f64) -> Result<f64, SceneError> {
        if value.is_finite() {
            return Ok(value);
        }
        let message = format!("{} is not finite: it is {value}", self.shown());
        let help = "look for a division by zero, a root or logarithm of a negative number, or \
                    too large a power";
        Err(SceneError::at(self, message, help))
    }
}

impl Value<false> {
    /// The finite value for the given parameters; fails if the expression is invalid or not finite.
    pub fn eval(&self, scope: &Scope) -> Result<f64, SceneError> {
        match &self.raw {
            Raw::Number(value) => self.finite(*value),
            Raw::Text(text) => self.finite(self.read(text, scope, &[])?.at(0.0, 0.0)),
        }
    }

    /// The function of the time `t` (s), which [`FieldFn::at`] takes as its first argument; fails if the
    /// expression is invalid, or constant and not finite, or if `t` is a parameter.
    pub fn in_time(&self, scope: &Scope) -> Result<FieldFn, SceneError> {
        let expr = match &self.raw {
            Raw::Number(value) => return Ok(FieldFn::Constant(self.finite(*value)?)),
            Raw::Text(text) => self.read(text, scope, TIME)?,
        };
        if expr.is_constant() {
            return Ok(FieldFn::Constant(self.finite(expr.at(0.0, 0.0))?));
        }
        if scope.get(TIME[0]).is_some() {
            let message =
                format!("{} uses `t`, which is the time here, and a parameter too", self.shown());
            return Err(SceneError::at(self, message, "give the parameter another name"));
        }
        Ok(FieldFn::Varying(expr))
    }
}

impl Value<true> {
    /// The function of `x` and `y` for the given parameters; fails if the expression is invalid, or
    /// constant and not finite.
    pub fn compile(&self, scope: &Scope) -> Result<FieldFn, SceneError> {
        let expr = match &self.raw {
            Raw::Number(value) => return Ok(FieldFn::Constant(self.finite(*value)?)),
            Raw::Text(text) => self.read(text, scope, COORDINATES)?,
        };
        if expr.is_constant() {
            Ok(FieldFn::Constant(self.finite(expr.at(0.0, 0.0))?))
        } else {
            let origin = scope.origin();
            let far = origin != [0.0; 2];
            Ok(if far { FieldFn::Shifted(expr, origin) } else { FieldFn::Varying(expr) })
        }
    }
}

impl From<Quantity> for Field {
    /// The same number or expression as a field that does not use the coordinates.
    fn from(q: Quantity) -> Field {
        Value { raw: q.raw, span: q.span }
    }
}

/// A compiled [`Field`]; cheap to clone.
#[derive(Clone, Debug, PartialEq)]
pub enum FieldFn {
    /// A value that is the same everywhere.
    Constant(f64),
    /// An expression that depends on the position.
    Varying(Expr),
    /// An expression of the position plus this origin (m).
    Shifted(Expr, [f64; 2]),
}

impl FieldFn {
    /// The value, if it is the same everywhere.
    pub fn constant(&self) -> Option<f64> {
        match self {
            FieldFn::Constant(value) => Some(*value),
            FieldFn::Varying(_) | FieldFn::Shifted(..) => None,
        }
    }

    /// The value at a point (m, relative to [`Scope::origin`]); NaN or infinite where the expression is undefined.
    pub fn at(&self, x: f64, y: f64) -> f64 {
        match self {
            FieldFn::Constant(value) => *value,
            FieldFn::Varying(expr) => expr.at(x, y),
            FieldFn::Shifted(expr, [dx, dy]) => expr.at(x + dx, y + dy),
        }
    }
}

impl<const XY: bool> Place for Value<XY> {
    fn place(&self) -> Option<Range<usize>> {
        self.span()
    }
}

impl<const XY: bool> PartialEq for Value<XY> {
    fn eq(&self, other: &Self) -> bool {
        self.raw == other.raw
    }
}

impl<const XY: bool> fmt::Display for Value<XY> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match &self.raw {
            Raw::Number(value) => write!(f, "{value}"),
            Raw::Text(text) => write!(f, "\"{text}\""),
        }
    }
}

impl<const XY: bool> Serialize for Value<XY> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.raw {
            Raw::Number(value) => serializer.serialize_f64(*value),
            Raw::Text(text) => serializer.serialize_str(text),
        }
    }
}

impl<'de, const XY: bool> Deserialize<'de> for Value<XY> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let spanned = Spanned::<Raw>::deserialize(deserializer)?;
        Ok(Value { span: Some(spanned.span()), raw: spanned.into_inner() })
    }
}

impl<'de> Deserialize<'de> for Raw {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(RawVisitor)
    }
}

struct RawVisitor;

impl Visitor<'_> for RawVisitor {
    type Value = Raw;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a number or an expression in quotes, such as 0.5 or \"2 * alpha\"")
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<Raw, E> {
        Ok(Raw::Number(value as f64))
    }

    fn visit_u64<E: de::Error>(self, value: u64) -> Result<Raw, E> {
        Ok(Raw::Number(value as f64))
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<Raw, E> {
        if value.is_finite() {
            Ok(Raw::Number(value))
        } else {
            Err(E::custom(format_args!("{value} is not finite, expected a finite number")))
        }
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<Raw, E> {
        Ok(Raw::Text(text.into()))
    }
}

impl<const XY: bool> JsonSchema for Value<XY> {
    fn schema_name() -> Cow<'static, str> {
        if XY { "Field" } else { "Quantity" }.into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let names = if XY { "the scene's parameters, x and y" } else { "the scene's parameters" };
        json_schema!({
            "description": format!("A number, or an expression over {names}."),
            "type": ["number", "string"],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::source::SceneSource;
    use serde::{Deserialize, Serialize};

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Values {
        list: Vec<Quantity>,
        field: Field,
    }

    fn scope() -> Scope {
        Scope::from_values([("alpha", 0.5), ("zero", 0.0)])
    }

    #[test]
    fn reads_numbers_and_texts_with_spans() {
        let text = "list = [1, 2.5, \"2*alpha\"]\nfield = \"x + y\"\n";
        let values: Values = toml::from_str(text).expect("valid");
        let span = values.list[2].span().expect("from a file");
        assert_eq!(&text[span], "\"2*alpha\"");
        let numbers: Vec<_> =
            values.list.iter().map(|q| q.eval(&scope()).expect("valid")).collect();
        assert_eq!(numbers, [1.0, 2.5, 1.0]);
        let back: Values =
            toml::from_str(&toml::to_string(&values).expect("serializes")).expect("valid");
        assert_eq!(back, values);
    }

    #[test]
    fn refuses_other_types_and_infinite_numbers() {
        for (value, message) in [
            ("true", "expected a number or an expression in quotes"),
            ("[1]", "expected a number or an expression in quotes"),
            ("{ a = 1 }", "expected a number or an expression in quotes"),
            ("1979-05-27", "expected a number or an expression in quotes"),
            ("nan", "NaN is not finite"),
            ("-inf", "-inf is not finite"),
        ] {
            let error = toml::from_str::<Values>(&format!("field = 1\nlist = [0, {value}]"))
                .expect_err(value);
            assert!(error.message().contains(message), "{value}: {error}");
            assert_eq!(error.span().map(|s| s.start), Some(21), "{value}: {error}");
        }
    }

    #[test]
    fn points_into_the_expression() {
        let text = "field = 0\nlist = [\"1 + alhpa\"]\n";
        let values: Values = toml::from_str(text).expect("valid");
        let source = SceneSource::new("s.toml", text);
        let error = values.list[0].eval(&scope()).expect_err("unknown").with_source(&source);
        assert!(error.one_line().starts_with("s.toml:2:14: unknown name `alhpa` in \"1 + alhpa\""));
        assert!(error.one_line().contains("did you mean `alpha`?"), "{}", error.one_line());
    }

    #[test]
    fn quantities_are_finite() {
        for text in ["1/zero", "ln(-1)", "10^400", "zero/zero"] {
            let error = Quantity::expression(text).eval(&scope()).expect_err(text);
            assert!(error.message().contains(text), "{error}");
            assert!(error.message().contains("is not finite: it is"), "{error}");
            assert!(Field::expression(text).compile(&scope()).is_err());
        }
        assert!(Quantity::number(f64::NAN).eval(&scope()).is_err());
        assert!(Quantity::expression("x").eval(&scope()).is_err());
    }

    #[test]
    fn fields_depend_on_the_position() {
        let field = Field::expression("alpha*x + y^2").compile(&scope()).expect("valid");
        assert_eq!(field.constant(), None);
        assert_eq!(field.at(2.0, 3.0), 10.0);
        let constant = Field::expression("alpha*2").compile(&scope()).expect("valid");
        assert_eq!(constant.constant(), Some(1.0));
        assert_ne!(field, constant);
        fn shareable<T: Send + Sync + Clone + fmt::Debug>(_: &T) {}
        shareable(&field);
    }
}
