//! Which neighbours the passes of shading have.

use super::DiSettings;
use restir_shared::technique::restir_di::{DiParams, PAIRS, pair_offsets};

impl DiSettings {
    /// Passes of shading a frame.
    #[doc(hidden)]
    pub fn shading_passes(&self) -> u32 {
        self.shaded.div_ceil(2 * PAIRS as u32).max(1)
    }

    /// The parameters of a frame's passes of shading, from those of its other passes: the pairs of neighbours are dealt out
    /// evenly. Where the disk has fewer than are asked for, they come again, in other passes.
    #[doc(hidden)]
    pub fn shading(&self, frame: &DiParams) -> Vec<DiParams> {
        let mut offsets = vec![0; self.shaded as usize / 2];
        let count = pair_offsets(frame.seed, frame.frame, self.shading_radius, &mut offsets);
        let passes = self.shading_passes() as usize;
        let of_pass = |pass: usize| {
            let [first, end] = [pass, pass + 1].map(|pass| pass * offsets.len() / passes);
            let dealt: Vec<u32> = (first..end).take(count).map(|n| offsets[n % count]).collect();
            frame.with_pairs(&dealt, pass as u32)
        };
        (0..passes).map(of_pass).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use restir_shared::resample::params::ReuseParams;
    use std::collections::BTreeSet;

    fn offsets(passes: &[DiParams]) -> Vec<[i16; 2]> {
        let of_pass = |p: &DiParams| p.pairs[..p.neighbours as usize / 2].to_vec();
        passes.iter().flat_map(of_pass).map(|packed| [packed as i16, (packed >> 16) as i16]).collect()
    }

    #[test]
    fn passes_share_all_pairs_and_have_none_twice() {
        // a disk of radius 1 has 4 pairs
        for (shaded, shading_radius, expected, each) in [
            (0, 6.0, 0, 0),
            (2, 6.0, 1, 1),
            (8, 6.0, 4, 1),
            (20, 6.0, 10, 1),
            (128, 16.0, 64, 1),
            (128, 1.0, 4, 16),
            (8, 0.0, 0, 0),
        ] {
            let settings = DiSettings { shaded, shading_radius, ..DiSettings::default() };
            for frame in 0..20 {
                let passes = settings.shading(&DiParams {
                    reuse: ReuseParams { frame, seed: 3, ..ReuseParams::default() },
                    ..DiParams::default()
                });
                assert_eq!(passes.len(), settings.shading_passes() as usize);
                assert!((0..).zip(&passes).all(|(pass, p)| p.shading_pass == pass));
                let differing = |p: &DiParams| offsets(&[*p]).iter().collect::<BTreeSet<_>>().len();
                assert!(passes.iter().all(|p| differing(p) == p.neighbours as usize / 2));
                let dealt = offsets(&passes);
                let all: BTreeSet<[i16; 2]> = dealt.iter().copied().collect();
                assert!(all.iter().all(|at| dealt.iter().filter(|other| *other == at).count() == each), "{dealt:?}");
                let either: BTreeSet<[i16; 2]> = all.iter().flat_map(|&[x, y]| [[x, y], [-x, -y]]).collect();
                assert_eq!(either.len(), 2 * all.len(), "{all:?}");
                assert_eq!(all.len(), expected, "{shaded} in {shading_radius}: {all:?}");
                // rounding adds at most half a diagonal
                let reach = shading_radius + 0.708;
                let within = |at: &[i16; 2]| at.map(f32::from).iter().map(|x| x * x).sum::<f32>() <= reach * reach;
                assert!(all.iter().all(within), "{all:?}");
            }
        }
    }
}
