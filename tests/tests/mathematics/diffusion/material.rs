//! From media to profiles.

use super::exact;
use libtest_mimic::Failed;
use restir_shared::diffusion::{ALBEDO_SLOPE, Profile, Shape, diffuse_albedo, disney_transmission};
use restir_shared::glam::Vec3;
use restir_shared::medium::Medium;
use restir_shared::num;
use restir_tests::suite::ensure;

const SHAPES: [Shape; 3] = [Shape::Searchlight, Shape::Diffuse, Shape::SurfaceLength];

pub(crate) fn shape_factors_are_the_published_ones() -> Result<(), Failed> {
    let albedos = [0.0, 0.2, 0.33, 0.5, 0.8, 1.0];
    let tables = [
        [5.434, 3.162, 2.247, 1.539, 1.05, 0.906],
        [4.14, 2.96, 2.343, 1.715, 1.10, 1.04],
        [4.686, 3.529, 3.5, 3.584, 8.380, 23.651],
    ];
    for (shape, table) in SHAPES.into_iter().zip(tables) {
        for (albedo, value) in albedos.into_iter().zip(table) {
            let found = shape.factor(albedo);
            ensure((found - value).abs() < 6.0e-4, || format!("{shape:?}({albedo}) = {found}, not {value}"))?;
        }
        let black = [shape.factor(0.0), shape.of_black()];
        ensure((black[0] / black[1] - 1.0).abs() < 3.0e-7, || format!("{shape:?}: {black:?}"))?;
    }
    // the least of the diffuse one
    let least = (0..=1000).map(|i| Shape::Diffuse.factor(i as f32 * 1.0e-3)).fold(f32::MAX, f32::min);
    ensure((least - 1.0286).abs() < 1.0e-4, || format!("least {least}"))
}

/// Colours to albedos (Kulla and Conty 2017), and back to the colours that the fit gives.
pub(crate) fn half_spaces_have_their_colour() -> Result<(), Failed> {
    let table = [
        (0.01, 0.048_927),
        (0.1, 0.384_240),
        (0.2, 0.613_357),
        (0.3, 0.757_527),
        (0.5, 0.911_709),
        (0.7, 0.976_001),
        (0.8, 0.990_589),
        (0.9, 0.997_907),
        (0.95, 0.999_505),
        (0.99, 0.999_981),
    ];
    let of = |color: f32, g: f32| Medium::of_color(Vec3::splat(color), Vec3::ONE, g);
    for (color, albedo) in table {
        let found = of(color, 0.0).albedo.x;
        // the printed root has its constants rounded
        ensure((found - albedo).abs() < 2.0e-5, || format!("colour {color}: albedo {found}, not {albedo}"))?;
    }
    let mut worst = 0.0_f32;
    for (color, reflected) in [(0.1, 0.0970), (0.5, 0.4808), (0.8, 0.7847), (0.95, 0.9451)] {
        for g in [0.0, 0.5, 0.8, -0.3] {
            let Medium { albedo, absorbed, .. } = of(color, g);
            worst = worst.max((diffuse_albedo(albedo.x, absorbed.x, g) - reflected).abs());
        }
    }
    println!("diffuse albedos of colours off by {worst:.1e}");
    ensure(worst < 1.0e-4, || format!("{worst}"))
}

/// Of walks: with an interface that never reflects totally, and without one; and that the fit is not of a dielectric's.
pub(crate) fn diffuse_albedos_are_those_of_half_spaces() -> Result<(), Failed> {
    let table = [
        (0.5, 0.1395, 0.1350, 0.0654),
        (0.9, 0.4585, 0.4582, 0.2898),
        (0.95, 0.5762, 0.5784, 0.4040),
        (0.98, 0.7039, 0.7079, 0.5509),
    ];
    for (albedo, fit, walks, dielectric) in table {
        let found = diffuse_albedo(albedo, 1.0 - albedo, 0.0);
        ensure((found - fit).abs() < 6.0e-5, || format!("albedo {albedo}: {found}, not {fit}"))?;
        let limit = if albedo < 0.9 { 0.04 } else { 0.0065 };
        ensure((found / walks - 1.0).abs() < limit, || format!("albedo {albedo}: {found}, by walks {walks}"))?;
        ensure((found / dielectric - 1.0).abs() > 0.2, || format!("albedo {albedo}: that of a dielectric"))?;
    }
    let (mut worst, mut naive) = (0.0_f64, 0.0_f64);
    for i in 0..=60 {
        // black to white, by what is scattered, and then by what is absorbed
        let part = 10.0_f64.powf(-f64::from(i) / 6.0);
        for (albedo, absorbed) in [(part, 1.0 - part), (1.0 - part, part)] {
            let exact = exact::albedo(absorbed.sqrt());
            if exact > 0.0 {
                let relative = |found: f32| (f64::from(found) / exact - 1.0).abs();
                worst = worst.max(relative(diffuse_albedo(albedo as f32, absorbed as f32, 0.0)));
                let q = num::sqrt(num::max(1.0 - albedo as f32, 0.0));
                naive = naive.max(relative((1.0 - q) / (1.0 + 1.554 * q)));
            }
        }
    }
    println!("diffuse albedo off by {worst:.1e}; of the difference by {naive:.1e}");
    ensure(worst < 5.0e-7 && naive > 1.0e-2, || format!("{worst:e}, {naive:e}"))?;
    let slope = f64::from(diffuse_albedo(1.0e-6, 1.0, 0.0)) * 1.0e6;
    ensure((slope / exact::SLOPE - 1.0).abs() < 1.0e-5 && f64::from(ALBEDO_SLOPE) - exact::SLOPE < 1.0e-8, || {
        format!("slope {slope}")
    })
}

/// Channel by channel, and nothing but numbers come out of profiles without a distance.
pub(crate) fn narrow_channels_are_lambertian() -> Result<(), Failed> {
    let medium = Medium::of_color(Vec3::new(0.9, 0.5, 0.2), Vec3::new(1.0, 1.0e-3, 1.0e-7), 0.0);
    let whole = Profile::of_medium(&medium, Shape::Diffuse);
    let wide = whole.of_channels(Vec3::new(1.0, 1.0, 0.0));
    ensure(
        wide.distance.z == 0.0
            && wide.distance.x == whole.distance.x
            && wide.at(1.0e-3).z == 0.0
            && wide.at(0.0).is_finite(),
        || format!("{wide:?}"),
    )?;
    ensure((wide.probability - Vec3::new(0.5, 0.5, 0.0)).abs().max_element() < 1.0e-6, || format!("{wide:?}"))?;
    let none = whole.of_channels(Vec3::ZERO);
    ensure(none.at(1.0) == Vec3::ZERO && none.probability == Vec3::ZERO, || format!("{none:?}"))?;
    // by albedo, a black channel is never chosen
    let weighted = Profile::by_albedo(Vec3::new(0.6, 0.2, 0.0), Vec3::new(1.0, 2.0, 3.0));
    ensure((weighted.probability - Vec3::new(0.75, 0.25, 0.0)).abs().max_element() < 1.0e-6, || format!("{weighted:?}"))
}

pub(crate) fn interfaces_let_through_what_they_should() -> Result<(), Failed> {
    let found = [1.0, 0.0, 0.5, 1.000_001, -0.2].map(disney_transmission);
    ensure(found == [1.0, 0.5, 1.0 - 0.5 / 32.0, 1.0, 0.5], || format!("{found:?}"))
}
