//! Texture images of meshes, kept in encoded form.

use super::MeshError;
use std::fmt;

/// An encoding of texture images that every browser can decode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageKind {
    /// PNG (Portable Network Graphics).
    Png,
    /// JPEG (Joint Photographic Experts Group).
    Jpeg,
    /// WebP, with lossy or lossless compression.
    Webp,
}

impl ImageKind {
    /// All supported image encodings.
    pub const ALL: [Self; 3] = [Self::Png, Self::Jpeg, Self::Webp];

    /// Returns the media type of the encoding, such as `image/png`.
    pub fn media_type(self) -> &'static str {
        match self {
            Self::Png => "image/png",
            Self::Jpeg => "image/jpeg",
            Self::Webp => "image/webp",
        }
    }

    /// Detects the encoding from the first bytes of an image file; `None` if it is not a supported one.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', ..] => Some(Self::Png),
            [0xff, 0xd8, 0xff, ..] => Some(Self::Jpeg),
            [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Some(Self::Webp),
            _ => None,
        }
    }
}

/// An encoded texture image, shown on a mesh by its texture coordinates. As in glTF, (0, 0) is the upper left corner, u
/// increases to the right and v downwards, both are 1 at the far edges, and beyond them the image repeats. Pixels are
/// never decoded.
#[derive(Clone, PartialEq, Eq)]
pub struct Texture {
    kind: ImageKind,
    bytes: Vec<u8>,
}

impl Texture {
    /// Creates a texture from the bytes of an image file.
    ///
    /// # Errors
    /// [`MeshError::InvalidArgument`] if the bytes do not start like a PNG, JPEG or WebP file.
    pub fn new(bytes: Vec<u8>) -> Result<Self, MeshError> {
        let Some(kind) = ImageKind::of(&bytes) else {
            let problem = "not a PNG, JPEG or WebP image".into();
            return Err(MeshError::InvalidArgument { parameter: "texture", problem });
        };
        Ok(Self { kind, bytes })
    }

    /// Returns the encoding of the image.
    pub fn kind(&self) -> ImageKind {
        self.kind
    }

    /// Returns the bytes of the encoded image file.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// Omits the bytes of the image, to keep the messages of failed tests short.
impl fmt::Debug for Texture {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        write!(out, "Texture({}, {} bytes)", self.kind.media_type(), self.bytes.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn the_first_bytes_tell_the_kind() {
        for (bytes, kind) in [
            (&b"\x89PNG\r\n\x1a\n..."[..], Some(ImageKind::Png)),
            (b"\xff\xd8\xff\xe0", Some(ImageKind::Jpeg)),
            (b"RIFF\x08\0\0\0WEBPVP8 ", Some(ImageKind::Webp)),
            (b"RIFF\x08\0\0\0WAVEfmt ", None),
            (b"GIF89a", None),
            (b"\x89PNG", None),
            (b"", None),
        ] {
            assert_eq!(Texture::new(bytes.to_vec()).ok().map(|texture| texture.kind()), kind, "{bytes:?}");
        }
    }
}
