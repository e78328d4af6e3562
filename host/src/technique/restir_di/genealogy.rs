//! The genealogy of a reservoir: from which reservoir of which pass and frame it has its sample, back to the candidate.

use super::DiSettings;
use super::lineage::{Follower, Origin, ReservoirPass};
use crate::render::{self, Render};
use crate::{Error, buffers::SceneBuffers, exec::Executor, memory, technique::explain::Place};
use restir_shared::layout::TRIANGLE_WORDS;
use restir_shared::scene::{AddressedLights, LightAddress, LightKind};
use restir_shared::technique::restir_di::{PackedReservoir, Stored, TileWords};

/// What a pass does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reuse {
    /// Draws candidates.
    Initial,
    /// Combines with the last frame.
    Temporal,
    /// Combines with the last frame's reservoir and its neighbours.
    Fused,
    /// Combines with neighbours: which of the passes that do, from 1.
    Spatial(u32),
}

/// A reservoir of the genealogy.
#[derive(Clone, Debug)]
pub struct Generation {
    /// Index of the frame.
    pub frame: u32,
    /// Index of the pass among those that make reservoirs.
    pub pass: usize,
    /// What it does.
    pub reuse: Reuse,
    /// Index of the pixel.
    pub pixel: u32,
    /// The reservoir as the executor left it.
    pub word: PackedReservoir,
    /// The same, replayed natively.
    pub replayed: PackedReservoir,
    /// Target of its sample at the pixel, without visibility.
    pub target: f32,
    /// The light of its sample, if it has one.
    pub light: Option<LightSource>,
    /// Where its sample comes from.
    pub origin: Origin,
}

/// What a light is, in whatever frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightSource {
    /// What emits.
    pub kind: LightKind,
    /// The triangle, in the order of the geometry arena, or the index among the scene's punctual lights.
    pub index: u32,
    /// The index of the material of a triangle; `None` of other lights.
    pub material: Option<u32>,
}

impl Generation {
    /// The reservoir.
    pub fn stored(&self) -> Stored {
        Stored::unpack(self.word)
    }
}

/// The genealogy of the reservoir that a pixel has in the last frame, from there to the candidate; of a reservoir without a
/// sample only itself.
///
/// # Errors
/// As of [`render::render`]; [`Error::Pixel`] for one outside of the image, [`Error::Memory`] for frames whose reservoirs cannot
/// all be kept.
pub fn genealogy(
    settings: &DiSettings,
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    render: &Render,
    place: Place,
) -> Result<Vec<Generation>, Error> {
    check(settings, scene, render)?;
    place.check(render)?;
    let mut follower = Follower::new(scene, render);
    let mut passes = Vec::new();
    render::render(executor, scene, render, &mut |step| {
        passes.extend(follower.follow(step)?);
        Ok(())
    })?;
    let mut generations = Vec::new();
    let mut next = passes.len().checked_sub(1).map(|last| (last, place.y * render.width + place.x));
    while let Some((pass, pixel)) = next {
        let generation = generation(&passes[pass], pixel);
        next = match generation.origin {
            Origin::Reservoir { made_by, pixel, .. } if generation.stored().sample.is_light() => Some((made_by, pixel)),
            _ => None,
        };
        generations.push(generation);
    }
    Ok(generations)
}

/// What [`genealogy`] checks first.
pub(super) fn check(settings: &DiSettings, scene: &SceneBuffers, render: &Render) -> Result<(), Error> {
    // first, for to check a render takes time with the number of frames
    check_memory(settings, scene, render)?;
    render::check(scene, render)
}

fn check_memory(settings: &DiSettings, scene: &SceneBuffers, render: &Render) -> Result<(), Error> {
    // hits, candidates, temporal and spatial reuse, 16 bytes each
    let [width, height, frames] = [render.width, render.height, render.count].map(u64::from);
    let planes = 16 * (3 + u64::from(settings.spatial)) * width * height;
    let candidates = settings.tiles.map_or(0, |tiles| u64::from(tiles.count) * u64::from(tiles.size));
    let tiles = candidates * size_of::<TileWords>() as u64;
    // and of a scene that moves its frames, with their wide trees
    let scenes = if scene.is_animated() { 2 * scene.stats().bytes } else { 0 };
    let bytes = frames.saturating_mul(planes + tiles + scenes);
    memory::check(bytes, "this genealogy", "give fewer frames, a smaller size or fewer tiles")
}

fn generation(pass: &ReservoirPass, pixel: u32) -> Generation {
    let word = pass.made.words[pixel as usize];
    let (replayed, origin) = pass.replay(pixel);
    let address = Stored::unpack(word).sample;
    let light = address.is_light().then(|| light_source(pass.frames.this(), address));
    let p = &pass.params;
    let reuse = match (pass.is_initial(), pass.is_temporal(), p.neighbours) {
        (true, ..) => Reuse::Initial,
        (_, true, 0) => Reuse::Temporal,
        (_, true, _) => Reuse::Fused,
        _ => Reuse::Spatial(p.combine),
    };
    let target = pass.target(pixel, address);
    Generation { frame: p.frame, pass: pass.made.made_by, reuse, pixel, word, replayed, target, light, origin }
}

fn light_source(scene: &SceneBuffers, address: LightAddress) -> LightSource {
    let view = scene.view();
    let kind = view.light_at(address).sample.kind;
    let index = scene.light_index(address.light);
    let first_word = (view.header.triangle_base + index * TRIANGLE_WORDS) as usize;
    let material = (kind == LightKind::Area).then(|| view.geometry[first_word].w);
    LightSource { kind, index, material }
}
