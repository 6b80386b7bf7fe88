//! Evaluates the parameters of a scene into a [`Scope`].

use super::error::{MAX_ERRORS, SceneError};
use super::expr;
use super::quantity::Quantity;
use super::scope::Scope;
use super::types::{Parameter, Scene};

/// Distance of a domain from zero, in its sizes, beyond which positions are computed relative to its
/// corner. Nearer to zero, coordinates lose no more than three of their sixteen digits.
const FAR: f64 = 1024.0;

impl Scope {
    /// Evaluates the scene's parameters and checks their names and ranges. A parameter may use the
    /// parameters above it. Several errors are reported at once.
    pub fn new(scene: &Scene) -> Result<Scope, SceneError> {
        Self::with_overrides(scene, |_| None)
    }

    /// Like [`Scope::new`], but `overrides` gives the values of some parameters (from a schedule or
    /// a slider). Parameters that depend on them change too.
    pub fn with_overrides(
        scene: &Scene,
        overrides: impl Fn(&str) -> Option<f64>,
    ) -> Result<Scope, SceneError> {
        let mut scope = Scope::default();
        let mut errors = vec![];
        for (name, parameter) in &scene.parameters {
            if errors.len() == MAX_ERRORS {
                break;
            }
            let value = check_name(name, parameter)
                .and_then(|()| scope.parameter(name, parameter, overrides(name)));
            match value {
                Ok(value) => _ = scope.values.insert(name.as_str().into(), value),
                Err(error) => {
                    errors.push(error);
                    // Parameters below this one report only their own errors.
                    let value = parameter.default.eval(&scope).unwrap_or(1.0);
                    scope.values.insert(name.as_str().into(), value);
                }
            }
        }
        SceneError::join(errors)?;
        scope.origin = scope.corner(scene);
        Ok(scope)
    }

    /// The lower left corner of a domain that is more than [`FAR`] times its size away from zero;
    /// otherwise zero. Errors of the domain are reported when it is resolved.
    fn corner(&self, scene: &Scene) -> [f64; 2] {
        let range = |q: &[Quantity; 2]| Some([q[0].eval(self).ok()?, q[1].eval(self).ok()?]);
        let (Some(x), Some(y)) = (range(&scene.domain.x), range(&scene.domain.y)) else {
            return [0.0; 2];
        };
        let size = (x[1] - x[0]).max(y[1] - y[0]);
        let far = [x, y].iter().flatten().any(|v| v.abs() > FAR * size);
        // A radius is measured from the axis.
        let left = if scene.domain.geometry.is_round() { 0.0 } else { x[0] };
        if far && size > 0.0 { [left, y[0]] } else { [0.0; 2] }
    }

    fn parameter(
        &self,
        name: &str,
        parameter: &Parameter,
        given: Option<f64>,
    ) -> Result<f64, SceneError> {
        let written = parameter.value.as_ref().unwrap_or(&parameter.default);
        let value = match given {
            Some(value) => value,
            None => written.eval(self)?,
        };
        let bound = |q: &Option<_>| q.as_ref().map(|q: &Quantity| q.eval(self)).transpose();
        let (min, max) = (bound(&parameter.min)?, bound(&parameter.max)?);
        if let (Some(min), Some(max)) = (min, max)
            && min > max
        {
            let message = format!("parameter `{name}`: its min {min} is above its max {max}");
            return Err(SceneError::at(&parameter.min, message, "swap them"));
        }
        let range = match (min, max) {
            (Some(min), Some(max)) => format!("{min} to {max}"),
            (Some(min), None) => format!("{min} or more"),
            (None, Some(max)) => format!("{max} or less"),
            (None, None) => "any number".into(),
        };
        let inside = min.is_none_or(|min| value >= min) && max.is_none_or(|max| value <= max);
        if value.is_finite() && inside {
            return Ok(value);
        }
        let message = format!("parameter `{name}` is {value}, outside its range: {range}");
        let help = format!("choose `{name}` in the range, or change its `min` or `max`");
        Err(SceneError::at(written, message, help).with_label("this value"))
    }
}

fn check_name(name: &str, parameter: &Parameter) -> Result<(), SceneError> {
    let fault = if !expr::is_name(name) {
        "cannot be used in expressions"
    } else if name == "x" || name == "y" {
        "is a coordinate"
    } else if expr::builtin_names().any(|builtin| builtin == name) {
        "is a function or constant"
    } else {
        return Ok(());
    };
    let help =
        "rename it: letters, digits and `_`, not starting with a digit, and no reserved name";
    let message = format!("parameter `{name}`: this name {fault}");
    Err(SceneError::at(&parameter.default, message, help).with_label("defined here"))
}
