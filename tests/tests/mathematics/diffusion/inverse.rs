//! From points back to the random numbers that find them.

use super::exact;
use super::solids::{Solid, disk, numbers};
use libtest_mimic::Failed;
use restir_shared::diffusion::{Disk, DiskNumbers, Profile, REACH, Support, TAIL};
use restir_shared::glam::{DVec3, Vec3};
use restir_tests::random::SplitMix;
use restir_tests::stats::{FAMILY_RATE, Family};
use restir_tests::suite::ensure;

const DISTANCES: Vec3 = Vec3::new(1.0, 0.3, 0.1);

/// The densities of a point by axis and channel, each times its probability, in double precision.
pub(crate) fn techniques(disk: &Disk, point: Vec3, normal: Vec3) -> [[f64; 3]; 3] {
    let frame = [disk.frame.n, disk.frame.s, disk.frame.t].map(|axis| axis.as_dvec3());
    let beside = point.as_dvec3() - disk.centre.as_dvec3();
    [0, 1, 2].map(|axis: usize| {
        let along = frame[axis];
        let across = [frame[(axis + 1) % 3], frame[(axis + 2) % 3]].map(|side| beside.dot(side));
        let cosine = normal.as_dvec3().dot(along).abs();
        [0, 1, 2].map(|channel: usize| {
            let d = f64::from(disk.profile.distance[channel]);
            let found = disk.support == Support::Published || beside.length() <= f64::from(REACH) * d;
            let radius = across[0].hypot(across[1]).max(1.0e-5 * d);
            let weight = f64::from(disk.profile.probability[channel]) * if axis == 0 { 0.5 } else { 0.25 };
            if found && d > 0.0 { weight * cosine * exact::profile(radius, d) / (1.0 - f64::from(TAIL)) } else { 0.0 }
        })
    })
}

/// The line of the numbers passes the point within rounding, and the segment there is long enough.
pub(crate) fn replayed_numbers_find_the_point() -> Result<(), Failed> {
    let solids = [
        Solid::Plane,
        Solid::Slab(2.0),
        Solid::Sphere(1.0, DVec3::ZERO),
        Solid::Sphere(5.0, DVec3::new(40.0, -3.0, 100.0)),
    ];
    let mut worst = 0.0_f64;
    for (stream, solid) in (0..).zip(solids) {
        let disk = disk(&solid, Profile::new(Vec3::ONE, DISTANCES));
        for index in 0..100_000 {
            let mut random = SplitMix::new((7 + stream) << 41 | index);
            let drawn = DiskNumbers::new(numbers(&mut random), &disk.profile);
            for point in solid.hits(&disk.segment(&drawn)) {
                let (found, density) = disk.invert(point.position, point.normal, random.unit() as f32);
                ensure(density > 0.0, || format!("{solid:?}: nothing finds {point:?}"))?;
                let segment = disk.segment(&found);
                let [origin, direction] = [segment.origin, segment.direction].map(|v| v.as_dvec3());
                let to = point.position.as_dvec3() - origin;
                let along = to.dot(direction) / direction.length_squared();
                let beside = (to - direction * along).length();
                let largest = point.position.abs().max(disk.centre.abs()).max_element();
                let allowed = 1.0e-5 + 4.0 * f64::from(largest.next_up() - largest);
                worst = worst.max(beside / allowed);
                ensure(beside <= allowed, || format!("{solid:?}: {beside:e} beside {point:?}, {drawn:?}, {found:?}"))?;
                // at the end of its reach, rounding may leave a point out
                let slack = allowed + 1.0e-3;
                let inside = along > -slack && along < f64::from(segment.t_max) + slack;
                ensure(inside, || format!("{solid:?}: {along} of {}", segment.t_max))?;
                // the same point, but for the angle at which the line meets the surface
                let cosine = point.normal.as_dvec3().dot(direction).abs();
                let nearest =
                    solid.hits(&segment).iter().map(|hit| hit.position.distance_of(point.position)).fold(1.0, f64::min);
                let grazing = cosine < 0.02;
                ensure(grazing || nearest <= 2.0 * allowed / cosine, || {
                    format!("{solid:?}: {nearest:e} away, {cosine}")
                })?;
            }
        }
    }
    println!("points come back within {worst:.2} of what is allowed");
    Ok(())
}

trait Distance {
    fn distance_of(self, other: Self) -> f64;
}

impl Distance for Vec3 {
    fn distance_of(self, other: Self) -> f64 {
        self.as_dvec3().distance(other.as_dvec3())
    }
}

/// Of points as samples find them, axis and channel by which they were found, and those that the inverse draws, are both distributed
/// as the densities are.
pub(crate) fn numbers_have_the_density_of_techniques() -> Result<(), Failed> {
    const RINGS: usize = 6;
    const CELLS: usize = 9 * RINGS;
    let solid = Solid::Sphere(1.5, DVec3::ZERO);
    let disk = disk(&solid, Profile::new(Vec3::ONE, DISTANCES));
    let published = Disk { support: Support::Published, ..disk };
    let (mut forth, mut back) = ([0_u64; CELLS], [0_u64; CELLS]);
    let (mut expected, mut wrong) = ([0.0_f64; CELLS], [0.0_f64; CELLS]);
    for index in 0..400_000 {
        let mut random = SplitMix::new(11 << 41 | index);
        let drawn = DiskNumbers::new(numbers(&mut random), &disk.profile);
        for point in solid.hits(&disk.segment(&drawn)) {
            let far = point.position.distance_of(disk.centre);
            let ring = ((far / 3.0 * RINGS as f64) as usize).min(RINGS - 1);
            let cell = |numbers: &DiskNumbers| ring * 9 + (3 * numbers.axis + numbers.channel) as usize;
            forth[cell(&drawn)] += 1;
            back[cell(&disk.invert(point.position, point.normal, random.unit() as f32).0)] += 1;
            for (disk, sums) in [(&disk, &mut expected), (&published, &mut wrong)] {
                let shares = techniques(disk, point.position, point.normal);
                let all: f64 = shares.iter().flatten().sum();
                shares.iter().flatten().enumerate().for_each(|(at, share)| sums[ring * 9 + at] += share / all);
            }
        }
    }
    let mut family = Family::new("axes and channels", FAMILY_RATE);
    let table = |counts: [u64; CELLS], sums: [f64; CELLS]| counts.into_iter().zip(sums).collect::<Vec<_>>();
    family.chi_square("of samples", table(forth, expected));
    family.chi_square("of the inverse", table(back, expected));
    println!("{}", family.verdict()?);
    let mut other = Family::new("by published densities", FAMILY_RATE);
    other.chi_square("of the inverse", table(back, wrong));
    ensure(!other.passed(), || "channels that cannot find a point go unnoticed".to_owned())
}
