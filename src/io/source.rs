//! Where the readers of volumes find the voxels: after the header, or in files beside it.

use super::FormatError;
use super::beside::{DataFiles, FileSet, Found, joined, with_file};
use super::text::Field;
use crate::volume::{Space, Voxels};
use std::borrow::Cow;

/// Options of reading a volume, besides the bytes of its file.
#[derive(Clone, Copy, Default)]
pub struct VolumeOptions<'a> {
    /// Content of the data file, if the header is in a file of its own; several data files are concatenated in order.
    pub detached: Option<&'a [u8]>,
    /// Files beside the header, in which the data files that it names are found, unless `detached` is given.
    pub files: Option<&'a dyn FileSet>,
    /// How the axes of world space lie, for files that do not say it.
    pub space: Option<Space>,
}

impl<'a> VolumeOptions<'a> {
    /// Returns the data files that a header names, among those given.
    ///
    /// # Errors
    /// No files are given, or one is missing; those of `named`.
    pub(super) fn source(
        &self,
        field: &Field<'_>,
        named: impl FnOnce() -> Result<DataFiles, FormatError>,
    ) -> Result<Source<'a>, FormatError> {
        match (self.detached, self.files) {
            (Some(bytes), _) => Ok(Source::Bytes(bytes)),
            (None, Some(files)) => Ok(Source::Files(files, named()?.find(field.format, files)?)),
            (None, None) => {
                Err(field
                    .invalid("the voxels are in another file; pass it in `files`, or its bytes as `data`"))
            }
        }
    }
}

/// Where the voxels of a volume are.
pub(super) enum Source<'a> {
    Bytes(&'a [u8]),
    Files(&'a dyn FileSet, Vec<Found>),
}

impl Source<'_> {
    /// Returns the voxels: those that `all` reads from the bytes, or from the only file; or those that `decode` makes of
    /// the `size` bytes that `part` takes from several files, an equal number of each.
    pub(super) fn voxels(
        &self,
        format: &'static str,
        size: usize,
        all: impl FnOnce(&[u8]) -> Result<Voxels, FormatError>,
        part: impl for<'b> Fn(&'b [u8], usize) -> Result<Cow<'b, [u8]>, FormatError>,
        decode: impl FnOnce(Cow<'_, [u8]>) -> Result<Voxels, FormatError>,
    ) -> Result<Voxels, FormatError> {
        match self {
            Self::Bytes(bytes) => all(bytes),
            Self::Files(files, found) => match &found[..] {
                [one] => with_file(*files, one, all),
                several => decode(Cow::Owned(joined(format, *files, several, size, part)?)),
            },
        }
    }
}
