//! What verification finds: tables, figures and checks with their bounds.

use serde::Serialize;

/// All that was verified.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    pub sections: Vec<Section>,
}

/// One subject.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Section {
    pub title: &'static str,
    /// What is computed and what it shows; Markdown.
    pub about: String,
    pub tables: Vec<Table>,
    pub figures: Vec<Figure>,
    pub checks: Vec<Check>,
}

/// Cells of text under a header.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Table {
    pub title: String,
    pub header: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

/// Curves over one axis; logarithmic ones show powers as straight lines.
#[derive(Clone, Debug, Serialize)]
pub struct Figure {
    /// Name of its file, without extension.
    pub name: String,
    pub title: String,
    pub x: &'static str,
    pub y: &'static str,
    pub logarithmic: bool,
    pub curves: Vec<(String, Vec<(f64, f64)>)>,
}

/// A number and what it has to be.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    pub what: String,
    pub value: f64,
    pub bound: Bound,
    pub passed: bool,
    /// A goal: to miss it is a known shortfall, not a failure.
    pub goal: bool,
}

/// What a number has to be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Bound {
    AtMost(f64),
    AtLeast(f64),
    /// Not farther than the second from the first.
    Within(f64, f64),
}

impl Check {
    pub fn new(what: impl Into<String>, value: f64, bound: Bound) -> Self {
        // Not-a-number passes nothing.
        let passed = match bound {
            Bound::AtMost(most) => value <= most,
            Bound::AtLeast(least) => value >= least,
            Bound::Within(aim, off) => (value - aim).abs() <= off,
        };
        Check { what: what.into(), value, bound, passed, goal: false }
    }

    /// What the table says of it.
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
    pub fn new(title: impl Into<String>, header: &[&str]) -> Self {
        let header = header.iter().map(ToString::to_string).collect();
        Table { title: title.into(), header, rows: vec![] }
    }

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
    pub fn check(&mut self, what: impl Into<String>, value: f64, bound: Bound) {
        self.checks.push(Check::new(what, value, bound));
    }

    /// A bound that is aimed at and may be missed.
    pub fn aim(&mut self, what: impl Into<String>, value: f64, bound: Bound) {
        self.checks.push(Check { goal: true, ..Check::new(what, value, bound) });
    }

    /// The section as Markdown; figures are looked for in `folder`.
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
    pub fn failures(&self) -> impl Iterator<Item = &Check> {
        self.sections.iter().flat_map(|s| &s.checks).filter(|c| !c.passed && !c.goal)
    }

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
        // Whole powers of ten, and halves, read better without zeros.
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

/// `log2` of the ratio of errors over that of resolutions.
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
    fn not_a_number_passes_nothing() {
        for bound in [Bound::AtMost(1.0), Bound::AtLeast(1.0), Bound::Within(1.0, 1.0)] {
            assert!(!Check::new("", f64::NAN, bound).passed);
        }
    }
}
