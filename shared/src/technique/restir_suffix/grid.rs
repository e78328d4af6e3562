//! Supporting prefixes near a point: a hash grid over the ends of all of them.
//!
//! A point looks for others within a radius that grows with the length of its prefix: so many footprints of a pixel. Radii are rounded to powers of
//! two, the level; a point finds those of its own level. The cells of a level have edges of twice its radius, so that a sphere around any point
//! lies within the 2 x 2 x 2 cells about it. [`compact`](crate::compact) sorts pixels by the hash of their cells.

use super::SuffixParams;
use crate::num;
use crate::pack::{decode_unit_vector, encode_unit_vector};
use crate::resample::mutual::ShiftRequest;
use crate::rng::{Rng, Sampler, pcg4d, stream};
use crate::scene::{Location, Surface};
use crate::shift::PathOrigin;
use crate::vec::{dot, length};
use bytemuck::{Pod, Zeroable};
use glam::{UVec4, Vec3};

/// The most suffixes that an integration prefix borrows.
pub const MAX_BORROWED: u32 = 4;
/// Of a bucket with more points only every second, third ... is looked at, so that there are no more.
const MOST: u32 = 1 << MOST_LOG2;
const MOST_LOG2: u32 = 5;
/// Radii are from 2^-63 to 2^63.
const LEAST_RADIUS: f32 = f32::from_bits((127 - 63) << 23);
const GREATEST_RADIUS: f32 = f32::from_bits((127 + 63) << 23);
const SQRT_2: f32 = core::f32::consts::SQRT_2;
/// Cells are at most so many edges away from the origin; what lies beyond is in the last ones.
const MOST_CELLS: f32 = 8_388_608.0;
/// The distance of what is not near: no radius reaches so far.
const FAR: f32 = f32::MAX;
/// Farther than all that is taken.
const NOTHING: f32 = 1.0e38;
/// The stream that says who of a bucket are paired.
const PAIRS: u32 = stream(5);

/// The end of a prefix as others look for it, in 16 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PrefixPoint {
    /// World position, in diagonals of the scene's bounds: but for rounding, points have the same cells in any unit of length.
    pub position: [f32; 3],
    /// In the low 8 bits the level, the biased exponent of the radius, which is 0 if there is no prefix; above it the octahedral coordinates of
    /// the normal on the path's side, 12 bits each.
    pub word: u32,
}

impl PrefixPoint {
    /// The end of a prefix; a level of 0 without one.
    #[inline(always)]
    pub fn new<S: Surface>(scene: &S, params: &SuffixParams, end: &PathOrigin) -> Self {
        if end.segments() == 0 {
            return Self::default();
        }
        let Location { position, normal, .. } = scene.location(&end.hit.unpack());
        let faces = dot(normal, Vec3::from_array(end.direction)) <= 0.0;
        Self::of(params, position, if faces { normal } else { -normal }, end.reach())
    }

    /// The end of a prefix of that length, on a surface of that unit normal; a level of 0 if it has no length.
    #[inline(always)]
    pub fn of(params: &SuffixParams, position: Vec3, normal: Vec3, reach: f32) -> Self {
        let code = encode_unit_vector(normal);
        let normal = ((code >> 4) & 0xfff) | ((code >> 20) << 12);
        let scale = params.per_diagonal();
        let radius = num::clamp(params.search_radius(reach * scale), LEAST_RADIUS, GREATEST_RADIUS);
        let level = if reach > 0.0 { (radius * SQRT_2).to_bits() >> 23 } else { 0 };
        Self { position: (position * scale).to_array(), word: (normal << 8) | level }
    }

    /// For tests: the same beside it, by so much of the diagonal.
    #[doc(hidden)]
    #[must_use]
    pub fn beside(&self, by: Vec3) -> Self {
        Self { position: (Vec3::from_array(self.position) + by).to_array(), ..*self }
    }

    #[inline(always)]
    fn level(&self) -> u32 {
        self.word & 0xff
    }

    #[inline(always)]
    fn normal(&self) -> Vec3 {
        let word = self.word >> 8;
        decode_unit_vector(((word & 0xfff) << 4) | ((word >> 12) << 20))
    }

    /// The position in edges of cells.
    #[inline(always)]
    fn in_cells(&self) -> Vec3 {
        let per_edge = f32::from_bits(253_u32.wrapping_sub(self.level()) << 23);
        Vec3::from_array(self.position) * per_edge
    }

    /// The bucket of the point's cell; of what is none, the last bucket.
    #[inline(always)]
    pub fn bucket(&self, buckets: u32) -> u32 {
        if self.level() == 0 { buckets - 1 } else { bucket(cell(self.in_cells()), self.level(), buckets) }
    }

    /// The squared distance to `other`, if that is near, on a surface that faces the same way, which is mutual; else the largest number.
    #[inline(always)]
    pub fn distance(&self, other: &Self, min_cos: f32) -> f32 {
        let distance = self.distance_within_radius(other);
        if distance < FAR && dot(self.normal(), other.normal()) >= min_cos { distance } else { FAR }
    }

    /// The same, whichever way the surfaces face.
    #[inline(always)]
    fn distance_within_radius(&self, other: &Self) -> f32 {
        let to = Vec3::from_array(other.position) - Vec3::from_array(self.position);
        let (radius, distance) = (f32::from_bits(self.level() << 23), dot(to, to));
        let near = (self.level() != 0) & (self.level() == other.level()) & (distance <= radius * radius);
        if near { distance } else { FAR }
    }
}

#[inline(always)]
fn cell(at: Vec3) -> [i32; 3] {
    let coordinate = |x: f32| num::floor(num::clamp(x, -MOST_CELLS, MOST_CELLS)) as i32;
    [coordinate(at.x), coordinate(at.y), coordinate(at.z)]
}

#[inline(always)]
fn is_same(a: [i32; 3], b: [i32; 3]) -> bool {
    (a[0] == b[0]) & (a[1] == b[1]) & (a[2] == b[2])
}

#[inline(always)]
fn bucket([x, y, z]: [i32; 3], level: u32, buckets: u32) -> u32 {
    pcg4d(UVec4::new(x as u32, y as u32, z as u32, level)).x & (buckets - 1)
}

/// All bits up to the highest one of a word.
#[inline(always)]
fn bits_of(word: u32) -> u32 {
    let word = word | (word >> 1);
    let word = word | (word >> 2);
    let word = word | (word >> 4);
    let word = word | (word >> 8);
    word | (word >> 16)
}

/// All points, sorted by buckets.
#[derive(Clone, Copy, Debug)]
pub struct PrefixGrid<'a> {
    /// Of each pixel its point.
    pub points: &'a [PrefixPoint],
    /// The pixels, by bucket, and in their own order within one.
    pub order: &'a [u32],
    /// Where in `order` each bucket begins, and where the last one ends.
    pub starts: &'a [u32],
}

/// The nearest points, in the order of their distances, and then of their pixels; `u32::MAX` where there are no more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Nearest {
    /// Their pixels.
    pub pixels: [u32; MAX_BORROWED as usize],
}

/// The points found so far.
struct Found {
    distances: [f32; MAX_BORROWED as usize],
    pixels: [u32; MAX_BORROWED as usize],
}

impl Found {
    /// No point that is farther away than this is one of the `count` nearest.
    #[inline(always)]
    fn farthest(&self, count: u32) -> f32 {
        self.distances[(count - 1) as usize]
    }

    /// Takes a point, if it is one of the nearest.
    #[inline(always)]
    fn take(&mut self, mut distance: f32, mut pixel: u32) {
        let mut n = 0;
        while n < MAX_BORROWED as usize {
            let (d, p) = (self.distances[n], self.pixels[n]);
            if (distance < d) | ((distance == d) & (pixel < p)) {
                (self.distances[n], self.pixels[n]) = (distance, pixel);
                (distance, pixel) = (d, p);
            }
            n += 1;
        }
    }
}

impl PrefixGrid<'_> {
    /// The `borrowed` prefixes that end nearest to a point.
    #[inline(always)]
    pub fn nearest(&self, params: &SuffixParams, to: &PrefixPoint) -> Nearest {
        let mut found =
            Found { distances: [NOTHING; MAX_BORROWED as usize], pixels: [u32::MAX; MAX_BORROWED as usize] };
        let first = cell(to.in_cells() - Vec3::splat(0.5));
        let mut corner = 0;
        while (corner < 8) & (to.level() != 0) {
            let of_corner = |axis: u32, x: i32| x + (corner >> axis & 1);
            self.look(params, to, [of_corner(0, first[0]), of_corner(1, first[1]), of_corner(2, first[2])], &mut found);
            corner += 1;
        }
        let kept = |n: u32| if n < params.borrowed { found.pixels[n as usize] } else { u32::MAX };
        Nearest { pixels: [kept(0), kept(1), kept(2), kept(3)] }
    }

    /// Looks at the points of a cell. Its bucket may have those of others, too.
    #[inline(always)]
    fn look(&self, params: &SuffixParams, to: &PrefixPoint, of: [i32; 3], found: &mut Found) {
        let bucket = bucket(of, to.level(), params.buckets);
        let (mut at, end) = (self.starts[bucket as usize], self.starts[bucket as usize + 1]);
        let count = end.wrapping_sub(at);
        let stride = count.wrapping_add(MOST - 1) >> MOST_LOG2;
        while at < end {
            let pixel = self.order[at as usize];
            let point = self.points[pixel as usize];
            // few points come so far that their normals have to be looked at
            let nearer = to.distance_within_radius(&point) <= found.farthest(params.borrowed);
            if nearer && is_same(cell(point.in_cells()), of) {
                found.take(to.distance(&point, params.min_normal_cos), pixel);
            }
            at = at.wrapping_add(stride);
        }
    }

    /// The request of the pixel `at` to take the sample of another one, which takes its own: pixels of a bucket are paired at random, in each round
    /// anew. There is none if the two are not near.
    #[inline(always)]
    pub fn pair(&self, params: &SuffixParams, at: [u32; 2]) -> ShiftRequest {
        let pixel = params.grid().index(at);
        let point = self.points[pixel as usize];
        if point.level() == 0 {
            return ShiftRequest::NONE;
        }
        let bucket = point.bucket(params.buckets);
        let (start, end) = (self.starts[bucket as usize], self.starts[bucket as usize + 1]);
        let count = end.wrapping_sub(start);
        let rank = self.rank(pixel, start, end);
        // all pixels of a bucket exchange the places whose numbers differ by the same word, which undoes itself
        let words = Rng::new(bucket & 0xffff, bucket >> 16, params.frame, params.seed, Sampler::Independent);
        let word = words.hash(PAIRS.wrapping_add(params.merge)).x & bits_of(count.wrapping_sub(1));
        let partner = rank ^ (if word == 0 { 1 } else { word });
        if partner >= count {
            return ShiftRequest::NONE;
        }
        let sample = self.order[start.wrapping_add(partner) as usize];
        let distance = point.distance(&self.points[sample as usize], params.min_normal_cos);
        if distance < FAR { ShiftRequest { sample, pixel } } else { ShiftRequest::NONE }
    }

    /// The place of a pixel among those of its bucket, which are in the order of their indices.
    #[inline(always)]
    fn rank(&self, pixel: u32, start: u32, end: u32) -> u32 {
        let (mut low, mut high) = (start, end);
        while low < high {
            let middle = low.wrapping_add(high.wrapping_sub(low) >> 1);
            if self.order[middle as usize] < pixel {
                low = middle.wrapping_add(1);
            } else {
                high = middle;
            }
        }
        low.wrapping_sub(start)
    }
}

impl SuffixParams {
    /// How far around the end of a prefix of that length others are looked for.
    #[inline(always)]
    fn search_radius(&self, reach: f32) -> f32 {
        let of = |axis: [f32; 3]| length(Vec3::from_array(axis));
        let pixel = num::div(2.0 * of(self.camera.up), of(self.camera.forward) * self.height as f32);
        self.radius * reach * pixel
    }

    /// One over the diagonal of the scene's bounds; 1 of a scene that tells none.
    #[inline(always)]
    fn per_diagonal(&self) -> f32 {
        let diagonal = length(Vec3::from_array(self.scene.bounds_hi) - Vec3::from_array(self.scene.bounds_lo));
        if diagonal > 0.0 { num::recip(diagonal) } else { 1.0 }
    }
}

const _: () = assert!(size_of::<PrefixPoint>() == 16 && size_of::<Nearest>() == 16 && MOST == 32);
