//! What one form of MIS needs over what the other does, for equal error.

use crate::bootstrap::{Interval, mean};
use restir::technique::restir_di::{DiSettings, VisibilityReuse};

use super::{FORMS, Measured, PROPOSED, Pair, TALBOT};
use crate::bench::error::{Errors, Truth};

const RESAMPLES: u32 = 1000;
/// As many where each takes longer.
pub(super) const FEW_RESAMPLES: u32 = 300;
/// Means of chains whose error is taken are so many: the RMAE of a single frame falls slower than n^-1/2.
const BLOCKS: usize = 8;

/// What is to be compared beside the error.
#[derive(Clone, Copy)]
pub(super) enum Per {
    /// Frames.
    Frame,
    /// Shadow rays that were traced.
    ShadowRay,
    /// Shadow rays as the paper counts them: in each combine as many as inputs, or as many for each.
    CountedRay,
    /// Targets that were evaluated.
    Evaluation,
    /// Seconds.
    Second,
}

impl Per {
    pub(super) const ALL: [(Self, &'static str); 5] = [
        (Self::Frame, "frames"),
        (Self::ShadowRay, "shadow rays"),
        (Self::CountedRay, "shadow rays by the paper's count"),
        (Self::Evaluation, "evaluations"),
        (Self::Second, "time"),
    ];
}

/// Shadow rays a pixel as the paper counts them, but for those of a sample at its own pixel: the initial one, those of
/// the combines of 2 and of k inputs, and the final one unless the selection knows visibility.
pub(super) fn counted_rays(form: usize, settings: &DiSettings) -> f64 {
    let others = [1, settings.neighbours];
    let selects = settings.visibility_reuse == VisibilityReuse::Selection;
    let of_combine = |others: u32| match (settings.knows_visibility(), form) {
        (false, _) => 0,
        (true, TALBOT) => (others + 1) * others,
        (true, _) => others * if selects { 2 } else { 1 },
    };
    let once = u32::from(settings.visibility_reuse >= VisibilityReuse::Candidates) + u32::from(!selects);
    f64::from(once + others.map(of_combine).iter().sum::<u32>())
}

impl Pair {
    /// How many times of what the proposed form takes Talbot's takes for equal RMAE; `None` if the reference is too noisy.
    /// The RMAE is of means of as many chains as make [`BLOCKS`] of them, and taken to fall with n^-1/2 from there.
    pub(super) fn at_equal_rmae(&self, truth: &Truth, per: Per) -> Option<Interval> {
        let block = (self.of[PROPOSED].chains.images.len() / BLOCKS).max(1);
        let rmae = self.errors(truth, block, |errors| errors.rmae_global)?;
        self.ratio(per, block, |times| {
            let [proposed, talbot] = means(&rmae, times);
            (talbot / proposed).powi(2)
        })
    }

    /// The same for equal relMSE, which is that of single frames, without the reference's noise.
    pub(super) fn at_equal_mse(&self, truth: &Truth, per: Per) -> Option<Interval> {
        let squared = self.errors(truth, 1, |errors| errors.rel_mse)?;
        self.ratio(per, 1, |times| {
            let [proposed, talbot] = means(&squared, times).map(|mean| mean - truth.relative_noise);
            talbot / proposed
        })
    }

    /// By how much Talbot's RMAE of a frame is smaller.
    pub(super) fn gain_a_frame(&self, truth: &Truth) -> Option<Interval> {
        let rmae = self.errors(truth, 1, |errors| errors.rmae_global)?;
        let Interval { value, ends: [low, high] } = Interval::of_positive(rmae[0].len(), RESAMPLES, |times| {
            let [proposed, talbot] = means(&rmae, times);
            talbot / proposed
        });
        Some(Interval { value: 1.0 - value, ends: [1.0 - high, 1.0 - low] })
    }

    /// How much better Talbot's form is, a frame, in squared error.
    pub(super) fn gap(&self, truth: &Truth) -> Option<Interval> {
        let squared = self.errors(truth, 1, |errors| errors.rel_mse)?;
        Some(Interval::of_positive(squared[0].len(), FEW_RESAMPLES, |times| {
            let [proposed, talbot] = means(&squared, times).map(|mean| mean - truth.relative_noise);
            proposed / talbot
        }))
    }

    /// Of means of `block` chains by both forms, if the reference can judge them.
    fn errors(&self, truth: &Truth, block: usize, of: fn(&Errors) -> f64) -> Option<[Vec<f64>; FORMS.len()]> {
        let errors = self.of.each_ref().map(|measured| measured.chains.errors(truth, block));
        let judged = errors.iter().all(|errors| judged(errors, truth));
        judged.then(|| errors.map(|errors| errors.iter().map(of).collect()))
    }

    fn ratio(&self, per: Per, block: usize, error: impl Fn(&[f64]) -> f64) -> Option<Interval> {
        let [proposed, talbot] = &self.of;
        let cost = match per {
            // time goes by chains, below
            Per::Frame | Per::Second => 1.0,
            Per::ShadowRay => talbot.cost.shadow_rays / proposed.cost.shadow_rays,
            Per::CountedRay => {
                let [proposed, talbot] = [PROPOSED, TALBOT].map(|form| counted_rays(form, &self.setting.settings));
                talbot / proposed
            }
            Per::Evaluation => talbot.cost.evaluations / proposed.cost.evaluations,
        };
        let seconds = matches!(per, Per::Second).then(|| slowdowns(proposed, talbot, block));
        let slower = |times: &[f64]| seconds.as_ref().map_or(1.0, |seconds| weighted_median(seconds, times));
        let blocks = proposed.chains.images.len() / block;
        let interval = Interval::of_positive(blocks, RESAMPLES, |times| error(times) * cost * slower(times));
        interval.value.is_finite().then_some(interval)
    }
}

/// By form.
fn means(errors: &[Vec<f64>; FORMS.len()], times: &[f64]) -> [f64; FORMS.len()] {
    errors.each_ref().map(|errors| mean(errors, times))
}

/// Whether the reference's noise has a small share in the errors.
pub(super) fn judged(errors: &[Errors], truth: &Truth) -> bool {
    truth.rel_mse(Errors::mean(errors.iter().copied()).rel_mse).is_pure()
}

/// The time of Talbot's frames over that of the proposed form's, chains side by side; the median of each block.
fn slowdowns(proposed: &Measured, talbot: &Measured, block: usize) -> Vec<f64> {
    let pairs = proposed.chains.seconds.iter().zip(&talbot.chains.seconds);
    let ratios: Vec<f64> = pairs.map(|(proposed, talbot)| talbot / proposed).collect();
    ratios.chunks_exact(block).map(crate::bench::fit::median).collect()
}

/// The median of `values` that count `times` each.
fn weighted_median(values: &[f64], times: &[f64]) -> f64 {
    let mut sorted: Vec<(f64, f64)> = values.iter().copied().zip(times.iter().copied()).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * times.iter().sum::<f64>();
    let mut below = 0.0;
    let reached = sorted.iter().find(|(_, times)| {
        below += times;
        below >= half
    });
    reached.map_or(f64::NAN, |(value, _)| *value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_as_the_paper_counts_them() {
        // one combine of two and one of five; none in MIS; in the selection as well; one of six
        let counted = super::super::settings(48)
            .map(|setting| [PROPOSED, TALBOT].map(|form| counted_rays(form, &setting.settings)));
        assert_eq!(counted, [[7.0, 24.0], [1.0, 1.0], [11.0, 23.0], [8.0, 34.0]]);
    }

    #[test]
    fn a_median_counts_its_values_as_often_as_it_is_told() {
        assert_eq!(weighted_median(&[3.0, 1.0, 2.0], &[1.0; 3]), 2.0);
        assert_eq!(weighted_median(&[3.0, 1.0, 2.0], &[5.0, 1.0, 1.0]), 3.0);
        assert_eq!(weighted_median(&[3.0, 1.0], &[0.0, 2.0]), 1.0);
    }
}
