//! Methods that fit surfaces to data, each in a module of its own, and the interface common to all, [`Method`].

mod caller_mesh;
pub mod deformable;
mod error;
pub mod implicit;
pub mod label_surfaces;
mod method;
pub mod multires;
mod params;
mod saved;
mod spec;
mod step;
pub mod tracking;

pub use error::MethodError;
pub use method::{LiveSurface, Method};
pub use params::{Auto, ParamInput, Parameters};
pub use spec::{ParamDefault, ParamKind, ParamScale, ParamSpec};
pub use step::{StepReport, Times};
