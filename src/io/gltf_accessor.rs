//! Accessors of a glTF document: arrays of numbers in its buffers.

use super::FormatError;
use super::glb::FORMAT;
use super::gltf::{Document, UNCOMPRESSED, required, unsigned};
use crate::math::Vec3;
use serde_json::Value;

/// Returns the name of the extension by which a primitive or buffer view is compressed; `None` if it has none of the
/// known ones. A file may hold the same data uncompressed as well, for readers without the extension.
pub(super) fn compression(value: &Value) -> Option<&'static str> {
    let known = ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];
    known.into_iter().find(|name| !value["extensions"][name].is_null())
}

/// The bytes of a glTF buffer view, and the number of bytes from one element to the next (`stride`) if the file gives
/// it.
pub(super) struct View<'a> {
    pub(super) bytes: &'a [u8],
    stride: Option<u64>,
}

impl<'a> Document<'a> {
    /// Returns the data of accessor `index`. An error if the number of components of its elements is not one of
    /// `widths`, or if a buffer view of it is too short.
    pub(super) fn accessor(&self, index: u64, widths: &[usize]) -> Result<Accessor<'a>, FormatError> {
        let value = self.entry("accessors", index)?;
        let field = format!("accessors[{index}]");
        let component = Component::parse(value, &field)?;
        let width = element_width(value, widths, &field)?;
        let count = required(value, "count", &field)?;
        let sparse = &value["sparse"];
        let elements = if value["bufferView"].is_null() && !sparse.is_null() {
            Elements { bytes: &[], stride: 0, component }
        } else {
            self.elements(value, component, width, count, &field)?
        };
        let sparse = match sparse {
            Value::Null => None,
            sparse => Some(self.sparse(sparse, component, width, count, &field)?),
        };
        let normalized = value["normalized"].as_bool().unwrap_or(false);
        let too_large = |_| FormatError::too_large(FORMAT, field, count.saturating_mul(width as u64));
        let count = usize::try_from(count).map_err(too_large)?;
        Ok(Accessor { elements, sparse, count, width, normalized })
    }

    /// Returns the elements that replace some of an accessor's.
    fn sparse(
        &self,
        value: &Value,
        component: Component,
        width: usize,
        accessor_count: u64,
        field: &str,
    ) -> Result<Sparse<'a>, FormatError> {
        let field = format!("{field}.sparse");
        let count = required(value, "count", &field)?;
        let indices_kind = Component::parse(&value["indices"], &format!("{field}.indices"))?;
        let indices =
            self.elements(&value["indices"], indices_kind, 1, count, &format!("{field}.indices"))?;
        let values = self.elements(&value["values"], component, width, count, &format!("{field}.values"))?;
        let sparse = Sparse { indices, values, count: count as usize };
        let mut next = 0.0;
        for k in 0..sparse.count {
            let index = sparse.indices.number(k, 0);
            if !(index >= next && index < accessor_count as f64) {
                let problem = format!("must ascend and be below {accessor_count}, got {index}");
                return Err(FormatError::invalid(FORMAT, format!("{field}.indices"), problem));
            }
            next = index + 1.0;
        }
        Ok(sparse)
    }

    /// Returns `count` elements in the buffer view that an accessor, or the sparse data of one, refers to.
    fn elements(
        &self,
        value: &Value,
        component: Component,
        width: usize,
        count: u64,
        field: &str,
    ) -> Result<Elements<'a>, FormatError> {
        let view = self.view(required(value, "bufferView", field)?)?;
        let element = component.size() * width;
        // Some programs write 0 where they mean none.
        let stride = view.stride.filter(|&stride| stride > 0).unwrap_or(element as u64);
        if stride < element as u64 {
            let problem = format!("elements of {element} bytes are {stride} apart");
            return Err(FormatError::invalid(FORMAT, field, problem));
        }
        let start = unsigned(value, "byteOffset")?.unwrap_or(0);
        let last = count.saturating_sub(1).saturating_mul(stride);
        let needed = if count == 0 { 0 } else { start.saturating_add(last).saturating_add(element as u64) };
        if needed > view.bytes.len() as u64 {
            let found = view.bytes.len() as u64;
            return Err(FormatError::Truncated { format: FORMAT, field: field.into(), needed, found });
        }
        let bytes = view.bytes.get(start as usize..).unwrap_or_default();
        Ok(Elements { bytes, stride: stride as usize, component })
    }

    /// Returns the bytes of buffer view `index`; an error unless they are there, uncompressed.
    pub(super) fn view(&self, index: u64) -> Result<View<'a>, FormatError> {
        let value = self.entry("bufferViews", index)?;
        let field = format!("bufferViews[{index}]");
        let buffer = required(value, "buffer", &field)?;
        let bytes = self.buffers.bytes(buffer);
        if let Some(name) =
            compression(value).filter(|name| bytes.is_err() || self.is_fallback_buffer(buffer, name))
        {
            return Err(FormatError::unsupported(FORMAT, field, name, UNCOMPRESSED));
        }
        let (start, length) =
            (unsigned(value, "byteOffset")?.unwrap_or(0), required(value, "byteLength", &field)?);
        let bytes = bytes?;
        let (needed, found) = (start.saturating_add(length), bytes.len() as u64);
        let bytes = bytes.get(start as usize..needed as usize).filter(|_| needed <= found);
        let bytes = bytes.ok_or(FormatError::Truncated { format: FORMAT, field, needed, found })?;
        Ok(View { bytes, stride: unsigned(value, "byteStride")? })
    }

    /// Returns whether a buffer is only a placeholder without data: the buffer views in it are compressed by
    /// `extension`, and their compressed bytes are in another buffer.
    fn is_fallback_buffer(&self, buffer: u64, extension: &str) -> bool {
        let buffer = self.entry("buffers", buffer);
        buffer.is_ok_and(|buffer| buffer["extensions"][extension]["fallback"] == true)
    }
}

/// Number type of the components of a glTF accessor's elements.
#[derive(Clone, Copy)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn parse(accessor: &Value, field: &str) -> Result<Self, FormatError> {
        Ok(match required(accessor, "componentType", field)? {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            other => {
                let accepted = "5120 to 5123, 5125 and 5126";
                return Err(FormatError::unsupported(
                    FORMAT,
                    format!("{field}.componentType"),
                    other.to_string(),
                    accepted,
                ));
            }
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// Returns the stored number of this type that represents 1 in normalised data.
    fn normalization_scale(self) -> f64 {
        match self {
            Self::I8 => 127.0,
            Self::U8 => 255.0,
            Self::I16 => 32767.0,
            Self::U16 => 65535.0,
            Self::U32 => 4294967295.0,
            Self::F32 => 1.0,
        }
    }
}

/// Elements of an accessor in a buffer view; their byte range has been checked.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    component: Component,
}

impl Elements<'_> {
    /// Returns component `k` of element `i` as it is stored; 0 if there are no bytes.
    fn number(&self, i: usize, k: usize) -> f64 {
        let at = i * self.stride + k * self.component.size();
        let byte = |n: usize| self.bytes.get(at + n).copied().unwrap_or(0);
        match self.component {
            Component::I8 => f64::from(byte(0) as i8),
            Component::U8 => f64::from(byte(0)),
            Component::I16 => f64::from(i16::from_le_bytes([byte(0), byte(1)])),
            Component::U16 => f64::from(u16::from_le_bytes([byte(0), byte(1)])),
            Component::U32 => f64::from(u32::from_le_bytes([byte(0), byte(1), byte(2), byte(3)])),
            Component::F32 => f64::from(f32::from_le_bytes([byte(0), byte(1), byte(2), byte(3)])),
        }
    }
}

/// Elements that replace some of an accessor's: their numbers, which ascend, and their values.
struct Sparse<'a> {
    indices: Elements<'a>,
    values: Elements<'a>,
    count: usize,
}

impl Sparse<'_> {
    /// Returns which of the values replaces element `i`, if one does.
    fn position(&self, i: usize) -> Option<usize> {
        let (mut low, mut high) = (0, self.count);
        while low < high {
            let middle = usize::midpoint(low, high);
            if (self.indices.number(middle, 0) as usize) < i { low = middle + 1 } else { high = middle }
        }
        (low < self.count && self.indices.number(low, 0) as usize == i).then_some(low)
    }
}

/// The elements of a glTF accessor, such as positions or indices.
pub(super) struct Accessor<'a> {
    /// All elements, of which those in `sparse` do not count; without bytes if those not in `sparse` are 0.
    elements: Elements<'a>,
    sparse: Option<Sparse<'a>>,
    pub(super) count: usize,
    width: usize,
    normalized: bool,
}

impl Accessor<'_> {
    /// Returns component `k` of element `i`, scaled to −1..1 or 0..1 if the file marks the accessor as normalised. Never
    /// inlined: in all its callers it would be 10 kB.
    #[inline(never)]
    pub(super) fn number(&self, i: usize, k: usize) -> f64 {
        debug_assert!(i < self.count && k < self.width);
        let replaced = self.sparse.as_ref().and_then(|sparse| Some((&sparse.values, sparse.position(i)?)));
        let (elements, at) = replaced.unwrap_or((&self.elements, i));
        let value = elements.number(at, k);
        if self.normalized { (value / elements.component.normalization_scale()).max(-1.0) } else { value }
    }

    /// Returns the first `N` components of element `i`.
    pub(super) fn numbers<const N: usize>(&self, i: usize) -> [f64; N] {
        std::array::from_fn(|k| self.number(i, k))
    }

    /// Returns the first three components of element `i`.
    pub(super) fn vector(&self, i: usize) -> Vec3 {
        Vec3::from_array(self.numbers(i).map(|x| x as f32))
    }
}

/// Returns the number of components of the elements of a glTF accessor; an error unless it is one of `widths`.
fn element_width(accessor: &Value, widths: &[usize], field: &str) -> Result<usize, FormatError> {
    let name = accessor["type"].as_str().unwrap_or("nothing");
    let width = match name {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        "MAT4" => 16,
        _ => 0,
    };
    if widths.contains(&width) {
        return Ok(width);
    }
    let found: String = name.chars().take(20).collect();
    let problem = format!("must have elements of {widths:?} components, got {found}");
    Err(FormatError::invalid(FORMAT, format!("{field}.type"), problem))
}
