//! Textures as embedded PNG files, and how materials use them.

use serde_json::{Value, json};

use super::{Document, Problem};
use crate::error::ensure;
use crate::scene::gltf::exact::{self, PlacedTexture};
use crate::scene::{Filter, Scene, Texels, Texture, TextureUse, UvSet, Wrap};

impl Document {
    /// Adds all textures, in their order; textures of the same texels share an image.
    pub(super) fn add_textures(&mut self, scene: &Scene) -> Result<(), Problem> {
        for (index, texture) in scene.textures.iter().enumerate() {
            let same = |other: &Texture| other.texels.is_shared(&texture.texels) && other.size == texture.size;
            let image = match scene.textures[..index].iter().position(same) {
                Some(first) => self.arrays["textures"][first]["source"].clone(),
                None => self.add_image(texture)?.into(),
            };
            let sampler = self.add("samplers", sampler(texture));
            self.add("textures", json!({ "name": texture.name, "sampler": sampler, "source": image }));
        }
        Ok(())
    }

    fn add_image(&mut self, texture: &Texture) -> Result<usize, Problem> {
        let view = self.view(png(texture)?, None);
        Ok(self.add("images", json!({ "bufferView": view, "mimeType": "image/png", "name": texture.name })))
    }

    /// A reference to a texture, as a material has it.
    pub(super) fn texture_use(&mut self, texture_use: &TextureUse) -> Result<Value, Problem> {
        let TextureUse { texture, transform, uv_set } = *texture_use;
        let exists = texture < self.arrays.get("textures").map_or(0, Vec::len);
        ensure!(exists, "it refers to texture {texture}, which does not exist");
        let finite = transform.iter().all(|entry| entry.is_finite());
        ensure!(finite, "its texture transform {transform:?} is not finite");
        let mut info = json!({ "index": texture });
        if uv_set == UvSet::Second {
            info["texCoord"] = json!(1);
        }
        if transform != TextureUse::new(texture).transform {
            let placed = PlacedTexture::of(transform);
            info["extensions"] = json!({ self.extension("KHR_texture_transform"): {
                "offset": placed.offset, "rotation": placed.rotation, "scale": placed.scale,
            } });
        }
        if let Some(extras) = exact::texture_extras(transform) {
            info["extras"] = extras;
        }
        Ok(info)
    }

    /// Notes that an extension is used.
    pub(super) fn extension(&mut self, name: &'static str) -> &'static str {
        self.extensions.insert(name);
        name
    }
}

fn sampler(texture: &Texture) -> Value {
    let wrap = |mode: Wrap| match mode {
        Wrap::Repeat => 10_497,
        Wrap::Mirror => 33_648,
        Wrap::Clamp => 33_071,
    };
    let filter = match texture.filter {
        Filter::Linear => 9729,
        Filter::Nearest => 9728,
    };
    json!({ "magFilter": filter, "minFilter": filter, "wrapS": wrap(texture.wrap[0]), "wrapT": wrap(texture.wrap[1]) })
}

/// A PNG file; without alpha where all texels are opaque.
fn png(texture: &Texture) -> Result<Vec<u8>, Problem> {
    let [width, height] = texture.size;
    let (count, texels) = (u64::from(width) * u64::from(height), texture.texels.count());
    let complete = count != 0 && count == texels as u64;
    ensure!(complete, "texture {:?} of {width} x {height} has {texels} texels", texture.name);
    let opaque = texture.texels.iter().all(|texel| texel[3] == u16::MAX);
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_depth(if texture.texels.is_fine() { png::BitDepth::Sixteen } else { png::BitDepth::Eight });
    encoder.set_color(if opaque { png::ColorType::Rgb } else { png::ColorType::Rgba });
    let channels = if opaque { 3 } else { 4 };
    let bytes: Vec<u8> = match &texture.texels {
        Texels::Eight(texels) => texels.iter().flat_map(|texel| texel.iter().copied().take(channels)).collect(),
        Texels::Sixteen(texels) => texels
            .iter()
            .flat_map(|texel| texel.iter().take(channels).flat_map(|channel| channel.to_be_bytes()))
            .collect(),
    };
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(&bytes)?;
        writer.finish()
    });
    written.map_err(|error| format!("texture {:?} cannot be encoded: {error}", texture.name))?;
    Ok(file)
}
