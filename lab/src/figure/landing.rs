//! Where the points lie that a profile's segments find on a cuboid.

use restir::Error;
use restir::scene::subsurface::medium;
use restir_shared::diffusion::{Disk, DiskNumbers, Profile, Shape};
use restir_shared::geometry::Ray;
use restir_shared::glam::{UVec4, Vec3, Vec4};
use restir_shared::medium::Medium;
use restir_shared::rng::{Rng, Sampler, unit};

/// Segments whose points are counted.
const SEGMENTS: u32 = 1 << 18;
/// Of the random numbers.
const SEED: u32 = 4;

/// The profile of a medium of which a millimetre is so many units long.
pub(super) fn profile(name: &str, millimetre: f64) -> Result<Profile, Error> {
    let volume = medium(name, millimetre)?;
    let color = volume.scattering.as_ref().map_or([0.0; 3], |scattering| scattering.color);
    let path = volume.extinction().map(|extinction| 1.0 / extinction);
    Ok(Profile::of_medium(&Medium::of_color(color.into(), path.into(), 0.0), Shape::Diffuse))
}

/// Where the points of segments lie that start from anywhere on the front of a cuboid, as shares of what they are worth in green.
#[derive(Default)]
pub(super) struct Landed {
    /// The share of segments that find none.
    pub(super) nothing: f64,
    pub(super) front: f64,
    pub(super) back: f64,
    pub(super) beside: f64,
}

impl Landed {
    /// Of a cuboid about the origin, by half of its sides; its front is at +z.
    pub(super) fn from_front(profile: Profile, half: Vec3) -> Self {
        let mut found = Self::default();
        for i in 0..SEGMENTS {
            let place = numbers(i, 0);
            let at = Vec3::new((2.0 * place.x - 1.0) * half.x, (2.0 * place.y - 1.0) * half.y, half.z);
            let disk = Disk::new(at, Vec3::Z, profile);
            let mut met = false;
            for (point, normal) in points(&disk, i, half) {
                let worth = f64::from(disk.weight(point, normal).0.y);
                let face = match normal.z {
                    z if z > 0.0 => &mut found.front,
                    z if z < 0.0 => &mut found.back,
                    _ => &mut found.beside,
                };
                *face += worth;
                met = true;
            }
            found.nothing += if met { 0.0 } else { 1.0 };
        }
        let all = found.front + found.back + found.beside;
        let Self { nothing, front, back, beside } = found;
        Self { nothing: nothing / f64::from(SEGMENTS), front: front / all, back: back / all, beside: beside / all }
    }
}

/// The points on a cuboid about the origin, by half of its sides, that the segment of a number finds, and the normals there.
pub(super) fn points(disk: &Disk, number: u32, half: Vec3) -> impl Iterator<Item = (Vec3, Vec3)> + use<> {
    let ray = disk.segment(&DiskNumbers::new(numbers(number, 1), &disk.profile));
    (0..6).filter_map(move |face| crossing(&ray, half, face / 2, if face % 2 == 0 { -1.0 } else { 1.0 }))
}

fn crossing(ray: &Ray, half: Vec3, axis: usize, side: f32) -> Option<(Vec3, Vec3)> {
    let t = (side * half[axis] - ray.origin[axis]) / ray.direction[axis];
    let point = ray.origin + ray.direction * t;
    let inside = (0..3).all(|other| other == axis || point[other].abs() <= half[other]);
    let mut normal = Vec3::ZERO;
    normal[axis] = side;
    (t > 0.0 && t < ray.t_max && inside).then_some((point, normal))
}

fn numbers(index: u32, dimension: u32) -> Vec4 {
    let words: UVec4 = Rng::new(index, 0, 0, SEED, Sampler::Independent).hash(dimension);
    Vec4::new(unit(words.x), unit(words.y), unit(words.z), unit(words.w))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_lie_on_the_cuboid_and_shares_are_whole() {
        let (half, profile) = (Vec3::new(0.5, 0.5, 0.1), profile("wax", 0.02).unwrap());
        let disk = Disk::new(Vec3::new(0.2, 0.1, half.z), Vec3::Z, profile);
        let found: Vec<_> = (0..256).flat_map(|i| points(&disk, i, half)).collect();
        assert!(found.len() > 100, "{}", found.len());
        for (point, normal) in found {
            assert!(
                ((point * normal).element_sum() - (half * normal.abs()).element_sum()).abs() < 1.0e-5,
                "{point} {normal}"
            );
            assert!((point.abs() - half).max_element() < 1.0e-5, "{point}");
        }
        // what lies beside the front of a thin body is more than of a thick one
        let [thin, thick] = [0.05, 0.5].map(|z| Landed::from_front(profile, Vec3::new(0.5, 0.5, z)));
        for Landed { front, back, beside, .. } in [&thin, &thick] {
            assert!((front + back + beside - 1.0).abs() < 1.0e-9);
        }
        assert!(
            thin.back > 0.2 && thick.back < 0.01 && thick.front > 0.6,
            "{} {} {}",
            thin.back,
            thick.back,
            thick.front
        );
    }
}
