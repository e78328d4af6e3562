//! Solids of which the sum over a profile is known, probed exactly, and estimates of it.

use restir_shared::diffusion::{Disk, DiskNumbers, Profile, REACH, TAIL};
use restir_shared::geometry::Ray;
use restir_shared::glam::{DVec3, Vec3, Vec4};
use restir_tests::random::SplitMix;

/// A surface, of which the first point is looked from.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Solid {
    Plane,
    /// Of a radius, about a point.
    Sphere(f64, DVec3),
    /// Of a depth.
    Slab(f64),
}

/// A point with its normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    pub(crate) position: Vec3,
    pub(crate) normal: Vec3,
}

/// Some direction that is along no axis.
const TILT: DVec3 = DVec3::new(0.36, -0.48, 0.8);

impl Solid {
    /// Where light leaves.
    pub(crate) fn first(&self) -> Point {
        let normal = TILT.as_vec3();
        match *self {
            Self::Sphere(radius, centre) => Point { position: (centre + TILT * radius).as_vec3(), normal },
            Self::Plane | Self::Slab(_) => Point { position: Vec3::ZERO, normal },
        }
    }

    /// Where a segment meets it.
    pub(crate) fn hits(&self, ray: &Ray) -> Vec<Point> {
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let at = |t: f64, normal: &dyn Fn(DVec3) -> DVec3| {
            let position = origin + direction * t;
            let inside = t > 0.0 && t < f64::from(ray.t_max);
            inside.then(|| Point { position: position.as_vec3(), normal: normal(position).as_vec3() })
        };
        let plane = |depth: f64, normal: DVec3| {
            let t = (-depth - origin.dot(TILT)) / direction.dot(TILT);
            at(t, &|_| normal)
        };
        let found = match *self {
            Self::Plane => [plane(0.0, TILT), None],
            Self::Slab(depth) => [plane(0.0, TILT), plane(depth, -TILT)],
            Self::Sphere(radius, centre) => {
                let from = origin - centre;
                let (b, c) = (from.dot(direction), from.length_squared() - radius * radius);
                let root = (b * b - c * direction.length_squared()).max(-1.0).sqrt();
                let normal = |position: DVec3| (position - centre).normalize();
                if root.is_nan() { [None; 2] } else { [at(-b - root, &normal), at(-b + root, &normal)] }
            }
        };
        found.into_iter().flatten().collect()
    }

    /// What leaves of the light that falls evenly on all of it, of albedo 1: the profile's integral over it.
    pub(crate) fn expected(&self, d: f64, part: Part) -> f64 {
        let reach = f64::from(REACH) * d;
        let within = 1.0 - f64::from(TAIL);
        let beyond = |r: f64| if r < reach { super::exact::ccdf(r / d) - f64::from(TAIL) } else { 0.0 };
        match (*self, part) {
            // the area of a sphere within a chord c is pi c^2
            (Self::Sphere(radius, _), _) => within - beyond(2.0 * radius),
            (Self::Slab(depth), Part::Far) => beyond(depth),
            _ => within,
        }
    }
}

/// Which points are counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Part {
    All,
    /// Those of the other side of a slab.
    Far,
}

/// Which hits of a segment are taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Mode {
    All,
    One,
}

/// Random numbers as the library has them.
pub(crate) fn numbers(random: &mut SplitMix) -> Vec4 {
    let mut unit = || random.below(1 << 24) as f32 / 16_777_216.0;
    Vec4::new(unit(), unit(), unit(), unit())
}

/// A disk about the solid's first point.
pub(crate) fn disk(solid: &Solid, profile: Profile) -> Disk {
    let Point { position, normal } = solid.first();
    Disk::new(position, normal, profile)
}

/// What a sample is worth, by channel.
pub(crate) fn estimate(solid: &Solid, disk: &Disk, part: Part, mode: Mode, random: &mut SplitMix) -> [f64; 3] {
    let segment = disk.segment(&DiskNumbers::new(numbers(random), &disk.profile));
    let hits = solid.hits(&segment);
    let counted = |point: &&Point| part == Part::All || point.normal.as_dvec3().dot(TILT) < 0.0;
    let worth = |point: &Point| disk.weight(point.position, point.normal).0.as_dvec3();
    let all: DVec3 = match mode {
        Mode::All => hits.iter().filter(counted).map(worth).sum(),
        Mode::One if hits.is_empty() => DVec3::ZERO,
        Mode::One => {
            let chosen = &hits[random.below(hits.len())];
            if counted(&chosen) { worth(chosen) * hits.len() as f64 } else { DVec3::ZERO }
        }
    };
    all.to_array()
}
