//! Methods that fit surfaces to data, each in a module of its own, and the stepping interface common to all.

mod caller_mesh;
pub mod deformable;
mod error;
pub mod implicit;
pub mod multires;
mod saved;
mod spec;
mod step;
pub mod tracking;

pub use error::MethodError;
pub use spec::{ParamDefault, ParamKind, ParamScale, ParamSpec};
pub use step::{StepReport, Times};
