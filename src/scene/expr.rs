//! This module parses and evaluates arithmetic expressions over named numbers and the coordinates
//! `x` and `y`.
//!
//! The crate `exmex` folds constants and evaluates. Its own grammar gives `-` a higher precedence
//! than `^`, makes `^` left-associative, splits names (`minimum`) and misreads nested commas. The
//! text is therefore parsed here first, and passed to `exmex` with values in place of names and
//! with all parentheses.

mod reader;

use reader::{OPERATORS, Reader, name_length, number_length};
use std::ops::Range;
use std::sync::Arc;

use exmex::{BinOp, Express, FlatEx, MakeOperators, MatchLiteral, Operator};

/// Longest expression, in bytes.
pub const MAX_LENGTH: usize = 2000;
/// Deepest nesting of parentheses, signs and powers.
pub const MAX_DEPTH: usize = 64;

type Unary = fn(f64) -> f64;
type Binary = fn(f64, f64) -> f64;

/// Functions of one argument, and the negative sign.
const UNARY: [(&str, Unary); 16] = [
    ("sqrt", f64::sqrt),
    ("abs", f64::abs),
    ("sin", f64::sin),
    ("cos", f64::cos),
    ("tan", f64::tan),
    ("sinh", f64::sinh),
    ("cosh", f64::cosh),
    ("tanh", f64::tanh),
    ("exp", f64::exp),
    ("ln", f64::ln),
    ("log10", f64::log10),
    ("floor", f64::floor),
    ("ceil", f64::ceil),
    ("round", f64::round),
    ("sign", |a| if a == 0.0 { a } else { a.signum() }),
    ("-", |a| -a),
];

/// Functions of two arguments. `min` and `max` return NaN if an argument is NaN.
const BINARY: [(&str, Binary); 3] = [
    ("min", |a, b| if a < b || a.is_nan() { a } else { b }),
    ("max", |a, b| if a > b || a.is_nan() { a } else { b }),
    ("atan2", f64::atan2),
];

/// An operator between two operands: its text, its precedence and its function.
type Infix = (&'static str, u8, Binary);

/// Operators between two operands. If one is the beginning of another, the longer comes first.
const INFIX: [Infix; 11] = [
    ("||", 1, |a, b| truth(a != 0.0 || b != 0.0)),
    ("&&", 2, |a, b| truth(a != 0.0 && b != 0.0)),
    ("<=", COMPARISON, |a, b| truth(a <= b)),
    (">=", COMPARISON, |a, b| truth(a >= b)),
    ("<", COMPARISON, |a, b| truth(a < b)),
    (">", COMPARISON, |a, b| truth(a > b)),
    ("+", 4, |a, b| a + b),
    ("-", 4, |a, b| a - b),
    ("*", 5, |a, b| a * b),
    ("/", 5, |a, b| a / b),
    ("^", POWER, f64::powf),
];
const COMPARISON: u8 = 3;
const SIGN: u8 = 6;
const POWER: u8 = 7;

/// Constants that are always defined.
const CONSTANTS: [(&str, f64); 2] = [("pi", std::f64::consts::PI), ("PI", std::f64::consts::PI)];

fn truth(yes: bool) -> f64 {
    f64::from(u8::from(yes))
}

/// The functions and constants an expression may use.
pub fn builtin_names() -> impl Iterator<Item = &'static str> {
    let unary = UNARY.iter().map(|(name, _)| *name).filter(|name| *name != "-");
    unary.chain(BINARY.iter().map(|(name, _)| *name)).chain(CONSTANTS.iter().map(|(name, _)| *name))
}

/// Whether the text is a valid name in expressions.
pub fn is_name(text: &str) -> bool {
    !text.is_empty() && name_length(text) == text.len()
}

/// An error in an expression: message, remedy and position.
#[derive(Clone, Debug, PartialEq)]
pub struct ExprError {
    /// Message that says what is wrong.
    pub message: String,
    /// Remedy; may be empty.
    pub help: String,
    /// Byte range of the error in the expression.
    pub at: Range<usize>,
}

#[derive(Clone, Debug)]
struct Operators;

impl MakeOperators<f64> for Operators {
    fn make<'a>() -> Vec<Operator<'a, f64>> {
        // All operations are in parentheses, so priorities do not matter.
        let bin = |apply| BinOp { apply, prio: 0, is_commutative: false };
        let infix =
            INFIX.iter().map(|&(text, _, apply)| match UNARY.iter().find(|u| u.0 == text) {
                Some(&(_, unary)) => Operator::make_bin_unary(text, bin(apply), unary),
                None => Operator::make_bin(text, bin(apply)),
            });
        let unary = UNARY.iter().filter(|u| u.0 != "-").map(|&(t, f)| Operator::make_unary(t, f));
        let binary = BINARY.iter().map(|&(text, apply)| Operator::make_bin(text, bin(apply)));
        infix.chain(unary).chain(binary).collect()
    }
}

#[derive(Clone, Debug)]
struct Literal;

impl MatchLiteral for Literal {
    fn is_literal(text: &str) -> Option<&str> {
        text.get(..number_length(text)).filter(|t| !t.is_empty())
    }
}

/// Names of variables, in alphabetical order.
pub type Variables = &'static [&'static str];

/// The coordinates.
pub const COORDINATES: Variables = &["x", "y"];

/// The time.
pub const TIME: Variables = &["t"];

/// A compiled expression in `x` and `y`, or in `t`; cheap to clone.
#[derive(Clone, Debug)]
pub struct Expr(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    flat: FlatEx<f64, Operators, Literal>,
    uses: [bool; 2],
}

impl PartialEq for Expr {
    /// Two expressions are equal if their texts are equal after names are replaced by values.
    fn eq(&self, other: &Self) -> bool {
        self.0.flat.unparse() == other.0.flat.unparse()
    }
}

impl Expr {
    /// Parses an expression. `names` gives the values of the names that it may use, and `known`
    /// lists them for messages. `variables`: those that it may use, no more than two.
    pub fn parse<'a>(
        text: &str,
        names: &'a dyn Fn(&str) -> Option<f64>,
        known: &'a dyn Fn() -> Vec<&'a str>,
        variables: Variables,
    ) -> Result<Self, ExprError> {
        if text.len() > MAX_LENGTH {
            let message =
                format!("the expression has {} bytes, more than {MAX_LENGTH}", text.len());
            let help = "split it with the help of [parameters]".to_owned();
            return Err(ExprError { message, help, at: 0..text.len() });
        }
        let mut reader =
            Reader { text, pos: 0, depth: 0, names, known, variables, uses: [false; 2] };
        let canonical = reader.expression(0)?;
        if let Some(rest) = reader.rest().chars().next() {
            let what = match rest {
                ')' => "`)` without `(`".to_owned(),
                '=' | '!' => format!("unknown operator `{rest}`"),
                _ => format!("expected an operator, found `{rest}`"),
            };
            return Err(reader.error(what, OPERATORS, rest.len_utf8()));
        }
        let flat = FlatEx::parse(&canonical).map_err(|e| ExprError {
            message: format!("cannot evaluate: {e}"),
            help: String::new(),
            at: 0..text.len(),
        })?;
        Ok(Expr(Arc::new(Inner { flat, uses: reader.uses })))
    }

    /// Whether the value does not depend on a variable.
    pub fn is_constant(&self) -> bool {
        self.0.uses == [false; 2]
    }

    /// The value at a point (m), or at a time `x` (s); NaN where the expression is undefined.
    pub fn at(&self, x: f64, y: f64) -> f64 {
        let Inner { flat, uses } = &*self.0;
        match uses {
            [true, true] => flat.eval(&[x, y]),
            [true, false] => flat.eval(&[x]),
            [false, true] => flat.eval(&[y]),
            [false, false] => flat.eval(&[]),
        }
        .unwrap_or(f64::NAN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Expr, ExprError> {
        let names = |name: &str| match name {
            "a" => Some(2.0),
            "minimum" => Some(-3.0),
            _ => None,
        };
        Expr::parse(text, &names, &|| vec!["a", "minimum"], COORDINATES)
    }

    fn value(text: &str) -> f64 {
        parse(text).unwrap_or_else(|e| panic!("{text}: {e:?}")).at(0.5, -1.5)
    }

    #[test]
    fn follows_the_usual_precedence() {
        for (text, expected) in [
            ("1+2*3", 7.0),
            ("(1+2)*3", 9.0),
            ("8/2/2", 2.0),
            ("8-2-2", 4.0),
            ("2/3*3", 2.0),
            ("2*3/4*5", 7.5),
            ("-2^2", -4.0),
            ("(-2)^2", 4.0),
            ("2^3^2", 512.0),
            ("2^-1", 0.5),
            ("2^-a^2", 0.0625),
            ("-a^2*3", -12.0),
            ("--a", 2.0),
            ("3 - -a", 5.0),
            ("3*-a", -6.0),
            ("+a", 2.0),
            ("x-y", 2.0),
            ("y", -1.5),
            ("minimum", -3.0),
            ("minimum^2", 9.0),
            ("-minimum", 3.0),
            ("min(max(1, a), 5) + min(1, max(2, min(3, 4)))", 3.0),
            ("max(min(a, 1), min(-1, -a))", 1.0),
            ("atan2(1, 1)*4/pi", 1.0),
            ("sqrt(a*8)", 4.0),
            ("sin(PI/2)+cos(0)", 2.0),
            ("-sin(-(pi/2))", 1.0),
            ("abs(-(a+1))*2", 6.0),
            ("log10(1000)", 3.0),
            ("ln(exp(2))", 2.0),
            ("tanh(0)+sinh(0)+cosh(0)+tan(0)", 1.0),
            ("floor(1.7)+ceil(1.2)+round(2.5)", 6.0),
            ("sign(-3)+sign(0)+sign(a)", 0.0),
        ] {
            assert!((value(text) - expected).abs() < 1e-14, "{text} = {}", value(text));
        }
    }

    #[test]
    fn reads_all_forms_of_numbers() {
        for (text, expected) in [
            ("1e-3", 1e-3),
            ("2.5E6", 2.5e6),
            ("1e+2", 100.0),
            (".5", 0.5),
            ("5.", 5.0),
            ("1e-3*2e3", 2.0),
            ("1e300*1e-300", 1.0),
            ("3e0-1", 2.0),
        ] {
            assert_eq!(value(text), expected, "{text}");
        }
    }

    #[test]
    fn compares() {
        for (text, expected) in [
            ("x < 1", 1.0),
            ("x > 1", 0.0),
            ("x <= 0.5", 1.0),
            ("y >= -1.5", 1.0),
            ("x < 1 && y > 0", 0.0),
            ("x < 1 || y > 0", 1.0),
            ("1 || 0 && 0", 1.0),
            ("1 + 1 < 1 * 3", 1.0),
            ("(x > 0) * 7", 7.0),
            ("x^2 + y^2 < 4 && !0", f64::NAN),
        ] {
            match parse(text) {
                Ok(e) => assert_eq!(e.at(0.5, -1.5), expected, "{text}"),
                Err(_) => assert!(expected.is_nan(), "{text}"),
            }
        }
    }

    #[test]
    fn says_what_is_wrong_and_where() {
        for (text, at, message, help) in [
            ("1 + alhpa", 4..9, "unknown name `alhpa`", "known names are: `a`"),
            ("1 + minimun", 4..11, "unknown name", "did you mean `minimum`?"),
            ("srqt(2)", 0..4, "unknown function `srqt`", "did you mean `sqrt`?"),
            ("sqrt", 0..4, "`sqrt` is a function", "sqrt(...)"),
            ("sqrt(1, 2)", 0..10, "takes 1 argument, not 2", ""),
            ("min(1)", 0..6, "takes 2 arguments, not 1", "nest"),
            ("1 +", 3..3, "ends too early", ""),
            ("  ", 2..2, "is empty", ""),
            ("(1 + 2", 0..1, "`(` is not closed", "`)`"),
            ("1 + sin(2", 4..8, "`(` is not closed", "`)`"),
            ("1)", 1..2, "`)` without `(`", ""),
            ("1 == 2", 2..3, "unknown operator `=`", "<="),
            ("2a", 1..2, "expected an operator, found `a`", "* /"),
            ("2 é", 2..4, "found `é`", ""),
            ("0 < x < 1", 6..7, "cannot be chained", "&&"),
            ("1e999", 0..5, "not a number", ""),
            ("* 2", 0..1, "expected a number", ""),
        ] {
            let e = parse(text).expect_err(text);
            assert!(e.message.contains(message), "{text}: {e:?}");
            assert!(e.help.contains(help), "{text}: {e:?}");
            assert_eq!(e.at, at, "{text}: {e:?}");
        }
    }

    #[test]
    fn limits_length_and_depth() {
        let nested = |n: usize| "(".repeat(n) + "1" + &")".repeat(n);
        assert_eq!(value(&nested(MAX_DEPTH)), 1.0);
        for deep in
            [nested(900), "-".repeat(1999) + "1", "2^".repeat(900) + "1", "sin(".repeat(500)]
        {
            assert!(parse(&deep).is_err_and(|e| e.message.contains("nested deeper")), "{deep}");
        }
        let sum = "x+".repeat(999) + "x";
        assert_eq!(value(&sum), 500.0);
        let long = "x+".repeat(100_000) + "x";
        assert!(parse(&long).is_err_and(|e| e.message.contains("more than 2000")));
    }

    /// A random expression with as few parentheses as the grammar requires, and its value.
    fn random_expression(random: &mut impl FnMut(usize) -> usize, depth: usize) -> (String, f64) {
        let wrapped = |(text, value): (String, f64)| (format!("({text})"), value);
        if depth == 0 || random(8) == 0 {
            return match random(5) {
                0 => ("x".into(), 0.5),
                1 => ("y".into(), -1.5),
                2 => ("minimum".into(), -3.0),
                3 => ("1.5e-1".into(), 0.15),
                _ => ("a".into(), 2.0),
            };
        }
        let (left, l) = wrapped(random_expression(random, depth - 1));
        let (right, r) = wrapped(random_expression(random, depth - 1));
        match random(9) {
            0 => (format!("{left} + {right}"), l + r),
            1 => (format!("{left} - {right}"), l - r),
            2 => (format!("{left}*{right}"), l * r),
            3 => (format!("{left} < {right}"), truth(l < r)),
            4 => (format!("-{left}"), -l),
            5 => (format!("sin{left}"), l.sin()),
            6 => (format!("min({left}, {right})"), l.min(r)),
            7 => (format!("-cos({left}*{left} - {right})"), -(l * l - r).cos()),
            _ => (format!("1 - -{left}^2*3 + abs({right})"), 1.0 + l.powf(2.0) * 3.0 + r.abs()),
        }
    }

    #[test]
    fn evaluates_random_expressions() {
        let mut state = 3u64;
        let mut random = |n: usize| {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as usize % n
        };
        for _ in 0..3000 {
            let depth = 1 + random(5);
            let (text, expected) = random_expression(&mut random, depth);
            if text.len() <= MAX_LENGTH {
                assert_eq!(value(&text), expected, "{text}");
            }
        }
    }

    #[test]
    fn constant_unless_coordinates_occur() {
        assert!(parse("a + 1").is_ok_and(|e| e.is_constant()));
        assert!(parse("a + x").is_ok_and(|e| !e.is_constant()));
        assert_eq!(parse("a+x").ok(), parse("2 + x").ok());
        assert_ne!(parse("a+x").ok(), parse("2 + y").ok());
        let e = Expr::parse("x", &|_| None, &Vec::new, &[]).expect_err("no coordinates");
        assert!(e.message.contains("`x` is a coordinate"), "{e:?}");
    }

    #[test]
    fn random_texts_never_panic() {
        let parts =
            ["x", "a", "1e", ".", "(", ")", "-", "^", "min", ",", "<", "&&", "é", "{", "sin(", " "];
        let mut state = 1u64;
        for _ in 0..20_000 {
            let mut text = String::new();
            for _ in 0..12 {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                text.push_str(parts[(state >> 60) as usize]);
            }
            if let Ok(e) = parse(&text) {
                e.at(0.5, 0.25);
            }
        }
    }
}
