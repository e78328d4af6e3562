//! Images that somebody else rendered, with what their pixels see as channels.

use crate::aov::Aov;
use crate::denoise::{Denoise, Planes};
use crate::exec::Executor;
use crate::image::{Channel, Image};
use crate::plan::{Buffer, FramePlan};
use crate::{Error, memory};
use restir_shared::denoise::{DenoiseParams, Guide, Reflectance, Track};
use restir_shared::glam::Vec3;
use restir_shared::layout::FilmPixel;
use restir_shared::num;
use restir_shared::vec::{self, luminance};
use std::collections::HashMap;
use std::sync::Arc;

/// Beyond this is nothing: Blender has 10^10 there.
const FAR: f32 = 1.0e9;
/// The height of a picture at the distance 1, which decides how much a surface may be bent: that of a view of 45 degrees.
const VIEW: f32 = 0.83;
/// What black surfaces give back, as polish of an index of refraction of 1.5.
const POLISH: f32 = 0.04;
/// An object that is so many times as bright as another one gives off light.
const BRIGHTER: f32 = 8.0;
/// The image is a mean of unknown samples, of more than one.
const FRAMES: f32 = 2.0;

impl Denoise {
    /// Layers that [`Self::image`] has to have.
    pub const NEEDS: [Aov; 3] = [Aov::Albedo, Aov::Normal, Aov::Depth];
    /// Layers that it knows beside them: without objects it tells surfaces apart by depth and normals.
    pub const KNOWS: [Aov; 2] = [Aov::Id, Aov::Scattering];

    /// An image from anywhere, by `layers`, whose channels have the names of [`Aov::channels`]. Depths may be in any unit.
    ///
    /// # Errors
    /// [`Error::EmptyImage`] if there are no pixels, [`Error::Setting`] if the image has not `width * height`, or a layer of
    /// [`Self::NEEDS`] is missing or has not a value a pixel, [`Error::Memory`] if it does not fit, and
    /// what the executor reports.
    pub fn image(&self, image: &Image, layers: &[Channel], executor: &mut dyn Executor) -> Result<Image, Error> {
        let Image { width, height, .. } = *image;
        let size = [width, height];
        let count = u64::from(width) * u64::from(height);
        if count == 0 || count != image.pixels.len() as u64 {
            return Err(if count == 0 { Error::EmptyImage { size } } else { pixels_missing(image) });
        }
        let scene = Layers::new(image, layers)?;
        let mut buffers = Vec::new();
        let planes = Planes::new(&mut buffers, size);
        let bytes = buffers.iter().map(|buffer| buffer.words as u64 * 4).sum();
        memory::check(bytes, "denoising this image", "use a smaller image")?;
        let (guides, tracks): (Vec<Guide>, Vec<Track>) = (0..image.pixels.len()).map(|i| scene.pixel(i)).unzip();
        let picture: Vec<_> = image.pixels.iter().map(|&sum| FilmPixel { sum, dropped: 0.0 }).collect();
        let seen = planes.seen();
        buffers[seen.guides].contents = Some(words(&guides));
        buffers[seen.tracks].contents = Some(words(&tracks));
        buffers.push(Buffer { name: "picture", words: picture.len() * 4, contents: Some(words(&picture)) });
        let spread = VIEW / height as f32;
        let params =
            self.params(size, 1, DenoiseParams { history: 0.0, frames: FRAMES, spread, ..DenoiseParams::default() });
        let passes = planes.passes(&params, self.rounds, buffers.len() - 1).into_iter().collect::<Result<_, _>>()?;
        let plan = FramePlan::of(buffers, passes, vec![planes.denoised()]);
        let outputs = executor.run(plan)?;
        let film: Vec<FilmPixel> = outputs.first().map(|words| bytemuck::pod_collect_to_vec(words)).unwrap_or_default();
        Ok(Image { width, height, pixels: film.into_iter().map(|pixel| pixel.sum).collect() })
    }
}

fn pixels_missing(image: &Image) -> Error {
    let Image { width, height, pixels } = image;
    Error::Setting(format!("an image of {width} x {height} has {} pixels; give it width * height", pixels.len()))
}

fn words<T: bytemuck::Pod>(plane: &[T]) -> Arc<[u32]> {
    bytemuck::pod_collect_to_vec(plane).into()
}

/// What pixels see, by layer.
struct Layers<'a> {
    size: [usize; 2],
    albedo: [&'a [f32]; 3],
    normal: [&'a [f32]; 3],
    depth: &'a [f32],
    id: Option<&'a [f32]>,
    scattering: Option<[&'a [f32]; 3]>,
    /// Mean luminance of the pixels of each object, and of those that see none.
    brightness: HashMap<u32, f32>,
}

impl<'a> Layers<'a> {
    fn new(image: &Image, channels: &'a [Channel]) -> Result<Self, Error> {
        let size = [image.width, image.height].map(|side| side as usize);
        let count = size[0] * size[1];
        let values = |name: &str| {
            let channel = channels.iter().find(|channel| channel.name == name);
            channel.map(|channel| channel.values.as_slice()).filter(|values| values.len() == count)
        };
        let needed = |name: &str| {
            let problem = || {
                Error::Setting(format!(
                    "the image has no channel {name:?} with a value a pixel; render it with --aov albedo,normal,depth,id, or in Blender with the \
                     passes Denoising Data, Depth and Object Index"
                ))
            };
            values(name).ok_or_else(problem)
        };
        let three = |layer: Aov| -> Result<[&[f32]; 3], Error> {
            let names = layer.channels();
            Ok([needed(names[0])?, needed(names[1])?, needed(names[2])?])
        };
        let [depth, id] = [Aov::Depth, Aov::Id].map(|layer| layer.channels()[0]);
        let mut layers = Self {
            size,
            albedo: three(Aov::Albedo)?,
            normal: three(Aov::Normal)?,
            depth: needed(depth)?,
            id: values(id),
            scattering: three(Aov::Scattering).ok(),
            brightness: HashMap::new(),
        };
        layers.brightness = layers.brightnesses(image);
        Ok(layers)
    }

    fn brightnesses(&self, image: &Image) -> HashMap<u32, f32> {
        let mut sums: HashMap<u32, [f32; 2]> = HashMap::new();
        for (i, pixel) in image.pixels.iter().enumerate() {
            let [sum, count] = sums.entry(self.key(i)).or_default();
            (*sum, *count) = (*sum + luminance(Vec3::from_array(*pixel)), *count + 1.0);
        }
        sums.into_iter().map(|(key, [sum, count])| (key, sum / count)).collect()
    }

    /// What a pixel sees; nothing where no object, no surface or no number is.
    fn pixel(&self, i: usize) -> (Guide, Track) {
        let [width, _] = self.size;
        let at = |planes: &[&[f32]; 3]| Vec3::new(planes[0][i], planes[1][i], planes[2][i]);
        let normal = at(&self.normal);
        let key = self.key(i);
        let faces = vec::dot(normal, normal) > 0.0;
        if key == 0 || !faces || self.is_beside_light(i) {
            return (Guide::NONE, Track::default());
        }
        let slopes = [self.slope(i, 1, i % width, width), self.slope(i, width, i / width, self.size[1])];
        let inside = self.scattering.as_ref().map_or(Vec3::ZERO, at);
        let albedo = at(&self.albedo) * if inside == Vec3::ZERO { Vec3::ONE } else { inside };
        let reflectance = Reflectance::new(albedo * (1.0 - POLISH) + Vec3::splat(POLISH));
        let place = [(i % width) as f32 + 0.5, (i / width) as f32 + 0.5];
        let inverse_depth = num::recip(self.depth[i]);
        (Guide::new(inverse_depth, slopes, vec::normalize(normal), key), Track { reflectance, place, inverse_depth })
    }

    /// Which object it is; 0 where there is none.
    fn key(&self, i: usize) -> u32 {
        let exists = self.depth[i] > 0.0 && self.depth[i] < FAR;
        let id = self.id.map_or(1.0, |id| id[i]);
        if exists && id > 0.0 { id as u32 } else { 0 }
    }

    /// Whether the next pixel is of an object that is far brighter, or sees none: of a lamp or the sky, of which this one may show a part.
    fn is_beside_light(&self, i: usize) -> bool {
        let [width, height] = self.size;
        let (x, y) = (i % width, i / width);
        let own = self.brightness.get(&self.key(i)).copied().unwrap_or(0.0);
        let brighter = |x: usize, y: usize| {
            let key = self.key(y * width + x);
            key == 0 || self.brightness.get(&key).is_some_and(|&other| other > BRIGHTER * own)
        };
        let rows = y.saturating_sub(1)..=(y + 1).min(height - 1);
        let mut around = rows.flat_map(|y| (x.saturating_sub(1)..=(x + 1).min(width - 1)).map(move |x| (x, y)));
        around.any(|(x, y)| brighter(x, y))
    }

    /// By which part of itself the inverse depth grows to the next pixel, which is `step` away: towards the side where it grows less, as an edge
    /// of the surface may be on the other.
    fn slope(&self, i: usize, step: usize, at: usize, side: usize) -> f32 {
        let here = num::recip(self.depth[i]);
        let growth =
            |j: usize, sign: f32| (self.key(j) == self.key(i)).then(|| sign * (num::recip(self.depth[j]) / here - 1.0));
        let next = (at + 1 < side).then(|| growth(i + step, 1.0)).flatten();
        let last = (at > 0).then(|| growth(i - step, -1.0)).flatten();
        let smaller = |a: f32, b: f32| if a.abs() < b.abs() { a } else { b };
        match (last, next) {
            (Some(last), Some(next)) => smaller(last, next),
            (growth, None) | (None, growth) => growth.unwrap_or(0.0),
        }
    }
}
