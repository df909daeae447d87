//! The error of all readers and writers of files, worded so that the owner of the file can act on it.

use crate::mesh::MeshError;

/// Reason why a file could not be read or written; every variant names the format and the field.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FormatError {
    /// A field has a value that the format does not allow, or that contradicts another field.
    #[error("{format}: {field}: {problem}")]
    Invalid {
        /// Name of the file format.
        format: &'static str,
        /// Header field or part of the file that has the value.
        field: String,
        /// The value found, and the values accepted.
        problem: String,
    },
    /// The file is valid, but uses a feature that the reader does not support.
    #[error("{format}: {field}: {found} is not supported; accepted: {accepted}")]
    Unsupported {
        /// Name of the file format.
        format: &'static str,
        /// Header field or part of the file that uses the feature.
        field: String,
        /// Unsupported feature that the file uses.
        found: String,
        /// Supported alternatives, for the user to choose from.
        accepted: &'static str,
    },
    /// The file ends too early.
    #[error("{format}: {field}: needs {needed} bytes, the file has {found}")]
    Truncated {
        /// Name of the file format.
        format: &'static str,
        /// Header field or part of the file that is cut off.
        field: String,
        /// Number of bytes that the header calls for.
        needed: u64,
        /// Number of bytes present in the file.
        found: u64,
    },
    /// The content does not fit in memory, or exceeds a limit of the reader.
    #[error(
        "{format}: {field}: needs {needed} bytes, more than a reader may take, or is left of the 4 GiB of WebAssembly (free() what is no longer needed)"
    )]
    TooLarge {
        /// Name of the file format.
        format: &'static str,
        /// Header field or part of the file that is too large.
        field: String,
        /// Number of bytes that the content would need.
        needed: u64,
    },
}

impl FormatError {
    /// Returns the same error about another format, of which the first is a kind.
    pub(crate) fn of_format(mut self, name: &'static str) -> Self {
        let (Self::Invalid { format, .. }
        | Self::Unsupported { format, .. }
        | Self::Truncated { format, .. }
        | Self::TooLarge { format, .. }) = &mut self;
        *format = name;
        self
    }

    /// Returns an [`Invalid`](Self::Invalid) error about positions that single precision cannot show.
    pub(crate) fn positions(format: &'static str, error: &MeshError) -> Self {
        Self::invalid(format, "positions", error.to_string())
    }

    /// Returns an [`Invalid`](Self::Invalid) error about `field`.
    pub(crate) fn invalid(
        format: &'static str,
        field: impl Into<String>,
        problem: impl Into<String>,
    ) -> Self {
        Self::Invalid { format, field: clipped(field), problem: clipped(problem) }
    }

    /// Returns an [`Unsupported`](Self::Unsupported) error about `field`.
    pub(crate) fn unsupported(
        format: &'static str,
        field: impl Into<String>,
        found: impl Into<String>,
        accepted: &'static str,
    ) -> Self {
        Self::Unsupported { format, field: clipped(field), found: clipped(found), accepted }
    }

    /// Returns a [`Truncated`](Self::Truncated) error about `field`; `needed` and `found` are in bytes.
    pub(crate) fn truncated(
        format: &'static str,
        field: impl Into<String>,
        needed: usize,
        found: usize,
    ) -> Self {
        Self::Truncated { format, field: clipped(field), needed: needed as u64, found: found as u64 }
    }

    /// Returns this error as one about a file beside the header.
    pub(crate) fn in_file(mut self, name: &str) -> Self {
        let (Self::Invalid { field, .. }
        | Self::Unsupported { field, .. }
        | Self::Truncated { field, .. }
        | Self::TooLarge { field, .. }) = &mut self;
        *field = clipped(format!("file '{name}'"));
        self
    }

    /// Returns a [`TooLarge`](Self::TooLarge) error about `field`, which needs `needed` bytes.
    pub(crate) fn too_large(format: &'static str, field: impl Into<String>, needed: u64) -> Self {
        Self::TooLarge { format, field: clipped(field), needed }
    }
}

/// Maximum number of characters of a file's content that an error message quotes: a malformed file may have a field of
/// any length.
const MAX_QUOTED: usize = 200;

/// Truncates text quoted in an error message to [`MAX_QUOTED`] characters.
fn clipped(text: impl Into<String>) -> String {
    let mut text = text.into();
    if let Some((end, _)) = text.char_indices().nth(MAX_QUOTED) {
        text.truncate(end);
        text.push('…');
    }
    text
}
