//! Vectors, frames, luminance, and what the film accepts.

use glam::Vec3;
use libtest_mimic::Failed;
use restir_shared::layout::FilmPixel;
use restir_shared::vec::{Frame, cross, dot, length, luminance, normalize};
use restir_tests::checks;
use restir_tests::random::SplitMix;
use restir_tests::suite::{Trial, ensure};

pub(crate) fn trials() -> Vec<Trial> {
    checks! {
        first {
            frames_are_orthonormal luminance_is_that_of_rec_709 samples_that_are_no_radiance_are_dropped
        }
    }
}

/// Around normals in all directions, poles and axes included: three products of three roundings each.
fn frames_are_orthonormal() -> Result<(), Failed> {
    let mut random = SplitMix::new(1);
    let mut anywhere = || Vec3::from_array([0; 3].map(|_: i32| random.unit() as f32 * 2.0 - 1.0));
    let axes = [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| [axis, -axis]);
    let normals: Vec<Vec3> = axes.chain((0..20_000).map(|_| anywhere())).map(normalize).collect();
    for n in normals {
        let Frame { s, t, .. } = Frame::new(n);
        let products = [dot(s, s) - 1.0, dot(t, t) - 1.0, dot(s, t), dot(s, n), dot(t, n)];
        let turned = length(cross(s, t) - n);
        let largest = products.iter().fold(turned, |largest, x| largest.max(x.abs()));
        ensure(largest < 2.0e-6, || format!("around {n}: {s} and {t} are off by {largest:e}"))?;
    }
    Ok(())
}

fn luminance_is_that_of_rec_709() -> Result<(), Failed> {
    let of_channels = [Vec3::X, Vec3::Y, Vec3::Z].map(luminance);
    ensure(of_channels == [0.2126, 0.7152, 0.0722], || format!("{of_channels:?}"))
}

/// In any of the channels.
fn samples_that_are_no_radiance_are_dropped() -> Result<(), Failed> {
    for channel in 0..3 {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1.267_650_6e30, f32::MAX] {
            let mut radiance = [1.0; 3];
            radiance[channel] = value;
            let FilmPixel { sum, dropped } = FilmPixel::from_radiance(Vec3::from_array(radiance));
            ensure((sum, dropped) == ([0.0; 3], 1.0), || format!("{radiance:?} gives {sum:?}, {dropped} dropped"))?;
        }
    }
    let kept = FilmPixel::from_radiance(Vec3::new(1.0e30, 1.0e-30, 0.0));
    ensure(kept.sum == [1.0e30, 1.0e-30, 0.0] && kept.dropped == 0.0, || format!("{kept:?}"))
}
