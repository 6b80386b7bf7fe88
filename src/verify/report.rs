//! The verification report: tables, figures, and checks with their bounds.

use serde::Serialize;

/// Report of all verified subjects.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// One section per subject.
    pub sections: Vec<Section>,
}

/// Section of one subject.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Section {
    /// Heading.
    pub title: &'static str,
    /// Description of the computation and its result, Markdown.
    pub about: String,
    /// Tables of results.
    pub tables: Vec<Table>,
    /// Figures of results.
    pub figures: Vec<Figure>,
    /// Checks of results.
    pub checks: Vec<Check>,
}

/// A table of text cells with a header.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Table {
    /// Line above the table; may be empty.
    pub title: String,
    /// Names of the columns.
    pub header: Vec<String>,
    /// Rows of cells, each as long as the header.
    pub rows: Vec<Vec<String>>,
}

/// A plot of curves.
#[derive(Clone, Debug, Serialize)]
pub struct Figure {
    /// File name without extension.
    pub name: String,
    /// Title of the plot.
    pub title: String,
    /// Label of the x axis.
    pub x: &'static str,
    /// Label of the y axis.
    pub y: &'static str,
    /// True if both axes are logarithmic, so that powers are straight lines.
    pub logarithmic: bool,
    /// Names and points `(x, y)` of the curves.
    pub curves: Vec<(String, Vec<(f64, f64)>)>,
}

/// A measured number and its required bound.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    /// Description of the number.
    pub what: String,
    /// Measured value.
    pub value: f64,
    /// Required bound.
    pub bound: Bound,
    /// True if the value satisfies the bound.
    pub passed: bool,
    /// True for a goal: missing it is a known shortfall, not a failure.
    pub goal: bool,
}

/// Required bound of a number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Bound {
    /// The number must not exceed this value.
    AtMost(f64),
    /// The number must not be below this value.
    AtLeast(f64),
    /// The number must differ from the first value by at most the second.
    Within(f64, f64),
}

impl Check {
    /// A check of a value against a bound; not a goal.
    pub fn new(what: impl Into<String>, value: f64, bound: Bound) -> Self {
        // NaN fails every bound.
        let passed = match bound {
            Bound::AtMost(most) => value <= most,
            Bound::AtLeast(least) => value >= least,
            Bound::Within(aim, off) => (value - aim).abs() <= off,
        };
        Check { what: what.into(), value, bound, passed, goal: false }
    }

    /// Text of the result in the table.
    pub fn verdict(&self) -> &'static str {
        match (self.passed, self.goal) {
            (true, _) => "pass",
            (false, true) => "goal missed",
            (false, false) => "**fail**",
        }
    }
}

impl std::fmt::Display for Bound {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Bound::AtMost(v) => write!(f, "at most {}", number(*v)),
            Bound::AtLeast(v) => write!(f, "at least {}", number(*v)),
            Bound::Within(aim, off) => write!(f, "{} ± {}", number(*aim), number(*off)),
        }
    }
}

impl Table {
    /// A table without rows.
    pub fn new(title: impl Into<String>, header: &[&str]) -> Self {
        let header = header.iter().map(ToString::to_string).collect();
        Table { title: title.into(), header, rows: vec![] }
    }

    /// The table as Markdown.
    pub fn markdown(&self) -> String {
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let mut out = String::new();
        if !self.title.is_empty() {
            out += &format!("{}\n\n", self.title);
        }
        out += &line(&self.header);
        out += &line(&vec!["---".to_string(); self.header.len()]);
        self.rows.iter().for_each(|row| out += &line(row));
        out
    }
}

impl Section {
    /// Adds a check that must pass.
    pub fn check(&mut self, what: impl Into<String>, value: f64, bound: Bound) {
        self.checks.push(Check::new(what, value, bound));
    }

    /// Adds a goal: a check that may fail.
    pub fn aim(&mut self, what: impl Into<String>, value: f64, bound: Bound) {
        self.checks.push(Check { goal: true, ..Check::new(what, value, bound) });
    }

    /// The section as Markdown, with links to figures in `folder`.
    pub fn markdown(&self, folder: &str) -> String {
        let mut out = format!("## {}\n\n{}\n", self.title, self.about.trim());
        for table in &self.tables {
            out += &format!("\n{}", table.markdown());
        }
        for figure in &self.figures {
            out += &format!("\n![{}]({folder}/{}.svg)\n", figure.title, figure.name);
        }
        if !self.checks.is_empty() {
            let mut table = Table::new("", &["check", "value", "must be", ""]);
            for c in &self.checks {
                table.rows.push(vec![
                    c.what.clone(),
                    number(c.value),
                    c.bound.to_string(),
                    c.verdict().into(),
                ]);
            }
            out += &format!("\n{}", table.markdown());
        }
        out
    }
}

impl Report {
    /// Checks that failed, without goals.
    pub fn failures(&self) -> impl Iterator<Item = &Check> {
        self.sections.iter().flat_map(|s| &s.checks).filter(|c| !c.passed && !c.goal)
    }

    /// Number of checks, goals included.
    pub fn checks(&self) -> usize {
        self.sections.iter().map(|s| s.checks.len()).sum()
    }
}

/// A number with three or four significant digits.
pub fn number(v: f64) -> String {
    if v == 0.0 || !v.is_finite() {
        return format!("{v}");
    }
    let size = v.abs();
    if !(1e-2..1e4).contains(&size) {
        let text = format!("{v:.2e}");
        // Trailing zeros are removed.
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let mantissa = mantissa.trim_end_matches('0').trim_end_matches('.');
        return format!("{mantissa}e{exponent}");
    }
    let digits = (3 - size.log10().floor() as i32).max(0) as usize;
    let text = format!("{v:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_string()
    } else {
        text
    }
}

/// Convergence rate between two pairs of resolution and error: `log2` of the ratio of the errors
/// over `log2` of the ratio of the resolutions.
pub fn rate(coarse: (u32, f64), fine: (u32, f64)) -> f64 {
    (coarse.1 / fine.1).log2() / (f64::from(fine.0) / f64::from(coarse.0)).log2()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (v, text) in [
            (0.0, "0"),
            (1.5, "1.5"),
            (0.012345, "0.01235"),
            (3.6e-3, "3.6e-3"),
            (1e-6, "1e-6"),
            (208.51, "208.5"),
            (123456.0, "1.23e5"),
            (-2.0, "-2"),
        ] {
            assert_eq!(number(v), text);
        }
    }

    #[test]
    fn nan_fails_every_bound() {
        for bound in [Bound::AtMost(1.0), Bound::AtLeast(1.0), Bound::Within(1.0, 1.0)] {
            assert!(!Check::new("", f64::NAN, bound).passed);
        }
    }
}
