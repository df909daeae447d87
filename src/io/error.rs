//! What can be wrong with a file, said so that its owner can act on it.

/// Why a file could not be read or written; every variant names the format and the field.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FormatError {
    /// A field holds something the format does not allow, or that contradicts another field.
    #[error("{format}: {field}: {problem}")]
    Invalid {
        /// Name of the file format.
        format: &'static str,
        /// Header field or part of the file.
        field: String,
        /// What was found and what is accepted.
        problem: String,
    },
    /// A correct file that uses something this reader does not take.
    #[error("{format}: {field}: {found} is not supported; accepted: {accepted}")]
    Unsupported {
        /// Name of the file format.
        format: &'static str,
        /// Header field or part of the file.
        field: String,
        /// What the file uses.
        found: String,
        /// What can be read.
        accepted: &'static str,
    },
    /// The file ends too early.
    #[error("{format}: {field}: needs {needed} bytes, the file has {found}")]
    Truncated {
        /// Name of the file format.
        format: &'static str,
        /// Header field or part of the file.
        field: String,
        /// Bytes that the header asks for.
        needed: u64,
        /// Bytes that are there.
        found: u64,
    },
    /// The content does not fit into memory.
    #[error("{format}: {field}: needs {needed} bytes, more than can be had")]
    TooLarge {
        /// Name of the file format.
        format: &'static str,
        /// Header field or part of the file.
        field: String,
        /// Bytes that would be needed.
        needed: u64,
    },
}

impl FormatError {
    /// An [`Invalid`](Self::Invalid) field.
    pub(crate) fn invalid(
        format: &'static str,
        field: impl Into<String>,
        problem: impl Into<String>,
    ) -> Self {
        Self::Invalid { format, field: shown(field), problem: shown(problem) }
    }

    /// Something [`Unsupported`](Self::Unsupported).
    pub(crate) fn unsupported(
        format: &'static str,
        field: impl Into<String>,
        found: impl Into<String>,
        accepted: &'static str,
    ) -> Self {
        Self::Unsupported { format, field: shown(field), found: shown(found), accepted }
    }

    /// A [`Truncated`](Self::Truncated) part.
    pub(crate) fn truncated(
        format: &'static str,
        field: impl Into<String>,
        needed: usize,
        found: usize,
    ) -> Self {
        Self::Truncated { format, field: shown(field), needed: needed as u64, found: found as u64 }
    }

    /// Something [`TooLarge`](Self::TooLarge).
    pub(crate) fn too_large(format: &'static str, field: impl Into<String>, needed: u64) -> Self {
        Self::TooLarge { format, field: shown(field), needed }
    }
}

/// Characters of a file's own words that a message repeats.
const MOST_SHOWN: usize = 200;

/// Cut to what can be read: a file may have anything of any length where one word belongs.
fn shown(text: impl Into<String>) -> String {
    let mut text = text.into();
    if let Some((end, _)) = text.char_indices().nth(MOST_SHOWN) {
        text.truncate(end);
        text.push('…');
    }
    text
}
