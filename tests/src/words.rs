//! What the words of the planes are that kernels write: two roundings of one number are near each other, two integers are equal or not.

use restir_host::metrics::ulp_distance;
use restir_kernels::{Binding, KernelDesc};
use restir_shared::technique::restir_pt::PackedPath;

/// Distance of two words, as f32, up to which other roundings account for it: a relative difference of 5e-4.
const NEAR: u32 = 1 << 12;
/// The same of a number from 0 to 1 that is stored as an integer: 2^-12.
const NEAR_BITS: u32 = 12;

/// What a word is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Word {
    /// An `f32`.
    Float,
    /// An index, a count, flags, or random bits: any difference is one.
    Integer,
    /// A number from 0 to 1 in the lowest 24 bits, and an integer above.
    Coordinate,
    /// Two numbers from 0 to 1 in 16 bits each.
    Coordinates,
    /// The first 20 bits of an `f32` behind its sign, and an integer above.
    ShortFloat,
    /// A random number: a number from 0 to 1 in 32 bits.
    Random,
}

impl Word {
    const fn of(letter: u8) -> Self {
        match letter {
            b'f' => Self::Float,
            b'c' => Self::Coordinate,
            b'h' => Self::Coordinates,
            b's' => Self::ShortFloat,
            b'w' => Self::Random,
            _ => Self::Integer,
        }
    }

    /// Whether nothing but other roundings may be between two words.
    pub fn is_near(self, a: u32, b: u32) -> bool {
        // an integer above the lowest bits is the same, and what is below differs by some steps
        let within = |[a, b]: [u32; 2], bits: u32, steps: u32| {
            let low = |word: u32| word & ((1 << bits) - 1);
            a >> bits == b >> bits && low(a).abs_diff(low(b)) <= steps
        };
        let half = |shift: u32| within([a, b].map(|word| word >> shift & 0xffff), 16, 1 << (16 - NEAR_BITS));
        match self {
            Self::Float => {
                let [a, b] = [a, b].map(f32::from_bits);
                (a.is_nan() && b.is_nan()) || ulp_distance(a, b) <= NEAR
            }
            Self::Integer => a == b,
            Self::Coordinate => within([a, b], 24, 1 << (24 - NEAR_BITS)),
            Self::Coordinates => half(0) && half(16),
            Self::ShortFloat => within([a, b], 20, NEAR >> 11),
            Self::Random => a.abs_diff(b) <= 1 << (32 - NEAR_BITS),
        }
    }
}

const FILM: &[u8] = b"ffff";
/// A path that keeps what arrives at its vertex, and one that keeps a light there.
const PATH: &[u8] = b"fffffffiiiicccci";
const PATH_TO_LIGHT: &[u8] = b"fffficcfiiicccci";

/// The words of the elements of bindings with a name and a size, a letter each. The kernels that check functions all write `results`:
/// theirs have the kernel's name.
const WORDS: &[(&str, &[u8])] = &[
    ("film", FILM),
    ("right", FILM),
    ("mean", FILM),
    ("direct", FILM),
    ("offsets", b"i"),
    ("sums", b"i"),
    ("counts", b"i"),
    ("indices", b"i"),
    ("requests", b"ii"),
    ("results", FILM),
    ("rays", b"fffffffiiiii"),
    ("origins", b"fiffffff"),
    ("surfaces", b"fffffffi"),
    ("seen", b"fiffffff"),
    ("ends", b"fiffffff"),
    ("throughputs", b"fffi"),
    ("nearest", b"iiii"),
    ("points", b"fffi"),
    ("words", b"i"),
    ("taken", b"i"),
    ("starts", b"i"),
    ("entries", b"fffifffifffffffifffi"),
    ("exits", b"fffifffifffffffi"),
    ("walkers", b"fffifffifffhfffs"),
    ("tallies", b"iiii"),
    ("tiles", b"fffifffcfffcfffi"),
    ("reservoirs", b"iccf"),
    ("reservoirs", PATH),
    ("reservoirs", b"ffffficciiii"),
    ("points", b"fffffffhiccf"),
    ("hits", b"fiff"),
    ("pairs", b"ffffffff"),
    ("guides", b"fiii"),
    ("tracks", b"ifff"),
    ("means", b"fffffffi"),
    ("contrasts", FILM),
    ("estimates", FILM),
    ("filtered", FILM),
    ("shares", b"fffi"),
    ("denoised", FILM),
    ("self_check", b"ffffffffffffffff"),
    ("num_probe", b"fffffffffffffffhfffhffifffihf"),
    ("bsdf_check", b"fffffffffffiiwwww"),
    ("sampler_check", b"ffffffffffffffffffffffffffffffffffffffffffiwiiwwifffffff"),
    ("diffusion_check", b"fffffffffffffffiiiifffffff"),
    ("crossing_check", b"ififffifffifffifffifffifffifffiff"),
];

/// The words of the elements that a kernel writes to a binding.
#[derive(Clone, Copy, Debug)]
pub struct Words {
    letters: &'static [u8],
}

impl Words {
    /// Of a binding of a kernel; none if the table does not have it, or has it with another size.
    pub fn of(kernel: &KernelDesc, binding: &Binding) -> Option<Self> {
        // what merges and is retraced is written as a reservoir
        let written = if ["merged", "retraced"].contains(&binding.name) { "reservoirs" } else { binding.name };
        let fits = |name, letters: &[u8]| {
            let is_of = name == written || (binding.name == "results" && name == kernel.name);
            is_of && letters.len() * 4 == binding.stride as usize
        };
        let (_, letters) = WORDS.iter().find(|(name, letters)| fits(*name, letters))?;
        Some(Self { letters })
    }

    /// The words of an element, of whose forms the host's decides.
    pub fn element(self, host: &[u32]) -> impl Iterator<Item = Word> {
        let keeps_light = |words: &[u32]| {
            let words = words.try_into().ok();
            words.is_some_and(|words| PackedPath { words }.unpack().path.keeps_light())
        };
        let letters = if self.letters == PATH && keeps_light(host) { PATH_TO_LIGHT } else { self.letters };
        letters.iter().map(|&letter| Word::of(letter))
    }
}
