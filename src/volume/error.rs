//! What can be wrong with a volume or with a question put to it.

/// Why a volume could not be made or a question could not be answered.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum VolumeError {
    /// An argument out of range, not finite, or of the wrong length.
    #[error("{parameter}: {problem}")]
    InvalidArgument {
        /// Name of the argument.
        parameter: &'static str,
        /// What was wrong and what is accepted.
        problem: String,
    },
    /// More memory than can be had.
    #[error("the volume needs {bytes} bytes, more than can be had")]
    TooLarge {
        /// Bytes that would be needed.
        bytes: u64,
    },
}

impl VolumeError {
    /// An [`InvalidArgument`](Self::InvalidArgument).
    pub(crate) fn invalid(parameter: &'static str, problem: impl Into<String>) -> Self {
        Self::InvalidArgument { parameter, problem: problem.into() }
    }
}

/// An empty vector with room for `count` elements.
///
/// # Errors
/// [`VolumeError::TooLarge`] where the memory cannot be had.
pub(crate) fn reserve<T>(count: usize) -> Result<Vec<T>, VolumeError> {
    let mut out = Vec::new();
    let bytes = (count as u64).saturating_mul(size_of::<T>() as u64);
    out.try_reserve_exact(count).map_err(|_| VolumeError::TooLarge { bytes })?;
    Ok(out)
}
