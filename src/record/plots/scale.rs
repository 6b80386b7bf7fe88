//! Scales of axes: ranges, ticks and labels.

use super::super::number::{engineering_exponent, nice_step, trim_zeros};
use super::*;

/// An axis with its range and ticks, computed from the data.
pub(super) struct Scale {
    /// Lower end; its decimal logarithm if `log`.
    pub(super) low: f64,
    /// Upper end; its decimal logarithm if `log`.
    pub(super) high: f64,
    pub(super) log: bool,
    /// Positions and labels of the ticks.
    pub(super) ticks: Vec<(f64, String)>,
    pub(super) label: String,
}

impl Scale {
    pub(super) fn new(axis: &Axis, values: impl Iterator<Item = f64>) -> Option<Self> {
        let (mut low, mut high) = values
            .map(|value| if axis.log { value.log10() } else { value })
            .filter(|value| value.is_finite())
            .fold(None, |ends: Option<(f64, f64)>, value| {
                Some(ends.map_or((value, value), |(l, h)| (l.min(value), h.max(value))))
            })?;
        if high - low <= 1e-12 * low.abs().max(high.abs()) {
            // A constant is drawn as a line in the middle.
            let room = match (axis.log, low == 0.0) {
                (true, _) => 0.5,
                (false, true) => 1.0,
                (false, false) => 0.5 * low.abs(),
            };
            (low, high) = (low - room, high + room);
        }
        Some(if axis.log {
            Self::logarithmic(axis, low, high)
        } else {
            Self::linear(axis, low, high)
        })
    }

    pub(super) fn linear(axis: &Axis, low: f64, high: f64) -> Self {
        let step = nice_step(high - low);
        let first = (low / step).ceil() as i64;
        let last = (high / step).floor() as i64;
        // Numbers such as 0.2 or 1500 need no power of ten; others do.
        let reach = low.abs().max(high.abs());
        let exponent = if (0.1..1e4).contains(&reach) { 0 } else { engineering_exponent(reach) };
        let factor = 10f64.powi(exponent);
        let decimals = (-(step / factor).log10() - 1e-9).ceil().clamp(0.0, 12.0) as usize;
        let ticks = (first..=last)
            .map(|i| {
                let value = i as f64 * step;
                let text = format!("{:.decimals$}", value / factor);
                (value, text.replace('-', "−"))
            })
            .collect();
        Self { low, high, log: false, ticks, label: axis_label(axis, exponent) }
    }

    pub(super) fn logarithmic(axis: &Axis, low: f64, high: f64) -> Self {
        // The axis spans at least half a decade.
        let short = (0.5 - (high - low)).max(0.0) / 2.0;
        let (low, high) = (low - short, high + short);
        let span = high - low;
        let ticks = if span > 2.0 {
            let step = (span / 8.0).ceil().max(1.0) as i64;
            let first = (low / step as f64).ceil() as i64;
            let last = (high / step as f64).floor() as i64;
            (first..=last).map(|i| ((i * step) as f64, decade(i * step))).collect()
        } else {
            let digits: &[f64] =
                if span > 1.0 { &[1.0, 2.0, 5.0] } else { &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0] };
            let (first, last) = (low.floor() as i64, high.floor() as i64);
            (first..=last)
                .flat_map(|e| digits.iter().map(move |d| (d.log10() + e as f64, *d, e)))
                .filter(|(place, ..)| (low..=high).contains(place))
                .map(|(place, digit, e)| (place, plain(digit, e)))
                .collect()
        };
        Self { low, high, log: true, ticks, label: axis_label(axis, 0) }
    }

    /// Extends both ends by `share` times the span.
    pub(super) fn widen(mut self, share: f64) -> Self {
        let room = share * (self.high - self.low);
        self.low -= room;
        self.high += room;
        self
    }

    /// Position of a value, 0 at the lower end and 1 at the upper; `None` if it cannot be drawn.
    pub(super) fn place(&self, value: f64) -> Option<f64> {
        let value = if self.log { value.log10() } else { value };
        let place = (value - self.low) / (self.high - self.low);
        place.is_finite().then_some(place)
    }

    pub(super) fn place_of_tick(&self, tick: f64) -> f64 {
        (tick - self.low) / (self.high - self.low)
    }
}

/// Formats a power of ten.
pub(super) fn decade(exponent: i64) -> String {
    match exponent {
        -2..=3 => plain(1.0, exponent),
        _ => format!("1e{exponent}").replace('-', "−"),
    }
}

/// Formats a digit times a power of ten.
pub(super) fn plain(digit: f64, exponent: i64) -> String {
    let exponent = i32::try_from(exponent).unwrap_or(0);
    if (-3..=4).contains(&exponent) {
        let value = digit * 10f64.powi(exponent);
        trim_zeros(&format!("{value:.4}")).to_owned()
    } else {
        format!("{}e{exponent}", trim_zeros(&format!("{digit:.1}"))).replace('-', "−")
    }
}

/// Label of an axis: name and unit, including the power of ten factored out of the tick labels.
pub(super) fn axis_label(axis: &Axis, exponent: i32) -> String {
    let Axis { name, unit, .. } = axis;
    // Only simple units take prefixes: a millimetre squared is not 1e-3 m².
    let simple = matches!(unit.as_str(), "m" | "s" | "Pa" | "N" | "J" | "W" | "Hz");
    let prefix = match exponent {
        0 => Some(""),
        -9 => Some("n"),
        -6 => Some("µ"),
        -3 => Some("m"),
        // Kiloseconds are not in use.
        3 if unit != "s" => Some("k"),
        6 if unit != "s" => Some("M"),
        9 if unit != "s" => Some("G"),
        _ => None,
    };
    let power = format!("1e{exponent}").replace('-', "−");
    match (prefix, unit.is_empty()) {
        (Some(""), true) => name.clone(),
        (Some(""), false) => format!("{name} ({unit})"),
        (Some(prefix), false) if simple => format!("{name} ({prefix}{unit})"),
        (_, true) => format!("{name} ({power})"),
        (_, false) => format!("{name} ({power} {unit})"),
    }
}
