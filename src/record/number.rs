//! This module formats numbers for readers.

/// Largest multiple of three not above the decimal exponent of `value`.
///
/// It is zero for zero and for values that are not finite.
pub fn engineering_exponent(value: f64) -> i32 {
    let magnitude = value.abs();
    if !magnitude.is_finite() || magnitude == 0.0 {
        return 0;
    }
    // The small addend keeps 1e-3 and 1e3 from being rounded into the decade below.
    let exponent = (magnitude.log10() + 1e-9).floor();
    3 * (exponent / 3.0).floor() as i32
}

/// Formats with three significant digits, without trailing zeros: `0`, `12.5`, `3.4e-5`.
pub fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return "none".to_owned();
    }
    let exponent = (value.abs().log10() + 1e-9).floor() as i32;
    if (-2..=4).contains(&exponent) {
        let decimals = usize::try_from(2 - exponent).unwrap_or(0);
        trim_zeros(&format!("{value:.decimals$}")).to_owned()
    } else {
        let mantissa = format!("{:.2}", value / 10f64.powi(exponent));
        format!("{}e{exponent}", trim_zeros(&mantissa))
    }
}

/// Removes trailing zeros after the decimal point, and the point itself if no digit follows.
pub fn trim_zeros(number: &str) -> &str {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }
}

/// Tick spacing of 1, 2 or 5 times a power of ten that gives about five to ten ticks.
pub fn nice_step(span: f64) -> f64 {
    let decade = 10f64.powf((span / 10.0).log10().floor());
    let share = span / 10.0 / decade;
    let digit = match share {
        s if s <= 1.0 => 1.0,
        s if s <= 2.0 => 2.0,
        s if s <= 5.0 => 5.0,
        _ => 10.0,
    };
    (digit * decade).max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_are_multiples_of_three() {
        for (value, exponent) in [
            (0.0, 0),
            (1.0, 0),
            (999.0, 0),
            (1e3, 3),
            (-2.5e4, 3),
            (1e-3, -3),
            (9.9e-4, -6),
            (f64::NAN, 0),
        ] {
            assert_eq!(engineering_exponent(value), exponent, "{value}");
        }
    }

    #[test]
    fn short_numbers() {
        for (value, text) in [
            (0.0, "0"),
            (12.5, "12.5"),
            (-0.03, "-0.03"),
            (1e-3, "1e-3"),
            (3.4e-5, "3.4e-5"),
            (12345.0, "12345"),
            (2.5e6, "2.5e6"),
        ] {
            assert_eq!(short(value), text);
        }
    }
}
