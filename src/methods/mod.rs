//! Methods that fit surfaces to data, each in a module of its own, and the interface common to all, [`Method`].

mod caller_mesh;
#[cfg(feature = "deformable")]
pub mod deformable;
mod error;
#[cfg(feature = "implicit")]
pub mod implicit;
#[cfg(feature = "labels")]
pub mod label_surfaces;
mod method;
#[cfg(feature = "multires")]
pub mod multires;
mod params;
mod saved;
mod spec;
mod step;
#[cfg(feature = "tracking")]
pub mod tracking;

pub use error::MethodError;
pub use method::{LiveSurface, Method};
pub use params::{ParamInput, Parameters};
pub use spec::{ParamDefault, ParamKind, ParamScale, ParamSpec};
pub use step::{StepReport, Times};
