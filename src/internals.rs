//! Items that the program's own tests and benches use beside the library's interface. They may change
//! in any version.

pub use crate::cases::rayleigh_taylor::{Undulation, growth_ratio};
pub use crate::cases::solids::{
    ARRAY_DRAG, LowerWall, SlantedChannel, array_drag, slanted_channel, slipping_circle, wedge,
};
pub use crate::cases::{
    Case, CoupleWave, Fluid, Layered, couette, couple_wave, coupled_cell, layered_channel,
    poiseuille,
};
pub use crate::cost::effects::{Pair, pair, without};
pub use crate::cost::knobs::KNOBS;
pub use crate::motion::frozen_flow::{CellVelocities, FrozenFlow};
pub use crate::record::logger::{Backpressure, Logger};
pub use crate::record::plots::{Axis as PlotAxis, Curve, PlotSpec, line_plot};
pub use crate::record::rerun_log::{RecordError, Recorded, RerunLog, Sink, repair};
pub use crate::record::{checkpoint, info};
pub use crate::results::open_all;
pub use crate::session::timed;
pub use crate::solve::element::{CellBlocks, SKELETON_NODES, pair as node_pair};
pub use crate::solve::multifrontal::tree::Tree;
pub use crate::solve::multifrontal::{Effort, Multifrontal};
pub use crate::space::measure::Measure;
pub use crate::space::mesh::{Axis, Mesh};
pub use crate::space::walls::Enclosure;
pub use crate::testing::TempFolder;
pub use crate::verify::{Effort as VerifyEffort, SUBJECTS, run as verify};
