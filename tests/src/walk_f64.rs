//! An independent random walk in `f64` inside of analytic bodies, which shares no code with the kernels: channel by channel, without a mixture of
//! densities, a hierarchy, or sampled lights.

use crate::oracle::Camera;
use crate::random::SplitMix;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// A convex body.
#[derive(Clone, Copy, Debug)]
pub enum Body {
    /// Lower and upper corner.
    Box(DVec3, DVec3),
    /// Centre and radius.
    Sphere(DVec3, f64),
}

/// What lets light in and out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Border {
    /// All light passes, and goes on by Lambert's law.
    Open,
    /// Light enters as by [`Self::Open`]. From inside it is mirrored as by an interface to what is denser by an index, or leaves by Lambert's law.
    DenserOutside(f64),
    /// A smooth dielectric of an index.
    Dielectric(f64),
}

/// A body of a homogeneous medium under a sky.
#[derive(Clone, Copy, Debug)]
pub struct Walker {
    /// The body.
    pub body: Body,
    /// How light passes its surface.
    pub border: Border,
    /// Collisions per unit length, by channel.
    pub extinction: [f64; 3],
    /// What of a collision is scattered, by channel.
    pub albedo: [f64; 3],
    /// Mean cosine of the angle of scattering.
    pub anisotropy: f64,
    /// Radiance of the sky, by direction.
    pub sky: fn(DVec3) -> f64,
    /// Orders of scattering that count, both included.
    pub orders: [u32; 2],
}

impl Body {
    /// The distance to the surface along a ray, from outside or inside, and its normal there.
    fn hit(&self, origin: DVec3, direction: DVec3, inside: bool) -> Option<(f64, DVec3)> {
        match *self {
            Self::Sphere(centre, radius) => {
                let from = origin - centre;
                let b = from.dot(direction);
                let square = b * b - (from.length_squared() - radius * radius);
                let t = if inside { -b + square.max(0.0).sqrt() } else { -b - square.max(0.0).sqrt() };
                let normal = (from + direction * t).normalize();
                (inside || square > 0.0 && t > 0.0).then_some((t.max(0.0), normal))
            }
            Self::Box(lo, hi) => {
                let (mut enter, mut leave) = ((f64::NEG_INFINITY, DVec3::ZERO), (f64::INFINITY, DVec3::ZERO));
                for (axis, unit) in DVec3::AXES.into_iter().enumerate() {
                    let ends = [lo, hi].map(|end| (end[axis] - origin[axis]) / direction[axis]);
                    let (near, far) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
                    let ahead = unit * direction[axis].signum();
                    enter = if near > enter.0 { (near, -ahead) } else { enter };
                    leave = if far < leave.0 { (far, ahead) } else { leave };
                }
                let ahead = enter.0 < leave.0 && enter.0 > 0.0;
                if inside { Some((leave.0.max(0.0), leave.1)) } else { ahead.then_some(enter) }
            }
        }
    }
}

/// What a smooth interface reflects, and the cosine behind it relative to the index `n` there; nothing passes beyond the critical angle.
fn fresnel(cos: f64, n: f64) -> (f64, f64) {
    let square = 1.0 - (1.0 - cos * cos) / (n * n);
    if square <= 0.0 {
        return (1.0, 0.0);
    }
    let bent = square.sqrt();
    let [s, p] = [(cos - n * bent) / (cos + n * bent), (n * cos - bent) / (n * cos + bent)];
    (0.5 * (s * s + p * p), bent)
}

/// A direction about a unit vector, at a cosine.
fn about(axis: DVec3, cos: f64, random: &mut SplitMix) -> DVec3 {
    let (x, y) = axis.any_orthonormal_pair();
    let (sin_turn, cos_turn) = (TAU * random.unit()).sin_cos();
    let sine = (1.0 - cos * cos).max(0.0).sqrt();
    (axis * cos + (x * cos_turn + y * sin_turn) * sine).normalize()
}

fn lambert(normal: DVec3, random: &mut SplitMix) -> DVec3 {
    about(normal, random.unit().sqrt(), random)
}

/// The cosine of Henyey and Greenstein's textbook.
fn turn(g: f64, random: &mut SplitMix) -> f64 {
    let u = random.unit();
    if g.abs() < 1.0e-6 {
        return 2.0 * u - 1.0;
    }
    let q = (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
    ((1.0 + g * g - q * q) / (2.0 * g)).clamp(-1.0, 1.0)
}

impl Walker {
    /// One estimate of a pixel's radiance, over its area.
    pub fn pixel(&self, camera: &Camera, restart: u32, x: u32, y: u32) -> [f64; 3] {
        [0, 1, 2].map(|channel| {
            let stream = (u64::from(restart) << 34) | u64::from(y << 18 | x << 2 | channel as u32);
            let random = &mut SplitMix::new(stream);
            let direction = camera.direction(f64::from(x) + random.unit(), f64::from(y) + random.unit());
            self.radiance(channel, camera.position, direction, random)
        })
    }

    fn counted(&self, order: u32, direction: DVec3) -> f64 {
        if order >= self.orders[0] && order <= self.orders[1] { (self.sky)(direction) } else { 0.0 }
    }

    fn radiance(&self, channel: usize, origin: DVec3, direction: DVec3, random: &mut SplitMix) -> f64 {
        let Some((t, normal)) = self.body.hit(origin, direction, false) else {
            return self.counted(0, direction);
        };
        let inwards = match self.border {
            Border::Open | Border::DenserOutside(_) => lambert(-normal, random),
            Border::Dielectric(n) => {
                let cos = -normal.dot(direction);
                let (reflected, bent) = fresnel(cos, n);
                if random.unit() < reflected {
                    return self.counted(0, direction + normal * (2.0 * cos));
                }
                ((direction + normal * cos) / n - normal * bent).normalize()
            }
        };
        self.walk(channel, origin + direction * t, inwards, random)
    }

    /// From the surface on. Radiance is scaled by n^2 on one side of a dielectric and back on the other.
    fn walk(&self, channel: usize, mut origin: DVec3, mut direction: DVec3, random: &mut SplitMix) -> f64 {
        let (mut throughput, mut order) = (1.0, 0);
        loop {
            let (border, normal) = self.body.hit(origin, direction, true).expect("inside");
            let flight = -(1.0 - random.unit()).ln() / self.extinction[channel];
            if flight < border {
                origin += direction * flight;
                direction = about(direction, turn(self.anisotropy, random), random);
                throughput *= self.albedo[channel];
                order += 1;
                if throughput < 0.1 {
                    if random.unit() < 0.5 {
                        return 0.0;
                    }
                    throughput *= 2.0;
                }
                continue;
            }
            origin += direction * border;
            let cos = normal.dot(direction);
            let (reflected, out) = match self.border {
                Border::Open => (0.0, None),
                Border::DenserOutside(n) => (fresnel(cos, n).0, None),
                Border::Dielectric(n) => {
                    let (reflected, bent) = fresnel(cos, 1.0 / n);
                    (reflected, Some((direction - normal * cos) * n + normal * bent))
                }
            };
            if random.unit() >= reflected {
                let out = out.unwrap_or_else(|| lambert(normal, random));
                return throughput * self.counted(order, out.normalize());
            }
            direction = (direction - normal * (2.0 * cos)).normalize();
        }
    }
}

/// `2 E3(depth)`: what passes a slab without a collision of light that enters by Lambert's law, by quadrature.
pub fn unscattered(depth: f64) -> f64 {
    const STEPS: u32 = 1 << 16;
    let part = |i: u32| {
        let cos = (f64::from(i) + 0.5) / f64::from(STEPS);
        2.0 * cos * (-depth / cos).exp() / f64::from(STEPS)
    };
    (0..STEPS).map(part).sum()
}

/// Rows of pixels of the sky [`from_above`].
pub const SKY_ROWS: u32 = 256;

/// Light from above the horizon, as of a map from pole to pole whose rows above it are white: radiance is linear between the centres of the
/// rows beside the horizon.
pub fn from_above(direction: DVec3) -> f64 {
    let row = direction.y.clamp(-1.0, 1.0).acos() / PI * f64::from(SKY_ROWS);
    (0.5 * f64::from(SKY_ROWS) + 0.5 - row).clamp(0.0, 1.0)
}
