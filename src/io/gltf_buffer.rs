//! Buffers of a glTF document: in the container, in data URIs, or in files beside it.

use super::glb::FORMAT;
use super::{FormatError, base64};
use serde_json::Value;
use std::borrow::Cow;

/// The bytes of the buffers of a glTF document, and the files beside it.
pub(super) struct Buffers<'a> {
    buffers: Vec<Result<Cow<'a, [u8]>, FormatError>>,
    files: &'a [(&'a str, &'a [u8])],
    /// Number of bytes of the buffers that are there.
    pub(super) size: u64,
}

impl<'a> Buffers<'a> {
    /// Finds the buffers of a document: in the binary chunk of its container, if it has one, in data URIs, and in the
    /// files beside it. One that is missing is an error only where its bytes are needed.
    pub(super) fn new(root: &Value, mut binary: Option<&'a [u8]>, files: &'a [(&'a str, &'a [u8])]) -> Self {
        let entries = root["buffers"].as_array().map_or(&[][..], Vec::as_slice);
        let bytes = |(index, buffer): (usize, &Value)| {
            let field = format!("buffers[{index}]");
            // The first buffer without an address is the binary chunk.
            let binary = if index == 0 { binary.take() } else { None };
            let missing = || FormatError::invalid(FORMAT, field.as_str(), "has no data");
            match buffer["uri"].as_str() {
                None => binary.map(Cow::Borrowed).ok_or_else(missing),
                Some(uri) if is_data_uri(uri) => decode_data_uri(uri, &field).map(Cow::Owned),
                Some(uri) => find(files, uri).map(Cow::Borrowed).ok_or_else(|| {
                    let problem = format!("is in the file '{}', which is needed as well", decoded(uri));
                    FormatError::invalid(FORMAT, field.as_str(), problem)
                }),
            }
        };
        let buffers: Vec<Result<Cow<[u8]>, _>> = entries.iter().enumerate().map(bytes).collect();
        let size = buffers.iter().flatten().map(|bytes| bytes.len() as u64).sum();
        Self { buffers, files, size }
    }

    /// Returns the bytes of buffer `index`.
    pub(super) fn bytes(&self, index: u64) -> Result<&[u8], FormatError> {
        let count = self.buffers.len();
        let problem = || format!("index {index} is out of range; there are {count} entries");
        let found = usize::try_from(index).ok().and_then(|i| self.buffers.get(i));
        let found = found.ok_or_else(|| FormatError::invalid(FORMAT, "buffers", problem()))?;
        found.as_deref().map_err(Clone::clone)
    }

    /// Returns the bytes that an address refers to; the name of the file if it is not there.
    pub(super) fn resource(&self, uri: &str, field: &str) -> Result<Result<Vec<u8>, String>, FormatError> {
        if is_data_uri(uri) {
            return decode_data_uri(uri, field).map(Ok);
        }
        Ok(find(self.files, uri).map(<[u8]>::to_vec).ok_or_else(|| decoded(uri)))
    }
}

fn is_data_uri(uri: &str) -> bool {
    uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:"))
}

/// Returns the bytes of a base64 data URI.
fn decode_data_uri(uri: &str, field: &str) -> Result<Vec<u8>, FormatError> {
    let coded = uri.split_once(',').filter(|(head, _)| head.ends_with(";base64"));
    coded
        .and_then(|(_, text)| base64::decode(text))
        .ok_or_else(|| FormatError::invalid(FORMAT, format!("{field}.uri"), "must be a base64 data URI"))
}

/// Returns the bytes of the file that a relative address refers to: the one of the same path, else of the same name.
fn find<'a>(files: &[(&str, &'a [u8])], uri: &str) -> Option<&'a [u8]> {
    let path = decoded(uri);
    let plain = |path: &str| path.trim_start_matches("./").replace('\\', "/");
    let last = |path: &str| plain(path).rsplit('/').next().map(str::to_owned);
    let same_path = files.iter().find(|(name, _)| plain(name) == plain(&path));
    same_path.or_else(|| files.iter().find(|(name, _)| last(name) == last(&path))).map(|&(_, bytes)| bytes)
}

/// Returns an address without percent-encoding.
fn decoded(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, after @ ..] = rest {
        let code = after.get(..2).filter(|_| *first == b'%').and_then(|hex| std::str::from_utf8(hex).ok());
        match code.and_then(|hex| u8::from_str_radix(hex, 16).ok()) {
            Some(byte) => {
                bytes.push(byte);
                rest = &after[2..];
            }
            None => {
                bytes.push(*first);
                rest = after;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
