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
pub mod flow_curve;
pub mod granular;
pub mod layered;
pub mod mixture;
pub mod newtonian;
pub mod point;
pub mod rates;

use cosserat::Cosserat;
use director::Orientation;
use flow_curve::FlowCurve;
use point::{PointLaw, Sym2};
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
    /// Flow curve of a generalised fluid; `None` if the viscosity does not depend on the flow. With
    /// a flow curve, the viscosities of `shear` and `rotation` are relative to the shear viscosity.
    pub curve: Option<FlowCurve>,
}

/// Rates and pressure at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LocalFlow {
    /// Deformation rates.
    pub rates: Rates,
    /// Pressure, Pa.
    pub pressure: f64,
}

/// The state of a material at an integration point.
#[derive(Clone, Copy, Debug)]
pub struct Here<'a> {
    /// Shear viscosity eta, Pa s; for a generalised fluid, the viscosity where no flow is known.
    pub viscosity: f64,
    /// Orientation of the directors; ignored unless the material is layered.
    pub orientation: &'a Orientation,
    /// Flow of the last iterate; `None` if it is not known or the law does not depend on it.
    pub flow: Option<LocalFlow>,
}

impl<'a> Here<'a> {
    /// A state whose flow is not known.
    pub fn without_flow(viscosity: f64, orientation: &'a Orientation) -> Self {
        Here { viscosity, orientation, flow: None }
    }
}

/// Change of the stress with the rates that is due to the change of the viscosity,
/// `slope/g e (e . dr)` with `e = U r`, the stress at unit viscosity; see [`flow_curve`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Softening {
    /// `eta'`, Pa s2; negative if the material softens, zero below the yield rate.
    pub slope: f64,
    /// The law `U` at unit viscosity, without the coupling beyond the shear viscosity.
    pub unit: PointLaw,
    /// The rates `r`.
    pub rates: Rates,
    /// The rate `g`, 1/s.
    pub rate: f64,
    /// The yield rate, 1/s.
    pub yield_rate: f64,
}

impl Softening {
    /// The derivative without the stresses of the rotation.
    pub fn of_shear(mut self) -> Self {
        (self.unit.coupling, self.unit.couple) = (0.0, 0.0);
        self.unit.bending = Sym2::default();
        self
    }

    /// The larger of the rate and the yield rate.
    pub fn effective_rate(&self) -> f64 {
        self.rate.max(self.yield_rate)
    }
}

impl Law {
    /// Whether the material is layered and has directors.
    pub fn is_layered(&self) -> bool {
        matches!(self.shear, Shear::Layered { .. })
            || self.rotation.is_some_and(|r| r.bending() != 0.0)
    }

    /// Variables on which the law depends.
    pub fn depends_on(&self) -> Dependence {
        Dependence {
            history: self.is_layered(),
            rates: self.curve.is_some(),
            pressure: self.curve.is_some_and(|c| c.depends_on_pressure()),
        }
    }

    /// The linear law at an integration point: the stress divided by the rates.
    pub fn at(&self, here: &Here) -> PointLaw {
        self.with_softening(here).0
    }

    /// The linear law at an integration point, and the derivative of the stress that it leaves out;
    /// `None` if the law does not depend on the flow or no flow is known.
    pub fn with_softening(&self, here: &Here) -> (PointLaw, Option<Softening>) {
        let Some(curve) = &self.curve else {
            return (self.of_viscosity(here.viscosity, here.orientation), None);
        };
        let unit = self.unit(here.orientation);
        let Some(LocalFlow { rates, pressure }) = here.flow else {
            return (unit.scaled(here.viscosity), None);
        };
        let rate = unit.power(&rates).sqrt();
        let viscosity = curve.viscosity(rate, pressure);
        let softening = Softening {
            slope: viscosity.slope,
            unit: unit.without_excess(),
            rates,
            rate,
            yield_rate: curve.yield_rate(pressure),
        };
        (unit.scaled(viscosity.value), Some(softening))
    }

    /// Rate `g` of a generalised fluid, 1/s.
    pub fn rate(&self, rates: &Rates, orientation: &Orientation) -> f64 {
        self.unit(orientation).power(rates).sqrt()
    }

    /// The law of a generalised fluid at unit viscosity.
    fn unit(&self, orientation: &Orientation) -> PointLaw {
        self.of_viscosity(1.0, orientation)
    }

    /// The law at a shear viscosity.
    fn of_viscosity(&self, viscosity: f64, orientation: &Orientation) -> PointLaw {
        let shear = match self.shear {
            Shear::Newtonian => newtonian::shear(viscosity),
            Shear::Layered { layer_viscosity } => {
                layered::shear(viscosity, layer_viscosity, orientation)
            }
        };
        let rotation = self.rotation.unwrap_or_default();
        let Cosserat { coupling, couple, .. } = rotation;
        let bending = layered::bending(rotation.bending(), orientation);
        let dilation = if self.compliance == 0.0 { viscosity } else { 0.0 };
        PointLaw { shear, dilation, coupling, couple, bending, hoop: 3.0 * viscosity }
    }
}
