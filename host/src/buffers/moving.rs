//! Scenes that move: the same triangles, tree and textures at another time.

use super::lights::LightTables;
use super::triangles::moved_bounds;
use super::{Flat, SceneBuffers, check, features, scene_error, used_materials};
use crate::Error;
use crate::scene::Scene;
use restir_shared::layout::{ALIAS_WORDS, ENVIRONMENT_WORDS, FEATURE_LIGHT_TABLE, LIGHT_WORDS, PUNCTUAL_WORDS};
use restir_shared::scene::LightAddress;
use std::sync::Arc;

/// What stays while a scene moves.
#[derive(Debug)]
pub(super) struct Moving {
    scene: Scene,
    flat: Flat,
    features: u32,
    most_lights: u32,
}

impl Moving {
    /// Of a scene with its animation.
    pub(super) fn new(scene: &Scene, flat: Flat) -> Self {
        // with every emitter shining
        let tables = LightTables::new(scene, &flat.triangles, flat.environment.as_ref(), &flat.bvh.bounds);
        let used = used_materials(scene, &flat.triangles);
        // powers that are equal at one time may not be at another
        let features = features::of_scene(scene, &used, &tables, &flat.texels) | FEATURE_LIGHT_TABLE;
        Self { scene: scene.clone(), flat, features, most_lights: tables.lights.len() as u32 }
    }

    /// All that the scene has at any time.
    pub(super) fn features(&self) -> u32 {
        self.features
    }
}

impl SceneBuffers {
    /// Whether the scene has an animation: this is one moment of it.
    pub fn is_animated(&self) -> bool {
        self.moving.is_some()
    }

    /// The scene at a time in frames; itself if nothing ever changes. Triangles keep their ids, feature bits are those
    /// of all times, and the lights that shine keep their order.
    ///
    /// # Errors
    /// [`Error::Scene`] if it moves too far away, or a triangle loses its area.
    pub fn at(&self, time: f64) -> Result<Self, Error> {
        match &self.moving {
            Some(moving) => self.refitted(moving, &moving.scene.at(time)),
            None => Ok(self.clone()),
        }
    }

    /// As [`Self::at`], for a scene that an embedder has moved: transforms of instances, positions of vertices, factors
    /// of materials and lights may differ.
    ///
    /// # Errors
    /// As of [`Self::build`]; [`Error::Scene`] as well if anything else differs, if a triangle loses its area, or if this
    /// was built of a scene without an animation, of which nothing is kept.
    pub fn refit(&self, scene: &Scene) -> Result<Self, Error> {
        let Some(moving) = &self.moving else {
            return Err(scene_error(scene, "was built without an animation; build it anew".to_owned()));
        };
        check::check(scene)?;
        if let Some(what) = difference(&moving.scene, scene) {
            return Err(scene_error(scene, format!("differs in its {what}, which cannot be refitted; build it anew")));
        }
        self.refitted(moving, scene)
    }

    fn refitted(&self, moving: &Arc<Moving>, scene: &Scene) -> Result<Self, Error> {
        let flat = &moving.flat;
        let bvh = flat.bvh.refit(&moved_bounds(scene, &flat.triangles)?);
        let buffers = Self::assemble(scene, flat, &bvh, self.texels.clone())?;
        if buffers.features & !moving.features != 0 || buffers.header.light_count > moving.most_lights {
            return Err(scene_error(scene, "has lights or materials of kinds that it had not; build it anew".to_owned()));
        }
        Ok(buffers.with_motion(moving.clone()))
    }

    /// The most lights that shine at any time.
    pub fn most_lights(&self) -> u32 {
        self.moving.as_ref().map_or(self.header.light_count, |moving| moving.most_lights)
    }

    /// The most words of 32 bits that the geometry and the attributes of any time take, these with the lights'
    /// counterparts in both directions.
    pub(crate) fn most_words(&self) -> [usize; 2] {
        let Some(moving) = &self.moving else { return [self.geometry.len(), self.attributes.len()] };
        let lights = moving.most_lights;
        let punctual = moving.scene.lights.len() as u32 * PUNCTUAL_WORDS;
        let tables = lights * (LIGHT_WORDS + ALIAS_WORDS) + punctual + ENVIRONMENT_WORDS;
        let counterparts = 2 * lights.div_ceil(4);
        [self.geometry.len(), 4 * (self.header.light_base + tables + counterparts) as usize]
    }

    /// For each light its index in `other`, the same scene at another time, or [`LightAddress::NO_LIGHT`]; `None` if the
    /// same lights shine. Four to a word of the arena.
    pub(crate) fn counterparts(&self, other: &Self) -> Option<Arc<[u32]>> {
        let (own, others) = (self.light_keys(), other.light_keys());
        let index = |key| others.binary_search(key).map_or(LightAddress::NO_LIGHT, |index| index as u32);
        let mut words: Vec<u32> = own.iter().map(index).collect();
        words.resize(words.len().next_multiple_of(4), LightAddress::NO_LIGHT);
        (own != others).then(|| words.into())
    }

    /// What each light is: its kind, and its triangle or index; ascending.
    fn light_keys(&self) -> Vec<[u32; 2]> {
        let (first, count) = (self.header.light_base as usize, self.header.light_count as usize);
        const { assert!(LIGHT_WORDS == 1) };
        self.attributes.chunks_exact(4).skip(first).take(count).map(|record| [record[2], record[0]]).collect()
    }
}

/// What two scenes differ in, if one cannot be refitted to the other.
fn difference(a: &Scene, b: &Scene) -> Option<&'static str> {
    let same_mesh = |(a, b): (&crate::scene::Mesh, &crate::scene::Mesh)| {
        a.indices == b.indices
            && a.material == b.material
            && a.positions.len() == b.positions.len()
            && a.normals.is_empty() == b.normals.is_empty()
            && a.uvs == b.uvs
            && a.tangents.is_empty() == b.tangents.is_empty()
    };
    let textures = |scene: &Scene| -> Vec<_> {
        scene.materials.iter().map(|m| m.textures().map(|used| used.map(|used| used.texture))).collect()
    };
    let parts = [
        ("meshes", a.meshes.len() == b.meshes.len() && a.meshes.iter().zip(&b.meshes).all(same_mesh)),
        ("instances", a.instances.iter().map(|i| i.mesh).eq(b.instances.iter().map(|i| i.mesh))),
        ("textures", a.textures == b.textures && textures(a) == textures(b)),
        ("lights", a.lights.len() == b.lights.len()),
        ("environment", a.environment == b.environment),
    ];
    parts.into_iter().find(|(_, same)| !same).map(|(what, _)| what)
}
