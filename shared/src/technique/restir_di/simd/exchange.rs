//! Shading with neighbours by SIMD.

use super::super::domain::Light;
use super::super::shade::{Points, uses};
use super::super::{DiPairs, DiParams, DiPoint, PackedHit};
use super::Looking;
use super::evaluated::{Asked, Evaluated, Known, Waiting};
use crate::lanes::{LANES, SimdToken};
use crate::layout::FilmPixel;
use crate::resample::exchange::{Alike, NEIGHBOURS, evaluated, receive_from};
use crate::scene::{SceneView, Still};

/// What [`exchange`](super::super::exchange()) finds for the pixels of a row from (x, y) on, in whose order the `hits`, `pairs` and pixels of the `film` are.
#[inline(always)]
pub fn exchange_row<const COMPILED: u32>(
    scene: &SceneView<'_, COMPILED>,
    params: &DiParams,
    points: &[DiPoint],
    (hits, [x, y]): (&[PackedHit], [u32; 2]),
    (pairs, film): (&mut [DiPairs], &mut [FilmPixel]),
    token: impl SimdToken,
) {
    let light = Light { frames: Still(*scene), flags: params.flags.in_use(scene) };
    let (points, neighbours, uses) = (Points::new(params, points), params.shading_neighbours(), uses(&light));
    let mut waiting = Waiting::new(scene, params.view(), light.flags, token);
    let mut found = [Evaluated::NONE; LANES * NEIGHBOURS];
    let mut first = x;
    let parts = hits.chunks(LANES).zip(pairs.chunks_mut(LANES).zip(film.chunks_mut(LANES)));
    for (hits, (pairs, film)) in parts {
        let mut alike = [Alike::NONE; LANES];
        let mut ends = [0; LANES];
        let (domain, mut count) = (Known::new(light, &[]), 0);
        for (lane, hit) in hits.iter().map(|hit| hit.unpack()).enumerate() {
            if hit.is_hit() {
                let at = [first.wrapping_add(lane as u32), y];
                alike[lane] = neighbours.alike(&points, at);
                evaluated(&domain, &points, &neighbours, &alike[lane], uses, at, |sample, traced| {
                    waiting.add(Looking { x: at[0], y, hit }, Asked { sample, traced }, count, &mut found);
                    count += 1;
                });
            }
            ends[lane] = count;
        }
        waiting.finish(&mut found);
        let mut begin = 0;
        for (lane, (pairs, pixel)) in pairs.iter_mut().zip(film).enumerate() {
            let known = Known::new(light, &found[begin..ends[lane]]);
            let at = [first.wrapping_add(lane as u32), y];
            let (targets, sent) = receive_from(&known, &points, &neighbours, &alike[lane], uses, &(), at);
            debug_assert!(known.is_done(), "less is asked for than was listed");
            (*pairs, *pixel) = (targets, FilmPixel { sum: sent.to_array(), dropped: 0.0 });
            begin = ends[lane];
        }
        first = first.wrapping_add(LANES as u32);
    }
}
