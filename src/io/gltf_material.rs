//! The base colour texture of a glTF primitive: its image and its texture transform.

use super::FormatError;
use super::gltf::{Document, numbers, required, unsigned};
use crate::math::Vec2;
use crate::mesh::Texture;
use serde_json::Value;

/// The base colour texture of a glTF primitive's material.
pub(super) struct BaseColor<'a> {
    texture: &'a Value,
    /// Number of the set of texture coordinates that the texture uses: n of `TEXCOORD_n`.
    pub(super) set: u64,
    transform: Option<TextureTransform>,
}

/// Transform of texture coordinates by `KHR_texture_transform`: scale, then rotation, then offset.
struct TextureTransform {
    scale: [f64; 2],
    /// Cosine and sine of the angle by which texture coordinates are rotated, counter-clockwise as seen in the image.
    rotation: [f64; 2],
    offset: [f64; 2],
}

impl<'a> BaseColor<'a> {
    /// Returns the base colour texture of a glTF primitive; `None` if the primitive has none.
    ///
    /// # Errors
    /// An index that is out of range or no integer, or a texture transform whose scale or offset is not two numbers.
    pub(super) fn of(document: &Document<'a>, primitive: &Value) -> Result<Option<Self>, FormatError> {
        let Some(material) = unsigned(primitive, "material")? else { return Ok(None) };
        let info = &document.entry("materials", material)?["pbrMetallicRoughness"]["baseColorTexture"];
        if info.is_null() {
            return Ok(None);
        }
        let texture = document.entry("textures", required(info, "index", "baseColorTexture")?)?;
        let transform = &info["extensions"]["KHR_texture_transform"];
        let own_set = unsigned(transform, "texCoord")?;
        let set = own_set.or(unsigned(info, "texCoord")?).unwrap_or(0);
        let transform = (!transform.is_null()).then(|| TextureTransform::parse(transform)).transpose()?;
        Ok(Some(Self { texture, set, transform }))
    }

    /// Returns the texture coordinates of a vertex in the image, with the texture transform applied.
    pub(super) fn transform_uv(&self, uv: Vec2) -> Vec2 {
        self.transform.as_ref().map_or(uv, |transform| transform.of(uv))
    }

    /// Returns the texture's image. Without one: the name of the file that it is in, if that is not there; nothing if its
    /// encoding is not PNG, JPEG or WebP.
    ///
    /// # Errors
    /// An index or range out of bounds, a buffer view without data or compressed, or a data URI that cannot be decoded.
    pub(super) fn texture(
        &self,
        document: &Document<'a>,
    ) -> Result<Result<Texture, Option<String>>, FormatError> {
        let webp = &self.texture["extensions"]["EXT_texture_webp"];
        let Some(source) = unsigned(self.texture, "source")?.or(unsigned(webp, "source")?) else {
            return Ok(Err(None));
        };
        let image = document.entry("images", source)?;
        let bytes = match (unsigned(image, "bufferView")?, image["uri"].as_str()) {
            (Some(view), _) => document.view(view)?.bytes.to_vec(),
            (None, Some(uri)) => match document.buffers.resource(uri, &format!("images[{source}]"))? {
                Ok(bytes) => bytes,
                Err(name) => return Ok(Err(Some(name))),
            },
            _ => return Ok(Err(None)),
        };
        Ok(Texture::new(bytes).map_err(|_| None))
    }
}

impl TextureTransform {
    fn parse(transform: &Value) -> Result<Self, FormatError> {
        let field = |name: &str| format!("KHR_texture_transform.{name}");
        let pair = |name: &str| numbers::<2>(&transform[name], || field(name));
        let angle = transform["rotation"].as_f64().unwrap_or(0.0);
        Ok(Self {
            scale: pair("scale")?.unwrap_or([1.0; 2]),
            rotation: [libm::cos(angle), libm::sin(angle)],
            offset: pair("offset")?.unwrap_or([0.0; 2]),
        })
    }

    /// Applies the texture transform to the texture coordinates of a vertex. The direction of rotation is that of the
    /// first example of `KHR_texture_transform`, of three.js and of the Khronos viewer; the matrix in the draft of the
    /// extension rotates in the opposite direction.
    fn of(&self, uv: Vec2) -> Vec2 {
        let [u, v] = [f64::from(uv.x) * self.scale[0], f64::from(uv.y) * self.scale[1]];
        let [cosine, sine] = self.rotation;
        let turned = [cosine * u + sine * v, cosine * v - sine * u];
        Vec2::new((turned[0] + self.offset[0]) as f32, (turned[1] + self.offset[1]) as f32)
    }
}
