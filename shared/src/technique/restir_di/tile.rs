//! Tiles of candidates, sampled once a frame and shared by pixels that lie together, so that they need not be looked up all
//! over the scene (Wyman and Panteleev 2021, "Rearchitecting Spatiotemporal Resampling for Production").
//!
//! A block of pixels takes one tile, chosen at random, and each pixel candidates that follow each other in it, from a
//! random place on. Each is distributed as one of the pixel's own would be, so nothing changes in expectation; but
//! pixels of a block share candidates, and so their errors.

use super::{DiParams, TileParams, TileWords};
use crate::layout::FEATURE_BLEND;
use crate::rng::{self, Rng};
use crate::scene::{AddressedLight, AddressedLights, LightAddress, LightKind, LightSample};
use glam::{UVec4, Vec2, Vec3};

/// Side of a block of pixels, as a power of two.
const BLOCK_LOG2: u32 = 3;
/// Random dimensions that no pixel has: of tiles' candidates, and of blocks.
const CANDIDATES: u32 = 1 << 16;
const BLOCKS: u32 = CANDIDATES + 1;
const TWO_SIDED: u32 = 4;
const BLENDED: u32 = 8;

/// The candidate of that index in a tile.
pub fn presample<S: AddressedLights>(scene: &S, params: &TileParams, index: u32, tile: u32) -> TileWords {
    let sample = params.frame.wrapping_mul(params.tile_size).wrapping_add(index);
    let rng = Rng::new(tile, 0, sample, params.seed, params.flags.sampler());
    let address = scene.choose_address(rng.draw(CANDIDATES));
    let light = if address.is_light() { scene.light_at(address) } else { AddressedLight::NONE };
    pack(address, &light)
}

fn pack(address: LightAddress, light: &AddressedLight) -> TileWords {
    let AddressedLight { sample, extent } = light;
    let [a, b] = if sample.kind == LightKind::Point { sample.falloff.to_array() } else { [sample.offset, *extent] };
    let word = |v: Vec3, w: u32| UVec4::new(v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), w);
    let flag = |on: bool, bit: u32| if on { bit } else { 0 };
    let kind = sample.kind as u32 | flag(sample.two_sided, TWO_SIDED) | flag(sample.blended, BLENDED);
    TileWords {
        position: word(sample.position, address.light),
        normal: word(sample.normal, address.u),
        emission: word(sample.emission, address.v),
        rest: word(Vec3::new(sample.density, a, b), kind),
    }
}

/// The inverse of [`pack`].
#[inline(always)]
pub(super) fn unpack(words: &TileWords) -> (LightAddress, AddressedLight) {
    let TileWords { position, normal, emission, rest } = *words;
    let vector = |word: UVec4| Vec3::new(f32::from_bits(word.x), f32::from_bits(word.y), f32::from_bits(word.z));
    let Vec3 { x: density, y: a, z: b } = vector(rest);
    let kind = match rest.w & 3 {
        0 => LightKind::Area,
        1 => LightKind::Point,
        2 => LightKind::Directional,
        _ => LightKind::Environment,
    };
    let at_point = kind == LightKind::Point;
    let address = LightAddress { light: position.w, u: normal.w, v: emission.w };
    let sample = LightSample {
        position: vector(position),
        normal: vector(normal),
        offset: if at_point { 0.0 } else { a },
        emission: vector(emission),
        two_sided: rest.w & TWO_SIDED != 0,
        density,
        kind,
        blended: rest.w & BLENDED != 0,
        key: address.key(FEATURE_BLEND),
        falloff: if at_point { Vec2::new(a, b) } else { Vec2::Y },
    };
    (address, AddressedLight { sample, extent: if at_point { 1.0 } else { b } })
}

/// The candidates of a pixel: some of a tile, which is taken for a ring.
#[derive(Clone, Copy)]
pub(super) struct Window {
    tile: u32,
    start: u32,
    size: u32,
}

impl Window {
    /// The window of a frame whose pixels draw candidates of their own.
    pub(super) const NONE: Self = Self { tile: 0, start: 0, size: 1 };

    /// The window of the pixel (x, y), which a random word of its own places in the tile.
    #[inline(always)]
    pub(super) fn new(params: &DiParams, [x, y]: [u32; 2], word: u32) -> Self {
        let block = params.rng([x >> BLOCK_LOG2, y >> BLOCK_LOG2]);
        let size = params.tile_size;
        Self { tile: below(params.tiles, block.hash(BLOCKS).x), start: below(size, word), size }
    }

    /// The index of the pixel's i-th candidate among those of all tiles.
    #[inline(always)]
    pub(super) fn at(&self, i: u32) -> u32 {
        self.tile.wrapping_mul(self.size).wrapping_add(self.start.wrapping_add(i) % self.size)
    }
}

/// A whole number below `count`, at most 2^15, in proportion to a random word. (1 - 2^-24) count is never rounded to count.
#[inline(always)]
fn below(count: u32, word: u32) -> u32 {
    (rng::unit(word) * count as f32) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_packed_comes_back() {
        let v = |x: f32| Vec3::new(x, -0.5 * x, 0.25 * x);
        for kind in [LightKind::Area, LightKind::Point, LightKind::Directional, LightKind::Environment] {
            let area = kind == LightKind::Area;
            let at_point = kind == LightKind::Point;
            let address = LightAddress { light: 5, u: 6, v: 7 };
            let sample = LightSample {
                position: v(3.0),
                normal: v(1.0),
                offset: if area { 0.01 } else { 0.0 },
                emission: v(7.0),
                two_sided: area,
                density: 0.3,
                kind,
                blended: area,
                key: address.key(FEATURE_BLEND),
                falloff: if at_point { Vec2::new(2.0, -1.0) } else { Vec2::Y },
            };
            let extent = if area | (kind == LightKind::Environment) { 0.7 } else { 1.0 };
            let (back, light) = unpack(&pack(address, &AddressedLight { sample, extent }));
            assert_eq!(back, address);
            let parts = |l: &AddressedLight| (l.sample.position, l.sample.normal, l.sample.emission, l.sample.falloff);
            let numbers = |l: &AddressedLight| (l.sample.offset, l.sample.density, l.extent);
            let words = |l: &AddressedLight| (l.sample.two_sided, l.sample.blended, l.sample.key);
            let light_in = AddressedLight { sample, extent };
            assert_eq!((parts(&light), numbers(&light)), (parts(&light_in), numbers(&light_in)));
            assert_eq!((words(&light), light.sample.kind), (words(&light_in), kind));
        }
    }

    /// Windows lie within their tile, and begin anywhere in it.
    #[test]
    fn windows_are_rings() {
        let params = DiParams { tiles: 3, tile_size: 10, ..DiParams::default() };
        for (word, start) in [(0, 0), (1 << 31, 5), (u32::MAX, 9)] {
            let window = Window::new(&params, [100, 7], word);
            assert!(window.tile < 3 && window.start == start);
            for i in 0..25 {
                let at = window.at(i);
                assert_eq!(at / 10, window.tile);
                assert_eq!(at, window.at(i + 10));
            }
        }
    }
}
