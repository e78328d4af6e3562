//! How many rays the passes ask for at most, for who traces them elsewhere ([`Deferred`](crate::scene::Deferred)).

use super::{DiParams, Flags};
use crate::layout::FEATURE_CLEAR;
use crate::transport::MAX_STRETCHES;

impl DiParams {
    /// Of one question whether light arrives, in a scene of these features: a way through glass has a ray for each stretch.
    fn rays_of_way(&self, features: u32) -> u32 {
        let through_glass = self.flags.contains(Flags::TRANSMITTANCE) && features & FEATURE_CLEAR != 0;
        if through_glass { MAX_STRETCHES } else { 1 }
    }

    /// Of [`super::initial`]: one for each group of candidates, and one for the candidate from scattering, which blended surfaces may have
    /// tested once more.
    #[doc(hidden)]
    pub fn most_rays_of_initial(&self, features: u32) -> u32 {
        let drawn = self.candidates * (1 + self.gloss_renewal as u32);
        let of_group = if self.group == 0 { self.candidates } else { self.group };
        (drawn.div_ceil(of_group.max(1)) + 2) * self.rays_of_way(features)
    }

    /// Of [`super::combine`]: for the samples of all inputs at the pixel that combines, and for its own at each of the others; for each sample at
    /// every pixel, if the form asks for that. What a pixel knows of its own sample is not enough where light comes through glass.
    #[doc(hidden)]
    pub fn most_rays_of_combine(&self, features: u32) -> u32 {
        let others = self.neighbours + u32::from(self.flags.contains(Flags::OTHER_FRAME));
        let inputs = others + 1;
        let of_way = self.rays_of_way(features);
        let forgotten = u32::from(of_way > 1);
        let third = self.flags.form().asks_for_third();
        of_way * if third { (inputs + 1) * inputs } else { inputs + others * (1 + forgotten) }
    }

    /// Of [`super::shade`] and [`super::offer`].
    #[doc(hidden)]
    pub fn most_rays_of_shade(&self, features: u32) -> u32 {
        self.rays_of_way(features)
    }

    /// Of [`super::exchange`].
    #[doc(hidden)]
    pub fn most_rays_of_exchange(&self, features: u32) -> u32 {
        self.neighbours * self.rays_of_way(features)
    }
}
