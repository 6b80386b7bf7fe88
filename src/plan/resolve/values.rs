//! This module evaluates numbers and fields of a scene and checks their ranges.

use crate::scene::{Field, FieldFn, Quantity, SceneError, Scope};
use crate::space::shape::side_normal;

/// A value, or an error of the scene with its position and remedy.
pub(in crate::plan) type Result<T> = std::result::Result<T, SceneError>;

/// Evaluates a quantity that must be above zero.
pub(in crate::plan) fn positive(q: &Quantity, scope: &Scope, what: &str) -> Result<f64> {
    let v = q.eval(scope)?;
    if v > 0.0 {
        return Ok(v);
    }
    Err(SceneError::at(q, format!("{what} is {v}"), format!("{what} must be above zero")))
}

pub(in crate::plan) fn not_negative(q: &Quantity, scope: &Scope, what: &str) -> Result<f64> {
    let v = q.eval(scope)?;
    if v >= 0.0 {
        return Ok(v);
    }
    Err(SceneError::at(q, format!("{what} is {v}"), format!("{what} must be zero or more")))
}

/// Evaluates a coordinate along an axis, relative to the origin of the scope.
pub(in crate::plan) fn coordinate(q: &Quantity, axis: usize, scope: &Scope) -> Result<f64> {
    Ok(q.eval(scope)? - scope.origin()[axis])
}

/// Evaluates a point, relative to the origin of the scope.
pub(in crate::plan) fn point(q: &[Quantity; 2], scope: &Scope) -> Result<[f64; 2]> {
    Ok([coordinate(&q[0], 0, scope)?, coordinate(&q[1], 1, scope)?])
}

/// Evaluates ranges along both axes, relative to the origin of the scope.
pub(in crate::plan) fn ranges(
    x: &[Quantity; 2],
    y: &[Quantity; 2],
    scope: &Scope,
) -> Result<[[f64; 2]; 2]> {
    let range = |q: &[Quantity; 2], axis| -> Result<[f64; 2]> {
        Ok([coordinate(&q[0], axis, scope)?, coordinate(&q[1], axis, scope)?])
    };
    Ok([range(x, 0)?, range(y, 1)?])
}

/// The ranges of x and y of a side of the domain.
pub(in crate::plan) fn edge(mut domain: [[f64; 2]; 2], side: usize) -> [[f64; 2]; 2] {
    domain[side_normal(side)] = [domain[side_normal(side)][side % 2]; 2];
    domain
}

/// The domain without a margin at its boundary. No mass lies on the boundary itself, so an
/// acceleration may be infinite there.
pub(in crate::plan) fn middle(domain: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    domain.map(|[a, b]| [a + (b - a) / 128.0, b - (b - a) / 128.0])
}

/// Smallest and largest value of a field on a 65 x 65 grid over the domain.
fn range_of(f: &FieldFn, [x, y]: [[f64; 2]; 2]) -> [f64; 2] {
    if let Some(v) = f.constant() {
        return [v, v];
    }
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for j in 0..=64 {
        for i in 0..=64 {
            let at = |[a, b]: [f64; 2], k: usize| a + (b - a) * k as f64 / 64.0;
            let v = f.at(at(x, i), at(y, j));
            if !v.is_finite() {
                return [f64::NAN, f64::NAN];
            }
            range = [range[0].min(v), range[1].max(v)];
        }
    }
    range
}

pub(in crate::plan) fn finite_range(
    q: &Field,
    f: &FieldFn,
    domain: [[f64; 2]; 2],
    what: &str,
) -> Result<[f64; 2]> {
    let range = range_of(f, domain);
    if range[0].is_finite() {
        return Ok(range);
    }
    Err(SceneError::at(
        q,
        format!("{what} is not finite everywhere in the domain"),
        "look for a division by zero, a root or logarithm of a negative number",
    ))
}
