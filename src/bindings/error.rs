//! Conversion of the core's errors to JavaScript: `{ code, message }`, which the TypeScript side turns into a
//! `VesicleError`.

use js_sys::{Object, Reflect};
use wasm_bindgen::prelude::JsValue;

use vesicle::io::FormatError;
use vesicle::mesh::MeshError;
use vesicle::methods::MethodError;
use vesicle::volume::VolumeError;
#[cfg(feature = "labels")]
use vesicle::voxelise::VoxeliseError;

/// An error with the code and message that JavaScript receives.
#[derive(Debug)]
pub struct Failure {
    code: &'static str,
    message: String,
}

impl Failure {
    /// Creates a failure with a code of the TypeScript `ErrorCode`.
    pub fn new(code: &'static str, message: impl Into<String>) -> Self {
        Self { code, message: message.into() }
    }

    /// Creates an `invalid-argument` failure; `parameter` is the name of the argument in the TypeScript API.
    pub fn invalid(parameter: &str, problem: &str) -> Self {
        Self::new("invalid-argument", format!("{parameter}: {problem}"))
    }

    /// Creates a `too-large` failure: `bytes` bytes of memory are needed, more than are left.
    pub fn too_large(bytes: u64) -> Self {
        Self::new(
            "too-large",
            format!(
                "{bytes} bytes are needed, more than is left of the 4 GiB of WebAssembly: free() what is no longer needed"
            ),
        )
    }
}

impl From<Failure> for JsValue {
    fn from(failure: Failure) -> Self {
        let object = Object::new();
        for (key, value) in [("code", failure.code), ("message", &failure.message)] {
            // Setting a property of a fresh plain object cannot fail.
            Reflect::set(&object, &key.into(), &value.into()).ok();
        }
        object.into()
    }
}

impl From<MeshError> for Failure {
    fn from(error: MeshError) -> Self {
        let code = match error {
            MeshError::InvalidArgument { .. } => "invalid-argument",
            MeshError::NotClosed { .. } => "not-closed",
            MeshError::SelfIntersecting { .. } | MeshError::CannotCut => "self-intersecting",
            MeshError::Precision { .. } => "precision",
            MeshError::NoProgress { .. } => "no-progress",
            MeshError::TooManyVertices { .. } | MeshError::TooLarge { .. } | MeshError::TooCrowded { .. } => {
                "too-large"
            }
        };
        Self::new(code, error.to_string())
    }
}

impl From<VolumeError> for Failure {
    fn from(error: VolumeError) -> Self {
        let code = match error {
            VolumeError::InvalidArgument { .. } => "invalid-argument",
            VolumeError::TooManyTriangles { .. } | VolumeError::TooLarge { .. } => "too-large",
        };
        Self::new(code, error.to_string())
    }
}

#[cfg(feature = "labels")]
impl From<VoxeliseError> for Failure {
    fn from(error: VoxeliseError) -> Self {
        match error {
            VoxeliseError::Mesh(error) => error.into(),
            VoxeliseError::Volume(error) => error.into(),
        }
    }
}

impl From<FormatError> for Failure {
    fn from(error: FormatError) -> Self {
        let code = match error {
            FormatError::TooLarge { .. } => "too-large",
            _ => "bad-file",
        };
        Self::new(code, error.to_string())
    }
}

impl From<MethodError> for Failure {
    fn from(error: MethodError) -> Self {
        match error {
            MethodError::Mesh(error) => error.into(),
            MethodError::Volume(error) => error.into(),
            MethodError::TooManyVertices { .. } | MethodError::TooLarge { .. } => {
                Self::new("too-large", error.to_string())
            }
            MethodError::Singular { .. } => Self::new("singular-system", error.to_string()),
            MethodError::NeedsData { .. } => Self::new("needs-data", error.to_string()),
            MethodError::BadState { .. } => Self::new("bad-file", error.to_string()),
            MethodError::InvalidArgument { .. } => Self::new("invalid-argument", error.to_string()),
        }
    }
}
