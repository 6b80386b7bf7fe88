//! Reads the text of an expression.

use super::super::error::suggestion;
use super::*;

pub(super) const OPERATORS: &str = "operators are + - * / ^ < > <= >= && ||";

/// Parser that rewrites an expression for `exmex`.
pub(super) struct Reader<'t, 'a> {
    pub(super) text: &'t str,
    pub(super) pos: usize,
    pub(super) depth: usize,
    pub(super) names: &'a dyn Fn(&str) -> Option<f64>,
    pub(super) known: &'a dyn Fn() -> Vec<&'a str>,
    pub(super) variables: Variables,
    pub(super) uses: [bool; 2],
}

impl<'t> Reader<'t, '_> {
    pub(super) fn rest(&self) -> &'t str {
        self.text.get(self.pos..).unwrap_or_default()
    }

    pub(super) fn skip_space(&mut self) {
        self.pos = self.text.len() - self.rest().trim_start().len();
    }

    /// An error about the next `length` bytes.
    pub(super) fn error(
        &self,
        message: impl Into<String>,
        help: impl Into<String>,
        length: usize,
    ) -> ExprError {
        let at = self.pos..self.text.len().min(self.pos + length);
        ExprError { message: message.into(), help: help.into(), at }
    }

    pub(super) fn eat(&mut self, token: &str) -> bool {
        let found = self.rest().starts_with(token);
        if found {
            self.pos += token.len();
            self.skip_space();
        }
        found
    }

    /// Parses an expression in parentheses, after a sign or in an exponent.
    pub(super) fn nested(&mut self, tightness: u8) -> Result<String, ExprError> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            let message = format!("nested deeper than {MAX_DEPTH}");
            return Err(self.error(message, "split it with the help of [parameters]", 1));
        }
        let inner = self.expression(tightness)?;
        self.depth -= 1;
        Ok(inner)
    }

    /// Parses operands and operators whose precedence is at least `tightness`.
    pub(super) fn expression(&mut self, tightness: u8) -> Result<String, ExprError> {
        let mut left = self.operand()?;
        let mut compared = false;
        while let Some(&(token, tight, _)) =
            INFIX.iter().find(|op| op.1 >= tightness && self.rest().starts_with(op.0))
        {
            if tight == COMPARISON && std::mem::replace(&mut compared, true) {
                let help = "join comparisons with &&: `0 < x && x < 1`";
                return Err(self.error("comparisons cannot be chained", help, token.len()));
            }
            self.eat(token);
            // The exponent of a power may have a sign and further powers.
            let right = match tight {
                POWER => self.nested(SIGN)?,
                _ => self.expression(tight + 1)?,
            };
            left = format!("({left} {token} {right})");
        }
        Ok(left)
    }

    /// Parses a number, a name, a call, or an operand with a sign or in parentheses.
    pub(super) fn operand(&mut self) -> Result<String, ExprError> {
        self.skip_space();
        let rest = self.rest();
        if self.eat("-") {
            return Ok(format!("(-({}))", self.nested(SIGN)?));
        }
        if self.eat("+") {
            return self.nested(SIGN);
        }
        if self.eat("(") {
            return self.until_closed(rest);
        }
        let length = number_length(rest);
        if length > 0 {
            let number = &rest[..length];
            return match number.parse::<f64>() {
                Ok(value) if value.is_finite() => {
                    self.eat(number);
                    Ok(literal(value))
                }
                _ => Err(self.error(format!("`{number}` is not a number"), "", length)),
            };
        }
        let name = &rest[..name_length(rest)];
        if name.is_empty() {
            let (message, length) = match rest.chars().next() {
                None if self.text.trim().is_empty() => ("the expression is empty".to_owned(), 0),
                None => ("the expression ends too early".to_owned(), 0),
                Some(c) => (format!("expected a number, a name or `(`, found `{c}`"), c.len_utf8()),
            };
            return Err(self.error(message, "", length));
        }
        if rest[name.len()..].trim_start().starts_with('(') {
            return self.call(name);
        }
        let value = if let Some(k) = self.variables.iter().position(|v| *v == name) {
            self.uses[k] = true;
            name.to_owned()
        } else if let Some(value) = CONSTANTS.iter().find(|c| c.0 == name).map(|c| c.1) {
            literal(value)
        } else {
            literal((self.names)(name).ok_or_else(|| self.unknown(name))?)
        };
        self.eat(name);
        Ok(value)
    }

    /// Parses up to the `)` of a parenthesis that was just opened; `opened` is the text from its
    /// `(`.
    pub(super) fn until_closed(&mut self, opened: &str) -> Result<String, ExprError> {
        let inner = self.nested(0)?;
        self.close(opened)?;
        Ok(inner)
    }

    /// Consumes `)`; if the text ends before it, the error points at the `(` in `opened`.
    pub(super) fn close(&mut self, opened: &str) -> Result<(), ExprError> {
        if self.eat(")") {
            return Ok(());
        }
        if let Some(next) = self.rest().chars().next() {
            let message = format!("expected an operator or `)`, found `{next}`");
            return Err(self.error(message, OPERATORS, next.len_utf8()));
        }
        self.pos = self.text.len() - opened.len();
        Err(self.error(
            "`(` is not closed",
            "add the missing `)`",
            opened.find('(').unwrap_or(0) + 1,
        ))
    }

    pub(super) fn call(&mut self, name: &str) -> Result<String, ExprError> {
        let (start, opened) = (self.pos, self.rest());
        let unary = UNARY.iter().any(|f| f.0 == name);
        if !unary && !BINARY.iter().any(|f| f.0 == name) {
            let functions: Vec<_> = builtin_names().filter(|n| !is_constant(n)).collect();
            let help = suggestion(name, "functions are", &functions);
            return Err(self.error(format!("unknown function `{name}`"), help, name.len()));
        }
        self.eat(name);
        self.eat("(");
        let mut arguments = vec![self.nested(0)?];
        while self.eat(",") {
            arguments.push(self.nested(0)?);
        }
        self.close(opened)?;
        match (arguments.as_slice(), unary) {
            ([a], true) => Ok(format!("({name}({a}))")),
            ([a, b], false) => Ok(format!("({a} {name} {b})")),
            (given, _) => {
                let wanted = if unary { "1 argument" } else { "2 arguments" };
                let message = format!("`{name}` takes {wanted}, not {}", given.len());
                let help = if unary { "" } else { "nest calls for more: min(a, min(b, c))" };
                Err(ExprError { message, help: help.into(), at: start..self.pos })
            }
        }
    }

    pub(super) fn unknown(&self, name: &str) -> ExprError {
        let (message, help) = if name == "x" || name == "y" {
            let help = "write a number or an expression in the scene's parameters";
            (format!("`{name}` is a coordinate, on which this value cannot depend"), help.into())
        } else if UNARY.iter().map(|f| f.0).chain(BINARY.iter().map(|f| f.0)).any(|f| f == name) {
            (format!("`{name}` is a function"), format!("write {name}(...)"))
        } else {
            let mut known = (self.known)();
            known.extend(self.variables);
            known.push("pi");
            (format!("unknown name `{name}`"), suggestion(name, "known names are", &known))
        };
        self.error(message, help, name.len())
    }
}

pub(super) fn is_constant(name: &str) -> bool {
    CONSTANTS.iter().any(|c| c.0 == name)
}

/// A number in the notation that `exmex` reads.
pub(super) fn literal(value: f64) -> String {
    if value.is_sign_negative() { format!("(-({:e}))", -value) } else { format!("{value:e}") }
}

/// Length in bytes of the unsigned number at the start of the text, such as `2`, `.5`, `2.5E-6`.
pub(super) fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |from: usize| bytes.iter().skip(from).take_while(|b| b.is_ascii_digit()).count();
    let whole = digits(0);
    let mut end = whole;
    if bytes.get(end) == Some(&b'.') {
        let fraction = digits(end + 1);
        if whole + fraction == 0 {
            return 0;
        }
        end += 1 + fraction;
    }
    if end > 0 && matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits(end + 1 + sign);
        if exponent > 0 {
            end += 1 + sign + exponent;
        }
    }
    end
}

/// Length in bytes of the name at the start of the text.
pub(super) fn name_length(text: &str) -> usize {
    if text.starts_with(|c: char| c.is_ascii_digit()) {
        return 0;
    }
    text.bytes().take_while(|b| b.is_ascii_alphanumeric() || *b == b'_').count()
}
