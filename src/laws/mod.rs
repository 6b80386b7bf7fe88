//! This module holds the constitutive laws as pure functions, independent of the mesh, the
//! particles and the time.
//!
//! The plan chooses a [`Law`] for each material. At an integration point, the law takes the state
//! [`Here`] and returns a [`PointLaw`], the linear operator whose product with the
//! rates is the stress. Element matrices, internal forces and laminates use these functions; the
//! conformance tests in `tests/physics/laws.rs` test the same functions.
//!
//! Each file states the equation of one law with its symbols, units and source. The numbered
//! equations (1)-(20) are those of F. Dufour, H. Muehlhaus, L. Moresi, "Texture alignment in simple
//! shear". Rotations are positive counter-clockwise.

pub mod cosserat;
pub mod director;
pub mod granular;
pub mod layered;
pub mod mixture;
pub mod newtonian;
pub mod point;
pub mod rates;

use cosserat::Cosserat;
use director::Orientation;
use point::PointLaw;
use rates::Rates;

/// Variables on which the law of a material depends. The solver evaluates the law again where one
/// of them may have changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dependence {
    /// Whether the law depends on quantities that particles carry.
    pub history: bool,
    /// Whether the law depends on the rates of the last iterate.
    pub rates: bool,
    /// Whether the law depends on the pressure of the last iterate.
    pub pressure: bool,
}

impl Dependence {
    /// Whether the law is constant for the material.
    pub fn is_none(self) -> bool {
        self == Dependence::default()
    }

    /// Whether the law needs the last iterate.
    pub fn needs_flow(self) -> bool {
        self.rates || self.pressure
    }
}

/// The deviatoric viscosity of a material.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Shear {
    /// Isotropic viscosity; see [`newtonian`].
    #[default]
    Newtonian,
    /// Layered viscosity; see [`layered`].
    Layered {
        /// Viscosity eta_s of shear along the layers, Pa s.
        layer_viscosity: f64,
    },
}

/// The constitutive law of a material.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Law {
    /// Deviatoric viscosity.
    pub shear: Shear,
    /// Resistance to rotation relative to the continuum; `None` for a classical fluid.
    pub rotation: Option<Cosserat>,
    /// Compliance 1/B, 1/(Pa s); zero if incompressible.
    pub compliance: f64,
}

/// The state of a material at an integration point.
#[derive(Clone, Copy, Debug)]
pub struct Here<'a> {
    /// Shear viscosity eta, Pa s.
    pub viscosity: f64,
    /// Orientation of the directors; ignored unless the material is layered.
    pub orientation: &'a Orientation,
    /// Rates of the last iterate; zero for laws that do not depend on them.
    pub rates: Rates,
    /// Pressure of the last iterate, Pa; zero for laws that do not depend on it.
    pub pressure: f64,
}

impl<'a> Here<'a> {
    /// A state without flow.
    pub fn at_rest(viscosity: f64, orientation: &'a Orientation) -> Self {
        Here { viscosity, orientation, rates: Rates::default(), pressure: 0.0 }
    }
}

impl Law {
    /// Whether the material is layered and has directors.
    pub fn is_layered(&self) -> bool {
        matches!(self.shear, Shear::Layered { .. })
    }

    /// Variables on which the law depends.
    pub fn depends_on(&self) -> Dependence {
        match self.shear {
            Shear::Newtonian => Dependence::default(),
            Shear::Layered { .. } => Dependence { history: true, ..Dependence::default() },
        }
    }

    /// The linear law at an integration point.
    pub fn at(&self, here: &Here) -> PointLaw {
        let shear = match self.shear {
            Shear::Newtonian => newtonian::shear(here.viscosity),
            Shear::Layered { layer_viscosity } => {
                layered::shear(here.viscosity, layer_viscosity, here.orientation)
            }
        };
        let Cosserat { coupling, couple } = self.rotation.unwrap_or_default();
        let dilation = if self.compliance == 0.0 { here.viscosity } else { 0.0 };
        PointLaw { shear, dilation, coupling, couple }
    }
}
