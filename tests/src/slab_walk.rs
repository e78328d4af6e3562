//! Walks of light inside of slabs, by the library's distances, directions and interfaces, without a scene: in units of the mean free path.

use glam::{DVec3, Vec2, Vec3};
use restir_shared::bsdf::Dielectric;
use restir_shared::medium::Channels;
use restir_shared::num;
use restir_shared::rng::{Rng, Sampler, unit};
use restir_shared::sampling::{sample_cosine_hemisphere, sample_henyey_greenstein};
use restir_shared::vec::Frame;

/// A path is not worth looking at any longer.
const MOST_COLLISIONS: u32 = 1 << 14;
/// The index of a border that mirrors, unless another one is asked for.
pub const INDEX: f32 = 1.4;

/// What happens to light that reaches the border from inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Border {
    /// It leaves.
    Open,
    /// It is reflected as if it was the outside that is denser by [`Slab::index`]: never totally.
    DenserOutside,
    /// It is reflected by Fresnel's equations, of a medium denser by [`Slab::index`].
    Dielectric,
}

/// How light comes in, behind the border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Entry {
    /// By Lambert's law.
    Lambert,
    /// Straight down.
    Normal,
}

/// A slab, infinitely deep for a half space.
#[derive(Clone, Copy, Debug)]
pub struct Slab {
    /// In mean free paths.
    pub depth: f32,
    /// What of a collision is scattered.
    pub albedo: f32,
    /// Mean cosine of the angle of scattering.
    pub anisotropy: f32,
    /// Both borders.
    pub border: Border,
    /// The index of borders that mirror.
    pub index: f32,
    /// How light enters.
    pub entry: Entry,
}

/// Where light leaves.
#[derive(Clone, Copy, Debug)]
pub struct Exit {
    /// On the other side.
    pub transmitted: bool,
    /// The share of the light that entered.
    pub weight: f64,
    /// How often it was scattered.
    pub collisions: u32,
    /// The distance from where it entered, along the border.
    pub radius: f64,
}

/// The walk of a number; nothing if the light was absorbed.
pub fn walk(slab: &Slab, seed: u32, index: u64) -> Option<Exit> {
    let numbers = |step: u32| {
        let words = Rng::new(index as u32 & 0xffff, (index >> 16) as u32, step, seed, Sampler::Independent).hash(0);
        [words.x, words.y, words.z, words.w].map(unit)
    };
    let interface = Dielectric::new(slab.index, 1.0 / slab.index, slab.border == Border::DenserOutside);
    let [u, v, ..] = numbers(0);
    let mut direction = match slab.entry {
        Entry::Lambert => sample_cosine_hemisphere(Vec2::new(u, v)),
        Entry::Normal => Vec3::Z,
    };
    let (mut depth, mut across) = (0.0_f32, DVec3::ZERO);
    let channels = Channels::new(Vec3::ONE, Vec3::ONE);
    let (mut throughput, mut collisions) = (1.0_f32, 0_u32);
    for step in 1..MOST_COLLISIONS {
        let [choice, u, v, w] = numbers(step);
        let border = if direction.z > 0.0 { slab.depth } else { 0.0 };
        let to_border = if direction.z == 0.0 { f32::MAX } else { (border - depth) / direction.z };
        let distance = channels.sample(Vec2::new(choice, w));
        across += direction.as_dvec3() * f64::from(distance.min(to_border));
        if distance < to_border {
            throughput *= slab.albedo * channels.collided(distance).x;
            depth += distance * direction.z;
            collisions += 1;
            let turned = sample_henyey_greenstein(Vec2::new(u, v), slab.anisotropy);
            direction = Frame::new(direction).to_world(turned);
            direction /= direction.as_dvec3().length() as f32;
            if collisions > 16 {
                let survival = num::clamp(throughput, 0.05, 1.0);
                if choice >= survival {
                    return None;
                }
                throughput /= survival;
            }
            continue;
        }
        throughput *= channels.passed(to_border).x;
        depth = border;
        let cos = direction.z.abs();
        let reflected =
            if slab.border == Border::Open { 0.0 } else { interface.fresnel(cos, interface.bent(cos)).reflected };
        if u < reflected {
            direction.z = -direction.z;
            continue;
        }
        let radius = across.x.hypot(across.y);
        return Some(Exit { transmitted: direction.z > 0.0, weight: f64::from(throughput), collisions, radius });
    }
    None
}
