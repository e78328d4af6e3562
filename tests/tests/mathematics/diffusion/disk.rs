//! Samples of a profile's points: sums over solids, densities and their bounds.

use super::exact;
use super::solids::{Mode, Part, Solid, disk, estimate, numbers};
use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_shared::diffusion::{Disk, DiskNumbers, Profile, REACH, Support, radial_profile};
use restir_shared::geometry::{Crossings, Hit, Ray};
use restir_shared::glam::{DVec3, Vec3};
use restir_shared::scene::{Probe, Surface, Trace};
use restir_tests::meshes::{buffers, cube, scaled};
use restir_tests::random::SplitMix;
use restir_tests::stats::{FAMILY_RATE, Family, Moments, ZTest, moments};
use restir_tests::suite::ensure;

const SAMPLES: u64 = 1 << 18;
/// Distances of three channels that need each other's samples.
const DISTANCES: Vec3 = Vec3::new(1.0, 0.2, 0.1);

fn estimates(solid: Solid, disk: &Disk, part: Part, mode: Mode, samples: u64) -> Vec<Moments> {
    moments(samples, 1 << 12, 3, |index| estimate(&solid, disk, part, mode, &mut SplitMix::new(2 << 41 | index)))
}

pub(crate) fn planes_spheres_and_slabs() -> Result<(), Failed> {
    let sphere = |radius| (Solid::Sphere(radius, DVec3::ZERO), Part::All);
    let slab = |depth| (Solid::Slab(depth), Part::Far);
    let cases = [(Solid::Plane, Part::All), sphere(1.0), sphere(0.2), slab(0.5), slab(1.0), slab(2.0), slab(4.0)];
    let mut family = Family::new("profiles over solids", FAMILY_RATE);
    for (solid, part) in cases {
        for choice in [Profile::new, Profile::by_albedo] {
            let profile = choice(Vec3::new(1.0, 0.5, 0.25), DISTANCES);
            for mode in [Mode::All, Mode::One] {
                let found = estimates(solid, &disk(&solid, profile), part, mode, SAMPLES);
                for channel in 0..3 {
                    let expected = solid.expected(DISTANCES[channel].into(), part) * f64::from(profile.albedo[channel]);
                    // beyond its reach a channel is nothing, exactly
                    if expected == 0.0 {
                        ensure(found[channel].mean() == 0.0, || format!("{solid:?}, channel {channel}"))?;
                    } else {
                        let name = format!("{solid:?}, {mode:?}, channel {channel}");
                        family.z_test(name, ZTest::new(found[channel], Moments::exact(expected)));
                    }
                }
            }
        }
    }
    println!("{}", family.verdict()?);
    // the numbers that are known of spheres
    for (radius, d, value) in [(1.0, 1.0, 0.5811), (1.0, 0.2, 0.9732), (1.0, 0.1, 0.9990), (0.2, 1.0, 0.1760)] {
        // to its printed digits, and what is cut off
        let found = Solid::Sphere(radius, DVec3::ZERO).expected(d, Part::All);
        ensure((found - value).abs() < 1.1e-4, || format!("radius {radius}, d {d}: {found}, not {value}"))?;
    }
    // of a plane, the axes in it find nothing
    let on_plane = disk(&Solid::Plane, Profile::new(Vec3::ONE, DISTANCES));
    let found = (0..SAMPLES).filter(|&index| {
        let drawn = DiskNumbers::new(numbers(&mut SplitMix::new(3 << 41 | index)), &on_plane.profile);
        !Solid::Plane.hits(&on_plane.segment(&drawn)).is_empty()
    });
    let share = found.count() as f64 / SAMPLES as f64;
    ensure((share - 0.5).abs() < 4.2 * (0.25 / SAMPLES as f64).sqrt(), || {
        format!("{share} of the segments hit a plane")
    })
}

/// What published densities leave of the light that a slab transmits, by the ratio of what samples there are to what they are taken for.
pub(crate) fn published_supports_lose_light() -> Result<(), Failed> {
    let tables = [
        (DISTANCES, [0.9975, 0.9958, 0.9602, 0.9612, 0.9034, 0.9308]),
        (Vec3::new(1.0, 0.1, 0.02), [0.989, 0.992, 0.941, 0.960, 0.970, 0.980]),
    ];
    for (distances, table) in tables {
        for (depth, value) in [0.5_f32, 1.0, 2.0, 3.0, 4.0, 6.0].into_iter().zip(table) {
            let exact_disk = Disk::new(Vec3::ZERO, Vec3::Z, Profile::new(Vec3::ONE, distances));
            let published_disk = Disk { support: Support::Published, ..exact_disk };
            let side = f64::from(REACH * REACH - depth * depth).sqrt();
            let at = |rho: f64| Vec3::new(rho as f32, 0.0, -depth);
            let profile = |rho: f64| f64::from(exact_disk.profile.at(at(rho).as_dvec3().length() as f32).x);
            let ratio = |rho: f64| {
                let [real, taken] = [exact_disk, published_disk].map(|disk| f64::from(disk.density(at(rho), Vec3::Z)));
                real / taken
            };
            let left = exact::ring(0.0, side, |rho| profile(rho) * ratio(rho)) / exact::ring(0.0, side, profile);
            let printed = if table[0] == 0.9975 { 1.5e-4 } else { 1.2e-3 };
            ensure((left - value).abs() < printed, || format!("{distances}, depth {depth}: {left:.4}, not {value}"))?;
        }
    }
    // and by samples: the exact support is right where the published one loses a tenth
    let slab = Solid::Slab(4.0);
    let right = disk(&slab, Profile::new(Vec3::ONE, DISTANCES));
    let wrong = Disk { support: Support::Published, ..right };
    let expected = slab.expected(1.0, Part::Far);
    let relative = |disk: &Disk, samples: u64| {
        let found = estimates(slab, disk, Part::Far, Mode::All, samples)[0];
        (found.mean() / expected, found.standard_error() / expected)
    };
    let ((right, error), (wrong, wrong_error)) = (relative(&right, 1 << 25), relative(&wrong, 1 << 22));
    println!(
        "through a slab of 4 d: {right:.4} +- {error:.4} of what there is, by published densities {wrong:.4} +- {wrong_error:.4}"
    );
    // more than three standard errors, one of a thousand
    ensure((right - 1.0).abs() < 2.0e-3 && 3.3 * error < 2.0e-3, || format!("{right} +- {error}"))?;
    ensure((wrong - 0.9034).abs() < 3.3 * wrong_error + 5.0e-5, || format!("{wrong} +- {wrong_error}"))
}

/// A random direction.
fn direction(random: &mut SplitMix) -> Vec3 {
    let mut one = || random.range(-1.0, 1.0);
    DVec3::new(one(), one(), one()).normalize_or(DVec3::Z).as_vec3()
}

pub(crate) fn weights_are_bounded() -> Result<(), Failed> {
    let (mut worst, mut wide) = (0.0_f32, 0.0_f32);
    for index in 0..300_000 {
        let mut random = SplitMix::new(4 << 41 | index);
        let mut distance = || 10.0_f64.powf(random.range(-4.0, 1.0)) as f32;
        let distances = Vec3::new(distance(), distance(), distance());
        let disk = Disk::new(Vec3::ZERO, direction(&mut random), Profile::new(Vec3::ONE, distances));
        let far = 10.0_f64.powf(random.range(-3.0, 1.3)) as f32 * distances[random.below(3)];
        let (point, normal) = (direction(&mut random) * far, direction(&mut random));
        let (weight, density) = disk.weight(point, normal);
        worst = worst.max(weight.max_element());
        // if all profiles ended where the widest does
        let beyond = (0..3).map(|channel| radial_profile(far, distances[channel])).fold(0.0, f32::max);
        if density > 0.0 {
            wide = wide.max(beyond / density);
        }
    }
    println!("largest weight {worst:.2}; with profiles as far as the widest {wide:.2}");
    // 4 / (1 / 3), less what is cut off
    ensure(worst <= 12.0 && worst > 10.5, || format!("{worst}"))?;
    ensure(wide > 12.5, || "a wider profile goes unnoticed".to_owned())
}

pub(crate) fn variances_of_all_and_one() -> Result<(), Failed> {
    let sphere = Solid::Sphere(1.0, DVec3::ZERO);
    let disk = disk(&sphere, Profile::new(Vec3::ONE, DISTANCES));
    let found = [Mode::All, Mode::One].map(|mode| {
        let found = estimates(sphere, &disk, Part::All, mode, 1 << 21);
        [0, 1, 2].map(|channel: usize| found[channel].variance())
    });
    let known = [[0.80, 0.99, 1.53], [0.85, 1.49, 2.36]];
    println!("variances {found:.3?}");
    for (found, known) in found.iter().flatten().zip(known.iter().flatten()) {
        // what is cut off is cut before sampling here, which takes a thousandth; rounding; and two percent of variance by samples
        ensure((found / known - 1.0).abs() < 0.02, || format!("{found}, not {known}"))?;
    }
    Ok(())
}

/// All the way: a box of triangles, its tree, its surface.
pub(crate) fn meshes_are_probed() -> Result<(), Failed> {
    const DEPTH: f64 = 2.0;
    let mut slab = scaled(cube(1.0, 3), 40.0);
    slab.positions.iter_mut().for_each(|at| at[1] *= DEPTH as f32 / 80.0);
    let buffers = buffers(slab);
    let mut family = Family::new("profiles over a box", FAMILY_RATE);
    for view in [buffers.view(), buffers.traced_view()] {
        let down = Ray { origin: Vec3::new(0.3, 9.0, -0.4), direction: Vec3::NEG_Y, t_max: Ray::FAR, key: 0 };
        let hit = view.closest(&down);
        let first = view.surface(&down, &hit);
        let disk = Disk::new(first.position, first.normal, Profile::new(Vec3::ONE, Vec3::splat(1.0)));
        let found = moments(SAMPLES, 1 << 12, 4, |index| {
            let mut random = SplitMix::new(5 << 41 | index);
            let segment = disk.segment(&DiskNumbers::new(numbers(&mut random), &disk.profile));
            let crossings = view.probe(&segment, view.object(&hit));
            let mut sums = [0.0; 4];
            let mut add = |hit: Hit, factor: f64, at: usize| {
                if hit.is_hit() {
                    let point = view.surface(&segment, &hit);
                    let side = usize::from(point.normal.y < 0.0);
                    sums[at + side] += f64::from(disk.weight(point.position, point.normal).0.x) * factor;
                }
            };
            crossings.nearest.into_iter().for_each(|hit| add(hit, 1.0, 0));
            add(one_of(&crossings, random.unit() as f32), crossings.count.into(), 2);
            sums
        });
        let expected = [Solid::Plane.expected(1.0, Part::All), Solid::Slab(DEPTH).expected(1.0, Part::Far)];
        for (found, (name, expected)) in found
            .into_iter()
            .zip(["near", "far", "near, one", "far, one"].into_iter().zip(expected.into_iter().cycle()))
        {
            println!("{name}: {:.4} +- {:.4}, exactly {expected:.4}", found.mean(), found.standard_error());
            family.z_test(name, ZTest::new(found, Moments::exact(expected)));
        }
    }
    println!("{}", family.verdict()?);
    one_of_many_is_fair(&buffers)
}

/// Each of the hits that are listed has its turn.
/// One of the hits, if it is listed.
fn one_of(crossings: &Crossings, u: f32) -> Hit {
    crossings.listed(crossings.one_of(u) as usize)
}

fn one_of_many_is_fair(buffers: &SceneBuffers) -> Result<(), Failed> {
    let view = buffers.view();
    let ray = Ray { origin: Vec3::new(0.3, 9.0, -0.4), direction: Vec3::NEG_Y, t_max: 20.0, key: 0 };
    let crossings = view.probe(&ray, view.object(&view.closest(&ray)));
    let turns = [0.0, 0.499_999, 0.5, 0.999_999_94].map(|u| one_of(&crossings, u).id);
    let [a, b] = [crossings.nearest[0].id, crossings.nearest[1].id];
    ensure(crossings.count == 2 && turns == [a, a, b, b], || format!("{crossings:?}: {turns:?}"))?;
    let missed = [one_of(&Crossings::NONE, 0.5), one_of(&Crossings { count: 16, ..crossings }, 0.6)];
    ensure(missed.iter().all(|hit| !hit.is_hit()), || format!("{missed:?}"))
}

/// The density in double precision.
fn exact_density(disk: &Disk, point: Vec3, normal: Vec3) -> f64 {
    super::inverse::techniques(disk, point, normal).iter().flatten().sum()
}

/// From a hundred thousandth of the scene to a thousand of it, and where there is nothing to divide by.
pub(crate) fn profiles_hold_at_all_scales() -> Result<(), Failed> {
    let sphere = Solid::Sphere(1.0, DVec3::new(0.25, -0.5, 0.125));
    for exponent in -5..=3 {
        let d = 10.0_f64.powi(exponent) as f32;
        let distances = DISTANCES * d;
        let disk = disk(&sphere, Profile::new(Vec3::ONE, distances));
        let mut worst = 0.0_f64;
        for index in 0..20_000 {
            let mut random = SplitMix::new(6 << 41 | index);
            let drawn = DiskNumbers::new(numbers(&mut random), &disk.profile);
            for point in sphere.hits(&disk.segment(&drawn)) {
                let (weight, density) = disk.weight(point.position, point.normal);
                ensure(weight.is_finite() && density.is_finite(), || format!("d {d}: {weight}, {density}"))?;
                let exact = exact_density(&disk, point.position, point.normal);
                if exact > 0.0 {
                    worst = worst.max((f64::from(density) / exact - 1.0).abs());
                }
            }
        }
        let found = estimates(sphere, &disk, Part::All, Mode::All, SAMPLES);
        let shown: Vec<(f64, f64)> = (0..3)
            .map(|channel| {
                let expected = sphere.expected(distances[channel].into(), Part::All);
                (found[channel].mean() / expected - 1.0, found[channel].standard_error() / expected)
            })
            .collect();
        println!("d {d:e}: density off by {worst:.1e}, sums by {shown:.4?}");
        ensure(found.iter().all(|found| found.mean().is_finite()), || format!("d {d}: {shown:?}"))?;
        // half a percent of the light, beside what samples leave; one of 2e4 fails. Beyond, a sample in thousands hits
        ensure(exponent > 1 || shown.iter().all(|(off, error)| off.abs() < 5.0e-3 + 4.2 * error), || {
            format!("d {d}: {shown:?}")
        })?;
        ensure(worst < 2.0e-3, || format!("d {d}: density off by {worst}"))?;
    }
    let nothing = Disk::new(Vec3::ONE, Vec3::Y, Profile::new(Vec3::ONE, Vec3::ZERO));
    for disk in [nothing, Disk::new(Vec3::ONE, Vec3::NEG_Z, Profile::new(Vec3::ONE, DISTANCES))] {
        let at = disk.weight(Vec3::ONE, Vec3::Y);
        let (drawn, density) = disk.invert(Vec3::ONE, Vec3::Y, 0.7);
        let ends = [0.0, 1.0 - 1.0 / 16_777_216.0].map(|radius| disk.segment(&DiskNumbers { radius, ..drawn }));
        let finite = ends.iter().all(|ray| ray.origin.is_finite() && ray.t_max >= 0.0 && ray.direction.is_finite());
        ensure(finite && at.0.is_finite() && at.1 == density && density.is_finite(), || format!("{at:?}, {drawn:?}"))?;
        ensure(drawn.turn == 0.0 && (0.0..1.0).contains(&drawn.radius), || format!("{drawn:?}"))?;
    }
    Ok(())
}
