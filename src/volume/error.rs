//! Errors of volumes and of the operations on them.

/// Error of creating a volume or of an operation on one.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum VolumeError {
    /// An argument out of range, not finite, or of the wrong length.
    #[error("{parameter}: {problem}")]
    InvalidArgument {
        /// Name of the rejected argument.
        parameter: &'static str,
        /// Reason for the rejection, with the accepted values.
        problem: String,
    },
    /// A contour would have more triangles than what starts from it may have.
    #[error(
        "the contour has more than {most} triangles, which is the most: choose another iso value, a coarser volume, voxels more nearly \
         cubes (long ones are divided), another start, or more vertices"
    )]
    TooManyTriangles {
        /// Largest number of triangles.
        most: usize,
    },
    /// An allocation failed, or a limit would be exceeded.
    #[error("the volume needs {bytes} bytes, more than is allowed, or left of the 4 GiB of WebAssembly")]
    TooLarge {
        /// Memory that the operation would need, in bytes.
        bytes: u64,
    },
}

impl VolumeError {
    /// Creates an [`InvalidArgument`](Self::InvalidArgument) error.
    pub(crate) fn invalid(parameter: &'static str, problem: impl Into<String>) -> Self {
        Self::InvalidArgument { parameter, problem: problem.into() }
    }
}

/// Returns an empty vector with capacity for `count` elements; used for all arrays as large as a volume, so that a lack
/// of memory is an error and not a crash.
///
/// # Errors
/// [`VolumeError::TooLarge`] if the allocation fails.
pub(crate) fn reserve<T>(count: usize) -> Result<Vec<T>, VolumeError> {
    let mut out = Vec::new();
    let bytes = (count as u64).saturating_mul(size_of::<T>() as u64);
    out.try_reserve_exact(count).map_err(|_| VolumeError::TooLarge { bytes })?;
    Ok(out)
}

/// Returns a vector of `count` copies of `value`.
///
/// # Errors
/// [`VolumeError::TooLarge`] if the allocation fails.
pub(crate) fn filled<T: Clone>(count: usize, value: T) -> Result<Vec<T>, VolumeError> {
    let mut out = reserve(count)?;
    out.resize(count, value);
    Ok(out)
}
