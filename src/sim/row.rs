//! The diagnostics of a step, in SI units: a row of `series.csv`, and the registry of its columns.
//!
//! An entry of `columns!` is all that a column needs: its name, unit and place in tables, plots,
//! recordings and comparisons, and the expression that computes it. Everything else that knows
//! columns (`record`, `compare`, `sweep`, `explorer`, the state of a run) reads [`COLUMNS`],
//! [`PER_GAUGE`] and [`PER_MATERIAL`].

use super::clock::Limiter;
use super::phases::Phases;
use crate::plan::material::Material;
use crate::plan::{Plan, Units};
use crate::solve::report::Report;
use crate::space::particles::Particles;
use crate::space::population::Count;
use serde::Serialize;

/// A column of the series.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Name in tables, summaries and comparisons.
    pub name: &'static str,
    /// Symbol in formulas; empty if it has none.
    pub symbol: &'static str,
    /// SI unit; empty for pure numbers.
    pub unit: &'static str,
    /// Name on axes and in legends.
    pub label: &'static str,
    /// What it is and where it comes from.
    pub meaning: &'static str,
    /// Entity path in recordings below the run's own; empty if it is not recorded.
    pub path: &'static str,
    /// Place in comparisons: low ranks come first.
    pub rank: Rank,
    /// Panel of the recording in which its curve is drawn.
    pub panel: Option<Panel>,
    /// Whether the explorer's page receives it.
    pub live: bool,
    /// Whether a plan's series has it.
    pub exists: fn(&Plan) -> bool,
    format: Format,
    access: Access,
}

/// How a column takes part in comparisons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rank {
    /// Values and curves are compared; this is its place among them.
    Compared(u8),
    /// Values are compared, curves are not: an error or a count.
    Value(u8),
    /// It says nothing about the flow and is left out.
    Never,
}

/// A panel of curves in recordings, in the order of display.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Panel {
    /// Volumes that crossed the gauges.
    OutflowVolume,
    /// Rates at the gauges.
    OutflowRate,
    /// Mean alignment of directors.
    Alignment,
    /// Powers; only where there is no gauge.
    Power,
    /// Errors of the balances.
    Balances,
    /// Wall seconds by phase.
    Seconds,
    /// The time step.
    TimeStep,
}

impl Panel {
    /// All panels in order.
    pub const ALL: [Panel; 7] = [
        Panel::OutflowVolume,
        Panel::OutflowRate,
        Panel::Alignment,
        Panel::Power,
        Panel::Balances,
        Panel::Seconds,
        Panel::TimeStep,
    ];

    /// Heading, and whether the axis is logarithmic.
    pub fn heading(self) -> (&'static str, bool) {
        match self {
            Panel::OutflowVolume => ("Outflow volume (m²)", false),
            Panel::OutflowRate => ("Outflow rate (m²/s)", false),
            Panel::Alignment => ("Mean alignment |n_x|", false),
            Panel::Power => ("Power (W/m)", false),
            Panel::Balances => ("Balances (log10)", true),
            Panel::Seconds => ("Seconds per step", false),
            Panel::TimeStep => ("Time step (log10 s)", true),
        }
    }
}

/// How numbers are written.
#[derive(Clone, Copy, Debug)]
enum Format {
    Plain,
    Exponent,
    Microseconds,
}

/// Reads and writes a row's value; the index is the gauge's or the material's.
#[derive(Clone, Copy, Debug)]
struct Access {
    number: fn(&Row, usize) -> f64,
    text: fn(&Row, usize, Format) -> String,
    set: fn(&mut Row, usize, &str) -> Result<(), &'static str>,
}

/// A type of values.
trait Value: Sized {
    /// What a text that cannot be read is not.
    const KIND: &'static str;
    fn number(&self) -> f64;
    fn text(&self, format: Format) -> String;
    fn parse(text: &str) -> Option<Self>;
}

impl Value for f64 {
    const KIND: &'static str = "number";
    fn number(&self) -> f64 {
        *self
    }
    fn text(&self, format: Format) -> String {
        match format {
            Format::Plain => format!("{self}"),
            Format::Exponent => format!("{self:e}"),
            Format::Microseconds => format!("{self:.6}"),
        }
    }
    fn parse(text: &str) -> Option<Self> {
        text.parse().ok()
    }
}

impl Value for Option<f64> {
    const KIND: &'static str = "number";
    fn number(&self) -> f64 {
        self.unwrap_or(f64::NAN)
    }
    fn text(&self, format: Format) -> String {
        self.number().text(format)
    }
    fn parse(text: &str) -> Option<Self> {
        f64::parse(text).map(|v| Some(v).filter(|v| !v.is_nan()))
    }
}

impl Value for Limiter {
    const KIND: &'static str = "limiter";
    fn number(&self) -> f64 {
        f64::NAN
    }
    fn text(&self, _: Format) -> String {
        self.name().into()
    }
    fn parse(text: &str) -> Option<Self> {
        Limiter::ALL.into_iter().find(|l| l.name() == text)
    }
}

macro_rules! counts {
    ($($type:ty)*) => { $(
        impl Value for $type {
            const KIND: &'static str = "count";
            fn number(&self) -> f64 {
                *self as f64
            }
            fn text(&self, _: Format) -> String {
                self.to_string()
            }
            fn parse(text: &str) -> Option<Self> {
                text.parse().ok()
            }
        }
    )* };
}
counts!(u64 u32 usize);

fn put<T: Value>(place: &mut T, text: &str) -> Result<(), &'static str> {
    *place = T::parse(text).ok_or(T::KIND)?;
    Ok(())
}

/// What a column may be computed from.
pub struct Measured<'a> {
    /// The plan of the run.
    pub plan: &'a Plan,
    /// Its units.
    pub units: &'a Units,
    /// Materials as they are now.
    pub materials: &'a [Material],
    /// Particles as they are now.
    pub particles: &'a Particles,
    /// How the last solution went.
    pub report: &'a Report,
    /// Events of the population since the start.
    pub count: Count,
    /// Number of the step.
    pub step: u64,
    /// s
    pub time: f64,
    /// s
    pub dt: f64,
    /// What set the step.
    pub limiter: Limiter,
    /// Corrections of all solutions of the step.
    pub iterations: u32,
    /// Largest speed, m/s.
    pub max_speed: f64,
    /// Root mean square speed, m/s.
    pub rms_speed: f64,
    /// See [`Row::volume_error`].
    pub volume_error: f64,
    /// J/m
    pub potential_energy: f64,
    /// J/m
    pub work: f64,
    /// J/m
    pub dissipated: f64,
}

macro_rules! columns {
    ($(
        $(#[doc = $doc:literal])+
        $field:ident: $type:ty = |$m:ident| $of:expr, $empty:expr, { $($key:ident: $value:expr),* $(,)? };
    )*) => {
        /// One row of the series.
        #[derive(Clone, Debug)]
        pub struct Row {
            $( $(#[doc = $doc])+ pub $field: $type, )*
            /// State of each gauge.
            pub gauges: Vec<GaugeRow>,
            /// Relative change since the start of each material's projected area over the volume
            /// of its particles, which is exact.
            pub drift: Vec<f64>,
            /// Wall seconds by phase.
            pub seconds: Phases,
        }

        impl Row {
            /// The row before anything is known.
            pub fn empty(materials: usize) -> Row {
                Row {
                    $( $field: $empty, )*
                    gauges: vec![],
                    drift: vec![0.0; materials],
                    seconds: Phases::default(),
                }
            }

            /// Computes the columns of a step, in the order of their entries.
            pub fn measured(
                m: &Measured,
                gauges: Vec<GaugeRow>,
                drift: Vec<f64>,
                seconds: Phases,
            ) -> Row {
                Row { $( $field: { let $m = m; $of }, )* gauges, drift, seconds }
            }
        }

        /// The columns that are one number of the whole run, in the order of the table.
        pub static COLUMNS: &[Column] = &[
            $( Column {
                name: stringify!($field),
                meaning: concat!($($doc),+),
                access: Access {
                    number: |r, _| r.$field.number(),
                    text: |r, _, f| r.$field.text(f),
                    set: |r, _, t| put(&mut r.$field, t),
                },
                $($key: $value,)*
                ..Column::PLAIN
            }, )*
        ];
    };
}

columns! {
    /// Number of the step, from 0.
    step: u64 = |m| m.step, 0, { label: "step", rank: Rank::Value(10), live: true };
    /// Simulated time.
    time: f64 = |m| m.time, 0.0, { symbol: "t", unit: "s", label: "time", live: true };
    /// Length of the step.
    dt: f64 = |m| m.dt, 0.0, {
        symbol: "dt", unit: "s", label: "dt", path: "time/dt", panel: Some(Panel::TimeStep), live: true,
    };
    /// What set the length of the step.
    dt_limiter: Limiter = |m| m.limiter, Limiter::Start, { label: "limiter", rank: Rank::Never };
    /// Wall seconds that the step took.
    wall: f64 = |_m| 0.0, 0.0, {
        unit: "s", label: "wall seconds", rank: Rank::Never, format: Format::Microseconds,
    };
    /// Power of gravity, body forces, tractions and moving boundaries.
    power_in: f64 = |m| m.report.power_in * m.units.power(), 0.0, {
        symbol: "P", unit: "W/m", label: "loads", rank: Rank::Compared(12),
        path: "diagnostics/power_in", panel: Some(Panel::Power),
    };
    /// Viscous dissipation.
    dissipation: f64 = |m| m.report.dissipation * m.units.power(), 0.0, {
        symbol: "Phi", unit: "W/m", label: "dissipation", rank: Rank::Compared(5),
        path: "diagnostics/dissipation", panel: Some(Panel::Power), live: true,
    };
    /// `|power_in - dissipation - stabilisation|` over the larger of the first two.
    power_error: f64 = |m| m.report.power_error(), 0.0, {
        label: "power error", format: Format::Exponent, path: "diagnostics/power_error",
        panel: Some(Panel::Balances), live: true,
    };
    /// L2 norm of the projected divergence over that of the strain rate.
    divergence_error: f64 = |m| m.report.divergence, 0.0, {
        label: "divergence error", format: Format::Exponent, path: "diagnostics/divergence_error",
        panel: Some(Panel::Balances),
    };
    /// Root mean square over cells with particles of (sum of particle volumes)/(cell area) - 1.
    volume_error: f64 = |m| m.volume_error, 0.0, {
        label: "volume error", format: Format::Exponent, path: "diagnostics/volume_error",
        panel: Some(Panel::Balances), live: true,
    };
    /// Corrections of the solver, all solutions of the step together.
    iterations: u32 = |m| m.iterations, 0, { label: "iterations" };
    /// Number of particles.
    particles: usize = |m| m.particles.len(), 0, { label: "particles", rank: Rank::Value(11) };
    /// Largest speed of a node.
    max_speed: f64 = |m| m.max_speed, 0.0, {
        unit: "m/s", label: "largest speed", rank: Rank::Compared(3),
        path: "diagnostics/max_speed", live: true,
    };
    /// Root mean square speed over the domain without solids.
    rms_speed: f64 = |m| m.rms_speed, 0.0, {
        unit: "m/s", label: "rms speed", rank: Rank::Compared(4), path: "diagnostics/rms_speed",
    };
    /// Power that the stabilisation of stratified fluids takes from the flow: numerical, of second
    /// order in the step, either sign.
    stabilisation: f64 = |m| m.report.restoring * m.units.power(), 0.0, {
        unit: "W/m", label: "stabilisation", format: Format::Exponent,
    };
    /// Potential energy of the particles in gravity, less what the background would have there.
    potential_energy: f64 = |m| m.potential_energy, 0.0, {
        symbol: "E_p", unit: "J/m", label: "potential energy", rank: Rank::Compared(7),
    };
    /// Time integral of the power of everything but gravity, and what scheduled changes of gravity
    /// add.
    work: f64 = |m| m.work, 0.0, {
        symbol: "W", unit: "J/m", label: "work", rank: Rank::Compared(12),
    };
    /// Time integral of the dissipation.
    dissipated: f64 = |m| m.dissipated, 0.0, {
        unit: "J/m", label: "dissipated energy", rank: Rank::Compared(6),
    };
    /// Largest `| |n| - 1 |` of the directors; zero without directors.
    director_error: f64 = |m| m.particles.director_error(), 0.0, {
        label: "director error", format: Format::Exponent,
    };
    /// Rotation unknowns that a Cosserat material acts on.
    active_rotation: usize = |m| m.report.active_rotation, 0, {
        label: "active rotation unknowns", rank: Rank::Compared(12),
    };
    /// Particles split since the start.
    splits: u64 = |m| m.count.splits, 0, { label: "splits", rank: Rank::Never };
    /// Particles merged since the start.
    merges: u64 = |m| m.count.merges, 0, { label: "merges", rank: Rank::Never };
    /// Particles held back by walls since the start.
    held: u64 = |m| m.count.held, 0, { label: "held at walls", rank: Rank::Never };
    /// Volume mean of |n_x| over layered particles; absent without directors.
    mean_alignment: Option<f64> = |m| mean_alignment(m.particles, m.materials), None, {
        symbol: "|n_x|", label: "mean |n_x|", rank: Rank::Compared(2), path: "texture/alignment",
        panel: Some(Panel::Alignment), live: true, exists: |p| p.effects.directors,
    };
}

/// State of a gauge.
#[derive(Clone, Debug, Serialize)]
pub struct GaugeRow {
    /// Net volume that crossed the gauge per unit depth, m2.
    pub volume: f64,
    /// Flux across it, m2/s.
    pub rate: f64,
}

/// Columns of every gauge; a prefix tells several gauges apart.
pub static PER_GAUGE: [Column; 2] = [
    Column {
        name: "outflow_volume",
        symbol: "V",
        unit: "m²",
        label: "volume",
        meaning: "Net volume of the gauge's material that has crossed it.",
        path: "volume",
        rank: Rank::Compared(0),
        panel: Some(Panel::OutflowVolume),
        live: true,
        access: Access {
            number: |r, k| r.gauges[k].volume,
            text: |r, k, f| r.gauges[k].volume.text(f),
            set: |r, k, t| put(&mut r.gauges[k].volume, t),
        },
        ..Column::PLAIN
    },
    Column {
        name: "outflow_rate",
        symbol: "Q",
        unit: "m²/s",
        label: "rate",
        meaning: "Flux of the gauge's material across it.",
        path: "rate",
        rank: Rank::Compared(1),
        panel: Some(Panel::OutflowRate),
        live: true,
        access: Access {
            number: |r, k| r.gauges[k].rate,
            text: |r, k, f| r.gauges[k].rate.text(f),
            set: |r, k, t| put(&mut r.gauges[k].rate, t),
        },
        ..Column::PLAIN
    },
];

/// Columns of every material.
pub static PER_MATERIAL: [Column; 1] = [Column {
    name: "volume_drift",
    label: "volume drift",
    meaning: "Relative change of the projected area over the volume of the particles.",
    path: "volume_drift",
    rank: Rank::Value(8),
    format: Format::Exponent,
    access: Access {
        number: |r, k| r.drift[k],
        text: |r, k, f| r.drift[k].text(f),
        set: |r, k, t| put(&mut r.drift[k], t),
    },
    ..Column::PLAIN
}];

impl Column {
    /// What columns have that say nothing else.
    const PLAIN: Column = Column {
        name: "",
        symbol: "",
        unit: "",
        label: "",
        meaning: "",
        path: "",
        rank: Rank::Value(12),
        panel: None,
        live: false,
        exists: |_| true,
        format: Format::Plain,
        access: Access {
            number: |_, _| f64::NAN,
            text: |_, _, _| String::new(),
            set: |_, _, _| Ok(()),
        },
    };
}

impl Column {
    /// The value of a row, for columns of the whole run; NaN where it is no number.
    pub fn number(&self, row: &Row) -> f64 {
        (self.access.number)(row, 0)
    }

    /// Reads a value of the table into a row, for columns of the whole run.
    ///
    /// # Errors
    /// What the text is not.
    pub fn set(&self, row: &mut Row, text: &str) -> Result<(), &'static str> {
        (self.access.set)(row, 0, text)
    }
}

/// A column of a plan's series.
pub struct Place {
    /// Name in the table's first line, with the gauge's or the material's.
    pub name: String,
    /// Entity path in recordings; empty if it is not recorded.
    pub path: String,
    /// Name of its curve among those of its panel.
    pub curve: String,
    /// Name on the explorer's page.
    pub live_name: String,
    /// The registry's entry.
    pub column: &'static Column,
    index: usize,
}

impl Place {
    /// The value of a row; NaN where it is no number.
    pub fn number(&self, row: &Row) -> f64 {
        (self.column.access.number)(row, self.index)
    }

    /// The value as the table writes it.
    pub fn text(&self, row: &Row) -> String {
        (self.column.access.text)(row, self.index, self.column.format)
    }

    /// Reads a value of the table into a row, whose lists have their lengths.
    ///
    /// # Errors
    /// A sentence with the column's name and what the text is not.
    pub fn set(&self, row: &mut Row, text: &str) -> Result<(), String> {
        (self.column.access.set)(row, self.index, text)
            .map_err(|kind| format!("{}: `{text}` is no {kind}", self.name))
    }
}

/// Columns of gauges come after this one.
const BEFORE_GAUGES: &str = "particles";

/// The columns of a plan's series, in the order of the table.
pub fn places(plan: &Plan) -> Vec<Place> {
    let mut list = Vec::new();
    for column in COLUMNS.iter().filter(|c| (c.exists)(plan)) {
        list.push(Place {
            name: column.name.into(),
            path: column.path.into(),
            curve: column.label.into(),
            live_name: match column.symbol {
                "|n_x|" => column.label.into(),
                _ => column.name.into(),
            },
            column,
            index: 0,
        });
        if column.name != BEFORE_GAUGES {
            continue;
        }
        for (index, gauge) in plan.gauges.iter().enumerate() {
            let name = &gauge.name;
            let prefix = if plan.gauges.len() > 1 { format!("{name}.") } else { String::new() };
            list.extend(PER_GAUGE.iter().map(|column| Place {
                name: format!("{prefix}{}", column.name),
                path: format!("gauges/{name}/{}", column.path),
                curve: name.clone(),
                live_name: format!("{name} {}", column.label),
                column,
                index,
            }));
        }
    }
    for (index, material) in plan.state.materials.iter().enumerate() {
        list.extend(PER_MATERIAL.iter().map(|column| Place {
            name: format!("{}.{}", material.name, column.name),
            path: format!("{}/{}", column.path, material.name),
            curve: material.name.clone(),
            live_name: format!("{} {}", material.name, column.label),
            column,
            index,
        }));
    }
    list
}

/// The registry's entry of a name of the table, with or without the gauge's or the material's.
pub fn find(name: &str) -> Option<&'static Column> {
    let last = name.rsplit('.').next().unwrap_or(name);
    COLUMNS.iter().chain(&PER_GAUGE).chain(&PER_MATERIAL).find(|c| c.name == last)
}

/// Volume mean of |n_x| over layered particles.
fn mean_alignment(p: &Particles, materials: &[Material]) -> Option<f64> {
    let directors = p.director.as_ref()?;
    let (mut sum, mut volume) = (0.0, 0.0);
    for (k, n) in directors.iter().enumerate() {
        if materials[p.material[k] as usize].law.is_layered() {
            sum += p.volume[k] * n[0].abs();
            volume += p.volume[k];
        }
    }
    (volume > 0.0).then(|| sum / volume)
}
