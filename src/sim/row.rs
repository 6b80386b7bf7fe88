//! This module holds the diagnostics of a step in SI units, which are a row of `series.csv`, and
//! the registry of its columns.
//!
//! A column is defined by one entry of `columns!`: its name, its unit, its use in tables, plots,
//! recordings and comparisons, and the expression that computes it. All other code that uses
//! columns (`record`, `compare`, `sweep`, `explorer`, the state of a run) reads [`COLUMNS`],
//! [`PER_GAUGE`] and [`PER_MATERIAL`].

use super::clock::Limiter;
use super::phases::Phases;
use crate::plan::material::Material;
use crate::plan::{Plan, Units};
use crate::scene::Geometry;
use crate::solve::report::Report;
use crate::space::count::Count;
use crate::space::particles::Particles;
use serde::Serialize;

/// A column of the series.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Name in tables, summaries and comparisons.
    pub name: &'static str,
    /// Symbol in formulas; empty if it has none.
    pub symbol: &'static str,
    /// SI unit; empty for dimensionless values.
    pub unit: &'static str,
    /// Name on axes and in legends.
    pub label: &'static str,
    /// Description of the value.
    pub meaning: &'static str,
    /// Entity path in recordings, below the path of the run; empty if the column is not recorded.
    pub path: &'static str,
    /// Role in comparisons; low ranks come first.
    pub rank: Rank,
    /// Panel of the recording that shows the curve.
    pub panel: Option<Panel>,
    /// Whether the explorer's page receives it.
    pub live: bool,
    /// Whether the series of a plan has the column.
    pub exists: fn(&Plan) -> bool,
    /// Name in the state of a run; empty for columns of gauges and materials.
    pub(super) saved: &'static str,
    format: Format,
    access: Access,
}

/// Role of a column in comparisons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rank {
    /// Values and curves are compared, in the order of this rank.
    Compared(u8),
    /// Only values are compared, in the order of this rank: an error or a count.
    Value(u8),
    /// The column does not describe the flow and is not compared.
    Never,
}

/// A panel of curves in recordings, in the order of display.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Panel {
    /// Volumes that have crossed the gauges.
    OutflowVolume,
    /// Fluxes across the gauges.
    OutflowRate,
    /// Forces on sides, walls and blocks.
    Force,
    /// Mean alignment of directors.
    Alignment,
    /// Powers; only for scenes without gauges.
    Power,
    /// Errors of the balances.
    Balances,
    /// Wall time by phase.
    Seconds,
    /// The time step.
    TimeStep,
}

impl Panel {
    /// All panels in order.
    pub const ALL: [Panel; 8] = [
        Panel::OutflowVolume,
        Panel::OutflowRate,
        Panel::Force,
        Panel::Alignment,
        Panel::Power,
        Panel::Balances,
        Panel::Seconds,
        Panel::TimeStep,
    ];

    /// Heading of the panel, and whether its axis is logarithmic.
    pub fn heading(self, geometry: Geometry) -> (String, bool) {
        let of = |what: &str, unit| (format!("{what} ({})", geometry.unit(unit)), false);
        match self {
            Panel::OutflowVolume => of("Outflow volume", "m²"),
            Panel::OutflowRate => of("Outflow rate", "m²/s"),
            Panel::Force => of("Force", "N/m"),
            Panel::Alignment => ("Mean alignment |n_x|".into(), false),
            Panel::Power => of("Power", "W/m"),
            Panel::Balances => ("Balances (log10)".into(), true),
            Panel::Seconds => ("Seconds per step".into(), false),
            Panel::TimeStep => ("Time step (log10 s)".into(), true),
        }
    }
}

/// Format of numbers in the table.
#[derive(Clone, Copy, Debug)]
enum Format {
    /// Shortest decimal form.
    Plain,
    /// Shortest form with an exponent.
    Exponent,
    /// Six decimals.
    Microseconds,
}

/// Functions that read and write a value of a row. The index is that of the gauge or material.
#[derive(Clone, Copy, Debug)]
struct Access {
    /// The value as a number.
    number: fn(&Row, usize) -> f64,
    /// The value as text.
    text: fn(&Row, usize, Format) -> String,
    /// Parses a value and stores it in the row.
    set: fn(&mut Row, usize, &str) -> Result<(), &'static str>,
}

/// A type of column values.
trait Value: Sized {
    /// Name of the type in the error for text that cannot be parsed.
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

/// Parses a value and stores it. The error is the name of the expected type.
fn put<T: Value>(place: &mut T, text: &str) -> Result<(), &'static str> {
    *place = T::parse(text).ok_or(T::KIND)?;
    Ok(())
}

/// Values from which columns are computed.
pub struct Measured<'a> {
    /// The plan of the run.
    pub plan: &'a Plan,
    /// Units of the plan.
    pub units: &'a Units,
    /// Current materials.
    pub materials: &'a [Material],
    /// Current particles.
    pub particles: &'a Particles,
    /// Report of the last solution.
    pub report: &'a Report,
    /// Particle events since the start.
    pub count: Count,
    /// Number of the step.
    pub step: u64,
    /// Simulated time, s.
    pub time: f64,
    /// Length of the step, s.
    pub dt: f64,
    /// The limit that determined the length of the step.
    pub limiter: Limiter,
    /// Number of solver corrections, summed over the solutions of the step.
    pub iterations: u32,
    /// Number of iterations of the flow curves of the last solution.
    pub nonlinear: u32,
    /// See [`Row::ill_posed_share`].
    pub ill_posed_share: f64,
    /// Kinetic energy, J/m.
    pub kinetic_energy: f64,
    /// Largest speed, m/s.
    pub max_speed: f64,
    /// Root mean square speed, m/s.
    pub rms_speed: f64,
    /// See [`Row::volume_error`].
    pub volume_error: f64,
    /// See [`Row::potential_energy`], J/m.
    pub potential_energy: f64,
    /// See [`Row::work`], J/m.
    pub work: f64,
    /// See [`Row::dissipated`], J/m.
    pub dissipated: f64,
    /// See [`Row::energy_error`].
    pub energy_error: f64,
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
            /// Values of each gauge.
            pub gauges: Vec<GaugeRow>,
            /// Values of each gauge of a force.
            pub forces: Vec<ForceRow>,
            /// Relative change since the start of the projected area of each material over the
            /// volume of its particles, which is exact.
            pub drift: Vec<f64>,
            /// Wall time by phase, s.
            pub seconds: Phases,
        }

        impl Row {
            /// An empty row for a number of materials.
            pub fn empty(materials: usize) -> Row {
                Row {
                    $( $field: $empty, )*
                    gauges: vec![],
                    forces: vec![],
                    drift: vec![0.0; materials],
                    seconds: Phases::default(),
                }
            }

            /// Computes the columns of a step, in the order of their entries.
            pub fn measured(
                m: &Measured,
                gauges: Vec<GaugeRow>,
                forces: Vec<ForceRow>,
                drift: Vec<f64>,
                seconds: Phases,
            ) -> Row {
                Row { $( $field: { let $m = m; $of }, )* gauges, forces, drift, seconds }
            }
        }

        /// Columns with one value for the whole run, in the order of the table.
        pub static COLUMNS: &[Column] = &[
            $( Column {
                name: stringify!($field),
                saved: concat!("row.", stringify!($field)),
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
    /// The limit that determined the length of the step.
    dt_limiter: Limiter = |m| m.limiter, Limiter::Start, { label: "limiter", rank: Rank::Never };
    /// Wall time of the step.
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
    /// `|power_in - dissipation - stabilisation|` over the largest of the three, or over a rounding
    /// scale if that is larger.
    power_error: f64 = |m| m.report.power_error(), 0.0, {
        label: "power error", format: Format::Exponent, path: "diagnostics/power_error",
        panel: Some(Panel::Balances), live: true,
    };
    /// L2 norm of the projected divergence over the L2 norm of the strain rate, with small terms
    /// added for rest and rigid rotation.
    divergence_error: f64 = |m| m.report.divergence, 0.0, {
        label: "divergence error", format: Format::Exponent, path: "diagnostics/divergence_error",
        panel: Some(Panel::Balances),
    };
    /// Root mean square over cells with particles of (sum of particle volumes)/(cell area) - 1.
    volume_error: f64 = |m| m.volume_error, 0.0, {
        label: "volume error", format: Format::Exponent, path: "diagnostics/volume_error",
        panel: Some(Panel::Balances), live: true,
    };
    /// Number of solver corrections, summed over the solutions of the step.
    iterations: u32 = |m| m.iterations, 0, { label: "iterations" };
    /// Number of particles.
    particles: usize = |m| m.particles.len(), 0, { label: "particles", rank: Rank::Value(11) };
    /// Largest speed at a node.
    max_speed: f64 = |m| m.max_speed, 0.0, {
        unit: "m/s", label: "largest speed", rank: Rank::Compared(3),
        path: "diagnostics/max_speed", live: true,
    };
    /// Root mean square speed over the domain except solids.
    rms_speed: f64 = |m| m.rms_speed, 0.0, {
        unit: "m/s", label: "rms speed", rank: Rank::Compared(4), path: "diagnostics/rms_speed",
    };
    /// Power that the stabilisation of stratified fluids takes from the flow: a numerical term of
    /// second order in the step, with either sign.
    stabilisation: f64 = |m| m.report.restoring * m.units.power(), 0.0, {
        unit: "W/m", label: "stabilisation", format: Format::Exponent,
    };
    /// Potential energy of the particles in gravity, relative to the background material.
    potential_energy: f64 = |m| m.potential_energy, 0.0, {
        symbol: "E_p", unit: "J/m", label: "potential energy", rank: Rank::Compared(7),
    };
    /// Kinetic energy.
    kinetic_energy: f64 = |m| m.kinetic_energy, 0.0, {
        symbol: "E_k", unit: "J/m", label: "kinetic energy", rank: Rank::Compared(7),
        exists: |p| p.effects.inertia,
    };
    /// Time integral of the power of all loads except gravity (of the pressure of the background too,
    /// where it crosses a side), plus the change of potential energy by scheduled changes.
    work: f64 = |m| m.work, 0.0, {
        symbol: "W", unit: "J/m", label: "work", rank: Rank::Compared(12),
    };
    /// Time integral of the dissipation.
    dissipated: f64 = |m| m.dissipated, 0.0, {
        unit: "J/m", label: "dissipated energy", rank: Rank::Compared(6),
    };
    /// Potential and kinetic energy lost since the start, less what was carried out, plus work minus
    /// dissipated energy, over the dissipated energy; with inertia, over the largest of the dissipated,
    /// the lost, the carried and the kinetic energy. 0 at rest, and where the energy of the particles
    /// does not determine the balance.
    energy_error: f64 = |m| m.energy_error, 0.0, {
        label: "energy error", format: Format::Exponent, path: "diagnostics/energy_error",
        panel: Some(Panel::Balances), live: true,
    };
    /// Largest `| |n| - 1 |` of the directors; zero without directors.
    director_error: f64 = |m| m.particles.director_error(), 0.0, {
        label: "director error", format: Format::Exponent,
    };
    /// Number of rotation unknowns on which a Cosserat material acts.
    active_rotation: usize = |m| m.report.active_rotation, 0, {
        label: "active rotation unknowns", rank: Rank::Compared(12),
    };
    /// Number of particle splits since the start.
    splits: u64 = |m| m.count.splits, 0, { label: "splits", rank: Rank::Never };
    /// Number of particle merges since the start.
    merges: u64 = |m| m.count.merges, 0, { label: "merges", rank: Rank::Never };
    /// Number of times that a wall stopped a particle since the start.
    held: u64 = |m| m.count.held, 0, { label: "held at walls", rank: Rank::Never };
    /// Volume that has entered through sides since the start.
    volume_in: f64 = |m| m.count.volume_in * m.units.volume(), 0.0, {
        unit: "m²", label: "volume in", exists: Plan::exchanges_volume,
    };
    /// Volume that has left through sides since the start.
    volume_out: f64 = |m| m.count.volume_out * m.units.volume(), 0.0, {
        unit: "m²", label: "volume out", exists: Plan::exchanges_volume,
    };
    /// Potential energy (relative to the background) and kinetic energy that material has carried out
    /// of the domain since the start, less what it has brought in.
    energy_out: f64 = |m| m.count.energy_out * m.units.energy(), 0.0, {
        unit: "J/m", label: "energy out", exists: Plan::exchanges_volume,
    };
    /// Number of iterations for friction, yield stresses and power laws, in the solution at the end of
    /// the step.
    nonlinear_iterations: u32 = |m| m.nonlinear, 0, {
        label: "nonlinear iterations", exists: |p| p.effects.flow_curves,
    };
    /// Share of the flowing volume of grains with friction whose inertial number lies outside the
    /// range in which the equations without an internal length are well posed. Material at rest and
    /// material at a bound of its viscosity do not count; 0 if nothing flows.
    ill_posed_share: f64 = |m| m.ill_posed_share, 0.0, {
        label: "ill-posed share", path: "diagnostics/ill_posed_share",
        exists: Plan::has_friction,
    };
    /// Volume mean of |n_x| over layered particles; absent without directors.
    mean_alignment: Option<f64> = |m| mean_alignment(m.particles, m.materials), None, {
        symbol: "|n_x|", label: "mean |n_x|", rank: Rank::Compared(2), path: "texture/alignment",
        panel: Some(Panel::Alignment), live: true, exists: |p| p.effects.directors,
    };
}

/// Values of a gauge.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct GaugeRow {
    /// Net volume of the gauge's material that has crossed it per unit depth, m2.
    pub volume: f64,
    /// Flux of the gauge's material across it, m2/s.
    pub rate: f64,
    /// Net volume of the gauge's material that the refilling of empty cells has carried across it,
    /// m2. It is not part of `volume`.
    pub refilled: f64,
}

/// Columns of each gauge. If there are several gauges, the gauge's name is a prefix.
pub static PER_GAUGE: [Column; 3] = [
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
        meaning: "Flux of the gauge's material across it; its share in the flow is a mean over the last two cells that have crossed.",
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
    Column {
        name: "outflow_refilled",
        unit: "m²",
        label: "refilled volume",
        meaning: "Net volume of the gauge's material that the refilling of empty cells has carried \
                  across it. It is not counted in outflow_volume.",
        path: "refilled",
        access: Access {
            number: |r, k| r.gauges[k].refilled,
            text: |r, k, f| r.gauges[k].refilled.text(f),
            set: |r, k, t| put(&mut r.gauges[k].refilled, t),
        },
        ..Column::PLAIN
    },
];

/// Force of the materials on a side, a wall or a block.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct ForceRow {
    /// Force along x per unit depth, N/m.
    pub x: f64,
    /// Force along y per unit depth, N/m.
    pub y: f64,
    /// Torque about the middle of what carries the force, counter-clockwise, per unit depth, N.
    pub torque: f64,
}

/// Columns of each gauge of a force, with the name of the gauge as a prefix.
pub static PER_FORCE: [Column; 3] = [
    Column {
        name: "force_x",
        symbol: "F_x",
        unit: "N/m",
        label: "force along x",
        meaning: "Force of all materials along x on a side, a wall or a block.",
        path: "force_x",
        rank: Rank::Compared(1),
        panel: Some(Panel::Force),
        live: true,
        access: Access {
            number: |r, k| r.forces[k].x,
            text: |r, k, f| r.forces[k].x.text(f),
            set: |r, k, t| put(&mut r.forces[k].x, t),
        },
        ..Column::PLAIN
    },
    Column {
        name: "force_y",
        symbol: "F_y",
        unit: "N/m",
        label: "force along y",
        meaning: "Force of all materials along y on a side, a wall or a block.",
        path: "force_y",
        rank: Rank::Compared(1),
        panel: Some(Panel::Force),
        live: true,
        access: Access {
            number: |r, k| r.forces[k].y,
            text: |r, k, f| r.forces[k].y.text(f),
            set: |r, k, t| put(&mut r.forces[k].y, t),
        },
        ..Column::PLAIN
    },
    Column {
        name: "torque",
        symbol: "T",
        unit: "N",
        label: "torque",
        meaning: "Torque of all materials about the middle of a side, a wall or a block, \
                  counter-clockwise.",
        path: "torque",
        rank: Rank::Compared(1),
        live: true,
        access: Access {
            number: |r, k| r.forces[k].torque,
            text: |r, k, f| r.forces[k].torque.text(f),
            set: |r, k, t| put(&mut r.forces[k].torque, t),
        },
        ..Column::PLAIN
    },
];

/// Columns of each material.
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
    /// Default values of the fields.
    const PLAIN: Column = Column {
        name: "",
        saved: "",
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
    /// Unit of the values of a run.
    pub fn unit_in(&self, geometry: Geometry) -> &'static str {
        geometry.unit(self.unit)
    }

    /// The value of a row as a number, for columns of the whole run; NaN if it is not a number.
    pub fn number(&self, row: &Row) -> f64 {
        (self.access.number)(row, 0)
    }

    /// Parses a value of the table and stores it in a row, for columns of the whole run.
    ///
    /// # Errors
    /// The text cannot be parsed; the error is the name of the expected type.
    pub fn set(&self, row: &mut Row, text: &str) -> Result<(), &'static str> {
        (self.access.set)(row, 0, text)
    }
}

/// A column in the series of a plan.
pub struct Place {
    /// Name in the header of the table, with the name of the gauge or material.
    pub name: String,
    /// Entity path in recordings; empty if the column is not recorded.
    pub path: String,
    /// Name of the curve in its panel.
    pub curve: String,
    /// Name on the explorer's page.
    pub live_name: String,
    /// Definition of the column.
    pub column: &'static Column,
    /// Index of the gauge or material.
    index: usize,
}

impl Place {
    /// The value of a row as a number; NaN if it is not a number.
    pub fn number(&self, row: &Row) -> f64 {
        (self.column.access.number)(row, self.index)
    }

    /// The value of a row as text for the table.
    pub fn text(&self, row: &Row) -> String {
        (self.column.access.text)(row, self.index, self.column.format)
    }

    /// Parses a value of the table and stores it in a row. The lists of the row must have their
    /// final lengths.
    ///
    /// # Errors
    /// The text cannot be parsed; the message contains the column's name and the expected type.
    pub fn set(&self, row: &mut Row, text: &str) -> Result<(), String> {
        (self.column.access.set)(row, self.index, text)
            .map_err(|kind| format!("{}: `{text}` is not a {kind}", self.name))
    }
}

/// The column after which the columns of the gauges follow.
const BEFORE_GAUGES: &str = "particles";

/// The columns in the series of a plan, in the order of the table.
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
    for (index, gauge) in plan.forces.iter().enumerate() {
        let name = &gauge.name;
        list.extend(PER_FORCE.iter().map(|column| Place {
            name: format!("{name}.{}", column.name),
            path: format!("forces/{name}/{}", column.path),
            curve: format!("{name} {}", column.label),
            live_name: format!("{name} {}", column.label),
            column,
            index,
        }));
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

/// The definition of a column by its name in the table, with or without the name of the gauge or
/// material.
pub fn find(name: &str) -> Option<&'static Column> {
    let last = name.rsplit('.').next().unwrap_or(name);
    COLUMNS.iter().chain(&PER_GAUGE).chain(&PER_FORCE).chain(&PER_MATERIAL).find(|c| c.name == last)
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
