//! Textures: images, samplers, and how materials use them.

use gltf::json::extensions::texture::TextureTransform;
use gltf::json::texture::{MagFilter, WrappingMode};
use gltf::json::validation::Checked;
use gltf::json::{self, Index};
use serde::Deserialize;

use super::exact::{self, PlacedTexture};
use super::image::{self, Decoded};
use super::{Importer, Problem, budget, label, uri};
use crate::error::ensure;
use crate::scene::{Filter, MAX_COORDINATE, Texture, TextureUse, UvSet, Wrap};

type JsonIndex = Index<json::Texture>;

/// The file's sets of texture coordinates that are a mesh's first and second.
pub(super) type UvSets = [Option<u32>; 2];

/// A reference to a texture, from any of a material's slots.
pub(super) struct Slot {
    texture: JsonIndex,
    /// Which of the file's sets of texture coordinates.
    pub(super) uv_set: u32,
    placed: PlacedTexture,
    exact: Option<[f32; 6]>,
}

impl From<&json::texture::Info> for Slot {
    fn from(info: &json::texture::Info) -> Self {
        let transform = info.extensions.as_ref().and_then(|extensions| extensions.texture_transform.clone());
        Self::new(info.index, info.tex_coord, transform, exact::texture_transform(&info.extras))
    }
}

impl From<&json::material::NormalTexture> for Slot {
    fn from(info: &json::material::NormalTexture) -> Self {
        let extension = info.extensions.as_ref().and_then(|extensions| extensions.others.get("KHR_texture_transform"));
        let transform = extension.and_then(|value| TextureTransform::deserialize(value).ok());
        Self::new(info.index, info.tex_coord, transform, exact::texture_transform(&info.extras))
    }
}

impl Slot {
    fn new(texture: JsonIndex, tex_coord: u32, transform: Option<TextureTransform>, exact: Option<[f32; 6]>) -> Self {
        let TextureTransform { offset, rotation, scale, tex_coord: other, .. } = transform.unwrap_or_default();
        let placed = PlacedTexture { offset: offset.0, rotation: rotation.0, scale: scale.0 };
        Self { texture, uv_set: other.unwrap_or(tex_coord), placed, exact }
    }

    fn transform(&self) -> [f32; 6] {
        let exact = self.exact.filter(|&exact| PlacedTexture::of(exact) == self.placed);
        exact.unwrap_or_else(|| self.placed.transform())
    }
}

impl Importer<'_> {
    /// Adds the texture of a slot, if no slot has used it before.
    pub(super) fn texture_use(&mut self, slot: &Slot, sets: UvSets) -> Result<TextureUse, Problem> {
        let transform = slot.transform();
        let small = transform.iter().all(|x| f64::from(*x).abs() <= MAX_COORDINATE);
        ensure!(small, "its texture transform {transform:?} is not finite or too large");
        let uv_set = if sets[1] == Some(slot.uv_set) { UvSet::Second } else { UvSet::First };
        Ok(TextureUse { texture: self.texture(slot.texture)?, transform, uv_set })
    }

    fn texture(&mut self, index: JsonIndex) -> Result<usize, Problem> {
        if let Some(&known) = self.textures.get(&index) {
            return Ok(known);
        }
        let texture = self.document.get(index, "it refers to texture")?;
        let (wrap, filter) = match texture.sampler {
            Some(sampler) => sampling(self.document.get(sampler, &format!("texture {index} refers to sampler"))?),
            None => Default::default(),
        };
        let Decoded { size, texels } = self.image(texture.source, index)?;
        let same = |t: &Texture| t.texels.is_shared(&texels) && (t.wrap, t.filter) == (wrap, filter);
        let position = self.scene.textures.iter().position(same).unwrap_or_else(|| {
            let name = label(texture.name.as_ref(), "texture", index);
            self.scene.textures.push(Texture { name, size, texels, wrap, filter });
            self.scene.textures.len() - 1
        });
        self.textures.insert(index, position);
        Ok(position)
    }

    fn image(&mut self, index: Index<json::Image>, texture: JsonIndex) -> Result<Decoded, Problem> {
        if let Some(decoded) = self.images.get(&index) {
            return Ok(decoded.clone());
        }
        let missing = || format!("texture {texture} has no PNG or JPEG image; export it with one");
        let source = self.document.root.get(index).ok_or_else(missing)?;
        let name = label(source.name.as_ref().or(source.uri.as_ref().filter(|uri| is_short(uri))), "image", index);
        let decoded = self.decoded(source).map_err(|problem| format!("image {name}: {problem}"))?;
        self.images.insert(index, decoded.clone());
        Ok(decoded)
    }

    fn decoded(&mut self, source: &json::Image) -> Result<Decoded, Problem> {
        let taken: u64 = self.images.values().map(|image| image.texels.bytes()).sum();
        let room = budget::max_bytes().saturating_sub(taken);
        match (&source.uri, source.buffer_view) {
            (Some(uri), _) => {
                let file = uri::bytes(uri, "image", self.folder, usize::MAX, &mut self.file_room)?;
                image::decode(&file, room)
            }
            (None, Some(view)) => image::decode(self.document.view(view)?.0, room),
            (None, None) => Err("it has no data: neither a URI nor a buffer view".to_owned()),
        }
    }
}

/// Whether a URI can stand for the image in a message.
fn is_short(uri: &str) -> bool {
    !uri.starts_with("data:")
}

/// What lies between and beyond texels; an unknown mode counts as the default.
fn sampling(sampler: &json::texture::Sampler) -> ([Wrap; 2], Filter) {
    let wrap = |mode: Checked<WrappingMode>| match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        _ => Wrap::Repeat,
    };
    let filter = match sampler.mag_filter {
        Some(Checked::Valid(MagFilter::Nearest)) => Filter::Nearest,
        _ => Filter::Linear,
    };
    ([wrap(sampler.wrap_s), wrap(sampler.wrap_t)], filter)
}
