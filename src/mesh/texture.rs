//! The picture on a surface, as its file holds it.

use super::MeshError;
use std::fmt;

/// Encodings of a picture that every browser reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageKind {
    /// Portable network graphics.
    Png,
    /// Of the Joint Photographic Experts Group.
    Jpeg,
    /// Google's, for the web.
    Webp,
}

impl ImageKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Png, Self::Jpeg, Self::Webp];

    /// The media type, such as `image/png`.
    pub fn media_type(self) -> &'static str {
        match self {
            Self::Png => "image/png",
            Self::Jpeg => "image/jpeg",
            Self::Webp => "image/webp",
        }
    }

    /// The encoding that the first bytes tell; `None` where it is no other than these.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', ..] => Some(Self::Png),
            [0xff, 0xd8, 0xff, ..] => Some(Self::Jpeg),
            [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Some(Self::Webp),
            _ => None,
        }
    }
}

/// An encoded picture. Its upper left corner is at (0, 0), u runs right and v down, both are 1 at the far edges, and
/// beyond them it repeats, as in glTF. The pixels are never looked at.
#[derive(Clone, PartialEq, Eq)]
pub struct Texture {
    kind: ImageKind,
    bytes: Vec<u8>,
}

impl Texture {
    /// The picture in the bytes of an image file.
    ///
    /// # Errors
    /// [`MeshError::InvalidArgument`] for bytes that do not begin as a PNG, JPEG or WebP file does.
    pub fn new(bytes: Vec<u8>) -> Result<Self, MeshError> {
        let Some(kind) = ImageKind::of(&bytes) else {
            let problem = "the bytes are of no image; PNG, JPEG and WebP are accepted".into();
            return Err(MeshError::InvalidArgument { parameter: "texture", problem });
        };
        Ok(Self { kind, bytes })
    }

    /// How the picture is encoded.
    pub fn kind(&self) -> ImageKind {
        self.kind
    }

    /// The image file.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// Without the bytes: nobody reads a hundred thousand of them in the message of a test.
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
