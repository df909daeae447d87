//! Surfaces fitted to data, one folder a method, and the stepping contract they share.

pub mod deformable;
mod error;
mod given;
pub mod implicit;
pub mod multires;
mod saved;
mod spec;
mod step;
pub mod tracking;

pub use error::MethodError;
pub use spec::{ParamDefault, ParamKind, ParamScale, ParamSpec};
pub use step::{StepReport, Times};
